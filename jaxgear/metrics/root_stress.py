"""Tooth-root stress after ISO 6336-3 Method B, and at every contact under the load that the contact analysis finds.

The standard evaluates the form factor Y_F and the stress correction Y_S at the outer point of single contact with the
full load, and its strengths belong to that stress. Under load contact goes on beyond the path of contact, so that a
second pair shares the load at that point: the largest local stress is a few percent smaller. Its critical section (30
degree tangent) is the same, and the lever arm follows the contact along the flank.

References:
    ISO 6336-3:2006 clause 6, with the sign of the last term of h_Fe as in the 2019 edition (the 2006 print drops a
    minus).
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import MeshCycle, Side
from ..geometry import Gear, GearPair, path_of_contact
from ..geometry.involute import load_angle
from ..geometry.outline import rack_tip
from ..numerics import Checked, over_batch, result
from .face_load import over_several_slices, root_face_load_factor

Real = Float[Array, "..."]
Scalar = Float[Array, ""]
Load = Float[Array, "pairs slices positions"]

_SECTION_STEPS = 8  # fixed-point steps of ISO 6336-3 for theta; it gains two digits per step
_NOTCH_LIMITS = (1.0, 8.0)  # validity of Y_S in the notch parameter q_s
# Contacts near the root load the section with hardly any lever arm; the formula needs a positive one [x module].
_SHORTEST_ARM = 0.05


class CriticalSection(Checked):
    """Root section at the 30 degree tangent.

    Attributes:
        chord: s_Fn.
        fillet_radius: rho_F.
        depth: distance of the section from the gear centre.
    """

    chord: Scalar = result("mm")
    fillet_radius: Scalar = result("mm")
    depth: Scalar = result("mm")


class RootFactors(Checked):
    """Form factor Y_F and stress correction factor Y_S at given load points."""

    form: Real = result()
    correction: Real = result()
    lever_arm: Real = result("mm")


class RootStress(Checked):
    """Nominal local root stress of both gears, shape (pairs, slices, positions)."""

    pinion: Load = result("MPa")
    wheel: Load = result("MPa")


class NominalRootStress(Checked):
    """Tooth-root stress of both gears by the standard."""

    pinion: Scalar = result("MPa")
    wheel: Scalar = result("MPa")


def critical_section(gear: Gear) -> CriticalSection:
    """Section of the generated root at the 30 degree tangent (external spur gear)."""
    m, z = gear.module, gear.teeth
    offset, below, radius = (length / m for length in rack_tip(gear))
    g, h = -below, 2 / z * offset - jnp.pi / 3
    theta = jax.lax.fori_loop(0, _SECTION_STEPS, lambda _, t: 2 * g / z * jnp.tan(t) - h, jnp.full_like(h, jnp.pi / 6))
    reach = g / jnp.cos(theta) - radius
    chord = z * jnp.sin(jnp.pi / 3 - theta) + jnp.sqrt(3.0) * reach
    fillet = radius + 2 * g**2 / (jnp.cos(theta) * (z * jnp.cos(theta) ** 2 - 2 * g))
    depth = 0.5 * (z * jnp.cos(jnp.pi / 3 - theta) + reach)
    return CriticalSection(chord * m, fillet * m, depth * m)


def root_factors(gear: Gear, roll_length: Real) -> RootFactors:
    """Y_F and Y_S for a load at a roll length [mm] of the flank."""
    section, m = critical_section(gear), gear.module
    cosine = jnp.cos(load_angle(gear, roll_length))
    # the lever arm ends where the load line crosses the tooth centreline
    arm = jnp.maximum(gear.base_radius / cosine - section.depth, _SHORTEST_ARM * m)
    alpha = jnp.deg2rad(gear.pressure_angle)
    form = 6 * (arm / m) * cosine / ((section.chord / m) ** 2 * jnp.cos(alpha))
    slenderness = section.chord / arm
    notch = jnp.clip(section.chord / (2 * section.fillet_radius), *_NOTCH_LIMITS)
    correction = (1.2 + 0.13 * slenderness) * notch ** (1 / (1.21 + 2.3 / slenderness))
    return RootFactors(form, correction, arm)


def root_stress_per_load(gear: Gear, roll_length: Real) -> Real:
    """cos(alpha) / m Y_F Y_S: root stress by a line load along the line of action at a roll length [MPa mm/N]."""
    factors = root_factors(gear, roll_length)
    return factors.form * factors.correction * jnp.cos(jnp.deg2rad(gear.pressure_angle)) / gear.module


def single_contact_root_stress(pair: GearPair) -> tuple[Scalar, Scalar]:
    """`root_stress_per_load` of pinion and wheel at their outer points of single contact, for contact ratios to 2."""
    path = path_of_contact(pair)
    rolls = path.pinion_roll_length(path.outer_single), path.wheel_roll_length(path.inner_single)
    pinion, wheel = (root_stress_per_load(gear, roll) for gear, roll in zip(pair.gears, rolls))
    return pinion, wheel


@over_batch
def nominal_root_stress(cycle: MeshCycle) -> NominalRootStress:
    """sigma_F = F_t / (b m) Y_F Y_S K_Fbeta of both gears [MPa], for contact ratios from 1 to 2.

    The whole load is at the outer point of single contact, whatever the contact analysis says of its sharing.
    K_Fbeta is `root_face_load_factor`, 1 on one slice. Factors of application and dynamics belong into the torque.
    """
    pair = cycle.kinematics.pair
    line_load = cycle.force / pair.face_width * over_several_slices(root_face_load_factor, cycle)
    return NominalRootStress(*(line_load * share for share in single_contact_root_stress(pair)))


@over_batch
def root_stress(cycle: MeshCycle) -> RootStress:
    """Local root stress f_t / m Y_F Y_S of both gears at every contact [MPa], f_t tangential line load there."""

    def stress(side: Side) -> Load:
        return cycle.line_load * root_stress_per_load(side.gear, side.contact_roll_length)[:, None]

    return RootStress(*(stress(side) for side in cycle.sides))
