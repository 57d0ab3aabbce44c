"""Losses of the flanks of a planetary stage, and its efficiency.

References:
    H. W. Mueller, Die Umlaufgetriebe, 1998: basic efficiency and the efficiencies that follow from it.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..metrics import Lubricant, loss_power
from ..numerics import Checked, Given, check, program, real, result
from .cycle import StageCycle
from .kinematics import driving_speed, member_speeds, member_torques, output_member
from .mesh_cycles import StageMeshes
from .stage import PlanetaryStage

Scalar = Float[Array, ""]
Planets = Float[Array, " planets"]

_WATT = jnp.pi / 30  # N m rpm


class StageLosses(Checked):
    """Result of `stage_losses`.

    Attributes:
        sun_mesh_loss, ring_mesh_loss: power that the flanks of every planet's meshes lose at the forces without losses
            [W], shape (planets,).
        bearing_loss: given power loss of the bearings [W].
        basic_efficiency: efficiency of the meshes with the carrier at rest, eta_s eta_r.
        efficiency: output over input power.
        input_power: power of the driving member [W].
    """

    sun_mesh_loss: Planets = result("W")
    ring_mesh_loss: Planets = result("W")
    bearing_loss: Scalar = result("W")
    basic_efficiency: Scalar = result()
    efficiency: Scalar = result()
    input_power: Scalar = result("W")

    @property
    def loss_power(self) -> Scalar:
        """Input minus output power [W]: losses of flanks and bearings."""
        return (1 - self.efficiency) * self.input_power


def stage_losses(
    cycle: StageCycle, meshes: StageMeshes, lubricant: Lubricant | None = None, *, bearing_loss: Given = 0.0
) -> StageLosses:
    """Losses of the flanks by the loads of all meshes and their sliding relative to the carrier, and the efficiency.

    Friction is that of `metrics.loss_power` for every mesh. Churning is left out, bearings are as given.

    Args:
        cycle: the solved stage.
        meshes: contacts of all meshes, made with a speed.
        lubricant: lubricant for the coefficient of friction; None where the meshes were made with one.
        bearing_loss: power loss of the bearings [W].

    Raises:
        ValueError: for meshes without a speed, without both lubricant and coefficient, and a negative bearing loss.
    """
    speeds = meshes.sun.operating_point.speed
    if speeds is None:
        raise ValueError("meshes have no speed, make them with mesh_cycles(prepared, cycle, speed=...)")
    check("bearing_loss", bearing_loss, "W", low=0.0)
    dtype = cycle.transmission_error.dtype
    return _losses(cycle, meshes, lubricant, speeds[0].astype(dtype), real(bearing_loss).astype(dtype))


@program
def _losses(
    cycle: StageCycle, meshes: StageMeshes, lubricant: Lubricant | None, speed: Scalar, bearing_loss: Scalar
) -> StageLosses:
    """Losses at a speed of the sun relative to the carrier [rpm]."""
    dtype = bearing_loss.dtype
    losses = [loss_power(mesh, lubricant).astype(dtype) for mesh in (meshes.sun, meshes.ring)]
    # power of the sun relative to the carrier, which the ring's mesh passes on
    rolling = _WATT * jnp.sum(meshes.sun.torque).astype(dtype) * speed
    basic = (1 - jnp.sum(losses[0]) / rolling) * (1 - jnp.sum(losses[1]) / rolling)
    power = _WATT * cycle.torque * driving_speed(cycle.stage, speed)
    return StageLosses(
        sun_mesh_loss=losses[0],
        ring_mesh_loss=losses[1],
        bearing_loss=bearing_loss,
        basic_efficiency=basic,
        efficiency=stage_efficiency(cycle.stage, basic) - bearing_loss / power,
        input_power=power,
    )


def stage_efficiency(stage: PlanetaryStage, basic_efficiency: Given) -> Scalar:
    """Efficiency of a stage by its basic efficiency eta_0 = eta_s eta_r, that with the carrier at rest.

    T_r = T_s z_r / z_s eta_0^w and T_c = -(T_s + T_r), w = 1 where power flows from sun to ring relative to the carrier
    and -1 where it flows back. A driving sun and a fixed ring have 1 - (1 - eta_0) i_0 / (i_0 - 1), i_0 = -z_r / z_s.

    Args:
        stage: the stage, of which gears, fixed and driving member count.
        basic_efficiency: basic efficiency, shape ().

    Raises:
        ValueError: for an efficiency that is not greater than zero and at most 1.
    """
    check("basic_efficiency", basic_efficiency, "", low=0.0, high=1.0, open_low=True)
    basic = real(basic_efficiency).astype(stage.gears.module.dtype)
    speeds, ideal = member_speeds(stage, 1.0), member_torques(stage, 1.0)
    forward = ideal.of(stage.driving) * (speeds.sun - speeds.carrier) >= 0
    ratio = stage.gears.ring_teeth / stage.gears.sun_teeth * jnp.where(forward, basic, 1 / basic)
    torques = ideal._replace(sun=jnp.ones_like(ratio), ring=ratio, carrier=-1 - ratio)
    output = output_member(stage)
    given = torques.of(stage.driving) * speeds.of(stage.driving)
    return -torques.of(output) * speeds.of(output) / given
