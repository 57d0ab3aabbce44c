"""REXS files that leave numbers open, in containers, and the list of their stages."""

import contextlib
import io
import random
import re
import zipfile
from types import SimpleNamespace

import equinox as eqx
import numpy as np
import pytest

import jaxgear as jg
from jaxgear.cli import main
from jaxgear.io import DesignFileError, load_design
from jaxgear.rexs import forms as container
from jaxgear.rexs import read_rexs, rexs_stages, write_rexs

PAIR = jg.GearPair(
    jg.Gear(teeth=19, module=3.0, face_width=20.0, bore_diameter=24.0, dedendum=1.31, tip_diameter=63.2),
    jg.Gear(teeth=48, module=3.0, face_width=18.0, bore_diameter=70.0),
    100.5,
)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The text of a file that says everything."""
    path = tmp_path_factory.mktemp("rexs") / "pair.rexs"
    write_rexs(path, PAIR, torque=50.0)
    return path.read_text("utf-8-sig")


def without(text, *attributes, tools=True):
    """The file without attributes, or without its tools."""
    for name in attributes:
        text, count = re.subn(rf'<attribute id="{name}".*?</attribute>', "", text)
        assert count
    return text if tools else text.replace('type="manufacturing_step"', 'type="step"')


def read(tmp_path, text, **options):
    path = tmp_path / "open.rexs"
    path.write_text(text)
    return read_rexs(path, **options)


@pytest.mark.parametrize("version", ["1.0", "1.6"])
def test_what_a_file_leaves_open_is_completed_alike_in_every_version(tmp_path, whole, version, caplog):
    """Without tools the root diameter tells the dedendum, without it the rack of ISO 53 does; tips follow from x."""
    text = whole.replace('version="2.0.0"', f'version="{version}"')
    found = read(tmp_path, without(text, tools=False))
    assert [float(gear.dedendum) for gear in found.pair.gears] == [1.31, 1.25]
    for gear, other in zip(found.pair.gears, PAIR.gears):
        assert float(gear.root_circle_radius) == pytest.approx(float(other.root_circle_radius), rel=1e-12)
    assert "pinion.dedendum = 1.31 (root_diameter)" in caplog.text
    assert "wheel.root_radius = 0.38 (basic rack of ISO 53)" in caplog.text and "--set KEY=VALUE" in caplog.text
    bare = read(tmp_path, without(text, "root_diameter", "tip_diameter", "addendum_coefficient_basic_profile",
                                  "inner_diameter", "elastic_modulus", tools=False))  # fmt: skip
    wanted = [jg.Gear(teeth=z, module=3.0, face_width=b) for z, b in ((19, 20.0), (48, 18.0))]
    for gear, other in zip(bare.pair.gears, wanted):
        for name in ("tip_radius", "root_circle_radius", "bore_radius", "root_radius"):
            assert float(getattr(gear, name)) == pytest.approx(float(getattr(other, name)), rel=1e-12), name
    (stage,) = rexs_stages(tmp_path / "open.rexs")
    assert stage.completed["pinion.tip_diameter"] == "63 (addendum 1 x module)"
    assert stage.completed["wheel.bore_diameter"] == "68.25 (half the root diameter)"
    assert stage.completed["wheel.material"] == "STEEL (no elastic_modulus)"


def test_what_is_missing_is_given_by_the_key_that_the_refusal_names(tmp_path, whole, caplog):
    for name, key, value in (
        ("face_width", "pinion.face_width", 21.0),
        ("normal_pressure_angle", "pinion.pressure_angle", 20.0),
        ("center_distance", "pair.center_distance", 100.6),
    ):
        text = re.sub(
            r'<component [^>]*(name="pinion( \w+ flank)?"|type="cylindrical_stage")>.*?</component>',
            lambda found, name=name: found[0].replace(f'id="{name}"', 'id="other"'),
            whole,
            flags=re.DOTALL,
        )
        with pytest.raises(DesignFileError, match=f"{name}: missing, give it with --set {key}=VALUE$"):
            read(tmp_path, text)
        assert read(tmp_path, text, given={key: value}) and f"{key} = {value:g} (given)" in caplog.text
    replaced = read(tmp_path, whole, given={"pinion.tip_diameter": 63.1})
    assert float(replaced.pair.pinion.tip_diameter) == 63.1 and replaced.torque == 50.0
    assert "pinion.tip_diameter = 63.1 (given in place of 63.2);" in caplog.text
    with pytest.raises(DesignFileError, match='"pinion.tip_diamter" is not known, did you mean "pinion.tip_diameter"'):
        read(tmp_path, whole, given={"pinion.tip_diamter": 63.1})


def test_a_rack_by_hand_stands_for_tools_that_are_not_read(tmp_path, whole):
    tool = 'id="addendum_coefficient_reference_profile"'
    more = '<attribute id="protuberance_amount" unit="mm">0.1</attribute>'
    text = whole.replace(f"<attribute {tool}", f"{more}<attribute {tool}")
    with pytest.raises(DesignFileError, match="or give the rack: --set pinion.dedendum=VALUE --set pinion.root_radius"):
        read(tmp_path, text)
    rack = {f"{gear}.{name}": value for gear in ("pinion", "wheel") for name, value in
            (("dedendum", 1.4), ("root_radius", 0.25))}  # fmt: skip
    found = read(tmp_path, text, given=rack).pair
    assert [float(gear.dedendum) for gear in found.gears] == [1.4, 1.4] and float(found.wheel.root_radius) == 0.25


def test_a_generating_profile_shift_tells_the_tooth_thickness(tmp_path, whole):
    """x_E = x + A_sn / (2 m tan(alpha)): 0.02 less are 43.68 um of module 3; beside limits it lies between theirs."""
    name = "generated_addendum_modification_coefficient"
    thin = whole.replace(f'id="{name}" unit="none">0.0<', f'id="{name}" unit="none">-0.02<', 1)
    found = read(tmp_path, thin).pair.pinion
    assert float(found.tooth_thickness_allowance) == pytest.approx(-6000 * 0.02 * np.tan(np.deg2rad(20)), abs=1e-6)
    limits = "".join(f'<attribute id="{end}_backlash_allowance_referenced_to_span" unit="mum">{value}</attribute>'
                     for end, value in (("upper", -30), ("lower", -60)))  # fmt: skip
    both = thin.replace('<attribute id="number_of_teeth"', f'{limits}<attribute id="number_of_teeth"', 1)
    assert float(read(tmp_path, both).pair.pinion.tooth_thickness_tolerance) == pytest.approx(31.925, abs=1e-3)
    for text, value in ((both, -0.05), (whole, 0.01)):
        wrong = re.sub(rf'(id="{name}" unit="none">)[-.0-9]*<', rf"\g<1>{value}<", text, count=1)
        with pytest.raises(DesignFileError, match=f"{name}: {value} must be at least .* or give the rack: --set pin"):
            read(tmp_path, wrong)


def test_chamfers_and_an_offset_of_the_faces_are_given(tmp_path, whole):
    chamfered = whole.replace('<attribute id="number_of_teeth"', '<attribute id="chamfer_at_tooth_end" unit="mm">0.5'
                              '</attribute><attribute id="number_of_teeth"', 1)  # fmt: skip
    with pytest.raises(DesignFileError, match="or give the width without: --set pinion.face_width=MM"):
        read(tmp_path, chamfered)
    assert float(read(tmp_path, chamfered, given={"pinion.face_width": 19.0}).pair.pinion.face_width) == 19.0
    beside = whole.replace('id="common_face_width" unit="mm">18.0', 'id="common_face_width" unit="mm">16.0')
    with pytest.raises(DesignFileError, match="or give --set pair.axial_offset=MM"):
        read(tmp_path, beside)
    assert float(read(tmp_path, beside, given={"pair.axial_offset": 3.0}).pair.axial_offset) == 3.0


def archive(path, members, **options):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, **options) as made:
        for name, content in members.items():
            made.writestr(name, content)
    return path


def test_containers_are_read_and_written(tmp_path, whole, monkeypatch):
    path = archive(tmp_path / "model.zip", {"figure.png": b"x", "../../out.rexs": whole})
    wanted = read(tmp_path, whole).pair
    assert eqx.tree_equal(read_rexs(path).pair, wanted)
    write_rexs(tmp_path / "again.rexsz", wanted, torque=50.0)
    assert zipfile.ZipFile(tmp_path / "again.rexsz").namelist() == ["again.rexs"]
    assert eqx.tree_equal(read_rexs(tmp_path / "again.rexsz").pair, wanted)
    assert not (tmp_path.parent.parent / "out.rexs").exists()
    monkeypatch.setattr(container, "_MOST", 2**20)
    for members, problem in (
        ({"a.rexs": whole, "b.rexs": whole}, "holds 2 REXS files, unpack it and give one of them: a.rexs, b.rexs"),
        ({"a.txt": whole}, "holds no REXS file, whose name ends in .rexs, .xml, .rexsj, .json"),
        ({"a.rexs": b"\0" * 2**21}, "a.rexs: expands to more than 1 MiB"),
    ):
        with pytest.raises(DesignFileError, match=re.escape(problem)):
            read_rexs(archive(tmp_path / "bad.rexsz", members))
    held, rng = container.packed(b"<model/>" * 400, "a.rexs"), random.Random(1)
    for _ in range(500):
        place = rng.randrange(4, len(held))
        with contextlib.suppress(DesignFileError):  # nothing else
            container.unpacked(held[:place] + bytes([rng.randrange(256)]) + held[place + 1 :])
    damaged = tmp_path / "damaged.zip"
    damaged.write_bytes(path.read_bytes()[:-30])
    with pytest.raises(DesignFileError, match=r"damaged.zip: is not a valid zip archive: "):
        read_rexs(damaged)


def call(*arguments):
    """Exit code, stdout and stderr of the command."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), pytest.raises(SystemExit) as exit_:
        main([str(argument) for argument in arguments])
    return SimpleNamespace(code=exit_.value.code, out=out.getvalue(), err=err.getvalue())


def test_the_stages_of_a_file_and_why_they_are_not_converted(tmp_path, whole):
    kinds = "planetary_stage", "bevel_stage", "cylindrical_stage"
    others = "".join(f'<component id="2{number}" type="{kind}"/>' for number, kind in enumerate(kinds))
    path = tmp_path / "gearbox.rexs"
    path.write_text(without(whole, tools=False).replace("</components>", f"{others}</components>"))
    found = {each.id: each for each in rexs_stages(path)}
    assert [found[2].teeth, found[2].module, found[2].center_distance, found[2].problem] == [(19, 48), 3.0, 100.5, ""]
    assert "one sun and one ring" in found[20].problem and "bevel gears" in found[21].problem
    assert found[22].problem == "cylindrical_stage 22: gear_1: missing"
    done = call("convert", path)
    head, *rows = done.out.splitlines()
    assert done.code == 0 and len(rows) == 4 and rows[0].startswith("2   cylindrical  19/48  3       0         100.5")
    assert {row.index("no: ") for row in rows[1:]} == {head.index("converted")} == {rows[0].index("yes, completed: ")}
    assert call("convert", path, "--torque", 5).err.count("--torque has no effect without OUT") == 1


def test_the_command_takes_numbers_beside_the_file(tmp_path, whole):
    source, target = tmp_path / "open.rexs", tmp_path / "open.toml"
    source.write_text(without(whole, tools=False))
    done = call("convert", source, target, "--set", "pinion.root_radius=0.25", "--set", "pair.center_distance=100.7")
    assert done.code == 0 and "pinion.root_radius = 0.25 (given)" in done.err
    pair = load_design(target).pair()
    assert float(pair.pinion.root_radius) == 0.25 and float(pair.center_distance) == 100.7
    np.testing.assert_allclose(float(pair.pinion.dedendum), 1.31)
    assert "--set a: must be KEY=NUMBER" in call("convert", source, tmp_path / "b.toml", "--set", "a").err
