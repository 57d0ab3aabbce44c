"""The command `jaxgear dynamics` and the table [dynamics]: what it writes and says, and one line for what is wrong."""

import csv
import dataclasses
import importlib
import json
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from commands import LINE, call
from design_texts import asked_sweep
from report_page import check_report

from jaxgear.dynamics import Oscillator, RectangularStiffness, SpeedResponse
from jaxgear.io import DesignFileError, load_design
from jaxgear.studies import Checkpoints, DynamicsResult, DynamicsStudy
from jaxgear.studies.checkpoints import SpeedResponses

pytestmark = pytest.mark.usefixtures("no_cache")

GEAR = """
teeth = 50
module = 3.0
face_width = 20.0
tip_diameter = 154.5709
bore_diameter = 40.0
tooth_thickness_allowance = -60.0
"""
PAIR = f"""
[pinion]{GEAR}
[wheel]{GEAR}
[load]
torque = 200.0
[resolution]
{LINE}
"""
TABLE = """
[dynamics]
mesh_frequencies = [1500.0, 3500.0]
number = 9
pinion_inertia = 7.8e-3
wheel_inertia = 7.8e-3
model = "varying stiffness"
positions = 32
steps = 64
torque_factors = [1.0]
"""
FIGURES = (
    "dynamic_factor",
    "dte_rms",
    "waterfall",
    "order_tracks",
    "run_up",
    "bifurcation",
    "phase_portrait",
    "branches",
)


@pytest.mark.parametrize("quick", [["--quick"], pytest.param([], marks=pytest.mark.slow)], ids=["quick", "whole"])
def test_the_command_writes_what_it_says(file, tmp_path, monkeypatch, quick):
    monkeypatch.setattr(importlib.import_module("jaxgear.studies.dynamics"), "_QUICK_SPEEDS", 9)
    path, folder = file(PAIR + TABLE + "run_up = 0.1\n[tolerance]\nquality_class = 7\n"), tmp_path / "out"
    done = call("dynamics", str(path), "--output", str(folder), "--report", *quick)
    code, out, err = done.code, done.out, done.err
    assert code == 0, err
    assert "[tolerance] is not part of this analysis, the gears are nominal\n" in err
    assert {entry.name for entry in folder.iterdir()} == {
        "summary.json",
        "responses.csv",
        "run_up.csv",
        "report.html",
        *(f"{name}.png" for name in FIGURES),
    }
    assert not list(tmp_path.glob(".out*"))  # what was kept is no longer needed
    with (folder / "responses.csv").open() as lines:
        rows = list(csv.DictReader(lines))
    assert len(rows) == 2 * 3 * 9  # unmodified and rule-based, three runs, nine speeds
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["left_out"].startswith("[tolerance]")
    for design, data in summary["designs"].items():
        for run in data["runs"]:
            of_run = [row for row in rows if (row["design"], row["speed"]) == (design, run["speed"])]
            factors = np.array([float(row["dynamic_factor"]) for row in of_run])
            assert run["max_dynamic_factor"] == pytest.approx(factors.max(), rel=1e-6)
            assert run["at_dynamic_factor_Hz"] == pytest.approx(float(of_run[factors.argmax()]["mesh_frequency_Hz"]))
            assert (factors > 0.99).all()  # the mean of the force over an orbit is the static one
            assert 1500.0 < run["natural_frequency_Hz"] < 3500.0
            for row in of_run:
                force, level = float(row["force_order_1_N"]), float(row["force_order_1_dB_re_1uN"])
                assert force > 0 and level == pytest.approx(20 * np.log10(force / np.sqrt(2) / 1e-6), abs=1e-4)
            assert float(of_run[0]["pinion_speed_rpm"]) == pytest.approx(1800.0)  # 50 teeth, 60 s
    worst = {name: max(run["max_dynamic_factor"] for run in data["runs"]) for name, data in summary["designs"].items()}
    assert 1 < worst["rule-based"] < worst["unmodified"]
    assert f"unmodified {worst['unmodified']:.3f}, rule-based {worst['rule-based']:.3f}" in out
    assert "rule-based" in out and "down, kicked" in out
    of = "evaluated at 32 positions of the mesh force and 64 steps per mesh cycle; twice as many change"
    assert summary["quick"] == bool(quick) == (of not in out)
    for name, data in summary["designs"].items():
        assert ("change_at_twice_the_positions_and_steps" in data) != bool(quick)
        if not quick:
            change = data["change_at_twice_the_positions_and_steps"]["worst_dynamic_factor"]
            assert 0 < abs(change) < 0.05 and f"{name} by {change:+.2g}" in out
    check_branches(summary, rows)
    check_run_ups(folder, summary, out)
    page = check_report(folder, path, "dynamics", path, "--output", folder, "--report", *quick)
    assert any(row[0] == "unmodified" and f"{worst['unmodified']:.3f}" in row for row in page.rows)


def check_run_ups(folder, summary, out):
    """From the lowest to the highest speed, with the factors that the summary and the terminal say."""
    with (folder / "run_up.csv").open() as lines:
        rows = list(csv.DictReader(lines))
    assert summary["run_up_s"] == 0.1
    for design, data in summary["designs"].items():
        (risen,) = data["run_ups"]
        of_design = [row for row in rows if row["design"] == design]
        assert len(of_design) == 200
        last = {name: float(of_design[-1][name]) for name in ("time_s", "mesh_frequency_Hz", "pinion_speed_rpm")}
        assert last == pytest.approx({"time_s": 0.08, "mesh_frequency_Hz": 3500.0, "pinion_speed_rpm": 4200.0})
        assert risen["max_dynamic_factor"] == pytest.approx(max(float(row["dynamic_factor"]) for row in of_design))
        assert f"{design} {risen['max_dynamic_factor']:.3f} at {risen['at_dynamic_factor_Hz']:.0f} Hz" in out
        assert 1 < risen["max_dynamic_factor"] < 1.1 * max(run["max_dynamic_factor"] for run in data["runs"])


def check_branches(summary, rows):
    """Jumps of the runs are folds of the branch that they lie on."""
    branch, *_ = summary["branches_of_unmodified"]
    assert branch["period_mesh_cycles"] == 1 and branch["ended"] == "range"
    folds = [one["mesh_frequency_Hz"] for one in branch["bifurcations"] if one["kind"] == "fold"]
    assert folds and len(folds) % 2 == 0
    up, down = (
        np.array([float(row["dynamic_factor"]) for row in rows if (row["design"], row["speed"]) == ("unmodified", run)])
        for run in ("up", "down")
    )
    speeds = np.linspace(1500.0, 3500.0, 9)
    apart = np.abs(up - down) > 0.01 * up  # two steady states: only between the folds
    assert apart.any()
    assert ((speeds[apart] > min(folds)) & (speeds[apart] < max(folds))).all()


@pytest.mark.parametrize(
    "text, message",
    [
        ("", "dynamics: missing; it says at which speeds the pair runs"),
        ("[dynamics]\n", "dynamics: needs mesh_frequencies [Hz] or speeds [rpm]"),
        (TABLE + "speeds = [1.0, 2.0]\n", "dynamics: mesh_frequencies and speeds are both given"),
        (TABLE + "damping_ratio = 2.0\n", "dynamics.damping_ratio: 2 must be at least 0 and at most 1"),
        (TABLE + "run_up = 0.05\n", "dynamics.run_up: 0.05 s holds 125 mesh cycles, needs 200"),
        (TABLE + "kick = 1e6\n", "dynamics.kick: 1e+06 must be at least 1 and at most 50"),
        (TABLE.replace("[1500.0, 3500.0]", "[1.0, 8.0]"), "dynamics.steps: 64 must be at least"),
        (TABLE.replace("3500.0", "1000.0"), "dynamics.mesh_frequencies[1]: 1000 Hz must be greater than 1500 Hz"),
        (TABLE.replace("3500.0", '"fast"'), "dynamics.mesh_frequencies[1]: must be a number, not a string"),
        (TABLE.replace("[1.0]", "[1.0, 1.0]"), "dynamics.torque_factors: must all be different"),
        (TABLE + "dampings = 1.0\n", 'dynamics.dampings: unknown key, did you mean "damping"?'),
        (TABLE + "damping_ratio = -0.1\n", "dynamics.damping_ratio: -0.1 must be at least 0"),
        (TABLE + "pinion_bearing = [100.0, 100.0]\n", "pinion_bearing and wheel_bearing must both be given, or none"),
        (TABLE + "damping_ratio = 0.1\ndamping = 1e-3\n", "damping_ratio and damping are both given"),
    ],
)
def test_what_is_wrong_with_the_table_is_one_line(file, tmp_path, text, message):
    done = call("dynamics", str(file(PAIR + text)), "--output", str(tmp_path / "out"))
    code, out, err = done.code, done.out, done.err
    lines = err.strip().splitlines()
    assert code == 2 and out == ""
    assert message in lines[-1] and lines[-1].startswith("jaxgear: error: ")
    assert not (tmp_path / "out").exists()


def test_masses_that_cannot_resonate_and_bores_left_open_are_said(file):
    """In one line each, from what a study holds."""
    wanted = {
        "bore_diameter = 40.0\n": "",
        "pinion_inertia = 7.8e-3\n": "",
        "wheel_inertia = 7.8e-3": "wheel_inertia = 450.0",
    }
    text = PAIR + TABLE
    for old, new in wanted.items():
        text = text.replace(old, new)
    design = load_design(file(text))
    settings = DynamicsStudy.of(design).settings
    study = SimpleNamespace(
        design=design, settings=settings, torque=200.0, natural_frequencies={"unmodified": {200.0: 20.0}}
    )
    (far,), (bore,) = DynamicsResult._far_from_resonance(study), DynamicsResult._bodies(study)
    assert "all speeds lie at 75 to 175 times the natural frequency of 20 Hz" in far and "pinion_inertia" in far
    assert bore.startswith("pinion: no bore_diameter, the inertia is of a solid disc, 0.00")
    assert "a bore of 71.2 mm" in bore


def test_speeds_of_the_pinion_are_mesh_frequencies(file):
    text = PAIR + TABLE.replace("mesh_frequencies = [1500.0, 3500.0]", "speeds = [1800.0, 4200.0]")
    study = DynamicsStudy.of(load_design(file(text)))
    frequencies = np.asarray(study.settings.mesh_frequencies)
    assert frequencies == pytest.approx(np.linspace(1500.0, 3500.0, 9))  # 50 teeth, 60 s
    assert study.torques == (200.0,)


SWEEP = """
[sweep]
samples = 4
results = ["ppte", "{name}"]
[variables]
height = {{ low = 0.0, high = 8.0, unit = "um" }}
[[pinion.modification]]
type = "tip_relief"
amount = "height"
length = 3.0
"""


def test_a_design_file_binds_names_to_its_settings(file):
    """The settings of the table, and a refusal in one line without them."""
    text = PAIR + SWEEP.format(name="worst_dynamic_factor")
    results = asked_sweep(load_design(file(text + TABLE))).results
    study = DynamicsStudy.of(load_design(file(text + TABLE)))
    assert results == ("ppte", study.settings.quantity("worst_dynamic_factor"))
    with pytest.raises(DesignFileError, match=r'sweep.results\[1\]: "worst_dynamic_factor" needs the table \[dynam'):
        asked_sweep(load_design(file(text)))
    with pytest.raises(DesignFileError, match='"dte_rms" needs load.speed'):
        asked_sweep(load_design(file(PAIR + SWEEP.format(name="dte_rms") + TABLE)))


def test_kept_responses_are_not_made_again(tmp_path):
    """After Ctrl-C the command goes on: by what they are made of, and by nothing else."""
    oscillator = Oscillator(RectangularStiffness(1.4, 0.8, 0.4), [1.0], [1.0], [1.0], mesh_damping=0.1, newton=1.0)
    made = []
    shapes = {"force_harmonics": (2, 3), "velocity_harmonics": (2, 3)}  # of two speeds, three orders and four points
    shapes |= {"poincare_dte": (2, 4), "poincare_velocity": (2, 4)}
    kinds = {"period": int, "status": np.int8}

    def sweep():
        """Stands for a sweep that takes long."""
        made.append(1)
        numbers = np.random.default_rng(0)
        names = [field.name for field in dataclasses.fields(SpeedResponse)][:14]
        given = {name: numbers.uniform(1, 9, shapes.get(name, 2)).astype(kinds.get(name, float)) for name in names}
        given["state"] = numbers.uniform(size=(2, 1)), numbers.uniform(size=(2, 1))
        return SpeedResponse(**jax.tree.map(jnp.asarray, given), orders=(1.0, 2.0, 0.5), direction="up")

    told = []
    checkpoints = Checkpoints(tmp_path / ".runs", lambda *of: told.append(of))
    first = checkpoints.of(SpeedResponses(), 2)((oscillator, "up"), sweep)
    assert told == [(1, 2)] and checkpoints.count() == 1
    again = Checkpoints(tmp_path / ".runs").of(SpeedResponses(), 2)((oscillator, "up"), sweep)
    assert len(made) == 1
    for one, other in zip(jax.tree.leaves(first), jax.tree.leaves(again), strict=True):
        assert np.array_equal(one, other) and one.dtype == other.dtype
    assert (again.direction, again.orders) == (first.direction, first.orders)
    kept = checkpoints.of(SpeedResponses(), 2)
    kept((oscillator, "down"), sweep)
    assert len(made) == 2
    for file in (tmp_path / ".runs").iterdir():  # one bit, anywhere
        whole = bytearray(file.read_bytes())
        whole[len(whole) // 2] ^= 1
        file.write_bytes(bytes(whole))
    for direction in ("up", "down"):
        kept((oscillator, direction), sweep)
    assert len(made) == 4
    Checkpoints(tmp_path / ".runs").remove()  # of a study that has kept nothing there
    assert checkpoints.count() == 2
    checkpoints.remove()
    assert not (tmp_path / ".runs").exists()


def test_a_largest_dynamic_factor_at_the_highest_speed_is_told():
    frequencies = np.array([100.0, 200.0, 300.0])

    def response(*factors):
        return SimpleNamespace(dynamic_factor=np.array(factors), mesh_frequency=frequencies)

    runs = {"rises": response(1.0, 1.2, 1.3), "peaks": response(1.0, 1.4, 1.2), "beyond": response(1.0, 1.2, 1.3)}
    study = SimpleNamespace(
        natural_frequencies={"rises": {50.0: 400.0}, "peaks": {50.0: 400.0}, "beyond": {50.0: 250.0}},
        settings=SimpleNamespace(mesh_frequencies=frequencies),
        rows=lambda: ((name, 50.0, "up", of) for name, of in runs.items()),
    )
    (told,) = DynamicsResult._still_rising(study)
    assert told.startswith("largest dynamic factor at the highest speed, 300 Hz: rises;")
