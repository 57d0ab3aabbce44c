"""The benchmark of the optimizers: it judges by the physics, and it fails when what it claims does not hold."""

from dataclasses import replace

import pytest

import jaxgear as jg
from benchmarks.optimization import judge, methods, report, tasks

GOOD = {
    ("50/50", "unmodified"): (3.5, 3000.0, 0, None),
    ("50/50", "iteration, type 1"): (0.6, 4000.0, 5, 4),
    ("50/50", "iteration, type 2"): (0.5, 2000.0, 300, 3),
    ("50/50", "genetic"): (0.37, 2500.0, 10_000, None),
    ("50/50", "slp"): (0.37, 2500.0, 150, None),
    ("50/50", "free form"): (0.1, 600.0, 100, None),
    ("19/48", "genetic"): (0.22, 900.0, 10_000, None),
    ("19/48", "slp"): (0.221, 900.0, 150, None),
    ("19/48", "free form"): (0.1, 900.0, 60, None),
}


def row(pair, method, ppte, pressure, evaluations, steps):
    return report.Row(pair, method, ppte, 2 * ppte, 3.0, pressure, 5.0, evaluations, steps, 10.0, 1.0)


@pytest.fixture
def rows():
    return [row(*key, *values) for key, values in GOOD.items()]


def changed(rows, method, **values):
    """The last row of a method changed."""
    index = max(index for index, row in enumerate(rows) if row.method == method)
    return [*rows[:index], replace(rows[index], **values), *rows[index + 1 :]]


def test_claims_hold_of_good_rows(rows):
    assert all(claim.holds for claim in report.claims(rows))


@pytest.mark.parametrize(
    ("method", "values", "words"),
    [
        ("slp", {"ppte_um": 0.2223}, "at most 1 % above"),
        ("slp", {"evaluations": 200}, "less than 2 %"),
        ("free form", {"ppte_um": 0.16}, "30 % below"),
        ("iteration, type 1", {"ppte_um": 0.9}, "type 1 iteration: PPTE at least 75 %"),
        ("iteration, type 1", {"steps": 6}, "type 1 iteration: PPTE at least 75 %"),
        ("iteration, type 1", {"max_relief_um": 7.1}, "type 1 iteration: PPTE at least 75 %"),
        ("iteration, type 2", {"ppte_um": 0.9}, "type 2 iteration: PPTE at least 75 %"),
        ("iteration, type 2", {"max_pressure_MPa": 4100.0}, "lower largest contact pressure"),
    ],
)
def test_each_claim_fails_by_itself(rows, method, values, words):
    failed = [claim.text for claim in report.claims(changed(rows, method, **values)) if not claim.holds]
    assert len(failed) == 1 and words in failed[0]


def test_a_claim_on_an_absent_method_is_not_checked(rows):
    found = report.claims([row for row in rows if row.method != "genetic"])
    assert [claim.holds for claim in found].count(None) == 4


def test_findings_leave_out_what_did_not_take_part(rows):
    said = report.findings(rows)
    assert any(line.startswith("19/48: slp reaches 1.005 times") and "1.5 %" in line for line in said)
    assert not any("robust design" in line for line in said)
    assert not any("genetic" in line for line in report.findings([row for row in rows if row.method != "genetic"]))


def test_every_method_of_the_library_takes_part():
    names = {method.name.lower().replace("-", "").replace(" ", "_") for method in methods.methods(methods.QUICK)}
    others = {"cma_es": "cmaes", "te_iteration": "iteration,_type_1"}
    assert {others.get(name, name) for name in jg.optimize.METHODS} <= names


@pytest.mark.slow
def test_the_judge_sees_what_the_contact_analysis_says():
    """Of a design that no search has touched: PPTE and pressure at the design torque, and the worst of all torques."""
    task = tasks.tasks()[0]
    mesh = task.mesh(16)
    relief = jg.TipRelief(5.0, 3.0)
    found = judge.Judge(task, 16, 27)(methods.Found(relief, None, 0))
    cycle = jg.solve(mesh, task.torque, pinion=relief)
    assert found.ppte == pytest.approx(float(jg.peak_to_peak(cycle.transmission_error)), rel=1e-9)
    assert found.max_pressure == pytest.approx(
        float(max(cycle.contact_pressure.max(), cycle.corner_pressure.max())), rel=1e-9
    )
    ppte = [
        float(jg.peak_to_peak(jg.solve(mesh, share * task.torque, pinion=relief).transmission_error))
        for share in (0.5, 2.0)
    ]
    assert found.worst_over_torque >= max(*ppte, found.ppte) * (1 - 1e-9)
    assert found.max_relief == pytest.approx(5.0)
    assert found.quantile95 > found.ppte
