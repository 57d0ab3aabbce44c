"""Imperial numbers in design files: the key says the unit, and nothing is taken in another one."""

import functools
import subprocess
import sys

import jax
import numpy as np
import pytest
from design_texts import loaded

from jaxgear.io import DesignFileError

GEARS = """
[pinion]
diametral_pitch = 8.0
teeth = 20
face_width_in = 1.5
tip_diameter_in = 2.75
[[pinion.modification]]
type = "tip_relief"
amount_in = 0.0005
length_in = 0.125
[wheel]
normal_diametral_pitch = 8
teeth = 40
face_width_in = 1.25
material = { elastic_modulus_ksi = 30000.0, poisson_ratio = 0.3 }
[pair]
center_distance_in = 3.75
[load]
torque_lbf_in = 450.0
torque_range_lbf_ft = [10.0, 50.0]
"""
METRIC = """
[pinion]
module = 3.175
teeth = 20
face_width = 38.1
tip_diameter = 69.85
[[pinion.modification]]
type = "tip_relief"
amount = 12.7
length = 3.175
[wheel]
module = 3.175
teeth = 40
face_width = 31.75
material = { elastic_modulus = 206842.718795, poisson_ratio = 0.3 }
[pair]
center_distance = 95.25
[load]
torque = 50.84317
torque_range = [13.5581794833, 67.7908974166]
"""


@pytest.fixture
def load(tmp_path):
    return functools.partial(loaded, tmp_path)


def test_imperial_numbers_are_the_metric_ones(load):
    """1 in = 25.4 mm, 1 lbf = 4.4482216 N, module = 25.4 mm / P, by hand."""
    imperial, metric = load(GEARS), load(METRIC)
    assert imperial.torque == pytest.approx(metric.torque, rel=1e-6)
    assert imperial.torque_range == pytest.approx(metric.torque_range, rel=1e-10)
    first, second = (jax.tree.leaves((file.pair(), file.design({}))) for file in (imperial, metric))
    np.testing.assert_allclose(np.array(first, float), np.array(second, float), rtol=1e-11)
    assert float(imperial.pair().pinion.module) == 3.175 and float(imperial.pair().pinion.face_width) == 38.1


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("face_width_in = 1.5", "face_width_in = 1.5\nface_width = 38.1", "face_width_in: has no effect beside face_w"),
        ("face_width_in = 1.5", "face_widht_in = 1.5", 'face_widht_in: unknown key, did you mean "face_width_in"?'),
        (
            "face_width_in = 1.5",
            'face_width_in = "b"',
            "face_width_in: must be a number: variables and tables are in mm",
        ),
        ("face_width_in = 1.5", "face_width_in = -1.5", "pinion.face_width_in: -38.1 mm must be greater than 0 mm"),
        ("diametral_pitch = 8.0", "diametral_pitch = 0.0", "diametral_pitch: 0 teeth per inch must be greater than 0"),
        (
            "diametral_pitch = 8.0",
            "diametral_pitch = 8.0\nhelix_angle = 15.0",
            "give normal_diametral_pitch, which is it",
        ),
        ("teeth = 40", "teeth = 40\naddendum_in = 0.125", "wheel.addendum_in: unknown key"),
        ("torque_lbf_in", "torque_lbf", "load.torque_lbf: unknown key"),
    ],
)
def test_nothing_is_taken_in_another_unit(load, old, new, problem):
    assert old in GEARS
    with pytest.raises(DesignFileError) as caught:
        load(GEARS.replace(old, new, 1))
    assert problem in str(caught.value)


@pytest.mark.slow
def test_a_helical_gear_has_a_normal_pitch(load):
    text = GEARS.replace("[pinion]\ndiametral", "[pinion]\nhelix_angle = 15.0\nnormal_diametral")
    text = text.replace("center_distance_in = 3.75", "center_distance_in = 3.9")
    assert float(load(text).pair().wheel.module) == 3.175


@pytest.mark.slow
def test_a_command_in_a_fresh_process_takes_them(tmp_path):
    """Whatever it looks at before the library is imported: the value is refused, not the key."""
    path = tmp_path / "gear.toml"
    path.write_text(GEARS.replace("face_width_in = 1.5", "face_width_in = -1.5"))
    done = subprocess.run(
        [sys.executable, "-m", "jaxgear", "analyze", path], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2 and "pinion.face_width_in: -38.1 mm must be greater than 0 mm" in done.stderr
