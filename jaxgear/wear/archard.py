"""Archard's law of wear, observed at single points of the flanks.

While one pair of teeth passes through the mesh, every point of flank i is in contact over the distance 2 a of the
rolling, slides past its mate by 2 a |u1 - u2| / u_i, and wears by

    dh_i = k_w p 2 a |u1 - u2| / u_i = k_w q |u1 - u2| / u_i,

p the mean pressure, q the line load, u the rolling speeds of the flanks: the half width of the contact drops out.

References:
    J. F. Archard, J. Appl. Phys. 24 (1953) 981-988, doi 10.1063/1.1721448.
    A. Flodin, S. Andersson, Simulation of mild wear in spur gears, Wear 207 (1997) 16-23.
"""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import MeshCycle
from ..geometry import PathOfContact
from ..numerics import check, program, real
from .deposit import Deposit

Load = Float[Array, "pairs slices positions"]

# A coefficient of 1 m2/N makes 1e6 mm2/N, and these times N/mm are 1e3 um each.
UM_PER_LOAD = 1e9


def specific_sliding(contact: PathOfContact, path: Any) -> tuple[Any, Any]:
    """Sliding over rolling |u1 - u2| / u_i of pinion and wheel at a path position [mm], of its shape.

    Beyond the path of contact it is that at its end: there a tip corner slides over the mate's flank.
    """
    path = jnp.clip(path, contact.start, contact.end)
    sliding = jnp.abs(path) * (1 / contact.pinion_base_radius + 1 / contact.wheel_base_radius)
    pinion = contact.pinion_roll_length(path) / contact.pinion_base_radius
    wheel = contact.wheel_roll_length(path) / contact.wheel_base_radius
    return sliding / pinion, sliding / wheel


def passage_depth(cycle: MeshCycle, coefficient: Any) -> tuple[Load, Load]:
    """Wear depth that one passage of a pair leaves where every contact of a cycle is, on pinion and wheel [um].

    Args:
        cycle: solved mesh cycle, without batch axes.
        coefficient: of wear [m2/N], a number, or one for every contact, shape (pairs, slices, positions).

    Returns:
        k_w q |u1 - u2| / u_i of both gears, shape (pairs, slices, positions) each.

    Raises:
        ValueError: for a negative coefficient.
    """
    coefficient = real(coefficient).astype(cycle.line_load.dtype)
    check("passage_depth", "coefficient", coefficient, "m2/N", low=0.0)
    pinion, wheel = specific_sliding(cycle.kinematics.path_of_contact, cycle.kinematics.path)
    worn = UM_PER_LOAD * coefficient * cycle.line_load
    return worn * pinion[:, None], worn * wheel[:, None]


@program
def worn(line_load: Load, coefficient: Any, place: Deposit) -> Float[Array, "gears parts slices points"]:
    """Wear depth that one passage leaves on the grids of both flanks [um], on the flank and by tip corners.

    Args:
        line_load: [N/mm], shape (pairs, slices, positions).
        coefficient: of wear [m2/N]; of every gear and contact, to be broadcast to (gears, pairs, slices, positions).
        place: where contacts wear the flanks.
    """
    worn = jnp.broadcast_to(UM_PER_LOAD * coefficient * line_load[None], (2, *line_load.shape))
    left = place.shares(line_load)[:, None] * worn[None]
    return jnp.einsum("ugkxij,ugisj->gksx", place.spreads, left) / place.arc[:, None, None]
