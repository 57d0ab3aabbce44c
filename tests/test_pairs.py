"""How many tooth pairs are carried along, and what happens where they are too few."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import gear_pair

import jaxgear as jg

SIZE = jg.Resolution(positions=16)


@pytest.fixture(scope="module")
def mesh():
    return jg.prepare(gear_pair(), resolution=SIZE)


def test_two_pairs_are_enough_for_19_48(mesh):
    """Their next neighbours are 65 um apart, where these gears have broken."""
    assert mesh.resolution.pairs == 2 and mesh.structure.shape[0] == 2
    assert float(mesh.outer_gap.min()) > 16.0 * 3.0


def test_traced_gears_take_four():
    shape = jax.eval_shape(lambda width: jg.prepare(gear_pair(face_width=width), resolution=SIZE), 18.0)
    assert shape.structure.shape == (4, 4, 16)


def test_what_the_pairs_have_to_contain_can_be_said():
    assert jg.prepare(gear_pair(), resolution=SIZE, deflection=70.0).resolution.pairs == 4


def test_next_pairs_count_with_what_is_removed_from_them(mesh):
    """Material off every tooth keeps the next pairs away as well as it lets the carried ones go; off the carried ones
    alone it does not, and the result is flagged."""
    everywhere = jnp.full((2, 1, 16), 200.0)
    assert bool(jg.contact.solve_removed(mesh, 50.0, everywhere).converged.all())
    # the last pair begins, and the first one ends, where their next neighbours come nearest
    some = everywhere.at[1, 0, 0].set(0.0).at[0, 0, -1].set(0.0)
    flagged = jg.contact.solve_removed(mesh, 50.0, some)
    assert float(flagged.residual.max()) < 1e-10 and not bool(flagged.converged[8])


@pytest.mark.slow
def test_a_load_beyond_their_reach_takes_more_pairs(mesh):
    heavy = jg.solve(mesh, 1500.0)
    wide = jg.solve(jg.prepare(gear_pair(), resolution=jg.Resolution(positions=16, pairs=4)), 1500.0)
    assert heavy.kinematics.resolution.pairs > 2 and bool(heavy.converged.all())
    np.testing.assert_allclose(heavy.transmission_error, wide.transmission_error, rtol=1e-9)
    traced = jax.jit(jg.solve)(mesh, 1500.0)
    assert not bool(traced.converged.all())
