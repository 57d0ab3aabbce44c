"""Contact of a tip corner with the mate's involute, before and after the theoretical path of contact.

A pair that is a distance x outside the path of contact touches with the tip corner of one gear on the flank of the
other. With the corner's gear in its nominal position, the gap is the arc of the mate's base circle by which the mate
has to turn until its involute passes through the corner. In the frame of the line of action this is a closed form: no
root, no table.

    Q = corner, at (du, dv) from the end of the path,  rho_Q = tangent length from Q to the mate's base circle,
    S = x + rho_Q - rho_mate + r_b,mate tau,  tau = turn of that tangent away from the line of action.

To second order S = x^2 rho_tip C / (2 rho_mate r_b,tip^2) with C = rho_tip + rho_mate, so the gap joins the path with
zero slope. All differences are formed without cancellation, so single precision keeps 1e-4 um where contact is
possible.

References:
    The geometry is that of R. G. Munro, L. Morrish, D. Palmer, Proc. IMechE C 213 (1999) 389-400; the closed form here
    is derived from the involute's generation.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

Real = Float[Array, "..."]

# Beyond this many base pitches outside the path the gap is hundreds of um; it goes on along its tangent there.
REACH = 0.4


def corner_gap(
    x: Real, tip_roll_length: Real, tip_base_radius: Real, mate_roll_length: Real, mate_base_radius: Real
) -> tuple[Real, Real]:
    """Gap and contact point of a tip corner outside the path of contact.

    Args:
        x: distance outside the path along the line of action [mm], not negative.
        tip_roll_length: roll length of the corner on its gear [mm]; this and what follows one number, or one for every
            x.
        tip_base_radius: base radius of that gear [mm].
        mate_roll_length: roll length of the mate at the end of the path [mm].
        mate_base_radius: base radius of the mate [mm].

    Returns:
        the gap [um] and the roll length of the touched point of the mate [mm].
    """
    angle = x / tip_base_radius
    sine, versine = jnp.sin(angle), 2 * jnp.sin(0.5 * angle) ** 2
    du = versine * tip_roll_length - sine * tip_base_radius
    dv = sine * tip_roll_length + versine * tip_base_radius
    # squared tangent length from the corner to the mate's base circle, minus its value at the end of the path
    change = (2 * mate_roll_length + du) * du + (2 * mate_base_radius + dv) * dv
    floor = (1e-3 * mate_base_radius) ** 2
    squared = jnp.maximum(mate_roll_length**2 + change, floor)
    tangent = jnp.sqrt(squared)
    growth = (squared - mate_roll_length**2) / (tangent + mate_roll_length)
    cross = mate_base_radius * (du - growth) - dv * tangent
    dot = (mate_roll_length + du) * tangent + (mate_base_radius + dv) * mate_base_radius
    gap = x + growth + mate_base_radius * jnp.arctan2(cross, dot)
    return 1e3 * gap, tangent
