"""The report of a rating: the numbers of a published one from a design file, spectrum, files, and what lacks an input."""

import csv
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE

import jaxgear as jg
from jaxgear.conditions import LoadSpectrum
from jaxgear.contact import OperatingPoint
from jaxgear.io import DesignFileError, load_design
from jaxgear.io.named_quantities import quantity_named
from jaxgear.numerics import changed
from jaxgear.rating import rate, report
from jaxgear.rating.thermal import thermal_rating
from jaxgear.report import write_report, write_tables
from jaxgear.studies.comparison_result import ComparisonResult

ROOT = Path(__file__).parents[1]
EXAMPLE, GUIDE = ROOT / "examples" / "rated_24_95.toml", ROOT / "examples" / "guides" / "rating.md"


@pytest.fixture(scope="module")
def design():
    return load_design(EXAMPLE)


@pytest.fixture(scope="module")
def rated(design):
    rating = design.tables["rating"].settings(design)
    found = rate(design.pair(), design.torque, design.speed, rating)
    return found, thermal_rating(found, design.torque, design.speed, rating), rating


def published():
    """Table, symbol, printed and own texts, and whether the guide marks the row."""
    title = ""
    for line in GUIDE.read_text("utf-8").splitlines():
        title = line[3:].lower() if line.startswith("## ") else title
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if title and line.startswith("| ") and cells[0] != "symbol":
            symbol, _, printed, here, unit = cells
            yield title, symbol, printed.split(" / "), here.strip("* ").split(" / "), here.endswith("*"), unit


def test_the_guide_lays_the_report_of_the_design_file_beside_the_published_one(rated):
    chain = report.rows(*rated)
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


def test_unknown_is_a_dash_and_no_number(design, rated):
    found, _, rating = rated
    bare = changed(rating, lubricant=changed(rating.lubricant, fzg_stage=None, micropitting_test=None))
    thermal = thermal_rating(found, design.torque, design.speed, bare)
    rows = {row[0]: row for row in report.safety_table(found, thermal, bare).rows}
    assert rows["S_B, scuffing, flash temperature"][1] == rows["S_lambda, micropitting, method B"][1] == "-"
    assert rows["S_B, scuffing, flash temperature"][-1] == ""
    assert report.summary(found, thermal, bare)["safeties"]["S_B"]["mesh"] is None
    lines = {line[1]: line for line in report.lines(found, thermal, bare) if line[0] == "losses"}
    assert lines["P_VZ0"][3] == "" and lines["P_VZ0"][-1] == "estimate"


def test_spectrum_tables_sum_to_the_damage(design, rated):
    rating = rated[-1]
    loads = LoadSpectrum([200e3, 150e3, 40e3], [0.1, 0.2, 0.7], speeds=[1165.9] * 3)
    found = rate(design.pair(), design.torque, design.speed, replace(rating, loads=loads))
    load, stressed = report.spectrum_tables(found.spectrum)
    assert [len(row) for row in load.rows] == [8] * 3 and [len(row) for row in stressed.rows] == [9] * 3
    damage = [sum(float(row[place]) for row in stressed.rows) for place in (4, 8)]
    np.testing.assert_allclose(damage, found.bending.damage, atol=2e-4)
    assert float(found.bending.damage[0]) > 0.1 and "U_F" in stressed.note


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


def test_an_analysis_writes_the_rating_into_all_its_files(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(SMALL)
    design = load_design(path)
    cycle = jg.solve(jg.prepare(design.pair(), resolution=LINE), OperatingPoint(20.0, 1000.0))
    given = dict.fromkeys(ComparisonResult.__dataclass_fields__)
    result = ComparisonResult(
        **{**given, "design": design, "evaluations": {"unmodified": SimpleNamespace(cycle=cycle)}}
    )
    part = result.parts["rating"]
    write_report(tmp_path / "report.html", "small", "rating", [], part.chapters)
    page = (tmp_path / "report.html").read_text("utf-8")
    assert "sigma_HG" in page and re.search(r"S_lambda, micropitting, method B", page)
    write_tables(tmp_path / "rating.xlsx", [("design file", "small")], part.chapters[0].tables)
    assert (tmp_path / "rating.xlsx").read_bytes().startswith(b"PK")
    lines = [*csv.reader(",".join(f'"{cell}"' for cell in line) for line in part.lines)]
    assert lines[0][:3] == ["table", "symbol", "meaning"] and all(len(line) == 7 for line in lines)
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
    with pytest.raises(DesignFileError, match=r'"no_load_loss_power" needs lubricant.pinion_immersion or'):
        quantity_named(design, "optimize.objective", "no_load_loss_power")


def test_what_rates_nothing_is_refused(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(SMALL.partition("[rating.pinion]")[0])
    with pytest.raises(DesignFileError, match=r"lubricant.fzg_stage: has no effect without \[rating\]"):
        load_design(path)
