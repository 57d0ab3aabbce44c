"""Micropitting by method B: the oil film at points of the path of contact, by the standard's sharing of the load.

Method A of the same standard has pressures and temperatures of a contact analysis in place of those of the points: that
is `metrics.micropitting_safety`, of the film at every contact. What both permit is the specific film thickness of a
test of the oil, `permissible_film_thickness`.

References:
    ISO/TS 6336-22 (ISO/TR 15144-1).
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..metrics.lubricant import Lubricant
from ..metrics.lubrication import film_between, flash_rise, helical_load_factor_at, loss_rise
from ..numerics import Checked, Given, result
from .load_sharing import MeshLoad, load_sharing, pitch_point_friction, points_of
from .losses import mesh_loss
from .mesh_geometry import MeshGeometry, OfGears, Scalar, reduced_modulus
from .settings import GearRating

_TEST_SHARE = 1.4  # of the film of the test that is permitted
_LEAST_PRESSURE = 1e-3  # MPa, where relief takes a pair out of contact
# W_W; case-hardened with at most 25 % austenite
_MATERIAL_FACTORS = {
    "case_hardened": 1.0,
    "induction_hardened": 0.65,
    "through_hardened": 0.5,
    "through_hardened_carbon": 0.5,
    "through_hardened_cast": 0.5,
    "through_hardened_carbon_cast": 0.5,
}
_NITRIDED, _HARD_NITRIDED = 1.5, 850.0  # W_W, and from which hardness on [HV]
# FZG micropitting test C-GF/8.3/90 (FVA 54) at point A: z 16/24, m 4.5, a 91.5, d_a 82.46/118.36, b 14, 2250 rpm
_TEST_OIL, _TEST_ROUGHNESS = 90.0, 0.5  # degC, um
_TEST_RADIUS, _TEST_SPEEDS = 3.8996, (1.05376, 4.78353)  # rho_A [mm], surface speeds [m/s]
_TEST_MODULUS = 226_374.0  # E_r of steel [MPa]
# as published of stage 10 with a mineral oil of 220/19 mm2/s
_STAGE_TORQUE, _STAGE_LOAD = 265.1, 236.3  # N m, N/mm
_STAGE_BULK, _STAGE_CONTACT, _STAGE_VISCOSITY = 127.7, 251.7, 21.42  # degC, degC, mPa s at 90 degC


class Micropitting(Checked):
    """Micropitting by method B; arrays (points,) at A, AB, B, C, D, DE, E.

    Attributes:
        helical_load_factor: K_Bgamma.
        friction: mu, mean coefficient of friction.
        roughness_factor: X_R.
        tip_relief_factor: X_Ca.
        loss_power: P mu H_v at the nominal torque.
        bulk_temperature: theta_M.
        reduced_modulus: E_r.
        normal_radius: rho_n.
        sharing_factor: X_Y.
        nominal_pressure: p_H, without load factors.
        pressure: p_dyn.
        contact_temperature: theta_B.
        film_thickness: h.
        specific_film_thickness: lambda = h / Ra.
        min_specific_film_thickness: the smallest of them.
        permissible_film: lambda_GFP; NaN where neither it nor a test is given.
        safety: S_lambda.
    """

    helical_load_factor: Scalar = result()
    friction: Scalar = result()
    roughness_factor: Scalar = result()
    tip_relief_factor: Scalar = result()
    loss_power: Scalar = result("W")
    bulk_temperature: Scalar = result("degC")
    reduced_modulus: Scalar = result("MPa")
    normal_radius: Float[Array, " points"] = result("mm")
    sharing_factor: Float[Array, " points"] = result()
    nominal_pressure: Float[Array, " points"] = result("MPa")
    pressure: Float[Array, " points"] = result("MPa")
    contact_temperature: Float[Array, " points"] = result("degC")
    film_thickness: Float[Array, " points"] = result("um")
    specific_film_thickness: Float[Array, " points"] = result()
    min_specific_film_thickness: Scalar = result()
    permissible_film: Scalar = result()
    safety: Scalar = result()


def micropitting(
    geometry: MeshGeometry, load: MeshLoad, lubricant: Lubricant, material_factors: OfGears
) -> Micropitting:
    """Micropitting by method B.

        p_dyn = Z_E (F_bt X_Y / (b rho_n) K_A K_gamma K_v K_Hbeta K_Halpha)^0.5
        theta_M = theta_oil + 7400 (P mu H_v / (a b))^0.72 X_S / (1.2 X_Ca)

    with the film of `metrics.film_thickness` and the flash temperature of `metrics.flash_temperature`, each at p_dyn.
    X_Ca is 1 without relief and grows linearly to that of a tip relief of C_eff on both gears.

    Args:
        geometry: of the mesh.
        load: of the mesh.
        lubricant: with `permissible_film`, `micropitting_test` or `micropitting_test_film` for a safety.
        material_factors: W_W of both gears.
    """
    helical, path = helical_load_factor_at(geometry.total_contact_ratio), points_of(geometry)
    inclined, oil = jnp.cos(geometry.base_helix_angle), lubricant.temperature
    nominal = geometry.base_force(load.torque) / geometry.face_width
    line_load = nominal * load.load_factors * helical
    friction, radius_at_pitch = pitch_point_friction(geometry, load, lubricant, "iso_6336_22", line_load)
    loss = mesh_loss(geometry, load, friction)
    relieved = _tip_relief_factor(geometry, load)
    area = geometry.center_distance * geometry.face_width
    bulk = oil + lubricant.cooling_factor * loss_rise(loss, area) / relieved
    sharing, radius = load_sharing(geometry, load, path), geometry.reduced_radius(path) / inclined
    modulus = 0.5 * reduced_modulus(geometry)
    static = jnp.sqrt(modulus / jnp.pi * nominal * sharing / radius)
    pressure = static * jnp.sqrt(load.load_factors)
    speeds = geometry.surface_speeds(path, load.speed)
    along = jnp.pi * pressure**2 * radius / modulus  # line load of this pressure
    hot = bulk + flash_rise(friction, along, radius, modulus, speeds, tuple(geometry.thermal_contact_coefficient))
    loaded = jnp.maximum(pressure, _LEAST_PRESSURE)
    film = film_between(lubricant, radius, speeds[0] + speeds[1], loaded, 2 * modulus, (bulk, hot))
    specific = film / lubricant.roughness
    permitted, least = permissible_film_thickness(lubricant, material_factors), jnp.min(specific)
    return Micropitting(
        helical_load_factor=helical,
        friction=friction,
        roughness_factor=2.2 * (lubricant.roughness / radius_at_pitch) ** 0.25,
        tip_relief_factor=relieved,
        loss_power=loss,
        bulk_temperature=bulk,
        reduced_modulus=2 * modulus,
        normal_radius=radius,
        sharing_factor=sharing,
        nominal_pressure=static,
        pressure=pressure,
        contact_temperature=hot,
        film_thickness=film,
        specific_film_thickness=specific,
        min_specific_film_thickness=least,
        permissible_film=permitted,
        safety=least / permitted,
    )


def permissible_film_thickness(lubricant: Lubricant, material_factors: OfGears) -> Scalar:
    """lambda_GFP, the specific film thickness that is permitted; NaN where no test is given.

    As given, or 1.4 W_W lambda_GFT with the mean factor of both materials.

    Args:
        lubricant: with its tests.
        material_factors: W_W of both gears, see `material_factor`.
    """
    if lubricant.permissible_film is not None:
        return lubricant.permissible_film
    if lubricant.micropitting_test_film is not None:
        film = lubricant.micropitting_test_film
    elif lubricant.micropitting_test is not None:
        film = film_of_test(lubricant, lubricant.micropitting_test)
    else:
        return jnp.full_like(lubricant.temperature, jnp.nan)
    return _TEST_SHARE * jnp.mean(material_factors) * film


def material_factor(gear: GearRating) -> Scalar:
    """W_W of a gear, by its heat treatment; NaN where the standard has none.

    Gas nitrided gears have 1.5 above 850 HV, and of less hardness 1, that of case-hardened ones.
    """
    if gear.heat_treatment == "gas_nitrided":
        hard = gear.hardness is not None and gear.hardness > _HARD_NITRIDED
        return jnp.where(hard, _NITRIDED, jnp.ones_like(gear.contacts_per_revolution))
    return jnp.full_like(gear.contacts_per_revolution, _MATERIAL_FACTORS.get(gear.heat_treatment or "", jnp.nan))


def film_of_test(lubricant: Lubricant, torque: Given) -> Scalar:
    """lambda_GFT at point A of the FZG micropitting test C-GF/8.3/90, with its own oil at 90 degC.

    Line load and temperatures are those published of stage 10, at other torques and oils by the laws of this standard:
    coefficient of friction with T^0.2 eta^-0.05 X_L, heat of the flanks with the 0.72nd power of the loss, flash
    temperature with T^0.75.

    Args:
        lubricant: oil.
        torque: of the pinion at the failure stage [N m].
    """
    stage = jnp.asarray(torque, lubricant.temperature.dtype) / _STAGE_TORQUE
    viscosity = 1e3 * lubricant.viscosity(jnp.full_like(lubricant.temperature, _TEST_OIL))
    friction = stage**0.2 * (viscosity / _STAGE_VISCOSITY) ** -0.05 * lubricant.slipperiness
    bulk = _TEST_OIL + (_STAGE_BULK - _TEST_OIL) * (stage * friction) ** 0.72
    hot = bulk + (_STAGE_CONTACT - _STAGE_BULK) * friction * stage**0.75
    pressure = jnp.sqrt(_STAGE_LOAD * stage * _TEST_MODULUS / (2 * jnp.pi * _TEST_RADIUS))
    radius, rolling, modulus = (
        jnp.full_like(bulk, number) for number in (_TEST_RADIUS, sum(_TEST_SPEEDS), _TEST_MODULUS)
    )
    film = film_between(lubricant, radius, rolling, pressure, modulus, (bulk, hot))
    return film / _TEST_ROUGHNESS


def _tip_relief_factor(geometry: MeshGeometry, load: MeshLoad) -> Scalar:
    """X_Ca: 1 without relief, 1 + 0.24 e_max + 0.71 e_max^2 with that for the load."""
    share = jnp.minimum(jnp.min(load.tip_relief) / load.effective_relief(geometry), 1.0)
    largest = jnp.max(geometry.tip_contact_ratio)
    return 1 + share * (0.24 * largest + 0.71 * largest**2)
