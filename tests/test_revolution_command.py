"""The command `jaxgear revolution`, the table [teeth] and the quantities of a revolution."""

import csv
import json

import matplotlib.pyplot as plt
import numpy as np
import pytest
from commands import FIXED, FREE, VARIABLES, assert_refused, call
from design_texts import asked_sweep

from jaxgear.io import DesignFileError, Search, load_design, teeth_of
from jaxgear.studies import RevolutionStudy

TEETH = """
[teeth]
over = "pinion"
[teeth.pinion]
file = "pitches.csv"
run_out = 8.0
"""
PITCHES = "tooth,single_pitch_um\n" + "\n".join(
    f"{tooth + 1},{5 * (-1) ** tooth * (tooth < 18)}" for tooth in range(19)
)


@pytest.fixture
def written(tmp_path):
    """Writes a design file with a table [teeth], and what it refers to."""

    def write(teeth=TEETH, base=FIXED, **files):
        for name, text in {"pitches": PITCHES, **files}.items():
            (tmp_path / f"{name}.csv").write_text(text, encoding="utf-8")
        path = tmp_path / "pair.toml"
        path.write_text(base + teeth, encoding="utf-8")
        return path

    return write


def test_the_table_is_read(written):
    teeth = teeth_of(load_design(written()))
    assert (teeth.over, teeth.counts, teeth.wheel) == ("pinion", (19, 48), None)
    np.testing.assert_allclose(teeth.pinion.pitch, 5.0 * (np.arange(19) % 2 == 0) * (np.arange(19) < 18), atol=1e-9)
    assert teeth_of(load_design(written(TEETH.replace('"pinion"', "30")))).over == 30
    assert [(float(wave.amplitude), float(wave.order)) for wave in teeth.pinion.undulations] == [(4.0, 1.0)]


def test_several_ways_add_up_and_draws_depend_on_the_seed(written):
    pitch = f"pitch = {[1.0] * 48}\nprofile_slope = {[2.0] * 48}"
    table = "\n[teeth.wheel]\n{}\n{}undulations = [{{ amplitude = 0.3, order = 37 }}]\n"
    drawn = "quality_class = 6\nseed = {}\n"
    plain, first, again, other = (
        teeth_of(load_design(written(table.format(pitch, text)))).wheel
        for text in ("", drawn.format(1), drawn.format(1), drawn.format(2))
    )
    np.testing.assert_array_equal(first.pitch, again.pitch)
    assert np.ptp(first.pitch) > 1.0 and abs(first.pitch - other.pitch).max() > 0.1
    np.testing.assert_array_equal(plain.pitch, 1.0)
    np.testing.assert_array_equal(plain.flanks.amount, 2.0)
    assert [len(of.undulations) for of in (plain, first)] == [1, 3]


FLANKS = "tooth,roll_length_mm,measured_um\n" + "\n".join(
    f"{tooth},{roll},{-0.1 * tooth * (roll - 1)}" for tooth in range(19) for roll in (2.5, 9.0, 16.6)
)


def test_a_measured_flank_of_every_tooth(written):
    flanks = teeth_of(load_design(written('[teeth.pinion]\nflanks = "flanks.csv"', flanks=FLANKS))).pinion.flanks
    assert flanks.position.shape == (19, 3)
    np.testing.assert_allclose(flanks.amount[4], 0.4 * np.array([1.5, 8.0, 15.6]))


@pytest.mark.parametrize(
    ("teeth", "message"),
    [
        ("[teeth]\nover = 'pinion'", "teeth: needs the table pinion or wheel, or both"),
        (
            "[teeth]\nover = 'never'\n[teeth.wheel]",
            'teeth.over: "never" is not known, must be one',
        ),
        ("[teeth]\nover = 0\n[teeth.wheel]", "teeth.over: 0 must be at least 1 and at most 100000"),
        ("[teeth]\nover = [1]\n[teeth.wheel]", "teeth.over: must be a whole number, not a list"),
        ("[teeth.wheel]\npitch = [1.0]", "teeth.wheel.pitch: has 1 numbers, the gear has 48 teeth"),
        ("[teeth.wheel]\nrun_out = -1.0", "teeth.wheel.run_out: -1 um must be greater than 0 um"),
        ("[teeth.wheel]\nseed = 1", "teeth.wheel.seed: has no effect without quality_class"),
        ("[teeth.pinion]\nquality_class = 12", "teeth.pinion.quality_class: 12 must be at least 1 and at most 11"),
        ("[teeth.pinion]\nundulations = [{ order = 3 }]", "teeth.pinion.undulations[0].amplitude: missing"),
        (
            f"[teeth.pinion]\nsingle_pitch = {[1.0] * 19}",
            "sum to 19 um around the gear, must sum to 0 um",
        ),
        (
            f"[teeth.pinion]\nhelix_slope = {[1.0] * 19}",
            "teeth.pinion.helix_slope: needs resolution.slices",
        ),
        ('[teeth.pinion]\nfile = "none.csv"', "teeth.pinion.file: none.csv: No such file or directory"),
        ('[teeth.pinion]\nfile = "other.csv"', "teeth.pinion.file: other.csv: has no column pitch_um, single_pitch_um"),
        ('[teeth.pinion]\nfile = "letters.csv"', 'letters.csv: pitch_um of point 2 is "x", must be a number'),
        (
            '[teeth.pinion]\nfile = "metres.csv"',
            "has pitch_um within 0.005 um, less than flanks can be measured to: is it",
        ),
        ('[teeth.pinion]\nfile = "order.csv"', "order.csv: has the column tooth, must count 0, 1, 2"),
        ('[teeth.pinion]\nflanks = "other.csv"', "teeth.pinion.flanks: other.csv: has no column tooth, must have one"),
        ('[teeth.wheel]\nflanks = "flanks.csv"', "flanks.csv: has flanks of 19 teeth, must have 48"),
    ],
)
def test_what_is_refused(written, teeth, message):
    files = {
        "flanks": FLANKS,
        "other": "depth_um\n1.0",
        "letters": "pitch_um\n1.0\nx",
        "metres": "pitch_um\n0.005\n0.0",
    }
    path = written(teeth, **files, order="tooth,pitch_um\n1,0.0\n3,0.0")
    with pytest.raises(DesignFileError) as refused:
        load_design(path)
    assert message in str(refused.value) and "\n" not in str(refused.value)


def test_names_of_quantities_take_the_table(written):
    search = FREE.replace("[optimize]", '[optimize]\nobjective = "pinion_side_bands"')
    assert Search.of(load_design(written(base=search))).problem["objective"].settings.counts == (19, 48)
    base = FIXED.replace("amount = 6.5", 'amount = "height"') + VARIABLES
    sweep = base + '[sweep]\nsamples = 8\nresults = ["total_composite_error"]\n'
    assert asked_sweep(load_design(written(base=sweep))).results[0].settings.over == "pinion"
    with pytest.raises(DesignFileError, match=r'"pinion_side_bands" needs the table \[teeth\]'):
        load_design(written("", base=search))
    with pytest.raises(DesignFileError, match='"wheel_side_bands" needs whole revolutions of the wheel and'):
        load_design(written(base=search.replace("pinion_side_bands", "wheel_side_bands")))


def test_the_command_says_one_line_without_the_table(written):
    assert_refused(call("revolution", written("")), "teeth: missing; it says by how much the teeth of the gears differ")


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """One study of three designs, and the folder of its results."""
    folder = tmp_path_factory.mktemp("revolution")
    (folder / "pitches.csv").write_text(PITCHES, encoding="utf-8")
    path = folder / "pair.toml"
    path.write_text(FIXED + TEETH, encoding="utf-8")
    result = RevolutionStudy.of(load_design(path)).run()
    result.write(folder)
    return result, folder


def test_the_study_compares_designs(study):
    result, folder = study
    summary = json.loads(json.dumps(result.summary(), default=np.ndarray.tolist))
    assert list(summary["designs"]) == ["unmodified", "rule-based", "modified"] and summary["base_pitches"] == 19
    assert list(result.failures()) == []
    modified = summary["designs"]["modified"]
    assert modified["total_composite_error_um"] > 8.0  # the run-out alone
    assert modified["pinion_side_bands_um"] > 0 and "wheel_side_bands_um" not in modified
    (table,) = result.tables()
    assert len(table.rows) == 3 and "wheel\nside bands\n[um]" not in table.header
    assert all("pinion tooth" in line for line in result.verdict())
    with (folder / "orders.csv").open(encoding="utf-8") as file:
        lines = {(row["design"], row["name"], row["order"]): float(row["amplitude_um"]) for row in csv.DictReader(file)}
    assert lines["modified", "pinion shaft order", "1"] == pytest.approx(modified["pinion_shaft_order_um"], rel=1e-5)
    assert lines["modified", "mesh", "1"] == pytest.approx(modified["mesh_order_um"], rel=1e-5)
    with (folder / "revolution.csv").open(encoding="utf-8") as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["phase", "unmodified_um", "rule-based_um", "modified_um"] and len(rows) == 1 + 19 * 16


def test_figures(study):
    result, _ = study
    figures = {figure.name: figure.axes for figure in result.figures()}
    axes = figures["revolution"]
    assert axes.get_xlabel() == "revolutions of the wheel [-]" and len(axes.lines) == 3
    panel = figures["orders"][-1]
    assert panel.get_xlabel() == "order of the pinion [-]" and panel.get_yscale() == "log"
    assert {text.get_text() for text in panel.get_legend().get_texts()} == {"mesh orders", "shaft orders", "side bands"}
    plt.close("all")


@pytest.mark.slow
def test_the_command_writes_its_results(written, tmp_path):
    found = call("revolution", written(), "--output", tmp_path / "out", "--report")
    assert found.code == 0, found.err
    assert "most loaded, of the mean tooth's load: pinion tooth" in found.out
    assert {path.name for path in (tmp_path / "out").iterdir()} >= {"orders.png", "report.html", "summary.json"}
