"""The report: nothing from outside, no text taken for code, and one line where it cannot be written."""

import builtins
import copy
import datetime
import io
import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import openpyxl
import pytest
from commands import FIXED, SWEEP, assert_refused, call
from report_page import Page, assert_well_formed
from rich.console import Console

from jaxgear import plot, report
from jaxgear.cli import document
from jaxgear.io import load_design
from jaxgear.numerics import UnitKey
from jaxgear.studies import AbstractStudyResult, AnalysisStudy
from jaxgear.sweeps.columns import FLAG, NUMBER, Column, described
from jaxgear.sweeps.table import in_memory
from jaxgear.vocabulary import quantities

pytestmark = pytest.mark.usefixtures("no_cache")

HOSTILE = '<script>alert("1")</script> & \'<img src="http://example.com/x.png">\' </pre></style>'
FACTS = [("design file", "pair.toml")]


@pytest.fixture
def without(monkeypatch):
    """Makes a library look as if it were not installed."""

    def hide(name):
        real = builtins.__import__

        def refuse(module, *rest):
            if module.partition(".")[0] == name:
                raise ModuleNotFoundError(f"No module named '{name}'")
            return real(module, *rest)

        monkeypatch.setitem(sys.modules, name, None)
        monkeypatch.setattr(builtins, "__import__", refuse)

    return hide


def written(path: Path, **parts) -> Page:
    """A page with one section."""
    section = report.Chapter("Part", **parts)
    report.write_report(path, HOSTILE, HOSTILE, [("name", HOSTILE)], [section])
    assert_well_formed(path.read_bytes())
    return Page(path.read_text("utf-8"))


def test_text_of_others_is_text_everywhere(tmp_path):
    table = report.Table((HOSTILE, "b"), ((HOSTILE, HOSTILE),), HOSTILE, HOSTILE)
    picture = report.Picture("a", HOSTILE, "data:image/png;base64,AAAA", 100.0)
    texts = {"lines": [HOSTILE], "warnings": [HOSTILE], "points": [HOSTILE]}
    page = written(tmp_path / "page.html", **texts, tables=[table], figures=[picture], literal=f"\n{HOSTILE}")
    assert "script" not in page.tags and page.tags.count("img") == 1
    assert page.references == ["#section-1", "data:image/png;base64,AAAA"]
    assert [HOSTILE, HOSTILE] in page.rows and page.literal.strip() == HOSTILE


def test_what_is_no_text_is_replaced(tmp_path):
    page = written(tmp_path / "page.html", lines=["\udcff"], literal="a\x00\x07b\nc\td")
    assert page.literal.strip() == "a\ufffd\ufffdb\nc\td"
    assert "\udcff" not in (tmp_path / "page.html").read_text("utf-8")


def test_a_file_that_cannot_be_written_is_one_line(tmp_path):
    with pytest.raises(ValueError, match="page.html: cannot be written: No such file"):
        written(tmp_path / "none" / "page.html")
    assert list(tmp_path.iterdir()) == []


def test_a_table_is_the_one_that_is_printed():
    table = report.Table(("", "a"), title="title", note="note")
    table.add_row("x [um]", "1")
    table.add_section()
    table.add_row("y", "22")
    assert table == report.Table(("", "a"), (("x [um]", "1"), ("y", "22")), "title", "note", (0,))
    out = Console(file=io.StringIO(), width=40, markup=False)
    out.print(table)
    printed = [line.strip() for line in out.file.getvalue().splitlines() if line.strip()]
    assert printed == ["title", "a", printed[2], "x [um]    1", "y        22", "note"]


def test_figures_are_numbered_through_all_sections(tmp_path):
    picture = report.Picture("a", "What it shows.", "data:image/png;base64,AAAA", 100.0)
    sections = [report.Chapter("one", figures=[picture, picture]), report.Chapter("two", figures=[picture])]
    report.write_report(tmp_path / "page.html", "t", "s", FACTS, sections)
    page = (tmp_path / "page.html").read_text("utf-8")
    assert [page.count(f"Figure {number}. What it shows.") for number in range(1, 5)] == [1, 1, 1, 0]


@pytest.mark.parametrize("width", [100.0, 250.0])
def test_a_picture_has_its_own_size_on_paper(tmp_path, width):
    with plot.figure.report_figure(width, 60.0) as figure:
        figure.subplots().set_axis_off()
        figure.patch.set_alpha(0)
    path = tmp_path / "k_chart.png"
    figure.savefig(path, dpi=200)
    plt.close(figure)
    found = report.picture(path, "A K-chart.")
    assert found.width == pytest.approx(width, abs=0.2) and found.caption == "A K-chart."
    page = tmp_path / "page.html"
    written(page, figures=[found])
    assert ('class="wide"' in page.read_text("utf-8")) == (width > 210)


def test_a_file_that_is_no_picture_is_refused(tmp_path):
    (tmp_path / "a.png").write_bytes(b"no picture")
    with pytest.raises(ValueError, match="a.png: is not a PNG file"):
        report.picture(tmp_path / "a.png", "")


def test_a_figure_has_the_name_and_the_caption_of_its_function():
    figure = report.Figure.of(plot.ppte_over_torque, np.array([1.0, 2.0]), {"a": np.array([1.0, 2.0])})
    assert (figure.name, figure.caption) == ("ppte_over_torque", "PPTE over the torque.")
    assert figure.figure is figure.axes.figure
    plt.close(figure.figure)


@pytest.mark.parametrize(
    "key, text, words",
    [
        (UnitKey("face_load", "N/mm"), "face_load_N_per_mm", "face load [N/mm]"),
        (UnitKey("viscosity_40", "mm2/s"), "viscosity_40_mm2_per_s", "viscosity 40 [mm2/s]"),
        (UnitKey("torque", "N m"), "torque_Nm", "torque [N m]"),
        (UnitKey("reduction", "%", "less"), "reduction_percent", "less [%]"),
        (UnitKey("elasticity_factor", "MPa^0.5"), "elasticity_factor_sqrt_MPa", "elasticity factor [MPa^0.5]"),
        (UnitKey("teeth"), "teeth", "teeth"),
        (quantities["loss_power"].key, "loss_power_W", "power loss of the flanks [W]"),
        ("max_flank_pressure_MPa", "max_flank_pressure_MPa", "max flank pressure [MPa]"),
        ("pairs_MPa", "pairs_MPa", "pairs MPa"),
    ],
)
def test_a_name_in_words(key, text, words):
    assert key == text and report.heading(key) == words
    assert report.heading(copy.deepcopy(key)) == report.heading(pickle.loads(pickle.dumps(key))) == words


def test_records_are_a_table_and_numbers():
    records = (
        report.Record("width", "mm", lambda of: of[0], ""),
        report.Record("mass", "kg", lambda of: of[1], "heavy", lambda mass: f"{1000 * mass:g} g"),
        report.Record("count", "", lambda of: len(of)),
        report.Record("age", "h", lambda of: None, "age"),
    )
    rows = {"a": (1.0, 2.0), "b": (3.0, 4.0)}
    assert report.numbers_of(records, rows["a"]) == {"width_mm": 1.0, "mass_kg": 2.0, "count": 2}
    down = report.table_of(records, rows, "title", "of")
    assert down == report.Table(
        ("of", "width [mm]", "heavy"), (("a", "1.000", "2000 g"), ("b", "3.000", "4000 g")), "title"
    )
    across = report.table_of(records, list(rows.items()), "title", across=True, note="note")
    assert across.header == ("", "a", "b") and across.rows[0] == ("width [mm]", "1.000", "3.000")


def test_numbers_of_nested_data_keep_their_place():
    data = {
        UnitKey("a", "mm"): {"b": 1.23456789, "c": [{"d": True}, {"d": False}]},
        "e": None,
        "f": np.array([1.0, np.nan]),
        "g": {},
    }
    assert list(report.numbers(data)) == [
        ("a [mm] / b", "1.23457"),
        ("a [mm] / c / 1 / d", "yes"),
        ("a [mm] / c / 2 / d", "no"),
        ("e", "-"),
        ("f", "1, -"),
        ("g", "-"),
    ]


class SomeResult(AbstractStudyResult):
    """A result with these findings and failures."""

    def __init__(self, findings, failures=()):
        self.findings, self.failures = lambda: findings, lambda: failures

    def summary(self):
        return {}


def test_what_nobody_looked_at_is_not_called_usual(tmp_path):
    (tmp_path / "pair.toml").write_text(FIXED)
    study = AnalysisStudy.of(load_design(tmp_path / "pair.toml"))
    asked = document.Document(("analyze", "pair.toml"), "pair.toml", b"title = 1\n", datetime.datetime.now())
    for findings, said in (((), True), (None, False), (["warning: this"], False)):
        asked.write(tmp_path, study, SomeResult(findings), {})
        page = (tmp_path / "report.html").read_text("utf-8")
        assert ("within the usual ranges" in page) == said and ("warning: this" in page) == bool(findings)
        assert "no limit is exceeded" in page
    asked.write(tmp_path, study, SomeResult(None, ["NOT CONVERGED"]), {})
    page = (tmp_path / "report.html").read_text("utf-8")
    assert "no limit is exceeded" not in page and page.count("NOT CONVERGED") == 2


def test_the_workbook_holds_the_table(tmp_path):
    pyarrow = pytest.importorskip("pyarrow")
    columns = [
        NUMBER,
        Column(described("=1+1", "um"), "parameter"),
        Column(quantities["ppte"]),
        FLAG,
    ]
    values = {"variant": [0, 1, 2], "=1+1": [1.5, 2.5, 3.5], "ppte_um": [0.3, np.nan, 0.2]}
    table = in_memory("t", columns, [pyarrow.table({**values, "converged": [True, False, True]})])
    path = tmp_path / "variants.xlsx"
    report.write_workbook(path, FACTS, table.best(2), table)
    book = openpyxl.load_workbook(path)
    assert book.sheetnames == ["about", "best", "variants"]
    assert [cell.value for cell in book["about"][1]] == ["design file", "pair.toml"]
    sheet = book["variants"]
    assert [[cell.value for cell in row] for row in sheet.iter_rows()] == [
        ["variant", "=1+1 [um]", "ppte_um", "converged"],
        [0, 1.5, 0.3, True],
        [1, 2.5, None, False],
        [2, 3.5, 0.2, True],
    ]
    assert all(cell.data_type == "s" for cell in sheet[1])  # no formula
    assert sheet.freeze_panes == "B2" and sheet.auto_filter.ref == "A1:D4"
    assert [row[0].value for row in book["best"].iter_rows(min_row=2)] == [2, 0]


@pytest.mark.parametrize(
    "command, library",
    [("analyze", "jinja2"), ("optimize", "jinja2"), ("sweep", "jinja2"), ("sweep", "xlsxwriter"), ("sweep", "plotly")],
)
def test_without_the_libraries_nothing_begins(tmp_path, without, command, library):
    file = tmp_path / "pair.toml"
    file.write_text(SWEEP if command == "sweep" else FIXED)
    without(library)
    done = call(command, file, "--report", "--output", tmp_path / "out")
    assert_refused(done, f"--report needs the library {library}: pip install 'jaxgear[report]'")
    assert not (tmp_path / "out").exists()


def test_without_the_libraries_other_commands_run(tmp_path, without):
    """They are asked for where a report is."""
    without("jinja2")
    assert document.document(None, tmp_path / "none.toml") is None


@pytest.mark.parametrize("command", ["analyze", "dynamics", "layout"])
def test_a_file_that_is_not_there_is_one_line(tmp_path, command):
    done = call(command, tmp_path / "none.toml", "--report", "--output", tmp_path / "out")
    assert_refused(done, "none.toml", "No such file")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(shutil.which("chromium") is None, reason="needs the browser")
def test_a_browser_prints_it(tmp_path):
    """Two short sections, one of which begins on a new page, on paper of the size A4."""
    page = tmp_path / "page.html"
    sections = [report.Chapter("a", ["b"]), report.Chapter("c", ["d"], new_page=True)]
    report.write_report(page, "title", "sub", FACTS, sections)
    paper = tmp_path / "page.pdf"
    options = ("--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'profile'}")
    command = ("chromium", *options, f"--print-to-pdf={paper}", page.as_uri())
    subprocess.run(command, check=True, capture_output=True, timeout=60)
    held = paper.read_bytes()
    assert held.count(b"/Type /Page\n") == 2 or b"/Count 2" in held
    assert b"/MediaBox [0 0 594.95996 841.91998]" in held or b"[0 0 595" in held
