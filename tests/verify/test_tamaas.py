"""Hertzian line contact against Tamaas, an independent boundary-element solver of elastic contact.

A cylinder lies on a periodic half plane, the period a hundred half widths long: neighbours change the result by about
(pi a / L)^2, 1e-3 of the approach and less of width and pressure.
"""

import types

import jax.numpy as jnp
import numpy as np
import pytest

import jaxgear as jg
from jaxgear.compliance.hertz import ContactGeometry, ContactSide

pytestmark = pytest.mark.verify

YOUNG, NU, RADII = 206e3, 0.3, (9.0, 22.0)
STRAIN = YOUNG / (1 - NU**2)
LOADS = (100.0, 300.0)
PERIOD, POINTS = 20.0, 2**15


@pytest.fixture(scope="module")
def tamaas():
    return pytest.importorskip("tamaas")


def geometry(depth):
    """Two steel flanks in plane strain with their centrelines at a depth [mm]."""

    def side(radius):
        values = (radius, depth, YOUNG, STRAIN, NU / (1 - NU), STRAIN)
        return ContactSide(*(jnp.full((1, 1, 1), v) for v in values))

    return ContactGeometry(side(RADII[0]), side(RADII[1]), jnp.full((1, 1, 1), 20.0))


@pytest.fixture(scope="module")
def solutions(tamaas):
    """Per line load: positions [mm], pressure [MPa], approach against the mean surface [um]."""
    reduced = RADII[0] * RADII[1] / (RADII[0] + RADII[1])
    x = (np.arange(POINTS) - POINTS // 2) * (PERIOD / POINTS)
    out = {}
    for load in LOADS:
        model = tamaas.ModelFactory.createModel(tamaas.model_type.basic_1d, [PERIOD], [POINTS])
        model.E, model.nu = STRAIN / 2, 0.0  # one body with the modulus of both, 1 / E* = 2 / STRAIN
        solver = tamaas.PolonskyKeerRey(model, -(x**2) / (2 * reduced), 1e-12)
        solver.solve(load / PERIOD)
        pressure, displacement = np.ravel(model.traction), np.ravel(model.displacement)
        below = displacement[POINTS // 2] - displacement.mean()
        out[load] = types.SimpleNamespace(x=x, pressure=pressure, approach=1e3 * below)
    return out


def test_half_width_and_peak_pressure(solutions):
    """A semi-ellipse has a mean square of a^2 / 4."""
    for load, solution in solutions.items():
        step = PERIOD / POINTS
        assert solution.pressure.sum() * step == pytest.approx(load, rel=1e-9)
        width = 2 * np.sqrt(solution.pressure @ solution.x**2 * step / load)
        expected = float(jnp.sqrt(geometry(1.0).width_factor * load)[0, 0, 0])
        assert width == pytest.approx(expected, rel=2e-4)
        assert solution.pressure.max() == pytest.approx(2 * load / (np.pi * expected), rel=2e-4)


def test_approach_between_two_loads(solutions):
    """Approach per load: its dependence on the load is that of the half width alone, whatever the reference depth."""
    law = jg.compliance.DepthReferenced().prepare(geometry(5.0))
    (low, high) = LOADS
    ours = [float(law.deflection(jnp.full((1, 1, 1), q))[0, 0, 0]) / q for q in LOADS]
    theirs = [solutions[q].approach / q for q in LOADS]
    assert ours[0] - ours[1] == pytest.approx(theirs[0] - theirs[1], rel=1e-3)
    assert theirs[0] - theirs[1] == pytest.approx(1e3 * np.log(high / low) / (np.pi * STRAIN / 2), rel=1e-3)


@pytest.mark.parametrize("depth", [0.1, 0.5, 1.7])
def test_approach_down_to_a_depth(solutions, depth):
    """Strain below the numerical pressure, integrated down to the depth with Flamant's stresses of each strip.

    With R^2 = s^2 + depth^2, int z^3 / r^4 dz = (ln(R^2 / s^2) + s^2 / R^2 - 1) / 2 and
    int s^2 z / r^4 dz = (1 - s^2 / R^2) / 2 over the axis; the strip at s = 0 has the mean of ln(s^2).
    """
    for load, solution in solutions.items():
        step = PERIOD / POINTS
        squared = solution.x**2
        outer = squared + depth**2
        log = np.log(np.where(squared > 0, squared, 1.0))
        log[POINTS // 2] = 2 * (np.log(step / 2) - 1)
        normal = 0.5 * (np.log(outer) - log + squared / outer - 1)
        transverse = 0.5 * (1 - squared / outer)
        strain = 2 / np.pi * step * solution.pressure @ (normal - NU / (1 - NU) * transverse)
        law = jg.compliance.DepthReferenced().prepare(geometry(depth))
        ours = float(law.deflection(jnp.full((1, 1, 1), load))[0, 0, 0])
        assert ours == pytest.approx(1e3 * 2 * strain / STRAIN, rel=1e-3)
