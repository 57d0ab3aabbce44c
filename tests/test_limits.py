"""Limits that can be kept are kept, between the positions of a mesh too, and whatever the objective pulls at."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE, gear_pair

import jaxgear as jg
from jaxgear.contact import OperatingPoint
from jaxgear.contact.mesh import parts
from jaxgear.metrics import Lubricant, Strength
from jaxgear.optimize import SLP, Genetic, Pareto, refine, verdict
from jaxgear.optimize.goal import FEASIBLE, counted
from jaxgear.optimize.linear_model import Linearizer
from jaxgear.optimize.refine import at_more_positions, fine_enough
from jaxgear.optimize.search import Record, scores

KNOWN = {"amount": 9.0, "length": 4.2}  # keeps every limit below that can be kept


def design(x):
    relief = jg.TipRelief(x["amount"], x["length"])
    return relief, relief


def number(mesh, name):
    pinion, wheel = design({key: np.float64(value) for key, value in KNOWN.items()})
    return float(jg.quantities[name](jg.solve(mesh, 50.0, pinion=pinion, wheel=wheel)))


@pytest.fixture
def one_program(monkeypatch):
    """What is left to gain at an optimum comes from the program that has led to the limits: of as many designs."""
    monkeypatch.setattr(verdict, "Linearizer", lambda problem, _: Linearizer(problem, refine._NEAR + refine._FAR))


@pytest.mark.slow
def test_a_search_that_meets_no_feasible_design_seeks_one(one_program):
    """Few random designs all miss a narrow band, which the violation alone leads to; nothing leads to no design."""
    mesh = jg.prepare(gear_pair(), resolution=LINE)
    limit = 1.02 * number(mesh, "ppte")

    def least(limit):
        return jg.minimize(
            jg.Problem(
                mesh,
                50.0,
                design,
                {"amount": (0.0, 30.0), "length": (1.0, 5.0)},
                objective="max_flank_pressure",
                constraints=[jg.Constraint("ppte", high=limit)],
            ),
            method=Genetic(population=4, generations=1),
            positions=None,
        )

    found = least(limit)
    assert found.feasible and found.constraints["ppte"].kept and found.violation == 0.0
    assert found.constraints["ppte"].value < limit
    none = least(0.01 * limit)
    assert not none.feasible and not none.constraints["ppte"].kept and none.violation > 1.0


@pytest.mark.parametrize(("low", "high", "at"), [(None, 3.0, 3.0), (2.0, None, 2.0), (None, 0.0, 0.0)])
def test_searches_aim_at_the_inner_side_of_a_limit(low, high, at):
    """What lies on it may pass it between two positions; what lies as far inside as is aimed at has no excess."""
    limit = jg.Constraint("ppte", low=low, high=high)
    way, scale = (1.0 if low is None else -1.0), abs(at) or 1.0
    for inside, excess in ((0.0, FEASIBLE), (FEASIBLE, 0.0)):
        (found,) = limit.excess(jnp.asarray(at - way * inside * scale))
        assert float(found) == pytest.approx(excess, abs=1e-12)
        assert bool(counted(found) > 0) == (inside == 0.0)


def test_two_limits_leave_room_between_them():
    """However close they are: the middle keeps both, where they are one as well."""
    for low, high in ((2.0, 2.0), (2.0, 2.0001), (1.0, 3.0)):
        excess = jg.Constraint("ppte", low=low, high=high).excess(jnp.asarray(0.5 * (low + high)))
        assert all(float(counted(each)) == 0.0 for each in excess)


def test_a_limit_of_a_free_parameter_holds_where_it_is():
    (excess,) = jg.Constraint({"amount": 1.0}, high=5.0).excess(jnp.asarray(5.0))
    assert float(excess) == 0.0


def test_a_mesh_is_fine_enough_for_all_designs_or_for_none():
    """What each of them is worth there, in parts of its own or of the span of a front, and the limits that it keeps."""
    values, kept = np.array([[1.0, 0.0], [3.0, 50.0]]), np.zeros(2)
    assert fine_enough(values, kept, values, kept)
    moved = values + np.array([[0.0, 0.5], [0.0, 0.0]])
    assert not fine_enough(values, kept, moved, kept) and fine_enough(values, kept, moved, kept, span=[2.0, 50.0])
    assert fine_enough(values, kept, values, np.array([0.0, FEASIBLE]))
    assert not fine_enough(values, kept, values, np.array([0.0, 1.1 * FEASIBLE]))
    assert fine_enough(values, np.array([0.0, 0.5]), values, np.array([0.0, 0.6])), "a limit that is passed anyway"


@pytest.mark.slow
def test_limits_beside_an_objective_that_is_no_extreme_are_judged_at_four_times_the_positions():
    """Its programs know no mesh half a position later; the largest pressure lies between twice the positions."""
    few = replace(LINE, positions=8)
    limit = jg.Constraint("max_flank_pressure", high=500.0)
    posed = jg.Problem(
        jg.prepare(gear_pair(), resolution=few),
        50.0,
        design,
        {"amount": (0.0, 30.0), "length": (1.0, 5.0)},
        objective="effective_contact_ratio",
        constraints=[limit],
    )
    point = np.array([[0.3, 0.6]])
    values, violations = at_more_positions(Record(posed, None), point)
    twice, four = (
        scores(posed.on(jg.prepare(posed.mesh.pair, resolution=replace(few, positions=count))), point)
        for count in (16, 32)
    )
    np.testing.assert_allclose(values, twice.value, rtol=1e-12)
    np.testing.assert_allclose(violations, four.violation, rtol=1e-12)
    assert abs(float(four.violation[0]) - float(twice.violation[0])) > 1e-4


@pytest.mark.slow
def test_limits_of_a_front_hold_on_a_mesh_of_four_times_the_positions():
    """Those of every design; of a front that stays on the mesh of its search some pass them between its positions."""
    mesh = jg.prepare(gear_pair(), resolution=LINE)
    fine = parts(jg.prepare(mesh.pair, resolution=replace(LINE, positions=16 * LINE.positions)), LINE.positions)
    limit = 1.05 * number(mesh, "max_flank_pressure")
    names = "ppte", "max_corner_pressure"

    def largest(positions):
        """Of all designs, relative to the limit; and the front."""
        front = jg.optimize.pareto(
            jg.Problem(
                mesh,
                50.0,
                design,
                {"amount": (0.0, 30.0), "length": (1.0, 5.0)},
                objective=names,
                constraints=[jg.Constraint("max_flank_pressure", high=limit)],
            ),
            method=Pareto(points=4, steps=10),
            positions=positions,
        )
        found = []
        for amount, length in zip(*front.parameters.values()):
            pinion, wheel = design({"amount": amount, "length": length})
            cycles = [jg.solve(part, 50.0, pinion=pinion, wheel=wheel) for part in fine]
            found.append(max(float(np.max(np.asarray(cycle.contact_pressure))) for cycle in cycles))
        return max(found) / limit, front

    worst, front = largest(4 * LINE.positions)
    assert worst <= 1.0 and front.compromise.feasible and front.compromise.positions >= 4 * LINE.positions
    assert front.values[front.chosen, 0] == pytest.approx(front.compromise.ppte, rel=1e-9)
    assert largest(None)[0] > 1.0


@pytest.mark.slow
def test_least_power_loss_within_limits_of_noise_and_root_safety():
    """A 23/81 pair; a relief that is known keeps both limits, on a finer mesh than that of the answer too."""
    pair = gear_pair((23, 81), 2.5, face_width=30.0, bores=(None, None))
    mesh, fine = (jg.prepare(pair, resolution=replace(LINE, positions=count)) for count in (64, 256))
    load = OperatingPoint(300.0, 1500.0)
    oil = Lubricant(viscosity_40=100.0, viscosity_100=11.1, temperature=80.0, roughness=0.5)
    safety = Strength(bending=700.0).quantity("pinion_root_safety")

    def worth(x):
        pinion, wheel = design({name: np.float64(value) for name, value in x.items()})
        cycle = jg.solve(fine, load, pinion=pinion, wheel=wheel)
        return float(jg.peak_to_peak(cycle.transmission_error)), float(safety(cycle))

    ppte, least = worth({"amount": 16.0, "length": 3.6})
    found = jg.minimize(
        jg.Problem(
            mesh,
            load,
            design,
            {"amount": (0.0, 40.0), "length": (1.0, 4.5)},
            objective=oil.quantity("loss_power"),
            constraints=[jg.Constraint("ppte", high=1.01 * ppte), jg.Constraint(safety, low=0.99 * least)],
        ),
        method=SLP(starts=2, rounds=1, steps=10),
        positions=64,
    )
    assert found.feasible and all(limit.kept for limit in found.constraints.values())
    noise, safe = worth(found.parameters)
    assert noise <= 1.01 * ppte and safe >= 0.99 * least
