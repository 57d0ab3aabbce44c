"""Bearings with radial clearance: closed forms, the limit of none, equilibrium and derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from gearboxes import PINION, stage

from jaxgear.shafts import (
    Bearing,
    Gearbox,
    Section,
    Shaft,
    ShaftLoad,
    annex_e,
    bearing_reactions,
    support,
)

Y = jnp.asarray(np.linspace(-8.0, 8.0, 5))


def beam(clearances, force=(300.0, 400.0, 0.0), at=40.0):
    ends = [Bearing(name, z, 200.0, clearance=c) for name, z, c in zip("AB", (0.0, 100.0), clearances)]
    return Gearbox([Shaft("s", [Section(100, 40)], ends, loads=[ShaftLoad(at, force)])], [])


def test_a_shaft_lies_against_its_bearings_in_the_direction_of_the_load():
    """Of a statically determinate shaft the forces are known, and displacements are c + F / k along them."""
    found = bearing_reactions(beam((20.0, 35.0)))
    forces = np.array([0.6, 0.4]) * 500.0
    np.testing.assert_allclose(found.force[:, :2], forces[:, None] * np.array([0.6, 0.8]), rtol=1e-9)
    moved = np.array([20.0, 35.0]) + forces / 200.0
    np.testing.assert_allclose(found.shaft[:, :2], moved[:, None] * np.array([0.6, 0.8]), rtol=1e-9)


@pytest.mark.slow
def test_no_clearance_is_no_clearance():
    given, zero = stage(1e-9), stage(0.0)
    np.testing.assert_allclose(support(given).influence(Y), support(zero).influence(Y), rtol=1e-6)
    bare = bearing_reactions(beam((None, None)))
    np.testing.assert_allclose(bearing_reactions(beam((0.0, 0.0))).shaft, bare.shaft, rtol=1e-9)


@pytest.mark.slow
def test_the_tangent_is_the_change_of_the_state():
    """Under an even load of the mesh, H f + gap changes with the torque by H times the change of f."""
    points, weights = np.polynomial.legendre.leggauss(len(Y))
    y, even = jnp.asarray(9.0 * points), weights / 2 * 1e3 / float(PINION.base_radius)

    def opening(moment):
        given = support(stage(25.0, moment=moment))
        return np.asarray(given.influence(y)) @ (even * moment) + np.asarray(given.gap(y))

    tangent = np.asarray(support(stage(25.0)).influence(y)) @ even
    np.testing.assert_allclose((opening(40.01) - opening(39.99)) / 0.02, tangent, rtol=1e-6)
    secant = opening(40.0) / 40.0
    assert np.abs(secant / tangent - 1).min() > 0.2


def test_a_shaft_afloat_has_no_answer():
    assert np.isnan(np.asarray(bearing_reactions(beam((20.0, 35.0), (0.0, 0.0, 0.0))).shaft)).all()


@pytest.mark.slow
def test_derivative_of_the_factor_is_its_central_difference():
    @jax.jit
    def factor(values):
        return annex_e(support(stage(values[0], values[1])), stations=11).face_load_factor

    at = jnp.array([25.0, 300.0])
    found = jax.jit(jax.grad(factor))(at)
    assert float(jnp.abs(found[0])) > 1e-5
    for index in range(2):
        step = jnp.zeros(2).at[index].set(1e-4 * at[index])
        slope = (factor(at + step) - factor(at - step)) / (2 * step[index])
        np.testing.assert_allclose(found[index], slope, rtol=1e-5)
