"""The dimensionless model of a gear pair, from its mesh under load."""

from typing import Literal

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import MeshCycle
from ..dynamics.force import AbstractMeshForce, DeadZone
from ..metrics import harmonics, secant_stiffness
from ..numerics import Checked, Given, check, real, result, safe_sqrt
from .model import DimensionlessModel

Scalar = Float[Array, ""]

_MICRO = 1e-6  # kg um/s^2 are 1e-6 N


class Identified(Checked):
    """Dimensionless model of a gear pair, and the scales between both.

    Attributes:
        model: x = 1 + (transmission error - mean unloaded one) / b on the drive flanks.
        half_clearance: b, half of the backlash on the line of action.
        mean_stiffness: k_mean.
        natural_frequency: omega_0 / (2 pi); the mesh frequency is Omega times this.
        mass: equivalent mass m on the line of action [kg].
    """

    model: DimensionlessModel
    half_clearance: Scalar = result("um")
    mean_stiffness: Scalar = result("N/um")
    natural_frequency: Scalar = result("Hz")
    mass: Scalar = result("kg")


def from_mesh(
    cycle: MeshCycle,
    *,
    mass: Given,
    damping_ratio: Given | None = None,
    damping: Given | None = None,
    half_clearance: Given | None = None,
    torque_fluctuation: Given = 0.0,
    torque_order: Given = 1.0,
    orders: int = 5,
    stiffness: Literal["secant", "tangent"] = "secant",
    clearance: AbstractMeshForce | None = None,
) -> Identified:
    """Identify omega_0, zeta, B_j and phi_j, F_m, F_aT and F_ah of a mesh.

    F_m = F / (b k_mean), B_j and phi_j from the harmonics of the stiffness over its mean, F_ah from the harmonics of
    the unloaded transmission error over b. Both contain the modification of the flanks of the cycle: the model needs no
    relief. A model of unmodified flanks can get a relief by `with_relief`.

    Args:
        cycle: mesh cycle of one design under one torque above 0.
        mass: equivalent mass on the line of action [kg], m = I_1 I_2 / (I_1 r_b2^2 + I_2 r_b1^2).
        damping_ratio: damping ratio zeta; None if `damping` is given.
        damping: damping of the DTE [N s/um], zeta = c / (2 sqrt(m k_mean)); None if `damping_ratio` is given.
        half_clearance: half clearance b on the line of action [um]; None for half of the backlash.
        torque_fluctuation: F_aT over F_m, at one order.
        torque_order: order of the torque fluctuation, as a multiple of the mesh frequency.
        orders: number of harmonics.
        stiffness: "secant" reproduces the static transmission error at this torque, "tangent" small vibrations.
        clearance: clearance function f; None for the dead zone. A `PolynomialClearance` is only valid in its range.

    Raises:
        ValueError: in one line, for no load, no backlash or not exactly one damping.
    """
    if (damping_ratio is None) == (damping is None):
        raise ValueError("give either damping_ratio or damping [N s/um]")
    if stiffness not in ("secant", "tangent"):
        raise ValueError(f'stiffness = {stiffness!r} must be "secant" or "tangent"')
    half = 0.5 * cycle.margins.backlash if half_clearance is None else real(half_clearance)
    check("half_clearance", half, "um", low=0.0, open_low=True)
    check("mass", mass, "kg", low=0.0, open_low=True)
    check("torque", cycle.torque, "N m", low=0.0, open_low=True)
    curve = secant_stiffness(cycle) if stiffness == "secant" else cycle.tangent_stiffness
    mass, mean = real(mass), jnp.mean(curve)
    # the phase 0 of the mesh is the time 0 of the model, with which the torque fluctuates
    parametric, unloaded = (
        harmonics(each, orders, first_phase=cycle.kinematics.first_phase)
        for each in (curve / mean, cycle.unloaded_transmission_error / half)
    )
    if damping is None:
        assert damping_ratio is not None  # one of both is given
        ratio = real(damping_ratio)
    else:
        ratio = 0.5 * real(damping) / safe_sqrt(mass * _MICRO * mean)
    load = cycle.force / (half * mean)
    order = jnp.arange(1, orders + 1, dtype=mean.dtype)
    # F_aT and F_ah share the list of orders; the fluctuation comes first
    first = jnp.zeros(orders + 1, mean.dtype).at[0].set(real(torque_fluctuation) * load)
    model = DimensionlessModel(
        load=load,
        damping_ratio=ratio,
        stiffness_harmonics=parametric.amplitude,
        stiffness_angles=jnp.deg2rad(parametric.phase),
        orders=jnp.concatenate([real(torque_order)[None], order]),
        torque=first,
        torque_angles=jnp.zeros_like(first),
        displacement=jnp.concatenate([jnp.zeros(1, mean.dtype), unloaded.amplitude]),
        displacement_angles=jnp.concatenate([jnp.zeros(1, mean.dtype), jnp.deg2rad(unloaded.phase)]),
        clearance=DeadZone() if clearance is None else clearance,
    )
    natural = safe_sqrt(mean / (mass * _MICRO)) / (2 * jnp.pi)
    return Identified(model, half, mean, natural, mass)
