"""Planetary stages with prepared meshes.

External pairs stand for both meshes where the equilibrium is argued, for which they make no difference.
"""

from dataclasses import replace
from functools import cache
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import FOUR_PAIRS, LINE, gear_pair, prepare, solve

import jaxgear as jg
from jaxgear.geometry import RingGear
from jaxgear.planetary import (
    PlanetaryStage,
    StageGears,
    StageMeshes,
    mesh_cycles,
    planet_phases,
    prepare_stage,
    solve_stage,
    stage_losses,
)

PLANETS, PIN, FORCE = 4, 500.0, 3000.0
RELIEF = jg.TipRelief(6.0, 4.0)


@cache
def mesh_of(*teeth):
    return prepare(gear_pair(teeth, bores=(None, None)), resolution=LINE)


def prepared(sun, ring=60):
    own = PlanetaryStage(
        StageGears(sun, (ring - sun) // 2, ring, module=3.0),
        PLANETS,
        radial_pin_stiffness=PIN,
        tangential_pin_stiffness=PIN,
        sun_support=1000.0,
        tangential_pin_error=jnp.zeros(PLANETS),
    )
    return prepare_stage(own, sun=mesh_of(sun, 18), ring=mesh_of(18, 60))


def solved(stage, relief=RELIEF):
    torque = PLANETS * FORCE * 1e-3 * stage.stage.gears.base_radius(stage.stage.gears.sun_teeth)
    return solve_stage(stage, torque, planet_to_sun=relief)


def test_meshes_in_phase_are_springs_in_series():
    """24/18/60: all planets at one phase and the ring's mesh half a base pitch later. The stage is then the two pairs
    under a planet's share of the load, its pin with 2 cos(alpha) on either side, and the wind-up of sun and ring."""
    stage = prepared(24)
    cycle = solved(stage)
    assert cycle.converged.all() and cycle.residual.max() < 1e-9
    np.testing.assert_allclose(cycle.load_share, 1.0, atol=1e-9)
    meshes, errors, pairs = mesh_cycles(stage, cycle, speed=1400.0, friction=0.05), [], []
    for found, teeth, flanks in ((meshes.sun, (24, 18), {"wheel": RELIEF}), (meshes.ring, (18, 60), {})):
        mesh = mesh_of(*teeth)
        pair = solve(mesh, FORCE * 1e-3 * mesh.pair.pinion.base_radius, **flanks)
        errors.append(np.asarray(pair.transmission_error - mesh.hub * pair.force / mesh.pair.face_width))
        assert np.isclose(pair.phase[0], 0.0)
        np.testing.assert_allclose(found.transmission_error, [errors[-1]] * PLANETS, atol=1e-9)
        np.testing.assert_allclose(found.line_load, [pair.line_load] * PLANETS, rtol=1e-7, atol=1e-7)
        pairs.append(jax.tree.map(lambda leaf: jnp.broadcast_to(leaf, (PLANETS, *leaf.shape)), pair))
    # the largest values of pairs under that force
    twin = StageMeshes(*pairs)
    for name in ("flank_pressure", "corner_pressure", "root_stress"):
        np.testing.assert_allclose(getattr(meshes, name), getattr(twin, name), rtol=1e-7)
    assert np.isclose(meshes.max_flank_pressure, pair.contact_pressure.max())
    # relative to the carrier, which turns with 24/84 of the sun
    np.testing.assert_allclose(
        [meshes.sun.operating_point.speed[0], meshes.ring.operating_point.speed[0]], [1e3, 4e3 / 3]
    )
    pins = (2 * np.cos(np.deg2rad(20))) ** 2 * FORCE / PIN
    windup = float(stage.sun.windup + stage.ring.windup) * PLANETS * FORCE
    assert windup > 0.1
    expected = errors[0] + np.roll(errors[1], -LINE.positions // 2) + pins + windup
    np.testing.assert_allclose(cycle.transmission_error, expected, atol=1e-7)


def test_power_balance_of_losses():
    """Losses of the flanks are missing at the carrier, but for their product: the ring's mesh passes on what the sun's
    mesh has left."""
    stage = prepared(24)
    cycle = solved(stage)
    meshes = mesh_cycles(stage, cycle, speed=1400.0, friction=0.05)
    found = stage_losses(cycle, meshes, bearing_loss=100.0)
    one, two = (1 - 0.05 * jg.quantities["mesh_loss_factor"](mesh)[0] for mesh in (meshes.sun, meshes.ring))
    assert np.isclose(found.basic_efficiency, one * two)
    assert np.isclose(found.input_power, cycle.torque * 1400 * np.pi / 30)
    flanks = float(jnp.sum(found.sun_mesh_loss + found.ring_mesh_loss))
    rolling = float(found.input_power) * 60 / 84
    assert np.isclose(flanks - (1 - one) * (1 - two) * rolling + 100.0, found.loss_power, rtol=1e-9)
    assert np.isclose(found.efficiency, 1 - (1 - one * two) * 60 / 84 - 100.0 / found.input_power)
    oil = jg.metrics.Lubricant(100.0, 11.0, 60.0, 0.4)
    bare = eqx.tree_at(lambda m: [each.operating_point.friction for each in (m.sun, m.ring)], meshes, [None, None])
    assert 0.98 < stage_losses(cycle, bare, oil).efficiency < 1
    with pytest.raises(ValueError, match="meshes have no speed"):
        stage_losses(cycle, eqx.tree_at(lambda m: m.sun.operating_point.speed, meshes, None), oil)


def test_counter_phased_planets_suppress_odd_harmonics():
    """26/18/62 and four planets, with the forces of equal planets at their own phases."""
    stage = prepared(26, 62)
    cycle = solved(stage)
    assert cycle.converged.all()
    np.testing.assert_allclose(cycle.mean_load_share, 1.0, atol=1e-6)
    odd, even = np.asarray(cycle.orders(4).amplitude)[::2], np.asarray(cycle.orders(4).amplitude)[1::2]
    assert odd.max() < 1e-3 < 1e-2 < even.max()
    np.testing.assert_allclose(cycle.sun_force[0], np.roll(cycle.sun_force[1], LINE.positions // 2), rtol=1e-9)
    # contacts at the mesh positions of every planet carry the force of the equilibrium there
    meshes = mesh_cycles(stage, cycle)
    for found, phases, force in zip(
        (meshes.sun, meshes.ring), planet_phases(stage.stage), (cycle.sun_force, cycle.ring_force)
    ):
        place = (
            np.round((np.asarray(found.phase) - np.asarray(phases)[:, None]) * LINE.positions).astype(int)
            % LINE.positions
        )
        carried = np.sum(found.pair_force, axis=1)
        np.testing.assert_allclose(carried, np.take_along_axis(np.asarray(force), place, axis=1), rtol=1e-9)
        np.testing.assert_allclose(found.force, np.mean(carried, axis=1), rtol=1e-12)


def test_tilted_pins_need_slices():
    stage = prepared(26, 62)
    tilted = replace(stage, stage=replace(stage.stage, radial_pin_tilt=np.ones(PLANETS)))
    with pytest.raises(ValueError, match="which a mesh of 1 slice cannot show"):
        solved(tilted)


@pytest.mark.slow
def test_derivatives_by_relief_and_pin_error():
    """K_gamma, PPTE, flank pressure and root stress against central differences."""
    stage = prepared(26, 62)

    def numbers(amount, late):
        errors = jnp.zeros(PLANETS)
        one = eqx.tree_at(lambda p: p.stage.tangential_pin_error, stage, errors)
        cycle = solved(one, jg.TipRelief(amount, 4.0))
        meshes = mesh_cycles(one, cycle)
        stresses = meshes.max_flank_pressure, meshes.root_stress.planet_to_ring[0]
        return jnp.stack([cycle.load_sharing_factor, jg.peak_to_peak(cycle.transmission_error), *stresses])

    at, step = jnp.asarray([6.0, -15.0]), 1e-3
    exact = jax.jit(jax.jacrev(lambda both: numbers(*both)))(at)
    for column, direction in zip(exact.T, np.eye(2)):
        there, back = (numbers(*(at + sign * step * direction)) for sign in (1, -1))
        np.testing.assert_allclose(column, (there - back) / (2 * step), rtol=1e-4, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "late", "relief"), [("N5_error_float", -30.0, 0.0), ("N5_error_float_relief", -30.0, 10.0)]
)
def test_reference_stage_with_the_meshes_of_the_library(name, late, relief):
    """26/19/64 teeth in plane stress: mean transmission error to 2 %, PPTE to 8 % or 0.1 um, shares to 0.01."""
    sun, planet = (jg.Gear(z, 3.0, face_width=20.0, bore_diameter=bore) for z, bore in ((26, 30.0), (19, 24.0)))
    ring = RingGear(64, 3.0, face_width=20.0, rim_diameter=236.4, cutter_teeth=25, root_radius=0.25)
    pairs = jg.GearPair(sun, planet), jg.GearPair(planet, ring)
    own = PlanetaryStage(
        StageGears.of_pairs(*pairs),
        5,
        radial_pin_stiffness=400.0,
        tangential_pin_stiffness=400.0,
        sun_support=0.0,
        tangential_pin_error=np.r_[late, np.zeros(4)],
    )
    assert abs((own.gears.phase_between_meshes + 0.5) % 1 - 0.5) < 1e-9
    with pytest.raises(ValueError, match="planet has teeth = 19 in the mesh with the sun and 26 in that with the ring"):
        StageGears.of_pairs(pairs[0], jg.GearPair(sun, ring))
    meshes = [
        jg.prepare(pair, compliance=jg.default_compliance(plane="stress"), resolution=FOUR_PAIRS) for pair in pairs
    ]
    stage, flank = prepare_stage(own, sun=meshes[0], ring=meshes[1]), jg.TipRelief(relief, 4.0)
    cycle = solve_stage(stage, 650.0, sun=flank, planet_to_sun=flank, planet_to_ring=flank, ring=flank)
    error, _, _, *forces = np.load(Path(__file__).with_name("planetary_reference.npz"))[name].astype(float).T
    windup = float(stage.sun.windup + stage.ring.windup) * float(np.sum(forces, axis=0).mean())
    assert cycle.converged.all()
    assert np.isclose(np.mean(cycle.transmission_error) - windup, error.mean(), rtol=0.02)
    assert np.isclose(jg.peak_to_peak(cycle.transmission_error), np.ptp(error), rtol=0.08, atol=0.1)
    np.testing.assert_allclose(cycle.mean_load_share, np.mean(forces, axis=1) / np.mean(forces), atol=0.01)
