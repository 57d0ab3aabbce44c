"""Settings of a rating after ISO 6336: load factors, materials, surfaces, deviations, required safeties."""

from typing import Literal

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..conditions import LoadSpectrum
from ..geometry import Gear, GearPair, Material
from ..metrics import AbstractSettings, Lubricant
from ..numerics import Checked, changed, concrete, count, number
from .materials import GROUPS, QUALITIES, Group, HeatTreatment, MaterialQuality

Scalar = Float[Array, ""]
Edition = Literal["2006", "2019"]
RootProfileShift = Literal["upper", "mean", "nominal"]
ProfileModification = Literal["none", "suitable", "optimal"]

_LEAST_MODULUS = 50_000.0  # [MPa], of metals
_CORE_HARDNESS = 25.0, 30.0  # [HRC], least, and from which case-hardened MQ bears more
_RZ_PER_RA = 6.0
_SAME = 0.01  # part by which roughnesses of the same flanks may differ
_CORE_BENDING = 500.0  # sigma_Flim then [MPa]


class GearRating(Checked):
    """Material, surface and deviations of one gear.

    Attributes:
        heat_treatment: group of materials of ISO 6336-5, from which S-N lines, running-in and the factors of notch,
            surface, size and mean stress follow too. Nodular iron is that of pearlite or bainite.
        hardness: of the flank, in HBW for normalized steel, cast steel and iron, else in HV; gives the endurance limits
            by A x + B, within the range of the group. Not needed where both limits are given.
        material_quality: requirements on material and heat treatment; "MQ" where none is given.
        core_hardness: of case-hardened gears [HRC]: MQ bears 500 MPa in bending from 30 HRC on, else 425 MPa (461 MPa
            with a hardenability J12 from 28 HRC on, given as `bending_limit`).
        yield_strength: sigma_S or sigma_0.2, for the notch sensitivity of steel that is not surface-hardened.
        pitting_limit: sigma_Hlim, in place of that of the group.
        bending_limit: sigma_Flim, nominal (without Y_ST = 2), in place of that of the group.
        flank_roughness_rz, flank_roughness_ra: mean peak-to-valley and arithmetic mean roughness of the flank; Rz is
            6 Ra where it is not given. The mean Ra of both gears is that of the lubricant.
        root_roughness_rz: of the tooth root.
        quality_class: flank tolerance class of ISO 1328-1:2013, for the deviations that are not given.
        base_pitch_deviation: f_pb, transverse, on the line of action.
        profile_form_deviation: f_falpha.
        moment_of_inertia: J, for the reduced mass; of a ring from the bore to the middle of the tooth where it is not
            given, and a solid disc without bore.
        contacts_per_revolution: load cycles of a tooth per revolution, 1; of a sun the number of its planets.
        idler: whether both flanks are loaded in turn: Y_M = 0.7 by the simple rule.
        stress_ratio: R, smallest over largest root stress; 0, pulsating load, where it is not given.
        grinding_notch_depth, grinding_notch_radius: t_g and rho_g of a notch that grinding leaves in the fillet.
    """

    heat_treatment: HeatTreatment | None = eqx.field(default=None, static=True)
    hardness: Scalar | None = number("", low=0.0, open_low=True, optional=True, default=None)
    material_quality: MaterialQuality | None = eqx.field(default=None, static=True)
    core_hardness: Scalar | None = number("HRC", low=_CORE_HARDNESS[0], high=60.0, optional=True, default=None)
    yield_strength: Scalar | None = number("MPa", low=0.0, open_low=True, optional=True, default=None)
    pitting_limit: Scalar | None = number("MPa", low=0.0, open_low=True, optional=True, default=None)
    bending_limit: Scalar | None = number("MPa", low=0.0, open_low=True, optional=True, default=None)
    flank_roughness_rz: Scalar | None = number("um", low=0.0, open_low=True, optional=True, default=None)
    flank_roughness_ra: Scalar | None = number("um", low=0.0, open_low=True, optional=True, default=None)
    root_roughness_rz: Scalar | None = number("um", low=0.0, open_low=True, optional=True, default=None)
    quality_class: int | None = count(low=1, high=11, optional=True, default=None)
    base_pitch_deviation: Scalar | None = number("um", low=0.0, optional=True, default=None)
    profile_form_deviation: Scalar | None = number("um", low=0.0, optional=True, default=None)
    moment_of_inertia: Scalar | None = number("kg m^2", low=0.0, open_low=True, optional=True, default=None)
    contacts_per_revolution: Scalar = number("", low=0.0, open_low=True, default=1.0)
    idler: bool = eqx.field(default=False, static=True)
    stress_ratio: Scalar | None = number("", low=-2.0, high=1.0, optional=True, default=None)
    grinding_notch_depth: Scalar | None = number("mm", low=0.0, optional=True, default=None)
    grinding_notch_radius: Scalar | None = number("mm", low=0.0, open_low=True, optional=True, default=None)

    def check_together(self) -> None:
        if self.heat_treatment is None:
            for name in ("material_quality", "hardness", "core_hardness"):
                if getattr(self, name) is not None:
                    raise ValueError(f"GearRating: heat_treatment: missing, {name} needs it")
        elif self.heat_treatment not in GROUPS:
            known = ", ".join(GROUPS)
            raise ValueError(f"GearRating: heat_treatment = {self.heat_treatment!r} must be one of {known}")
        if self.material_quality not in (None, *QUALITIES):
            known = ", ".join(QUALITIES)
            raise ValueError(f"GearRating: material_quality = {self.material_quality!r} must be one of {known}")
        if self.core_hardness is not None and self.heat_treatment != "case_hardened":
            raise ValueError(f"GearRating: core_hardness has no effect on {self.heat_treatment} gears")
        if self.idler and self.stress_ratio is not None:
            raise ValueError("GearRating: stress_ratio has no effect beside idler, give either")
        if (self.grinding_notch_depth is None) != (self.grinding_notch_radius is None):
            raise ValueError("GearRating: grinding_notch_depth and grinding_notch_radius belong together, give both")
        if self.heat_treatment is not None and (self.pitting_limit is None or self.bending_limit is None):
            self._check_hardness(GROUPS[self.heat_treatment])

    def _check_hardness(self, group: Group) -> None:
        low, high = group.ranges[self._quality]
        if self.hardness is None:
            flat = {row[self._quality].slope for row in (group.pitting, group.bending)} == {0}
            if flat:
                return
            raise ValueError(
                f"GearRating: hardness: missing, {self.heat_treatment} gears have it from {low:g} to {high:g} "
                f"{group.hardness}; or give pitting_limit and bending_limit"
            )
        known = concrete(self.hardness)
        if known is not None and not ((low <= known) & (known <= high)).all():
            raise ValueError(
                f"GearRating: hardness = {float(known):g} {group.hardness} must be from {low:g} to {high:g} "
                f"{group.hardness} for {self.heat_treatment} gears of quality {QUALITIES[self._quality]}; "
                "or give pitting_limit and bending_limit"
            )

    @property
    def _quality(self) -> int:
        return QUALITIES.index(self.material_quality or "MQ")

    @property
    def group(self) -> Group:
        """Its group of materials.

        Raises:
            ValueError: where none is given.
        """
        if self.heat_treatment is None:
            raise ValueError("needs heat_treatment of both gears, [rating.pinion] and [rating.wheel]")
        return GROUPS[self.heat_treatment]

    @property
    def pitting_strength(self) -> Scalar:
        """sigma_Hlim [MPa]: given, or that of the group."""
        if self.pitting_limit is not None:
            return self.pitting_limit
        return self._of_group(self.group.pitting)

    @property
    def bending_strength(self) -> Scalar:
        """sigma_Flim [MPa]: given, or that of the group."""
        if self.bending_limit is not None:
            return self.bending_limit
        bears = self._of_group(self.group.bending)
        if self.core_hardness is None or self.material_quality not in (None, "MQ"):
            return bears
        return jnp.where(self.core_hardness >= _CORE_HARDNESS[1], _CORE_BENDING, bears)

    def _of_group(self, limits) -> Scalar:
        slope, offset, most = limits[self._quality]
        if self.hardness is None:
            return jnp.full_like(self.contacts_per_revolution, offset)
        return jnp.minimum(slope * self.hardness + offset, most)

    @property
    def roughness(self) -> Scalar:
        """R_z of the flank [um]: given, or 6 R_a.

        Raises:
            ValueError: where neither is given.
        """
        if self.flank_roughness_rz is not None:
            return self.flank_roughness_rz
        if self.flank_roughness_ra is None:
            raise ValueError("Z_R needs flank_roughness_rz or flank_roughness_ra of both gears")
        return _RZ_PER_RA * self.flank_roughness_ra


class Rating(AbstractSettings):
    """Rating of both gears after ISO 6336; load factors count here, and never in the torque.

    Attributes:
        edition: of ISO 6336.
        application_factor: K_A; 1 with a load spectrum. Static strength is compared with the load without it.
        mesh_load_factor: K_gamma, uneven sharing between several meshes.
        dynamic_factor: K_v; by method B of ISO 6336-1 where it is not given.
        face_load_factor: K_Hbeta; by method C from `shaft_deflection` and `mesh_misalignment`, or else that of the
            contact analysis under the torque itself, where it is not given.
        shaft_deflection: f_sh, by bending and torsion of the pinion and its shaft over the face width, for method C.
        mesh_misalignment: f_ma, by manufacture over the face width, for method C.
        root_face_load_factor: K_Fbeta; by method B from K_Hbeta where it is not given.
        transverse_load_factor: K_Halpha = K_Falpha; by method B where it is not given.
        service_life: L_h; endurance limits (life factors of 1) without it.
        pitting_permitted: whether some pitting is permitted, on flanks of through-hardened, case- or induction-hardened
            steel.
        long_life_factor: life factors at 1e10 cycles, 0.85; 1 with the best of material, lubrication, manufacture and
            experience.
        profile_modification: how well the profile is modified for the load, for the stress of helical gears (2019) and
            the transverse load factors.
        tip_relief: C_a in K_v; that of the modifications where it is not given. Of flanks without relief, and from
            tolerance class 6 on, it does not count.
        root_profile_shift: generating profile shift by which roots are rated: of the upper or mean tooth thickness
            allowance, or of no allowance.
        required_pitting_safety, required_root_safety: S_Hmin and S_Fmin.
        required_scuffing_safety, required_micropitting_safety: S_Bmin, S_Smin and S_lambdamin.
        pinion, wheel: material, surface and deviations of the gears.
        lubricant: for the factors Z_L and Z_v.
        loads: load spectrum after ISO 6336-6; None for the torque of the analysis alone.
    """

    table = "rating"

    edition: Edition = eqx.field(default="2019", static=True)
    application_factor: Scalar = number("", low=0.5, high=10.0, default=1.0)
    mesh_load_factor: Scalar = number("", low=1.0, high=10.0, default=1.0)
    dynamic_factor: Scalar | None = number("", low=0.0, high=10.0, open_low=True, optional=True, default=None)
    face_load_factor: Scalar | None = number("", low=0.0, high=10.0, open_low=True, optional=True, default=None)
    shaft_deflection: Scalar | None = number("um", low=0.0, optional=True, default=None)
    mesh_misalignment: Scalar | None = number("um", low=0.0, optional=True, default=None)
    root_face_load_factor: Scalar | None = number("", low=0.0, high=10.0, open_low=True, optional=True, default=None)
    transverse_load_factor: Scalar | None = number("", low=0.0, high=10.0, open_low=True, optional=True, default=None)
    service_life: Scalar | None = number("h", low=0.0, open_low=True, optional=True, default=None)
    pitting_permitted: bool = eqx.field(default=False, static=True)
    long_life_factor: Scalar = number("", low=0.85, high=1.0, default=0.85)
    profile_modification: ProfileModification = eqx.field(default="none", static=True)
    tip_relief: Scalar | None = number("um", low=0.0, optional=True, default=None)
    root_profile_shift: RootProfileShift = eqx.field(default="upper", static=True)
    required_pitting_safety: Scalar = number("", low=0.0, open_low=True, default=1.0)
    required_root_safety: Scalar = number("", low=0.0, open_low=True, default=1.4)
    required_scuffing_safety: Scalar = number("", low=0.0, open_low=True, default=1.5)
    required_micropitting_safety: Scalar = number("", low=0.0, open_low=True, default=1.2)
    pinion: GearRating = eqx.field(default_factory=GearRating)
    wheel: GearRating = eqx.field(default_factory=GearRating)
    lubricant: Lubricant | None = None
    loads: LoadSpectrum | None = None

    def check_together(self) -> None:
        if (self.shaft_deflection is None) != (self.mesh_misalignment is None):
            raise ValueError("Rating: shaft_deflection and mesh_misalignment belong together, give both")
        if self.shaft_deflection is not None and self.face_load_factor is not None:
            raise ValueError("Rating: shaft_deflection has no effect beside face_load_factor, give either")
        self._check_roughness()

    def _check_roughness(self) -> None:
        """Both gears' R_a and that of the lubricant, which films and friction count, are of the same flanks."""
        of_oil = None if self.lubricant is None else self.lubricant.roughness
        given = self.pinion.flank_roughness_ra, self.wheel.flank_roughness_ra, of_oil
        known = [number for each in given if each is not None and (number := concrete(each)) is not None]
        if len(known) < len(given):
            return
        first, second, mean = known
        if (abs(0.5 * (first + second) - mean) > _SAME * mean).any():
            raise ValueError(
                f"Rating: flank_roughness_ra = {first.max():g} and {second.max():g} um must have the mean "
                f"lubricant.roughness = {mean.max():g} um, they are of the same flanks"
            )

    @property
    def gears(self) -> tuple[GearRating, GearRating]:
        """Pinion and wheel."""
        return self.pinion, self.wheel


def check_metal(name: str, material: Material) -> None:
    """Refuses gears that are not of metal.

    Raises:
        ValueError: for an elastic modulus of plastics, in one line.
    """
    known = concrete(material.elastic_modulus)
    if known is not None and (known < _LEAST_MODULUS).any():
        given = f"{name} = {float(known.min()):g} MPa must be at least {_LEAST_MODULUS:g} MPa"
        raise ValueError(f"{given}: ISO 6336 rates gears of metal, those of plastics are for VDI 2736")


def rated_pair(pair: GearPair, rating: Rating) -> GearPair:
    """The pair with the tooth thickness by which its roots are rated, for root stress and single stiffness."""
    pinion, wheel = (_rated(gear, rating) for gear in pair.gears)
    return changed(pair, pinion=pinion, wheel=wheel)


def _rated(gear: Gear, rating: Rating) -> Gear:
    if rating.root_profile_shift == "mean":
        return gear
    none = jnp.zeros_like(gear.module)
    if rating.root_profile_shift == "upper":
        return changed(gear, tooth_thickness_tolerance=none)
    stock = None if gear.grinding_allowance is None else none
    return changed(gear, tooth_thickness_allowance=none, tooth_thickness_tolerance=none, grinding_allowance=stock)
