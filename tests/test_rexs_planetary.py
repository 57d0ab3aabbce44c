"""REXS files of planetary stages: gears, all four flank sides and numbers of the stage come back; what is missing."""

import re

import jax
import numpy as np
import pytest
import rexs_schema
from catalogue import LINE

from jaxgear.io import DesignFileError, load_design
from jaxgear.rexs import read_rexs, read_rexs_stage, rexs_stages
from jaxgear.rexs.convert import convert
from jaxgear.rexs.frame import frames

STAGE = f"""
title = "a stage"

[sun]
teeth = 24
module = 3.0
profile_shift = -0.2
face_width = 18.0
tip_diameter = 76.8
bore_diameter = 30.0
tip_edge_radius = 0.1

[planet]
teeth = 18
module = 3.0
profile_shift = 0.2
face_width = 18.0
tip_diameter = 61.2
bore_diameter = 20.0
tip_edge_radius = 0.1

[ring]
teeth = 60
module = 3.0
profile_shift = -0.2
face_width = 18.0
cutter_teeth = 25
root_radius = 0.2
tip_diameter = 176.4
tip_edge_radius = 0.1
rim_diameter = 215.0

[pair]
center_distance = 63.0

[stage]
planets = 3
angles = [10.0, {10 + 29 * 360 / 84!r}, 250.0]
driving = "carrier"
radial_pin_stiffness = 500.0
tangential_pin_stiffness = 412.3456789012
sun_support = 0.0
tangential_pin_error = [-12.5, 3.0, 0.1]
pin_tolerance = 20.0
pin_samples = 4

[load]
torque = 1400.0
speed = 210.0

[resolution]
positions = {LINE.positions}
pairs = {LINE.pairs}

[[sun.modification]]
type = "tip_relief"
amount = 8.0
length = 4.0
curve = "parabolic"

[[planet.modification]]
type = "tip_relief"
amount = 7.0
length = 3.0

[[planet.ring_modification]]
type = "profile_crowning"
amount = 3.0

[[planet.ring_modification]]
type = "lead_slope"
amount = 2.0

[[ring.modification]]
type = "tip_relief"
amount = 5.0
length = 3.0
"""
OPTIONS = {"stage": None, "flank": None, "load_case": None, "torque": None, "given": []}
SIDES = "sun", "planet_to_sun", "planet_to_ring", "ring"


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stages")
    (folder / "stage.toml").write_text(STAGE)
    convert(folder / "stage.toml", folder / "stage.rexs", **OPTIONS)
    convert(folder / "stage.rexs", folder / "again.toml", **OPTIONS)
    return folder


def whole(path):
    design = load_design(path)
    table = design.tables["stage"]
    return table.whole_of(design, design.values), table.fields


def test_a_stage_comes_back(files):
    """Gears, centre distance, load and every number of the stage; the file is one of the data model of REXS."""
    assert not rexs_schema.faults((files / "stage.rexs").read_bytes())
    (first, numbers), (again, found) = whole(files / "stage.toml"), whole(files / "again.toml")
    for one, other in zip(first.pairs, again.pairs):
        np.testing.assert_allclose(one.working_center_distance, other.working_center_distance, rtol=1e-12)
        for gears in zip(one.gears, other.gears):
            radii = [[gear.tip_radius, gear.root_circle_radius, gear.bore_radius] for gear in gears]
            np.testing.assert_allclose(*radii, rtol=1e-9)
            fields = (
                "teeth module pressure_angle profile_shift face_width addendum dedendum root_radius tip_edge_radius"
            )
            shapes = [[getattr(gear, name) for name in fields.split()] for gear in gears]
            shapes = [[0.0 if number is None else number for number in each] for each in shapes]
            np.testing.assert_allclose(*shapes, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose([first.torque, first.speed], [again.torque, again.speed], rtol=1e-12)
    assert numbers.keys() | {"fixed"} == found.keys() and found["fixed"] == "ring"
    for name, value in numbers.items():
        if isinstance(value, str):
            assert found[name] == value
        else:
            np.testing.assert_allclose(found[name], value, rtol=1e-12)


def test_all_four_flank_sides_come_back(files):
    (first, _), (again, _) = whole(files / "stage.toml"), whole(files / "again.toml")
    seen = []
    for pair, before, after in zip(first.pairs, first.flanks, again.flanks):
        for frame, one, other in zip(frames(pair), before, after):
            roll, face = np.meshgrid(np.linspace(frame.start, frame.tip, 9), np.linspace(-9.0, 9.0, 5))
            amounts = [frame.removed(flank, roll, face) for flank in (one, other)]
            np.testing.assert_allclose(*amounts, atol=1e-9)
            seen.append(amounts[0])
    assert min(np.ptp(each) for each in seen) > 2.5 and np.abs(seen[1] - seen[2]).max() > 3


def test_the_list_of_stages_has_the_whole(files):
    listed = rexs_stages(files / "stage.rexs")
    kinds = [stage.kind for stage in listed]
    assert kinds == ["planetary_stage"] + ["cylindrical_stage"] * 6 and not any(stage.problem for stage in listed)
    assert listed[0].teeth == (24, 18, 60) and listed[0].center_distance == 63.0
    # each mesh is a pair of its own as well
    assert float(read_rexs(files / "stage.rexs", stage=listed[1].id).pair.wheel.teeth) == 18


def changed(folder, target, *replacements):
    """File with other texts, each of which has to be there."""
    text = (folder / "stage.rexs").read_text()
    for old, new in replacements:
        text, count = re.subn(old, new, text, flags=re.DOTALL)
        assert count, old
    target.write_text(text)
    return target


NO_OWN = r"<attribute id=\"custom_jaxgear_(?!rim|tip)\w+\"[^>]*>(?:[^<]|<array>|</array>|</?c>)*</attribute>", ""


def test_files_of_other_programs(files, tmp_path):
    """Negative teeth of a cylindrical gear for the ring, no shift of the sun, no numbers of pins, planets in any order.

    One line says what is missing and how it is given; then it is the same stage.
    """
    other = changed(
        files,
        tmp_path / "other.rexs",
        NO_OWN,
        ('type="ring_gear"', 'type="cylindrical_gear"'),
        ('hint="ring_gear"', 'hint="cylindrical_gear"'),
        ('id="number_of_teeth" unit="none">60<', 'id="number_of_teeth" unit="none">-60<'),
        (
            r'(name="sun (?:left|right) flank".*?)<attribute id="addendum_modification_coefficient"[^<]*</attribute>',
            r"\1",
        ),
    )
    with pytest.raises(DesignFileError, match=r"give it with --set sun\.profile_shift=VALUE"):
        read_rexs_stage(other)
    given = {"sun.profile_shift": -0.2}
    with pytest.raises(
        DesignFileError, match=r"stage\.tangential_pin_stiffness missing.*--set stage\.radial_pin_stiffness=VALUE"
    ):
        read_rexs_stage(other, given=given)
    given |= {"stage.radial_pin_stiffness": 500.0, "stage.tangential_pin_stiffness": 400.0}
    found, known = read_rexs_stage(other, given=given), read_rexs_stage(files / "stage.rexs")
    own = {"radial_pin_stiffness": 500.0, "tangential_pin_stiffness": 400.0}
    assert found.stage == {name: known.stage[name] for name in ("planets", "angles", "fixed", "driving")} | own
    assert jax.tree.all(jax.tree.map(lambda one, two: bool(one == two), found.pairs, known.pairs))
    assert found.torque == pytest.approx(1400.0, rel=1e-12)


def test_places_count_the_way_that_the_sun_is_driven(files, tmp_path):
    """With the left flanks of the sun the same file is the mirror image, and errors go along with their planets."""
    mirrored = changed(
        files,
        tmp_path / "mirrored.rexs",
        (">left</attribute>", ">there</attribute>"),
        (">right</attribute>", ">left</attribute>"),
        (">there</attribute>", ">right</attribute>"),
    )
    found = read_rexs_stage(mirrored)
    np.testing.assert_allclose(found.stage["angles"], [-10.0, 110.0, 350.0 - 29 * 360 / 84], rtol=1e-12)
    assert found.stage["tangential_pin_error"] == [-12.5, 0.1, 3.0]
    same = read_rexs_stage(mirrored, flank="right")
    assert same.stage["tangential_pin_error"] == [-12.5, 3.0, 0.1]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (r'(gear" name="planet 2">.*?id="face_width" unit="mm">)18\.0', r"\g<1>17.0", "must be the common one"),
        (r'(gear" name="planet 3">.*?id="tip_diameter" unit="mm">)[0-9.]+', r"\g<1>61.0", "must be alike"),
        (">right</attribute>", ">left</attribute>", "loaded_tooth_flank: left must be the other side"),
        ('role="gear_2"', 'role="gear_3"', "must be one sun and one ring"),
        ('type="planetary_stage"', 'type="worm_stage"', "has no planetary_stage"),
    ],
)
def test_what_is_no_stage_is_refused(files, tmp_path, old, new, said):
    with pytest.raises(DesignFileError, match=said):
        read_rexs_stage(changed(files, tmp_path / "wrong.rexs", (old, new)))


def test_the_ring_is_fixed_where_nothing_is_coupled_to_the_casing(files, tmp_path, caplog):
    path = changed(files, tmp_path / "loose.rexs", ('type="coupling"', 'type="concept_bearing"'))
    assert read_rexs_stage(path).stage["fixed"] == "ring"
    assert "stage.fixed = ring (no member is coupled to the casing)" in caplog.text


def test_keys_of_a_pair_are_none_of_a_stage(files):
    with pytest.raises(DesignFileError, match=r'"pinion\.teeth"'):
        read_rexs_stage(files / "stage.rexs", given={"pinion.teeth": 20})


def test_nothing_is_left_of_a_stage_that_cannot_be_assembled(files, tmp_path):
    path = changed(
        files, tmp_path / "wrong.rexs", (r'(rotating_angle_around_neg_u_axis" unit="deg">)-250\.0', r"\g<1>-249.0")
    )
    with pytest.raises(DesignFileError, match="cannot be assembled"):
        convert(path, tmp_path / "stage.toml", **OPTIONS)
    assert not (tmp_path / "stage.toml").exists()


def test_helical_stages_come_back(files, tmp_path):
    """With leads that differ at both ends of the face, of the same face coordinates in both meshes."""
    text = STAGE.replace("profile_shift", "helix_angle = 12.0\nprofile_shift", 1)
    hand = "helix_angle = -12.0\nprofile_shift"
    text = text.replace("profile_shift = 0.2", f"{hand} = 0.2").replace(
        "rim_diameter", "helix_angle = -12.0\nrim_diameter"
    )
    text = text.replace("center_distance = 63.0\n", f"center_distance = {63 / np.cos(np.deg2rad(12)):.12g}\n")
    for spur, helical in ((76.8, 78.4), (61.2, 62.4), (176.4, 180.4), (215.0, 220.0)):
        text = text.replace(f"diameter = {spur}", f"diameter = {helical}")
    text += '\n[[planet.modification]]\ntype = "lead_slope"\namount = 5.0\n'
    (tmp_path / "stage.toml").write_text(text)
    convert(tmp_path / "stage.toml", tmp_path / "stage.rexs", **OPTIONS)
    (first, _), found = whole(tmp_path / "stage.toml"), read_rexs_stage(tmp_path / "stage.rexs")
    assert float(found.pairs[1].wheel.helix_angle) == -12.0
    for pair, before, names in zip(first.pairs, first.flanks, (SIDES[:2], SIDES[2:])):
        for frame, one, name in zip(frames(pair), before, names):
            roll, face = np.meshgrid(np.linspace(frame.start, frame.tip, 5), np.linspace(-9.0, 9.0, 3))
            np.testing.assert_allclose(
                *(frame.removed(each, roll, face) for each in (one, found.flanks[name])), atol=1e-9
            )


def workbench_file():
    """A stage as a published sample of REXS 1.1 has it: 17/22/61 teeth, no shifts of sun and ring, one shaft a planet.

    Tools are related to gears, the ring is coupled to the casing, the load is on the shaft of the sun.
    """
    parts, relations = {}, []

    def add(kind, **values):
        number = len(parts) + 1
        shown = "".join(
            f'<attribute id="{name}" unit="{unit}">{value}</attribute>' for name, (value, unit) in values.items()
        )
        parts[number] = f'<component id="{number}" type="{kind}">{shown}</component>'
        return number

    def relate(kind, **roles):
        refs = "".join(f'<ref id="{number}" role="{role}"/>' for role, number in roles.items())
        relations.append(f'<relation id="{len(relations) + 1}" type="{kind}">{refs}</relation>')

    def gear(kind, teeth, shaft, **shift):
        common = {"face_width": (50.0, "mm"), "normal_module": (4.0, "mm"), "number_of_teeth": (teeth, "none")}
        part = add(kind, helix_angle_reference_diameter=("-0.0", "\N{DEGREE SIGN}"), **common)
        angle = {"normal_pressure_angle": (20.0, "\N{DEGREE SIGN}")}
        relate(
            "flank",
            gear=part,
            left=add("flank_geometry", **angle, **shift),
            right=add("flank_geometry", **angle, **shift),
        )
        relate("assembly", assembly=shaft, part=part)
        return part

    unit, whole = add("gear_unit"), add("planetary_stage")
    relate("assembly", assembly=unit, part=whole)
    shafts = [add("shaft", rotational_speed=(1500.0, "1 / min"), defines_speed=("true", "none")), add("shaft")]
    relate("side", outer_part=add("gear_casing"), inner_part=shafts[1], assembly=add("switchable_coupling"))
    load = add("external_load", torque_around_u_axis=(1591.5, "N m"), defines_torque=("true", "none"))
    relate("assembly", assembly=shafts[0], part=load)
    relate("planet_carrier_shaft", shaft=add("shaft"), planetary_stage=whole)
    sun, ring = gear("cylindrical_gear", 17, shafts[0]), gear("ring_gear", 61, shafts[1])
    for angle in (0.0, 119.99999999999999, 239.99999999999997):
        planet = gear("cylindrical_gear", 22, add("shaft"), addendum_modification_coefficient=(0.0, "none"))
        for turned, gears in ((0.0, {"gear_1": sun, "gear_2": planet}), (180.0, {"gear_1": planet, "gear_2": ring})):
            own = {"center_distance": (78.0, "mm"), "common_face_width": (50.0, "mm")}
            own["rotating_angle_around_neg_u_axis"] = (angle + turned, "\N{DEGREE SIGN}")
            stage = add("cylindrical_stage", **own)
            relate("assembly", assembly=whole, part=stage)
            relate("stage", stage=stage, **gears)
            for each in gears.values():
                data = add("stage_gear_data", is_driving_gear=("false", "none"))
                relate("stage_gear_data", stage=stage, gear=each, stage_gear_data=data)
    body = f"<relations>{''.join(relations)}</relations><components>{''.join(parts.values())}</components>"
    return f'<?xml version="1.0" encoding="UTF-8"?><model version="1.1">{body}</model>'


def test_a_published_form_of_a_stage(tmp_path):
    """What is missing is said one by one; then the stage is that of the file, with equal places and a fixed ring."""
    source, target = tmp_path / "workbench.rexs", tmp_path / "stage.toml"
    source.write_text(workbench_file(), encoding="utf-8")
    (problem,) = [stage.problem for stage in rexs_stages(source) if stage.kind == "planetary_stage"]
    assert problem.endswith("addendum_modification_coefficient: missing, give it with --set sun.profile_shift=VALUE")
    given = ["sun.profile_shift=0", "ring.profile_shift=0"]
    with pytest.raises(DesignFileError, match="stage.radial_pin_stiffness, stage.tangential_pin_stiffness missing"):
        convert(source, target, **OPTIONS | {"given": given})
    assert not target.exists()
    given += ["stage.radial_pin_stiffness=800", "stage.tangential_pin_stiffness=800", "stage.sun_support=0"]
    convert(source, target, **OPTIONS | {"given": given})
    found, numbers = whole(target)
    pins = {"radial_pin_stiffness": 800.0, "tangential_pin_stiffness": 800.0, "sun_support": 0.0}
    assert numbers == {"planets": 3, "fixed": "ring", "driving": "sun"} | pins
    assert [float(found.pairs[0].pinion.teeth), *(float(pair.wheel.teeth) for pair in found.pairs)] == [17, 22, 61]
    assert found.pairs[1].wheel.is_internal and (found.torque, found.speed) == pytest.approx((1591.5, 1500.0))
