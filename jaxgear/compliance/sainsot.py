"""Sainsot's polynomial for the fillet-foundation deflection (legacy).

    delta = F cos^2 a / (E b) { L (u/S)^2 + M u/S + P (1 + Q tan^2 a) },   X = A/t^2 + B h^2 + C h/t + D/t + E h + F

It is a fit to plane-stress rings with clamped bore and contains the ring's torsion. Stated validity: 1.4 <= h <= 7,
0.01 <= t <= 0.12 with t = theta_f; pinions below about 25 teeth lie outside, where the polynomial extrapolates
smoothly.

References:
    P. Sainsot, P. Velex, O. Duverger, J. Mech. Des. 126 (2004) 748-752, doi 10.1115/1.1758252, eq. (15) and Table 1.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

_TABLE = np.array(
    [
        [-5.574e-5, -1.9986e-3, -2.3015e-4, 4.7702e-3, 0.0271, 6.8045],
        [60.111e-5, 28.100e-3, -83.431e-4, -9.9256e-3, 0.1624, 0.9086],
        [-50.952e-5, 185.50e-3, 0.0538e-4, 53.300e-3, 0.2895, 0.9236],
        [-6.2042e-5, 9.0889e-3, -4.0964e-4, 7.8297e-3, -0.1472, 0.6904],
    ]
)


def coefficients(half_angle: Float[Array, ""], thickness_ratio: Float[Array, ""]) -> Float[Array, "4"]:
    """L*, M*, P*, Q* for a root half angle [rad] and a ratio of root to bore radius."""
    t, h = half_angle, thickness_ratio
    basis = jnp.stack([t**-2, h**2, h / t, 1 / t, h, jnp.ones_like(h)])
    return jnp.asarray(_TABLE, basis.dtype) @ basis
