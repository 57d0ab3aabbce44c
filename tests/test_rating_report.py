"""The report of a rating: numbers of a published one from a design file, spectrum, files, what lacks an input."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE
from rated_pairs import STAGE_3
from rated_pairs import rated as rated_by

import jaxgear as jg
from jaxgear.contact import OperatingPoint
from jaxgear.io import DesignFileError, load_design
from jaxgear.io.named_quantities import quantity_named
from jaxgear.numerics import changed, real
from jaxgear.rating import rate, report
from jaxgear.rating.chain import Spectrum
from jaxgear.rating.figures import woehler
from jaxgear.rating.thermal import thermal_rating
from jaxgear.report import write_report, write_tables
from jaxgear.studies.comparison import ComparisonResult

ROOT = Path(__file__).parents[1]
EXAMPLE, GUIDE = ROOT / "examples" / "rated_24_95.toml", ROOT / "examples" / "guides" / "rating.md"


@pytest.fixture(scope="module")
def rated():
    """Of the pair of the example."""
    oil = replace(STAGE_3.rating.lubricant, fzg_stage=real(14.0), micropitting_test_film=real(0.102))
    rating = replace(STAGE_3.rating, lubricant=oil)
    return rated_by(STAGE_3), thermal_rating(rated_by(STAGE_3), STAGE_3.torque, STAGE_3.speed, rating), rating


def published():
    """Table, symbol, printed and own texts, and whether the guide marks the row."""
    title = ""
    for line in GUIDE.read_text("utf-8").splitlines():
        title = line[3:].lower() if line.startswith("## ") else title
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if title and line.startswith("| ") and cells[0] != "symbol":
            symbol, _, printed, here, unit = cells
            yield title, symbol, printed.split(" / "), here.strip("* ").split(" / "), here.endswith("*"), unit


@pytest.mark.slow
def test_the_guide_lays_the_report_of_the_design_file_beside_the_published_one():
    design = load_design(EXAMPLE)
    rating = design.tables["rating"].settings(design)
    found = rate(design.pair(), design.torque, design.speed, rating)
    chain = report.rows(found, thermal_rating(found, design.torque, design.speed, rating), rating)
    wrong, seen = [], 0
    for title, symbol, printed, here, marked, unit in published():
        key = next(name for name in chain if name.lower() == title)
        row = next(row for row in chain[key] if row.symbol == symbol)
        numbers = [number * (1e-3 if unit == "kW" and row.unit == "W" else 1) for number in row.numbers]
        digits = [len(each.partition(".")[2]) for each in printed]
        shown = [f"{number:.{digit}f}" for number, digit in zip(numbers, digits, strict=True)]
        allowed = [
            max(0.5 * 10.0**-digit * (1 + 1e-9), 1e-3 * abs(float(each))) for each, digit in zip(printed, digits)
        ]
        missed = any(abs(float(each) - number) > most for each, number, most in zip(printed, numbers, allowed))
        seen += 1
        if shown != here or missed != marked:
            wrong.append((title, symbol, printed, here, shown, marked))
    assert wrong == [] and seen > 90


def test_safeties_come_first_with_what_is_required(rated):
    table = report.safety_table(*rated)
    assert table.rows[0] == ("S_F, tooth root", "3.26", "3.09", "1.56", "met")
    assert table.rows[1][1:4] == ("1.81", "1.88", "1.25")
    found, thermal, rating = rated
    strict = report.safety_table(found, thermal, changed(rating, required_root_safety=jnp.asarray(4.0)))
    assert strict.rows[0][-1] == "NOT MET"
    part = report.part(*rated, "unmodified")
    assert part.tables == (table,) and part.chapters[0].tables[0] == table
    assert part.data["safeties"]["S_H"]["required"] == 1.25
    assert part.data["flank"]["sigma_H0"]["unit"] == "MPa" and "mesh" in part.data["load_factors"]["K_v"]


def test_unknown_is_a_dash_and_no_number(rated):
    found, thermal, rating = rated
    unknown = jnp.asarray(np.nan)
    flash, film = (replace(of, safety=unknown) for of in (thermal.flash, thermal.micropitting))
    thermal = replace(thermal, flash=flash, micropitting=film)
    rows = {row[0]: row for row in report.safety_table(found, thermal, rating).rows}
    assert rows["S_B, scuffing, flash temperature"][1] == rows["S_lambda, micropitting, method B"][1] == "-"
    assert rows["S_B, scuffing, flash temperature"][-1] == ""
    assert report.summary(found, thermal, rating)["safeties"]["S_B"]["mesh"] is None
    lines = {line[1]: line for line in report.lines(found, thermal, rating) if line[0] == "losses"}
    assert lines["P_VZ0"][3] == "" and lines["P_VZ0"][-1] == "estimate"


@pytest.fixture
def spectrum(rated):
    """Of three loads with damages in proportion to their stresses."""
    bins, stress = jnp.array([3.0, 2.0, 1.0]), jnp.array([[900.0, 600.0, 300.0], [800.0, 500.0, 200.0]])
    factors = jax.tree.map(lambda number: jnp.stack([number] * 3), rated[0].factors)
    damage = stress / 4000
    return Spectrum(bins, bins, 1e6 * stress, factors, stress, stress, damage, damage, bins[:2], bins[:2])


def test_spectrum_tables_sum_to_the_damage(spectrum):
    load, stressed = report.spectrum_tables(spectrum)
    assert load.rows[0] == ("1", "3", "3", "900", "800", "1.092", "1.150", "1.069")
    assert [row[2] for row in stressed.rows] == ["0.2250", "0.1500", "0.0750"]
    assert "U_F 0.4500 / 0.3750" in stressed.note and len(stressed.rows[0]) == 9


def test_page_workbook_and_lines(rated, tmp_path):
    part = report.part(*rated, "unmodified", coast=True)
    assert part.chapters[0].lines[0].endswith("coast flanks are rated, which carry the negative torque.")
    write_report(tmp_path / "report.html", "stage 3", "rating", [], part.chapters)
    page = (tmp_path / "report.html").read_text("utf-8")
    assert "sigma_HG" in page and "S_lambda, micropitting, method B" in page
    write_tables(tmp_path / "rating.xlsx", [("design file", "small")], part.chapters[0].tables)
    assert (tmp_path / "rating.xlsx").read_bytes().startswith(b"PK")
    assert part.lines[0][:3] == ("table", "symbol", "meaning") and all(len(line) == 7 for line in part.lines)


def test_woehler_figure_has_every_load_at_its_place(rated, spectrum):
    """Of a spectrum all marks, and numbers from 1 % of the damage sum on; of a single load its own."""
    none = replace(spectrum, pitting_damage=spectrum.pitting_damage.at[0].set(jnp.array([0.5, 0.004, 0.0])))
    for found, marks, texts in ((replace(rated[0], spectrum=none), 3, ["0.5"]), (rated[0], 1, None)):
        first, *others = woehler(found)
        line, _, does, idle = first.get_lines()
        assert np.allclose(line.get_ydata()[1:-1], found.flank_lines[0].stress)
        assert len(does.get_xdata()) + len(idle.get_xdata()) == marks
        if texts is not None:
            assert [text.get_text() for text in first.texts] == texts and len(others[0].texts) == 3
            assert np.allclose(does.get_ydata(), [900.0, 600.0]) and np.allclose(does.get_xdata(), [9e8, 6e8])
        assert others[1].get_ylabel() == r"stress $\sigma_F$ [MPa]" and others[2].get_xlabel() == "load cycles [-]"


SMALL = """
[pinion]
teeth = 20
module = 2.0
face_width = 10.0
quality_class = 5
[wheel]
teeth = 30
module = 2.0
face_width = 10.0
quality_class = 5
[load]
torque = 20.0
speed = 1000.0
[lubricant]
viscosity_40 = 220.0
viscosity_100 = 19.0
temperature = 80.0
roughness = 0.4
fzg_stage = 10
micropitting_test_film = 0.1
[rating.pinion]
heat_treatment = "case_hardened"
flank_roughness_ra = 0.4
root_roughness_rz = 10.0
[rating.wheel]
heat_treatment = "case_hardened"
flank_roughness_ra = 0.4
root_roughness_rz = 10.0
"""


@pytest.mark.slow
def test_an_analysis_has_the_rating_and_both_ways_to_share_the_load(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(SMALL)
    design = load_design(path)
    cycle = jg.solve(jg.prepare(design.pair(), resolution=LINE), OperatingPoint(20.0, 1000.0))
    given: dict[str, Any] = dict.fromkeys(ComparisonResult.__dataclass_fields__)
    given |= {"design": design, "evaluations": {"unmodified": SimpleNamespace(cycle=cycle)}}
    part = ComparisonResult(**given).parts["rating"]
    # the quantities of both ways to share the load are near each other, and never the same number
    numbers = {
        name: float(quantity_named(design, "optimize.objective", name)(cycle))
        for kind in ("scuffing", "micropitting")
        for name in (f"rated_{kind}_safety", f"local_{kind}_safety")
    }
    assert numbers["rated_scuffing_safety"] == pytest.approx(part.data["safeties"]["S_B"]["mesh"])
    for kind in ("scuffing", "micropitting"):
        ratio = numbers[f"rated_{kind}_safety"] / numbers[f"local_{kind}_safety"]
        assert 0.5 < ratio < 2.0 and ratio != 1.0


def test_what_rates_nothing_is_refused(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(SMALL)
    with pytest.raises(DesignFileError, match=r'"no_load_loss_power" needs lubricant.pinion_immersion or'):
        quantity_named(load_design(path), "optimize.objective", "no_load_loss_power")
    path.write_text(SMALL.partition("[rating.pinion]")[0])
    with pytest.raises(DesignFileError, match=r"lubricant.fzg_stage: has no effect without \[rating\]"):
        load_design(path)
