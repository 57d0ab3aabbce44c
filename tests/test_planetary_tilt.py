"""Pins that tilt over the face, by the signs of which flanks can take the effect away."""

from dataclasses import replace
from functools import cache

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import FACE, gear_pair, prepare
from reference_stage import prepared as tables
from reference_stage import stage as reference

import jaxgear as jg
from jaxgear.metrics import face_load_factor
from jaxgear.planetary import PlanetaryStage, StageFlanks, StageGears, mesh_cycles, prepare_stage, solve_stage

WIDTH, FORCE, TILT, ANGLE = 18.0, 3000.0, 0.5, np.deg2rad(20)
# over the face, of a tangential and of a radial tilt
OPEN, SHIFTED = TILT * WIDTH * np.cos(ANGLE), TILT * WIDTH * np.sin(ANGLE)
CORRECTED = [
    ("tangential_pin_tilt", {"sun": -OPEN, "ring": -OPEN}),  # leads of the central gears
    ("tangential_pin_tilt", {"planet_to_sun": -OPEN, "planet_to_ring": -OPEN}),  # taper of the planets
    ("radial_pin_tilt", {"planet_to_sun": -SHIFTED, "planet_to_ring": SHIFTED}),  # helix of the planets
]


@cache
def prepared():
    """24/18/60 teeth; the pair of sun and planet stands for both meshes, whose slopes of the gap are argued."""
    own = PlanetaryStage(
        StageGears(24, 18, 60, module=3.0),
        3,
        radial_pin_stiffness=500.0,
        tangential_pin_stiffness=500.0,
        radial_pin_tilt=np.zeros(3),
        tangential_pin_tilt=np.zeros(3),
        pin_tilt_compliance=0.0,
    )
    mesh = prepare(gear_pair((24, 18), bores=(None, None)), resolution=FACE)
    return prepare_stage(own, sun=mesh, ring=mesh)


def tilted(**tilt):
    one = prepared()
    given = {name: jnp.full(3, value) if name != "pin_tilt_compliance" else value for name, value in tilt.items()}
    return replace(one, stage=replace(one.stage, **given))


def leads(**amounts):
    return StageFlanks(*(jg.LeadSlope(amounts.get(name, 0.0)) for name in StageFlanks._fields))


@eqx.filter_jit
def removed(mesh, flanks, slope):
    return mesh.loaded(jnp.asarray(FORCE), flanks, slope).removed.amount


def gaps(stage, flanks):
    """Gap over the face of both meshes of every planet at all contacts."""
    slopes = stage.stage.gap_slopes(jnp.asarray(FORCE))
    return [removed(stage.sun, own, slope) for own, slope in zip((flanks.at_sun, flanks.at_ring), slopes)]


@pytest.mark.parametrize(("name", "amounts"), CORRECTED)
def test_leads_that_take_the_effect_away(name, amounts):
    """Of a tangential tilt those of sun and ring, or tapered planets; of a radial one a helix of the planets."""
    for corrected, alone in zip(gaps(tilted(**{name: TILT}), leads(**amounts)), gaps(tilted(**{name: TILT}), leads())):
        np.testing.assert_allclose(corrected, 0.0, atol=1e-9)
        assert np.ptp(alone) > 0.8 * min(OPEN, SHIFTED)


def test_windup_of_the_carrier_opens_both_meshes():
    """The tilt is that of a force 2 F cos(alpha) on every pin."""
    compliance = 1e-4
    found = gaps(tilted(pin_tilt_compliance=compliance), leads())
    same = gaps(tilted(tangential_pin_tilt=compliance * 2 * FORCE * np.cos(ANGLE)), leads())
    for one, other in zip(found, same):
        np.testing.assert_allclose(one, other, rtol=1e-12)


def solved_by(stage, flanks):
    torque = 3 * FORCE * 1e-3 * stage.stage.gears.base_radius(24.0)
    return solve_stage(stage, torque, **flanks._asdict())


def solved(stage, flanks):
    cycle = solved_by(stage, flanks)
    meshes = mesh_cycles(stage, cycle)
    assert cycle.converged.all() and meshes.status.max() == 0
    return cycle, np.asarray([face_load_factor(meshes.sun), face_load_factor(meshes.ring)])


@pytest.mark.slow
def test_load_over_the_face():
    """K_Hbeta of all meshes: 1 with corrected flanks, more without; and its derivative by the tilt."""
    level, even = solved(tilted(), leads())
    np.testing.assert_allclose(even, 1.0, rtol=1e-6)
    for name, amounts in CORRECTED:
        cycle, factors = solved(tilted(**{name: TILT}), leads(**amounts))
        np.testing.assert_allclose(factors, 1.0, rtol=1e-6)
        np.testing.assert_allclose(cycle.transmission_error, level.transmission_error, rtol=1e-9)
        assert solved(tilted(**{name: TILT}), leads())[1].min() > 1.1

    def largest(tilt):
        one = tilted(tangential_pin_tilt=tilt)
        return jnp.max(face_load_factor(mesh_cycles(one, solved_by(one, leads())).sun))

    at, step = jnp.asarray(TILT), 1e-4
    exact = jax.jvp(largest, (at,), (jnp.ones_like(at),))[1]
    assert np.isclose(exact, (largest(at + step) - largest(at - step)) / (2 * step), rtol=1e-5)


def test_tilts_that_mean_nothing_are_refused():
    own = reference(tangential_pin_tilt=np.full(3, TILT))
    with pytest.raises(ValueError, match="a table holds the load over the face: pins cannot tilt"):
        solve_stage(tables(own), 100.0)
    with pytest.raises(ValueError, match="radial_pin_tilt has 2 numbers, must have one for each of the 3 planets"):
        reference(radial_pin_tilt=[0.0, 1.0])
