"""Power losses of a mesh: friction of its flanks under load, and the oil that its gears stir.

Losses count the torque itself, load factors do not heat. What gears lose without load comes from laws of test rigs and
depends on the housing as much as on the gears: estimates, of which two are here to be compared.

References:
    ISO/TR 14179-2 (G. Niemann, H. Winter, Maschinenelemente II, with the law of J. Mauz) for mesh and no-load loss; C.
    Changenet, P. Velex, A model for the prediction of churning losses in geared transmissions, J. Mech. Des. 129
    (2007) 128-133.
"""

import jax.numpy as jnp

from ..metrics.lubricant import Lubricant
from ..metrics.lubrication import loss_factor_at
from ..numerics import Given, real
from .load_sharing import MeshLoad, pitch_point_friction
from .mesh_geometry import MeshGeometry, Real, Scalar

_GRAVITY = 9.81  # m/s^2
_LAMINAR, _TURBULENT = 6000.0, 9000.0  # Reynolds numbers between which the churning torque is linear
_IMMERSED = 1e-6, 0.98  # of the diameter, to stay clear of where the wetted arc has no derivative


def mesh_friction(geometry: MeshGeometry, load: MeshLoad, lubricant: Lubricant) -> Scalar:
    """Schlenk's mean coefficient of friction at the nominal torque; see `metrics.friction_coefficient`."""
    line_load = geometry.base_force(load.torque) / geometry.face_width
    return pitch_point_friction(geometry, load, lubricant, "schlenk", line_load)[0]


def loss_factor(geometry: MeshGeometry) -> Scalar:
    """H_v of the geometry alone, see `metrics.ohlendorf_loss_factor`; the contact analysis has H_VL of its own."""
    recess, approach = geometry.tip_contact_ratio
    return loss_factor_at(geometry.teeth[0], geometry.gear_ratio, (recess, approach), geometry.base_helix_angle)


def mesh_loss(geometry: MeshGeometry, load: MeshLoad, friction: Given) -> Scalar:
    """P_VZP = P mu H_v of the flanks [W], with a mean coefficient of friction."""
    return load.torque * load.speed * jnp.pi / 30 * friction * loss_factor(geometry)


def hydraulic_torque(width: Given, speed: Given, immersion: Given, splash: Given = 1.0) -> Real:
    """No-load torque of a gear pair by Mauz [N m], an estimate from rigs of small gears: b^3 overstates wide ones.

        T_H = C_Sp C_1 exp(C_2 v_w / 10)
        C_1 = 0.063 (e_1 + e_2) / 10 + 0.0128 (b / 10)^3,   C_2 = (e_1 + e_2) / 800 + 0.2

    Args:
        width: b of the mesh [mm].
        speed: v_w at the pitch circles [m/s].
        immersion: e_1 + e_2, depths to which the gears dip into the oil at rest [mm].
        splash: C_Sp, 1 for spray lubrication; see `splash_factor`.
    """
    torque = 0.063 * immersion / 10 + 0.0128 * (width / 10) ** 3
    return real(splash * torque * jnp.exp((immersion / 800 + 0.2) * speed / 10))


def splash_factor(deepest: Given, pitch_height: Given, hydraulic_length: Given) -> Real:
    """C_Sp of dip lubrication, (4 e_max / (3 h_C))^1.5 2 h_C / l_h, of `hydraulic_torque`.

    Args:
        deepest: e_max, the larger depth [mm].
        pitch_height: h_C, of the pitch point above the lowest point of the gears in the oil [mm].
        hydraulic_length: l_h = 4 V / A of the wetted housing [mm].
    """
    return real((4 * deepest / (3 * pitch_height)) ** 1.5 * 2 * pitch_height / hydraulic_length)


def churning_loss(
    geometry: MeshGeometry, gear: int, speed: Given, immersion: Given, volume: Given, lubricant: Lubricant
) -> Scalar:
    """Loss of a gear that churns its oil bath by Changenet and Velex [W], an estimate.

        P = 1/2 rho omega^3 S_m R^3 C_m,  Re = omega R^2 / nu,  Fr = omega^2 R / g
        C_m = 1.366 (h / D)^0.45 (V / D^3)^0.1 Fr^-0.6 Re^-0.21                    Re < 6000
        C_m = 3.644 (h / D)^0.1 (V / D^3)^-0.35 Fr^-0.88 (b / D)^0.85              Re > 9000

    with the pitch diameter D = 2 R and the wetted surface S_m of flanks, faces and disc, linear in Re in between.

    Args:
        geometry: of the mesh.
        gear: 0 for the pinion, 1 for the wheel.
        speed: of the pinion [rpm].
        immersion: depth h to which the gear dips into the oil at rest [mm].
        volume: V of the oil [dm^3].
        lubricant: oil.
    """
    diameter = 1e-3 * geometry.working_diameter[gear]
    width = 1e-3 * geometry.face_widths[gear]
    radius, turn = 0.5 * diameter, speed * geometry.teeth[0] / geometry.teeth[gear] * jnp.pi / 30
    depth = jnp.clip(1e-3 * immersion / diameter, *_IMMERSED)
    fill = 1e-3 * volume / diameter**3
    density = lubricant.density_at(lubricant.temperature)
    reynolds = turn * radius**2 / (1e-6 * lubricant.kinematic_viscosity(lubricant.temperature))
    froude = turn**2 * radius / _GRAVITY
    slow = 1.366 * depth**0.45 * fill**0.1 * froude**-0.6 * jnp.minimum(reynolds, _LAMINAR) ** -0.21
    fast = 3.644 * depth**0.1 * fill**-0.35 * froude**-0.88 * (width / diameter) ** 0.85
    share = jnp.clip((reynolds - _LAMINAR) / (_TURBULENT - _LAMINAR), 0.0, 1.0)
    half = jnp.arccos(1 - 2 * depth)  # of the wetted arc
    height = 0.5e-3 * (geometry.tip_diameter[gear] - geometry.root_diameter[gear])
    sides = radius**2 * (2 * half - jnp.sin(2 * half)) + diameter * width * half
    teeth = 2 * geometry.teeth[gear] * half * height * width / (jnp.pi * jnp.cos(geometry.pressure_angle))
    coefficient = slow + share * (fast - slow)
    return 0.5 * density * turn**3 * (sides + teeth) * radius**3 * coefficient
