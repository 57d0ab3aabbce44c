"""Tables [lubricant] and [strength] of design files: what they mean, refuse, and bring into tables and sweeps."""

import json
import re

import equinox as eqx
import numpy as np
import pytest
from commands import LINE
from design_texts import asked_sweep

import jaxgear as jg
from jaxgear.cli import run
from jaxgear.contact import OperatingPoint
from jaxgear.io import DesignFileError, Search, load_design, quantities_of_tables
from jaxgear.metrics import share_settings
from jaxgear.numerics import program
from jaxgear.studies import AnalysisStudy, SweepStudy, evaluation

pytestmark = pytest.mark.usefixtures("no_cache")

PAIR = f"""
[pinion]
teeth = 19
module = 3.0
face_width = 18.0
[wheel]
teeth = 48
module = 3.0
face_width = 18.0
[resolution]
{LINE}
[load]
torque = 50.0
speed = 3000.0
"""
OIL = """
[lubricant]
file = "oil.toml"
temperature = 80.0
roughness = 0.5
"""
STRENGTH = """
[strength]
pitting = 1500.0
bending = 900.0
"""
RELIEF = """
[[pinion.modification]]
type = "tip_relief"
amount = "amount"
length = 4.0
[variables]
amount = { low = 0.0, high = 12.0, unit = "um" }
[optimize]
constraint = [{ of = "scuffing_safety", low = 1.5 }]
[sweep]
samples = 2
results = ["loss_power", "scuffing_safety", "pinion_root_safety"]
"""
UNLIMITED = RELIEF.replace('[optimize]\nconstraint = [{ of = "scuffing_safety", low = 1.5 }]\n', "")
SHEET = "viscosity_40 = 100.0\nviscosity_100 = 11.0\nscuffing_temperature = 250.0\n"


@pytest.fixture
def load(file, tmp_path):
    (tmp_path / "oil.toml").write_text(SHEET)
    return lambda text: load_design(file(text))


def test_an_oil_may_stand_in_a_file_of_its_own(load):
    whole = load(PAIR + "[lubricant]\n" + SHEET + "temperature = 80.0\nroughness = 0.5")
    design = load(PAIR + OIL + STRENGTH)
    assert (
        repr(design.tables["lubricant"])
        == repr(whole.tables["lubricant"])
        == repr(jg.metrics.Lubricant(100.0, 11.0, 80.0, 0.5, scuffing_temperature=250.0))
    )
    assert repr(design.tables["strength"]) == repr(jg.metrics.Strength(1500.0, bending=900.0))
    assert load(PAIR).tables == {}


def test_tables_bring_the_quantities_that_they_tell_of(load):
    def names(text):
        return {quantity.name for quantity in quantities_of_tables(load(text))}

    assert names(PAIR.replace("speed = 3000.0", "")) == set()
    assert names(PAIR) == {"max_flash_temperature"}
    rubbing = names(PAIR + "friction = 0.05")
    assert rubbing == {"max_flash_temperature", "loss_power", "mesh_efficiency"}
    assert names(PAIR.replace("speed = 3000.0", "friction = 0.05")) == {"mesh_efficiency"}
    oiled = names(PAIR + OIL)
    assert oiled > rubbing and "scuffing_safety" in oiled and "micropitting_safety" not in oiled
    rated = {f"{gear}_{kind}_safety" for gear in ("pinion", "wheel") for kind in ("pitting", "root", "local_root")}
    assert names(PAIR.replace("speed = 3000.0", "") + STRENGTH) == rated


@pytest.mark.parametrize(
    "text, message",
    [
        (PAIR.replace("speed = 3000.0", "") + OIL, "pair.toml: lubricant: has no effect without load.speed"),
        (
            PAIR.replace("3000.0", "0.0") + OIL,
            "pair.toml: load.speed: 0 rpm must be greater than 0 rpm with [lubricant]",
        ),
        (
            PAIR.replace("3000.0", '"n"') + OIL + "[variables]\nn = { low = 0.0, high = 3000.0 }",
            "pair.toml: variables.n.low: 0 rpm must be greater than 0 rpm with [lubricant]",
        ),
        (
            PAIR.replace("3000.0", "1e-9") + OIL,
            "pair.toml: load.speed: 1e-09 rpm must be at least 0.001 rpm and at most 1e+07 rpm with [lubricant]",
        ),
        (PAIR + OIL + 'friction = "xu"', 'lubricant.friction: "xu" is not known'),
        (PAIR + "friction = 0.05" + OIL + 'friction = "schlenk"', "lubricant.friction: has no effect beside load.fric"),
        (
            PAIR + "friction = 0.05" + OIL + "friction_factor = 1.0",
            "friction_factor: has no effect beside load.friction",
        ),
        (PAIR + OIL + "viscosity_40 = 220.0", "pair.toml: lubricant.viscosity_40: is given in oil.toml too"),
        (PAIR + OIL.replace("oil.toml", "no.toml"), "no.toml: No such file"),
        (PAIR + OIL.replace('"oil.toml"', "3"), "lubricant.file: must be a string, not a number"),
        (PAIR + OIL.replace("roughness = 0.5", ""), "pair.toml: lubricant.roughness: missing"),
        (PAIR + OIL.replace("80.0", '"t"'), "lubricant.temperature: must be a number, not a string"),
        (PAIR + OIL.replace("80.0", "280.0"), "lubricant.temperature: 280 degC must be at least -60 degC and at most"),
        (PAIR + OIL.replace("80.0", "245.0") + "density = 0.9", "density: 0.9 kg/m^3 must be at least 50 kg/m^3"),
        (PAIR + OIL.replace("roughness", "rougness"), 'lubricant.rougness: unknown key, did you mean "roughness"?'),
        (PAIR + "[strength]", "strength: is empty; it gives the permissible stresses"),
        (PAIR + "[strength]\nwheel_bending = 900.0", "strength: bending must be given where wheel_bending is"),
        (PAIR + "[strength]\npitting = 0", "strength.pitting: 0 MPa must be greater than 0 MPa"),
    ],
)
def test_refuses_with_key_and_unit(load, text, message):
    with pytest.raises(DesignFileError, match=re.escape(message)) as refused:
        load(text)
    assert "\n" not in str(refused.value)


def test_what_is_wrong_in_the_file_of_the_oil_names_that_file(load, tmp_path):
    for sheet, message in (
        (SHEET.replace("100.0", "-1"), "oil.toml: viscosity_40: -1 mm2/s must be at least 2 mm2/s"),
        (SHEET + "visc = 3", "oil.toml: visc: unknown key"),
        (SHEET + "=", "oil.toml: line 4"),
    ):
        (tmp_path / "oil.toml").write_text(sheet)
        with pytest.raises(DesignFileError, match=re.escape(message)):
            load_design(tmp_path / "pair.toml") if (tmp_path / "pair.toml").exists() else load(PAIR + OIL)
        (tmp_path / "pair.toml").write_text(PAIR + OIL)


def test_a_constraint_and_a_column_need_their_table(load):
    design = load(PAIR + OIL + STRENGTH + RELIEF)
    (constraint,) = Search.of(design).problem["constraints"]
    assert constraint.quantity == design.tables["lubricant"].quantity("scuffing_safety")
    assert asked_sweep(design).results[2] == design.tables["strength"].quantity("pinion_root_safety")
    for text, message in (
        (PAIR + STRENGTH + RELIEF, 'optimize.constraint[0].of: "scuffing_safety" needs the table [lubricant]'),
        (PAIR + OIL + RELIEF.replace("scuffing", "micropitting"), "needs lubricant.permissible_film"),
    ):
        with pytest.raises(DesignFileError, match=re.escape(message)):
            Search.of(load(text))
    for text, message in (
        (PAIR + UNLIMITED, 'sweep.results[0]: "loss_power" needs load.friction or the table [lubricant]'),
        (PAIR.replace("speed = 3000.0", "") + UNLIMITED, 'sweep.results[0]: "loss_power" needs load.speed'),
        (PAIR + OIL + UNLIMITED, 'sweep.results[2]: "pinion_root_safety" needs the table [strength]'),
        (PAIR + OIL + "[strength]\npressure = 1e3" + UNLIMITED, "needs strength.bending"),
    ):
        with pytest.raises(DesignFileError, match=re.escape(message)):
            asked_sweep(load(text))


@pytest.mark.slow
def test_analysis_and_sweep_give_what_the_library_gives(load, file, tmp_path, capsys):
    design = load(PAIR + OIL + STRENGTH + RELIEF)
    numbers = (
        design.tables["lubricant"].quantity("scuffing_safety"),
        design.tables["strength"].quantity("pinion_root_safety"),
    )
    mesh = design.mesh()

    of_cycle = eqx.filter_jit(lambda cycle: [quantity(cycle) for quantity in numbers])

    def solved(amount):  # by the programs of the analysis
        return of_cycle(jg.solve(mesh, OperatingPoint(50.0, 3000.0), pinion=jg.TipRelief(amount, 4.0)))

    table = sweep_table(file(PAIR + OIL + STRENGTH + RELIEF), tmp_path)
    for row in table:
        expected = solved(row["amount"])
        np.testing.assert_allclose([row["scuffing_safety"], row["pinion_root_safety"]], expected, rtol=1e-9)
    with pytest.raises(ValueError, match=r"holds a sweep of other settings \(.*friction"):
        sweep_table(file(PAIR + "friction = 0.05" + OIL + STRENGTH + RELIEF), tmp_path)
    fixed = RELIEF.partition("[variables]")[0].replace('"amount"', "6.0")
    path = file(PAIR + OIL + STRENGTH + fixed)
    assert run.run_study(AnalysisStudy, {}, path, tmp_path / "out", figures=False, cache=False)
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    modified, expected = summary["designs"]["modified"], solved(6.0)
    assert [modified[quantity.key] for quantity in numbers] == pytest.approx([float(number) for number in expected])
    assert summary["lubricant"]["viscosity_40_mm2_per_s"] == 100.0 and summary["lubricant"]["friction"] == "schlenk"
    assert summary["strength"] == {"pitting_MPa": 1500.0, "bending_MPa": 900.0, "load_factor": 1.0}
    shown = capsys.readouterr().out
    for label in ("scuffing safety S_B", "pinion root safety S_F", "power loss of the flanks [W]"):
        assert label in shown
    assert "micropitting" not in shown


@pytest.mark.slow
def test_other_oils_and_strengths_are_other_numbers_of_one_program(load, monkeypatch):
    traced = []
    monkeypatch.setattr(evaluation, "summary", lambda cycle: {})

    @program
    def numbers(*of):
        traced.append(of)
        return evaluation._numbers.__wrapped__(*of)

    cycle = jg.solve(load(PAIR).mesh(), OperatingPoint(50.0, 3000.0))
    for temperature in ("80.0", "90.0"):
        design = load(PAIR + OIL.replace("80.0", temperature) + STRENGTH.replace("900.0", f"9{temperature}"))
        further = tuple(quantities_of_tables(design))
        found, _ = numbers(cycle, *share_settings(further))
        each = eqx.filter_jit(lambda cycle, of=further: {quantity.key: quantity(cycle) for quantity in of})(cycle)
        expected = {name: float(value) for name, value in each.items()}
        assert {name: float(value) for name, value in found.items()} == pytest.approx(expected, rel=1e-9)
    assert len(traced) == 1


@pytest.mark.slow
def test_a_sweep_over_the_speed(load, file, tmp_path):
    variable = RELIEF.replace("[variables]", '[variables]\nn = { low = 500.0, high = 5000.0, unit = "rpm" }')
    text = PAIR.replace("speed = 3000.0", 'speed = "n"') + OIL + STRENGTH + variable
    design = load(text)
    mesh, quantity = design.mesh(), design.tables["lubricant"].quantity("loss_power")
    for row in sweep_table(file(text), tmp_path):
        cycle = jg.solve(mesh, OperatingPoint(50.0, row["n"]), pinion=jg.TipRelief(row["amount"], 4.0))
        assert row["loss_power_W"] == pytest.approx(float(quantity(cycle)), rel=1e-9)


def sweep_table(path, folder):
    """Rows of the sweep of a design file."""
    assert run.run_study(SweepStudy, {"best": 2}, path, folder / "sweep", figures=False, cache=False)
    import pyarrow.dataset as dataset

    return dataset.dataset(folder / "sweep" / "table").to_table().to_pylist()
