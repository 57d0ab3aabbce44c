"""How many tooth pairs are carried along, and what happens where they are too few."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import gear_pair

import jaxgear as jg
from jaxgear.contact import removed_material
from jaxgear.contact.covering import check_cover
from jaxgear.contact.slide import as_removed
from jaxgear.contact.solve import outermost
from jaxgear.contact.status import Status

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
    assert shape.structure.shape == (4, 4, 1, 16)


def test_what_the_pairs_have_to_contain_can_be_said():
    assert jg.prepare(gear_pair(), resolution=SIZE, deflection=70.0).resolution.pairs == 3


def test_next_pairs_count_with_what_is_removed_from_them(mesh):
    """Material off every tooth keeps the next pairs away as well as it lets the carried ones go; off the carried ones
    alone it does not, and the result is flagged."""
    everywhere = np.full((2, 1, 16), 200.0)
    assert np.all(jg.contact.solve_removed(mesh, 50.0, jnp.asarray(everywhere)).converged)
    # the last pair begins, and the first one ends, where their next neighbours come nearest
    some = everywhere.copy()
    some[1, 0, 0] = some[0, 0, -1] = 0.0
    flagged = jg.contact.solve_removed(mesh, 50.0, jnp.asarray(some))
    assert np.max(flagged.residual) < 1e-10 and flagged.status[8] == Status.MORE_PAIRS_NEEDED


def test_a_gap_of_the_support_moves_the_next_pairs_as_it_does_the_others(mesh):
    """Flanks that the support brings 3 um nearer touch 3 um earlier."""
    nothing = as_removed(mesh.resolution, jnp.zeros((2, 1, 16)))
    nearer = outermost(replace(mesh, support_gap=jnp.asarray([-3.0])), nothing)
    np.testing.assert_allclose(nearer, outermost(mesh, nothing) - 3.0, rtol=1e-12)


@pytest.mark.slow
def test_a_load_beyond_their_reach_takes_more_pairs(mesh):
    heavy = jg.solve(mesh, 1500.0)
    wide = jg.solve(jg.prepare(gear_pair(), resolution=jg.Resolution(positions=16, pairs=4)), 1500.0)
    assert heavy.kinematics.resolution.pairs > 2 and bool(heavy.converged.all())
    np.testing.assert_allclose(heavy.transmission_error, wide.transmission_error, rtol=1e-9)
    traced = jax.jit(jg.solve)(mesh, 1500.0)
    assert int(traced.status.max()) == Status.MORE_PAIRS_NEEDED


REACH = 10.0, 12.0  # roll lengths of the active profiles [mm], about


def deep(x):
    """Tip and root relief, crowning and slope of both flanks from twelve numbers [um, mm]."""

    def one(y):
        relief = jg.TipRelief(y[0], y[1]) + jg.RootRelief(y[2], y[3])
        return relief + jg.ProfileCrowning(y[4]) + jg.ProfileSlope(y[5])

    return {"pinion": one(x[:6]), "wheel": one(x[6:])}


# found by a search among thousands: without looking at how the removed material falls off, two pairs were called enough
WORST = [
    [0.0, 8.6, 0.0, 7.2, 0.0, -307.0, 94.5, 8.4, 168.5, 3.7, 0.0, 0.0],
    [0.0, 3.9, 0.0, 12.2, 0.0, -965.4, 64.4, 4.5, 900.9, 6.7, 696.0, -407.3],
    [0.0, 8.3, 859.4, 9.0, 0.0, -159.4, 250.0, 8.3, 0.0, 1.1, 0.0, -320.9],
]


def random_designs(count, most):
    rng = np.random.default_rng(0)

    def one(reach):
        amount = rng.choice(most) * rng.random(4) * (rng.random(4) < 0.4)
        length = reach * rng.uniform(0.05, 1.0, 2)
        return [amount[0], length[0], amount[1], length[1], amount[2], rng.choice([-1, 1]) * amount[3]]

    return np.array(WORST + [one(REACH[0]) + one(REACH[1]) for _ in range(count)])


@jax.jit
def removed_from(wide, designs):
    return jax.vmap(lambda x: removed_material(wide, 10.0, **deep(x)))(designs)


@jax.jit
def expected_between(mesh, removed):
    """Of the two pairs next to those carried, which a mesh of four carries too."""
    return jax.vmap(lambda r: outermost(mesh, jax.tree.map(lambda field: field[1:3], r)))(removed)


@jax.jit
def expected_too_high(mesh, wide, removed):
    """By how much more than expected the gaps of these pairs close at most."""
    closing = (wide.corner_gap[None] + removed.amount) / wide.lever[None]
    true = jnp.minimum(closing[:, 0], closing[:, 3]).min(axis=1)
    return (expected_between(mesh, removed) - true).max()


@pytest.mark.slow
def test_no_pair_beyond_touches_before_it_is_expected(mesh):
    """Their gaps never close earlier, but for the curvature of the removed material within one contact, and where
    contacts are kept from sliding, for a thousandth of the material: beyond the path they get narrower."""
    still = jg.prepare(gear_pair(), resolution=jg.Resolution(positions=16, pairs=4, slide_steps=0))
    designs = random_designs(1000, [50.0, 400.0, 1000.0])
    assert expected_too_high(mesh, still, removed_from(still, designs)) < 1.0  # of up to 1000 um
    # contacts that slide, which the least plausible ones do off the flank
    wide = jg.prepare(gear_pair(), resolution=jg.Resolution(positions=16, pairs=4))
    possible = random_designs(1000, [20.0, 50.0, 400.0])
    possible[: len(WORST)] = possible[len(WORST)]  # the least plausible ones are left out
    assert expected_too_high(mesh, wide, removed_from(wide, possible)) < 0.01
    # reliefs that people make leave it where it is without any, but for what they slide
    plain = eqx.filter_jit(outermost)(mesh, as_removed(mesh.resolution, jnp.zeros((2, 1, 16))))
    tips = np.zeros((len(designs), 12))
    tips[:, [0, 6]], tips[:, [1, 3, 7, 9]] = designs[:, [0, 6]].clip(0.0, 40.0), 3.0
    for size, less in ((still, 1e-9), (wide, 2.0)):
        assert (np.asarray(expected_between(mesh, removed_from(size, tips))) >= np.asarray(plain) - less).all()


@pytest.mark.slow
@pytest.mark.parametrize("positions", [16, 25])
def test_what_two_pairs_call_converged_four_confirm(positions):
    designs, torques = random_designs(500, [50.0, 400.0, 1000.0]), jnp.asarray([10.0, 10.0, 50.0, 200.0, 600.0])

    def solved(pairs):
        mesh = jg.prepare(gear_pair(), resolution=jg.Resolution(positions=positions, pairs=pairs))

        def one(x):
            cycle = jg.solve(mesh, x[0], **deep(x[1:]))
            return cycle.transmission_error, cycle.converged

        many = jnp.concatenate([jnp.resize(torques, len(designs))[:, None], designs], axis=1)
        return jax.jit(lambda many: jax.lax.map(one, many, batch_size=128))(many)

    (few, sure), (more, _) = solved(2), solved(4)
    assert 0.5 < float(sure.mean()) < 1.0
    np.testing.assert_allclose(few[sure], more[sure], rtol=1e-9, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("teeth, torque", [((19, 48), 50.0), ((30, 30), 80.0), ((20, 30), 50.0)])
def test_the_default_gives_what_four_pairs_give(teeth, torque):
    """Also at three times the torque, traced, where nothing can take more pairs; no realistic design is flagged."""
    designs = jnp.asarray([[0.0] * 12, [6.0, 4.0, 0.0, 1.0, 0.0, 0.0] * 2, [12.0, 2.0, 8.0, 2.0, 5.0, -4.0] * 2])
    results = []
    for pairs in (None, 4):
        mesh = jg.prepare(gear_pair(teeth), resolution=jg.Resolution(positions=16, pairs=pairs))
        assert pairs is not None or mesh.resolution.pairs < 4
        cycles = jax.jit(jax.vmap(lambda t, mesh=mesh: jax.vmap(lambda x: jg.solve(mesh, t, **deep(x)))(designs)))(
            torque * jnp.asarray([0.1, 1.0, 3.0])
        )
        assert bool(cycles.converged.all())
        results.append(cycles.transmission_error)
    np.testing.assert_allclose(*results, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("width, helix", [(60.0, 30.0), (80.0, 45.0), (24.0, 30.0)])
def test_pairs_are_counted_by_the_contact_lines_on_the_face(width, helix):
    """Overlap ratios of 1.9 to 9: as many as lie within the path of contact, to which the next ones come no nearer."""
    pinion, wheel = (jg.Gear(z, 2.0, face_width=width, helix_angle=b) for z, b in ((24, helix), (50, -helix)))
    pair = jg.GearPair(pinion, wheel)
    path, half = jg.path_of_contact(pair), 0.5 * float(pair.overlap_ratio)
    farthest = max(float(path.end), -float(path.start)) / float(path.base_pitch) + half
    pairs = jg.contact.fewest_pairs(pair, deflection=1.0)
    assert 2 * farthest <= pairs <= 2 * farthest + 2
    assert jg.contact.fewest_pairs(pair, deflection=40.0) >= pairs
    check_cover(pair, path, jg.Resolution(pairs=pairs))
    with pytest.raises(ValueError, match="pairs = 2 must be at least"):
        check_cover(pair, path, jg.Resolution(pairs=2))
