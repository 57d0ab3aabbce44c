"""The contact that a tip corner cuts off, against a discretised half plane solved as a non-negative least squares."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import nnls

from jaxgear.compliance.laws import cut_off

PENALTY = 1e4
CORNERS = (0.9, 0.6, 0.3, 0.0, -0.3, -1.0, -2.0, -3.0)


def solve(corner, count=240):
    """A parabola x^2 / 2 whose body ends at the given distance to the left of its vertex, pressed on a half plane.

    Galerkin's method with constant pressures and the logarithmic kernel, E* = R = 1. The approach enters as the
    multiplier of a penalty on the load, so that the result is exact for the slightly smaller load it carries.

    Returns:
        half width of the full contact under that load; approach; ends, mean ln(distance from the corner) of the
        pressure.
    """
    right = -corner + (1.1 + corner if corner > 0.9 else 1.02 * 2 / 3 * (corner + np.sqrt(corner**2 + 3)))
    edges = -corner + (right + corner) * (0.5 - 0.5 * np.cos(np.linspace(0, np.pi, count + 1)))
    width = np.diff(edges)
    difference = edges[:, None] - edges[None]
    distance = np.where(difference == 0, 1.0, np.abs(difference))
    second = difference**2 * (0.5 * np.log(distance) - 0.75)  # second primitive of ln |t|
    logarithm = -(second[1:, 1:] - second[1:, :-1] - second[:-1, 1:] + second[:-1, :-1])
    kernel = -2 / np.pi * logarithm  # displacement of both bodies, 2 / (pi E*) int p ln(1 / |x - s|) ds
    gap = (edges[1:] ** 3 - edges[:-1] ** 3) / 6
    wanted = np.pi / 4  # a = 1
    factor = cholesky(kernel + PENALTY * np.outer(width, width))
    pressure, _ = nnls(factor, solve_triangular(factor.T, PENALTY * wanted * width - gap, lower=True))
    load = width @ pressure
    loaded = np.flatnonzero(pressure)
    offset = edges + corner
    primitive = offset * (np.log(np.where(offset > 0, offset, 1.0)) - 1)
    return (
        np.sqrt(4 * load / np.pi),
        PENALTY * (wanted - load),
        edges[loaded[[0, -1]] + [0, 1]],
        np.diff(primitive) @ pressure / load,
    )


def patch(tau):
    """The law's patch at a = 1."""
    return cut_off(jnp.asarray(tau), jnp.asarray(1.0))


def excess(tau):
    """Phi: the law's polynomial part, and the logarithm of the half extent."""
    cut = patch(tau)
    return float(cut.bending - 0.25 * jnp.log(cut.squared_extent))


def test_full_contact_has_the_approach_of_hertz():
    """Checks the numerical solution itself: a^2 / 2 (ln(2 / a) + 1 / 2) below the parabola's vertex."""
    a, approach, ends, _ = solve(1.5)
    assert approach == pytest.approx(0.5 * a**2 * (np.log(2 / a) + 0.5), rel=2e-4)
    np.testing.assert_allclose(ends, [-a, a], atol=0.03)


@pytest.mark.parametrize("corner", CORNERS)
def test_approach_and_length_of_the_cut_off_contact(corner):
    """What the cut adds to the approach of the full contact, and how far the patch reaches."""
    a, approach, (left, right), _ = solve(corner)
    tau = corner / a
    phi = excess(tau)
    phi += 0.5 * tau**2 if tau < 0 else 0.0  # the law leaves the gap below the corner to the geometry
    extra = approach - 0.5 * a**2 * (np.log(2 / a) + 0.5)
    assert extra == pytest.approx(a**2 * phi, rel=0.01, abs=1e-4)
    assert left == -corner
    assert right - left == pytest.approx(2 / 3 * (corner + np.sqrt(corner**2 + 3 * a**2)), rel=0.02)


def mean_log_of_law(corner):
    a, *_, mean_log = solve(corner)
    return np.log(patch(corner / a).mean_distance), mean_log - np.log(a)


@pytest.mark.parametrize("corner", [1.5, 1.1])
def test_mean_logarithm_of_the_distance_from_the_corner(corner):
    law, numerical = mean_log_of_law(corner)
    assert law == pytest.approx(numerical, abs=0.005)


@pytest.mark.parametrize("corner", CORNERS)
def test_mean_logarithm_over_the_semi_ellipse_of_a_cut_off_contact(corner):
    """The wedge term spreads the load over the patch without the singularity that only half planes have."""
    length = 2 / 3 * (corner + np.sqrt(corner**2 + 3))
    angle = (np.arange(20000) + 0.5) * np.pi / 20000
    distance = 0.5 * length * (1 - np.cos(angle))
    mean = np.sum(np.log(distance) * np.sin(angle) ** 2) / np.sum(np.sin(angle) ** 2)
    assert np.log(patch(corner).mean_distance) == pytest.approx(mean, abs=1e-6)
