"""The command `jaxgear identify`: what it writes, its priors, and what it refuses."""

import csv
import json

import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import pytest
from commands import FIXED, VARIABLES, assert_refused, call

from jaxgear.conditions import solve_case
from jaxgear.io import load_design
from jaxgear.optimize import Identified
from jaxgear.studies import DesignIdentification, IdentificationResult, write_results
from jaxgear.tolerance import ToleranceClass

BASE = FIXED.replace("amount = 6.5", 'amount = "height"') + VARIABLES
TRUE, TORQUES = 8.0, (30.0, 60.0)


def written(folder, base=BASE):
    """A design file with a relief that is unknown, and readings that are good but for their values."""
    path, data = folder / "pair.toml", folder / "te.csv"
    path.write_text(base, encoding="utf-8")
    rows = [f"{phase / 16},{torque},{phase % 3}" for torque in TORQUES for phase in range(16)]
    data.write_text("\n".join(["phase,torque_Nm,te_um", *rows]), encoding="utf-8")
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


def result_of(study, height):
    """A result with an estimate of the relief, without a search."""
    data = study.measurement
    found = Identified(
        names=("height", "torque_scale"),
        estimate=jnp.array([height, 1.0]),
        deviation=jnp.array([0.5, 0.01]),
        correlation=jnp.array([[1.0, 0.8], [0.8, 1.0]]),
        prior=jnp.array([[10.0, 1.0], [5.0, 0.01]]),
        singular_values=jnp.array([10.0, 0.1]),
        directions=jnp.eye(2),
        torque=data.torque,
        phase=data.phase,
        measured=data.transmission_error,
        fitted=data.transmission_error,
        noise=jnp.full_like(data.phase, 0.05),
        model_error=jnp.asarray(0.1),
        chi_square=jnp.asarray(1.0),
        converged=jnp.asarray(True),
        candidates=jnp.array([50.0]),
        told_by_candidates=jnp.array([[10.0, 0.2]]),
    )
    return IdentificationResult(study.design, study.measured, found)


def test_what_is_found_is_said_and_written(tmp_path):
    path, data = written(tmp_path)
    study = DesignIdentification.of(load_design(path), measured=data, noise=0.05)
    result = result_of(study, 8.0)
    assert study.prior == {"height": (10.0, 5.0)}
    assert not list(result.failures()) and not result.findings()
    summary, _ = write_results(tmp_path / "out", study, result, figures=False)
    assert summary["unknowns"]["height"]["estimate"] == 8.0 and summary["unknowns"]["height"]["unit"] == "um"
    said = list(result.verdict())
    assert "correlation of height and torque_scale: 0.80" in said and "50 N m" in said[-1]
    assert summary["cannot_tell"] == [line for line in said if "cannot be told" in line] != []
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["cannot_tell"] == summary["cannot_tell"]
    with (tmp_path / "out" / "identified.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [(row["name"], row["unit"]) for row in rows] == [("height", "um"), ("torque_scale", "")]
    made = load_design(tmp_path / "out" / "identified.toml")
    assert float(made.design({})[0].amount) == 8.0
    panels = np.ravel(result.figures()["identified"])
    assert panels[-1].get_xlabel() == "phase [base pitches]"
    assert [panel.get_ylabel() for panel in panels] == ["TE at 30 N m [µm]", "TE at 60 N m [µm]"]
    plt.close("all")


def test_an_estimate_that_is_no_flank_is_flagged_and_makes_no_design_file(tmp_path):
    base = FIXED.replace("length = 5.0", 'length = "height"', 1) + "[variables]\nheight = { low = 1.0, high = 6.0 }\n"
    path, data = written(tmp_path, base)
    study = DesignIdentification.of(load_design(path), measured=data, noise=0.05)
    result = result_of(study, -1.0)
    write_results(tmp_path / "out", study, result, figures=False)
    assert "NO DESIGN FILE" in next(iter(result.failures())) and "outside its range" in result.findings()[0]
    assert {one.name for one in (tmp_path / "out").iterdir()} == {"summary.json", "identified.csv"}


@pytest.mark.slow
def test_the_search_finds_the_relief(tmp_path):
    path, data = measured(tmp_path)
    result = DesignIdentification.of(load_design(path), measured=data, noise=0.05).run()
    height = result.summary()["unknowns"]["height"]
    assert not list(result.failures())
    assert abs(height["estimate"] - TRUE) < 3 * height["standard_deviation"] < 3 * height["prior_standard_deviation"]


def test_priors_are_those_of_the_tolerance_class(tmp_path):
    path, data = written(
        tmp_path, BASE.replace("high = 20.0", "high = 20.0, value = 6.0") + "[tolerance]\nquality_class = 6\n"
    )
    design = load_design(path)
    mean, deviation = DesignIdentification.of(design, measured=data, noise=0.05).prior["height"]
    limit = ToleranceClass.of(design.pair().pinion, 6).profile_total
    assert mean == 6.0 and deviation == pytest.approx(float(limit) / 3)


@pytest.mark.parametrize(
    ("base", "change", "options", "fragments"),
    [
        (BASE, ("te_um", "te"), ["--noise", 0.1], ["te.csv", "te: unknown column"]),
        (BASE, (",30.0,", ",x,"), ["--noise", 0.1], ["te.csv", "torque_Nm"]),
        (BASE, ("", ""), ["--noise", -1], ["noise = -1 um must be greater than 0 um"]),
        (BASE, ("", ""), ["--noise", 0.1, "--offset", -1], ["offset = -1 um must be at least 0 um"]),
        (FIXED, ("", ""), ["--noise", 0.1], ["pair.toml", "variables: missing"]),
    ],
)
def test_what_is_refused_leaves_nothing(tmp_path, base, change, options, fragments):
    path, data = written(tmp_path, base)
    data.write_text(data.read_text().replace(*change) if change[0] else data.read_text(), encoding="utf-8")
    assert_refused(call("identify", path, data, *options, "-o", tmp_path / "out"), *fragments)
    assert {one.name for one in tmp_path.iterdir()} == {"pair.toml", "te.csv"}


def test_data_without_repeats_need_their_noise(tmp_path):
    found = call("identify", *written(tmp_path), "-o", tmp_path / "out")
    line = found.err.splitlines()[-1]  # after the stages
    assert found.code == 2 and found.out == "" and "te.csv: te_um: noise = None needs" in line and "--noise" in line
    assert {one.name for one in tmp_path.iterdir()} == {"pair.toml", "te.csv"}


def test_a_file_that_is_not_there(tmp_path):
    assert_refused(call("identify", written(tmp_path)[0], tmp_path / "none.csv"), "none.csv: No such file")


@pytest.mark.slow
def test_the_command_writes_its_results(tmp_path):
    found = call("identify", *measured(tmp_path), "--noise", 0.05, "--output", tmp_path / "out", "--report")
    assert found.code == 0, found.err
    names = {"identified.csv", "identified.toml", "identified.png", "report.html", "summary.json"}
    assert {path.name for path in (tmp_path / "out").iterdir()} == names
