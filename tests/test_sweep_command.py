"""The command `jaxgear sweep`: what it prints and writes, how it resumes, and that every failure is one line."""

import csv
import importlib
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import jax
import matplotlib.pyplot as plt
import numpy as np
import openpyxl
import pyarrow
import pyarrow.parquet as parquet
import pytest
from commands import FREE, SWEEP, assert_refused, call
from design_texts import asked_sweep
from report_page import assert_row, check_report

import jaxgear as jg
from jaxgear.cli import jax_setup
from jaxgear.contact.status import Status
from jaxgear.io import load_design, read_variants
from jaxgear.metrics.findings import LIMITS
from jaxgear.plot.figure import captioned
from jaxgear.studies import evaluation
from jaxgear.studies.study import Stages
from jaxgear.sweeps import SweepTable
from jaxgear.sweeps import run as sweep_run
from jaxgear.sweeps.columns import Column, described

SWEEPS = importlib.import_module("jaxgear.studies.sweep")
CHOSEN = 2  # variants that the report shows side by side and on a page each


def sweep(file, *arguments):
    return call("sweep", file, "--no-figures", *arguments)


@pytest.fixture(autouse=True)
def no_cache(monkeypatch):
    """The tests keep their own compilation cache, and the devices that there are."""
    monkeypatch.setenv("JAXGEAR_NO_CACHE", "1")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A design file and its sweep."""
    folder = tmp_path_factory.mktemp("sweep")
    (folder / "gear.toml").write_text(SWEEP)
    os.environ["JAXGEAR_NO_CACHE"] = "1"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(evaluation, "_TORQUES", 5)  # as in `test_cli`
        patch.setattr(SWEEPS, "CHOSEN", CHOSEN)
        result = call("sweep", folder / "gear.toml", "-o", folder / "out", "--best", "5", "--report")
    assert result.code == 0, result.err
    return folder, result


def test_the_best_variant_says_what_a_finer_mesh_would_change_and_what_is_unusual(folder, monkeypatch):
    folder, result = folder
    file, best = load_design(folder / "gear.toml"), jg.open_sweep(folder / "out" / "table").best(1)
    pinion, wheel = file.design(best.designs()[0])
    size = file.resolution()
    ppte = [
        float(jg.peak_to_peak(jg.solve(file.mesh(of), 50.0, pinion=pinion, wheel=wheel).transmission_error))
        for of in (size, replace(size, positions=2 * size.positions))
    ]
    told = f"variant {best.column('variant')[0]} at 50 N m by {ppte[1] - ppte[0]:+.2g} um"
    assert f"evaluated at 16 positions; twice as many change PPTE: {told}" in result.out
    assert told in (folder / "out" / "report.html").read_text("utf-8")
    monkeypatch.setitem(LIMITS, "flank pressure", LIMITS["flank pressure"]._replace(high=1.0))
    _, (unusual,) = SWEEPS.best_variant_lines(file, best, size)
    assert unusual.startswith(f"warning: variant {best.column('variant')[0]} at 50 N m: flank pressure ")


def test_the_report_shows_the_best_variants(folder):
    folder, _ = folder
    typed = "sweep", folder / "gear.toml", "-o", folder / "out", "--best", "5", "--report"
    page = check_report(folder / "out", folder / "gear.toml", *typed)
    best = jg.open_sweep(folder / "out" / "table").best(5)
    names = [f"variant {number}" for number in best.column("variant")]
    assert ["", *names] in page.rows
    for name, heading in (("height", "height [um]"), ("ppte_um", "PPTE [um]")):
        assert_row(page, heading, list(best.column(name)))
    # evaluated on a mesh of their own, to the same result
    assert ["", "unmodified", *names[:CHOSEN]] in page.rows
    again = next(row for row in page.rows if row[0] == "PPTE [um]")[2:]
    assert [float(cell) for cell in again] == pytest.approx(list(best.column("ppte_um"))[:CHOSEN], abs=6e-4)
    for number in names[:CHOSEN]:  # a page each
        assert ["", number, "least of all", "largest of all", "better is"] in page.rows
    book = openpyxl.load_workbook(folder / "out" / "variants.xlsx")
    found = [[cell.value for cell in row] for row in book["best"].iter_rows(min_row=2)]
    assert [row[0] for row in found] == list(best.column("variant"))
    assert [row[2] for row in found] == pytest.approx(list(best.column("ppte_um")))
    assert book["variants"].max_row == 61


@pytest.mark.slow
def test_the_table_is_that_of_the_library(folder):
    folder, _ = folder
    table = jg.open_sweep(folder / "out" / "table")
    assert table.names == ("variant", "height", "ppte_um", "effective_contact_ratio", "converged", "status")
    assert table.units["height"] == "um" and len(table) == 60 and table.title == "a [small] pair"
    np.testing.assert_array_equal(
        table.column("height"), jg.LatinHypercube({"height": (0.0, 20.0)}, 60, seed=0).rows(0, 60)[:, 0]
    )
    file = load_design(folder / "gear.toml")
    plan = asked_sweep(file).plan
    direct = jg.sweep(file.mesh(), 50.0, file.design, plan, results=("ppte", "effective_contact_ratio"))
    np.testing.assert_array_equal(table.column("ppte_um"), direct.column("ppte_um"))


def test_the_best_are_printed_and_written(folder):
    folder, result = folder
    best = jg.open_sweep(folder / "out" / "table").best(5)
    assert "a [small] pair, best first by ppte_um" in result.out and "height [um]" in result.out
    for name, form in (("ppte_um", ".3f"), ("height", ".4g")):
        assert f"{best.column(name)[0]:{form}}" in result.out
    assert f"table in {folder / 'out' / 'table'}{os.sep}" in result.out and "60 variants, " in result.out
    read = read_variants(folder / "out" / "best.csv", {"height": (0.0, 20.0)}, {"height": "um"})
    np.testing.assert_array_equal(read.rows(0, 5)[:, 0], best.column("height"))
    assert "jaxgear: 60 of 60 variants" in result.err


def test_pictures_show_every_variant_or_an_even_share(folder, tmp_path, monkeypatch):
    folder, _ = folder
    names = {path.stem for path in (folder / "out").glob("*.png")}
    assert {"pareto", "parallel_coordinates"} < names and "radar" not in names
    assert {
        "transmission_error",
        "transmission_error_orders",
        "k_chart",
    } < names  # of the best, for the report
    monkeypatch.setattr(SWEEPS, "_DRAWN", 20)
    drawn = {}
    pareto = captioned("")(lambda table: drawn.update(table) or plt.subplots()[1])
    monkeypatch.setattr("jaxgear.plot.pareto", pareto)
    table = jg.open_sweep(folder / "out" / "table")
    for figure in SWEEPS.figures_of(table):
        plt.close(figure.figure)
    front = table.pareto(["ppte_um", "effective_contact_ratio"]).column("ppte_um")
    assert set(drawn[table.find("ppte")]) == {*table.column("ppte_um")[::3], *front}


def test_repeated_it_finds_everything_there(folder):
    folder, _ = folder
    before = {path.name: path.stat().st_mtime_ns for path in (folder / "out" / "table").glob("part-*")}
    result = sweep(folder / "gear.toml", "-o", folder / "out")
    assert result.code == 0 and "resuming, 60 of 60 variants are complete" in result.err
    assert {path.name: path.stat().st_mtime_ns for path in (folder / "out" / "table").glob("part-*")} == before
    other = sweep(folder / "gear.toml", "-o", folder / "out", "--samples", "61")
    assert_refused(other, "table: holds a sweep of other settings (plan, variants)")


def test_a_list_of_variants_may_be_the_best_of_a_sweep(folder, tmp_path):
    folder, _ = folder
    listed = SWEEP.replace("samples = 60", 'file = "best.csv"').replace("latin_hypercube", "list")
    (tmp_path / "listed.toml").write_text(listed)
    (tmp_path / "best.csv").write_bytes((folder / "out" / "best.csv").read_bytes())
    assert sweep(tmp_path / "listed.toml", "-o", tmp_path / "out").code == 0
    again, best = (
        jg.open_sweep(tmp_path / "out" / "table"),
        jg.open_sweep(folder / "out" / "table").best(len(jg.open_sweep(tmp_path / "out" / "table"))),
    )
    np.testing.assert_array_equal(again.column("ppte_um"), best.column("ppte_um"))


def test_a_quick_sweep_is_coarse_short_and_says_so(folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(SWEEPS, "_QUICK_SAMPLES", 60)
    fine = SWEEP.replace("positions = 16", "positions = 4096").replace("samples = 60", "samples = 5000")
    (tmp_path / "gear.toml").write_text(fine)
    result = sweep("gear.toml", "--quick")
    assert result.code == 0 and "quick run" in result.out
    table = jg.open_sweep("results/gear/sweep-quick/table")
    assert len(table) == 60
    np.testing.assert_array_equal(table.column("ppte_um"), jg.open_sweep(folder[0] / "out" / "table").column("ppte_um"))


def test_failed_variants_are_loud(folder, tmp_path, monkeypatch):
    evaluated = sweep_run._evaluate_few

    def failed(*given):
        values, status = evaluated(*given)
        return values, np.full_like(status, Status.MORE_PAIRS_NEEDED)

    monkeypatch.setattr(sweep_run, "_evaluate_few", failed)
    (tmp_path / "gear.toml").write_text(SWEEP)
    result = sweep(tmp_path / "gear.toml", "-o", tmp_path / "out")
    assert result.code == 1 and "60 variants failed" in result.err
    said = " ".join(result.err.split())
    assert "60 of 60 variants: tooth pairs" in said and "leave pairs of the resolution open, or raise it to" in said
    assert list(jg.open_sweep(tmp_path / "out" / "table").column("status")) == 60 * ["more_pairs_needed"]


def test_a_slow_sweep_tells_how_far_it_is_before_the_next_tenth(monkeypatch):
    clock, stages = [0.0], []
    monkeypatch.setattr(SWEEPS.time, "perf_counter", lambda: clock[0])
    meter = SWEEPS._Meter(Stages(lambda progress: progress.done is None and stages.append(progress.stage)))
    for done in range(0, 6):
        meter(done, 1000, None)
        clock[0] += 20.0
    assert [stage.partition(",")[0] for stage in stages] == ["2 of 1", "4 of 1"]


def test_interrupted_while_drawing_it_says_what_is_there(folder, monkeypatch):
    folder, _ = folder
    monkeypatch.setattr(SWEEPS, "figures_of", lambda *_: signal.raise_signal(signal.SIGINT))
    result = call("sweep", folder / "gear.toml", "-o", folder / "out")
    line = f"all tables are complete in {folder / 'out'}{os.sep}, not all figures are drawn"
    assert result.code == 130 and result.err.splitlines()[-1] == f"jaxgear: interrupted, {line}"


def test_a_damaged_part_is_named_and_mended(folder, tmp_path):
    folder, _ = folder
    parts = sorted((folder / "out" / "table").glob("part-*"))
    sound = parts[1].read_bytes()
    parts[1].write_bytes(sound[:1000] + bytes([sound[1000] ^ 1]) + sound[1001:])
    result = sweep(folder / "gear.toml", "-o", folder / "out")
    warning = f"jaxgear: warning: {parts[1]}: is damaged or displaced, its variants are evaluated again"
    assert result.code == 0 and warning in result.err.splitlines()
    assert parts[1].read_bytes() == sound


def test_a_folder_of_something_else_is_refused(folder, tmp_path):
    (tmp_path / "best.csv").write_text("mine")
    assert_refused(sweep(folder[0] / "gear.toml", "-o", tmp_path), "holds other files than a sweep (best.csv)")
    assert (tmp_path / "best.csv").read_text() == "mine"


@pytest.mark.slow
def test_an_interrupted_sweep_says_how_to_go_on_and_does(tmp_path):
    content = SWEEP.replace("samples = 60", "samples = 6000").replace("part_rows = 25", "part_rows = 100")
    (tmp_path / "gear.toml").write_text(content)
    command = [
        sys.executable,
        "-c",
        "from jaxgear.cli import main; main()",
        "sweep",
        "gear.toml",
        "-o",
        "out",
        "--no-figures",
    ]
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
        "JAX_COMPILATION_CACHE_DIR": str(jax.config.jax_compilation_cache_dir or tmp_path / "compiled"),
        "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
        "JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES": "-1",
    }
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    process = subprocess.Popen(command, cwd=tmp_path, env=environment, **pipes)
    try:
        while len(list((tmp_path / "out" / "table").glob("part-*"))) < 3 and process.poll() is None:
            time.sleep(0.001)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    finally:
        process.kill()
    assert process.returncode == 130 and out == ""
    assert err.splitlines()[-1].startswith("jaxgear: interrupted, ")
    assert err.endswith(f" of 6,000 variants are in out{os.sep}, resume with the same command\n")
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0 and "jaxgear: resuming, " in done.stderr
    assert len(jg.open_sweep(tmp_path / "out" / "table")) == 6000


@pytest.mark.parametrize(
    "old, new, fragments",
    [
        ("[sweep]", "[swep]", ['gear.toml: swep: unknown key, did you mean "sweep"?']),
        ("samples = 60", "", ['sweep.samples: missing, sampling = "latin_hypercube" needs it']),
        ("samples = 60", "samples = 0", ["sweep.samples: 0 must be at least 1"]),
        ("samples = 60", "samples = 60\nlevels = 3", ['sweep.levels: has no effect with sampling = "latin_hypercube"']),
        ('"latin_hypercube"', '"sobbol"', ['sweep.sampling: "sobbol" is not known, did you mean "sobol"?']),
        ('"ppte"', '"pte"', ['sweep.results[0]: "pte" is not known, did you mean "ppte"?']),
        ('"ppte"', '"effective_contact_ratio"', ['sweep.results[1]: "effective_contact_ratio" is given twice']),
        ('"ppte"', '"te_harmonic_3", "ppte"', None),
        ("part_rows = 25", "weights = [1.0]", ["sweep.weights: has no effect without sweep.torques"]),
        ("part_rows = 25", "torques = [-1.0]", ["sweep.torques[0]: -1 N m must be greater than 0 N m"]),
        ("part_rows = 25", "torques = [1, 2]\nweights = [1]", ["sweep.weights: 1 weights must be"]),
        ("part_rows = 25", "part_rows = 0", ["sweep.part_rows: 0 must be"]),
        ('"latin_hypercube"\nsamples = 60', '"full_factorial"', ["sweep.levels: missing"]),
        ('"latin_hypercube"\nsamples = 60', '"full_factorial"\nlevels = 1', ["sweep.levels: 1 must be at least 2"]),
        ('"latin_hypercube"\nsamples = 60', '"full_factorial"\nlevels = "3"', ["sweep.levels: must be a whole number"]),
        ('"latin_hypercube"\nsamples = 60', '"list"', ["sweep.file: missing"]),
        ('"latin_hypercube"\nsamples = 60', '"list"\nfile = "no.csv"', ["no.csv: No such file or directory"]),
        ('"latin_hypercube"\nsamples = 60', '"list"\nfile = "bad.csv"', ["bad.csv: ", "tall"]),
        ('"latin_hypercube"\nsamples = 60', '"list"\nfile = "other.csv"', ["other.csv: has no column height"]),
        ('"latin_hypercube"\nsamples = 60', '"list"\nfile = "empty.csv"', ["empty.csv: holds no variants"]),
        ('"latin_hypercube"\nsamples = 60', '"list"\nfile = "bad.parquet"', ["bad.parquet: "]),
        ("[sweep]", "[tolerance]\nquality_class = 99\n[sweep]", ["tolerance.quality_class: ", "99"]),
        ("[sweep]", "[tolerance]\nquality_class = 5\nmisalignment = 3.0\n[sweep]", ["tolerance.misalignment: needs"]),
    ],
)
def test_a_wrong_sweep_is_refused_before_anything_is_written(tmp_path, monkeypatch, old, new, fragments):
    monkeypatch.chdir(tmp_path)
    assert old in SWEEP
    (tmp_path / "gear.toml").write_text(SWEEP.replace(old, new))
    (tmp_path / "bad.csv").write_text("height\n1.0\ntall\n")
    (tmp_path / "other.csv").write_text("width\n1.0\n")
    (tmp_path / "empty.csv").write_text("height\n")
    (tmp_path / "bad.parquet").write_text("no")
    if fragments is None:
        asked_sweep(load_design("gear.toml"))  # the control: this one is right
    else:
        assert_refused(sweep("gear.toml"), *fragments)
    assert not (tmp_path / "results").exists()


def test_the_example_asks_for_a_million():
    example = Path(__file__).parents[1] / "examples" / "sweep_19_48.toml"
    request = asked_sweep(load_design(example))
    assert request.plan.size == 1_000_000 and request.load.torques.tolist() == [50.0]


def test_a_file_without_a_sweep_or_variables_is_refused(tmp_path):
    (tmp_path / "free.toml").write_text(FREE)
    assert_refused(sweep(tmp_path / "free.toml"), "free.toml: sweep: missing; it says which variants")
    fixed = SWEEP.replace('"height"', "6.5").partition("[variables]")
    (tmp_path / "fixed.toml").write_text(fixed[0] + fixed[2].partition('unit = "um" }')[2])
    assert_refused(sweep(tmp_path / "fixed.toml"), "fixed.toml: sweep: has no effect without [variables]")


def test_requests_cover_all_that_a_file_can_say(tmp_path):
    def request(old, new):
        (tmp_path / "gear.toml").write_text(SWEEP.replace(old, new))
        return asked_sweep(load_design(tmp_path / "gear.toml"))

    assert request('"latin_hypercube"', '"sobol"\nseed = 4').plan.describe()["seed"] == 4
    factorial = request('"latin_hypercube"\nsamples = 60', '"full_factorial"\nlevels = { height = [3.0, 5.0] }').plan
    assert factorial.rows(0, 2).tolist() == [[3.0], [5.0]]
    assert request('"latin_hypercube"\nsamples = 60', '"full_factorial"\nlevels = 7').plan.size == 7
    load = request("part_rows = 25", "torques = [25.0, 50.0]\nweights = [3, 1]").load
    assert load.weights.tolist() == [0.75, 0.25]
    gears = request("[sweep]", "[tolerance]\nquality_class = [5, 6]\nsamples = 8\nseed = 2\n[sweep]").manufactured
    assert (gears.samples, gears.seed) == (8, 2) and gears.tolerance.pinion.helix_slope is None
    assert request("[sweep]", "[sweep]").manufactured is None


@pytest.mark.parametrize(
    "arguments, fragment",
    [
        (["--coordinator", "localhost:1"], "--coordinator, --processes and --process go together"),
        (["--coordinator", "localhost", "--processes", "2", "--process", "0"], "localhost must be HOST:PORT"),
        (["--coordinator", "h:1", "--processes", "2", "--process", "2"], "--process 2 must be less than --processes 2"),
        (["--distributed", "--process", "0"], "--distributed finds"),
        (["--samples", "0"], "--samples"),
    ],
)
def test_wrong_options_are_one_line(folder, arguments, fragment):
    assert_refused(sweep(folder[0] / "gear.toml", *arguments), fragment)


def test_every_usable_core_becomes_a_device_unless_told_otherwise(monkeypatch):
    settings = {}
    monkeypatch.setattr(jax_setup.jax.config, "update", settings.__setitem__)
    monkeypatch.delenv("JAX_NUM_CPU_DEVICES", raising=False)
    monkeypatch.setenv("XLA_FLAGS", "")
    for cores, wanted in ((1, 2), (2, 2), (48, 48)):
        monkeypatch.setattr(jax_setup, "usable_cores", lambda cores=cores: cores)
        jax_setup.use_all_cores()
        assert settings.pop("jax_num_cpu_devices") == wanted
    monkeypatch.setenv("JAX_NUM_CPU_DEVICES", "3")
    jax_setup.use_all_cores()
    monkeypatch.delenv("JAX_NUM_CPU_DEVICES")
    monkeypatch.setenv("XLA_FLAGS", "--xla_force_host_platform_device_count=5")
    jax_setup.use_all_cores()
    assert not settings


BOX = {"a": (0.0, 20.0), "l": (1.0, 6.0)}


def listed(path, content, encoding="utf-8"):
    path.write_text(content, encoding=encoding)
    return read_variants(path, BOX, {"a": "um", "l": "mm"}).rows(0, 1).tolist()


def test_headings_are_no_formulas_and_read_back(tmp_path):
    """Names are the user's: quotes within them, and what a spreadsheet would calculate or run."""
    names = ['a"b', "=cmd|' /C calc'!A0", "+1", "@x", "plain", "'quoted"]
    path = tmp_path / "list.csv"
    SweepTable("", [Column(described(name, "um"), "parameter") for name in names], (), None).to_csv(path)
    (headings,) = csv.reader(path.read_text().splitlines())
    assert [heading[0] for heading in headings] == ["a", "'", "'", "'", "p", "'"]
    with path.open("a") as file:
        file.write("0,1,2,3,4,5\n")
    box, units = dict.fromkeys(names, (0.0, 9.0)), dict.fromkeys(names, "um")
    assert read_variants(path, box, units).rows(0, 1).tolist() == [[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]]


def test_a_list_in_other_units_is_converted_or_refused(tmp_path):
    path = tmp_path / "list.csv"
    assert listed(path, "a [mm],l [um]\n0.006,3400\n") == [[6.0, 3.4]]
    assert listed(path, '"l","other","a [µm]",other\n3.4,x,6,y\n') == [[6.0, 3.4]]
    assert listed(path, "\ufeffa,l [mm]\n6,3.4\n") == [[6.0, 3.4]]
    with pytest.raises(ValueError, match=r"list.csv: column a is in \[deg\], must be in \[um\]"):
        listed(path, "a [deg],l\n6,3.4\n")
    table = pyarrow.table({"a": [0.006], "l": [3.4]})
    fields = [pyarrow.field("a", "float64", metadata={"unit": "mm"}), pyarrow.field("l", "float64")]
    parquet.write_table(table.cast(pyarrow.schema(fields)), tmp_path / "list.parquet")
    assert read_variants(tmp_path / "list.parquet", BOX, {"a": "um"}).rows(0, 1).tolist() == [[6.0, 3.4]]


@pytest.mark.parametrize(
    "content, encoding, problem",
    [
        ("a,l\n6,3\n6,7\n", "utf-8", "l = 7 of variant 1 must be from 1 to 6"),
        ("a,l\n-1e-9,3\n", "utf-8", "a = -1e-09 of variant 0 must be from 0 to 20"),
        ("a,l\ninf,3\n", "utf-8", "a = inf of variant 0 must be"),
        ("a,l,a [mm]\n6,3,6\n", "utf-8", "has 2 columns a, must have one"),
        ("a,l,Ä\n6,3,1\n", "latin-1", "is not text in UTF-8"),
        ("a,l\n6,3\n", "utf-16", "is not text in UTF-8"),
    ],
)
def test_a_list_that_cannot_be_meant_is_refused_by_name(tmp_path, content, encoding, problem):
    with pytest.raises(ValueError, match=f"list.csv: {problem}"):
        listed(tmp_path / "list.csv", content, encoding)
