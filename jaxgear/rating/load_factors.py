"""Load factors of ISO 6336-1: dynamics, load over the face, sharing between pairs of teeth.

They multiply stresses in this order, each with those before it; none of them belongs into a torque.

References:
    ISO 6336-1:2006/2019, method B. Constants and equations of K_v and K_Halpha as coded in `MATISO_6336.m` of
    github.com/gfsReboucas/Drivetrain after the edition of 2006; the standard itself was not at hand. They come from
    teeth of steel with the damping and the scatter of industrial gears: a resonance with loss of contact, as an
    oscillator with few per cent of damping has it, is far above. Use K_v to order designs.
"""

from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..compliance.iso_6336 import single_stiffness
from ..contact.status import Status, Statuses, status_of
from ..geometry import Gear, GearPair
from ..metrics.stress import contact_ratio_square
from ..numerics import Checked, Given, real, result
from ..shafts import method_c, root_face_load_factor, tooth_height
from ..tolerance import ToleranceClass
from .mesh_geometry import MeshGeometry
from .settings import GearRating, Rating, rated_pair

Scalar = Float[Array, ""]
Real = Float[Array, "..."]  # of every bin of a load spectrum

_MM = 1e-3
_FACE_SHARE = 0.85  # c_gamma_beta over c_gamma_alpha
_LIGHT_LOAD = 100.0  # line load [N/mm], below which the main resonance begins earlier
_MAIN_BEGINS = 0.85  # N_S
_MAIN, _INTERMEDIATE = 1.15, 1.5  # ends of the main and the intermediate range of N
LEAST_SPEED = 3.0  # [m/s] of v z_1 / 100 sqrt(u^2 / (1 + u^2)), below which method B is of little use
_COARSE = 6  # tolerance class, from which on tip relief does not count in K_v
_OPTIMAL = 0.5  # share of the deviations that counts in K_Halpha, of flanks relieved for the load

_HARDENING: Mapping[str, Any] = {"hard": "surface_hardened", "soft": "through_hardened", "cast": "cast_iron"}

# of y_p, y_f and y_alpha: share of the deviation, and the most [um] above 5 and above 10 m/s
_RUN_IN_HARD = 0.075, 3.0
_RUN_IN_CAST = 0.275, 22.0, 11.0
_RUN_IN_SOFT = 160.0, 12_800.0, 6400.0  # over sigma_Hlim [MPa]
_SLOW, _FAST = 5.0, 10.0  # [m/s]
# C_ay = ((sigma_Hlim / a - b)^2 / c + d) um of ISO 6336-1
_RUN_IN_RELIEF = 97.0, 18.45, 18.0, 1.5


class LoadFactors(Checked):
    """Factors of the load on a mesh, and the terms they are made of.

    Attributes:
        application, mesh: K_A, K_gamma.
        dynamic: K_v.
        face, root_face: K_Hbeta, K_Fbeta.
        transverse, root_transverse: K_Halpha, K_Falpha.
        line_load: w K_A K_gamma, w = F_t / b.
        theoretical_stiffness, single_stiffness: c'_th, c'.
        mesh_stiffness, face_mesh_stiffness: c_gamma_alpha, c_gamma_beta.
        reduced_mass: m_red.
        resonance_speed: n_E1 of the pinion.
        resonance_ratio: N = n_1 / n_E1.
        main_resonance_begins: N_S.
        base_pitch_deviation, profile_form_deviation: f_pb and f_falpha, the larger of both gears.
        pitch_run_in, form_run_in: y_p = y_alpha, y_f.
        tip_relief: C_a that counts in K_v.
        pitch, form, relief: B_p, B_f, B_k.
        constants: C_v1 ... C_v7.
        usable_speed: v z_1 / 100 sqrt(u^2 / (1 + u^2)).
    """

    application: Scalar = result()
    mesh: Scalar = result()
    dynamic: Scalar = result()
    face: Scalar = result()
    root_face: Scalar = result()
    transverse: Scalar = result()
    root_transverse: Scalar = result()
    line_load: Scalar = result("N/mm")
    theoretical_stiffness: Scalar = result("N/(mm um)")
    single_stiffness: Scalar = result("N/(mm um)")
    mesh_stiffness: Scalar = result("N/(mm um)")
    face_mesh_stiffness: Scalar = result("N/(mm um)")
    reduced_mass: Scalar = result("kg/mm")
    resonance_speed: Scalar = result("rpm")
    resonance_ratio: Scalar = result()
    main_resonance_begins: Scalar = result()
    base_pitch_deviation: Scalar = result("um")
    profile_form_deviation: Scalar = result("um")
    pitch_run_in: Scalar = result("um")
    form_run_in: Scalar = result("um")
    tip_relief: Scalar = result("um")
    pitch: Scalar = result()
    form: Scalar = result()
    relief: Scalar = result()
    constants: Float[Array, " seven"] = result()
    usable_speed: Scalar = result("m/s")

    @property
    def flank(self) -> Real:
        """K_A K_gamma K_v K_Hbeta K_Halpha."""
        return self.application * self.mesh * self.dynamic * self.face * self.transverse

    @property
    def root(self) -> Real:
        """K_A K_gamma K_v K_Fbeta K_Falpha."""
        return self.application * self.mesh * self.dynamic * self.root_face * self.root_transverse

    @property
    def range(self) -> str:
        """Speed range: "subcritical", "main resonance", "intermediate" or "supercritical"; of concrete numbers only."""
        ratio = float(self.resonance_ratio)
        if ratio <= float(self.main_resonance_begins):
            return "subcritical"
        if ratio <= _MAIN:
            return "main resonance"
        return "intermediate" if ratio < _INTERMEDIATE else "supercritical"

    @property
    def status(self) -> Statuses:
        """`Status.OUT_OF_VALIDITY` where the speed is not high enough for method B."""
        return status_of({Status.OUT_OF_VALIDITY: ~(self.usable_speed >= LEAST_SPEED)})


def load_factors(
    pair: GearPair,
    geometry: MeshGeometry,
    torque: Given,
    speed: Given,
    rating: Rating,
    *,
    face_load_factor: Given = 1.0,
    tip_relief: Given = 0.0,
) -> LoadFactors:
    """Load factors of a gear pair, those that the rating gives and those of method B.

        B_p = c' (f_pb - y_p) / w,  B_f = c' (f_falpha - y_f) / w,  B_k = |1 - c' C_a / w|

    and K_v from them by the speed range. C_a counts up to tolerance class 5.

        K_Halpha = K_Falpha = 0.9 + 0.4 c_gamma_alpha (f - y_alpha) / (F_tH / b),  F_tH = F_t K_A K_gamma K_v K_Hbeta

    with the larger f of f_pb and f_falpha; of total contact ratios up to 2 times half of it, above with the second term
    times sqrt(2 (eps_gamma - 1) / eps_gamma); at least 1 and at most one pair that carries all.

    Args:
        pair: gear pair.
        geometry: its numbers.
        torque: on the pinion [N m].
        speed: of the pinion [rpm].
        rating: settings.
        face_load_factor: K_Hbeta where the rating gives neither it nor what method C needs.
        tip_relief: C_a where the rating gives none [um].
    """
    application, sharing = rating.application_factor, rating.mesh_load_factor
    nominal = geometry.tangential_force(torque) / geometry.face_width
    load = application * sharing * nominal
    theoretical, single = single_stiffness(rated_pair(pair, rating), load)
    mesh = single * (0.75 * geometry.contact_ratio + 0.25)
    velocity = geometry.reference_speed(speed)
    pitch, form = deviations(pair, geometry, rating)
    pitch_run_in, form_run_in = (_mean_run_in(rating, found, velocity) for found in (pitch, form))
    relief = real(tip_relief) if rating.tip_relief is None else rating.tip_relief
    if any(gear.quality_class is not None and gear.quality_class >= _COARSE for gear in rating.gears):
        relief = jnp.zeros_like(relief)
    compared = single / load
    terms = (compared * (pitch - pitch_run_in), compared * (form - form_run_in), jnp.abs(1 - compared * relief))
    mass = reduced_mass(pair, geometry, rating)
    resonance = resonance_speed(geometry.teeth[0], mesh, mass)
    lightness = jnp.sqrt(jnp.minimum(load, _LIGHT_LOAD) / _LIGHT_LOAD)
    begins = 0.5 + (_MAIN_BEGINS - 0.5) * lightness
    constants, ratio = constants_of(geometry.total_contact_ratio), real(speed) / resonance
    dynamic = factor_of(ratio, begins, *terms, constants) if rating.dynamic_factor is None else rating.dynamic_factor
    if rating.shaft_deflection is not None:
        face = _by_method_c(rating, load * dynamic, _FACE_SHARE * mesh)
    else:
        face = real(face_load_factor) if rating.face_load_factor is None else rating.face_load_factor
    root_face = rating.root_face_load_factor
    if root_face is None:
        root_face = root_face_load_factor(face, pair.face_width, tooth_height(pair))
    if rating.transverse_load_factor is None:
        counted = _OPTIMAL if rating.profile_modification == "optimal" else 1.0
        deviation = counted * jnp.maximum(pitch, form) - pitch_run_in
        shared = transverse_load_factors(geometry, mesh * deviation / (load * dynamic * face))
    else:
        shared = rating.transverse_load_factor, rating.transverse_load_factor
    u = jnp.abs(geometry.gear_ratio)
    return LoadFactors(
        application=application,
        mesh=sharing,
        dynamic=dynamic,
        face=face,
        root_face=root_face,
        transverse=shared[0],
        root_transverse=shared[1],
        line_load=load,
        theoretical_stiffness=theoretical,
        single_stiffness=single,
        mesh_stiffness=mesh,
        face_mesh_stiffness=_FACE_SHARE * mesh,
        reduced_mass=mass,
        resonance_speed=resonance,
        resonance_ratio=ratio,
        main_resonance_begins=begins,
        base_pitch_deviation=pitch,
        profile_form_deviation=form,
        pitch_run_in=pitch_run_in,
        form_run_in=form_run_in,
        tip_relief=relief,
        pitch=terms[0],
        form=terms[1],
        relief=terms[2],
        constants=constants,
        usable_speed=velocity * geometry.teeth[0] / 100 * u / jnp.sqrt(1 + u**2),
    )


def _by_method_c(rating: Rating, line_load: Scalar, stiffness: Scalar) -> Scalar:
    """K_Hbeta from f_sh and f_ma, for F_m / b = F_t K_A K_gamma K_v / b: the mean of the running-in of both gears."""
    assert rating.shaft_deflection is not None and rating.mesh_misalignment is not None
    found = []
    for gear in rating.gears:
        kind = gear.group.kind.running_in
        limit = gear.pitting_strength if kind == "soft" else None
        given = {"hardening": _HARDENING[kind], "endurance_limit": limit, "helix_tolerance": jnp.zeros_like(line_load)}
        found.append(method_c(line_load, stiffness, rating.shaft_deflection, rating.mesh_misalignment, **given))
    return 0.5 * (found[0] + found[1])


def transverse_load_factors(geometry: MeshGeometry, moved: Given) -> tuple[Scalar, Scalar]:
    """K_Halpha and K_Falpha, without the limits 0.9 + 0.4 `moved`, c_gamma_alpha (f - y_alpha) / (F_tH / b)."""
    along, total = geometry.contact_ratio, geometry.total_contact_ratio
    above = jnp.maximum(total, 2.0)
    factor = (0.9 + 0.4 * jnp.sqrt(2 * (above - 1) / above) * moved) * jnp.minimum(total, 2.0) / 2
    sharing = contact_ratio_square(along, geometry.overlap_ratio)
    contact, root = (jnp.clip(factor, 1.0, total / limit) for limit in (along * sharing, 0.25 * along + 0.75))
    return contact, root


def deviations(pair: GearPair, geometry: MeshGeometry, rating: Rating) -> tuple[Scalar, Scalar]:
    """f_pb and f_falpha [um], the larger of both gears': given, or of their tolerance classes.

    Raises:
        ValueError: for a gear without a deviation and without a class.
    """
    found = [_deviations(gear, settings, geometry) for gear, settings in zip(pair.gears, rating.gears)]
    pitch, form = (jnp.maximum(*of_gears) for of_gears in zip(*found))
    return pitch, form


def _deviations(gear: Gear, settings: GearRating, geometry: MeshGeometry) -> tuple[Scalar, Scalar]:
    pitch, form = settings.base_pitch_deviation, settings.profile_form_deviation
    if pitch is not None and form is not None:
        return pitch, form
    if settings.quality_class is None:
        raise ValueError("K_v needs quality_class, or base_pitch_deviation and profile_form_deviation, of both gears")
    limits = ToleranceClass.of(gear, settings.quality_class)
    if pitch is None:
        pitch = limits.single_pitch * jnp.cos(geometry.transverse_pressure_angle)
    return pitch, limits.profile_form if form is None else form


def run_in(gear: GearRating, deviation: Scalar, velocity: Scalar) -> Scalar:
    """y [um]: what running in takes off a deviation [um] on flanks of this material, at a velocity [m/s]."""
    kind = gear.group.kind.running_in
    if kind == "hard":
        return jnp.minimum(_RUN_IN_HARD[0] * deviation, _RUN_IN_HARD[1])
    per = jnp.ones_like(deviation) if kind == "cast" else 1 / gear.pitting_strength
    share, slow, fast = (number * per for number in (_RUN_IN_CAST if kind == "cast" else _RUN_IN_SOFT))
    most = jnp.where(velocity > _FAST, fast, jnp.where(velocity > _SLOW, slow, jnp.inf))
    return jnp.minimum(jnp.minimum(share, 1.0) * deviation, most)


def _mean_run_in(rating: Rating, deviation: Scalar, velocity: Scalar) -> Scalar:
    first, second = (run_in(gear, deviation, velocity) for gear in rating.gears)
    return 0.5 * (first + second)


def running_in_relief(rating: Rating) -> Scalar:
    """C_ay [um], tip relief that running in makes: the mean of both materials."""
    per, least, divisor, offset = _RUN_IN_RELIEF
    limits = jnp.stack([gear.pitting_strength for gear in rating.gears])
    return jnp.mean((limits / per - least) ** 2 / divisor + offset)


def reduced_mass(pair: GearPair, geometry: MeshGeometry, rating: Rating) -> Scalar:
    """m_red = m_1 m_2 / (m_1 + m_2) [kg/mm] of m_i = J_i / (b r_bi^2), J given or of a ring from bore to mid tooth.

    A ring gear reaches from mid tooth to its rim diameter.
    """
    first, second = (
        _mass(gear) if settings.moment_of_inertia is None else _given_mass(gear, settings.moment_of_inertia, geometry)
        for gear, settings in zip(pair.gears, rating.gears)
    )
    return first * second / (first + second)


def _given_mass(gear: Gear, inertia: Scalar, geometry: MeshGeometry) -> Scalar:
    return inertia / (geometry.face_width * (_MM * gear.base_radius) ** 2)


def _mass(gear: Gear) -> Scalar:
    """Moment of inertia per face width over the squared base radius [kg/mm]."""
    outer = 0.5 * (gear.tip_radius + gear.root_circle_radius)
    inner = jnp.zeros_like(outer) if gear.bore_diameter is None else gear.bore_radius
    if gear.is_internal:
        outer, inner = gear.bore_radius, outer
    # density in kg/m^3 is 1e-9 kg/mm^3
    return jnp.pi / 2 * gear.material.density * _MM**3 * (outer**4 - inner**4) / gear.base_radius**2


def resonance_speed(teeth: Given, mesh_stiffness: Given, reduced_mass: Given) -> Scalar:
    """n_E1 = 30000 / (pi z_1) sqrt(c_gamma_alpha / m_red) [rpm], where teeth come in at the natural frequency.

    Args:
        teeth: of the pinion, z_1.
        mesh_stiffness: c_gamma_alpha [N/(mm um)].
        reduced_mass: m_red [kg/mm].
    """
    return 30_000 / (jnp.pi * real(teeth)) * jnp.sqrt(real(mesh_stiffness) / real(reduced_mass))


def constants_of(contact_ratio: Given) -> Float[Array, " seven"]:
    """C_v1 ... C_v7 at a total contact ratio above 1 (table 8 of ISO 6336-1:2006)."""
    ratio = real(contact_ratio)
    high = ratio > 2
    above = jnp.where(high, ratio, 2.5)  # no pole for what is not taken
    one = jnp.ones_like(ratio)
    seventh = jnp.where(ratio <= 1.5, 0.75, jnp.where(ratio > 2.5, 1.0, 0.125 * jnp.sin(jnp.pi * (ratio - 2)) + 0.875))
    return jnp.stack(
        [
            0.32 * one,
            jnp.where(high, 0.57 / (above - 0.3), 0.34),
            jnp.where(high, 0.096 / (above - 1.56), 0.23),
            jnp.where(high, (0.57 - 0.05 * above) / (above - 1.44), 0.90),
            0.47 * one,
            jnp.where(high, 0.12 / (above - 1.74), 0.47),
            seventh,
        ]
    )


def factor_of(
    resonance_ratio: Given,
    main_begins: Given,
    pitch: Given,
    form: Given,
    relief: Given,
    constants: Float[Array, " seven"],
) -> Scalar:
    """K_v from N, N_S, B_p, B_f, B_k and C_v1 ... C_v7.

    Up to N_S it rises with N, to 1.15 it is that of the main resonance, from 1.5 on that of supercritical speed, and
    linear between. At N_S it jumps, as the standard has it.
    """
    c1, c2, c3, c4, c5, c6, c7 = constants
    low = resonance_ratio * (c1 * pitch + c2 * form + c3 * relief) + 1
    main = c1 * pitch + c2 * form + c4 * relief + 1
    fast = c5 * pitch + c6 * form + c7
    between = fast + (main - fast) * (_INTERMEDIATE - resonance_ratio) / (_INTERMEDIATE - _MAIN)
    upper = jnp.where(resonance_ratio <= _MAIN, main, jnp.where(resonance_ratio < _INTERMEDIATE, between, fast))
    return jnp.where(resonance_ratio <= main_begins, low, upper)
