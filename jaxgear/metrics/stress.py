"""Contact stress and tooth-root stress after ISO 6336, factor by factor and at every contact.

The pressure of the contact analysis is another number: the standard's contact ratio factor stands for the sharing of
the load, and strengths are measured by the same formula.

The standard evaluates the form factor Y_F and the stress correction Y_S at the outer point of single contact with the
full load, and its strengths belong to that stress. Under load contact goes on beyond the path of contact, so that a
second pair shares the load at that point: the largest local stress is a few percent smaller. Its critical section (30
degree tangent) is the same, and the lever arm follows the contact along the flank.

References:
    ISO 6336-3:2006 clause 6, with the sign of the last term of h_Fe as in the 2019 edition (the 2006 print drops a
    minus); of helical gears with its factor Y_beta. The edition of 2019 divides that by cos(beta)^3 and multiplies the
    form factor by a share of the load f_eps. ISO 6336-2:2006 with Z_beta of its corrigendum of 2008.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..compliance.plane import combined_modulus
from ..contact import MeshCycle, Side
from ..geometry import Gear, GearPair, PathOfContact
from ..geometry.gear import virtual_gear
from ..geometry.involute import load_angle
from ..geometry.outline import Curves, curves, rack_tip
from ..numerics import Checked, bracketed_root, over_batch, result, safe_sqrt
from .load_distribution import face_load_factor, over_several_slices, root_face_load_factor

Scalar = Float[Array, ""]


class ContactStress(Checked):
    """Nominal contact stress of both gears."""

    pinion: Scalar = result("MPa")
    wheel: Scalar = result("MPa")


@over_batch
def nominal_contact_stress(cycle: MeshCycle) -> ContactStress:
    """sigma_H = Z sigma_H0 sqrt(K_Hbeta) of both gears [MPa], for contact ratios from 1 to 2.

        sigma_H0 = Z_H Z_E Z_eps Z_beta sqrt(F_t / (d_1 b) (u + 1) / u)
        Z_eps = sqrt((4 - eps_alpha) / 3 (1 - eps_beta) + eps_beta / eps_alpha), eps_beta at most 1
        Z_beta = 1 / sqrt(cos(beta))

    which of spur gears is Z_eps times Hertz's pressure of one pair at the pitch point, in plane strain. Z is Z_B of the
    pinion and Z_D of the wheel: from the pitch point to the inner and outer point of single contact, where that is the
    worse place; between spur gears and an overlap ratio of 1, where it is 1, linear in the overlap ratio. K_Hbeta is
    `face_load_factor`, 1 on one slice. Factors of application and dynamics belong into the torque.

    References:
        ISO 6336-2, clauses 6 and 7 (nominal contact stress, zone factor, single pair contact factors).
    """
    pair = cycle.kinematics.pair
    line_load = cycle.force / pair.face_width * over_several_slices(face_load_factor, cycle)
    return ContactStress(
        *(safe_sqrt(line_load * square) for square in nominal_stress_squares(pair, cycle.kinematics.path_of_contact))
    )


def nominal_stress_squares(pair: GearPair, path: PathOfContact) -> tuple[Scalar, Scalar]:
    """Squares of `nominal_contact_stress` per line load along the line of action, pinion and wheel [MPa^2 mm/N]."""
    factors = contact_factor_squares(pair, path)
    normal = factors.contact_ratio * factors.elasticity * factors.helix_angle * jnp.cos(pair.pinion.base_helix_angle)
    at_pitch = normal / path.reduced_radius(jnp.zeros_like(path.end))
    return at_pitch * factors.pinion_single_pair, at_pitch * factors.wheel_single_pair


class ContactFactors(NamedTuple):
    """Squares of factors of ISO 6336-2.

    Attributes:
        zone: Z_H^2.
        elasticity: Z_E^2 [MPa].
        contact_ratio: Z_eps^2.
        helix_angle: Z_beta^2.
        pinion_single_pair, wheel_single_pair: Z_B^2 and Z_D^2, at least 1.
    """

    zone: Scalar
    elasticity: Scalar
    contact_ratio: Scalar
    helix_angle: Scalar
    pinion_single_pair: Scalar
    wheel_single_pair: Scalar


def contact_factor_squares(pair: GearPair, path: PathOfContact) -> ContactFactors:
    """Squares of the factors of `nominal_contact_stress` that are independent of the load."""
    overlap = jnp.minimum(pair.overlap_ratio, 1.0)
    pitch = path.reduced_radius(jnp.zeros_like(path.end))
    inner, outer = (pitch / path.reduced_radius(single) for single in (path.inner_single, path.outer_single))
    inner, outer = (jnp.maximum(single, 1.0) for single in (inner, outer))
    if pair.pinion.helix_angle is not None:
        inner, outer = ((1 + (1 - overlap) * (jnp.sqrt(square) - 1)) ** 2 for square in (inner, outer))
    cosine = jnp.cos(pair.pinion.transverse_pressure_angle)
    return ContactFactors(
        zone=2 * jnp.cos(pair.pinion.base_helix_angle) / (cosine**2 * jnp.tan(pair.working_pressure_angle)),
        elasticity=combined_modulus(pair.pinion.material, pair.wheel.material, "strain") / jnp.pi,
        contact_ratio=contact_ratio_square(path.contact_ratio, overlap),
        helix_angle=1 / pair.pinion.helix_cosine,
        pinion_single_pair=inner,
        wheel_single_pair=outer,
    )


def contact_ratio_square(contact_ratio: Scalar, overlap_ratio: Scalar) -> Scalar:
    """Z_eps^2 = (4 - eps_alpha) / 3 (1 - eps_beta) + eps_beta / eps_alpha, eps_beta at most 1."""
    overlap = jnp.minimum(overlap_ratio, 1.0)
    return jnp.maximum(4 - contact_ratio, 0.0) / 3 * (1 - overlap) + overlap / contact_ratio


Real = Float[Array, "..."]
Load = Float[Array, "pairs slices positions"]

# inclination of the tangent at the critical section to the centreline, of external and of ring gears [rad]
_TANGENT, _RING_TANGENT = jnp.pi / 6, jnp.pi / 3
_SECTION_STEPS = 8  # fixed-point steps of ISO 6336-3 for theta; it gains two digits per step
NOTCH_LIMITS = (1.0, 8.0)  # validity of Y_S in the notch parameter q_s
_OBLIQUE, _MOST_OBLIQUE = 120.0, 30.0  # deg; Y_beta = 1 - eps_beta beta / 120 deg, beta at most 30 deg
# Contacts near the root load the section with almost no lever arm; the formula needs a positive one [x module].
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
    """Form factor Y_F and stress correction factor Y_S at given load points, with the dimensions of the critical
    section.

    Attributes:
        form, correction: Y_F, Y_S.
        lever_arm: h_Fe.
        load_angle: alpha_Fen [rad].
        load_diameter: d_en, of helical gears that of the virtual gear.
        notch: q_s, before it is limited to the validity of Y_S.
        section: section at the 30 degree tangent.
    """

    form: Real = result()
    correction: Real = result()
    lever_arm: Real = result("mm")
    load_angle: Real = result("rad")
    load_diameter: Real = result("mm")
    notch: Real = result()
    section: CriticalSection = eqx.field()


class RootStress(Checked):
    """Nominal local root stress of both gears, shape (pairs, slices, positions)."""

    pinion: Load = result("MPa")
    wheel: Load = result("MPa")


class NominalRootStress(Checked):
    """Tooth-root stress of both gears by the standard."""

    pinion: Scalar = result("MPa")
    wheel: Scalar = result("MPa")


def critical_section(gear: Gear) -> CriticalSection:
    """Section of the generated root at the 30 degree tangent, of ring gears the 60 degree one.

    That of helical gears is in the normal section.
    """
    gear = _of_normal_section(gear)
    if gear.fillet_arc is not None:
        drawn = curves(gear)
        assert drawn.arc_angle is not None
        x, y = drawn.trochoid(drawn.arc_angle + jnp.asarray(_RING_TANGENT))
        return CriticalSection(2 * x, drawn.rounding, y)
    if gear.cutter is not None:
        tangent = _RING_TANGENT if gear.is_internal else _TANGENT
        return _section_by_cutter(curves(gear), jnp.full_like(gear.module, tangent))
    m, z = gear.module, gear.teeth
    offset, below, radius = (length / m for length in rack_tip(gear))
    g, h = -below, 2 / z * offset - jnp.pi / 3
    theta = jax.lax.fori_loop(0, _SECTION_STEPS, lambda _, t: 2 * g / z * jnp.tan(t) - h, jnp.full_like(h, jnp.pi / 6))
    reach = g / jnp.cos(theta) - radius
    chord = z * jnp.sin(jnp.pi / 3 - theta) + jnp.sqrt(3.0) * reach
    fillet = radius + 2 * g**2 / (jnp.cos(theta) * (z * jnp.cos(theta) ** 2 - 2 * g))
    depth = 0.5 * (z * jnp.cos(jnp.pi / 3 - theta) + reach)
    return CriticalSection(chord * m, fillet * m, depth * m)


def _section_by_cutter(drawn: Curves, tangent: Scalar) -> CriticalSection:
    """Root section where the fillet has this inclination to the centreline [rad], by a root search.

    The radius of curvature is that of the roulette of the tip arc's centre (Euler and Savary) and of the arc:
    rho_F = rho_a0 + L^2 / (L + sin(g) / (1 / r_w + 1 / r_w0)), where the rack has r_w0 = infinity.
    """
    low = jnp.full_like(drawn.depth, _TANGENT)
    g = bracketed_root(_beyond_tangent, low, jnp.full_like(low, jnp.pi / 2), (drawn, tangent))
    x, y = drawn.trochoid(g)
    reach, _ = drawn.cutter_contact(g)
    assert drawn.cutter_radius is not None
    rolling = drawn.pitch_radius * drawn.cutter_radius / (drawn.pitch_radius + drawn.cutter_radius)
    fillet = drawn.rounding + reach**2 / (reach + rolling * jnp.sin(g))
    return CriticalSection(2 * x, fillet, y)


def _beyond_tangent(g: Real, given: tuple[Curves, Scalar]) -> Real:
    """Inclination of the fillet's tangent at the parameter g beyond that of the critical section [rad]."""
    drawn, tangent = given
    return g - drawn.cutter_contact(g)[1] - tangent


def _of_normal_section(gear: Gear) -> Gear:
    return gear if gear.helix_angle is None else virtual_gear(gear)


def root_factors(gear: Gear, roll_length: Real) -> RootFactors:
    """Y_F and Y_S for a load at a roll length [mm] of the flank.

    Of helical gears they are those of the virtual spur gear, loaded at the same height of its tooth.
    """
    if gear.helix_angle is not None:
        virtual = virtual_gear(gear)
        radius = gear.signed(jnp.hypot(gear.base_radius, roll_length)) - gear.pitch_radius + virtual.pitch_radius
        gear, roll_length = virtual, gear.signed(safe_sqrt(radius**2 - virtual.base_radius**2))
    section, m = critical_section(gear), gear.module
    angle = load_angle(gear, roll_length)
    cosine = jnp.cos(angle)
    # the lever arm ends where the load line crosses the tooth centreline
    arm = jnp.maximum(gear.base_radius / cosine - section.depth, _SHORTEST_ARM * m)
    alpha = jnp.deg2rad(gear.pressure_angle)
    form = 6 * (arm / m) * cosine / ((section.chord / m) ** 2 * jnp.cos(alpha))
    slenderness = section.chord / arm
    notch = section.chord / (2 * section.fillet_radius)
    correction = (1.2 + 0.13 * slenderness) * jnp.clip(notch, *NOTCH_LIMITS) ** (1 / (1.21 + 2.3 / slenderness))
    return RootFactors(form, correction, arm, angle, 2 * jnp.hypot(gear.base_radius, roll_length), notch, section)


def _root_stress_per_load(gear: Gear, roll_length: Real) -> Real:
    """cos(alpha_t) / m_n Y_F Y_S: root stress by a line load on the line of action at a roll length [MPa mm/N]."""
    return _per_load(gear, root_factors(gear, roll_length))


def _per_load(gear: Gear, factors: RootFactors) -> Real:
    return factors.form * factors.correction * jnp.cos(gear.transverse_pressure_angle) / gear.module


def single_contact_factors(pair: GearPair, path: PathOfContact) -> tuple[RootFactors, RootFactors]:
    """Y_F and Y_S of pinion and wheel at their outer points of single contact, for contact ratios to 2.

    Of helical gears that point is the one of the virtual gears, whose contact ratio is eps_alpha / cos(beta_b)^2.
    """
    if pair.pinion.helix_angle is None:
        gears = pair.gears
        rolls = path.pinion_roll_length(path.outer_single), path.wheel_roll_length(path.inner_single)
    else:
        gears = virtual_gear(pair.pinion), virtual_gear(pair.wheel)
        double = path.contact_ratio / jnp.cos(pair.pinion.base_helix_angle) ** 2 - 1
        one, other = (gear.tip_roll_length - double * gear.base_pitch for gear in gears)
        rolls = one, other
    pinion, wheel = (root_factors(gear, roll) for gear, roll in zip(gears, rolls))
    return pinion, wheel


def root_helix_factor(pair: GearPair) -> Scalar:
    """Y_beta = 1 - eps_beta beta / 120 deg, eps_beta at most 1 and beta at most 30 deg (ISO 6336-3)."""
    if pair.pinion.helix_angle is None:
        return jnp.ones_like(pair.pinion.module)
    angle = jnp.minimum(jnp.abs(pair.pinion.helix_angle), _MOST_OBLIQUE)
    return 1 - jnp.minimum(pair.overlap_ratio, 1.0) * angle / _OBLIQUE


def single_contact_root_stress(pair: GearPair, path: PathOfContact) -> tuple[Scalar, Scalar]:
    """cos(alpha_t) / m_n Y_F Y_S Y_beta of pinion and wheel [MPa mm/N] at their outer points of single contact."""
    helix = root_helix_factor(pair)
    pinion, wheel = (_per_load(*each) * helix for each in zip(pair.gears, single_contact_factors(pair, path)))
    return pinion, wheel


@over_batch
def nominal_root_stress(cycle: MeshCycle) -> NominalRootStress:
    """sigma_F = F_t / (b m_n) Y_F Y_S Y_beta K_Fbeta of both gears [MPa], for contact ratios from 1 to 2.

    The whole load is at the outer point of single contact, whatever the contact analysis says of its sharing.
    K_Fbeta is `root_face_load_factor`, 1 on one slice. Factors of application and dynamics belong into the torque.
    """
    pair = cycle.kinematics.pair
    line_load = cycle.force / pair.face_width * over_several_slices(root_face_load_factor, cycle)
    return NominalRootStress(
        *(line_load * share for share in single_contact_root_stress(pair, cycle.kinematics.path_of_contact))
    )


@over_batch
def root_stress(cycle: MeshCycle) -> RootStress:
    """Local root stress f_t / m_n Y_F Y_S of both gears at every contact [MPa], f_t tangential line load there.

    Every slice bends by its own load, at its own height where contact lines are oblique. What its neighbours, which are
    loaded lower down, take over of its bending is not in it: that is Y_beta of the nominal stress.
    """

    def stress(side: Side) -> Load:
        return cycle.line_load * _root_stress_per_load(side.gear, side.contact_roll_length)

    return RootStress(*(stress(side) for side in cycle.sides))


@over_batch
def rating_factors(cycle: MeshCycle) -> dict[str, Float[Array, ""]]:
    """Loads, factors and stresses of both gears, by name and unit; of contact ratios from 1 to 2.

        sigma_H0 = Z_H Z_E Z_eps Z_beta sqrt(F_t / (d_1 b) (u + 1) / u)
        sigma_H = Z_B sigma_H0 sqrt(K_Hbeta), wheel: Z_D
        sigma_F0 = F_t / (b m_n) Y_F Y_S Y_beta,  sigma_F = sigma_F0 K_Fbeta

    The stresses are those of `nominal_contact_stress` and `nominal_root_stress`.

    References:
        ISO 6336-2 clauses 6 and 7, ISO 6336-3 clauses 5 to 7 (Method B).
    """
    pair, path = cycle.kinematics.pair, cycle.kinematics.path_of_contact
    module, cosine = pair.pinion.module, jnp.cos(pair.pinion.transverse_pressure_angle)
    squares = contact_factor_squares(pair, path)
    one = jnp.ones_like(module)
    face, root_face = (one * over_several_slices(of, cycle) for of in (face_load_factor, root_face_load_factor))
    zone, elasticity, sharing, helix, *single = map(safe_sqrt, squares)
    tangential = cycle.force * cosine
    per_area = tangential / (2 * pair.pinion.pitch_radius * pair.face_width)
    pitting = zone * elasticity * sharing * helix * safe_sqrt(per_area * (1 + 1 / pair.signed_gear_ratio))
    root_helix = root_helix_factor(pair)
    found = {
        "tangential_force_N": tangential,
        "face_load_factor": face,
        "root_face_load_factor": root_face,
        "zone_factor": zone,
        "elasticity_factor_sqrt_MPa": elasticity,
        "contact_ratio_factor": sharing,
        "helix_angle_factor": helix,
        "nominal_contact_stress_MPa": pitting,
        "root_helix_angle_factor": root_helix,
    }
    for name, factor in zip(("pinion", "wheel"), single):
        found[f"{name}_single_pair_contact_factor"] = factor
        found[f"{name}_contact_stress_MPa"] = pitting * factor * safe_sqrt(face)
    for name, factors in zip(("pinion", "wheel"), single_contact_factors(pair, path)):
        bending = tangential / (pair.face_width * module) * factors.form * factors.correction * root_helix
        found[f"{name}_form_factor"] = factors.form
        found[f"{name}_stress_correction_factor"] = factors.correction
        found[f"{name}_nominal_root_stress_MPa"] = bending
        found[f"{name}_root_stress_MPa"] = bending * root_face
    return found
