"""Optima in steps that a shop can make: the best design on the grid, by the search's own judgement, and its cost."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest
from known_optimum import Known

import jaxgear as jg
from jaxgear.io import DesignFileError, Search, load_design
from jaxgear.optimize import Constraint, search
from jaxgear.optimize.problem import Score
from jaxgear.optimize.refine import refined
from jaxgear.optimize.result import Rounding
from jaxgear.optimize.rounding import check_steps, rounded
from jaxgear.studies.optimization_result import _rounding

STEPS = {"pinion": 3.0, "wheel": 3.0}
BOX = {"pinion": (0.0, 20.0), "wheel": (0.0, 20.0)}


@pytest.fixture(scope="module")
def known():
    return Known()


def on_grid(known, keeps=lambda x: True):
    """Least PPTE of all designs on the steps within the bounds, one after the other."""
    numbers = [3.0 * number for number in range(7)]
    designs = [dict(zip(BOX, values)) for values in itertools.product(numbers, numbers)]
    flanks = [known.parabolas(x) for x in designs if keeps(x)]
    cycles = [jg.solve(known.mesh, known.torque, pinion=pinion, wheel=wheel) for pinion, wheel in flanks]
    return min(float(jg.peak_to_peak(cycle.transmission_error)) for cycle in cycles)


def test_the_best_grid_point_is_found_where_variables_depend_on_each_other(monkeypatch):
    """In a narrow valley across the grid the nearest point, and the best corner of the cell, are no optimum."""
    low, high, valley = np.array([0.0, 0.25]), np.array([10.0, 8.0]), np.array([[1.0, 1.0], [1.0, -0.2]])
    centre = np.array([4.62, 3.71])

    def values(points):
        ridge = (np.asarray(points) * (high - low) + low - centre) @ valley.T
        return 9.0 * np.abs(ridge[:, 0]) + ridge[:, 1] ** 2

    def scores(problem, points):
        return Score(values(points)[:, None], np.asarray(np.asarray(points)[:, 0] * 10 > 7.0, float))

    monkeypatch.setattr(search, "scores", scores)
    problem = SimpleNamespace(names=("a", "b"), low=low, high=high, cases=SimpleNamespace(count=1))
    record = search.Record(problem, None)
    record.point = (centre - low) / (high - low)
    found = rounded(record, {"a": 0.5, "b": 0.2}, lambda *_: None)
    grid = np.array([(a, b) for a in np.arange(15) * 0.5 for b in np.arange(2, 41) * 0.2])
    assert found.value == pytest.approx(values((grid - low) / (high - low)).min(), abs=1e-9)
    assert record.evaluations == found.evaluations < 60


@pytest.mark.slow
def test_the_optimum_on_the_steps_is_the_best_of_all_grid_points(known):
    result = known.minimize(known.parabolas, BOX, rounding=STEPS)
    assert all(value % 3.0 == 0.0 for value in result.parameters.values())
    assert float(result.pinion.amount) == result.parameters["pinion"]
    assert result.objective == pytest.approx(on_grid(known), abs=1e-9)
    assert result.rounding.objective < result.objective
    ((_, row),) = _rounding(SimpleNamespace(units={"pinion": "um", "wheel": "um"}), result)
    assert row == f"to steps of 3 um: ppte {result.rounding.objective:.4g} -> {result.objective:.4g} um"


@pytest.mark.slow
def test_before_rounding_is_the_optimum_without_it(known):
    exact = known.minimize(known.parabolas, BOX)
    result = known.minimize(known.parabolas, BOX, rounding=STEPS)
    assert result.rounding.objective == exact.objective and result.rounding.parameters == exact.parameters
    assert result.evaluations > exact.evaluations and exact.rounding is None and "before rounding" in str(result)


def test_a_step_that_breaks_a_limit_is_not_taken(monkeypatch):
    """Between 3.1 and 3.4 there is no multiple of 1: the optimum keeps its digits, and the verdict says so."""

    def scores(problem, points):
        inside = np.abs(np.asarray(points)[:, 0] * 10 - 3.25) < 0.15
        return Score(np.zeros((len(points), 1)), np.where(inside, 0.0, 1.0))

    monkeypatch.setattr(search, "scores", scores)
    problem = SimpleNamespace(
        names=("a",), low=np.zeros(1), high=np.full(1, 10.0), cases=SimpleNamespace(count=1), mesh=None
    )
    record = search.Record(problem, None)
    record.judge(np.array([[0.33]]))
    found = refined(record, lambda *_: None, None, {"a": 1.0})
    assert found.record is found.unrounded is record and record.point == 0.33
    kept = SimpleNamespace(rounding=Rounding({}, {"a": 3.3}, 0.0))
    ((_, row),) = _rounding(SimpleNamespace(units={}), kept)
    assert row.startswith("none: no design on the steps")


@pytest.mark.slow
def test_a_rounded_design_keeps_bounds_and_limits_and_searches_what_has_no_step(known):
    box, most = {"pinion": (1.0, 20.0), "wheel": (1.0, 20.0)}, Constraint({"pinion": 1.0, "wheel": 1.0}, high=16.0)
    result = known.minimize(known.parabolas, box, rounding=STEPS, constraints=[most])
    assert result.feasible
    best = on_grid(known, lambda x: min(x.values()) > 0 and sum(x.values()) <= 16)
    assert result.objective == pytest.approx(best, abs=1e-9)
    free = known.minimize(known.parabolas, BOX, rounding={"pinion": 3.0})
    assert free.parameters["pinion"] % 3.0 == 0.0 and free.objective <= on_grid(known) + 1e-9


@pytest.mark.parametrize(
    ("steps", "said"),
    [
        ({"pinon": 1.0}, '"pinon" of rounding must be one of pinion, wheel'),
        ({"pinion": -1.0}, "rounding of pinion = -1 must be at least 0"),
        ({"pinion": 30.0}, "no multiple from 1 to 20; give a smaller step or 0 for none"),
    ],
)
def test_a_step_that_cannot_be_is_refused(steps, said):
    with pytest.raises(ValueError, match=said):
        check_steps(steps, {"pinion": (1.0, 20.0), "wheel": (0.0, 20.0)})


FILE = """
[pinion]
teeth = 30
module = 3.0
face_width = 20.0

[wheel]
teeth = 30
module = 3.0
face_width = 20.0

[load]
torque = 50.0

[variables]
amount = { low = 0.0, high = 20.0 }
length = { low = 1.02, high = 1.08 }
exponent = { low = 1.0, high = 3.0 }

[[pinion.modification]]
type = "tip_relief"
amount = "amount"
length = "length"
curve = { type = "power", exponent = "exponent" }

"""


def test_a_design_file_rounds_amounts_and_lengths_unless_it_says_otherwise(tmp_path):
    def steps(text):
        (tmp_path / "pair.toml").write_text(FILE + text, encoding="utf-8")
        return Search.of(load_design(tmp_path / "pair.toml")).options.get("rounding")

    assert steps("") == {"amount": 0.5}  # no multiple of 0.1 mm lies within the bounds of the length
    assert steps("[optimize.rounding]\namount = 0\nlength = 0.01\n") == {"length": 0.01}
    assert steps("[optimize.rounding]\nvariables = { exponent = 0.1 }\n") == {"amount": 0.5, "exponent": 0.1}
    for text, said in (
        ("[optimize.rounding]\nlength = 0.1\n", "optimize.rounding: .* length = 0.1 has no multiple from 1.02 to 1.08"),
        ("[optimize.rounding]\namount = -1\n", "optimize.rounding.amount: -1 um must be at least 0 um"),
        ("[optimize.rounding]\nvariables = { amont = 1 }\n", 'optimize.rounding.variables: "amont" is not a variable'),
        ('[optimize]\nmethod = "te_iteration"\nrounding = {}\n', "optimize.rounding: has no effect with method"),
    ):
        with pytest.raises(DesignFileError, match=said):
            steps(text)
