"""Load-dependent power loss of the mesh."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import MeshCycle
from ..geometry import GearPair, path_of_contact
from ..numerics import over_batch, safe_divide

Scalar = Float[Array, ""]


@over_batch
def loss_factor(cycle: MeshCycle) -> Scalar:
    """Loss factor H_VL of the loaded mesh: loss power = input power * friction coefficient * H_VL.

        H_VL = 1 / (p_et b) int int (f_N b / F_bt) (v_g / v_tb) dx dy

    with the line load f_N of this cycle, the sliding speed v_g and the speed of the base circles v_tb. Corner contact
    counts with the sliding speed at its path position. Zero at zero torque.

    References:
        A. Wimmer, Lastverluste von Stirnradverzahnungen, TU Muenchen 2006.
    """
    contact = cycle.kinematics.path_of_contact
    # sliding over base-circle speed: v_g / v_tb = |s| (1 / r_b1 + 1 / r_b2)
    sliding = jnp.abs(cycle.kinematics.path) * (1 / contact.pinion_base_radius + 1 / contact.wheel_base_radius)
    return safe_divide(jnp.sum(jnp.mean(cycle.pair_force * sliding, axis=-1)), cycle.force)


def ohlendorf_loss_factor(pair: GearPair) -> Scalar:
    """Loss factor H_v of the geometry alone, for contact ratios from 1 to 2.

        H_v = pi (u + 1) / (z1 u) (1 - eps + eps1^2 + eps2^2)

    References:
        H. Ohlendorf, Verlustleistung und Erwaermung von Stirnraedern, TH Muenchen 1958; G. Niemann, H. Winter,
        Maschinenelemente II.
    """
    path = path_of_contact(pair)
    recess, approach = path.end / path.base_pitch, -path.start / path.base_pitch
    ratio = pair.gear_ratio
    share = 1 - (recess + approach) + recess**2 + approach**2
    return jnp.pi * (ratio + 1) / (pair.pinion.teeth * ratio) * share
