"""The command `jaxgear identify`: what it writes, its priors, and what it refuses."""

import csv
import json
import signal

import jax.numpy as jnp
import numpy as np
import pytest
from commands import FIXED, VARIABLES, assert_refused, call

from jaxgear.conditions import solve_case
from jaxgear.contact.kinematics import kinematics
from jaxgear.identification import IdentificationStudy, Identified
from jaxgear.identification import study as identification
from jaxgear.io import DesignFile, load_design
from jaxgear.numerics import real
from jaxgear.rexs import read_rexs
from jaxgear.tolerance import ToleranceClass

BASE = FIXED.replace("amount = 6.5", 'amount = "height"') + VARIABLES
BOTH = (
    BASE.replace("amount = 7.5", 'amount = "depth"') + 'depth = { low = 0.0, high = 16.0, value = 6.0, unit = "um" }\n'
)
CLASSES = "[tolerance]\nquality_class = [5, 7]\n"
TRUE, TORQUES = 8.0, (30.0, 60.0)


def written(folder, base=BASE):
    """A design file with a relief that is unknown, and readings that are good but for their values."""
    path, data = folder / "pair.toml", folder / "te.csv"
    path.write_text(base, encoding="utf-8")
    rows = [f"{phase / 16},{torque},{phase % 3},{1 + phase % 2}" for torque in TORQUES for phase in range(16)]
    data.write_text("\n".join(["phase,torque_Nm,te_um,revolution", *rows]), encoding="utf-8")
    return path, data


def measured(folder):
    """The same with the transmission error of the true relief."""
    path, data = written(folder)
    design, noise = load_design(path), np.random.default_rng(1)
    mesh, rows = design.mesh(design.resolution(60.0)), ["phase,torque_Nm,te_um"]
    for torque in TORQUES:
        found = solve_case(mesh, jnp.asarray(torque), *design.design({"height": jnp.asarray(TRUE)}))
        read = np.asarray(found.transmission_error) + 0.05 * noise.standard_normal(16)
        rows += [f"{phase},{torque},{value}" for phase, value in zip(np.asarray(mesh.phase), read)]
    data.write_text("\n".join(rows), encoding="utf-8")
    return path, data


class Search:
    """Takes the place of the search: gives an estimate of the relief and keeps what was asked for."""

    def __init__(self, monkeypatch, height):
        self.height = height
        monkeypatch.setattr(identification, "identify", self)
        monkeypatch.setattr("jaxgear.studies.summary.gears", lambda design: {})  # which other tests compile
        monkeypatch.setattr(DesignFile, "mesh", lambda self, size: kinematics(self.pair(), real(0.0), size, "strain"))

    def __call__(self, mesh, measurement, design, prior, **asked):
        self.asked = {"mesh": mesh} | asked
        left = 0.3 * np.cos(4 * np.pi * measurement.phase)  # the second mesh order
        own = len(prior) + 1
        pitches = [f"{gear}_pitch_{tooth}" for gear, teeth in (("pinion", 19), ("wheel", 48)) for tooth in range(teeth)]
        names = (*prior, "torque_scale", *(pitches if asked["single_pitch"] else ()))
        count = len(names)
        return Identified(
            names=names,
            own=own,
            estimate=jnp.where(jnp.arange(count) < own, self.height, jnp.arange(count) - own),
            deviation=jnp.full(count, 0.5),
            correlation=0.8 + 0.2 * jnp.eye(count),
            prior=jnp.ones((2, count)),
            singular_values=jnp.where(jnp.arange(count) < own - 1, 10.0, 0.1),
            directions=jnp.eye(count),
            torque=measurement.torque,
            phase=measurement.phase,
            measured=measurement.transmission_error,
            fitted=measurement.transmission_error - left,
            noise=jnp.full_like(measurement.phase, 0.05),
            model_error=jnp.asarray(0.1),
            chi_square=jnp.asarray(1.0),
            converged=jnp.asarray(True),
            candidates=jnp.array([50.0]),
            candidate_singular_values=jnp.full((1, count), 0.2),
        )


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """One run of the command."""
    folder = tmp_path_factory.mktemp("identify")
    path, data = written(folder, BOTH.replace("positions = 16", "positions = 32") + CLASSES)
    with pytest.MonkeyPatch.context() as monkeypatch:
        search = Search(monkeypatch, 8.0)
        monkeypatch.setenv("JAXGEAR_NO_CACHE", "1")
        result = call(
            "identify", path, data, "--noise", 0.05, "--offset", 2, "--pitch", "--quick", "-o", folder / "out"
        )
    assert result.code == 0, result.err
    summary = json.loads((folder / "out" / "summary.json").read_text(encoding="utf-8"))
    return result, folder / "out", summary, search


def test_its_files(ran):
    _, folder, summary, _ = ran
    names = {"pitch.png", "pitch_pinion.csv", "pitch_wheel.csv"} | {
        "summary.json",
        "flanks.csv",
        "k_chart.png",
        *(f"identified.{end}" for end in ("csv", "toml", "rexs", "png")),
    }
    assert {path.name for path in folder.iterdir()} == names
    with (folder / "identified.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [(row["name"], row["unit"]) for row in rows] == [("height", "um"), ("depth", "um"), ("torque_scale", "")]
    assert summary["unknowns"]["height"]["estimate"] == float(rows[0]["estimate"]) == 8.0


def test_the_flanks_it_writes_are_those_of_the_estimates(ran):
    folder = ran[1]
    assert [float(flank.amount) for flank in load_design(folder / "identified.toml").design({})] == [8.0, 8.0]
    assert (folder / "identified.rexs").read_text(encoding="utf-8-sig").startswith("<?xml")
    with (folder / "flanks.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    largest = {(row["design"], row["gear"]): float(row["modification_um"]) for row in rows}  # the last is at the tip
    assert largest[("identified", "pinion")] == 8.0 and largest[("prior", "pinion")] == 10.0
    assert largest[("identified", "wheel")] == 8.0 and largest[("prior", "wheel")] == 6.0


def test_pitch_deviations_are_those_of_the_teeth_of_a_design_file(ran, tmp_path):
    _, folder, summary, search = ran
    design = load_design(folder / "identified.toml")
    expected = [
        float(ToleranceClass.of(gear, number).single_pitch) / 3 for gear, number in zip(design.pair().gears, (5, 7))
    ]
    assert search.asked["single_pitch"] == pytest.approx(expected)
    for gear, first, count in (("pinion", 0, 19), ("wheel", 19, 48)):
        with (folder / f"pitch_{gear}.csv").open(encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        assert [int(row["tooth"]) for row in rows] == list(range(count))
        assert [float(row["single_pitch_um"]) for row in rows] == list(range(first, first + count))
        assert summary[f"{gear}_single_pitch_um"]["estimate"] == [float(row["single_pitch_um"]) for row in rows]
    assert set(summary["unknowns"]) == {"height", "depth", "torque_scale"}


def test_what_it_says(ran):
    result, _, summary, _ = ran
    assert "correlation of height and torque_scale: 0.80" in result.out
    assert "least: 50 N m" in result.out and "quick run, coarse positions" in result.out
    first, second = summary["cannot_tell"]
    assert first.startswith("torque_scale cannot be told: ") and first in result.out
    assert second.startswith("67 combinations of 67 pitch deviations cannot be told")


def test_what_the_fit_leaves_is_given_by_mesh_orders(ran):
    result, _, summary, _ = ran
    expected = np.where(np.arange(7) == 1, 0.3, 0.0)  # 16 readings tell 7 orders
    np.testing.assert_allclose(summary["residual_orders_um"], [expected] * 2, atol=1e-12)
    # of 16 readings the cosine and the sine each scatter with sqrt(2/16) of the noise, see Rayleigh's law
    np.testing.assert_allclose(summary["noise_orders_um"], 0.05 * np.sqrt(-2 * np.log(0.05) * 2 / 16))
    assert "order 2" in result.out and "0.300" in result.out


def test_what_it_asks_for(ran):
    asked = ran[3].asked
    assert asked["offset"] == 2.0 and asked["torque_scale"] == 0.01 and asked["candidates"] == [50.0]
    assert asked["mesh"].resolution.positions == 16  # of a quick run


def test_priors_are_those_of_the_class_of_each_gear(tmp_path):
    path, data = written(tmp_path, BOTH + CLASSES)
    design = load_design(path)
    prior = IdentificationStudy.of(design, measured=data, noise=0.05).prior
    for (mean, deviation), gear, number, value in zip(prior.values(), design.pair().gears, (5, 7), (10.0, 6.0)):
        assert mean == value and deviation == pytest.approx(float(ToleranceClass.of(gear, number).profile_total) / 3)
    (tmp_path / "pair.toml").write_text(BASE, encoding="utf-8")
    assert IdentificationStudy.of(load_design(path), measured=data, noise=0.05).prior == {"height": (10.0, 5.0)}


def test_an_estimate_that_is_no_flank_is_flagged_and_makes_no_design_file(tmp_path, monkeypatch):
    base = FIXED.replace("length = 5.0", 'length = "height"', 1) + "[variables]\nheight = { low = 1.0, high = 6.0 }\n"
    Search(monkeypatch, -1.0)
    result = call("identify", *written(tmp_path, base), "--noise", 0.05, "-o", tmp_path / "out", "--no-figures")
    assert result.code == 1 and "NO DESIGN FILE" in result.err and "outside its range" in result.out
    assert {one.name for one in (tmp_path / "out").iterdir()} == {"summary.json", "identified.csv"}


def test_flanks_that_rexs_has_no_place_for_are_said_and_left_out(tmp_path, monkeypatch):
    Search(monkeypatch, 8.0)
    path, data = written(tmp_path, BASE + "[pair]\naxial_offset = 1.0\n")
    result = call("identify", path, data, "--noise", 0.05, "-o", tmp_path / "out", "--no-figures")
    assert result.code == 0 and "identified.rexs is not written: " in result.out
    names = {"summary.json", "identified.csv", "identified.toml", "flanks.csv"}
    assert {one.name for one in (tmp_path / "out").iterdir()} == names


def test_interrupted_it_leaves_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(DesignFile, "mesh", lambda *_: None)
    monkeypatch.setattr(identification, "identify", lambda *_, **__: signal.raise_signal(signal.SIGINT))
    result = call("identify", *written(tmp_path), "--noise", 0.05, "-o", tmp_path / "out")
    assert result.code == 130 and result.err.endswith("jaxgear: interrupted, nothing was written\n")
    assert "Traceback" not in result.err and {one.name for one in tmp_path.iterdir()} == {"pair.toml", "te.csv"}


@pytest.mark.parametrize(
    ("base", "change", "options", "fragments"),
    [
        (BASE, ("te_um", "te"), ["--noise", 0.1], ["te.csv", "te: unknown column"]),
        (BASE, (",30.0,", ",x,"), ["--noise", 0.1], ["te.csv", "torque_Nm"]),
        (BASE, ("", ""), ["--noise", -1], ["noise = -1 um must be greater than 0 um"]),
        (BASE, ("", ""), ["--noise", 0.1, "--offset", -1], ["offset = -1 um must be at least 0 um"]),
        (BASE, ("", ""), [], ["te.csv: te_um: noise = None needs 12 repeated readings", "--noise gives it"]),
        (FIXED, ("", ""), ["--noise", 0.1], ["pair.toml", "variables: missing"]),
        (BASE, ("", ""), ["--noise", 0.1, "--pitch"], ["pair.toml", "tolerance: missing; --pitch takes"]),
        (BASE + CLASSES, ("", ""), ["--noise", 0.1, "--pitch"], ["te.csv: te_um: offset", "--offset gives"]),
        (
            BASE + CLASSES,
            ("revolution", "repeat"),
            ["--pitch", "--offset", 5, "--noise", 0.1],
            ["te.csv: phase: covers 0.94"],
        ),
    ],
)
def test_what_is_refused_leaves_nothing(tmp_path, base, change, options, fragments):
    path, data = written(tmp_path, base)
    data.write_text(data.read_text().replace(*change) if change[0] else data.read_text(), encoding="utf-8")
    assert_refused(call("identify", path, data, *options, "-o", tmp_path / "out"), *fragments)
    assert {one.name for one in tmp_path.iterdir()} == {"pair.toml", "te.csv"}


def test_a_file_that_is_not_there(tmp_path):
    assert_refused(call("identify", written(tmp_path)[0], tmp_path / "none.csv"), "none.csv: No such file")


@pytest.mark.slow
def test_the_command_finds_the_relief(tmp_path):
    path, data = measured(tmp_path)
    found = call("identify", path, data, "--noise", 0.05, "--output", tmp_path / "out", "--report")
    assert found.code == 0, found.err
    assert (tmp_path / "out" / "report.html").exists()
    height = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))["unknowns"]["height"]
    exchanged = read_rexs(tmp_path / "out" / "identified.rexs")
    assert float(exchanged.pinion.amount) == pytest.approx(height["estimate"])
    assert abs(height["estimate"] - TRUE) < 3 * height["standard_deviation"] < 3 * height["prior_standard_deviation"]
