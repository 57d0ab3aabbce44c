"""Vibration of planetary stages: published natural frequencies, symmetry, closed forms, static limit and resonances."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from reference_stage import HELD, TORQUE, prepared, stage

import jaxgear as jg
from jaxgear.dynamics import inertia_of
from jaxgear.geometry import RingGear
from jaxgear.planetary import (
    PlanetaryStage,
    StageGears,
    StageInertias,
    natural_modes,
    solve_stage,
    stage_response,
    stage_system,
)

MESHES = {"sun_stiffness": 364.0, "ring_stiffness": 482.0}
INERTIAS = StageInertias(sun=2e-3, planet=6e-4, ring=0.1, carrier=0.05, planet_mass=0.5, sun_mass=1.0)


def helicopter_stage(planets):
    """J. Lin, R. G. Parker, J. Vib. Acoust. 121 (1999) 316-321, table 1: only I / r^2 counts."""
    gears = StageGears(24, 30, 84, 3.0, 24.6)
    sun, planet, ring = (1e-3 * gears.base_radius(z) for z in (24.0, 30.0, 84.0))
    own = PlanetaryStage(
        gears,
        planets,
        radial_pin_stiffness=100.0,
        tangential_pin_stiffness=100.0,
        sun_support=100.0,
        ring_support=100.0,
        carrier_support=100.0,
    )
    inertias = StageInertias(
        sun=0.39 * sun**2,
        planet=0.61 * planet**2,
        ring=3.00 * ring**2,
        carrier=6.29 * (1e-3 * gears.working_center_distance) ** 2,
        planet_mass=0.66,
        sun_mass=0.4,
        ring_mass=2.35,
        carrier_mass=5.43,
    )
    return stage_system(own, inertias, sun_stiffness=500.0, ring_stiffness=500.0, fixed_support=1e9 * ring**2)


def by_kind(modes, kind):
    return np.asarray([frequency for frequency, each in zip(modes.frequency, modes.kinds) if each == kind])


def test_published_natural_frequencies():
    """Table 2 of the paper: rotational modes are distinct, translational ones come in pairs, and of the planets alone
    there are N - 3 of each frequency."""
    three, four = natural_modes(helicopter_stage(3)), natural_modes(helicopter_stage(4))
    rotational = [0.0, 1475.7, 1930.3, 2658.3, 7462.8, 11775.3]
    translational = [743.2, 1102.4, 1896.0, 2276.4, 6986.3, 9647.9]
    np.testing.assert_allclose(by_kind(three, "rotation"), rotational, atol=0.06)
    np.testing.assert_allclose(by_kind(three, "translation"), np.repeat(translational, 2), atol=0.06)
    assert not len(by_kind(three, "planet"))
    np.testing.assert_allclose(by_kind(four, "planet"), [1808.2, 5963.8, 6981.7], atol=0.06)
    assert (len(by_kind(four, "rotation")), len(by_kind(four, "translation"))) == (6, 12)


def test_torsional_stage_of_two_planets():
    """Fixed ring: both meshes in series between sun, planets and carrier, and two planets against each other."""
    own, planets = stage(2, teeth=(26, 18, 62)), 2
    system = stage_system(own, INERTIAS, **MESHES, torsional=True)
    modes = natural_modes(system)
    gears, cosine = own.gears, np.cos(np.deg2rad(20.0))
    sun, planet = (1e-3 * float(gears.base_radius(z)) for z in (26.0, 18.0))
    pins = 1e-3 * float(gears.working_center_distance)
    sun, planet = 2e-3 / sun**2, 6e-4 / planet**2
    carrier = 0.05 / pins**2 + planets * 0.5
    both = 1 / (planets * planet) + cosine**2 / carrier
    flexible = np.asarray([[both + 1 / sun, both - 2 / (planets * planet)], [both - 2 / (planets * planet), both]])
    square = np.linalg.eigvals(planets * np.diag([364.0, 482.0]) @ flexible)
    expected = np.sort([0.0, (364.0 + 482.0) / planet, *square])
    np.testing.assert_allclose(modes.frequency, np.sqrt(1e6 * expected) / (2 * np.pi), rtol=1e-9, atol=1e-3)
    assert sorted(modes.kinds) == ["planet", "rotation", "rotation", "rotation"]
    np.testing.assert_allclose(np.sum(modes.kinetic_energy, axis=1), 1.0)
    single = jax.tree.map(lambda leaf: leaf.astype(np.float32), own)
    rounded = natural_modes(stage_system(single, INERTIAS, **MESHES, torsional=True)).frequency
    assert rounded.dtype == np.float32
    np.testing.assert_allclose(rounded, modes.frequency, rtol=1e-5, atol=3.0)


def test_response_of_the_reference_stage():
    """At low speed forces and transmission error of the static stage; phases excite rotation with the third harmonic
    alone, and a resonance is 1 / (2 D) high."""
    own = stage(sun_support=HELD)
    cycle = solve_stage(prepared(own), TORQUE[3])
    system = stage_system(own, INERTIAS, **MESHES)
    modes = natural_modes(system)
    natural = by_kind(modes, "rotation")[1]
    found = [stage_response(system, cycle, [1.0, natural / 3], damping_ratio=ratio) for ratio in (0.01, 0.02)]
    slow = found[0]
    np.testing.assert_allclose(np.abs(slow.transmission_error[0]), cycle.orders(5).amplitude, rtol=2e-3, atol=1e-6)
    static = np.abs(np.fft.rfft(cycle.sun_force)[:, 1:6]) / 30
    np.testing.assert_allclose(np.abs(slow.mesh_force[0, 0]), static, rtol=5e-3, atol=0.05)
    # planets push on their pins with the sum of both forces
    pins = np.abs(np.fft.rfft(cycle.bearing_force, axis=-1)[..., 1:6]) / 30
    np.testing.assert_allclose(np.abs(slow.pin_force[0]), pins, rtol=5e-3, atol=0.05)
    assert np.isclose(slow.dynamic_factor[0], np.max(slow.force()[0]) / np.mean(cycle.sun_force))
    assert not slow.loses_contact.any() and replace(slow, mean_force=0.01 * slow.mean_force).loses_contact.all()
    # suppressed in rotation at every speed, as the third harmonic is in translation
    assert np.abs(slow.transmission_error[:, [0, 1, 3, 4]]).max() < 1e-6
    assert slow.amplitude("sun x")[:, 2].max() < 1e-9 < 1e-2 < slow.amplitude("sun x")[:, 0].min()
    high, low = (np.abs(each.transmission_error[1, 2]) for each in found)
    assert np.isclose(high / low, 2.0, rtol=2e-2) and high > 10 * cycle.orders(3).amplitude[2]


def test_derivatives_by_stiffness():
    """A stage of stiffness s has natural frequencies that rise with sqrt(s); the response against differences."""
    own = stage(sun_support=HELD)
    cycle = solve_stage(prepared(own), TORQUE[3])

    def frequencies(size):
        stiff = jnp.asarray([364.0, 482.0]) * size
        return natural_modes(
            stage_system(own, INERTIAS, sun_stiffness=stiff[0], ring_stiffness=stiff[1], torsional=True)
        ).frequency

    one = jnp.ones(())
    slope = jax.jacrev(frequencies)(one)
    np.testing.assert_allclose(slope[1:], 0.5 * frequencies(one)[1:], rtol=1e-9)

    def force(stiff):
        system = stage_system(own, INERTIAS, sun_stiffness=stiff, ring_stiffness=482.0)
        return jnp.sum(jnp.abs(stage_response(system, cycle, [1000.0], damping_ratio=0.05).mesh_force))

    at, step = jnp.asarray(364.0), 1e-2
    exact = jax.grad(force)(at)
    assert np.isclose(exact, (force(at + step) - force(at - step)) / (2 * step), rtol=1e-5)


def test_inertia_of_a_ring():
    ring = RingGear(64, 3.0, face_width=20.0, rim_diameter=236.4, cutter_teeth=25)
    assert np.isclose(inertia_of(ring), np.pi / 2 * ring.material.density * 0.02 * (0.1182**4 - 0.096**4))
    gears = [jg.Gear(z, 3.0, face_width=20.0, bore_diameter=24.0) for z in (26, 19)]
    found = StageInertias.of_gears(*gears, ring, carrier=0.05)
    assert found.ring == inertia_of(ring) and found.planet == inertia_of(gears[1]) and found.carrier_mass is None


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (
            lambda own, of: stage_system(own, of, sun_stiffness=0.0, ring_stiffness=1.0),
            "sun_stiffness = 0 N/um must be",
        ),
        (
            lambda own, of: stage_system(own, of, sun_stiffness=[1.0], ring_stiffness=1.0),
            r"sun_stiffness has shape \(1,\)",
        ),
        (
            lambda own, of: stage_system(stage(carrier_support=1.0), of, **MESHES),
            "carrier_mass is missing, the support of the carrier is not rigid",
        ),
    ],
)
def test_systems_that_mean_nothing_are_refused(call, text):
    with pytest.raises(ValueError, match=text):
        call(stage(), INERTIAS)
