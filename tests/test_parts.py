"""A fine mesh as several coarse ones: the same contact at the same mesh positions, by one program."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import FACE, LINE, gear_pair, prepare

import jaxgear as jg
from jaxgear.contact.mesh import half_way, parts
from jaxgear.optimize.linear_model import Linearizer

TORQUE, COARSE, COUNT = 50.0, 8, LINE.positions // 8


def mesh_of(positions):
    return prepare(gear_pair(), resolution=replace(LINE, positions=positions))


def solved(mesh, relief=8.0, crowning=0.0, torque=TORQUE):
    """Both gears alike."""
    flank = jg.TipRelief(relief, 4.0) + jg.ProfileCrowning(crowning)
    return jg.solve(mesh, torque, pinion=flank, wheel=flank)


@pytest.fixture(scope="module")
def fine():
    return mesh_of(COUNT * COARSE)


@pytest.fixture(scope="module")
def half():
    """A mesh of every second position of the fine one."""
    return mesh_of(COARSE)


@pytest.mark.slow
def test_parts_together_are_the_mesh(fine):
    whole, divided = solved(fine), [solved(part) for part in parts(fine, COARSE)]
    assert len(divided) == COUNT
    for first, part in enumerate(divided):
        assert np.all(part.converged)
        np.testing.assert_allclose(part.phase, np.asarray(whole.phase)[first::COUNT], rtol=1e-14)
        for name in ("transmission_error", "pair_force", "contact_pressure", "corner_pressure"):
            expected = np.asarray(getattr(whole, name))[..., first::COUNT]
            np.testing.assert_allclose(getattr(part, name), expected, rtol=1e-9, atol=1e-9, err_msg=name)


@pytest.mark.parametrize(
    "helix_angle, wider",
    [pytest.param(None, 4.0, id="wider"), pytest.param(15.0, 0.0, id="helical", marks=pytest.mark.slow)],
)
def test_no_array_of_a_part_has_the_positions_of_the_whole(helix_angle, wider):
    first, second = (jg.Gear(teeth, 3.0, face_width=20.0, helix_angle=helix_angle) for teeth in (19, 48))
    other = None if helix_angle is None else -helix_angle
    pair = jg.GearPair(first, replace(second, face_width=20.0 + wider, helix_angle=other))
    mesh = jg.prepare(pair, resolution=replace(FACE, pairs=4))
    whole, part = (
        [leaf.shape for leaf in jax.tree.leaves(each) if leaf.ndim and leaf.shape[-1] == FACE.positions]
        for each in (mesh, parts(mesh, FACE.positions // 2)[0])
    )
    assert whole and not part


def assert_doubled(mesh, twice):
    """The mesh, and the one half a position later, are the one of twice the positions."""
    phase, error = np.asarray(twice.phase), np.asarray(solved(twice).transmission_error)
    for each, first in ((mesh, 0), (half_way(mesh), 1)):
        np.testing.assert_allclose(each.phase, phase[first::2], atol=1e-15)
        np.testing.assert_allclose(solved(each).transmission_error, error[first::2], rtol=1e-9)


@pytest.mark.slow
def test_a_mesh_half_a_position_later_doubles_the_positions(half, fine):
    assert_doubled(half, fine)


@pytest.mark.slow
def test_a_finer_mesh_half_a_position_later_doubles_the_positions(fine):
    assert_doubled(fine, mesh_of(2 * COUNT * COARSE))


def test_parts_do_not_converge_where_the_next_pair_touches(fine):
    """Its gap is that of the fine mesh, and what falls off at the edge falls as far per mm."""
    whole = np.asarray(solved(fine, relief=0.0, crowning=50.0, torque=3000.0).converged)
    assert 0 < whole.sum() < whole.size
    for first, part in enumerate(parts(fine, COARSE)):
        found = np.asarray(solved(part, relief=0.0, crowning=50.0, torque=3000.0).converged)
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
    return jg.Problem(mesh, TORQUE, design, BOX, objective=objective, constraints=[limit])


@pytest.fixture(scope="module")
def coarse(half):
    """Linearizer compiled for two points on a coarse mesh."""
    return Linearizer(problem_on(half), 2)


POINT = np.array([[0.3, 0.6]])


@pytest.fixture(scope="module")
def whole(fine):
    """The problem linearized on the fine mesh as it is."""
    return Linearizer(problem_on(fine), 1)(POINT)[0]


@pytest.mark.slow
def test_a_problem_is_linearized_on_the_parts(fine, coarse, whole):
    by_parts = coarse.on(problem_on(fine))(POINT)[0]
    assert bool(by_parts.fine)
    for found, expected in zip((*by_parts.objectives, *by_parts.limits), (*whole.objectives, *whole.limits)):
        np.testing.assert_allclose(found.value, expected.value, rtol=1e-9)
        order, known = np.argsort(found.upper[0]), np.argsort(np.asarray(expected.upper)[0])
        np.testing.assert_allclose(found.slope[0][order], np.asarray(expected.slope)[0][known], rtol=1e-6, atol=1e-6)


def test_at_twice_the_positions_a_problem_is_that_of_the_finer_mesh(coarse, whole):
    twice = coarse.at_more_positions(POINT)[0][0]
    for found, expected in zip((*twice.objectives, *twice.limits), (*whole.objectives, *whole.limits)):
        np.testing.assert_allclose(found.value, expected.value, rtol=1e-9)


@pytest.mark.slow
def test_at_twice_the_positions_of_parts_a_problem_is_that_of_the_finer_mesh(fine, coarse):
    twice = coarse.on(problem_on(fine)).at_more_positions(POINT)[0][0]
    expected = problem_on(mesh_of(2 * COUNT * COARSE)).score(jnp.asarray(POINT[0]))
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
    assert coarse.on(posed).at_more_positions(POINT) is None
