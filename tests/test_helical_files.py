"""Helical pairs in files: design files with both hands, slices and variables; REXS; commands."""

import jax
import numpy as np
import pytest
from design_texts import loaded, text

import jaxgear as jg
from jaxgear.io import DesignFileError, write_design

ANGLE = "helix_angle = 15.0"
OPEN = 'helix_angle = "beta"'
VARIABLE = "[variables]\nbeta = {{ low = {low}, high = {high}, unit = 'deg' }}\n"


@pytest.fixture
def load(tmp_path):
    return lambda **given: loaded(tmp_path, text(**given))


def test_one_gear_says_the_angle_of_both(load):
    for given, right in (
        ({"pinion": ANGLE}, 15.0),
        ({"wheel": ANGLE}, -15.0),
        ({"pinion": ANGLE, "wheel": "helix_angle = -15.0"}, 15.0),
    ):
        pinion, wheel = load(**given).pair().gears
        assert float(pinion.helix_angle) == right == -float(wheel.helix_angle)
    assert load(pinion="helix_angle = 0.0").pair().is_spur and load().pair().is_spur


def test_the_angle_is_a_variable_of_both_gears(load):
    design = load(pinion=OPEN, tail=VARIABLE.format(low=5.0, high=25.0))
    assert design.bounds == {"beta": (5.0, 25.0)} and design.units == {"beta": "deg"}
    found = design.pair({"beta": 11.0})
    assert float(found.pinion.helix_angle) == 11.0 == -float(found.wheel.helix_angle)
    overlap = jax.jacfwd(lambda beta: design.pair({"beta": beta}).overlap_ratio)(11.0)
    assert float(overlap) == pytest.approx(18.0 / (3.0 * np.pi) * np.cos(np.deg2rad(11.0)) * np.pi / 180, rel=1e-12)


REFUSED = {
    "one slice": (
        {"pinion": ANGLE, "tail": "[resolution]\nslices = 1"},
        r"resolution.slices: must be at least 2, 1 cannot show helical gears, .* \(11 where the key is left out\)$",
    ),
    "one hand": (
        {"pinion": ANGLE, "wheel": ANGLE},
        "wheel.helix_angle: 15 deg must be -15 deg: gears on parallel shafts",
    ),
    "two variables": (
        {"pinion": OPEN, "wheel": OPEN, "tail": VARIABLE.format(low=0.0, high=20.0)},
        "wheel.helix_angle: has no effect, pinion.helix_angle is a variable and that of the wheel is its opposite",
    ),
    "range": ({"wheel": "helix_angle = 50.0"}, "wheel.helix_angle: 50 deg must be at least -45 deg and at most 45 deg"),
    "bounds": (
        {"wheel": OPEN, "tail": VARIABLE.format(low=0.0, high=50.0)},
        "variables.beta.high: 50 deg must be at least -45 deg and at most 45 deg as wheel.helix_angle",
    ),
    "finite elements": (
        {"pinion": ANGLE, "tail": "[model]\nstructure = 'finite_element'"},
        "model: .*helix_angle = 15 deg, must be 0 deg",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_a_helical_file_cannot_say(load, case):
    given, expected = REFUSED[case]
    with pytest.raises(DesignFileError, match=expected) as refused:
        load(**given)
    assert len(str(refused.value).splitlines()) == 1


def test_a_helical_pair_is_written_and_read(load, tmp_path):
    pair = load(pinion=ANGLE, wheel="over_balls = 156.5\nball_diameter = 5.25").pair()
    path = tmp_path / "written.toml"
    write_design(path, pair, torque=50.0, pinion=jg.NoModification(), wheel=jg.NoModification())
    again = loaded(tmp_path, path.read_text()).pair()
    assert jax.tree.all(jax.tree.map(lambda a, b: bool(a == b), pair, again))
