"""Kinematics of a planetary stage: ratio, torques, speeds, phases of the meshes and what they suppress.

References:
    R. G. Parker, J. Sound Vib. 236 (2000) 561-573, on planet phasing; Willis' equation for the speeds.
"""

from typing import Literal, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..numerics import Given, concrete, program, real, safe_sqrt, whole
from .stage import Member, PlanetaryStage

Scalar = Float[Array, ""]
Planets = Float[Array, " planets"]

_PRESENT = 1e-3  # angles of few digits leave less than this share


class Members(NamedTuple):
    """One number for each central member, and one for the planets.

    Attributes:
        sun, ring, carrier: values of the central members.
        planet: value of every planet.
    """

    sun: Scalar
    ring: Scalar
    carrier: Scalar
    planet: Scalar

    def of(self, member: Member) -> Scalar:
        """Value of a central member."""
        return {"sun": self.sun, "ring": self.ring, "carrier": self.carrier}[member]


def member_torques(stage: PlanetaryStage, torque: Given) -> Members:
    """Torques from outside on sun, ring and carrier [N m] that balance; positive the way that of the sun acts.

    T_r = T_s z_r / z_s and T_c = -(T_s + T_r), whichever member is fixed; none acts on the planets. Losses are left
    out.

    Args:
        stage: the stage.
        torque: size of the torque on the driving member [N m].
    """
    given = driving_torque(stage, 1.0)
    sun = real(torque).astype(given.dtype) / given
    ratio = stage.gears.ring_teeth / stage.gears.sun_teeth
    return Members(sun, sun * ratio, -sun * (1 + ratio), jnp.zeros_like(sun))


def mesh_force(stage: PlanetaryStage, torque: Given) -> Scalar:
    """Sum of the forces of all planets' meshes with the sun on the line of action [N], and of those with the ring.

    Args:
        stage: the stage.
        torque: size of the torque on the driving member [N m].
    """
    return 1e3 * member_torques(stage, torque).sun / stage.gears.base_radius(stage.gears.sun_teeth)


class AxialLoads(NamedTuple):
    """Loads of a helical stage along its axis; of every planet they are in equilibrium but for the moment.

    Attributes:
        sun: axial force on the sun [N], in the direction of positive face coordinates; minus that on the ring.
        planet_moment: moment that tilts a planet about the tangent of its circle [N m], which its bearing takes.
    """

    sun: Scalar
    planet_moment: Scalar


def axial_loads(stage: PlanetaryStage, torque: Given) -> AxialLoads:
    """Axial force on the sun, and tilting moment of every planet.

    F_a = F tan(beta_b) of the force F of all meshes with the sun. A planet has the opposite forces of its two meshes,
    F_a / N, on both pitch circles: M = |F_a| / N a (z_p / (z_s + z_p) + z_p / (z_r - z_p)), zero for spur gears.

    Args:
        stage: the stage.
        torque: size of the torque on the driving member [N m].
    """
    gears = stage.gears
    axial = mesh_force(stage, torque) * jnp.tan(gears.base_helix_angle)
    planet = gears.planet_teeth
    arm = gears.working_center_distance * (planet / (gears.sun_teeth + planet) + planet / (gears.ring_teeth - planet))
    return AxialLoads(axial, 1e-3 * jnp.abs(axial) / stage.planets * arm)


def driving_torque(stage: PlanetaryStage, torque: Given) -> Scalar:
    """Size of the torque on the driving member [N m] that belongs to one on the sun."""
    ratio = stage.gears.ring_teeth / stage.gears.sun_teeth
    return (
        real(torque).astype(ratio.dtype)
        * {"sun": jnp.ones_like(ratio), "ring": ratio, "carrier": 1 + ratio}[stage.driving]
    )


def member_speeds(stage: PlanetaryStage, speed: Given) -> Members:
    """Speeds of all members [rpm]; all positive ones turn the same way.

    Args:
        stage: the stage.
        speed: speed of the driving member [rpm].
    """
    gears = stage.gears
    sun_teeth, planet_teeth, ring_teeth = gears.sun_teeth, gears.planet_teeth, gears.ring_teeth
    zero, one = jnp.zeros_like(sun_teeth), jnp.ones_like(sun_teeth)
    # speeds where the carrier rests, before the fixed member is brought to rest
    relative = {"sun": one, "ring": -sun_teeth / ring_teeth, "carrier": zero}
    scale = real(speed).astype(one.dtype) / (relative[stage.driving] - relative[stage.fixed])
    sun, ring, carrier = (scale * (relative[member] - relative[stage.fixed]) for member in ("sun", "ring", "carrier"))
    return Members(sun, ring, carrier, carrier - (sun - carrier) * sun_teeth / planet_teeth)


def relative_speeds(stage: PlanetaryStage, speed: Given) -> Members:
    """Amounts of the speeds of all members against the carrier [rpm], zero for the carrier.

    Args:
        stage: the stage.
        speed: speed of the driving member [rpm].
    """
    speeds = member_speeds(stage, speed)
    return Members(*(jnp.abs(each - speeds.carrier) for each in speeds))


def driving_speed(stage: PlanetaryStage, speed: Given) -> Scalar:
    """Speed of the driving member [rpm] that belongs to one of the sun against the carrier."""
    return real(speed).astype(stage.gears.module.dtype) / relative_speeds(stage, 1.0).sun


def output_member(stage: PlanetaryStage) -> Member:
    """The member that neither is fixed nor drives."""
    members: tuple[Member, ...] = ("sun", "ring", "carrier")
    return next(member for member in members if member not in (stage.fixed, stage.driving))


def gear_ratio(stage: PlanetaryStage) -> Scalar:
    """Speed of the driving member over that of the output; negative where they turn in opposite senses."""
    return 1 / member_speeds(stage, 1.0).of(output_member(stage))


def mesh_frequency(stage: PlanetaryStage, speed: Given) -> Scalar:
    """Mesh frequency [Hz] of all meshes, z_s |n_s - n_c| / 60, at a speed of the driving member [rpm]."""
    return stage.gears.sun_teeth * relative_speeds(stage, speed).sun / 60


@program
def planet_phases(stage: PlanetaryStage) -> tuple[Planets, Planets]:
    """Mesh positions of every planet's meshes with sun and ring at the stage's phase zero [base pitches], in [0, 1).

    -z_s phi_i / (2 pi) with the sun, and later by `phase_between_meshes` with the ring: by the condition of assembly
    that is z_r phi_i / (2 pi) + gamma. Both are zero at the pitch point and rise towards recess of sun and planet.
    """
    turns = stage.planet_angles / (2 * jnp.pi)
    sun = (-stage.gears.sun_teeth * turns) % 1.0
    return sun, (sun + stage.gears.phase_between_meshes) % 1.0


class Phasing(NamedTuple):
    """How much of a harmonic of equal meshes is left in the sum over all planets, from 0 to 1, shape (harmonics,) each.

    Attributes:
        rotation: in torques and rotations of sun, ring and carrier, and so in the transmission error.
        translation: in forces on sun, ring and carrier.
    """

    rotation: Float[Array, " harmonics"]
    translation: Float[Array, " harmonics"]

    @property
    def kinds(self) -> tuple[Literal["rotation", "translation", "none"], ...]:
        """Motion of the central members that every harmonic excites; of both the stronger one."""
        rotation, translation = (concrete(each) for each in self)
        if rotation is None or translation is None:
            raise ValueError("Phasing: kinds are being traced, must be concrete")
        largest = np.where(rotation >= translation, "rotation", "translation")
        kinds = np.where(np.maximum(rotation, translation) < _PRESENT, "none", largest)
        return tuple(kinds.tolist())


def phasing(stage: PlanetaryStage, harmonics: int = 6) -> Phasing:
    """Shares of the mesh harmonics 1 ... n that the phases of equal planets under equal loads leave.

    |mean_i e^(2 pi j l psi_i)| for rotation, the larger |mean_i e^(2 pi j l psi_i +- j phi_i)| for translation. At
    equal angles, with k = l z_s mod N, they are 1 for k = 0 and for k = 1 or N - 1, else 0 (Parker).

    Args:
        stage: the stage.
        harmonics: number of harmonics.
    """
    whole("harmonics", harmonics)
    order = jnp.arange(1, harmonics + 1, dtype=stage.planet_angles.dtype)
    turned = 2 * jnp.pi * order[:, None] * planet_phases(stage)[0][None]

    def left(angle: Array) -> Array:
        return safe_sqrt(jnp.mean(jnp.cos(angle), axis=-1) ** 2 + jnp.mean(jnp.sin(angle), axis=-1) ** 2)

    place = stage.planet_angles[None]
    return Phasing(left(turned), jnp.maximum(left(turned + place), left(turned - place)))
