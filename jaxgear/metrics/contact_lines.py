"""Quantities of oblique contact lines: their length, axial force, tilting and shuttling moments.

References:
    ISO 21771 for the ratios; the lengths are those of ISO 6336-2 and of G. Niemann, H. Winter, Maschinenelemente II.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import MeshCycle
from ..geometry import GearPair, path_of_contact
from ..numerics import over_batch, safe_divide

Scalar = Float[Array, ""]
Curve = Float[Array, " positions"]


@over_batch
def total_contact_ratio(cycle: MeshCycle) -> Scalar:
    """Total contact ratio eps_gamma = eps_alpha + eps_beta, sum of transverse contact ratio and overlap ratio."""
    return cycle.kinematics.path_of_contact.contact_ratio + cycle.kinematics.pair.overlap_ratio


def contact_line_lengths(pair: GearPair) -> tuple[Scalar, Scalar]:
    """Least and mean total length of the theoretical contact lines of all pairs over the cycle [mm].

        mean   b eps_alpha / cos(beta_b)
        least  the mean less min(n_a n_b, (1 - n_a) (1 - n_b)) / eps_beta b / cos(beta_b)

    with the fractional parts n_a of the transverse contact ratio and n_b of the overlap ratio. For spur gears the least
    length is the face width times the integer part of the contact ratio.
    """
    transverse, overlap = path_of_contact(pair).contact_ratio, pair.overlap_ratio
    beyond, over = transverse - jnp.floor(transverse), overlap - jnp.floor(overlap)
    share = jnp.where(overlap < 1, 1.0, safe_divide(over, overlap))
    less = jnp.minimum(beyond * share, safe_divide((1 - beyond) * (1 - over), overlap, default=1.0))
    along = pair.face_width / jnp.cos(pair.pinion.base_helix_angle)
    return along * (transverse - less), along * transverse


@over_batch
def axial_force(cycle: MeshCycle) -> Scalar:
    """Axial force F_bt tan(abs(beta_b)) of the mesh [N], in opposite directions on pinion and wheel."""
    return cycle.force * jnp.abs(cycle.kinematics.pair.path_slope)


@over_batch
def tilting_moments(cycle: MeshCycle) -> tuple[Scalar, Scalar]:
    """Tilting moments F_ax r_w of the axial force on pinion and wheel, with their working pitch radii [N m]."""
    pair, force = cycle.kinematics.pair, 1e-3 * axial_force(cycle)
    secant = 1 / jnp.cos(pair.working_pressure_angle)
    return force * pair.pinion.base_radius * secant, force * pair.wheel.base_radius * secant


@over_batch
def shuttling_moment(cycle: MeshCycle) -> Curve:
    """Moment of the forces on the line of action about the middle of the common face, sum of q y dy [N m].

    It is positive for a load at positive face coordinates. For helical gears it alternates while the contact lines pass
    over the face, and excites the bearings.
    """
    of = cycle.kinematics
    return 1e-3 * jnp.einsum("psn,s->n", cycle.line_load, of.face_coordinate * of.slice_width)
