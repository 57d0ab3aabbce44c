"""How uneven the load is over the face: factors of a mesh cycle, as quantities."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import FACE, LINE, gear_pair, prepare

import jaxgear as jg
from jaxgear.metrics import edge_load_factor, face_load_factor, face_load_factors, root_face_load_factor, summary
from jaxgear.shafts import tooth_height
from jaxgear.vocabulary import quantities

NAMES = ("face_load_factor", "root_face_load_factor", "edge_load_factor")


@pytest.fixture(scope="module")
def mesh():
    return prepare(gear_pair(), resolution=FACE)


@pytest.fixture(scope="module")
def cycle(mesh):
    return jg.solve(mesh, 50.0, pinion=jg.LeadSlope(10.0))


def loaded(cycle, load):
    """The cycle with given line loads (pairs, slices, positions)."""
    return replace(cycle, line_load=jnp.asarray(load))


def test_factors_are_those_of_the_pair_and_position_of_the_largest_line_load(cycle):
    load = np.ones(cycle.line_load.shape)
    load[0, :, 2] = [9.0, 0.0, 0.0, 0.0, 0.0, 0.0]  # more uneven, but less loaded than what follows
    load[1, :, 2] = [2.0, 4.0, 6.0, 8.0, 10.0, 12.0]
    load[0, :, 5] = [11.0, 1.0, 1.0, 1.0, 1.0, 1.0]
    found = loaded(cycle, load)
    curve = np.ones(8)
    curve[[2, 5]] = 12 / 7, 11 * 6 / 16
    np.testing.assert_allclose(face_load_factors(found), curve, rtol=1e-12)
    np.testing.assert_allclose(face_load_factor(found), 12 / 7, rtol=1e-12)
    np.testing.assert_allclose(edge_load_factor(found), 12 / 7, rtol=1e-12)
    pair = cycle.kinematics.pair
    ratio = min(float(tooth_height(pair) / pair.face_width), 1 / 3)
    expected = (12 / 7) ** (1 / (1 + ratio + ratio**2))
    np.testing.assert_allclose(root_face_load_factor(found), expected, rtol=1e-12)
    # of a crowned flank the ends carry less than the mean
    middle = np.broadcast_to(np.array([0.0, 3.0, 5.0, 5.0, 3.0, 2.0])[None, :, None], load.shape)
    np.testing.assert_allclose(edge_load_factor(loaded(cycle, middle)), 2 / 3, rtol=1e-12)


def test_aligned_flanks_are_even_and_slopes_mirror(mesh):
    both = [jg.solve(mesh, 50.0, pinion=jg.LeadSlope(amount)) for amount in (-10.0, 0.0, 10.0)]
    factors = [float(face_load_factor(one)) for one in both]
    np.testing.assert_allclose(factors[1], 1.0, atol=1e-9)
    np.testing.assert_allclose(factors[0], factors[2], rtol=1e-9)
    assert factors[0] > 1.5


def test_nothing_carried_is_even_and_nothing_found_is_not(cycle):
    idle = loaded(cycle, 0 * cycle.line_load)
    assert [float(quantities[name](idle)) for name in NAMES] == [1.0, 1.0, 1.0]
    lost = loaded(cycle, jnp.nan * cycle.line_load)
    assert np.isnan([float(quantities[name](lost)) for name in NAMES]).all()


def test_derivatives_are_central_differences(cycle):
    """By the line loads, in a direction that changes all of them."""
    way, step = jnp.asarray(np.random.default_rng(1).normal(size=cycle.line_load.shape)), 1e-6

    def numbers(load):
        return jnp.stack([quantities[name](loaded(cycle, load)) for name in NAMES])

    along = jax.jit(lambda load: jax.jvp(numbers, (load,), (way,)))
    _, slope = along(cycle.line_load)
    after, before = (along(cycle.line_load + side * step * way)[0] for side in (1, -1))
    np.testing.assert_allclose(slope, (after - before) / (2 * step), rtol=1e-5)
    assert np.abs(slope).min() > 1e-6


@pytest.mark.slow
def test_derivatives_by_a_slope_are_central_differences(mesh):
    """Through the contact analysis, forwards and backwards."""

    def factor(slope):
        return face_load_factor(jg.solve(mesh, 50.0, pinion=jg.LeadSlope(slope)))

    at, step = 10.0, 1e-3
    difference = (factor(at + step) - factor(at - step)) / (2 * step)
    np.testing.assert_allclose(jax.grad(factor)(at), difference, rtol=1e-5)
    np.testing.assert_allclose(jax.jvp(factor, (at,), (1.0,))[1], difference, rtol=1e-5)


@pytest.mark.slow
def test_many_cycles_at_once(mesh, cycle):
    many = jax.vmap(lambda slope: jg.solve(mesh, 50.0, pinion=jg.LeadSlope(slope)))(jnp.array([0.0, 10.0]))
    found = {name: quantities[name](many) for name in NAMES}
    for name in NAMES:
        np.testing.assert_allclose(found[name][1], quantities[name](cycle), rtol=1e-9)
    assert eqx.filter_eval_shape(summary, many)["face_load_factor"].shape == (2,)


def test_a_slope_of_the_pinion_levels_that_of_the_wheel(mesh):
    found = []
    for slope in (-6.0, 0.0, 12.0):
        cycle = jg.solve(mesh, 50.0, pinion=jg.LeadSlope(slope), wheel=jg.LeadSlope(6.0))
        found.append([float(quantities[name](cycle)) for name in NAMES])
    np.testing.assert_allclose(found[0], 1.0, atol=1e-6)
    assert 1.0 < found[1][0] < found[2][0] and found[2][0] > 1.5


@pytest.mark.slow
def test_a_sweep_takes_them(mesh):
    def design(x):
        return jg.LeadSlope(x["slope"]), jg.LeadSlope(6.0)

    bounds = {"slope": (-12.0, 12.0)}
    table = jg.sweep(mesh, 50.0, design, jg.FullFactorial(bounds, 5), results=NAMES)
    best = int(np.argmin(table.column("face_load_factor")))
    assert table.column("slope")[best] == -6.0
    np.testing.assert_allclose([table.column(name)[best] for name in NAMES], 1.0, atol=1e-6)
    assert table.column("face_load_factor").max() > 1.5


def test_one_slice_has_no_load_over_the_face():
    mesh = prepare(gear_pair(), resolution=LINE)
    cycle = jg.solve(mesh, 50.0)
    for name in (*NAMES, "face_load_factors"):
        function = quantities[name] if name in NAMES else face_load_factors
        with pytest.raises(ValueError, match="a mesh of 1 slice has no load over the face"):
            function(cycle)
    assert "face_load_factor" not in eqx.filter_eval_shape(summary, cycle)
    with pytest.raises(ValueError, match="^face_load_factor: a mesh of 1 slice"):
        jg.sweep(
            mesh,
            50.0,
            lambda x: (jg.TipRelief(x["tip"], 3.0), None),
            jg.FullFactorial({"tip": (0.0, 5.0)}, 2),
            results=("face_load_factor",),
        )
