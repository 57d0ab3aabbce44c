"""The end of a search on a finer mesh: what is reported does not belong to the positions of the search."""

import numpy as np
import pytest
from catalogue import gear_pair, ppte, prepare

import jaxgear as jg

TORQUE = 50.0
BOX = {"pinion": (0.0, 20.0), "wheel": (0.0, 20.0), "length": (1.0, 5.7)}


def design(x):
    return jg.TipRelief(x["pinion"], x["length"]), jg.TipRelief(x["wheel"], x["length"])


@pytest.mark.slow
def test_the_result_does_not_belong_to_the_positions_of_the_search():
    """At 16 positions the search fits the flanks to these positions; what it reports is true at any."""
    pair = gear_pair()
    coarse, fine = (prepare(pair, resolution=jg.Resolution(positions=n, pairs=2)) for n in (16, 512))
    problem, method = jg.Problem(coarse, TORQUE, design, BOX), jg.optimize.SLP(starts=2, rounds=1, steps=15)
    fitted, result = (jg.minimize(problem, method, positions=positions) for positions in (None, 128))
    assert np.isnan(fitted.grid_change) and fitted.positions == 16
    assert result.positions >= 128
    assert abs(result.grid_change) <= 0.02 * result.objective or result.positions > 1024
    true = [ppte(fine, TORQUE, found.pinion, found.wheel) for found in (fitted, result)]
    assert true[0] > 1.1 * fitted.ppte
    assert true[1] == pytest.approx(result.ppte, rel=0.05)
    assert true[1] <= true[0]
    assert len(result.cycle.phase) == result.positions
    assert result.evaluations > fitted.evaluations
