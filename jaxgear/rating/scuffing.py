"""Scuffing by the flash temperature and by the integral temperature.

Both methods compare a temperature of the contact with one at which the oil of an FZG test failed. Radii of curvature
are those of the transverse section, but that of friction at the pitch point, which is of the normal section. The
contact analysis has temperatures of its own, `metrics.contact_temperature`, at its own line loads.

References:
    ISO/TS 6336-20 (ISO/TR 13989-1), flash temperature; ISO/TS 6336-21 (ISO/TR 13989-2), integral temperature.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..metrics.lubricant import Lubricant
from ..metrics.lubrication import FLASH_SHARE, helical_load_factor_at
from ..numerics import Checked, Given, result
from .load_sharing import MeshLoad, load_sharing, mean_over_path, pitch_point_friction, points_of
from .mesh_geometry import MeshGeometry, OfGears, Real, Scalar, reduced_modulus

# pinion torque of the load stages of the FZG test A/8.3/90 (ISO 14635-1) [N m]; stage 13 is between its neighbours
_STAGES = (5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 14.0)
_STAGE_TORQUES = (94.1, 135.3, 183.4, 239.3, 302.0, 372.6, 450.1, 534.5, 714.2)
_STEEL_FLASH_FACTOR = 50.0  # X_M of common steel, which the constant 2.52 belongs to
_APPROACH = 50.0  # um of missing relief for which X_J grows by 1
_BULK_SHARE = 0.7  # of the mean flash temperature, ISO/TS 6336-21
_INTEGRAL_WEIGHT = 1.5  # C_2, by which the flash temperature counts more than the bulk temperature
_RUNNING_IN = 30.0  # of X_E


class FlashScuffing(Checked):
    """Scuffing by the flash temperature method; arrays (points,) at A, AB, B, C, D, DE, E.

    Attributes:
        line_load: w_Bt, with the load factors.
        effective_relief: C_eff.
        angle_factor: X_alphabeta.
        flash_factor: X_M at the pitch point.
        lubricant_factor: X_L, with the viscosity of the oil in it.
        path_multiplicity_factor: X_mp.
        friction: mu, mean coefficient of friction.
        path_parameter: Gamma, 0 at C.
        approach_factor: X_J.
        sharing_factor: X_Gamma.
        flash_temperature: theta_fl.
        mean_flash_temperature: theta_flm, over the path of contact without approach factor.
        bulk_temperature: theta_M.
        contact_temperature: largest theta_B of the points.
        scuffing_temperature: theta_S; NaN where neither it nor a load stage of the test is given.
        safety: S_B, rise over the oil to the scuffing temperature over that to the contact temperature.
    """

    line_load: Scalar = result("N/mm")
    effective_relief: Scalar = result("um")
    angle_factor: Scalar = result()
    flash_factor: Scalar = result("K s^0.5 m^0.5 mm/N^0.75")
    lubricant_factor: Scalar = result()
    path_multiplicity_factor: Scalar = result()
    friction: Scalar = result()
    path_parameter: Float[Array, " points"] = result()
    approach_factor: Float[Array, " points"] = result()
    sharing_factor: Float[Array, " points"] = result()
    flash_temperature: Float[Array, " points"] = result("K")
    mean_flash_temperature: Scalar = result("K")
    bulk_temperature: Scalar = result("degC")
    contact_temperature: Scalar = result("degC")
    scuffing_temperature: Scalar = result("degC")
    safety: Scalar = result()


class IntegralScuffing(Checked):
    """Scuffing by the integral temperature method.

    Attributes:
        effective_relief: C_eff, with the single stiffness c' of spur gears.
        helical_load_factor: K_Bgamma.
        friction: mu, mean coefficient of friction.
        roughness_factor: X_R.
        running_in_factor: X_E.
        geometry_factor: X_BE.
        approach_factor: X_Q.
        tip_relief_factor: X_Ca.
        contact_ratio_factor: X_eps.
        tip_flash_temperature: theta_flaE, at the tip of the pinion without sharing of the load.
        mean_flash_temperature: theta_flaint.
        bulk_temperature: theta_M.
        integral_temperature: theta_int.
        scuffing_temperature: theta_intS; NaN without the load stage of a test.
        test_bulk_temperature, test_flash_temperature: theta_MT and theta_flaintT of that test.
        safety: S_intS = theta_intS / theta_int.
        load_safety: S_SL, on the torque as far as temperatures rise with it, over the temperature of the oil.
    """

    effective_relief: Scalar = result("um")
    helical_load_factor: Scalar = result()
    friction: Scalar = result()
    roughness_factor: Scalar = result()
    running_in_factor: Scalar = result()
    geometry_factor: Scalar = result()
    approach_factor: Scalar = result()
    tip_relief_factor: Scalar = result()
    contact_ratio_factor: Scalar = result()
    tip_flash_temperature: Scalar = result("K")
    mean_flash_temperature: Scalar = result("K")
    bulk_temperature: Scalar = result("degC")
    integral_temperature: Scalar = result("degC")
    scuffing_temperature: Scalar = result("degC")
    test_bulk_temperature: Scalar = result("degC")
    test_flash_temperature: Scalar = result("K")
    safety: Scalar = result()
    load_safety: Scalar = result()


def flash_scuffing(geometry: MeshGeometry, load: MeshLoad, lubricant: Lubricant) -> FlashScuffing:
    """Scuffing by the flash temperature method.

        theta_fl = 2.52 mu (X_M / 50) X_J (X_Gamma w_Bt)^0.75 (n_1 / 60)^0.5 |rho_1^0.5 - (rho_2 / u)^0.5| / rho^0.25
        theta_M = theta_oil + 0.47 X_S X_mp theta_flm,   theta_B = theta_M + theta_fl
        theta_S = 80 + (0.85 + 1.4 X_W) X_L S_FZG^2

    The largest temperature is that of the seven points; of equal ones the derivative is the mean of theirs.

    Args:
        geometry: of the mesh.
        load: of the mesh.
        lubricant: with `fzg_stage` or `scuffing_temperature` for a safety.

    References:
        ISO/TS 6336-20 (ISO/TR 13989-1).
    """
    line_load = load.line_load(geometry)
    friction, _ = pitch_point_friction(geometry, load, lubricant, "iso_6336_20", line_load)

    def rise(path: Real) -> Real:
        pinion, wheel = geometry.curvatures(path)
        slip = jnp.abs(jnp.sqrt(pinion) - jnp.sqrt(wheel / geometry.gear_ratio))
        heat = (load_sharing(geometry, load, path) * line_load) ** 0.75 * jnp.sqrt(load.speed / 60)
        flash = flash_factor(geometry, path) / _STEEL_FLASH_FACTOR
        return 2.52 * friction * flash * heat * slip / geometry.reduced_radius(path) ** 0.25

    path, relief = points_of(geometry), load.effective_relief(geometry)
    parameter = path / geometry.tangent_lengths[0]
    approach = _approach(parameter, relief - load.tip_relief[1])
    flash, mean = approach * rise(path), mean_over_path(geometry, rise)
    multiple = 0.5 * (1 + load.meshes)
    oil = lubricant.temperature
    bulk = oil + FLASH_SHARE * lubricant.cooling_factor * multiple * mean
    hottest = bulk + jnp.max(flash)
    limit = scuffing_temperature(lubricant)
    return FlashScuffing(
        line_load=line_load,
        effective_relief=relief,
        angle_factor=angle_factor(geometry),
        flash_factor=flash_factor(geometry, 0.0),
        lubricant_factor=_lubricant_factor(lubricant),
        path_multiplicity_factor=multiple,
        friction=friction,
        path_parameter=parameter,
        approach_factor=approach,
        sharing_factor=load_sharing(geometry, load, path),
        flash_temperature=flash,
        mean_flash_temperature=mean,
        bulk_temperature=bulk,
        contact_temperature=hottest,
        scuffing_temperature=limit,
        safety=(limit - oil) / (hottest - oil),
    )


def scuffing_temperature(lubricant: Lubricant) -> Scalar:
    """theta_S [degC] of ISO/TS 6336-20: as given, or by the load stage at which the oil failed; NaN without both."""
    if lubricant.scuffing_temperature is not None:
        return lubricant.scuffing_temperature
    if lubricant.fzg_stage is None:
        return jnp.full_like(lubricant.temperature, jnp.nan)
    return 80 + (0.85 + 1.4 * lubricant.structure_factor) * _lubricant_factor(lubricant) * lubricant.fzg_stage**2


def _lubricant_factor(lubricant: Lubricant) -> Scalar:
    """X_L of ISO/TS 6336-20, with the viscosity of the oil [mPa s] in it."""
    return (1e3 * lubricant.viscosity(lubricant.temperature)) ** -0.05 * lubricant.slipperiness


def flash_factor(geometry: MeshGeometry, path: Given) -> Real:
    """X_M at distances from the pitch point [mm]: E_r^0.25 over the thermal contact coefficient of both flanks.

    Where the materials differ their coefficients count by the roots of the surface speeds, as in Blok's formula.
    """
    pinion, wheel = geometry.curvatures(path)
    weights = jnp.sqrt(pinion), jnp.sqrt(wheel / geometry.gear_ratio)
    first, second = geometry.thermal_contact_coefficient
    mean = (first * weights[0] + second * weights[1]) / (weights[0] + weights[1])
    return 1e3**1.5 * reduced_modulus(geometry) ** 0.25 / mean  # the standard has mm and m in one coefficient


def angle_factor(geometry: MeshGeometry) -> Scalar:
    """X_alphabeta = 1.22 sin(alpha_wt)^0.25 (cos(alpha_n) cos(beta))^0.25 / (cos(alpha_wt) cos(alpha_t))^0.5."""
    working, transverse = geometry.working_pressure_angle, geometry.transverse_pressure_angle
    normal = jnp.cos(geometry.pressure_angle) * jnp.cos(geometry.helix_angle)
    return 1.22 * (jnp.sin(working) * normal) ** 0.25 / jnp.sqrt(jnp.cos(working) * jnp.cos(transverse))


def _approach(parameter: Real, missing: Scalar) -> Real:
    """X_J: the driven tip digs in by the relief that it lacks [um], most at A; 1 from C on."""
    depth = jnp.maximum(-parameter, 0.0) / (parameter[-1] - parameter[0])
    return 1 + jnp.maximum(missing, 0.0) / _APPROACH * depth**3


def integral_scuffing(geometry: MeshGeometry, load: MeshLoad, lubricant: Lubricant) -> IntegralScuffing:
    """Scuffing by the integral temperature method.

        theta_flaE = mu X_M X_BE X_alphabeta (K_Bgamma w_Bt)^0.75 v_w^0.5 a^-0.25 X_E / (X_Q X_Ca)
        theta_flaint = theta_flaE X_eps,   theta_M = theta_oil + 0.7 X_mp X_S theta_flaint
        theta_int = theta_M + 1.5 theta_flaint
        theta_intS = 80 + 0.23 T_1T + 1.5 X_WrelT 0.2 T_1T (100 / nu_40)^0.02

    Arguments as `flash_scuffing`; the safety needs `fzg_stage`. The relief of X_Ca is the smaller one of both tips, but
    at least what running in has made, `run_in` C_ay.

    References:
        ISO/TS 6336-21 (ISO/TR 13989-2).
    """
    helical = helical_load_factor_at(geometry.total_contact_ratio)
    line_load = helical * load.line_load(geometry)
    friction, radius = pitch_point_friction(geometry, load, lubricant, "iso_6336_22", line_load)
    running_in = 1 + (1 - lubricant.run_in) * _RUNNING_IN * lubricant.roughness / radius
    shape, approach = _geometry_factor(geometry), _approach_ratio(geometry)
    stiffness = jnp.where(geometry.overlap_ratio > 0, load.mesh_stiffness, load.single_stiffness)
    deflection = load.outer_factors * geometry.tangential_force(load.torque) / geometry.face_width / stiffness
    worn_in = lubricant.run_in * load.running_in_relief
    relieved = _tip_relief_factor(geometry, jnp.maximum(jnp.min(load.tip_relief), worn_in) / deflection)
    flash = friction * flash_factor(geometry, geometry.path[-1]) * shape * angle_factor(geometry)
    flash *= line_load**0.75 * jnp.sqrt(geometry.pitch_line_speed(load.speed)) / geometry.center_distance**0.25
    flash *= running_in / (approach * relieved)
    share = contact_ratio_factor(geometry.tip_contact_ratio)
    mean, oil = flash * share, lubricant.temperature
    bulk = oil + _BULK_SHARE * 0.5 * (1 + load.meshes) * lubricant.cooling_factor * mean
    reached = bulk + _INTEGRAL_WEIGHT * mean
    test_bulk, test_flash = temperatures_of_test(lubricant)
    limit = test_bulk + _INTEGRAL_WEIGHT * lubricant.structure_factor * test_flash
    return IntegralScuffing(
        effective_relief=deflection,
        helical_load_factor=helical,
        friction=friction,
        roughness_factor=2.2 * (lubricant.roughness / radius) ** 0.25,
        running_in_factor=running_in,
        geometry_factor=shape,
        approach_factor=approach,
        tip_relief_factor=relieved,
        contact_ratio_factor=share,
        tip_flash_temperature=flash,
        mean_flash_temperature=mean,
        bulk_temperature=bulk,
        integral_temperature=reached,
        scuffing_temperature=limit,
        test_bulk_temperature=test_bulk,
        test_flash_temperature=test_flash,
        safety=limit / reached,
        load_safety=(limit - oil) / (reached - oil),
    )


def temperatures_of_test(lubricant: Lubricant) -> tuple[Scalar, Scalar]:
    """Bulk [degC] and mean flash temperature [K] at which the oil failed in the FZG test; NaN without its stage."""
    if lubricant.fzg_stage is None:
        unknown = jnp.full_like(lubricant.temperature, jnp.nan)
        return unknown, unknown
    stage = lubricant.fzg_stage
    torque = jnp.interp(stage, *(jnp.asarray(each, stage.dtype) for each in (_STAGES, _STAGE_TORQUES)))
    return 80 + 0.23 * torque, 0.2 * torque * (100 / lubricant.viscosity_40) ** 0.02


def _geometry_factor(geometry: MeshGeometry) -> Scalar:
    """X_BE at the tip of the pinion."""
    pinion, wheel = geometry.curvatures(geometry.path[-1])
    slip = jnp.abs(jnp.sqrt(pinion) - jnp.sqrt(wheel / geometry.gear_ratio))
    return 0.51 * jnp.sqrt(jnp.abs(geometry.gear_ratio + 1)) * slip / jnp.abs(pinion * wheel) ** 0.25


def _approach_ratio(geometry: MeshGeometry) -> Scalar:
    """X_Q by the contact ratio of approach, that of the driven tip, over that of recess; linear from 1.5 to 3."""
    recess, approach = geometry.tip_contact_ratio
    return 1.4 - 4 / 15 * jnp.clip(approach / recess, 1.5, 3.0)


def _tip_relief_factor(geometry: MeshGeometry, relief: Scalar) -> Scalar:
    """X_Ca at a tip relief over C_eff, which counts up to 1."""
    share, largest = jnp.minimum(relief, 1.0), jnp.max(geometry.tip_contact_ratio)
    return 1 + (0.06 + 0.18 * share) * largest + (0.02 + 0.69 * share) * largest**2


def contact_ratio_factor(tip_contact_ratios: OfGears) -> Scalar:
    """X_eps, mean over the path of contact over the flash temperature at the tip of the pinion.

    Args:
        tip_contact_ratios: eps_1, eps_2; their sum from 1 to 3.
    """
    first, second = tip_contact_ratios
    larger, smaller = jnp.maximum(first, second), jnp.minimum(first, second)
    both = first * second
    inner = 0.70 * (first**2 + second**2) - 0.22 * (first + second) + 0.52 - 0.60 * both
    beyond = 0.18 * larger**2 + 0.70 * smaller**2 + 0.82 * larger - 0.52 * smaller - 0.30 * both
    double = 0.44 * larger**2 + 0.59 * smaller**2 + 0.30 * (larger - smaller) - 0.15 * both
    share = jnp.where(first + second < 2, jnp.where(larger < 1, inner, beyond), double)
    return share / (2 * (first + second) * first)
