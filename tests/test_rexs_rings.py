"""REXS files of ring gears: numbers, tool and flanks come back; what other programs leave open is completed."""

import dataclasses
from functools import partial

import jax
import numpy as np
import pytest
import rexs_schema

import jaxgear as jg
from jaxgear.geometry.rim_support import ElasticFoundation
from jaxgear.io import load_design, write_design
from jaxgear.rexs import read_rexs, write_rexs
from jaxgear.rexs.convert import convert
from jaxgear.rexs.frame import frames

BOTH = {"module": 3.0, "face_width": 20.0}
PLANET = jg.Gear(19, bore_diameter=24.0, tip_diameter=63.0, tip_edge_radius=0.1, **BOTH)
RING = jg.RingGear(
    64,
    profile_shift=-0.1,
    cutter_teeth=25,
    cutter_profile_shift=0.1,
    root_radius=0.2,
    rim_diameter=236.4,
    tip_diameter=188.0,
    tip_form_diameter=188.4,
    tip_edge_radius=0.1,
    **BOTH,
)
PAIR = jg.GearPair(PLANET, RING, 67.5)
FLANKS = {"pinion": jg.TipRelief(10.0, 4.0, jg.Linear()), "wheel": jg.TipRelief(8.0, 3.0) + jg.ProfileSlope(2.0)}


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    path = tmp_path_factory.mktemp("rings") / "pair.rexs"
    write_rexs(path, PAIR, **FLANKS, torque=100.0)
    return path


def same(one, two):
    assert jax.tree.structure(one) == jax.tree.structure(two)
    for first, second in zip(jax.tree.leaves(one), jax.tree.leaves(two)):
        np.testing.assert_allclose(first, second, rtol=1e-9, atol=1e-12)


def test_a_ring_pair_comes_back(written):
    assert not rexs_schema.faults(written.read_bytes())
    found = read_rexs(written)
    same(found.pair, PAIR)
    same(found.pinion, FLANKS["pinion"])
    frame = frames(PAIR)[1]
    roll = np.linspace(frame.start, frame.tip, 7)
    amounts = [frame.removed(flank, roll, 0 * roll) for flank in (found.wheel, FLANKS["wheel"])]
    np.testing.assert_allclose(*amounts, atol=1e-9)
    assert amounts[0][-1] > 5 > amounts[0][0]


def test_tables_of_a_ring_come_back(tmp_path):
    """A curve that REXS has no formula for is written as points, from the root inwards to the tip."""
    relief = jg.TipRelief(8.0, 3.0, jg.Power(1.5))
    write_rexs(tmp_path / "points.rexs", PAIR, wheel=relief, error=0.001)
    frame = frames(PAIR)[1]
    roll = np.linspace(frame.start, frame.tip, 40)
    amounts = [frame.removed(flank, roll, 0 * roll) for flank in (read_rexs(tmp_path / "points.rexs").wheel, relief)]
    np.testing.assert_allclose(*amounts, atol=2e-3)


@pytest.mark.parametrize("order", ["gear_1 is the planet", "gear_1 is the ring"])
def test_signs_of_other_programs(written, tmp_path, order):
    """Negative teeth of a cylindrical gear, of either place in the stage, without tool and rim."""
    text = written.read_text().replace('type="ring_gear"', 'type="cylindrical_gear"')
    text = text.replace('id="number_of_teeth" unit="none">64', 'id="number_of_teeth" unit="none">-64')
    for name in ("custom_jaxgear_rim_diameter", "tip_corner_radius_factor_reference_profile"):
        text = text.replace(f'id="{name}"', f'id="custom_{name}"')
    if order == "gear_1 is the ring":
        text = text.replace("gear_1", "gear_0").replace("gear_2", "gear_1").replace("gear_0", "gear_2")
    path = tmp_path / "other.rexs"
    path.write_text(text)
    wheel = read_rexs(path).pair.wheel
    assert isinstance(wheel, jg.RingGear) and float(wheel.teeth) == 64
    assert float(wheel.root_circle_radius) == pytest.approx(float(RING.root_circle_radius), abs=1e-6)
    assert float(wheel.bore_radius) == pytest.approx(float(wheel.root_circle_radius) - 3.5 * 3, abs=0.05)


def test_the_root_circle_by_the_cutter(written, tmp_path):
    path = tmp_path / "cutter.rexs"
    path.write_text(written.read_text().replace('id="root_diameter"', 'id="custom_root_diameter"'))
    assert float(read_rexs(path).pair.wheel.dedendum) == pytest.approx(float(RING.dedendum), abs=1e-6)


def test_the_command_converts_ring_pairs(written, tmp_path):
    options = {"stage": None, "flank": None, "load_case": None, "torque": None, "given": []}
    convert(written, tmp_path / "pair.toml", **options)
    same(load_design(tmp_path / "pair.toml").pair(), PAIR)
    convert(tmp_path / "pair.toml", tmp_path / "again.rexs", **options)
    same(read_rexs(tmp_path / "again.rexs").pair, PAIR)


@pytest.mark.parametrize("write", [write_rexs, partial(write_design, pinion=None, wheel=None)])
def test_supports_of_a_rim_are_refused(tmp_path, write):
    held = dataclasses.replace(RING, support=ElasticFoundation(1e3))
    with pytest.raises(ValueError, match="supports of a rim are not written yet"):
        write(tmp_path / "pair.toml", jg.GearPair(PLANET, held, 67.5), torque=100.0)


@pytest.mark.parametrize(
    ("given", "said"), [({"wheel.bore_diameter": 100.0}, "is a ring gear"), ({"wheel.dedendum": 1.2}, "is a ring gear")]
)
def test_what_a_ring_has_not_is_refused(written, given, said):
    with pytest.raises(ValueError, match=said):
        read_rexs(written, given=given)
