"""The command `jaxgear wear` and the table [wear]: what it writes and says, and one line for what is wrong."""

import csv
import dataclasses
import importlib
import json
from types import SimpleNamespace

import equinox as eqx
import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import pytest
from catalogue import gear_pair
from commands import call
from design_texts import asked_sweep
from pyarrow import parquet
from report_page import check_report

import jaxgear as jg
from jaxgear import plot
from jaxgear.contact import removed_material
from jaxgear.io import (
    DesignFileError,
    Search,
    load_design,
    read_flank,
    read_worn,
    write_worn,
)
from jaxgear.io.tolerance_table import manufactured_of
from jaxgear.studies import Checkpoints, NamedArrays, WearResult, WearStudy, wear_scatter
from jaxgear.studies.checkpoints import Marches
from jaxgear.studies.comparison import compared, sought
from jaxgear.tolerance import deviated_material
from jaxgear.wear import March, mean_over_life, over_life, wear, wear_depth

pytestmark = pytest.mark.usefixtures("no_cache", "involute_as_relief")


def quiet(*_):
    """Called after every two blocks: one program serves any number of them."""


def relief(amount, length=2.0):
    """Of the kind that the command makes by rule: one program wears all flanks of one kind."""
    return jg.TipRelief(amount, length)


@pytest.fixture
def involute_as_relief(request, monkeypatch):
    """All but one test compare the rule-based relief with one of no height: one program for both designs."""

    def alike(*arguments, **options):
        mesh, designs = compared(*arguments, **options)
        bare = relief(0.0)
        return mesh, {name: (bare, bare) if name == "unmodified" else flanks for name, flanks in designs.items()}

    if "involutes" not in request.fixturenames:
        monkeypatch.setattr(importlib.import_module("jaxgear.studies.wear"), "compared", alike)


@pytest.fixture
def involutes():
    """Unmodified flanks are compared as the command has them."""


GEAR = """
teeth = 30
module = 2.0
face_width = 20.0
bore_diameter = 12.6
tip_diameter = 64.0
"""
PAIR = f"""
[pinion]{GEAR}
[wheel]{GEAR}
[load]
torque = 150.0
[resolution]
positions = 16
pairs = 2
slide_steps = 0
"""
TABLE = """
[wear]
revolutions = 2e7
coefficient = 1e-18
depth_limit = 5.0
blocks = 4
"""
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


def test_the_command_writes_what_it_says(file, tmp_path):
    path, folder = file(PAIR + TABLE), tmp_path / "out"
    done = call("wear", str(path), "--output", str(folder), "--report")
    assert done.code == 0, done.err
    figures = "worn_pinion", "worn_wheel", "ppte_over_life", "depth_over_life"
    expected = {"summary.json", "report.html", "life.csv", "worn_flanks.csv", "worn_flanks.parquet"}
    expected |= {f"{name}.png" for name in figures}
    assert {entry.name for entry in folder.iterdir()} == expected
    assert not list(tmp_path.glob(".out*"))  # what was kept is no longer needed
    summary = json.loads((folder / "summary.json").read_text())
    with (folder / "life.csv").open() as lines:
        rows = list(csv.DictReader(lines))
    assert len(rows) == 2 * 5  # unmodified and rule-based, new and after four blocks
    last = rows[4]
    unmodified = summary["designs"]["unmodified"]
    assert float(last["ppte_um"]) == pytest.approx(unmodified["worn_ppte_um"], rel=1e-6)
    assert 0 < unmodified["wear_depth_error_um"] < 0.05 * unmodified["pinion_wear_depth_um"]
    assert f"{unmodified['wear_depth_error_um']:.3f}" in done.out
    assert float(last["wear_depth_error_um"]) == pytest.approx(unmodified["wear_depth_error_um"], rel=1e-6)
    assert float(last["pinion_wear_depth_um"]) == pytest.approx(unmodified["pinion_wear_depth_um"], rel=1e-6)
    assert unmodified["worn_ppte_um"] < unmodified["new_ppte_um"]
    assert float(last["flank_pressure_error_MPa"]) == pytest.approx(
        unmodified["worn_flank_pressure_error_MPa"], rel=1e-6
    )
    assert 0 < unmodified["worn_flank_pressure_error_MPa"] < 0.1 * unmodified["worn_flank_pressure_MPa"]
    backlash = summary["geometry"]["pair"]["backlash_on_line_of_action_um"]
    assert f"{backlash:g}" == "0"  # no -0
    assert 0 < unmodified["volume_by_tip_corners_share"] < 0.5
    assert unmodified["life_to_depth_revolutions"] == pytest.approx(2e7 * 5 / unmodified["pinion_wear_depth_um"], 0.15)
    assert f"{unmodified['worn_ppte_um']:.3f}" in done.out and "to 5 um" in done.out
    ruled = summary["designs"]["rule-based"]["life_to_depth_revolutions"]
    assert ruled > 2e7 and f"{ruled:.3g} *" in done.out and "* beyond wear.revolutions" in done.out
    check_flanks(path, folder, rows)
    check_report(folder, path, "wear", path, "--output", folder, "--report")


def test_the_figures_of_worn_flanks_show_every_design(monkeypatch):
    depth = np.linspace(0.0, 3.0, 10).reshape(5, 1, 2)
    gears = gear_pair().gears
    lives = {
        name: SimpleNamespace(
            pinion_depth=times * depth,
            wheel_depth=times * depth,
            gears=gears,
            roll_length=(np.asarray([8.0, 12.0]),) * 2,
            revolutions=np.linspace(0.0, 2e7, 5),
        )
        for times, name in enumerate(("unmodified", "rule-based", "optimum"), 1)
    }
    settings = SimpleNamespace(dynamics=None)
    monkeypatch.setattr(plot, "wear_history", lambda *given: None)
    figures = WearResult.figures(SimpleNamespace(histories=lives, settings=settings, scatters={}))
    drawn = {figure.name: figure.axes for figure in figures}
    for gear in ("pinion", "wheel"):
        panels = np.ravel(drawn[f"worn_{gear}"])
        assert [panel.get_title() for panel in panels] == list(lives)
        assert [panel.lines[-1].get_ydata().max() for panel in panels] == [3.0, 6.0, 9.0]
    plt.close("all")


def check_flanks(path, folder, rows):
    """The flanks of the file give the numbers of the file."""
    design = load_design(path)
    pinion, wheel = read_worn(folder / "worn_flanks.csv")["unmodified", 2e7]
    cycle = jg.solve(design.mesh(), design.torque, pinion=pinion, wheel=wheel)
    assert float(jg.peak_to_peak(cycle.transmission_error)) == pytest.approx(float(rows[4]["ppte_um"]), rel=1e-6)


@pytest.mark.parametrize(
    "text, message",
    [
        ("", "wear: missing; it says for how long the pair runs and how it wears"),
        ("[wear]\n", "wear.revolutions: missing"),
        (TABLE.replace("2e7", "-1.0"), "wear.revolutions: -1 revolutions must be greater than 0"),
        (TABLE.replace("1e-18", "-1e-18"), "wear.coefficient: -1e-18 m2/N must be at least 0 m2/N"),
        (
            TABLE.replace("1e-18", "1e-12"),
            "wear.coefficient: 1e-12 m2/N must be at least 0 m2/N and at most 1e-13 m2/N",
        ),
        (TABLE.replace("blocks = 4", "blocks = 5"), "wear.blocks: 5 must be even"),
        (TABLE + "weights = [1.0]\n", "wear.weights: has no effect without wear.torques"),
        (TABLE + "torques = [50.0, 50.0]\n", "wear.torques: torques must be different"),
        (TABLE.replace("depth_limit = 5.0", "depth_limit = 0.0"), "wear.depth_limit: 0 um must be greater than 0 um"),
        (TABLE + "coeficient = 1.0\n", "wear.coeficient: unknown key"),
    ],
)
def test_what_is_wrong_with_the_table_is_one_line(file, tmp_path, text, message):
    done = call("wear", str(file(PAIR + text)), "--output", str(tmp_path / "out"))
    lines = done.err.strip().splitlines()
    assert done.code == 2 and done.out == ""
    assert message in lines[-1] and lines[-1].startswith("jaxgear: error: ")
    assert not (tmp_path / "out").exists()


def test_a_design_file_binds_names_to_its_settings(file):
    """The settings of the table, and a refusal in one line without them."""
    text = PAIR + SWEEP.format(name="worn_ppte")
    results = asked_sweep(load_design(file(text + TABLE))).results
    settings = WearStudy.of(load_design(file(text + TABLE))).settings
    assert results == ("ppte", settings.quantity("worn_ppte"))
    with pytest.raises(DesignFileError, match=r'sweep.results\[1\]: "worn_ppte" needs the table \[wear\]'):
        asked_sweep(load_design(file(text)))
    of_increments = TABLE.replace("blocks = 4", "largest_increment = 0.1")
    with pytest.raises(DesignFileError, match=r'wear.blocks: missing, "worn_ppte" needs it'):
        asked_sweep(load_design(file(text + of_increments)))
    assert asked_sweep(load_design(file(text + TABLE + "largest_increment = 0.1\n"))).results == results
    with pytest.raises(DesignFileError, match='"life_to_ppte" needs wear.ppte_limit'):
        asked_sweep(load_design(file(PAIR + SWEEP.format(name="life_to_ppte") + TABLE)))


def test_the_mesh_has_pairs_for_the_loads_that_wear_it(file):
    open_pairs = PAIR.replace("pairs = 2\n", "").replace("torque = 150.0", "torque = 20.0")
    few, more = (load_design(file(open_pairs + TABLE + f"torques = [{torque}]\n")) for torque in (20.0, 3000.0))
    assert few.resolution().pairs == few.resolution(20.0).pairs < more.resolution().pairs


def test_loads_of_wear_do_not_follow_a_variable_of_the_load(file):
    text = PAIR.replace("torque = 150.0", 'torque = 150.0\nspeed = "n"') + SWEEP.format(name="wear_depth")
    text = text.replace("[variables]\n", '[variables]\nn = { low = 500.0, high = 900.0, unit = "rpm" }\n')
    table = TABLE + "torques = [50.0, 150.0]\n"
    with pytest.raises(DesignFileError, match='wear.torques: load.speed is the variable "n", which they do not follow'):
        asked_sweep(load_design(file(text + table)))
    asked_sweep(load_design(file(text + table + "speeds = [500.0, 1000.0]\n")))


def test_a_real_life_can_be_asked_for(file):
    """20 000 h at 3000 rpm are 3.6e9 revolutions."""
    table = (
        TABLE.replace("2e7", "3.6e9")
        + """
[optimize]
objective = "wear_depth"
constraint = [{ of = "life_to_depth", low = 7.2e9 }]
"""
    )
    design = load_design(file(PAIR + VARIABLES + table))
    assert WearStudy.of(design).settings.revolutions == 3.6e9
    assert Search.of(design).method == "slp"
    beyond = table.replace("life_to_depth", "life_to_ppte").replace("[wear]", "[wear]\nppte_limit = 3.0")
    with pytest.raises(DesignFileError, match=r"constraint\[0\].low: 7.2e\+09 must be at most 3.6e"):
        Search.of(load_design(file(PAIR + VARIABLES + beyond)))


LOADS = TABLE + "torques = [50.0, 150.0]\nweights = [3.0, 1.0]\n"


def test_loads_of_the_table_wear_one_flank_together(file, monkeypatch):
    """The quantities wear it under the spectrum, whatever the load of the case."""
    asked = {}

    class Worn(Exception):
        pass

    def recorded(mesh, load, revolutions, **options):
        asked.update(options, load=load, revolutions=revolutions)
        raise Worn

    design = load_design(file(PAIR + SWEEP.format(name="wear_depth") + LOADS))
    settings = WearStudy.of(design).settings
    assert settings.loads is not None and settings.loads.weights.tolist() == [0.75, 0.25]
    monkeypatch.setattr(importlib.import_module("jaxgear.wear.settings"), "wear", recorded)
    mesh = load_design(file(PAIR)).mesh()
    with pytest.raises(Worn):
        asked_sweep(design).results[1](jg.metrics.Analysis(jg.solve(mesh, 150.0), mesh))
    assert asked["load"].torques.tolist() == [50.0, 150.0] and asked["load"].weights.tolist() == [0.75, 0.25]
    assert (float(asked["revolutions"]), asked["blocks"]) == (2e7, 4)
    np.testing.assert_array_equal(asked["coefficient"], 1e-18)


@pytest.mark.parametrize("weights, told", [("weights = [3.0, 1.0]", "for 75, 25 % of"), ("", "the same share of")])
def test_the_shares_of_the_torques_are_told(file, weights, told):
    design = load_design(file(PAIR + LOADS.replace("weights = [3.0, 1.0]", weights)))
    result = WearResult(design, WearStudy.of(design).settings, {}, {}, {})
    shares = result.inputs()["shares_of_revolutions"]
    assert told in shares and shares in next(result.tables()).title


@pytest.mark.slow
def test_a_quantity_under_loads_is_that_of_their_life(file):
    design = load_design(file(PAIR + SWEEP.format(name="wear_depth") + LOADS))
    mesh = load_design(file(PAIR)).mesh()
    spectrum = jg.LoadSpectrum([50.0, 150.0], [3.0, 1.0])
    perfect = jnp.zeros((2, 1, 16))
    life = wear(mesh, spectrum, 2e7, coefficient=1e-18, blocks=4, deviation=perfect)
    asked = asked_sweep(design).results[1](jg.metrics.Analysis(jg.solve(mesh, 150.0), mesh))
    assert float(asked) == pytest.approx(float(wear_depth(life)[-1]), rel=1e-12)


DYNAMICS = """
[dynamics]
speeds = [500.0, 1000.0]
model = "varying stiffness"
damping_ratio = 0.1
positions = 16
"""
DYNAMIC = TABLE + 'line_load = "dynamic"\n'
FAST = PAIR.replace("torque = 150.0", "torque = 150.0\nspeed = 6000.0").replace(
    "bore_diameter = 12.6", "bore_diameter = 12.6\ntooth_thickness_allowance = -60.0"
)


def test_a_dynamic_line_load_needs_a_speed_and_what_vibrates(file):
    settings = WearStudy.of(load_design(file(FAST + DYNAMICS + DYNAMIC))).settings
    assert settings.line_load == "dynamic" and settings.dynamics.model == "varying stiffness"
    static = WearStudy.of(load_design(file(FAST + DYNAMICS + TABLE))).settings
    assert static.dynamics is None  # as before there was such a load
    for text, needs in ((FAST + DYNAMIC, r"the table \[dynamics\]"), (PAIR + DYNAMICS + DYNAMIC, "load.speed")):
        with pytest.raises(DesignFileError, match=f'wear.line_load: "dynamic" needs {needs}'):
            load_design(file(text))
    loads = DYNAMIC + "torques = [50.0, 150.0]\nspeeds = [500.0, 1000.0]\n"  # which have speeds of their own
    assert WearStudy.of(load_design(file(PAIR + DYNAMICS + loads))).settings.loads.speeds.tolist() == [500.0, 1000.0]
    with pytest.raises(DesignFileError, match='wear.line_load: "quick"'):
        load_design(file(PAIR + TABLE + 'line_load = "quick"\n'))


def test_dynamic_factors_over_the_life_are_results_of_a_file(file):
    """Of flanks that wear under either load."""
    asked = SWEEP.format(name="worn_dynamic_factor")
    for table in (TABLE, DYNAMIC):
        quantity = asked_sweep(load_design(file(FAST + DYNAMICS + table + asked))).results[1]
        settings = quantity.settings
        assert settings.dynamics.positions == 16
        assert settings.line_load == ("dynamic" if table is DYNAMIC else "static")
    for text, needs in (
        (FAST + DYNAMICS, r"the table \[wear\]"),
        (FAST + TABLE, r"the table \[dynamics\]"),
        (PAIR + DYNAMICS + TABLE, "load.speed"),
    ):
        with pytest.raises(DesignFileError, match=f'sweep.results.1.: "worn_dynamic_factor" needs {needs}'):
            asked_sweep(load_design(file(text + asked)))


@pytest.mark.slow
def test_the_command_shows_the_dynamic_factor(file, tmp_path):
    folder = tmp_path / "out"
    done = call("wear", str(file(FAST + DYNAMICS + DYNAMIC + TOLERANCE)), "--output", str(folder))
    assert done.code == 0, done.err
    assert "[tolerance] is not part of this analysis" in done.err
    assert "K_v worst" in done.out and "dynamic line load at 6000 rpm" in done.out
    assert (folder / "dynamic_factor_over_life.png").exists()
    found = json.loads((folder / "summary.json").read_text())
    assert found["left_out"].startswith("[tolerance] is not part") and "tolerances" not in found
    assert found["settings"]["line_load"] == "dynamic" and found["settings"]["dynamics"]["positions"] == 16
    with (folder / "life.csv").open() as lines:
        factors = [float(row["dynamic_factor"]) for row in csv.DictReader(lines) if row["design"] == "unmodified"]
    assert len(factors) == 5 and min(factors) > 1.0
    assert found["designs"]["unmodified"]["max_dynamic_factor_over_life"] == pytest.approx(max(factors), rel=1e-6)


TOLERANCE = "[tolerance]\nquality_class = 7\nsamples = 3\n"


def scatter(design, flanks, kept):
    """Lives of the manufactured pairs of a file, with reliefs of one height."""
    mesh, settings = design.mesh(), WearStudy.of(design).settings
    designs = {"relieved": (relief(flanks), relief(flanks))}
    gears = manufactured_of(design)
    found = wear_scatter.manufactured_wear(mesh, 150.0, designs, settings, gears, keep=kept)
    return mesh, found["relieved"]


@pytest.mark.slow
def test_manufactured_pairs_live_as_their_deviations_let_them(file, tmp_path, monkeypatch):
    """Each is the life of the manufactured gears of the file; finer gears scatter less."""
    design = load_design(file(PAIR + TABLE + TOLERANCE))
    kept = Checkpoints(tmp_path / ".runs").of(NamedArrays())
    mesh, found = scatter(design, 5.0, kept)
    assert list(found) == ["mean_ppte_over_life", "wear_depth", "life_to_depth"]
    drawn = manufactured_of(design).on(mesh)
    options = {"pinion": relief(5.0), "wheel": relief(5.0)}
    nominal = np.asarray(removed_material(mesh, 150.0, **options).amount)
    for number in range(3):
        deviation = jax.tree.map(lambda leaf, number=number: jnp.asarray(np.asarray(leaf)[number]), drawn)
        off = np.asarray(deviated_material(mesh, 150.0, deviation, **options).amount) - nominal
        life = wear(mesh, 150.0, 2e7, coefficient=1e-18, blocks=4, deviation=off, callback=quiet, **options)
        assert found["wear_depth"][number] == pytest.approx(float(wear_depth(life)[-1]), rel=1e-6)
        assert found["mean_ppte_over_life"][number] == pytest.approx(float(mean_over_life(life, "ppte")), rel=1e-6)
    assert np.ptp(found["mean_ppte_over_life"]) > 0.3
    _, finer = scatter(load_design(file(PAIR + TABLE + TOLERANCE.replace("7", "1"))), 5.0, kept)
    # an eighth of the limits, but for their rounding
    assert np.ptp(finer["mean_ppte_over_life"]) < 0.5 * np.ptp(found["mean_ppte_over_life"])
    monkeypatch.setattr(wear_scatter, "_numbers", None)  # after Ctrl-C nothing is worn again
    _, again = scatter(design, 5.0, kept)
    assert list(again) == list(found)
    assert all((again[name] == found[name]).all() for name in found)


def test_failed_pairs_are_told_and_count_as_the_worst():
    samples = {"mean_ppte_over_life": np.array([1.0, 2.0, np.nan]), "life_to_ppte": np.array([3e6, 1e7, np.nan])}
    (line,) = wear_scatter.failures({"relieved": samples})
    assert line.startswith("NOT CONVERGED: relieved, 1 of 3 manufactured pairs, which count as the worst")
    told = wear_scatter.summary(samples)["manufactured"]
    assert told["failed"] == 1 and told["mean_ppte_over_life_um"]["q95"] == np.inf
    assert np.isnan(told["mean_ppte_over_life_um"]["mean"])
    assert told["life_to_ppte_revolutions"]["half_last"] == 3e6  # two of three reach it
    assert np.isnan(told["life_to_ppte_revolutions"]["95_percent_last"])
    none = {name: np.full(3, np.nan) for name in samples}
    assert wear_scatter.summary(none)["manufactured"]["mean_ppte_over_life_um"]["q95"] == np.inf
    fine = {name: values[:2] for name, values in samples.items()}
    assert not list(wear_scatter.failures({"relieved": fine}))
    assert wear_scatter.summary(fine)["manufactured"]["mean_ppte_over_life_um"]["mean"] == 1.5


def test_so_many_pairs_last_so_long():
    """At least 19 of 20 of them, exactly; lives that nobody follows further are no average with shorter ones."""
    lives = {"mean_ppte_over_life": np.ones(40), "life_to_ppte": np.where(np.arange(40) < 2, 0.0, 2e7)}
    told = wear_scatter.summary(lives)["manufactured"]["life_to_ppte_revolutions"]
    assert told == {"half_last": 2e7, "95_percent_last": 2e7}
    lives["life_to_ppte"][2] = 5.0
    assert wear_scatter.summary(lives)["manufactured"]["life_to_ppte_revolutions"]["95_percent_last"] == 5.0


@pytest.mark.slow
def test_overlong_blocks_are_a_failure(file, tmp_path):
    """As quantities are no numbers then: flanks that wear ten times as much in two blocks overshoot."""
    text = PAIR + TABLE.replace("1e-18", "1e-17").replace("blocks = 4", "blocks = 2")
    done = call("wear", str(file(text)), "--output", str(tmp_path / "out"), "--no-figures")
    assert done.code == 1 and "BLOCKS TOO LONG: unmodified, flanks overshoot" in done.err


def test_a_life_that_is_not_known_is_not_endless(file, tmp_path):
    text = PAIR + TABLE.replace("1e-18", "1e-14").replace("2e7", "2e9")
    done = call("wear", str(file(text)), "--output", str(tmp_path / "out"), "--no-figures")
    assert done.code == 1 and "never" not in done.out and "NOT CONVERGED: unmodified from" in done.err
    found = json.loads((tmp_path / "out" / "summary.json").read_text())["designs"]["unmodified"]
    assert found["life_to_depth_revolutions"] is None


def test_tolerances_are_left_out_under_the_dynamic_load_alone(file):
    assert wear_scatter.left_out(load_design(file(PAIR + TABLE + TOLERANCE))) == ""
    assert wear_scatter.left_out(load_design(file(FAST + DYNAMICS + DYNAMIC))) == ""
    told = wear_scatter.left_out(load_design(file(FAST + DYNAMICS + DYNAMIC + TOLERANCE)))
    assert told.startswith(
        "[tolerance] is not part of this analysis, the gears are nominal (wear of manufactured pairs"
    )
    assert "\n" not in told


def test_a_misalignment_needs_slices(file, tmp_path):
    path = file(PAIR + TABLE + TOLERANCE + "misalignment = 5.0\n")
    done = call("wear", str(path), "--output", str(tmp_path / "out"))
    assert done.code == 2 and "tolerance.misalignment: needs resolution.slices of at least 2" in done.err
    assert not (tmp_path / "out").exists()


def test_a_quick_run_has_few_blocks(file):
    text = PAIR + TABLE.replace("blocks = 4", "largest_increment = 0.1")
    settings = WearStudy.of(load_design(file(text)), quick=True).settings
    assert settings.blocks == 4 and settings.largest_increment is None


VARIABLES = """
[variables]
amount = { low = 0.0, high = 25.0, unit = "um" }
length = { low = 1.0, high = 3.8, unit = "mm" }
""" + "".join(
    f"""
[[{gear}.modification]]
type = "tip_relief"
amount = "amount"
length = "length"
"""
    for gear in ("pinion", "wheel")
)


@pytest.mark.slow
def test_the_command_seeks_the_relief_that_lasts(file, tmp_path, involutes):
    folder = tmp_path / "out"
    done = call("wear", str(file(PAIR + TABLE + VARIABLES + TOLERANCE)), "--quick", "--output", str(folder), "--report")
    assert done.code == 0, done.err
    found = json.loads((folder / "summary.json").read_text())
    designs, how = found["designs"], "sought at 150 N m, under the static line load, on gears without deviations"
    assert found["optimum_over_life"] == how and f"optimum over life: {how}" in " ".join(done.out.split())
    assert how in (folder / "report.html").read_text("utf-8")
    assert list(designs) == ["unmodified", "rule-based", "optimum", "optimum over life"]
    new, lasting = designs["optimum"], designs["optimum over life"]
    assert new["new_ppte_um"] < lasting["new_ppte_um"]
    assert lasting["mean_ppte_over_life_um"] < 0.9 * new["mean_ppte_over_life_um"]
    assert "least mean PPTE over the life: optimum over life" in done.out
    assert "3 manufactured pairs of quality class 7, the same for every design" in done.out
    assert (folder / "life_ppte_distribution.png").exists() and found["tolerances"]["quality_class"] == 7
    spread = [design["manufactured"]["mean_ppte_over_life_um"] for design in designs.values()]
    assert all(of["mean"] > 0 and of["std"] > 0 and of["q95"] > of["mean"] for of in spread)
    assert f"{spread[-1]['q95']:.3f}" in done.out


def test_a_search_that_is_for_the_life_already_has_no_other(file):
    def search(text):
        design = load_design(file(PAIR + TABLE + VARIABLES + text))
        return Search.of(design).over_life(WearStudy.of(design).settings)

    assert search("") is not None and search('[optimize]\nmethod = "genetic"\n') is not None
    assert search('[optimize]\nobjective = "worn_ppte"\n') is None
    assert search('[optimize]\nmethod = "free_form"\n') is None
    assert search('[optimize]\nmethod = "pareto"\n') is None


def test_kept_blocks_are_not_worn_again(tmp_path, file):
    """After Ctrl-C the command goes on, and what comes out is what would have."""
    mesh = load_design(file(PAIR)).mesh()
    options = {"coefficient": 1e-18, "blocks": 4, "pinion": relief(0.0), "wheel": relief(0.0)}

    class Stop(Exception):
        pass

    def stopped(*_):
        raise Stop

    with pytest.raises(Stop):
        wear(mesh, 150.0, 2e7, keep=Checkpoints(tmp_path / ".runs").of(Marches()), callback=stopped, **options)
    made = []

    def counted(made_of, make):
        def making():
            made.append(1)
            return make()

        return Checkpoints(tmp_path / ".runs").of(Marches())(made_of, making)

    again = wear(mesh, 150.0, 2e7, keep=counted, **options)
    assert len(made) == 1  # of two pairs of blocks
    whole = wear(mesh, 150.0, 2e7, callback=quiet, **options)
    np.testing.assert_array_equal(again.depth, whole.depth)
    np.testing.assert_array_equal(over_life(again, "ppte"), over_life(whole, "ppte"))


def prepared(pair, *, resolution, compliance=None, support=None):
    """Stands for a mesh of other sizes."""
    return SimpleNamespace(pair=pair, resolution=resolution, compliance=compliance, support=support)


class SlowSearch:
    """Stands for a search that takes long."""

    method = "slp"

    def __init__(self, parameters):
        self.parameters, self.run = parameters, 0

    def __call__(self, mesh, callback):
        self.run += 1
        finer = prepared(mesh.pair, resolution=dataclasses.replace(mesh.resolution, positions=24))
        flanks = {"pinion": relief(12.3, 2.1), "wheel": relief(12.3, 2.1)}
        return SimpleNamespace(parameters=self.parameters, mesh=finer, **flanks)


def test_what_a_search_has_found_is_not_sought_again(tmp_path, file, monkeypatch):
    """The mesh on which it ended, and the flanks, come from a few numbers beside the results."""
    monkeypatch.setattr(importlib.import_module("jaxgear.studies.comparison"), "prepare", prepared)
    mesh, stages = load_design(file(PAIR)).mesh(), SimpleNamespace(step=None)
    search = SlowSearch({"amount": 12.3, "length": 2.1})

    def found(name="optimum", text="", oil=100.0):
        (tmp_path / "oil.toml").write_text(f"viscosity_40 = {oil}\nviscosity_100 = 5.0\n")
        design = load_design(
            file(FAST + VARIABLES + '[lubricant]\nfile = "oil.toml"\ntemperature = 80.0\nroughness = 0.5\n' + text)
        )
        return sought(design, name, search, mesh, Checkpoints(tmp_path / "kept"), stages, quick=False)

    first, again = found(), found()
    assert search.run == 1
    for ended, (pinion, wheel) in (first, again):
        assert ended.resolution.positions == 24 and str(pinion) == str(wheel) == str(jg.TipRelief(12.3, 2.1))
        assert eqx.tree_equal(ended.pair, mesh.pair) and eqx.tree_equal(ended.compliance, mesh.compliance)
    assert eqx.tree_equal(first[1], again[1]) and first[0].resolution == again[0].resolution
    found("optimum over life")
    found(text='[optimize]\nmethod = "genetic"\n')
    found(oil=30.0)
    assert search.run == 4  # another search, another file, another oil


def test_a_search_without_numbers_to_keep_gives_its_flanks(tmp_path, file):
    """Although the file has variables, as the transmission-error iteration may."""
    design, stages = load_design(file(PAIR + VARIABLES)), SimpleNamespace(step=None)
    search = SlowSearch({})
    search.method = "te_iteration"
    mesh, flanks = sought(design, "optimum", search, design.mesh(), Checkpoints(), stages, quick=False)
    assert mesh.resolution.positions == 24 and str(flanks[0]) == str(jg.TipRelief(12.3, 2.1))


def test_blocks_on_the_disk_are_the_blocks(tmp_path):
    march = March(jnp.arange(3.0), jnp.ones(2), jnp.array([0, 3], jnp.int8), {"status": jnp.array([0, 1], jnp.int8)})
    found = Marches().result(dict(Marches().arrays(march)))
    assert (found.status == march.status).all()
    assert found.seen["status"].dtype == np.int8 and (found.depth == march.depth).all()


@pytest.fixture(scope="module")
def skewed(tmp_path_factory):
    """A life of flanks that wear unevenly over the face: that of one slice, and more of it on a second one."""
    path = tmp_path_factory.mktemp("skewed") / "design.toml"
    path.write_text(PAIR)
    flanks = {"pinion": relief(0.0), "wheel": relief(0.0)}
    life = wear(load_design(path).mesh(), 150.0, 2e7, coefficient=1e-18, blocks=2, callback=quiet, **flanks)
    further = np.linspace(0.0, 0.5, 3)[:, None, None, None, None]
    depth = np.concatenate([life.depth, life.depth + further], axis=3)
    places = np.asarray(life.face_coordinate) + np.array([-5.0, 5.0])
    return eqx.tree_at(lambda of: (of.depth, of.face_coordinate), life, (jnp.asarray(depth), jnp.asarray(places)))


@pytest.mark.parametrize("name", ["flanks.csv", "flanks.parquet"])
def test_flanks_over_the_face_are_read_back(tmp_path, skewed, name):
    path = tmp_path / name
    write_worn(path, {"skewed": skewed, "once more": skewed})
    worn = read_worn(path)
    assert list(worn) == [(design, done) for design in ("skewed", "once more") for done in (0.0, 1e7, 2e7)]
    for gear, ours in zip(("pinion", "wheel"), skewed.flanks()):
        one = read_flank(path, gear=gear, design="skewed", revolutions=2e7)
        for theirs in (worn["skewed", 2e7][gear == "wheel"], one):
            np.testing.assert_array_equal(ours.amount, theirs.amount)
            np.testing.assert_array_equal(ours.roll_length, theirs.roll_length)
            np.testing.assert_array_equal(ours.face_coordinate, theirs.face_coordinate)
    assert np.ptp(skewed.flanks()[0].amount[0]) > 0.1
    for options, message in (
        ({}, "holds several: revolutions must be one of 0, 1e.07, 2e.07"),
        ({"revolutions": 3e7}, "revolutions = 3e.07 is not in the file, revolutions must be one of 0, "),
    ):
        with pytest.raises(DesignFileError, match=f"{name}: {message}"):
            read_flank(path, gear="pinion", design="skewed", **options)


def test_both_files_hold_the_same_numbers(tmp_path, skewed):
    paths = [tmp_path / name for name in ("flanks.csv", "flanks.parquet")]
    for path in paths:
        write_worn(path, {"skewed": skewed})
    with paths[0].open() as lines:
        rows = list(csv.DictReader(lines))
    columns = parquet.read_table(paths[1]).to_pydict()
    assert {name: [type(values[0])(row[name]) for row in rows] for name, values in columns.items()} == columns


def test_a_worn_flank_stands_in_a_design_file(file, tmp_path, skewed):
    write_worn(tmp_path / "worn.parquet", {"skewed": skewed})
    table = '[[pinion.modification]]\ntype = "file"\nfile = "worn.parquet"\ngear = "pinion"\nrevolutions = 2e7\n'
    pinion, _ = load_design(file(PAIR.replace("pairs = 2", "pairs = 2\nslices = 2") + table)).design({})
    np.testing.assert_array_equal(pinion.amount, skewed.flanks()[0].amount)


def test_other_files_are_refused_in_one_line(tmp_path):
    with pytest.raises(ValueError, match="none.csv: No such file") as refused:
        read_worn(tmp_path / "none.csv")
    assert "\n" not in str(refused.value)
    (tmp_path / "other.parquet").write_text("a,b\n1,2\n")
    with pytest.raises(ValueError, match="other.parquet: is not a valid Parquet file: ") as refused:
        read_worn(tmp_path / "other.parquet")
    assert "\n" not in str(refused.value)
    (tmp_path / "other.csv").write_text("a,b\n1,2\n")
    with pytest.raises(ValueError, match="other.csv: holds no worn flanks as jaxgear writes them"):
        read_worn(tmp_path / "other.csv")


def test_pictures_of_other_gears_are_refused_in_one_line():
    with pytest.raises(ValueError, match='gear = \'rack\' must be "pinion" or "wheel"') as refused:
        plot.worn_flank(None, "rack")
    assert "\n" not in str(refused.value)
