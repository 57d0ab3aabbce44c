"""The gear body as a plate under an axial force at its teeth: it tilts and dishes.

Helical teeth pass on an axial force, tan(beta_b) times that on the transverse line of action, and the body gives way to
it along the axis; tan(beta_b) times this counts on the line of action. The body is an annular plate, clamped at the
bore, with the force on the reference circle: Kirchhoff's plate for every harmonic n of the circumference, powers
x^(+-n), x^(2+-n) of the relative radius with logarithms where two of them are one, and the deflection by shear, whose
flow has a harmonic potential. Against finite elements of whole gears (19/48 teeth, module 3 mm, 15 degrees, face of 20
mm) the mean transmission error of unmodified gears is within 2 %, with the wheel held at 40 mm or at 100 mm; without
the plate it is up to 14 % too small.

The body also turns with its rim, so that the place of a contact on the face counts: at y from the middle of the body
the radial part of the force, sin(alpha_wt), works on the slope, and the load's own place acts back on the deflection of
all (`contact.face_coupling`). With a wheel held at 40 mm, mean transmission errors of gears with a slope of 20 um are
up to 5 % off without that, 2 % with it, and line loads of unmodified gears 3 % and 1 % (rms).

A ring gear is such a plate too, held at its rim and loaded at its inner edge; one on arcs counts as held all round.

References:
    S. Timoshenko, S. Woinowsky-Krieger, Theory of Plates and Shells, 1959, section 63 (loads that are not symmetric).
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..geometry import Gear
from ..numerics import solve_dense
from .plane import shear_modulus

Scalar = Float[Array, ""]
Edge = Float[Array, "2"]  # deflection and slope at x = 1

# Harmonics that are longer than a plate of usual proportions is thick; shorter ones belong to the teeth.
_HARMONICS = 12
_SHEAR_FACTOR = 5 / 6  # of a plate (Reissner)


class AxialCompliance(NamedTuple):
    """Compliance of a gear body under an axial force at its reference circle, at the place of the force.

    Attributes:
        deflection: deflection along the axis, by bending and shear [um/N].
        slope: slope of the body along the radius, by bending [um/N per mm].
    """

    deflection: Scalar
    slope: Scalar


def axial_compliance(gear: Gear) -> AxialCompliance:
    """Axial compliance of the body of a gear clamped at its bore, of a ring gear at its rim.

    A ring gear lies outside of the circle of its load: forces on its edge have the other sign, and the slope is that
    over the signed radius.
    """
    radius, width, material = gear.pitch_radius, gear.face_width, gear.material
    ratio, poisson = gear.bore_radius / radius, material.poisson_ratio
    stiffness = material.elastic_modulus * width**3 / (12 * (1 - poisson**2))
    bending = 1e3 * radius**2 / (jnp.pi * stiffness) * _bending(ratio, poisson)
    sheared = 1e3 * _shear(ratio) / (jnp.pi * _SHEAR_FACTOR * shear_modulus(material) * width)
    return AxialCompliance(gear.signed(bending[0] + sheared), gear.signed(bending[1] / radius))


def _bending(ratio: Scalar, poisson: Scalar) -> Edge:
    """Sum over harmonics of the bending compliance of the plate, times pi D / r^2."""
    orders = jnp.arange(2, _HARMONICS + 1).astype(ratio.dtype)
    higher = jnp.sum(jax.vmap(lambda n: _of_powers(n, ratio, poisson))(orders), axis=0)
    return 0.5 * _low_order(0, ratio, poisson) + _low_order(1, ratio, poisson) + higher


def _shear(ratio: Scalar) -> Scalar:
    """Deflection by shear alone, times pi times the shear stiffness of the plate."""
    order = jnp.arange(1, _HARMONICS + 1).astype(ratio.dtype)
    faded = ratio ** (2 * order)
    return -0.5 * jnp.log(ratio) + jnp.sum((1 - faded) / ((1 + faded) * order))


def _low_order(order: int, ratio: Scalar, poisson: Scalar) -> Edge:
    """Bending compliance in harmonic 0 or 1, where some of the four functions are powers with a logarithm."""
    powers = jnp.asarray([0.0, 2.0, 0.0, 2.0] if order == 0 else [1.0, 3.0, -1.0, 1.0], ratio.dtype)
    logarithmic = np.array([False, False, True, True] if order == 0 else [False, False, False, True])
    log = jnp.log(ratio)
    value = ratio**powers
    slope = powers * value / ratio
    bore = jnp.where(logarithmic, value * log, value), jnp.where(logarithmic, slope * log + value / ratio, slope)
    plain, more = _at_edge(powers, order, poisson), _with_logarithm(powers, order, poisson)
    edge = [jnp.where(logarithmic, *pair) for pair in zip(more, plain)]
    there = jnp.stack([jnp.where(logarithmic, 0.0, 1.0).astype(ratio.dtype), jnp.where(logarithmic, 1.0, powers)])
    return _at_force(jnp.stack([*bore, *edge]), there)


def _of_powers(order: Scalar, ratio: Scalar, poisson: Scalar) -> Edge:
    """Bending compliance in harmonic 2 or higher; falling powers are scaled to 1 at the bore, to avoid overflow."""
    powers = jnp.stack([order, order + 2, -order, 2 - order])
    fade = jnp.stack([jnp.ones_like(order), jnp.ones_like(order), ratio**order, ratio ** (order - 2)])
    value = jnp.stack([ratio**order, ratio ** (order + 2), jnp.ones_like(order), jnp.ones_like(order)])
    rows = [value, powers * value / ratio, *(fade * row for row in _at_edge(powers, order, poisson))]
    return _at_force(jnp.stack(rows), jnp.stack([fade, powers * fade]))


def _at_edge(powers: Array, order: Scalar | int, poisson: Scalar) -> tuple[Array, Array]:
    """Radial moment and Kirchhoff's shear force of x^p cos(n theta) at x = 1, both over minus the plate's stiffness."""
    square = order**2
    moment = powers * (powers - 1) + poisson * (powers - square)
    force = powers * (powers - 1) ** 2 - powers - square * powers + 2 * square + (1 - poisson) * square * (1 - powers)
    return moment, force


def _with_logarithm(powers: Array, order: int, poisson: Scalar) -> tuple[Array, Array]:
    """Moment and shear force of x^p ln(x) as in `_at_edge`: the derivatives of those of x^p by p."""
    moment = 2 * powers - 1 + poisson
    return moment, 3 * powers**2 - 4 * powers - order**2 * (2 - poisson)


def _at_force(rows: Float[Array, "4 4"], there: Float[Array, "2 4"]) -> Edge:
    """Deflection and slope at the edge by a unit force of the harmonic, clamped at the bore, without outer moment."""
    unit = jnp.asarray([0.0, 0.0, 0.0, -1.0], rows.dtype)
    return there @ solve_dense(rows, unit)
