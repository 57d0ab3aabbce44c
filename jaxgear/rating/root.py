"""Tooth bending strength of ISO 6336-3.

References:
    ISO 6336-3:2006 and 2019; the roots are those of the generating profile shift.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Gear, GearPair, PathOfContact
from ..metrics.stress import RootFactors, root_helix_factor, single_contact_factors
from ..numerics import Checked, Given, result
from .life import Strengths
from .mesh_geometry import MeshGeometry
from .settings import GearRating, Rating, rated_pair

Scalar = Float[Array, ""]
OfGears = Float[Array, " gears"]

TEST_GEAR = 2.0  # Y_ST
_OVERHANG = 1.0  # modules per side, by which a wider gear counts at most
_RIM = 2.242, 1.6, 0.5, 1.2  # Y_B = 1.6 ln(2.242 h_t / s_R) for s_R / h_t from 0.5 to 1.2
_RING_RIM = 8.324, 1.15, 1.75, 3.5  # Y_B = 1.15 ln(8.324 m_n / s_R) for s_R / m_n from 1.75 to 3.5
_FINEST = 4  # tolerance class, up to which deep teeth share the load
_DEEP = 2.05, 2.5, 2.366, 0.666, 0.7  # Y_DT
_ROUGHNESSES = 1.0, 40.0  # R_z [um] that Y_RrelT is known for
_SMALL = 5.0  # module [mm], up to which Y_X is 1
_IDLER = 0.7  # Y_M


class BendingFactors(Checked):
    """Factors of ISO 6336-3, of both gears where they differ.

    Attributes:
        form: Y_F; of 2019 with the share of the load f_eps in it.
        load_sharing: f_eps, 1 in 2006.
        correction: Y_S, with a grinding notch Y_Sg.
        helix_angle, rim, deep_tooth: Y_beta, Y_B, Y_DT.
        notch_sensitivity, surface, size, mean_stress: Y_deltarelT, Y_RrelT, Y_X, Y_M.
        static_notch_sensitivity, static_mean_stress: for static strength, where surface and size are 1.
        generating_shift: x_E by which the roots are rated.
        notch: q_s.
        chord, fillet_radius, lever_arm: s_Fn, rho_F, h_Fe.
        load_angle: alpha_Fen [deg].
        load_diameter: d_en.
        face_width: b that bends.
        virtual_contact_ratio: eps_alphan.
    """

    form: OfGears = result()
    load_sharing: Scalar = result()
    correction: OfGears = result()
    helix_angle: Scalar = result()
    rim: OfGears = result()
    deep_tooth: Scalar = result()
    notch_sensitivity: OfGears = result()
    surface: OfGears = result()
    size: OfGears = result()
    mean_stress: OfGears = result()
    static_notch_sensitivity: OfGears = result()
    static_mean_stress: OfGears = result()
    generating_shift: OfGears = result()
    notch: OfGears = result()
    chord: OfGears = result("mm")
    fillet_radius: OfGears = result("mm")
    lever_arm: OfGears = result("mm")
    load_angle: OfGears = result("deg")
    load_diameter: OfGears = result("mm")
    face_width: OfGears = result("mm")
    virtual_contact_ratio: Scalar = result()

    def nominal_stress(self, geometry: MeshGeometry, torque: Given) -> OfGears:
        """sigma_F0 = F_t / (b m_n) Y_F Y_S Y_beta Y_B Y_DT [MPa] of a torque on the pinion [N m]."""
        product = self.form * self.correction * self.helix_angle * self.rim * self.deep_tooth
        return geometry.tangential_force(torque) / (self.face_width * geometry.module) * product

    @property
    def reference(self) -> OfGears:
        """Y_ST Y_deltarelT Y_RrelT Y_X Y_M."""
        return TEST_GEAR * self.notch_sensitivity * self.surface * self.size * self.mean_stress

    @property
    def static(self) -> OfGears:
        """Y_ST Y_deltarelT Y_M of static strength."""
        return TEST_GEAR * self.static_notch_sensitivity * self.static_mean_stress


def bending_factors(pair: GearPair, path: PathOfContact, geometry: MeshGeometry, rating: Rating) -> BendingFactors:
    """Factors of the root stress and of its permissible value.

    Raises:
        ValueError: for gears without the roughness of the root, and without the yield strength where their notch
            sensitivity needs it.
    """
    rated = rated_pair(pair, rating)
    found = single_contact_factors(rated, path)
    virtual = geometry.contact_ratio / jnp.cos(geometry.base_helix_angle) ** 2
    overlap = jnp.minimum(geometry.overlap_ratio, 1.0)
    helix, sharing = root_helix_factor(pair), jnp.ones_like(virtual)
    if rating.edition == "2019":
        helix = helix / jnp.cos(geometry.helix_angle) ** 3
        single = jnp.where(virtual < 2, jnp.sqrt(1 - overlap + overlap / virtual), _of_several(overlap, virtual))
        sharing = jnp.where(overlap > 0, single, jnp.where(virtual < 2, 1.0, 0.7))
    material = [_material_factors(*each, geometry.module) for each in zip(rating.gears, found)]
    per_gear = {name: jnp.stack([of[name] for of in material]) for name in material[0]}

    def both(of) -> OfGears:
        return jnp.stack([of(each) for each in found])

    return BendingFactors(
        form=both(lambda each: each.form) * sharing,
        load_sharing=sharing,
        helix_angle=helix,
        rim=jnp.stack([rim_factor(gear) for gear in rated.gears]),
        deep_tooth=_deep_tooth_factor(virtual, rating),
        generating_shift=jnp.stack([gear.generating_profile_shift for gear in rated.gears]),
        notch=both(lambda each: each.notch),
        chord=both(lambda each: each.section.chord),
        fillet_radius=both(lambda each: each.section.fillet_radius),
        lever_arm=both(lambda each: each.lever_arm),
        load_angle=both(lambda each: jnp.rad2deg(each.load_angle)),
        load_diameter=both(lambda each: each.load_diameter),
        face_width=jnp.minimum(geometry.face_widths, geometry.face_width + 2 * _OVERHANG * geometry.module),
        virtual_contact_ratio=virtual,
        **per_gear,
    )


def _of_several(overlap: Scalar, virtual: Scalar) -> Scalar:
    """f_eps of virtual contact ratios from 2 on."""
    return jnp.sqrt((1 - overlap) / 2 + overlap / virtual)


def rim_factor(gear: Gear) -> Scalar:
    """Y_B by the rim thickness over the tooth height, of ring gears over the module; 1 of a solid gear."""
    if gear.is_internal:
        (share, slope, thinnest, thick), ratio = _RING_RIM, gear.body_thickness / gear.module
    elif gear.rim_thickness is None:
        return jnp.ones_like(gear.module)
    else:
        share, slope, thinnest, thick = _RIM
        ratio = gear.rim_thickness / (gear.tip_radius - gear.root_circle_radius)
    return jnp.where(ratio >= thick, 1.0, slope * jnp.log(share / jnp.clip(ratio, thinnest, thick)))


def _deep_tooth_factor(virtual: Scalar, rating: Rating) -> Scalar:
    classes = [gear.quality_class for gear in rating.gears]
    if any(each is None or each > _FINEST for each in classes):
        return jnp.ones_like(virtual)
    low, high, offset, slope, least = _DEEP
    return jnp.where(virtual <= low, 1.0, jnp.where(virtual > high, least, offset - slope * virtual))


def _material_factors(gear: GearRating, found: RootFactors, module: Scalar) -> dict[str, Scalar]:
    """Y_S and the factors that depend on the material."""
    correction, kind = found.correction, gear.group.kind
    depth, radius = gear.grinding_notch_depth, gear.grinding_notch_radius
    if depth is not None and radius is not None:
        correction = 1.3 * correction / (1.3 - 0.6 * jnp.sqrt(depth / radius))
    if gear.root_roughness_rz is None:
        raise ValueError("Y_RrelT needs root_roughness_rz of both gears")
    layer = _slip_layer(gear)
    sensitivity = 1 + jnp.sqrt(0.2 * layer * (1 + 2 * found.notch))
    offset, slope, exponent, most = kind.surface
    rough = jnp.minimum(gear.root_roughness_rz, _ROUGHNESSES[1])
    surface = jnp.where(rough < _ROUGHNESSES[0], most, offset - slope * (rough + 1) ** exponent)
    largest, falling, least = kind.size
    size = jnp.where(module <= _SMALL, 1.0, jnp.maximum(largest - falling * module, least))
    return {
        "correction": correction,
        "notch_sensitivity": sensitivity / (1 + jnp.sqrt(1.2 * layer)),
        "surface": surface,
        "size": size,
        "mean_stress": _mean_stress_factor(gear, kind.mean_stress, found.correction),
        "static_notch_sensitivity": _static_notch(gear, found.correction),
        "static_mean_stress": _mean_stress_factor(gear, kind.static_mean_stress, found.correction),
    }


def _slip_layer(gear: GearRating) -> Scalar:
    """rho' [mm]."""
    strengths, layers = zip(*gear.group.kind.notch)
    if len(layers) == 1:
        return jnp.full_like(gear.contacts_per_revolution, layers[0])
    strength = _yield_strength(gear)
    return jnp.interp(strength, jnp.asarray(strengths, strength.dtype), jnp.asarray(layers, strength.dtype))


def _yield_strength(gear: GearRating) -> Scalar:
    if gear.yield_strength is None:
        raise ValueError(f"Y_deltarelT needs yield_strength of {gear.heat_treatment} gears")
    return gear.yield_strength


def _static_notch(gear: GearRating, correction: Scalar) -> Scalar:
    first, second, by_yield = gear.group.kind.static_notch
    if not by_yield:
        return first + second * correction
    ratio = first * (second / _yield_strength(gear)) ** 0.25
    return (1 + ratio * (correction - 1)) / (1 + ratio)


def _mean_stress_factor(gear: GearRating, influence: tuple[float, float], correction: Scalar) -> Scalar:
    """Y_M: 0.7 of an idler, 1 / (1 - R (1 - M) / (1 + M)) of a stress ratio R."""
    if gear.idler:
        return jnp.full_like(correction, _IDLER)
    if gear.stress_ratio is None:
        return jnp.ones_like(correction)
    offset, slope = influence
    m = offset - slope * correction
    return 1 / (1 - gear.stress_ratio * (1 - m) / (1 + m))


def root_strengths(factors: BendingFactors, rating: Rating) -> Strengths:
    """Limits, knees and factors of the permissible root stress."""
    limits = jnp.stack([gear.bending_strength for gear in rating.gears])
    pinion, wheel = (gear.group.kind.root for gear in rating.gears)
    return Strengths(limits, (pinion, wheel), factors.reference, factors.static)
