"""Scuffing, micropitting and losses of a gear pair together, as a rating with a lubricant has them."""

import jax.numpy as jnp

from ..metrics.lubricant import Lubricant
from ..numerics import Checked, Given, program, result
from .chain import PairRating
from .load_factors import running_in_relief
from .load_sharing import MeshLoad
from .losses import churning_loss, hydraulic_torque, loss_factor, mesh_friction, mesh_loss
from .mesh_geometry import MeshGeometry, OfGears, Scalar
from .micropitting import Micropitting, material_factor, micropitting
from .scuffing import FlashScuffing, IntegralScuffing, flash_scuffing, integral_scuffing
from .settings import Rating


class ThermalRating(Checked):
    """Rating of a mesh by what friction does to it; NaN for what the lubricant does not tell enough of.

    Attributes:
        flash: scuffing by the flash temperature.
        integral: scuffing by the integral temperature.
        micropitting: by method B.
        friction: mu_mz by Schlenk, at the nominal torque.
        loss_factor: H_v.
        loss_power: P_VZP of the flanks, at the nominal torque.
        efficiency: of the mesh, 1 - mu_mz H_v.
        no_load_loss_power: P_VZ0 by Mauz, an estimate.
        churning_loss_power: of both gears by Changenet and Velex, an estimate.
    """

    flash: FlashScuffing
    integral: IntegralScuffing
    micropitting: Micropitting
    friction: Scalar = result()
    loss_factor: Scalar = result()
    loss_power: Scalar = result("W")
    efficiency: Scalar = result()
    no_load_loss_power: Scalar = result("W")
    churning_loss_power: Scalar = result("W")


def thermal_rating(
    found: PairRating, torque: Given, speed: Given, rating: Rating, tip_relief: Given = 0.0
) -> ThermalRating:
    """Scuffing, micropitting and losses of a rated pair.

    Args:
        found: rating of the pair, for its geometry and load factors.
        torque: on the pinion, nominal [N m].
        speed: of the pinion [rpm].
        rating: settings, with the lubricant.
        tip_relief: C_a of pinion and wheel as designed, where the rating gives none [um].

    Raises:
        ValueError: for a rating without lubricant.
    """
    if rating.lubricant is None:
        raise ValueError("scuffing, micropitting and losses need the lubricant")
    dtype = found.tangential_force.dtype
    relief = tip_relief if rating.tip_relief is None else rating.tip_relief
    load, turns = jnp.asarray(torque, dtype), jnp.asarray(speed, dtype)
    return _thermal(found, load, turns, rating, jnp.broadcast_to(jnp.asarray(relief, dtype), (2,)))


@program
def _thermal(found: PairRating, torque: Scalar, speed: Scalar, rating: Rating, tip_relief: OfGears) -> ThermalRating:
    assert rating.lubricant is not None
    factors, grades = found.factors, [gear.quality_class or 0 for gear in rating.gears]
    load = MeshLoad(
        torque=torque,
        speed=speed,
        outer_factors=factors.application * factors.mesh,
        load_factors=factors.flank,
        single_stiffness=factors.single_stiffness,
        mesh_stiffness=factors.mesh_stiffness,
        tip_relief=tip_relief,
        running_in_relief=running_in_relief(rating),
        accuracy_grade=jnp.full_like(torque, max(grades)),
        meshes=jnp.maximum(*(gear.contacts_per_revolution for gear in rating.gears)),
    )
    materials = jnp.stack([material_factor(gear) for gear in rating.gears])
    return rate_thermal(found.geometry, load, rating.lubricant, materials)


def rate_thermal(
    geometry: MeshGeometry, load: MeshLoad, lubricant: Lubricant, material_factors: OfGears
) -> ThermalRating:
    """Scuffing, micropitting and losses.

    Args:
        geometry: of the mesh.
        load: on it.
        lubricant: oil.
        material_factors: W_W of both gears, see `micropitting.material_factor`.
    """
    friction, lost = mesh_friction(geometry, load, lubricant), loss_factor(geometry)
    depths = lubricant.pinion_immersion, lubricant.wheel_immersion
    no_load = churned = jnp.full_like(friction, jnp.nan)
    turn = load.speed * jnp.pi / 30
    if not all(depth is None for depth in depths):
        dipped = [jnp.zeros_like(friction) if depth is None else depth for depth in depths]
        velocity = geometry.pitch_line_speed(load.speed)
        no_load = turn * hydraulic_torque(geometry.face_width, velocity, sum(dipped), lubricant.splash_factor)
        if lubricant.oil_volume is not None:
            bath = lubricant.oil_volume, lubricant
            of_gears = (churning_loss(geometry, gear, load.speed, depth, *bath) for gear, depth in enumerate(dipped))
            churned = sum(of_gears, jnp.zeros_like(friction))
    return ThermalRating(
        flash=flash_scuffing(geometry, load, lubricant),
        integral=integral_scuffing(geometry, load, lubricant),
        micropitting=micropitting(geometry, load, lubricant, material_factors),
        friction=friction,
        loss_factor=lost,
        loss_power=mesh_loss(geometry, load, friction),
        efficiency=1 - friction * lost,
        no_load_loss_power=no_load,
        churning_loss_power=churned,
    )
