"""Dynamic factor K_v of ISO 6336-1, method B: what the standard expects, beside what the dynamics find; and the
transverse load factors K_Halpha and K_Falpha, which rest on it."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..compliance import IsoStiffness, iso_stiffness
from ..contact.status import Status, Statuses, status_of
from ..geometry import Gear, GearPair, path_of_contact
from ..metrics.stress import contact_factor_squares
from ..numerics import Checked, Given, check, optional_real, program, real, result
from ..tolerance import ToleranceClass

Scalar = Float[Array, ""]

_MM = 1e-3
_RUN_IN = 0.075  # of a deviation, that case-hardened and nitrided flanks wear off
_LEAST_SPEED = 3.0  # [m/s] of v z_1 / 100 sqrt(u^2 / (1 + u^2)), below which method B is of little use
_MAIN, _INTERMEDIATE = 1.15, 1.5  # ends of the main and the intermediate range of N


class IsoDynamicFactor(Checked):
    """K_v of ISO 6336-1, method B, and the terms it is made of.

    Constants and equations (6) to (22) as coded in `MATISO_6336.m` of github.com/gfsReboucas/Drivetrain after the 2006
    edition; the standard itself was not at hand. They come from teeth of steel with the damping and the scatter of
    industrial gears: a resonance with loss of contact, as an oscillator with few per cent of damping has it, is far
    above. Use K_v to order designs.

    Attributes:
        factor: K_v.
        resonance_ratio: N = n_1 / n_E1.
        main_resonance_begins: N_S, 0.85; lower for line loads below 100 N/mm.
        resonance_speed: n_E1 of the pinion = 30000 / (pi z_1) sqrt(c_gamma_alpha / m_red).
        line_load: w = K_A F_t / b.
        reduced_mass: m_red, per face width on the line of action.
        pitch, form, relief: B_p, B_f, B_k.
        constants: C_v1 ... C_v7, shape (7,).
        usable_speed: v z_1 / 100 sqrt(u^2 / (1 + u^2)); below 3 m/s method B is of little use.
    """

    factor: Scalar = result()
    resonance_ratio: Scalar = result()
    main_resonance_begins: Scalar = result()
    resonance_speed: Scalar = result("rpm")
    line_load: Scalar = result("N/mm")
    reduced_mass: Scalar = result("kg/mm")
    pitch: Scalar = result()
    form: Scalar = result()
    relief: Scalar = result()
    constants: Float[Array, " seven"] = result()
    usable_speed: Scalar = result("m/s")

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
        return status_of({Status.OUT_OF_VALIDITY: ~(self.usable_speed >= _LEAST_SPEED)})


def iso_dynamic_factor(
    pair: GearPair,
    torque: Given,
    speed: Given,
    *,
    quality_class: Given | None = None,
    deviations: tuple[Given, Given] | None = None,
    tip_relief: Given = 0.0,
    application_factor: Given = 1.0,
    reduced_mass: Given | None = None,
    run_in: Given = _RUN_IN,
) -> IsoDynamicFactor:
    """K_v of a gear pair.

    B_p = c' f_pb_eff / w, B_f = c' f_falpha_eff / w, B_k = |1 - c' C_a / w|, with C_v1 ... C_v7 at the total contact
    ratio eps_gamma = eps_alpha + eps_beta and the transverse base pitch deviation f_pb = f_p cos(alpha_t).

    Args:
        pair: gear pair.
        torque: on the pinion, more than 0 [N m].
        speed: of the pinion [rpm].
        quality_class: flank tolerance class of both gears (ISO 1328-1:2013), of which the larger base pitch and form
            deviation count; None for gears without deviation.
        deviations: f_pb and f_falpha [um], the larger of both gears, in place of a class: measured, or of an earlier
            edition of the standard.
        tip_relief: C_a [um]; for flanks without any the standard takes what running in wears off,
            `sizing.run_in_relief`.
        application_factor: K_A.
        reduced_mass: m_red [kg/mm]; None for rings from bore to the middle of tip and root diameter (a solid disc where
            the gear has no bore), as the standard simplifies.
        run_in: share of the deviations that running in takes away, y_p and y_f over them; 0.075 for case-hardened or
            nitrided gears (without the standard's upper limits in um).
    """
    check("torque", torque, "N m", low=0.0, open_low=True)
    check("speed", speed, "rpm", low=0.0)
    check("tip_relief", tip_relief, "um", low=0.0)
    check("application_factor", application_factor, "", low=0.0, open_low=True)
    check("reduced_mass", reduced_mass, "kg/mm", low=0.0, open_low=True)
    check("run_in", run_in, "", low=0.0, high=1.0)
    return _factor(
        pair,
        real(torque),
        real(speed),
        real(tip_relief),
        real(application_factor),
        real(run_in),
        *_deviations(pair, quality_class, deviations),
        optional_real(reduced_mass),
    )


class TransverseLoadFactors(Checked):
    """How unevenly pairs share the load for their base pitch deviations, by ISO 6336-1, method B.

    Attributes:
        contact: K_Halpha.
        root: K_Falpha.
    """

    contact: Scalar = result()
    root: Scalar = result()


def transverse_load_factors(
    pair: GearPair,
    torque: Given,
    *,
    quality_class: Given | None = None,
    deviations: tuple[Given, Given] | None = None,
    dynamic_factor: Given = 1.0,
    face_load_factor: Given = 1.0,
    application_factor: Given = 1.0,
    run_in: Given = _RUN_IN,
) -> TransverseLoadFactors:
    """K_Halpha and K_Falpha of a gear pair.

    0.9 + 0.4 c_gamma_alpha (f - y_alpha) / (F_tH / b), F_tH = F_t K_A K_v K_Hbeta, with the larger f of f_pb and
    f_falpha and the running-in y_alpha of f_pb; of total contact ratios eps_gamma up to 2 times eps_gamma / 2, above it
    with a second term times sqrt(2 (eps_gamma - 1) / eps_gamma). At least 1; at most eps_gamma / (eps_alpha Z_eps^2)
    and eps_gamma / (0.25 eps_alpha + 0.75), one pair that carries all. Equations (73) to (76) of the edition of 2006,
    from the source of `IsoDynamicFactor`; f as the report of a commercial program has it (1.069).

    Args:
        pair: gear pair.
        torque: on the pinion, more than 0 [N m].
        quality_class, deviations, application_factor, run_in: as of `iso_dynamic_factor`.
        dynamic_factor: K_v.
        face_load_factor: K_Hbeta.
    """
    check("torque", torque, "N m", low=0.0, open_low=True)
    check("dynamic_factor", dynamic_factor, "", low=0.0, open_low=True)
    check("face_load_factor", face_load_factor, "", low=0.0, open_low=True)
    check("application_factor", application_factor, "", low=0.0, open_low=True)
    check("run_in", run_in, "", low=0.0, high=1.0)
    load = _line_load(pair, real(torque), real(application_factor))
    pitch, form = _deviations(pair, quality_class, deviations)
    deviation = jnp.maximum(pitch, form) - pitch * real(run_in)
    moved = iso_stiffness(pair, load).mesh * deviation / (load * real(dynamic_factor) * real(face_load_factor))
    path = path_of_contact(pair)
    along, total = path.contact_ratio, path.contact_ratio + pair.overlap_ratio
    above = jnp.maximum(total, 2.0)
    factor = (0.9 + 0.4 * jnp.sqrt(2 * (above - 1) / above) * moved) * jnp.minimum(total, 2.0) / 2
    limits = along * contact_factor_squares(pair, path).contact_ratio, 0.25 * along + 0.75
    return TransverseLoadFactors(*(jnp.clip(factor, 1.0, total / limit) for limit in limits))


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


def _deviations(pair: GearPair, quality_class, given) -> tuple[Scalar, Scalar]:
    """f_pb and f_falpha [um], the larger of both gears': given, of a class, or zero."""
    if given is not None:
        if quality_class is not None:
            raise ValueError(f"deviations have no effect beside quality_class = {quality_class}, give either")
        for value in given:
            check("deviations", value, "um", low=0.0)
        return real(given[0]), real(given[1])
    if quality_class is None:
        return real(0.0), real(0.0)
    gears = [(gear, ToleranceClass.of(gear, quality_class)) for gear in (pair.pinion, pair.wheel)]
    base = [limits.single_pitch * jnp.cos(gear.transverse_pressure_angle) for gear, limits in gears]
    return jnp.maximum(*base), jnp.maximum(*(limits.profile_form for _, limits in gears))


def _line_load(pair: GearPair, torque: Scalar, application: Scalar) -> Scalar:
    """K_A F_t / b [N/mm]."""
    return 1e3 * torque * application / pair.pinion.pitch_radius / pair.face_width


def _total_contact_ratio(pair: GearPair) -> Scalar:
    return path_of_contact(pair).contact_ratio + pair.overlap_ratio


@program
def _factor(pair, torque, speed, tip_relief, application, run_in, pitch, form, mass) -> IsoDynamicFactor:
    pinion = pair.pinion
    load = _line_load(pair, torque, application)
    stiffness: IsoStiffness = iso_stiffness(pair, load)
    mass = _reduced_mass(pair) if mass is None else mass
    resonance = resonance_speed(pinion.teeth, stiffness.mesh, mass)
    compared = stiffness.single / load
    terms = (
        compared * (1 - run_in) * pitch,
        compared * (1 - run_in) * form,
        jnp.abs(1 - compared * tip_relief),
    )
    ratio = speed / resonance
    begins = jnp.where(load >= 100, 0.85, 0.5 + 0.35 * jnp.sqrt(jnp.minimum(load, 100.0) / 100))
    constants = constants_of(_total_contact_ratio(pair))
    pitch_line = 2 * jnp.pi * pinion.pitch_radius * _MM * speed / 60
    u = pair.gear_ratio
    usable = pitch_line * pinion.teeth / 100 * u / jnp.sqrt(1 + u**2)
    factor = factor_of(ratio, begins, *terms, constants)
    return IsoDynamicFactor(factor, ratio, begins, resonance, load, mass, *terms, constants, usable)


def _reduced_mass(pair: GearPair) -> Scalar:
    """m_red [kg/mm] from m_i* = J_i* / r_bi^2 of rings."""
    first, second = (_mass(gear) for gear in (pair.pinion, pair.wheel))
    return first * second / (first + second)


def _mass(gear: Gear) -> Scalar:
    """Moment of inertia per face width over the squared base radius [kg/mm]."""
    outer = 0.5 * (gear.tip_radius + gear.root_circle_radius)
    inner = jnp.zeros_like(outer) if gear.bore_diameter is None else gear.bore_radius
    # density in kg/m^3 is 1e-9 kg/mm^3
    return jnp.pi / 2 * gear.material.density * _MM**3 * (outer**4 - inner**4) / gear.base_radius**2
