"""A sweep over macro geometry flags exactly the pairs that the constructors refuse."""

import numpy as np
import pytest

import jaxgear as jg

BOUNDS = {"shift": (-0.6, 0.9), "distance": (99.0, 104.0), "tip": (60.0, 70.0), "bore": (20.0, 58.0)}
SLIPS = np.array([[0.2, 101.0, 64.0, 24.0], [0.2, 101.05, 64.0, 24.0], [0.2, 101.09, 64.0, 24.0]])


def pair_of(v):
    pinion = jg.Gear(19, 3.0, profile_shift=v["shift"], face_width=10.0, tip_diameter=v["tip"], bore_diameter=v["bore"])
    return jg.GearPair(pinion, jg.Gear(48, 3.0, face_width=10.0), v["distance"])


def accepted(row):
    try:
        pair_of(dict(zip(BOUNDS, row)))
    except ValueError:
        return False
    return True


@pytest.mark.slow
def test_the_flag_of_a_sweep_is_the_verdict_of_the_constructors():
    near = {**BOUNDS, "shift": (0.0, 0.3), "distance": (100.4, 101.6), "tip": (62.0, 65.0), "bore": (20.0, 30.0)}
    rows = np.concatenate([SLIPS, jg.Sobol(BOUNDS, 20, seed=2).rows(0, 20), jg.Sobol(near, 20, seed=3).rows(0, 20)])
    expected = np.array([accepted(row) for row in rows])
    assert not expected[0] and not expected[1] and expected[2] and 8 < expected.sum() < 30
    table = jg.sweep(
        lambda v: jg.prepare(pair_of(v), resolution=jg.Resolution(positions=8, contact_nodes=2, pairs=3)),
        50.0,
        lambda v: (None, None),
        jg.VariantList(tuple(BOUNDS), rows),
    )
    np.testing.assert_array_equal(table.column("converged"), expected)
    np.testing.assert_array_equal(np.isnan(table.column("ppte_um")), ~expected)
