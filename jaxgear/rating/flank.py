"""Surface durability (pitting) of ISO 6336-2.

References:
    ISO 6336-2:2006 with its corrigendum of 2008 (Z_beta), and 2019.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import GearPair, PathOfContact
from ..metrics.stress import contact_factor_squares
from ..numerics import Checked, Given, result
from .life import Strengths
from .materials import PITTING_PERMITTED, Knees
from .mesh_geometry import MeshGeometry
from .settings import GearRating, Rating

Scalar = Float[Array, ""]
OfGears = Float[Array, " gears"]

# sigma_Hlim [MPa] between which C_ZL and C_ZR change, and their values
_LIMITS = 850.0, 1200.0
_LUBRICANT = 0.83, 0.91
_ROUGHNESS = 0.15, 0.08
_VELOCITY_ABOVE = 0.02  # C_Zv - C_ZL
_SMOOTH = 3.0  # R_z10 and R_zH of a factor of 1 [um]
_REFERENCE_RADIUS = 10.0  # [mm]
_HARDEST_ROUGHNESS = 6.0  # R_z of a hard flank [um], up to which it hardens its mate
_WORK_HARDENING = 130.0, 470.0  # [HBW]
_ROUGHEST = 16.0  # R_zH [um]
# both through-hardened: (HB1 / HB2, slope over u - 1)
_HARDNESS_RATIOS = 1.2, 1.7
_MOST_RATIO, _MOST_SLOPE = 20.0, 0.00698
_PERMITTING = 5e7  # cycles of the endurance limit of materials that bear some pitting
# f_ZCa of 2019, by the modification of the profile
_MODIFIED = {"none": 1.2, "suitable": 1.07, "optimal": 1.0}


class FlankFactors(Checked):
    """Factors of ISO 6336-2; of both gears where they differ.

    Attributes:
        zone, elasticity, contact_ratio, helix_angle: Z_H, Z_E, Z_eps, Z_beta.
        single_pair: Z_B and Z_D.
        lubricant, velocity, roughness: Z_L, Z_v, Z_R.
        mean_roughness: R_z10.
        work_hardening, static_work_hardening: Z_W.
        size: Z_X, 1.
    """

    zone: Scalar = result()
    elasticity: Scalar = result("MPa^0.5")
    contact_ratio: Scalar = result()
    helix_angle: Scalar = result()
    single_pair: OfGears = result()
    lubricant: Scalar = result()
    velocity: Scalar = result()
    roughness: Scalar = result()
    mean_roughness: Scalar = result("um")
    work_hardening: OfGears = result()
    static_work_hardening: OfGears = result()
    size: OfGears = result()

    def nominal_stress(self, geometry: MeshGeometry, torque: Given) -> Scalar:
        """sigma_H0 = Z_H Z_E Z_eps Z_beta sqrt(F_t / (d_1 b) (u + 1) / u) [MPa] of a torque on the pinion [N m]."""
        load = geometry.tangential_force(torque) / (geometry.reference_diameter[0] * geometry.face_width)
        product = self.zone * self.elasticity * self.contact_ratio * self.helix_angle
        return product * jnp.sqrt(load * (1 + 1 / geometry.gear_ratio))

    @property
    def reference(self) -> OfGears:
        """Z_L Z_v Z_R Z_W Z_X of both gears."""
        return self.lubricant * self.velocity * self.roughness * self.work_hardening * self.size


def flank_factors(
    pair: GearPair, path: PathOfContact, geometry: MeshGeometry, speed: Given, rating: Rating
) -> FlankFactors:
    """Factors of the contact stress and of its permissible value, at a speed of the pinion [rpm].

    Raises:
        ValueError: for a rating without lubricant, and for gears without roughness or, where Z_W needs it, hardness.
    """
    oil = rating.lubricant
    if oil is None:
        raise ValueError("Z_L needs the lubricant, its viscosity at 40 degC")
    squares, overlap = contact_factor_squares(pair, path), jnp.minimum(geometry.overlap_ratio, 1.0)
    softer = jnp.minimum(*(gear.pitting_strength for gear in rating.gears))
    way = jnp.clip((softer - _LIMITS[0]) / (_LIMITS[1] - _LIMITS[0]), 0.0, 1.0)
    on_film, on_roughness = (low + (high - low) * way for low, high in (_LUBRICANT, _ROUGHNESS))
    on_speed = on_film + _VELOCITY_ABOVE
    velocity = geometry.reference_speed(speed)
    radius = geometry.reduced_radius(jnp.zeros_like(overlap))
    first, second = (gear.roughness for gear in rating.gears)
    relative = 0.5 * (first + second) * (_REFERENCE_RADIUS / radius) ** (1 / 3)
    hardening = [_work_hardening(of, geometry, rating, radius, velocity) for of in (0, 1)]
    return FlankFactors(
        zone=jnp.sqrt(squares.zone),
        elasticity=jnp.sqrt(squares.elasticity),
        contact_ratio=jnp.sqrt(squares.contact_ratio),
        helix_angle=jnp.sqrt(squares.helix_angle),
        single_pair=_single_pair_factors(geometry, rating, overlap),
        lubricant=on_film + 4 * (1 - on_film) / (1.2 + 134 / oil.viscosity_40) ** 2,
        velocity=on_speed + 2 * (1 - on_speed) / jnp.sqrt(0.8 + 32 / velocity),
        roughness=(_SMOOTH / relative) ** on_roughness,
        mean_roughness=relative,
        work_hardening=jnp.stack([hardened for hardened, _ in hardening]),
        static_work_hardening=jnp.stack([static for _, static in hardening]),
        size=jnp.ones_like(geometry.teeth),
    )


def _single_pair_factors(geometry: MeshGeometry, rating: Rating, overlap: Scalar) -> OfGears:
    """Z_B and Z_D: from the pitch point to the inner points of single contact; linear in the overlap ratio to 1 or, in
    2019, to sqrt(f_ZCa)."""
    inner, outer = geometry.path[1], geometry.path[3]
    at_pitch = geometry.reduced_radius(jnp.zeros_like(inner))
    spur = jnp.sqrt(at_pitch / geometry.reduced_radius(jnp.stack([inner, outer])))
    helical = 1.0 if rating.edition == "2006" else _MODIFIED[rating.profile_modification] ** 0.5
    return jnp.maximum(spur - overlap * (spur - helical), 1.0)


def _work_hardening(
    of: int, geometry: MeshGeometry, rating: Rating, radius: Scalar, velocity: Scalar
) -> tuple[Scalar, Scalar]:
    """Z_W of one gear for endurance and static strength: more than 1 of the softer one of a pair."""
    gear, mate, one = rating.gears[of], rating.gears[1 - of], jnp.ones_like(radius)
    if gear.group.kind.hardened or gear.group.kind.running_in == "cast":
        return one, one
    if mate.group.kind.hardened:
        hardness = jnp.clip(_hardness(gear), *_WORK_HARDENING) - _WORK_HARDENING[0]
        assert rating.lubricant is not None
        hard, soft = mate.roughness, gear.roughness
        film = (rating.lubricant.viscosity_40 * velocity / 1500) ** -0.33
        roughness = hard * (_REFERENCE_RADIUS / radius) ** 0.33 * (hard / soft) ** 0.66 * film
        factor = (1.2 - hardness / 1700) * (_SMOOTH / jnp.clip(roughness, _SMOOTH, _ROUGHEST)) ** 0.15
        smooth = hard <= _HARDEST_ROUGHNESS
        return jnp.where(smooth, factor, 1.0), jnp.where(smooth, 1.05 - hardness / 6800, 1.0)
    if gear.hardness is None or mate.hardness is None:
        return one, one  # of limits that are given as such, no hardness is known that could add to them
    ratio = mate.hardness / gear.hardness
    low, high = _HARDNESS_RATIOS
    slope = jnp.where(ratio < low, 0.0, jnp.where(ratio > high, _MOST_SLOPE, 0.00898 * ratio - 0.00829))
    ratio = jnp.abs(geometry.gear_ratio)
    larger = jnp.maximum(ratio, 1 / ratio)
    return 1 + slope * (jnp.minimum(larger, _MOST_RATIO) - 1), one


def _hardness(gear: GearRating) -> Scalar:
    if gear.hardness is None:
        raise ValueError("Z_W needs the hardness of the softer gear [HBW]")
    return gear.hardness


def flank_strengths(factors: FlankFactors, rating: Rating) -> Strengths:
    """Limits, knees and factors of the permissible contact stress.

    Raises:
        ValueError: where pitting is permitted on a material that bears none.
    """
    limits = jnp.stack([gear.pitting_strength for gear in rating.gears])
    pinion, wheel = (_knees(gear, rating) for gear in rating.gears)
    return Strengths(limits, (pinion, wheel), factors.reference, factors.static_work_hardening)


def _knees(gear: GearRating, rating: Rating) -> Knees:
    knees = gear.group.kind.flank
    if not rating.pitting_permitted:
        return knees
    if knees[-1][0] < _PERMITTING:
        raise ValueError(f"pitting_permitted has no S-N line for {gear.heat_treatment} gears")
    return PITTING_PERMITTED
