"""Meshes and other loads in the axes of a gearbox, for `equilibrium`."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import gauss_legendre
from .equilibrium import Patterns
from .gearbox import Gearbox

Slices = Float[Array, " slices"]
Scalar = Float[Array, ""]

# Points over which the force of a mesh is spread where it loads another one: exact for an elastic line of one
# piece; on the same face, of an idler, its wind-up is off by 3 %.
_POINTS = 4


class Acting(NamedTuple):
    """A mesh in the axes of the gearbox.

    Attributes:
        shafts: of pinion and wheel.
        positions: of the middle of the common face on both shafts [mm].
        base_radii: [mm].
        normal: from the pinion's flank to the wheel's, along the line of action, in x, y, z, rx, ry.
        half: half the common face width [mm].
    """

    shafts: tuple[int, int]
    positions: tuple[Scalar, Scalar]
    base_radii: tuple[Scalar, Scalar]
    normal: Float[Array, "5"]
    half: Scalar


def acting(gearbox: Gearbox, mesh: int) -> Acting:
    """Where and in which direction the force of a mesh acts.

    The pinion pushes the wheel forwards by cos(alpha_wt) and away from itself by sin(alpha_wt).
    """
    given, pair = gearbox.meshes[mesh], gearbox.pair(mesh)
    (first, pinion), (second, wheel) = gearbox.place(given.pinion), gearbox.place(given.wheel)
    turning = gearbox.path.turning[first] * (1 if gearbox.direction == "counterclockwise" else -1)
    angle, alpha = jnp.deg2rad(given.angle), pair.working_pressure_angle
    away = jnp.stack([jnp.cos(angle), jnp.sin(angle)])
    forwards = turning * jnp.stack([-jnp.sin(angle), jnp.cos(angle)])
    normal = jnp.concatenate([jnp.cos(alpha) * forwards + jnp.sin(alpha) * away, jnp.zeros(3)])
    radii = pair.pinion.base_radius, pair.wheel.base_radius
    middles = pair.face_middles
    positions = pinion.position + middles[0], wheel.position + middles[1]
    return Acting((first, second), positions, radii, normal, 0.5 * pair.face_width)


def mesh_patterns(gearbox: Gearbox, mesh: int, y: Slices) -> list[Patterns]:
    """Unit forces between the flanks at face coordinates, for every shaft."""
    where = acting(gearbox, mesh)
    each = jnp.eye(len(y))[:, None, :] * where.normal[None, :, None]
    found = []
    for index in range(len(gearbox.shafts)):
        if index in where.shafts:
            side = where.shafts.index(index)
            found.append(Patterns(where.positions[side] + y, each if side else -each))
        else:
            found.append(Patterns(jnp.zeros(0), jnp.zeros((0, 5, len(y)))))
    return found


def load_pattern(gearbox: Gearbox, without: int | None = None) -> list[Patterns]:
    """All loads as one pattern for every shaft: meshes, even over their faces, but for one; and loads from outside."""
    points, weights = gauss_legendre(_POINTS)
    at: list[list] = [[] for _ in gearbox.shafts]
    vectors: list[list] = [[] for _ in gearbox.shafts]
    torques = gearbox.pinion_torques()
    for mesh in range(len(gearbox.meshes)):
        if mesh == without:
            continue
        where = acting(gearbox, mesh)
        force = 1e3 * torques[mesh] / where.base_radii[0]
        for side, sign in enumerate((-1.0, 1.0)):
            at[where.shafts[side]].extend(where.positions[side] + where.half * (2 * points - 1))
            vectors[where.shafts[side]].extend(sign * force * weights[:, None] * where.normal[None])
    for index, shaft in enumerate(gearbox.shafts):
        at[index].extend(load.position for load in shaft.loads)
        vectors[index].extend(load.vector for load in shaft.loads)
    empty = Patterns(jnp.zeros(0), jnp.zeros((0, 5, 1)))
    return [Patterns(jnp.stack(a), jnp.stack(v)[..., None]) if a else empty for a, v in zip(at, vectors)]


def side_by_side(first: list[Patterns], second: list[Patterns]) -> list[Patterns]:
    """Patterns of two lists for the same shafts."""
    found = []
    for one, two in zip(first, second):
        left = jnp.concatenate([one.vectors, jnp.zeros((*one.vectors.shape[:2], two.vectors.shape[2]))], axis=2)
        right = jnp.concatenate([jnp.zeros((*two.vectors.shape[:2], one.vectors.shape[2])), two.vectors], axis=2)
        found.append(Patterns(jnp.concatenate([one.at, two.at]), jnp.concatenate([left, right])))
    return found


def torques_on(gearbox: Gearbox, shaft: int, without: int | None = None):
    """Positions and torques on a shaft, positive where they drive it [N mm], those of all but one mesh.

    Meshes act evenly over their faces; the coupling without a torque of its own takes what is left.
    """
    points, weights = gauss_legendre(_POINTS)
    at: list = []
    found: list = []
    left = jnp.zeros(())
    for mesh, torque in enumerate(gearbox.pinion_torques()):
        where = acting(gearbox, mesh)
        if shaft not in where.shafts:
            continue
        side = where.shafts.index(shaft)
        own = torque * (gearbox.pair(mesh).gear_ratio if side else -1.0)
        left = left - own
        if mesh != without:
            at.extend(where.positions[side] + where.half * (2 * points - 1))
            found.extend(weights * own)
    couplings = gearbox.shafts[shaft].couplings
    left = left - sum((item.torque for item in couplings if item.torque is not None), jnp.zeros(()))
    at.extend(item.position for item in couplings)
    found.extend(left if item.torque is None else item.torque for item in couplings)
    return (jnp.stack(at), 1e3 * jnp.stack(found)) if at else (jnp.zeros(0), jnp.zeros(0))
