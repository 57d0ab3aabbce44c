"""Helical pairs in files: design files with both hands, slices and variables; REXS; commands."""

import json
from dataclasses import replace

import jax
import numpy as np
import pytest
from commands import call
from design_texts import loaded, text
from helical_pairs import pair_of

import jaxgear as jg
from jaxgear.contact import helical_slices
from jaxgear.geometry import span
from jaxgear.io import DesignFileError, load_design, write_design
from jaxgear.io.write_design import write_starter
from jaxgear.rexs import read_rexs, write_rexs
from jaxgear.rexs.frame import frames
from jaxgear.studies.gear_data import FACTORS, gears, mounting, rating_page

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


def test_slices_show_the_contact_lines(load):
    """Eleven, or ten for every base pitch of overlap; of variables those of the longest overlap."""
    design = load(pinion=ANGLE)
    assert design.resolution().slices == 22 == helical_slices(design.pair())
    wide = "[resolution]\nslices = 7"
    assert load(pinion=ANGLE, tail=wide).resolution().slices == 7
    for low, high, slices in ((-5.0, 5.0, 11), (-40.0, 20.0, 44), (0.0, 45.0, 44)):
        free = load(wheel=OPEN, tail=VARIABLE.format(low=low, high=high)).resolution()
        assert (free.slices, free.pairs >= 4) == (slices, True)
    assert load().resolution().slices == 1


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
        r"resolution.slices: must be at least 2, 1 cannot show helical gears, .* \(22 where the key is left out\)$",
    ),
    "one hand": (
        {"pinion": ANGLE, "wheel": ANGLE},
        "wheel.helix_angle: 15 deg must be -15 deg: gears on parallel shafts",
    ),
    "two variables": (
        {"pinion": OPEN, "wheel": OPEN, "tail": VARIABLE.format(low=0.0, high=20.0)},
        "wheel.helix_angle: has no effect, pinion.helix_angle is a variable and that of the wheel follows from it",
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


PAIR = pair_of(tooth_thickness_allowance=-40.0, tooth_thickness_tolerance=20.0, tip_edge_radius=0.1)
FLANKS = {
    "pinion": jg.TipRelief(8.0, 2.7, jg.Linear()) + jg.LeadSlope(12.0) + jg.EndRelief(5.0, 4.0, side="negative"),
    "wheel": jg.LeadCrowning(6.0) + jg.microgeometry.TabulatedFlank(
        [4.0, 30.0], [-8.0, 1.0, 9.0], np.arange(6.0).reshape(2, 3)
    ),
}  # fmt: skip


def same(one, other, tolerance=1e-9):
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=tolerance, atol=1e-9), one, other)


def removed(found, sign=1):
    """What both flanks remove over roll lengths and face coordinates, or these with the other sign."""
    share, face = np.meshgrid(np.linspace(0.02, 0.98, 7), sign * np.linspace(-9.5, 9.5, 9))
    flanks = zip(frames(PAIR), (found["pinion"], found["wheel"]))
    return np.stack([each.removed(flank, each.start + share * (each.tip - each.start), face) for each, flank in flanks])


@pytest.mark.parametrize("name", ["pair.rexs", "pair.rexsj"])
def test_a_helical_stage_comes_back_from_rexs(tmp_path, name):
    write_rexs(tmp_path / name, PAIR, **FLANKS, torque=50.0, speed=1000.0)
    found = read_rexs(tmp_path / name)
    same(found.pair, with_numbers(PAIR), 1e-6)
    np.testing.assert_allclose(removed(vars(found)), removed(FLANKS), atol=0.01)


def with_numbers(pair):
    """Diameters and centre distance in a file are numbers; bores are those of the pair."""
    gears = [replace(gear, tip_diameter=2 * gear.tip_radius) for gear in pair.gears]
    return replace(pair, pinion=gears[0], wheel=gears[1], center_distance=pair.working_center_distance)


def test_left_flanks_meet_the_other_end_first(tmp_path):
    """A pinion that drives with its left flanks is turned end for end: face coordinates change sign, the hand stays."""
    path = tmp_path / "pair.rexs"
    write_rexs(path, PAIR, **FLANKS)
    text = path.read_text()
    assert text.count(">right<") == 2
    path.write_text(text.replace(">right<", ">left<"))
    left, right = read_rexs(path), read_rexs(path, flank="right")
    same(left.pair, right.pair)
    np.testing.assert_allclose(removed(vars(left)), removed(vars(right), -1), atol=1e-9)
    assert np.abs(removed(vars(left)) - removed(vars(right))).max() > 5.0
    path.write_text("\n".join(line for line in text.splitlines() if "loaded_tooth_flank" not in line))
    with pytest.raises(
        DesignFileError, match=r"cylindrical_gear 3: modifies the ends .* choose left or right \(flank\)"
    ):
        read_rexs(path)


def test_flanks_and_slopes_are_seen_from_the_datum_face(tmp_path):
    """A slope of the left flank is that of the right one the other way, at whichever end they are looked at."""
    path = tmp_path / "pair.rexs"
    write_rexs(path, PAIR, pinion=jg.LeadSlope(12.0))
    for end in ("negative", "positive"):
        path.write_text(path.read_text().replace(">negative<", f">{end}<"))
        assert [float(read_rexs(path, flank=side).pinion.amount) for side in ("right", "left")] == [12.0, -12.0]
    path.write_text(path.read_text().replace(">positive<", ">negative<", 1))
    with pytest.raises(DesignFileError, match=r"datum_face_orientation: must be that of gear 3: the same flanks"):
        read_rexs(path)


def test_the_base_helix_angle_says_the_same(tmp_path):
    path = tmp_path / "pair.rexs"
    write_rexs(path, PAIR)
    text = path.read_text()
    base = float(np.rad2deg(PAIR.pinion.base_helix_angle))
    for gear in (1, -1):
        text = text.replace(
            f'"helix_angle_reference_diameter" unit="deg">{15.0 * gear}<',
            f'"helix_angle_base_diameter" unit="deg">{base * gear}<',
        )
    path.write_text(text)
    assert float(read_rexs(path).pair.pinion.helix_angle) == pytest.approx(15.0, abs=1e-9)


EARLY = """<model version="1.0"><relations>
<relation id="1" type="stage"><ref id="6" role="stage"/>
<ref id="1" role="gear_1"/><ref id="2" role="gear_2"/></relation>
<relation id="2" type="flank"><ref id="1" role="gear"/><ref id="3" role="left"/><ref id="3" role="right"/></relation>
<relation id="3" type="flank"><ref id="2" role="gear"/><ref id="4" role="left"/><ref id="4" role="right"/></relation>
</relations><components>
<component id="6" name="" type="cylindrical_stage">
<attribute id="center_distance" unit="mm">53.0</attribute></component>
{gears}</components></model>
"""
GEAR = """<component id="{0}" name="" type="cylindrical_gear"><attribute id="normal_module" unit="mm">1.0</attribute>
<attribute id="helix_angle_reference_diameter" unit="\u00b0">{1}</attribute>
<attribute id="face_width" unit="mm">11.0</attribute><attribute id="number_of_teeth" unit="none">{2}</attribute>
</component><component id="{3}" name="" type="flank_geometry">
<attribute id="normal_pressure_angle" unit="\u00b0">20.0</attribute>
<attribute id="addendum_modification_coefficient" unit="none">{4}</attribute></component>
"""


def test_files_that_knew_no_tools_have_the_rack_of_iso_53(tmp_path, caplog):
    path = tmp_path / "early.rexs"
    gears = GEAR.format(1, 30.0, 23, 3, 0.581) + GEAR.format(2, -30.0, 67, 4, 0.5131)
    path.write_text(EARLY.format(gears=gears), encoding="utf-8")
    found = read_rexs(path).pair
    for name, value in (("dedendum", 1.25), ("root_radius", 0.38)):
        assert f"pinion.{name} = {value} (basic rack of ISO 53)" in caplog.text
    wanted = [jg.Gear(z, 1.0, 20.0, x, face_width=11.0, helix_angle=beta) for z, x, beta in
              ((23, 0.581, 30.0), (67, 0.5131, -30.0))]  # fmt: skip
    same(found, jg.GearPair(*wanted, 53.0))


def test_the_tables_of_a_run_have_the_numbers_of_iso_21771(load):
    """Values of the pair worked out by hand; W_k and M_dK are those of the library."""
    wide = "[pair]\naxial_offset = 1.0"  # common face of 18 mm
    found = gears(load(pinion=ANGLE, tail=wide))
    pinion, pair = found["geometry"]["pinion"], found["geometry"]["pair"]
    wanted = {"helix_angle_deg": 15.0, "base_helix_angle_deg": 14.0761, "transverse_module_mm": 3.105829}
    wanted |= {"transverse_pressure_angle_deg": 20.646896}
    for name, value in wanted.items():
        assert float(pinion[name]) == pytest.approx(value, abs=6e-5), name
    assert float(pinion["active_tip_diameter_mm"]) == pytest.approx(float(pinion["tip_diameter_mm"]), rel=1e-12)
    assert float(pair["center_distance_mm"]) == pytest.approx(104.04526, abs=5e-6)
    assert float(pair["overlap_ratio"]) == pytest.approx(0.5492 * 18.0 / 20.0, abs=5e-5)
    assert float(pair["total_contact_ratio"]) == pytest.approx(1.5700 + 0.5492 * 0.9, abs=1e-4)
    teeth = found["drawing"]["wheel"]["teeth_spanned"]
    wheel = load(pinion=ANGLE).pair().wheel
    assert found["drawing"]["wheel"]["span_upper_limit_mm"] == pytest.approx(float(span(wheel, teeth)), rel=1e-12)


def test_the_backlash_that_is_said_is_the_one_that_is_given(load):
    """Normal to the flanks, as the comment of the template has it; the transverse one is larger by 1 / cos(beta_b)."""
    file = load(pinion=ANGLE, tail="[pair]\nbacklash = 50.0")
    assert mounting(file).endswith("backlash normal to the flanks 50 um")
    transverse = gears(file)["geometry"]["pair"]["backlash_on_line_of_action_um"]
    assert float(transverse) == pytest.approx(50 / np.cos(np.deg2rad(14.0761)), rel=1e-5)


def test_a_symbol_that_the_words_end_with_is_not_repeated():
    rows = {row[0] for row in rating_page({"design": dict.fromkeys(FACTORS, 1.0)}).tables[0].rows}
    assert "face load factor K_Hbeta" in rows and not any("K_Hbeta, K_Hbeta" in row for row in rows)


def test_new_writes_a_helical_pair_that_is_read(tmp_path):
    path = tmp_path / "new.toml"
    given = {"module": 3.0, "torque": 100.0, "face_width": 20.0, "speed": None}
    write_starter(path, (19, 48), **given, helix_angle=-15.0)
    pair = load_design(path).pair()
    assert float(pair.pinion.helix_angle) == -15.0 == -float(pair.wheel.helix_angle)
    with pytest.raises(ValueError, match="helix_angle = 60 deg must be at least -45 deg and at most 45 deg"):
        write_starter(tmp_path / "other.toml", (19, 48), **given, helix_angle=60.0)


COMMAND = text(
    pinion=ANGLE + "\n[[pinion.modification]]\ntype = 'tip_relief'\namount = 20.0\nlength = 5.0",
    wheel="[[wheel.modification]]\ntype = 'tip_relief'\namount = 20.0\nlength = 5.0",
    load="torque_range = [25.0, 50.0]\nspeed = 1000.0",
    tail="[resolution]\npositions = 8\nslices = 5\npairs = 3\nnewton_steps = 12",
)


@pytest.mark.slow
def test_analyze_takes_a_helical_file(tmp_path):
    (tmp_path / "gear.toml").write_text(COMMAND)
    found = call("analyze", tmp_path / "gear.toml", "--output", tmp_path / "out", "--report")
    assert found.code == 0, found.err
    data = json.loads((tmp_path / "out" / "summary.json").read_text())
    designs = data["designs"]
    assert designs["modified"]["overlap_ratio"] == pytest.approx(0.5492 * 0.9, abs=5e-5)
    assert designs["modified"]["axial_force_N"] == pytest.approx(
        50e3 / (1.5 * 19 / np.cos(np.deg2rad(15.0))) * np.tan(np.deg2rad(15.0)), rel=1e-6
    )
    assert data["resolution"]["slices"] == 5 and data["gears"]["wheel"]["helix_angle_deg"] == -15.0
    for name in ("pressure_map", "contact_pattern", "line_load", "load_sharing", "pressure", "lead_chart"):
        assert (tmp_path / "out" / f"{name}.png").stat().st_size > 5000
    assert "overlap ratio" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
