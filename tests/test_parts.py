"""A fine mesh as several coarse ones: the same contact at the same mesh positions, by one program."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE, gear_pair, prepare

import jaxgear as jg
from jaxgear.contact.parts import half_way, parts
from jaxgear.optimize.linearizer import Linearizer
from jaxgear.optimize.problem import make_problem

TORQUE, COARSE, COUNT = 50.0, 8, LINE.positions // 8
RELIEF = jg.TipRelief(8.0, 4.0)


def mesh_of(positions):
    return prepare(gear_pair(), resolution=replace(LINE, positions=positions))


def solved(mesh):
    return jg.solve(mesh, TORQUE, pinion=RELIEF, wheel=RELIEF)


@pytest.fixture(scope="module")
def fine():
    return mesh_of(COUNT * COARSE)


def test_parts_together_are_the_mesh(fine):
    whole, divided = solved(fine), [solved(part) for part in parts(fine, COARSE)]
    assert len(divided) == COUNT
    for first, part in enumerate(divided):
        assert bool(jnp.all(part.converged))
        np.testing.assert_allclose(part.phase, whole.phase[first::COUNT], rtol=1e-14)
        for name in ("transmission_error", "pair_force", "contact_pressure", "corner_pressure"):
            expected = getattr(whole, name)[..., first::COUNT]
            np.testing.assert_allclose(getattr(part, name), expected, rtol=1e-9, atol=1e-9, err_msg=name)


def test_a_mesh_half_a_position_later_doubles_the_positions(fine):
    twice, later = mesh_of(2 * COUNT * COARSE), half_way(fine)
    for mesh, first in ((fine, 0), (later, 1)):
        np.testing.assert_allclose(mesh.phase, twice.phase[first::2], atol=1e-15)
        error = solved(mesh).transmission_error
        np.testing.assert_allclose(error, solved(twice).transmission_error[first::2], rtol=1e-9)


def test_parts_do_not_converge_where_the_next_pair_touches(fine):
    """Its gap is that of the fine mesh, and what falls off at the edge falls as far per mm."""
    deep = jg.ProfileCrowning(400.0)
    whole = np.asarray(jg.solve(fine, TORQUE, pinion=deep, wheel=deep).converged)
    for first, part in enumerate(parts(fine, COARSE)):
        found = np.asarray(jg.solve(part, TORQUE, pinion=deep, wheel=deep).converged)
        np.testing.assert_array_equal(found, whole[first::COUNT])


def test_what_cannot_be_divided_stays_whole(fine):
    for positions in (7, COUNT * COARSE, 2 * COUNT * COARSE):
        assert parts(fine, positions) == [fine]


BOX = {"amount": (0.0, 20.0), "length": (1.0, 5.7)}


def problem_on(mesh, objective="ppte"):
    def design(x):
        relief = jg.TipRelief(x["amount"], x["length"])
        return relief, relief

    limit = jg.Constraint("max_flank_pressure", high=900.0)
    return make_problem(design, BOX, mesh=mesh, torque=TORQUE, objective=objective, constraints=[limit])


@pytest.fixture(scope="module")
def coarse():
    """Linearizer compiled for two points on a coarse mesh."""
    return Linearizer(problem_on(mesh_of(COARSE)), 2)


def test_a_problem_is_linearized_on_the_parts(fine, coarse):
    point = np.array([[0.3, 0.6]])
    posed = problem_on(fine)
    by_parts, whole = coarse.on(posed)(point)[0], posed.linearize(jnp.asarray(point[0]))
    assert bool(by_parts.fine)
    for found, expected in zip((*by_parts.objectives, *by_parts.limits), (*whole.objectives, *whole.limits)):
        np.testing.assert_allclose(found.value, expected.value, rtol=1e-9)
        order, known = np.argsort(found.upper[0]), np.argsort(np.asarray(expected.upper)[0])
        np.testing.assert_allclose(found.slope[0][order], np.asarray(expected.slope)[0][known], rtol=1e-6, atol=1e-6)
    twice = coarse.on(posed).at_twice_the_positions()(point)[0]
    expected = problem_on(mesh_of(2 * COUNT * COARSE)).score(jnp.asarray(point[0]))
    assert float(twice.objectives[0].value[0]) == pytest.approx(float(expected.value[0]), rel=1e-9)


def test_the_finer_search_compiles_nothing(fine, coarse):
    coarse(np.array([[0.1, 0.2]]))
    finer = coarse.on(coarse.problem.on(fine))
    compiled = []
    jax.monitoring.register_event_duration_secs_listener(
        lambda name, seconds, **_: compiled.append(name) if name.endswith("backend_compile_duration") else None
    )
    finer(np.array([[0.5, 0.5], [0.2, 0.9]]))
    assert not compiled


def test_a_mean_is_not_made_of_extremes(fine, coarse):
    posed = problem_on(fine, objective="effective_contact_ratio")
    assert not posed.is_made_of_extremes
    assert coarse.on(posed).at_twice_the_positions() is None
