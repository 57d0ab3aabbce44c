"""The page of variants: all in one file, no text taken for code, and what it works out in the browser."""

import html
import json
import re
import shutil
import subprocess

import numpy as np
import pytest
from report_page import Page, assert_well_formed

from jaxgear import report
from jaxgear.numerics.pareto import pareto_front
from jaxgear.sweeps.columns import FLAG, NUMBER, Column, described
from jaxgear.sweeps.table import in_memory
from jaxgear.vocabulary import quantities

pyarrow, offline = pytest.importorskip("pyarrow"), pytest.importorskip("plotly.offline")

HOSTILE = '</script><script>alert("1")</script> & <!-- '
COLUMNS = [
    NUMBER,
    Column(described("height", "um"), "parameter"),
    Column(quantities["ppte"]),
    Column(described("effective_contact_ratio", label=HOSTILE, better="larger")),
    Column(quantities["mean_te"]),
    Column(quantities["mean_te"], torque=50.0),
    FLAG,
]
MAIN = ["ppte_um", "effective_contact_ratio", "mean_te_um"]


def values(count):
    """Two results that cost each other, with ties, and one failed variant."""
    generator = np.random.default_rng(4)
    height = generator.uniform(0.0, 20.0, count)
    ppte = np.round(np.abs(height - 8.0) + generator.uniform(0.0, 3.0, count), 1)
    ratio = np.round(1.8 - 0.01 * height + generator.uniform(0.0, 0.1, count), 2)
    ppte[5] = ratio[5] = np.nan
    mean = 10.0 + height
    columns = np.arange(count), height, ppte, ratio, mean, 1.1 * mean, np.isfinite(ppte)
    return dict(zip((column.name for column in COLUMNS), columns))


@pytest.fixture
def page(tmp_path):
    """Writes the page of so many variants."""

    def write(count):
        table = in_memory("t", COLUMNS, [pyarrow.table(values(count))])
        path = tmp_path / "variants.html"
        facts = [("design file", HOSTILE)]
        report.write_variants(path, f"a pair {HOSTILE}", facts, table)
        return path

    return write


def data_of(text):
    return json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)[1])


def test_the_page_holds_all_it_needs(page):
    text = page(40).read_text("utf-8")
    library = offline.get_plotlyjs()
    assert text.count(library) == 1 and len(text) < len(library) + 50_000
    own = text.replace(library, "")
    assert_well_formed(own.encode())
    # scripts hold no markup, which the parser of the tests would otherwise take for some
    found = Page(re.sub(r"(<script[^>]*>).*?</script>", r"\1</script>", own, flags=re.DOTALL))
    assert found.references == [] and found.tags.count("script") == 3
    assert "url(" not in found.styles and "@import" not in found.styles
    policy = re.search(r'http-equiv="Content-Security-Policy" content="([^"]*)"', own)[1]
    assert policy.startswith("default-src 'none';") and "http" not in policy
    assert ["design file", HOSTILE] in found.rows


def test_the_page_knows_the_variants_that_did_not_fail(page):
    text, given = page(40).read_text("utf-8"), values(40)
    data = data_of(text)
    assert "39 of 40 variants, 1 failed" in text
    fine = np.isfinite(given["ppte_um"])
    assert data["variants"] == given["variant"][fine].tolist()
    assert [column["label"] for column in data["columns"]] == [
        "height [µm]",
        "PPTE [µm]",
        f"{HOSTILE} [-]",
        "mean transmission error [µm]",
        "mean transmission error at 50 N m [µm]",
    ]
    assert [column["main"] for column in data["columns"]] == [True] * 4 + [False]
    assert [column["better"] for column in data["columns"]] == ["", "smaller", "larger", "smaller", "smaller"]
    for column, name in zip(data["columns"], ("height", *MAIN, "mean_te_um_50Nm")):
        np.testing.assert_allclose(column["values"], given[name][fine], rtol=1e-5)
    assert np.sort(given["ppte_um"][fine])[:3].tolist() == [data["columns"][1]["values"][row] for row in data["chosen"]]


def test_of_many_variants_the_best_and_the_front_are_among_those_shown(page, monkeypatch):
    monkeypatch.setattr("jaxgear.report.variants.MOST_ROWS", 60)
    data, given = data_of(page(2000).read_text("utf-8")), values(2000)
    shown = set(data["variants"])
    signed = np.stack([given["ppte_um"], -given["effective_contact_ratio"]], axis=1)
    unique = np.unique(signed[pareto_front(signed)], axis=0)
    rows = [data["variants"].index(row) for row in shown]
    ppte, ratio = (np.asarray(data["columns"][place]["values"])[rows] for place in (1, 2))
    kept = np.stack([ppte, -ratio], axis=1)
    assert all((np.abs(kept - point) < 1e-9).all(axis=1).any() for point in unique)
    best = np.argsort(np.where(np.isnan(given["ppte_um"]), np.inf, given["ppte_um"]), kind="stable")[:20]
    assert set(best.tolist()) <= shown and len(shown) <= 60 + len(unique) + 1


ACTIONS = """<script>
window.addEventListener("load", () => setTimeout(async () => {
  const seen = [pick("status").textContent];
  pick("take").click();
  seen.push(chosen.map((row) => data.variants[row]).join(" "));
  await Plotly.restyle("parallel", { "dimensions[0].constraintrange": [[2, 7]] });
  seen.push(pick("status").textContent, kept.length);
  seen.push(paretoFront(kept, ...axes()).map((row) => data.variants[row]).join(" "));
  seen.push(pick("pareto")._fullLayout.xaxis.title.text, document.querySelectorAll("#chosen tr").length);
  const found = document.createElement("pre");
  found.id = "seen";
  found.textContent = JSON.stringify(seen);
  document.body.append(found);
}, 500));
</script></body>"""


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("chromium") is None, reason="needs the browser")
def test_a_browser_finds_the_front_and_what_is_within_the_ranges(page, tmp_path):
    """The front is that of the library, over all variants and within a range of a variable."""
    path, given = page(200), values(200)
    path.write_text(path.read_text("utf-8").replace("</body>", ACTIONS), "utf-8")
    options = ("--headless", "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader")
    quiet = ("--disable-background-networking", f"--user-data-dir={tmp_path / 'profile'}")
    command = ("chromium", *options, *quiet, "--virtual-time-budget=20000", "--dump-dom", path.as_uri())
    done = subprocess.run(command, check=True, capture_output=True, timeout=100)
    text = re.search(r'<pre id="seen">(.*?)</pre>', done.stdout.decode("utf-8"), re.DOTALL)[1]
    before, taken, after, kept, front, axis, rows = json.loads(html.unescape(text))
    signed = np.stack([given["ppte_um"], -given["effective_contact_ratio"]], axis=1)
    everywhere = np.flatnonzero(pareto_front(signed))
    inside = (given["height"] >= 2) & (given["height"] <= 7) & np.isfinite(given["ppte_um"])
    within = np.flatnonzero(pareto_front(np.where(inside[:, None], signed, np.nan)))
    assert 3 < len(within) != len(everywhere)
    assert before == f"199 within the ranges, {len(everywhere)} of them on the front, 3 chosen."
    assert set(map(int, taken.split())) <= set(everywhere.tolist()) and len(taken.split()) == min(8, len(everywhere))
    assert kept == inside.sum() and set(map(int, front.split())) == set(within.tolist())
    assert after.startswith(f"{inside.sum()} within the ranges, {len(within)} of them on the front, ")
    assert axis == "PPTE [µm], smaller is better" and rows == 6  # a line for the names, and one for every column
