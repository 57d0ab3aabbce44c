"""Limits that can be kept are kept, between the positions of a mesh too, and whatever the objective pulls at."""

import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE, gear_pair

import jaxgear as jg
from jaxgear.optimize import Genetic
from jaxgear.optimize.goal import FEASIBLE, counted

KNOWN = {"amount": 9.0, "length": 4.2}  # keeps every limit below that can be kept


def design(x):
    relief = jg.TipRelief(x["amount"], x["length"])
    return relief, relief


def number(mesh, name):
    pinion, wheel = design({key: np.float64(value) for key, value in KNOWN.items()})
    return float(jg.quantities[name](jg.solve(mesh, 50.0, pinion=pinion, wheel=wheel)))


def test_a_search_that_meets_no_feasible_design_seeks_one():
    """Few random designs all miss a narrow band, which the violation alone leads to; nothing leads to no design."""
    mesh = jg.prepare(gear_pair(), resolution=LINE)
    limit = 1.02 * number(mesh, "ppte")

    def least(limit):
        return jg.minimize(
            design,
            {"amount": (0.0, 30.0), "length": (1.0, 5.0)},
            mesh=mesh,
            torque=50.0,
            objective="max_flank_pressure",
            constraints=[jg.Constraint("ppte", high=limit)],
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
