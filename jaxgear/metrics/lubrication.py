"""Friction, heat, film and power loss of a lubricated mesh, at the line loads of its contact analysis.

Loads, pressures and sliding are those of the cycle; what the standards work out at a few points of the path of contact
with shares of the load and factors for its distribution, stands here at every contact point.

Of helical gears every slice is at its own place on the transverse path of contact. Flanks slide over each other in the
transverse section, across the contact line; radii of curvature are those of the section normal to that line, rho /
cos(beta_b), and line loads are per length of it.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..compliance.plane import combined_modulus
from ..contact import MeshCycle
from ..geometry import GearPair, path_of_contact, reduced_radius
from ..numerics import Given, check, over_batch, real, safe_divide, safe_power, safe_sqrt
from .load_distribution import slice_forces
from .lubricant import FrictionLaw, Lubricant

Load = Float[Array, "pairs slices positions"]
Real = Float[Array, "..."]

_BLOK_FACTOR = 1.13  # 2 / sqrt(pi), semi-elliptic heat flux (ISO/TS 6336-20, where Blok's own 1.11 is rounded)


def flash_temperature(
    cycle: MeshCycle, speed: Given, *, friction: Given = 0.06
) -> Float[Array, "*cycles pairs slices positions"]:
    """Rise of the flank temperature in the contact [K], at the line loads of this cycle.

        T_fl = 1.13 mu w |v1 - v2| / [(B1 sqrt(v1) + B2 sqrt(v2)) sqrt(2 b_H)]

    Zero where the pair is apart, in corner contact (no flank curvature there), and at the pitch point.

    Args:
        cycle: solved mesh cycle.
        speed: speed of the pinion [rpm], scalar.
        friction: mean coefficient of friction; 0.06 is the leading constant of ISO/TR 13989-1 at unit load and speed
            terms.

    Raises:
        ValueError: for a negative speed or friction.

    References:
        ISO/TS 6336-20 (ISO/TR 13989-1); H. Blok 1937.
    """
    check("speed", speed, "rpm", low=0.0)
    check("friction", friction, "", low=0.0)
    return _flash(cycle, real(speed), real(friction))


@over_batch
def _flash(cycle: MeshCycle, speed, friction) -> Load:
    kinematics, (pinion, wheel) = cycle.kinematics, cycle.sides
    pair = kinematics.pair
    pinion_speed, wheel_speed = kinematics.path_of_contact.rolling_speeds(kinematics.path, speed)
    reduced = _normal(pair, reduced_radius(pinion.contact_roll_length, wheel.contact_roll_length))
    modulus = combined_modulus(pair.pinion.material, pair.wheel.material, kinematics.plane)
    sinks = pair.pinion.material.thermal_contact_coefficient, pair.wheel.material.thermal_contact_coefficient
    rise = flash_rise(friction, cycle.line_load, reduced, modulus, (pinion_speed, wheel_speed), sinks)
    return jnp.where(kinematics.outside <= 0, rise, 0.0)


def flash_rise(
    friction: Given,
    line_load: Given,
    radius: Given,
    modulus: Given,
    speeds: tuple[Given, Given],
    sinks: tuple[Given, Given],
) -> Real:
    """Blok's rise of the temperature of two flanks [K], the formula of `flash_temperature`.

    Args:
        friction: coefficient.
        line_load: along the contact line [N/mm].
        radius: relative radius of curvature in the section normal to it [mm].
        modulus: E* of both flanks [MPa].
        speeds: speeds of both surfaces through the contact [m/s].
        sinks: thermal contact coefficients of both materials [N/(m s^0.5 K)].
    """
    half_width = safe_sqrt(4 * line_load * radius / modulus / jnp.pi) * 1e-3  # [m]
    heat = friction * line_load * 1e3 * jnp.abs(speeds[0] - speeds[1])
    taken = sinks[0] * safe_sqrt(speeds[0]) + sinks[1] * safe_sqrt(speeds[1])
    # no heat makes no rise, also where it is not conducted; heat that is not finite stays so
    return _BLOK_FACTOR * safe_divide(heat, taken * safe_sqrt(2 * half_width), default=0.0 * heat)


def _normal(pair: GearPair, radius: Float[Array, "..."]) -> Float[Array, "..."]:
    """A relative radius of curvature of the transverse section [mm], in the section normal to the contact line."""
    return radius / jnp.cos(pair.pinion.base_helix_angle)


Scalar = Float[Array, ""]


@over_batch
def loss_factor(cycle: MeshCycle) -> Scalar:
    """Loss factor H_VL of the loaded mesh: loss power = input power * friction coefficient * H_VL.

        H_VL = 1 / (p_et b cos(beta_b)) int int (f_N b / F_bt) (v_g / v_tb) dx dy

    with the line load f_N of this cycle, the sliding speed v_g and the speed of the base circles v_tb. Corner contact
    counts with the sliding speed at its path position. Of helical gears the friction is that of the normal force,
    F_bt / cos(beta_b). Zero at zero torque.

    References:
        A. Wimmer, Lastverluste von Stirnradverzahnungen, TU Muenchen 2006.
    """
    kinematics = cycle.kinematics
    contact = kinematics.path_of_contact
    # sliding over base-circle speed: v_g / v_tb = |s| (1 / r_b1 + 1 / r_b2)
    sliding = jnp.abs(kinematics.path) * (1 / contact.pinion_base_radius + 1 / contact.wheel_base_radius)
    force = slice_forces(cycle) / jnp.cos(kinematics.pair.pinion.base_helix_angle)
    return safe_divide(jnp.sum(jnp.mean(force * sliding, axis=-1)), cycle.force)


def ohlendorf_loss_factor(pair: GearPair) -> Scalar:
    """Loss factor H_v of the geometry alone, for contact ratios from 1 to 2.

        H_v = pi (u + 1) / (z1 u cos(beta_b)) (1 - eps + eps1^2 + eps2^2)

    References:
        H. Ohlendorf, Verlustleistung und Erwaermung von Stirnraedern, TH Muenchen 1958; G. Niemann, H. Winter,
        Maschinenelemente II.
    """
    path = path_of_contact(pair)
    ratios = path.end / path.base_pitch, -path.start / path.base_pitch
    return loss_factor_at(pair.pinion.teeth, pair.signed_gear_ratio, ratios, pair.pinion.base_helix_angle)


def loss_factor_at(teeth: Real, gear_ratio: Real, tip_contact_ratios: tuple[Real, Real], base_helix: Real) -> Real:
    """`ohlendorf_loss_factor` of the teeth of the pinion, u, the contact ratios eps_1, eps_2, and beta_b [rad]; u is
    negative with a ring gear.
    """
    recess, approach = tip_contact_ratios
    share = 1 - (recess + approach) + recess**2 + approach**2
    return jnp.pi * (gear_ratio + 1) / (teeth * gear_ratio) * share / jnp.cos(base_helix)


# leading constants of the laws of friction
_SCHLENK, _ISO_20, _ISO_22 = 0.048, 0.060, 0.045
_ISO_22_ROUGHNESS = 2.2
FLASH_SHARE = 0.47  # of the mean flash temperature that the teeth take on (ISO/TS 6336-20)
# rise of the bulk temperature [K] with kW per mm2 of centre distance times face width; 1.2 for spray (ISO/TS 6336-22)
_LOSS_RISE, _LOSS_EXPONENT, _SPRAY = 7400.0, 0.72, 1.2
_FILM = 1.6  # film thickness over radius (Dowson and Higginson, as in ISO/TS 6336-22)
_THICKEST = 1000.0  # um, of the film where the flanks are apart or touch with a tip edge


@over_batch
def friction_coefficient(cycle: MeshCycle, lubricant: Lubricant) -> Scalar:
    """Mean coefficient of friction of the mesh; zero without load.

        mu = c (w / (v rho))^0.2 eta^-0.05 X_R X_L

    with the line load w [N/mm], the sum of both rolling speeds v [m/s] and the normal relative radius rho [mm] at the
    pitch point, and the viscosity eta [mPa s] at the temperature of the oil. By `lubricant.friction`, with the load
    factors K of the lubricant and `helical_load_factor` K_Bgamma,

        "schlenk"      c = 0.048, X_R = Ra^0.25,               w = F_bt / b
        "iso_6336_20"  c = 0.060, X_R = Ra^0.25,               w = K F_t / b
        "iso_6336_22"  c = 0.045, X_R = 2.2 (Ra / rho)^0.25,   w = K K_Bgamma F_bt / b

    F_bt is the force on the transverse line of action, F_t = F_bt cos(alpha_t) that on the reference circle.
    A coefficient that the cycle was solved with (`OperatingPoint.friction`) counts in its place.

    Raises:
        ValueError: for a cycle without a speed, or of speed 0.

    References:
        L. Schlenk, Untersuchungen zur Fresstragfaehigkeit von Grosszahnraedern, TU Muenchen 1994; ISO/TR 13989-1
        (ISO/TS 6336-20); ISO/TR 15144-1 (ISO/TS 6336-22).
    """
    if cycle.operating_point.friction is not None:
        return cycle.operating_point.friction
    speed = _running(cycle)
    check("speed", speed, "rpm", low=0.0, open_low=True)
    contact, pair = cycle.kinematics.path_of_contact, cycle.kinematics.pair
    rolling = sum(contact.rolling_speeds(0.0, speed))
    line_load = cycle.force / pair.face_width
    if lubricant.friction == "iso_6336_22":
        line_load = line_load * lubricant.load_factor * helical_load_factor(pair)
    if lubricant.friction == "iso_6336_20":
        line_load = line_load * jnp.cos(pair.pinion.transverse_pressure_angle) * lubricant.load_factor
    radius = _normal(pair, contact.reduced_radius(0.0))
    return mean_friction(lubricant, lubricant.friction, line_load, rolling, radius)


def mean_friction(lubricant: Lubricant, law: FrictionLaw, line_load: Given, rolling: Given, radius: Given) -> Real:
    """The laws of `friction_coefficient` on their own.

    Args:
        lubricant: lubricant at its own temperature.
        law: one of them; ISO/TS 6336-21 has that of ISO/TS 6336-22.
        line_load: w with what the law counts in it [N/mm].
        rolling: sum of the rolling speeds [m/s].
        radius: relative radius of curvature [mm].
    """
    match law:
        case "iso_6336_22":
            surface = _ISO_22 * _ISO_22_ROUGHNESS * (lubricant.roughness / radius) ** 0.25
        case "iso_6336_20":
            surface = _ISO_20 * lubricant.roughness**0.25
        case _:
            surface = _SCHLENK * lubricant.roughness**0.25
    viscosity = 1e3 * lubricant.viscosity(lubricant.temperature)
    return surface * safe_power(line_load / (rolling * radius), 0.2) * viscosity**-0.05 * lubricant.slipperiness


def helical_load_factor(pair: GearPair) -> Scalar:
    """Helical load factor K_Bgamma of scuffing and micropitting, by the total contact ratio eps_gamma.

        1 up to 2,   1 + 0.2 sqrt((eps_gamma - 2) (5 - eps_gamma)),   1.3 from 3.5 on

    References:
        ISO/TS 6336-21 (ISO/TR 13989-2); ISO/TS 6336-22 (ISO/TR 15144-1).
    """
    return helical_load_factor_at(path_of_contact(pair).contact_ratio + pair.overlap_ratio)


def helical_load_factor_at(total_contact_ratio: Given) -> Real:
    """`helical_load_factor` at a total contact ratio."""
    ratio = jnp.clip(total_contact_ratio, 2.0, 3.5)
    return 1 + 0.2 * safe_sqrt((ratio - 2) * (5 - ratio))


@over_batch
def loss_power(cycle: MeshCycle, lubricant: Lubricant | None = None) -> Scalar:
    """Power loss by friction of the flanks [W]: input power * coefficient of friction * loss factor H_VL.

    Power and loss factor are those of the torque of the cycle: load factors of the lubricant raise the coefficient
    alone.

    Args:
        cycle: solved mesh cycle, with a speed.
        lubricant: that tells the coefficient; None where the cycle was solved with one.

    Raises:
        ValueError: for a cycle without a speed, and without both lubricant and coefficient.
    """
    input_power = cycle.torque * _running(cycle) * jnp.pi / 30
    return input_power * _friction(cycle, lubricant) * loss_factor(cycle)


@over_batch
def mesh_efficiency(cycle: MeshCycle, lubricant: Lubricant | None = None) -> Scalar:
    """Efficiency of the mesh, transmitted over input power, 1 - mu H_VL; arguments and errors as `loss_power`.

    What seals, bearings and churned oil take is not in it.
    """
    return 1 - _friction(cycle, lubricant) * loss_factor(cycle)


@over_batch
def lubricated_flash_temperature(cycle: MeshCycle, lubricant: Lubricant) -> Load:
    """`flash_temperature` [K] with the coefficient of friction of a lubricant, at line loads times its load factor."""
    speed = _running(cycle)
    rise = flash_temperature(cycle, speed, friction=friction_coefficient(cycle, lubricant))
    return rise * lubricant.load_factor**0.75  # heat over the square root of the contact width


@over_batch
def bulk_temperature(cycle: MeshCycle, lubricant: Lubricant) -> Scalar:
    """Bulk temperature of the teeth [degC]: oil temperature and a rise by `lubricant.bulk`.

    "flash"  0.47 X_S T_flm, T_flm the flash temperature as a mean over path of contact and face (ISO/TS 6336-20)
    "loss"   7400 (P / (a b))^0.72 X_S / 1.2 with the loss power P [kW], centre distance and face width [mm]
             (ISO/TS 6336-22); what tip relief spares is in the loss of the contact analysis.
    """
    if lubricant.bulk == "loss":
        area = cycle.kinematics.pair.working_center_distance * cycle.kinematics.pair.face_width
        rise = loss_rise(loss_power(cycle, lubricant), area)
    else:
        rise = FLASH_SHARE * _mean_over_path(cycle, lubricated_flash_temperature(cycle, lubricant))
    return lubricant.temperature + lubricant.cooling_factor * rise


def loss_rise(loss: Given, area: Given) -> Real:
    """Rise of the bulk temperature [K] for a cooling factor of 1, by the law "loss" of `bulk_temperature`.

    Args:
        loss: power loss of the flanks [W].
        area: centre distance times face width [mm^2].
    """
    return _LOSS_RISE * safe_power(1e-3 * loss / area, _LOSS_EXPONENT) / _SPRAY


@over_batch
def contact_temperature(cycle: MeshCycle, lubricant: Lubricant) -> Load:
    """Contact temperature [degC], bulk and flash temperature; bulk temperature without contact."""
    return bulk_temperature(cycle, lubricant) + lubricated_flash_temperature(cycle, lubricant)


@over_batch
def film_thickness(cycle: MeshCycle, lubricant: Lubricant) -> Load:
    """Thickness of the oil film in the contact [um]; 1000 where the flanks are apart or touch with a tip edge.

        h = 1600 rho G^0.6 U^0.7 W^-0.13 S^0.22,      E_r = 2 E*
        G = alpha E_r,  U = eta v / (2 E_r rho),  W = 2 pi p^2 / E_r^2,  S = (alpha eta at the contact) / (alpha eta)

    with the normal relative radius rho [mm] of the involutes, the sum v of the rolling speeds, the pressure p of the
    cycle times the square root of the load factor; viscosity eta and its pressure coefficient alpha at the bulk
    temperature, in S also at the contact temperature. Where the contact is hotter than any oil (510 degC) there is no
    film.

    References:
        D. Dowson, G. R. Higginson, Elasto-hydrodynamic Lubrication, 1966; ISO/TS 6336-22 (ISO/TR 15144-1), method A.
    """
    kinematics, (pinion, wheel) = cycle.kinematics, cycle.sides
    speed = _running(cycle)
    speeds = kinematics.path_of_contact.rolling_speeds(kinematics.path, speed)
    rolling, pair = speeds[0] + speeds[1], kinematics.pair
    radius = _normal(pair, reduced_radius(pinion.contact_roll_length, wheel.contact_roll_length))
    modulus = 2 * combined_modulus(pair.pinion.material, pair.wheel.material, kinematics.plane)
    temperatures = bulk_temperature(cycle, lubricant), contact_temperature(cycle, lubricant)
    pressure = cycle.contact_pressure * jnp.sqrt(lubricant.load_factor)
    apart = pressure <= 0
    film = film_between(lubricant, radius, rolling, jnp.where(apart, 1.0, pressure), modulus, temperatures)
    return jnp.where(apart, _THICKEST, jnp.minimum(film, _THICKEST))


def film_between(
    lubricant: Lubricant, radius: Real, rolling: Real, pressure: Real, modulus: Real, temperatures: tuple[Real, Real]
) -> Real:
    """Film thickness by the formula of `film_thickness` from radius, speed, pressure and temperatures [um].

    Args:
        lubricant: oil.
        radius: normal relative radius of curvature [mm].
        rolling: sum of the rolling speeds [m/s].
        pressure: pressure of Hertz, greater than 0 [MPa].
        modulus: E_r = 2 E* [MPa].
        temperatures: temperatures of the teeth and in the contact [degC].
    """
    bulk, hot = temperatures
    viscosity, coefficient = lubricant.viscosity(bulk), lubricant.pressure_viscosity(bulk)
    material = safe_power(1e6 * coefficient * modulus, 0.6)
    motion = safe_power(viscosity * rolling / (2e3 * modulus * radius), 0.7)
    load = (2 * jnp.pi * (pressure / modulus) ** 2) ** -0.13
    thinning = lubricant.pressure_viscosity(hot) * lubricant.viscosity(hot) / (coefficient * viscosity)
    return 1e3 * _FILM * radius * material * motion * load * safe_power(thinning, 0.22)


@over_batch
def specific_film_thickness(cycle: MeshCycle, lubricant: Lubricant) -> Load:
    """lambda = h / Ra, the film over the mean roughness of both flanks; below 1 the flanks touch."""
    return film_thickness(cycle, lubricant) / lubricant.roughness


def _mean_over_path(cycle: MeshCycle, field: Load) -> Scalar:
    """Mean of a field over the whole path of contact, where it is zero included, and over the face."""
    kinematics = cycle.kinematics
    width = kinematics.slice_width
    over_face = jnp.einsum("psn,s->pn", field, width) / jnp.sum(width)
    # every position stands for as much of the path as there are pairs on it
    return safe_divide(jnp.sum(jnp.mean(over_face, axis=-1)), kinematics.path_of_contact.contact_ratio)


def _friction(cycle: MeshCycle, lubricant: Lubricant | None) -> Scalar:
    if cycle.operating_point.friction is not None:
        return cycle.operating_point.friction
    if lubricant is None:
        raise ValueError("needs a coefficient of friction, solve with OperatingPoint(torque, speed, friction)")
    return friction_coefficient(cycle, lubricant)


def _running(cycle: MeshCycle) -> Scalar:
    """Speed of the pinion [rpm]."""
    speed = cycle.operating_point.speed
    if speed is None:
        raise ValueError("needs a speed, solve with OperatingPoint(torque, speed)")
    return speed
