"""Kinematics of planetary stages: ratios, torques, phases, what phasing suppresses, and what cannot be assembled."""

import jax
import numpy as np
import pytest

from jaxgear import planetary
from jaxgear.planetary import PlanetaryStage, StageGears

PIN = {"radial_pin_stiffness": 400.0, "tangential_pin_stiffness": 400.0}


def stage(sun, ring, planets=3, **options):
    gears = StageGears(sun, (ring - sun) // 2, ring, module=3.0)
    return PlanetaryStage(gears, planets, **PIN, **options)


@pytest.mark.parametrize(
    ("teeth", "shifts", "distance", "working", "gamma"),
    [
        ((26, 19, 64), (0.0, 0.0, 0.0), None, (20.0, 20.0), 0.0),
        ((24, 18, 60), (0.0, 0.0, 0.0), None, (20.0, 20.0), 0.5),
        ((24, 18, 60), (0.2, 0.3, -0.8), None, (23.1644, 23.1644), 0.519861),
        ((26, 19, 65), (0.1, 0.25, -0.1), 68.4971, (22.1782, 18.8101), 0.048602),
    ],
)
def test_phase_between_the_meshes_of_a_planet(teeth, shifts, distance, working, gamma):
    """Numbers of flanks that were drawn; the thickness of ring teeth has no part in them."""
    gears = StageGears(*teeth, 3.0, 20.0, *shifts, center_distance=distance)
    np.testing.assert_allclose(np.rad2deg(gears.working_pressure_angles), working, atol=2e-4)
    missed = float(gears.phase_between_meshes) - gamma
    assert abs((missed + 0.5) % 1 - 0.5) < (1e-6 if distance is None else 2e-5)  # a distance of six digits


def test_a_thinner_planet_touches_the_ring_later():
    """Both its flanks move towards the centreline of the tooth by half of the allowance on the base circle."""
    nominal, thin = (StageGears(26, 19, 64, 3.0, planet_thickness_allowance=a) for a in (0.0, -60.0))
    moved = 19 * 2 * (-0.06 / 57) / (2 * np.pi)
    assert np.isclose(thin.phase_between_meshes - 1 - nominal.phase_between_meshes, moved, rtol=1e-9)


@pytest.mark.parametrize(
    ("fixed", "driving", "ratio"),
    [
        ("ring", "sun", 3.461538),
        ("sun", "ring", 1.406250),
        ("carrier", "sun", -2.461538),
        ("ring", "carrier", 1 / 3.461538),
        ("sun", "carrier", 1 / 1.406250),
        ("carrier", "ring", -1 / 2.461538),
    ],
)
def test_ratio_torques_and_mesh_frequency_of_every_way_to_drive(fixed, driving, ratio):
    """The ratios of the three stages; power in and out balance; one mesh frequency for sun, planets and ring."""
    own = stage(26, 64, fixed=fixed, driving=driving)
    assert np.isclose(planetary.gear_ratio(own), ratio, atol=1e-6)
    torques, speeds = planetary.member_torques(own, 100.0), planetary.member_speeds(own, 1500.0)
    assert np.isclose(speeds.of(driving), 1500.0) and abs(speeds.of(fixed)) < 1e-9
    assert np.isclose(torques.of(driving), 100.0 if driving != "carrier" else -100.0)
    assert np.isclose(torques.ring / torques.sun, 64 / 26) and np.isclose(sum(torques), 0.0)
    power = [torques.of(member) * speeds.of(member) for member in ("sun", "ring", "carrier")]
    assert np.isclose(sum(power), 0.0, atol=1e-6)
    meshes = [26 * (speeds.sun - speeds.carrier), 64 * (speeds.ring - speeds.carrier)]
    meshes.append(19 * (speeds.planet - speeds.carrier))
    np.testing.assert_allclose(np.abs(meshes) / 60, planetary.mesh_frequency(own, 1500.0))


@pytest.mark.parametrize(
    ("sun", "ring", "planets", "kinds"),
    [
        (27, 63, 3, "RRRRRR"),
        (25, 65, 5, "RRRRRR"),
        (24, 60, 4, "RRRRRR"),
        (26, 64, 3, "TTRTTR"),
        (26, 64, 5, "T--TRT"),
        (26, 62, 4, "-R-R-R"),
        (25, 59, 4, "T-TRT-"),
        (28, 62, 6, "--R--R"),
    ],
)
def test_what_phasing_suppresses(sun, ring, planets, kinds):
    """The table of Parker's rule; what is left is all of a harmonic or nothing."""
    found = planetary.phasing(stage(sun, ring, planets))
    assert "".join({"rotation": "R", "translation": "T", "none": "-"}[kind] for kind in found.kinds) == kinds
    for factor in found:
        np.testing.assert_allclose(factor, np.round(factor), atol=1e-7)


def test_unequal_places():
    """24/62 teeth and four planets in two opposite pairs, whose first harmonic is left over in part."""
    angles = [0.0, 92.0930, 180.0, 267.9070]
    own = stage(24, 62, 4, angles=angles)
    sun, ring = planetary.planet_phases(own)
    np.testing.assert_allclose(sun, [0.0, 0.860465, 0.0, 0.139535], atol=1e-5)
    gamma = own.gears.phase_between_meshes
    by_ring = gamma + 62 * np.asarray(angles) / 360
    np.testing.assert_allclose((ring - by_ring + 0.5) % 1, 0.5, atol=1e-4)
    assert 0.5 < float(planetary.phasing(own, 1).rotation[0]) < 1


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: stage(26, 64, 4), "90 teeth of sun and ring are no multiple of 4 planets: .* multiples of 360/90 deg"),
        (lambda: stage(24, 62, 4, angles=[0, 91, 180, 268]), r"angles\[1\] = 91 deg .* 92.093 deg is the nearest"),
        (lambda: stage(24, 60, 4, angles=[0, 90, 60, 270]), "must increase"),
        (lambda: stage(12, 78, 6), "planets are 67.5 mm apart, must be more than their tip diameter of 105 mm"),
        (lambda: stage(26, 64, sun_gap=[1.0, 2.0]), "sun_gap has 2 numbers, must have one for each of the 3 planets"),
        (lambda: stage(26, 64, driving="ring"), 'driving = "ring" must not be the fixed member'),
        (lambda: StageGears(26, 19, 65, 3.0), "of 67.5 mm, planet and ring of 69 mm, must be equal"),
        (lambda: StageGears(26, 19, 65, 3.0, center_distance=67.4), "67.4 mm must be at least 67.5 mm"),
        (lambda: StageGears(26, 19, 18, 3.0), "ring_teeth = 18 must be greater than planet_teeth = 19"),
    ],
)
def test_what_cannot_be_built_is_refused(make, text):
    with pytest.raises(ValueError, match=text):
        make()


@pytest.mark.parametrize(
    ("fixed", "driving", "closed"),
    [
        ("ring", "sun", lambda i, eta: 1 - (1 - eta) * i / (i - 1)),
        ("ring", "carrier", lambda i, eta: (i - 1) / (i / eta - 1)),
        ("sun", "ring", lambda i, eta: (i - eta) / (i - 1)),
        ("sun", "carrier", lambda i, eta: (i - 1) / (i - 1 / eta)),
        ("carrier", "sun", lambda i, eta: eta),
        ("carrier", "ring", lambda i, eta: eta),
    ],
)
def test_efficiency_by_the_basic_efficiency(fixed, driving, closed):
    """i_0 = -64/26; H. W. Mueller, Die Umlaufgetriebe."""
    own = stage(26, 64, fixed=fixed, driving=driving)
    assert np.isclose(planetary.stage_efficiency(own, 0.97), closed(-64 / 26, 0.97), rtol=1e-14)
    assert np.isclose(planetary.stage_efficiency(own, 1.0), 1.0, rtol=1e-14)
    single = jax.tree.map(lambda leaf: leaf.astype(np.float32), own)
    found = planetary.stage_efficiency(single, 0.97)
    assert found.dtype == np.float32 and np.isclose(found, closed(-64 / 26, 0.97), rtol=1e-6)
