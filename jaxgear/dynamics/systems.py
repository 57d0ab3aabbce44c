"""Oscillators of a gear pair: torsional, two gears, two gears on flexible bearings."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..geometry import Gear, GearPair
from ..numerics import Given, Numbers, check, concrete, real
from .force import AbstractMeshForce
from .oscillator import NEWTON, Excitation, Oscillator

Scalar = Float[Array, ""]

_MM = 1e-3  # in m
DIRECTIONS = 2, 3  # directions of bearing stiffness: along and across the line of action, and along the axis
_BEARING = "(2, 2, 2) or (2, 3, 3): of pinion and wheel, along, across[, axial]"


def inertia_of(gear: Gear) -> Scalar:
    """Moment of inertia of a gear body about its axis [kg m2]: a ring from the bore to the reference pitch circle.

    It uses face width and density of the gear; a gear without `bore_diameter` is a solid disc, and a ring gear reaches
    from the pitch circle to its outer circle. Oscillators accept other inertias as an argument.
    """
    outer, inner = _radii(gear)
    return jnp.pi / 2 * gear.material.density * gear.face_width * _MM * (outer**4 - inner**4)


def mass_of(gear: Gear) -> Scalar:
    """Mass of the same body [kg]."""
    outer, inner = _radii(gear)
    return jnp.pi * gear.material.density * gear.face_width * _MM * (outer**2 - inner**2)


def _radii(gear: Gear) -> tuple[Scalar, Scalar]:
    """Outer and inner radius of the gear body [m]."""
    if gear.is_internal:
        return jnp.abs(gear.bore_radius) * _MM, jnp.abs(gear.pitch_radius) * _MM
    inner = jnp.zeros_like(gear.module) if gear.bore_diameter is None else gear.bore_radius
    return gear.pitch_radius * _MM, inner * _MM


def equivalent_mass(pair: GearPair, inertias: Numbers | None = None) -> Scalar:
    """Mass on the line of action of two gears that turn against each other [kg].

    1 / m = r_b1^2 / I_1 + r_b2^2 / I_2

    Args:
        pair: pinion and wheel.
        inertias: moments of inertia of pinion and wheel and of the parts that turn with them [kg m2]; None for
            `inertia_of` the gears.

    Raises:
        ValueError: in one line for inertias that are not two positive numbers.
    """
    return 1 / jnp.sum(1 / _masses(pair, inertias))


def torsional(
    mesh_force: AbstractMeshForce,
    pair: GearPair,
    torque: Given,
    *,
    damping_ratio: Given | None = None,
    damping: Given | None = None,
    inertias: Numbers | None = None,
    mean_stiffness: Given | None = None,
    excitation: Excitation | None = None,
) -> Oscillator:
    """Torsional oscillator of two gears with one coordinate, the DTE q on the line of action [um].

    m q'' + c q' + F(phase, q) = T_1 / r_b1

    Args:
        mesh_force: mesh force.
        pair: pinion and wheel.
        torque: torque on the pinion [N m].
        damping_ratio: damping ratio at the mean stiffness, c = 2 ratio sqrt(k m).
        damping: viscous damping c [N s/um], in place of the ratio. Damping acts with and without contact.
        inertias: moments of inertia of pinion and wheel [kg m2]; None for `inertia_of` the gears.
        mean_stiffness: stiffness k for the damping ratio [N/um]; None for the `mean_tangent_stiffness` of the mesh
            force under the static load.
        excitation: external excitation, whose displacement is subtracted from the DTE; None for none.

    Raises:
        ValueError: in one line for both or neither of damping and damping_ratio, or a number outside its range.
    """
    mass, force = equivalent_mass(pair, inertias), _force(pair, torque)
    c = _damping(mesh_force, mass, force, damping_ratio, damping, mean_stiffness)
    one = jnp.ones((1,), mass.dtype)
    return Oscillator(
        mesh_force=mesh_force, mass=mass * one, direction=one, load=force * one, mesh_damping=c, excitation=excitation
    )


def two_gears(
    mesh_force: AbstractMeshForce,
    pair: GearPair,
    torque: Given,
    *,
    damping_ratio: Given | None = None,
    damping: Given | None = None,
    inertias: Numbers | None = None,
    mean_stiffness: Given | None = None,
    excitation: Excitation | None = None,
) -> Oscillator:
    """Pinion and wheel as two coordinates, r_b1 theta_1 and r_b2 theta_2 [um], without springs to ground.

    I_1 / r_b1^2 x_1'' + F + c q' = T_1 / r_b1,   I_2 / r_b2^2 x_2'' - F - c q' = -T_1 / r_b1,   q = x_1 - x_2

    The torque on the wheel balances the torque on the pinion. Arguments and errors are those of `torsional`. As a
    component of a larger model, parts joined to the gears add to `load`, `stiffness` and `damping`, or to the value of
    the vector field.
    """
    masses, force = _masses(pair, inertias), _force(pair, torque)
    c = _damping(mesh_force, 1 / jnp.sum(1 / masses), force, damping_ratio, damping, mean_stiffness)
    direction = jnp.asarray([1.0, -1.0], masses.dtype)
    return Oscillator(
        mesh_force=mesh_force,
        mass=masses,
        direction=direction,
        load=force * direction,
        mesh_damping=c,
        excitation=excitation,
    )


def on_bearings(
    mesh_force: AbstractMeshForce,
    pair: GearPair,
    torque: Given,
    *,
    bearing_stiffness: Numbers,
    bearing_damping: Numbers | None = None,
    masses: Numbers | None = None,
    damping_ratio: Given | None = None,
    damping: Given | None = None,
    inertias: Numbers | None = None,
    mean_stiffness: Given | None = None,
    excitation: Excitation | None = None,
) -> Oscillator:
    """Two gears whose centres move on flexible bearings: five coordinates [um], or seven with axial motion.

    The coordinates are, in this order: the relative rotation u = r_b1 theta_1 - r_b2 theta_2; the displacement of the
    centre of the pinion along the line of action (positive in the direction of its force on the wheel), across it, and
    along its axis (positive like face coordinates); the displacements of the centre of the wheel. Axial displacements
    of helical gears change the DTE,

        q = u + along_1 - along_2 - tan(beta_b) (axial_1 - axial_2)

    with the base helix angle of the pinion, positive for a right hand. The bearings carry the mesh force F and the
    axial force F tan(beta_b): at rest the pinion is displaced by -F / k_1 along the line of action and by
    F tan(beta_b) / k_1 along its axis, the wheel in the opposite directions. The gears do not tilt: the moment of the
    axial force about their centres has a rigid support.

    Args:
        mesh_force, pair, torque, damping_ratio, damping, inertias, mean_stiffness, excitation: as for `torsional`.
        bearing_stiffness: symmetric stiffness matrices of the supports of pinion and wheel [N/um]: in (along, across),
            shape (2, 2, 2), with rigid axial supports; or in (along, across, axial), shape (2, 3, 3).
        bearing_damping: damping matrices of the supports [N s/um], same shape; None for none.
        masses: masses of pinion and wheel that move on the bearings [kg], shape (2,); None for the gear bodies of
            `inertia_of`.

    Raises:
        ValueError: in one line as for `torsional`, and for a stiffness that is not symmetric or not positive definite.
    """
    mass, force = equivalent_mass(pair, inertias), _force(pair, torque)
    c = _damping(mesh_force, mass, force, damping_ratio, damping, mean_stiffness)
    bodies = _pair_of_numbers("masses", "kg", (mass_of(pair.pinion), mass_of(pair.wheel)) if masses is None else masses)
    held = _on_ground("bearing_stiffness", "N/um", bearing_stiffness, stiff=True)
    directions = len(held) // 2
    damped = None
    if bearing_damping is not None:
        damped = _on_ground("bearing_damping", "N s/um", bearing_damping, stiff=False)
        if len(damped) != len(held):
            raise ValueError(
                f"bearing_damping is of {len(damped) // 2} directions, must be of {directions} as bearing_stiffness"
            )
    one = jnp.ones((1,), mass.dtype)
    centre = jnp.concatenate([one, 0 * one, -pair.path_slope[None]])[:directions]
    return Oscillator(
        mesh_force=mesh_force,
        mass=jnp.concatenate([mass[None], jnp.repeat(bodies, directions)]),
        direction=jnp.concatenate([one, centre, -centre]),
        load=force * jnp.zeros((1 + 2 * directions,), mass.dtype).at[0].set(1.0),
        mesh_damping=c,
        stiffness=_beside_rotation(held),
        damping=None if damped is None else _beside_rotation(damped),
        excitation=excitation,
    )


def _masses(pair: GearPair, inertias) -> Float[Array, "2"]:
    """Masses of pinion and wheel on the line of action [kg]."""
    given = (inertia_of(pair.pinion), inertia_of(pair.wheel)) if inertias is None else inertias
    radii = jnp.stack([pair.pinion.base_radius, pair.wheel.base_radius]) * _MM
    return _pair_of_numbers("inertias", "kg m2", given) / radii**2


def _pair_of_numbers(name: str, unit: str, given) -> Float[Array, "2"]:
    if isinstance(given, tuple | list) and any(isinstance(part, jax.Array) for part in given):
        given = jnp.stack([real(part) for part in given])
    numbers = real(given)
    if numbers.shape != (2,):
        raise ValueError(f"{name} has shape {numbers.shape}, must be two numbers, of pinion and wheel")
    check(name, numbers, unit, low=0.0, open_low=True)
    return numbers


def _force(pair: GearPair, torque) -> Scalar:
    """Static force on the line of action [N]."""
    torque = real(torque)
    if torque.ndim:
        raise ValueError(f"torque has shape {torque.shape}, must be a single number; make many with jax.vmap")
    check("torque", torque, "N m", low=0.0, open_low=True)
    return torque / (pair.pinion.base_radius * _MM)


def _damping(mesh_force, mass, force, ratio, damping, stiffness) -> Scalar:
    """Viscous damping of the DTE [N s/um]."""
    if (ratio is None) == (damping is None):
        raise ValueError("give either damping_ratio or damping [N s/um]")
    if ratio is None:
        if stiffness is not None:
            raise ValueError("mean_stiffness belongs to damping_ratio, damping is given")
        damping = real(damping)
        check("damping", damping, "N s/um", low=0.0)
        return damping
    ratio = real(ratio)
    check("damping_ratio", ratio, "", low=0.0, high=1.0)
    stiffness = mesh_force.mean_tangent_stiffness(force) if stiffness is None else real(stiffness)
    check("mean_stiffness", stiffness, "N/um", low=0.0, open_low=True)
    # stiffness and damping are per um, the mass is that of metres
    return 2 * ratio * jnp.sqrt(stiffness * mass / NEWTON)


def _on_ground(name: str, unit: str, given: Any, *, stiff: bool) -> Float[Array, "centres centres"]:
    """Block matrix of the bearings of pinion and wheel over the coordinates of both centres."""
    given = real(given)
    if given.shape not in [(2, count, count) for count in DIRECTIONS]:
        raise ValueError(f"{name} has shape {given.shape}, must be {_BEARING}")
    check(name, given, unit)
    known = concrete(given)
    if known is not None:
        if (np.abs(known - known.swapaxes(1, 2)) > 1e-9 * np.max(np.abs(known))).any():
            raise ValueError(f"{name} must be symmetric")
        least = float(np.min(np.linalg.eigvalsh(known)))
        if least < 0 or (stiff and least == 0):
            limit = "greater than 0" if stiff else "at least 0"
            raise ValueError(f"{name} has an eigenvalue of {least:g} {unit}, must be {limit} {unit}")
    return jax.scipy.linalg.block_diag(*given)


def _beside_rotation(of_centres: Float[Array, "centres centres"]) -> Float[Array, "coordinates coordinates"]:
    """Matrix with a leading zero row and column for the relative rotation, which has no spring to ground."""
    return jnp.pad(of_centres, ((1, 0), (1, 0)))
