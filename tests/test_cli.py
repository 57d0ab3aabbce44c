"""The command line: what it prints and writes, and that every failure is one line that leaves nothing behind."""

import contextlib
import csv
import dataclasses
import errno
import importlib
import io
import json
import os
import re
import stat
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from commands import FIXED, FREE, LINE, assert_refused, call
from report_page import Page, check_report

import jaxgear as jg
from jaxgear import plot
from jaxgear.cli import jax_setup, main, run
from jaxgear.contact.status import Status
from jaxgear.geometry import over_balls
from jaxgear.io import Search, first_look, load_design
from jaxgear.io.folder import result_folder
from jaxgear.metrics import Finding
from jaxgear.microgeometry import NoModification
from jaxgear.numerics import Usual
from jaxgear.optimize import result as optimum_result
from jaxgear.studies import ComparisonResult, evaluation, gear_data, manufactured, optimization_result, side_by_side
from jaxgear.studies.analysis import ComparisonRun
from jaxgear.studies.gear_data import gears
from jaxgear.studies.optimization_result import OptimizationResult, front_rows, front_table, gains
from jaxgear.tolerance import ToleranceClass, iso_rounded
from jaxgear.vocabulary import quantities

pytestmark = pytest.mark.usefixtures("no_cache")

STAGES = "finite-element tables", "searching", "verifying"  # in this order
EARLIER = (
    '{"versions": {"jaxgear": "0.1.0"}, "contents": ["k_chart.png", "summary.json"]}'  # the summary of an earlier run
)
PROJECT = """
[project]
number = "4711"
customer = "<Miller> & sons"
"""
THIN = "tooth_thickness_allowance = [-90.0, -60.0]\n"
# on which gears of one slice do not stand
SHAFTS = """
[layout]
quality_class = 6
[[shafts]]
name = "in"
sections = [{ length = 160.0, diameter = 40.0 }]
bearings = [{ name = "A", position = 60.0, radial = 250.0 }, { name = "B", position = 140.0, radial = 250.0 }]
gears = [{ name = "pinion", position = 20.0, integral = true }]
couplings = [{ position = 160.0, torque = 50.0 }]
[[shafts]]
name = "out"
sections = [{ length = 190.0, diameter = 45.0 }]
bearings = [{ name = "C", position = 20.0, radial = 300.0 }, { name = "D", position = 130.0, radial = 300.0 }]
gears = [{ name = "wheel", position = 45.0, integral = true }]
couplings = [{ position = 190.0 }]
"""


@pytest.fixture(scope="module", autouse=True)
def few_torques():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(evaluation, "_TORQUES", 5)
        patch.setattr(evaluation, "_QUICK_TORQUES", 5)
        yield


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Design files, and the results of one run of each command."""
    folder = tmp_path_factory.mktemp("cli")
    fixed = FIXED.replace(LINE, f"{LINE}\nslices = 1") + SHAFTS
    fixed += PROJECT
    (folder / "fixed.toml").write_text(fixed + "[tolerance]\nquality_class = 5\nsamples = 8\n")
    (folder / "plain.toml").write_text(FIXED)
    (folder / "free.toml").write_text(FREE + 'te_iteration = { start = "unmodified" }\n')
    return folder


@pytest.fixture(scope="module")
def analyzed(folder):
    """The involute is manufactured as a relief of no height: one program for both designs."""
    made = []  # what was asked for and found, of every design

    def scatter(mesh, torque, gears, *, pinion, wheel):
        bare = jg.TipRelief(0.0, 5.0)
        pinion, wheel = (bare if isinstance(flank, NoModification) else flank for flank in (pinion, wheel))
        found = jg.monte_carlo(mesh, torque, gears, pinion=pinion, wheel=wheel)
        made.append(({"torque": torque, "pinion": pinion, "wheel": wheel, "manufactured": gears}, found))
        return found

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("JAXGEAR_NO_CACHE", "1")
        patch.setattr(manufactured, "monte_carlo", scatter)
        result = call("analyze", folder / "fixed.toml", "-o", folder / "analyzed", "--no-figures", "--report")
    summary = json.loads((folder / "analyzed" / "summary.json").read_text())
    return SimpleNamespace(**vars(result), summary=summary, made=made)


def optimization(folder, name, *options):
    """One run of the command on the free file, and what it has written."""
    os.environ["JAXGEAR_NO_CACHE"] = "1"
    target = folder / name
    typed = "optimize", folder / "free.toml", *options, "--output", target, "--report"
    result = vars(call(*typed))
    summary = json.loads((target / "summary.json").read_text())
    return SimpleNamespace(**result, summary=summary, typed=typed, target=target, quick="--quick" in options)


@pytest.fixture(scope="module")
def searched(folder):
    """A quick run, which ends on the mesh on which it begins."""
    return optimization(folder, "searched", "--quick", "--no-figures")


@pytest.fixture(scope="module")
def minimized(folder):
    """A run that ends on a finer mesh."""
    return optimization(folder, "minimized", "--no-figures")


@pytest.fixture(scope="module")
def iterated(folder):
    """A run of a method that needs no variables, on the mesh of the file."""
    return optimization(folder, "iterated", "-m", "te_iteration", "--no-figures")


@pytest.fixture(scope="module", params=["searched", pytest.param("minimized", marks=pytest.mark.slow)])
def optimized(request):
    return request.getfixturevalue(request.param)


@pytest.fixture(scope="module", params=["iterated", "minimized"])
def verified(request):
    return request.getfixturevalue(request.param)


def test_analyze_gives_what_the_library_gives(folder, analyzed):
    assert analyzed.code == 0
    file = load_design(folder / "fixed.toml")
    pinion, wheel = file.design({})
    mesh = file.mesh()
    cycle = jg.solve(mesh, 50.0, pinion=pinion, wheel=wheel)
    written = analyzed.summary["designs"]["modified"]
    for metric, value in eqx.filter_jit(jg.summary)(cycle).items():
        assert written[metric] == pytest.approx(float(value), rel=1e-9), metric
    assert written["max_flash_temperature_K"] == pytest.approx(float(jg.metrics.flash_temperature(cycle, 3000.0).max()))
    assert written["pinion_modification"] == [
        {"type": "tip_relief", "amount": 6.5, "length": 5.0, "curve": {"type": "parabolic"}}
    ]
    table = analyzed.summary["ppte_over_torque"]
    assert table["torque_Nm"][0] == 30.0 and table["torque_Nm"][-1] == 60.0
    assert table["modified_um"][-1] == pytest.approx(
        float(jg.peak_to_peak(jg.solve(mesh, 60.0, pinion=pinion, wheel=wheel).transmission_error))
    )
    assert table["unmodified_um"] == sorted(table["unmodified_um"])  # without relief PPTE grows with the torque
    finer = file.mesh(dataclasses.replace(mesh.resolution, positions=2 * mesh.resolution.positions))
    twice = jg.solve(finer, 50.0, pinion=pinion, wheel=wheel)
    changes = written["change_at_twice_the_positions"]
    assert changes.keys() == {"ppte_um", "force_excitation_N", "max_flank_pressure_MPa", "max_corner_pressure_MPa"}
    for metric, change in changes.items():
        value = jg.quantities[metric.rpartition("_")[0]](twice)
        assert change == pytest.approx(float(value) - written[metric], abs=1e-7), metric
    change = changes["max_flank_pressure_MPa"]  # none where the largest is at a position that both grids have
    pressure = f"modified by {change:+.2g} MPa" if change else "modified not"
    assert "\n  and max flank pressure: unmodified by" in analyzed.out and pressure in analyzed.out
    change = changes["ppte_um"]
    assert (
        "twice as many change PPTE: unmodified by" in analyzed.out and f"modified by {change:+.2g} um" in analyzed.out
    )


def test_designs_of_a_file_with_tolerances_are_manufactured(folder, analyzed):
    """All of them by the same random gears: the numbers are those of the library."""
    file = load_design(folder / "fixed.toml")
    pinion, wheel = file.design({})
    tolerance = jg.Tolerance.from_class(file.pair(), 5).without_lead()
    gears = jg.ManufacturedGears(tolerance, 8)
    wanted = {"torque": 50.0, "pinion": pinion, "wheel": wheel, "manufactured": gears}
    asked, scatter = analyzed.made[1]
    assert asked.keys() == wanted.keys() and eqx.tree_equal(asked, wanted)
    found = analyzed.summary["designs"]["modified"]["manufactured"]
    assert found["pairs"] == 8 and found["failed"] == 0
    assert found["nominal_ppte_um"] == pytest.approx(analyzed.summary["designs"]["modified"]["ppte_um"], rel=1e-6)
    wanted = [float(value) for value in (scatter.mean, scatter.std, scatter.ppte_quantile95)]
    assert [found[f"{name}_ppte_um"] for name in ("mean", "std", "q95")] == pytest.approx(wanted)
    assert found["mean_ppte_um"] > found["nominal_ppte_um"], "deviations spoil a relief that fits"
    line = f"8 manufactured pairs of quality class 5: PPTE {wanted[0]:.3f} um on average, 95 % below {wanted[2]:.3f} um"
    assert line in analyzed.out


def test_the_summary_says_what_was_computed(analyzed):
    pinion = analyzed.summary["gears"]["pinion"]
    assert (pinion["teeth"], pinion["module_mm"], pinion["face_width_mm"]) == (19, 3.0, 18.0)
    assert pinion["bore_diameter_mm"] == pytest.approx(24.75) and pinion["bore_given"] is False
    assert pinion["tip_diameter_mm"] == pytest.approx(63.0) and pinion["elastic_modulus_MPa"] == 206_000.0
    assert pinion["material"] == "STEEL" and "span_mm" not in pinion
    assert analyzed.summary["center_distance_mm"] == pytest.approx(100.5)
    model = analyzed.summary["model"]
    assert model["plane"] == "auto" and model["compliance"]["body"]["type"] == "elastic_ring"
    assert "bores: pinion 24.75 mm (half the root diameter, as none is given), wheel" in analyzed.out
    assert "; centre distance 100.5 mm, backlash on the line of action 0 um\n" in analyzed.out
    findings = {
        name: [finding["name"] for finding in of["findings"]] for name, of in analyzed.summary["designs"].items()
    }
    assert findings == {"unmodified": ["corner pressure"], "modified": []}
    assert analyzed.out.count("warning") == 1


def test_shafts_that_an_analysis_leaves_out_are_told(folder, analyzed):
    """On stderr, in the summary and in the report."""
    line = load_design(folder / "fixed.toml").left_out
    assert line.startswith("shafts and bearings are not part of this analysis") and "resolution.slices = 1" in line
    assert line in analyzed.err and analyzed.summary["left_out"] == line
    report = (folder / "analyzed" / "report.html").read_text("utf-8")
    assert line[1:] in report and "Shafts, bearings and housing are those of the design file" not in report


def test_what_is_not_usual_is_said_once_of_all_designs_it_concerns():
    usual, range_ = Usual(0.0, 1650.0, "MPa", "case-hardened"), Usual(0.0, 0.5, "", "steel")
    found = {
        "unmodified": (Finding("friction", "", 3.7, range_), Finding("corner pressure", "", 4689.0, usual)),
        "optimum": (
            Finding("friction", "", 3.7, range_),
            Finding("corner pressure", "", 1837.0, usual),
            Finding("flank pressure", "", 3383.0, usual),
        ),
    }
    assert list(side_by_side.finding_lines(found)) == [
        "warning: friction 3.7 is more than 0.5 (steel)",
        "warning: unmodified 4689 MPa, optimum 1837 MPa: corner pressure 1837 MPa is more than 1650 MPa "
        "(case-hardened)",
        "warning: optimum: flank pressure 3383 MPa is more than 1650 MPa (case-hardened)",
    ]


def test_optimize_compares_three_designs_and_improves(optimized):
    assert optimized.code == 0
    designs = optimized.summary["designs"]
    assert list(designs) == ["unmodified", "rule-based", "optimum"]
    before, after = designs["unmodified"]["ppte_um"], designs["optimum"]["ppte_um"]
    assert after < 0.5 * before
    assert optimized.summary["ppte_reduction_percent"] == pytest.approx(100 * (1 - after / before))
    assert list(optimized.summary["optimum"]["parameters"]) == ["height_um"]
    height = optimized.summary["optimum"]["parameters"]["height_um"]
    assert designs["optimum"]["pinion_modification"][0]["amount"] == height
    assert 2.0 < height < 15.0
    assert optimized.summary["quick"] is optimized.quick
    assert optimized.summary["versions"]["jax"] == jax.__version__


def test_rule_based_design_is_the_iso_relief_on_both_tips(folder, optimized):
    relief = jg.iso_relief(load_design(folder / "free.toml").pair(), 50.0)
    for gear in ("pinion", "wheel"):
        (part,) = optimized.summary["designs"]["rule-based"][f"{gear}_modification"]
        assert part["amount"] == pytest.approx(float(relief.amount))
        assert part["length"] == pytest.approx(float(relief.length))


def test_the_reports_hold_what_was_found(folder, analyzed, optimized):
    file = folder / "fixed.toml"
    page = check_report(
        folder / "analyzed", file, "analyze", file, "-o", folder / "analyzed", "--no-figures", "--report"
    )
    assert "img" not in page.tags
    (made,) = {page.rows.index(row) for row in page.rows if row[:1] == ["95 % quantile [um]"]}
    told = [design["manufactured"]["q95_ppte_um"] for design in analyzed.summary["designs"].values()]
    assert page.rows[made] == ["95 % quantile [um]", *(f"{value:.3f}" for value in told)]
    assert ["tolerances / quality class", "5"] in page.rows
    # whose gears they are, what stands on their drawings, and the factors of their rating
    assert page.rows[:2] == [["project number", "4711"], ["customer", "<Miller> & sons"]]
    assert analyzed.summary["project"] == {"number": "4711", "customer": "<Miller> & sons"}
    rows = {row[0]: row[1:] for row in page.rows if len(row) == 3}
    assert rows["teeth spanned, k"] == ["3", "6"] and rows["flank tolerance class"] == ["5", "5"]
    pair = load_design(file).pair()
    for gear, name in zip(pair.gears, ("pinion", "wheel")):
        drawn, limits = analyzed.summary["drawing"][name], ToleranceClass.of(gear, 5)
        assert drawn["profile_total_deviation_um"] == float(iso_rounded(limits.profile_total))
        assert drawn["ball_diameter_mm"] == pytest.approx(5.1)
    over = float(over_balls(pair.wheel, 5.1))
    assert drawn["over_balls_upper_limit_mm"] == drawn["over_balls_lower_limit_mm"] == pytest.approx(over, rel=1e-12)
    (folder / "thin.toml").write_text(file.read_text().replace("[pinion]", "[pinion]\n" + THIN, 1))
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):  # those of the command
        drawn = gears(load_design(folder / "thin.toml"))["drawing"]["pinion"]
    for key, times in (("span", np.cos(np.deg2rad(20.0))), ("over_balls", 2.3)):  # dE cos(alpha) / sin(alpha_K)
        width = drawn[f"{key}_upper_limit_mm"] - drawn[f"{key}_lower_limit_mm"]
        assert width == pytest.approx(30e-3 * times, rel=1e-9 if key == "span" else 0.05)
    chosen = "span = [22.85, 22.88]\nteeth_spanned = 3"
    (folder / "thin.toml").write_text(file.read_text().replace("[pinion]", "[pinion]\n" + chosen, 1))
    (teeth, ball, quality), (free, *_) = gear_data.chosen(load_design(folder / "thin.toml"))
    assert (float(teeth), ball, float(quality.quality_class), free) == (3.0, None, 5.0, None)
    factors = [one["pinion_form_factor"] for one in analyzed.summary["iso_6336"].values()]
    assert rows["pinion form factor, Y_F"] == [f"{factor:.6g}" for factor in factors] and factors[0] > 1
    design = next(iter(analyzed.summary["designs"].values()))
    rated = next(iter(analyzed.summary["iso_6336"].values()))
    assert rated["wheel_root_stress_MPa"] == pytest.approx(design["wheel_root_stress_MPa"], rel=1e-12)
    page = check_report(optimized.target, folder / "free.toml", *optimized.typed)
    printed = [row for row in page.rows if row[0] == "PPTE [um]"]
    ppte = [f"{design['ppte_um']:.3f}" for design in optimized.summary["designs"].values()]
    assert printed[0] == ["PPTE [um]", *ppte]  # before "all numbers"
    text = (optimized.target / "report.html").read_text("utf-8")
    assert "a [small] pair" in text and "contact analyses by method slp" in text


def test_all_files_but_figures_are_there(folder, optimized, analyzed):
    for target in (optimized.target, folder / "analyzed"):
        assert {path.name for path in target.iterdir()} == {"summary.json", "flanks.csv", "report.html"}


def test_flanks_hold_the_tip_values_of_the_designs(optimized):
    with (optimized.target / "flanks.csv").open() as file:
        rows = list(csv.DictReader(file))
    for name, design in optimized.summary["designs"].items():
        for gear in ("pinion", "wheel"):
            line = [row for row in rows if row["design"] == name and row["gear"] == gear]
            tip = float(line[-1]["modification_um"])
            amounts = [part["amount"] for part in design[f"{gear}_modification"]]
            assert tip == pytest.approx(sum(amounts), abs=1e-5)
            assert float(line[-1]["diameter_mm"]) == pytest.approx({"pinion": 63.0, "wheel": 150.0}[gear])


def test_the_table_lines_up_and_shows_what_was_asked(optimized):
    _, _, after = optimized.out.partition("a [small] pair, 50 N m on the pinion")
    lines = after[: after.index("computing time [s]")].splitlines()[1:-1]
    assert len(lines) > 20 and len({len(line) for line in lines}) == 1
    for label in ("unmodified", "rule-based", "optimum", "PPTE [um]", "mean transmission error", "max flank pressure"):
        assert label in optimized.out
    for label in ("corner pressure", "effective contact ratio", "pinion root stress", "wheel root stress"):
        assert label in optimized.out
    for label in (
        "mesh loss factor",
        "pinion tip relief, amount [um]",
        "max flash temperature [K]",
        "computing time [s]",
    ):
        assert label in optimized.out
    assert "a [small] pair, 50 N m on the pinion" in optimized.out
    assert "first-order optimality: " in optimized.out and "no variable is at a bound" in optimized.out
    ppte = optimized.summary["designs"]["optimum"]["ppte_um"]
    assert re.search(rf"PPTE \[um\].* {ppte:.3f} ", optimized.out)


def test_the_first_screen_says_what_to_grind_what_it_gains_and_whether_to_trust_it(optimized):
    """Before the table, in the words of a drawing; how the search has gone comes last."""
    named = "Modification to grind: optimum", "Gain at 50 N m", "Checks of the result"
    parts = [*named, "a [small] pair, 50 N m", "contact analyses by"]
    places = [optimized.out.index(part) for part in parts]
    assert places == sorted(places)
    before, rule, after = (design["ppte_um"] for design in optimized.summary["designs"].values())
    than_rule = f"{abs(100 * (after / rule - 1)):.1f} % {'less' if after < rule else 'more (worse)'} than rule-based"
    gain = f"{before:.3f} -> {after:.3f} um: {100 * (1 - after / before):.1f} % less than unmodified, {than_rule}"
    assert re.search(rf"  PPTE +{re.escape(gain)} \({rule:.3f}\)", optimized.out)
    (relief,) = optimized.summary["designs"]["optimum"]["pinion_modification"]
    base = 0.5 * 57.0 * np.cos(np.deg2rad(20.0))
    begins = np.sqrt(31.5**2 - base**2) - relief["length"]
    diameter = 2 * np.hypot(base, begins)
    ground = f"tip relief {relief['amount']:.2f} um over {relief['length']:.3f} mm of roll length, parabolic"
    assert f"  pinion  {ground}, from diameter {diameter:.3f} mm (roll angle" in optimized.out
    rows = [row for row in Page((optimized.target / "report.html").read_text("utf-8")).rows if len(row) == 2]
    assert next(row for row in rows if row[0] == "pinion")[1].startswith(ground)


def judged(objective, *values, ppte, verified=None):
    """Designs with an objective, as a command compares them."""
    names = "unmodified", "rule-based", "optimum"
    return {
        name: SimpleNamespace(objectives={objective: value}, metrics={"ppte_um": of}, verified=verified)
        for name, value, of in zip(names, values, ppte, strict=True)
    }


def test_gains_lead_with_the_objective_and_say_what_became_worse():
    """Less loss, bought with PPTE; a safety is to be large; a temperature has no percentages."""

    def problem(name):
        return SimpleNamespace(objectives=[quantities[name]], cases=SimpleNamespace(count=1))

    found = list(gains(judged("loss_power [W]", 290.0, 210.0, 199.7, ppte=(2.0, 0.5, 3.0)), problem("loss_power")))
    assert found == [
        (
            quantities["loss_power"].words,
            "290 -> 199.7 W: 31.1 % less than unmodified, 4.9 % less than rule-based (210)",
        ),
        (
            "PPTE",
            "2.000 -> 3.000 um: 50.0 % more (worse) than unmodified, 500.0 % more (worse) than rule-based (0.500)",
        ),
    ]
    numbers = judged("pinion_root_safety", 2.0, 2.2, 2.1, ppte=(2.0, 0.5, 3.0))
    (safety, _) = gains(numbers, problem("pinion_root_safety"))
    assert safety[1] == "2.00 -> 2.10: 5.0 % more than unmodified, 4.5 % less (worse) than rule-based (2.20)"
    numbers = judged("bulk_temperature [degC]", 80.0, 75.0, 70.0, ppte=(2.0, 0.5, 3.0))
    (hot, _) = gains(numbers, problem("bulk_temperature"))
    assert hot[1] == "80.0 -> 70.0 degC: -10 degC against unmodified, -5 degC against rule-based (75.0)"


def test_a_front_is_tabulated_drawn_and_compared(monkeypatch):
    values = np.array([[0.5, 400.0], [1.0, 380.0], [3.0, 350.0]])
    parameters = {"height": np.array([1.0, 2.0, 3.0])}
    objectives = quantities["ppte"], quantities["loss_power"]
    front = SimpleNamespace(
        objectives=[of.name for of in objectives],
        compromise=SimpleNamespace(problem=SimpleNamespace(objectives=objectives)),
        values=values,
        parameters=parameters,
        chosen=1,
    )
    both = {"unmodified": [4.0, 500.0], "rule-based": [1.2, 390.0], "compromise": [1.0, 380.0]}
    designs = {name: SimpleNamespace(objectives=dict(zip("ab", of))) for name, of in both.items()}
    # the picture has the designs that are no part of the front
    for owner, name, found in (
        (optimization_result, "response_surface", (None, None)),
        (plot, "response_surface", None),
    ):
        monkeypatch.setattr(owner, name, plot.figure.captioned("")(lambda *given, found=found, **options: found))
    monkeypatch.setattr(plot, "optimum_front", plot.figure.captioned("")(lambda front, **options: options))
    cycle = SimpleNamespace(unloaded_transmission_error=None, torque=1.0)
    optimum = SimpleNamespace(cycle=cycle, pinion=None, wheel=None, iterations=())
    monkeypatch.setattr(ComparisonResult, "figures", lambda result: iter(()))
    of = SimpleNamespace(torque=1.0), False, SimpleNamespace(phase=None), None, designs, {}, ""
    _, figure = OptimizationResult(*of, optimum, front, None, 0).figures()
    drawn = figure.axes
    assert figure.name == "front"
    assert drawn["chosen"] == 1 and {name: [*point] for name, point in drawn["others"].items()} == {
        name: both[name] for name in ("unmodified", "rule-based")
    }
    table = front_table(front, designs, {"height": "mm"})
    assert table.header == ("", "PPTE\n[um]", f"{quantities['loss_power'].words}\n[W]", "height\n[mm]")
    rows = table.rows
    assert rows[1] == ("2, compromise", "1", "380", "2") and rows[-1] == ("rule-based", "1.2", "390", "-")
    told = dict(reversed([*front_rows(front, [1, 1], designs)]))
    assert "worst distance" in told["compromise"]
    assert [text for label, text in front_rows(front, [1, 1], designs) if label == "front"] == [
        "better than unmodified in every objective: all of its 3 designs",
        "better than rule-based in every objective: 2 of its 3 designs",
    ]


def test_stages_are_lines_where_there_is_no_terminal(optimized):
    assert optimized.err.splitlines()[0] == "jaxgear: preparing the mesh"
    assert all(line.startswith("jaxgear: ") for line in optimized.err.splitlines())


def test_a_quick_run_is_coarse_and_short(folder, tmp_path, monkeypatch):
    asked = {}

    class Searched(Exception):
        pass

    def search(problem, **options):
        asked.update(options, problem=problem)
        raise Searched

    monkeypatch.setattr(importlib.import_module("jaxgear.io.optimize_table"), "minimize", search)
    monkeypatch.setenv("JAXGEAR_DEBUG", "1")
    path = tmp_path / "fine.toml"
    path.write_text(FREE.replace("positions = 16", "positions = 4096"))
    with pytest.raises(Searched), jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
        main(["optimize", str(path), "--quick", "--no-figures", "-o", str(tmp_path / "out")])
    problem = asked["problem"]
    assert asked["method"] == jg.optimize.SLP(starts=4, rounds=1, steps=10) and float(problem.cases.torque[0]) == 50.0
    assert problem.bounds == {"height": (0.0, 20.0)} and problem.mesh.resolution.positions == 16
    assert not (tmp_path / "out").exists()


def test_the_numbers_are_those_of_the_mesh_on_which_the_search_ended(optimized):
    """16 positions fit the flanks to themselves; no design is judged by other positions than the rest."""
    optimum, designs = optimized.summary["optimum"], optimized.summary["designs"]
    assert optimum["positions"] == optimized.summary["resolution"]["positions"]
    if optimized.quick:  # it ends where it began
        assert optimum["positions"] == 16
    else:
        assert optimum["positions"] >= 512
        assert f"searched at 16 positions, evaluated at {optimum['positions']} positions" in optimized.out
    assert designs["optimum"]["ppte_um"] == pytest.approx(optimum["ppte_um"], rel=1e-9)
    assert optimum["objective"] == pytest.approx(optimum["ppte_um"], rel=1e-6)
    for design in designs.values():
        assert design["objectives"] == {"ppte [um]": pytest.approx(design["ppte_um"], rel=1e-6)}
    assert "ppte [um]" not in optimized.out  # the row above says it


@pytest.mark.slow
def test_every_design_is_verified_by_finite_elements(folder, verified):
    designs, judged = verified.summary["designs"], verified.summary["optimum"]["method"] == "slp"  # by an objective
    found = {name: design["verified"] for name, design in designs.items()}
    for name, second in found.items():
        assert second["structure"] == "finite_element" and 1e-4 < abs(second["ppte_um"] - designs[name]["ppte_um"])
        wanted = {"ppte [um]": pytest.approx(second["ppte_um"], rel=1e-6)} if judged else {}
        assert second.get("objectives", {}) == wanted
    said = (line for line in verified.out.splitlines() if line.startswith("    by finite elements"))
    (row,) = (line for line in said if " -> " not in line)
    assert all(f"{second['ppte_um']:.3f}" in row for second in found.values())
    before, after = (found[name]["ppte_um"] for name in ("unmodified", "optimum"))
    fall = 100 * (1 - after / before)
    told = f"by finite elements  {before:.3f} -> {after:.3f} um: {fall:.1f} % less than unmodified"
    assert told in verified.out
    file = load_design(folder / "free.toml")
    positions = verified.summary["resolution"]["positions"]
    compliance = jg.finite_element_compliance(file.pair())
    mesh = jg.prepare(file.pair(), compliance=compliance, resolution=replace(file.resolution(), positions=positions))
    cycle = jg.solve(mesh, 50.0)
    assert before == pytest.approx(float(jg.peak_to_peak(cycle.transmission_error)), rel=1e-6)
    stages = verified.err.splitlines()
    tables, search, second = (next(i for i, line in enumerate(stages) if word in line) for word in STAGES)
    assert tables < search < second


@pytest.fixture
def not_searched(monkeypatch):
    """Runs that search nothing: designs are evaluated on the mesh of the file."""

    def evaluated(self, request, beside):
        for name, modifications in beside.items():
            self.evaluate(name, *modifications)
        self.evaluate("optimum", *beside["rule-based"])

    monkeypatch.setattr(ComparisonRun, "search", evaluated)


def test_what_cannot_be_meshed_is_not_verified(tmp_path, not_searched):
    """Few teeth on a thin rim: said before the search where it was asked for, else under the table."""
    thin = FREE.replace("teeth = 19", "teeth = 8\nprofile_shift = 0.5\nbore_diameter = 19.2")
    asked = tmp_path / "asked.toml"
    asked.write_text(thin.replace("starts = 2", "verify = true\nstarts = 2"))
    result = call("optimize", asked, "-o", tmp_path / "asked")
    assert result.code == 2 and "searching" not in result.err and not (tmp_path / "asked").exists()
    assert "asked.toml: optimize.verify: bore_diameter leaves a rim of" in result.err
    open_ = tmp_path / "open.toml"
    open_.write_text(thin)
    result = call("optimize", open_, "-m", "te_iteration", "-o", tmp_path / "open", "--no-figures")
    assert "\nnot verified by finite elements: bore_diameter leaves a rim of" in result.out
    designs = json.loads((tmp_path / "open" / "summary.json").read_text())["designs"]
    assert not any("verified" in design for design in designs.values())


def test_nobody_has_to_verify(tmp_path, not_searched):
    path = tmp_path / "alone.toml"
    path.write_text(FREE.replace("starts = 2", "verify = false\nstarts = 2"))
    result = call("optimize", path, "-m", "te_iteration", "-o", tmp_path / "alone", "--no-figures")
    assert result.code == 0 and "finite" not in result.out + result.err


@pytest.fixture(scope="module")
def robust(folder):
    """The worst of two torques, neither the one of the table, within a limit that no design keeps."""
    os.environ["JAXGEAR_NO_CACHE"] = "1"
    asked = FREE.replace("starts = 2\nsteps = 100", 'method = "factorial"\nmeasure = "worst"\ntorques = [30.0, 60.0]')
    (folder / "robust.toml").write_text(asked + 'constraint = [{ of = "max_flank_pressure", high = 100.0 }]\n')
    result = call("optimize", folder / "robust.toml", "--quick", "--no-figures", "-o", folder / "robust")
    return SimpleNamespace(**vars(result), summary=json.loads((folder / "robust" / "summary.json").read_text()))


@pytest.mark.slow
def test_table_and_verdict_are_of_one_torque_and_one_measure(folder, robust):
    optimum, designs = robust.summary["optimum"], robust.summary["designs"]
    before, after = designs["unmodified"], designs["optimum"]
    assert optimum["ppte_um"] == pytest.approx(after["ppte_um"], rel=1e-9)
    assert "Gain at 50 N m" in robust.out
    assert re.search(rf"  PPTE +{before['ppte_um']:.3f} -> {after['ppte_um']:.3f} um", robust.out)
    mesh = load_design(folder / "robust.toml").mesh()
    relief = designs["rule-based"]["pinion_modification"][0]
    tip = jg.TipRelief(relief["amount"], relief["length"])
    worst = max(
        float(jg.peak_to_peak(jg.solve(mesh, torque, pinion=tip, wheel=tip).transmission_error))
        for torque in (30.0, 60.0)
    )
    assert designs["rule-based"]["objectives"] == {"worst ppte [um]": pytest.approx(worst, rel=1e-6)}
    assert after["objectives"]["worst ppte [um]"] == pytest.approx(optimum["objective"], rel=1e-6)
    (row,) = (line for line in robust.out.splitlines() if "worst ppte [um]" in line and "->" not in line)
    assert all(f"{design['objectives']['worst ppte [um]']:.4g}" in row for design in designs.values())
    both = [design["objectives"]["worst ppte [um]"] for design in (before, after)]
    assert re.search(rf"  worst PPTE +{both[0]:.3f} -> {both[1]:.3f} um", robust.out)


@pytest.mark.slow
def test_a_limit_that_no_design_keeps_is_no_success(robust):
    assert robust.code == 1
    limit = robust.summary["optimum"]["constraints"]["max_flank_pressure"]
    assert limit["met"] is False and limit["high"] == 100.0 and limit["value"] > 300.0
    assert robust.summary["optimum"]["feasible"] is False
    assert f"max_flank_pressure {limit['value']:.4g} MPa, NOT MET: at most 100" in robust.out
    assert "constraints are not met" in robust.err


@pytest.mark.slow
def test_another_method_reports_like_every_other(iterated):
    assert iterated.code == 0 and "quick run" not in iterated.out
    optimum, designs = iterated.summary["optimum"], iterated.summary["designs"]
    assert iterated.summary["quick"] is False and optimum["method"] == "te_iteration"
    assert list(designs) == ["unmodified", "rule-based", "optimum", "as cubic"]
    assert designs["optimum"]["ppte_um"] == pytest.approx(optimum["ppte_um"])
    assert designs["as cubic"]["ppte_um"] == pytest.approx(optimum["projection"]["ppte_um"])
    assert optimum["iterations"][0]["ppte"] == pytest.approx(designs["unmodified"]["ppte_um"])
    assert f"{len(optimum['iterations'])} contact analyses by method te_iteration" in iterated.out


@pytest.mark.slow
def test_all_files_of_an_iteration_from_a_relief_of_low_pressure(folder):
    path = folder / "low.toml"
    path.write_text(FREE + 'te_iteration = { start = "low_pressure" }\n')
    target = folder / "low"
    typed = "optimize", path, "--quick", "-m", "te_iteration", "-o", target, "--report"
    result = call(*typed)
    optimum = json.loads((target / "summary.json").read_text())["optimum"]
    assert result.code == 0 and optimum["method"] == "te_iteration"
    assert optimum["iterations"][0]["max_relief"] > 1.0
    assert "img" in check_report(target, path, *typed).tags
    names = {
        "transmission_error",
        "transmission_error_orders",
        "load_sharing",
        "pressure",
        "k_chart",
        "ppte_over_torque",
        "harris_map",
        "response_surface",
        "convergence",
        "iterations_relief",
        "iterations_transmission_error",
    }
    expected = {"summary.json", "report.html", "flanks.csv", *(f"{name}.png" for name in names)}
    assert {path.name for path in target.iterdir()} == expected
    for path in target.glob("*.png"):
        assert path.read_bytes().startswith(b"\x89PNG")


def test_a_quick_run_verifies_nothing(searched):
    assert "quick run" in searched.out and "finite" not in searched.out + searched.err
    assert not any("verified" in design for design in searched.summary["designs"].values())


def test_an_optimum_that_keeps_not_its_limits_is_no_success(folder, tmp_path, monkeypatch, searched):
    request = importlib.import_module("jaxgear.io.optimize_table").Search
    search, limit = request.__call__, optimum_result.Limit(432.1, None, 100.0, "MPa", False)

    def passing(self, *arguments):
        return replace(search(self, *arguments), constraints={"max_flank_pressure": limit}, violation=3.321)

    monkeypatch.setattr(request, "__call__", passing)
    options = "--quick", "--no-figures"
    result = call("optimize", folder / "free.toml", *options, "-o", tmp_path / "out")
    assert result.code == 1 and "constraints are not met" in result.err
    assert "max_flank_pressure 432.1 MPa, NOT MET: at most 100" in result.out and "NOT FEASIBLE" in result.out
    optimum = json.loads((tmp_path / "out" / "summary.json").read_text())["optimum"]
    assert optimum["feasible"] is False and optimum["constraints"]["max_flank_pressure"]["met"] is False


def test_results_of_an_earlier_run_are_replaced_and_figures_are_optional(folder, tmp_path, analyzed):
    target = tmp_path / "out"
    target.mkdir()
    (target / "k_chart.png").write_text("from an earlier run")
    assert_refused(call("analyze", folder / "plain.toml", "-o", target), "other files than results of jaxgear (k_chart")
    (target / "summary.json").write_text(EARLIER.replace("]}", '], "title": "other", "torque_Nm": 70.0}'))
    replaced = call("analyze", folder / "plain.toml", "-o", target, "--no-figures")
    assert replaced.code == 0
    assert f"replaces the results in {target}/ ('other' at 70 N m, 1 figures); --output keeps them" in replaced.err
    assert "replaces" not in analyzed.err
    assert {path.name for path in target.iterdir()} == {"summary.json", "flanks.csv"}
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    assert stat.S_IMODE(target.stat().st_mode) & 0o500 == 0o500


def test_results_go_beside_the_caller_by_default(folder, tmp_path, monkeypatch, analyzed):
    monkeypatch.chdir(tmp_path)
    result = call("analyze", folder / "plain.toml", "--no-figures")
    assert result.code == 0 and (tmp_path / "results" / "plain" / "analyze" / "summary.json").is_file()
    assert "results in results/plain/analyze/" in result.out


def test_no_two_commands_share_a_folder():
    folders = [
        run.default_folder(Path("a/gear.toml"), *command, quick=quick)
        for command in (("analyze",), ("optimize", "slp"), ("optimize", "factorial"), ("sweep",))
        for quick in (False, True)
    ]
    assert len(set(folders)) == len(folders) and folders[4] == Path("results/gear/optimize/factorial")
    assert not any(one in other.parents for one in folders for other in folders)


def test_a_full_disk_is_one_line_with_the_path(tmp_path):
    with pytest.raises(ValueError, match=r"out: cannot be written: No space left on device$"):
        with result_folder(tmp_path / "out"):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert not list(tmp_path.iterdir())
    figure = plot.ppte_over_torque([1.0, 2.0], {"a": np.array([1.0, 2.0])}).figure
    with pytest.raises(ValueError, match="full.png: cannot be written: File too large"), files_of_at_most(1000):
        plot.save(figure, tmp_path / "full.png")
    assert not list(tmp_path.iterdir())


@contextlib.contextmanager
def files_of_at_most(size):
    """What a full disk does, without filling one."""
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_failed_contact_solution_is_loud(folder, tmp_path, monkeypatch, analyzed):
    def failed(*arguments, **flanks):
        cycles = jg.sweeps.over_torques(*arguments, **flanks)
        return [replace(cycle, status=jnp.full_like(cycle.status, Status.MORE_PAIRS_NEEDED)) for cycle in cycles]

    monkeypatch.setattr(evaluation, "over_torques", failed)
    path = tmp_path / "fails.toml"
    path.write_text(FIXED)
    result = call("analyze", path, "--no-figures", "-o", tmp_path / "out")
    assert result.code == 1
    assert "CONTACT SOLUTION NOT CONVERGED: unmodified at 30" in result.err
    assert "more are needed; do not use its numbers" in " ".join(result.err.split())
    designs = json.loads((tmp_path / "out" / "summary.json").read_text())["designs"]
    assert designs["unmodified"]["converged"] is False
    assert 50.0 in designs["unmodified"]["failed_torques_Nm"]


@pytest.mark.parametrize(
    "command, content, fragments",
    [
        ("analyze", FREE, ["gear.toml: variables: analyze needs numbers, these are free: height", "jaxgear optimize"]),
        ("optimize", FIXED, ["gear.toml: variables: missing", "jaxgear analyze"]),
        ("optimize", FREE + 'method = "simplex"', ['optimize.method: "simplex" is not known, must be one of']),
        ("optimize", FREE + 'objective = "noise"', ['optimize.objective: "noise" is not known']),
        ("optimize", FREE + 'method = "genetic"', ['optimize.starts: has no effect with method "genetic"']),
        ("optimize", FREE + 'measure = "worst"', ["optimize.measure: has no effect on a single case"]),
        ("optimize", FREE + "manufactured = 4", ["optimize.manufactured: needs the table [tolerance]"]),
        ("optimize", FREE + "torques = [30.0, 30.0]", ["optimize.torques: torques must be different"]),
        ("optimize", FREE + 'constraint = [{ of = "ppte" }]', ["optimize.constraint[0]: low or high"]),
        ("optimize", FREE + "constraint = [{ variables = { width = 1.0 }, low = 0.0 }]", ['"width" is not a variable']),
        ("optimize", FREE + 'objective = ["ppte", "mean_te"]', ["optimize.objective: 2 with method", "pareto"]),
        ("optimize", FREE + "seed = 1", ["optimize.seed: has no effect", "slp", "nominal gears"]),
        (
            "optimize",
            FREE.replace("starts = 2\nsteps = 100", 'method = "factorial"') + "factorial = { levels = { width = 3 } }",
            ["optimize.factorial.levels: must name all variables and nothing else: height"],
        ),
        ("optimize", FREE + "genetic = { population = 2 }", ["optimize.genetic.population: 2 must be at least 4"]),
        ("analyze", FIXED.replace("teeth = 19", "teth = 19"), ['pinion.teth: unknown key, did you mean "teeth"?']),
        (
            "analyze",
            FIXED.replace("module = 3.0", "module = -3.0", 1),
            ["pinion.module: -3 mm must be greater than 0"],
        ),
        ("optimize", "[pinion", ["gear.toml: line 1: Expected ']' at the end of a table declaration"]),
        ("optimize", "", ["pinion: missing, this key is required"]),
    ],
)
def test_a_wrong_design_file_is_refused(tmp_path, monkeypatch, command, content, fragments):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "gear.toml").write_text(content)
    assert_refused(call(command, "gear.toml"), *fragments)
    assert [path.name for path in tmp_path.iterdir()] == ["gear.toml"]


def test_files_and_folders_that_cannot_be_used_are_refused(folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    fixed = folder / "fixed.toml"
    (tmp_path / "taken").write_text("something else")
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter.tex").write_text("years of work")
    assert_refused(call("analyze", "nowhere.toml"), "nowhere.toml: No such file or directory")
    assert_refused(call("analyze", "thesis"), "thesis: is a folder, not a file")
    assert_refused(call("analyze", fixed, "-o", "taken"), "taken: is a file, not a folder")
    assert_refused(call("analyze", fixed, "-o", "taken/below"), "taken/below: cannot be written")
    assert_refused(call("analyze", fixed, "-o", "thesis"), "thesis: holds other files than results of jaxgear (chapter")
    assert_refused(call("analyze", fixed, "-o", "."), ".: holds other files than results")
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path / "empty")  # replacing it would leave the shell in a folder that is gone
    assert_refused(call("analyze", fixed, "-o", "."), ".: is the folder you are in and would be replaced")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").rmdir()
    assert {path.name for path in tmp_path.rglob("*")} == {"taken", "thesis", "chapter.tex"}


@pytest.mark.parametrize(
    "arguments, fragment",
    [
        ([], "Missing command"),
        (["analyse"], "No such command"),
        (["analyze"], "Missing argument"),
        (["analyze", "a.toml", "b.toml"], "unexpected extra argument"),
        (["optimize", "a.toml", "--fast"], "No such option"),
        (["analyze", "a.toml", "--quick"], "No such option"),
        (["optimize", "a.toml", "--output"], "requires an argument"),
    ],
)
def test_wrong_usage_is_one_line(arguments, fragment):
    assert_refused(call(*arguments), fragment, "jaxgear --help")


@pytest.mark.parametrize("command", ["analyze", "optimize"])
def test_interruption_leaves_earlier_results_alone(folder, tmp_path, monkeypatch, command):
    target = tmp_path / "out"
    target.mkdir()
    (target / "summary.json").write_text(EARLIER)

    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(ComparisonRun, "prepare", lambda self, **_: None)
    monkeypatch.setattr(ComparisonRun, "evaluate", interrupt)
    monkeypatch.setattr(ComparisonRun, "search", interrupt)
    name = {"analyze": "fixed", "optimize": "free"}[command]
    result = call(command, folder / f"{name}.toml", "-o", target)
    assert result.code == 130
    assert result.err.splitlines()[1:] == ["jaxgear: interrupted, nothing was written"]
    assert (target / "summary.json").read_text() == EARLIER
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_a_defect_of_the_program_is_one_line_too(folder, tmp_path, monkeypatch):
    def fail(*_, **__):
        raise TypeError("two\nlines")

    monkeypatch.setattr(ComparisonRun, "prepare", fail)
    target = tmp_path / "out"
    result = call("analyze", folder / "fixed.toml", "-o", target)
    assert_refused(result, "unexpected TypeError: two lines (JAXGEAR_DEBUG=1 shows where)")
    assert not target.exists()
    monkeypatch.setenv("JAXGEAR_DEBUG", "1")
    with pytest.raises(TypeError):
        main(["analyze", str(folder / "fixed.toml"), "-o", str(target)])


def test_the_program_starts_as_a_process_of_its_own(tmp_path):
    command = [sys.executable, "-c", "from jaxgear.cli import main; main()"]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    result = subprocess.run(
        [*command, "analyze", "nowhere.toml"], cwd=tmp_path, capture_output=True, text=True, env=environment
    )
    assert_refused(SimpleNamespace(code=result.returncode, out=result.stdout, err=result.stderr), "nowhere.toml")
    assert list(tmp_path.iterdir()) == []


def test_the_help_knows_every_method():
    assert first_look.known_methods() == [*jg.optimize.METHODS, "pareto"]


def test_help_and_version_need_no_file():
    assert "optimize" in call("--help").out and call("--help").code == 0
    assert "Design file" in call("optimize", "--help").out
    assert call("--version").out.startswith("jaxgear ")


def test_the_compiler_raises_what_is_wrong_and_says_nothing_else(monkeypatch):
    """Of XLA's messages on stderr only fatal ones: its alarm over a long compilation asks for a bug report."""
    monkeypatch.setenv("TF_CPP_MIN_LOG_LEVEL", "")
    monkeypatch.delenv("TF_CPP_MIN_LOG_LEVEL")
    call("--version")
    assert os.environ["TF_CPP_MIN_LOG_LEVEL"] == "3"


def test_output_that_nobody_takes():
    """`jaxgear --help | head -1` is no error, a full disk behind `>` is one."""
    reader, writer = os.pipe()
    os.close(reader)
    for stream, code, line in (
        (open(writer, "w"), 0, ""),
        (open("/dev/full", "w"), 2, "jaxgear: error: standard output: No space left on device\n"),
    ):
        err = io.StringIO()
        with contextlib.redirect_stdout(stream), contextlib.redirect_stderr(err), pytest.raises(SystemExit) as exit_:
            main(["--help"])
        assert (exit_.value.code, err.getvalue()) == (code, line)
        stream.close()


def test_a_new_design_file_runs_as_it_is(tmp_path):
    """With the reliefs of the rule as values; what is there already is not replaced, and gears are checked."""
    file, options = tmp_path / "pair.toml", ("--teeth", 19, 48, "--module", 3, "--torque", 50, "--face-width", 18)
    done = call("new", file, *options)
    assert done.code == 0 and "19/48 teeth" in done.out
    written = file.read_text("utf-8")
    assert_refused(call("new", file, *options), "pair.toml: exists already")
    assert file.read_text("utf-8") == written
    assert_refused(call("new", tmp_path / "b.toml", *options[:-1], -18), "face_width = -18 mm must be greater than 0")
    assert_refused(call("new", tmp_path / "b.txt", *options), "b.txt: the name of a design file must end in .toml")
    assert [path.name for path in tmp_path.iterdir()] == ["pair.toml"]
    design = load_design(file)
    rule = jg.iso_relief(design.pair(), 50.0)
    assert design.values["wheel_amount"] == pytest.approx(float(rule.amount), abs=0.05)
    assert Search.of(design).method == "slp"
    file.write_text(f"{written}[resolution]\n{LINE}\n")
    result = call("analyze", file, "-o", tmp_path / "out", "--no-figures")
    assert result.code == 0 and "modified" in result.out


@pytest.fixture
def no_cache_of_jax():
    """What users have, of whom few tell JAX to keep programs itself."""
    before = jax.config.jax_compilation_cache_dir
    jax.config.update("jax_compilation_cache_dir", None)
    yield
    jax.config.update("jax_compilation_cache_dir", before)


def test_the_cache_is_a_private_folder_and_never_an_obstacle(tmp_path, monkeypatch, no_cache_of_jax):
    kept = []
    monkeypatch.setattr(jax_setup, "keep", kept.append)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    folder = jax_setup.enable_cache()
    assert len(kept) == 1 and folder.is_relative_to(tmp_path)
    assert stat.S_IMODE(folder.stat().st_mode) & 0o077 == 0
    folder.chmod(0o777)  # others could place programs here
    assert jax_setup.enable_cache() is None
    folder.chmod(0o700)
    tmp_path.chmod(0o777)  # and here another folder of this name
    assert jax_setup.enable_cache() is None
    tmp_path.chmod(0o1777)  # but not one that is not theirs
    assert jax_setup.enable_cache() == folder
    tmp_path.chmod(0o700)
    kept.clear()
    before = os.umask(0)
    try:
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "new" / "cache"))
        made = jax_setup.enable_cache()
    finally:
        os.umask(before)
    ways = [part for part in made.parents if part != tmp_path and part.is_relative_to(tmp_path)]
    assert len(ways) == 3 and all(stat.S_IMODE(part.stat().st_mode) == 0o700 for part in ways)
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert jax_setup.enable_cache() is None
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    folder.chmod(0o700)
    jax.config.update("jax_compilation_cache_dir", "/elsewhere")  # its variable sets it too
    assert jax_setup.enable_cache() is None
    assert len(kept) == 1
