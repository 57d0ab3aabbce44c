"""Equilibrium of planetary stages with the mesh tables of the reference, its invariants and derivatives."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import matplotlib
import numpy as np
import pytest
from matplotlib.patches import Wedge
from reference_stage import HELD, REFERENCE, TORQUE, prepared, stage

import jaxgear as jg
from jaxgear.planetary import TableMesh, figures, mesh_cycles, prepare_stage, solve_stage

matplotlib.use("Agg")

LATE = -30.0


def errors(planets, value=LATE):
    return np.r_[value, np.zeros(planets - 1)]


def solved(own, kind="none", torque=None):
    return solve_stage(prepared(own, kind), TORQUE[own.planets] if torque is None else torque)


def amplitudes(cycle):
    return np.asarray(cycle.orders(6).amplitude)


CASES = {
    "N3_ideal_held": (stage(sun_support=HELD), "none"),
    "N3_error_float": (stage(tangential_pin_error=errors(3)), "none"),
    "N3_error_held": (stage(sun_support=HELD, tangential_pin_error=errors(3)), "none"),
    "N5_ideal_float": (stage(5), "none"),
    "N5_error_float": (stage(5, tangential_pin_error=errors(5)), "none"),
    "N5_error_float_relief": (stage(5, tangential_pin_error=errors(5)), "relief"),
}


@pytest.mark.parametrize("name", CASES)
def test_reference_with_its_own_tables(name):
    """Transmission error to 0.02 um, forces to 0.1 % of the mean, shares to 1e-3, and exact equilibrium."""
    own, kind = CASES[name]
    cycle, planets = solved(own, kind), own.planets
    error, x, y, *forces = REFERENCE[name].T
    mean = np.mean(forces)
    assert cycle.converged.all() and not cycle.loose.any() and cycle.residual.max() < 1e-9
    np.testing.assert_allclose(cycle.transmission_error, error, atol=0.02)
    np.testing.assert_allclose(cycle.sun_displacement, [x, y], atol=0.02)
    np.testing.assert_allclose(cycle.sun_force, forces, atol=1e-3 * mean)
    np.testing.assert_allclose(cycle.ring_force, cycle.sun_force, atol=1e-6 * mean)
    shares = np.mean(forces, axis=1) / mean
    np.testing.assert_allclose(cycle.mean_load_share, shares, atol=1e-3)
    assert np.isclose(cycle.load_sharing_factor, shares.max(), atol=1e-3)
    np.testing.assert_allclose(np.sum(cycle.sun_force, axis=0), 1e3 * TORQUE[planets] / own.gears.base_radius(26.0))
    # nearly twice the tangential part on the pin: both meshes push the same way
    np.testing.assert_allclose(cycle.pin_force, 2 * np.asarray(cycle.sun_force) * np.cos(np.deg2rad(20)), rtol=1e-9)
    if "ideal" in name:
        np.testing.assert_allclose(cycle.mean_load_share, 1.0, atol=1e-6)
        left = {3: [0, 1, 3, 4], 5: [0, 1, 2, 3, 5]}[planets]
        assert amplitudes(cycle)[left].max() < 1e-3


def test_meshes_in_phase():
    """24/21/66 teeth and three planets: all meshes at one phase, as the reference forces it on 26/19/64."""
    cycle = solved(stage(teeth=(24, 21, 66)), torque=TORQUE[3] * 24 / 26)
    np.testing.assert_allclose(cycle.transmission_error, REFERENCE["N3_inphase_float"][:, 0], atol=0.02)
    np.testing.assert_allclose(cycle.load_share, 1.0, atol=1e-9)
    assert cycle.orbit < 1e-9


@pytest.mark.parametrize(("size", "torque"), [(1.0, 400.0), (-8.0, 400.0), (15.0, 8.0), (-15.0, 3.0)])
def test_three_planets_and_a_floating_sun_share_equally(size, torque):
    """Static determinacy: whatever the errors, at every phase; also where the sun has to move by many times what the
    teeth give before all planets touch."""
    errors = {"tangential_pin_error": [-20.0, 5.0, 9.0], "sun_gap": [0.0, 4.0, 1.0], "ring_gap": [3.0, 0.0, 7.0]}
    cycle = solved(
        stage(sun_support=0.0, **{name: size * np.asarray(each) for name, each in errors.items()}), "none", torque
    )
    assert cycle.converged.all() and not cycle.loose.any()
    np.testing.assert_allclose(cycle.load_share, 1.0, atol=1e-9)
    assert cycle.orbit > 1 or torque < 10


def test_errors_that_change_no_force():
    """An error of all planets alike turns the sun; a radial one at equal pressure angles turns a planet."""
    nominal = solved(stage(sun_support=HELD))
    late = solved(stage(sun_support=HELD, tangential_pin_error=np.full(3, LATE)))
    out = solved(stage(sun_support=HELD, radial_pin_error=[25.0, -10.0, 0.0]))
    for cycle in (late, out):
        np.testing.assert_allclose(cycle.sun_force, nominal.sun_force, rtol=1e-8)
    turned = np.asarray(late.transmission_error - nominal.transmission_error)
    np.testing.assert_allclose(turned, 2 * LATE * np.cos(np.deg2rad(20)), atol=1e-7)
    np.testing.assert_allclose(out.transmission_error, nominal.transmission_error, atol=1e-7)


def test_rule_of_load_sharing():
    """share_i - 1 = k_loop (mean e - e_i) / F without the content 1, cos phi, sin phi of e; mean tangents of the
    tables."""
    planets, e = 5, 2 * np.cos(np.deg2rad(20)) * errors(5)
    cosine = np.cos(np.deg2rad(20))
    loop = 1 / (1 / 364.0 + 1 / 482.0 + (2 * cosine) ** 2 / 400.0)
    angles = 2 * np.pi / planets * np.arange(planets)
    held = np.stack([np.ones(planets), np.cos(angles), np.sin(angles)], axis=1)
    rest = e - held @ np.linalg.lstsq(held, e, rcond=None)[0]
    mean = 1e3 * TORQUE[5] / (planets * 39 * np.cos(np.deg2rad(20)))
    shares = solved(stage(5, tangential_pin_error=errors(5))).mean_load_share
    np.testing.assert_allclose(shares, 1 - loop * rest / mean, atol=2e-3)


def test_lost_planets_and_forces_beyond_the_table():
    """A planet that is far behind carries all; the others' rotation is not determined, and nothing is silent."""
    own = stage(sun_support=HELD, tangential_pin_error=[0.0, 400.0, 400.0])
    alone = solved(own, torque=40.0)
    assert alone.converged.all()
    np.testing.assert_allclose(alone.mean_load_share, [3.0, 0.0, 0.0], atol=1e-9)
    assert not solved(own, torque=4000.0).converged.any()


def numbers(base, late, pin):
    """K_gamma and PPTE of a stage; `late` is the error of the first pin, `pin` the stiffness of all."""
    pins = (lambda p: p.stage.radial_pin_stiffness), (lambda p: p.stage.tangential_pin_stiffness)
    one = eqx.tree_at(lambda p: [of(p) for of in pins], base, [pin, pin])
    errors = jnp.zeros(3, base.sun.width.dtype).at[0].set(late)
    cycle = solve_stage(eqx.tree_at(lambda p: p.stage.tangential_pin_error, one, errors), TORQUE[3])
    return jnp.stack([cycle.load_sharing_factor, jg.peak_to_peak(cycle.transmission_error)])


def test_derivatives_in_both_modes_of_a_batch_in_single_precision():
    """By pin error and bearing stiffness, against central differences in float64; what `jax.vmap` of float32 gives.

    The reverse mode is the transposed forward one.
    """
    double, late = prepared(stage(sun_support=HELD)), [LATE, -10.0, 15.0]
    single = jax.tree.map(lambda leaf: leaf.astype(np.float32) if leaf.dtype == np.float64 else leaf, double)

    @jax.jit
    @jax.vmap
    def batch(late):
        at = late, jnp.float32(400.0)
        value, linear = jax.linearize(lambda *at: numbers(single, *at), *at)
        transposed, one = jax.linear_transpose(linear, *at), jnp.ones((), late.dtype)
        reverse = jax.vmap(transposed)(jnp.eye(2, dtype=late.dtype))
        return value, (linear(one, 0 * one), linear(0 * one, one)), reverse

    found = batch(jnp.asarray(late, np.float32))
    assert all(leaf.dtype == np.float32 for leaf in jax.tree.leaves(found))
    for place, error in enumerate(late):
        value, forward, reverse = jax.tree.map(lambda leaf, place=place: leaf[place], found)
        np.testing.assert_allclose(reverse, forward, rtol=1e-4, atol=1e-6)
        at = np.asarray([error, 400.0])
        np.testing.assert_allclose(value, numbers(double, *map(jnp.asarray, at)), rtol=2e-4)
        for step, column in zip(np.diag([1e-2, 1e-1]), forward):
            there, back = (numbers(double, *map(jnp.asarray, at + sign * step)) for sign in (1, -1))
            np.testing.assert_allclose(column, (there - back) / (2 * step.sum()), rtol=2e-3, atol=1e-5)


def test_another_stage_of_the_same_gears():
    one = prepared(stage(sun_support=HELD))
    other = replace(one, stage=stage(sun_support=HELD, tangential_pin_error=errors(3)))
    assert eqx.tree_equal(solve_stage(other, TORQUE[3]), solved(other.stage))


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda p: solve_stage(p, 0.0), "torque = 0 N m must be greater than 0 N m"),
        (lambda p: solve_stage(p, [1.0, 2.0]), r"torque has shape \(2,\), must be a single number"),
        (lambda p: solve_stage(p, 1.0, sun=jg.TipRelief(5.0, 2.0)), "a table holds the modifications of its flanks"),
        (lambda p: solve_stage(p.stage, 1.0), "prepared is a PlanetaryStage, must be a PreparedStage"),
        (lambda p: mesh_cycles(p, solve_stage(p, 1.0)), "sun is a table, which holds no contacts"),
        (lambda p: prepare_stage(p.stage, sun=p, ring=p), "sun is a PreparedStage, must be a prepared mesh or"),
        (lambda p: TableMesh(np.zeros((4, 3)), np.arange(4.0), 20.0), "approach has 3 columns, must have .* 4 loads"),
    ],
)
def test_calls_that_mean_nothing_are_refused(call, text):
    with pytest.raises((ValueError, TypeError), match=text):
        call(prepared(stage()))


@pytest.mark.usefixtures("clean_figures")
def test_figures_show_what_the_cycle_has():
    own, _ = CASES["N3_error_held"]
    cycle = solved(own)
    drawing = figures.stage_drawing(own)
    filled = [patch for patch in drawing.patches if isinstance(patch, Wedge)]
    shares = [(patch.theta2 - patch.theta1) / 360 for patch in filled]
    np.testing.assert_allclose(shares, np.repeat([0, 1 / 3, 2 / 3], 2), atol=1e-9)
    shares = figures.load_shares(cycle)
    for line, share, mean in zip(shares.lines, cycle.load_share, cycle.mean_load_share):
        np.testing.assert_array_equal(line.get_ydata()[:60], share)
        assert f"({mean:.3f})" in line.get_label()
    orders = figures.orders({"held": cycle})
    np.testing.assert_allclose([bar.get_height() for bar in orders.patches], amplitudes(cycle))
    assert [label.get_text()[-1] for label in orders.get_xticklabels()] == list("TTRTTR")
    (path, _), (curve,) = figures.orbit({"held": cycle}).lines, figures.transmission_error({"held": cycle}).lines
    assert np.isclose(np.hypot(*path.get_data()).max(), cycle.orbit)
    assert f"{np.ptp(curve.get_ydata()):.2f}" in curve.get_label()
    for ax in (drawing, shares, orders, path.axes, curve.axes):
        assert "[" in ax.get_ylabel()
