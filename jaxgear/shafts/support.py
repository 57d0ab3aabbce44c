"""What shafts, bearings and housing do to the gap of a mesh over its face."""

from abc import abstractmethod
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..geometry import GearPair
from ..numerics import Checked, gauss_legendre, program, real, whole
from .beam import twist
from .equilibrium import Patterns, solve, system
from .gearbox import Gearbox
from .misalignment import Misalignment

Slices = Float[Array, " slices"]
Scalar = Float[Array, ""]

# Points over which the force of a mesh is spread where it loads another one: exact for an elastic line of one piece.
_POINTS = 4


class AbstractSupport(Checked):
    """How the flanks of a mesh come apart along the line of action, over the face coordinate y."""

    @abstractmethod
    def influence(self, y: Slices) -> Float[Array, "slices slices"]:
        """Gap that opens at y[s] under a unit force between the flanks at y[t] [um/N], symmetric, semidefinite."""

    @abstractmethod
    def gap(self, y: Slices) -> Slices:
        """Gap by everything else than the force of this mesh [um]."""


class RigidSupport(AbstractSupport):
    """Axes that do not give way, but may not be parallel.

    Attributes:
        pair: the gears.
        misalignment: of their axes.
    """

    pair: GearPair
    misalignment: Misalignment = eqx.field(default_factory=Misalignment)

    def influence(self, y: Slices) -> Float[Array, "slices slices"]:
        """Zero."""
        return jnp.zeros((len(y), len(y)))

    def gap(self, y: Slices) -> Slices:
        """That of the misalignment [um]."""
        return self.misalignment.over_face(self.pair) * real(y) / self.pair.face_width


class ShaftSupport(AbstractSupport):
    """The shafts of a gearbox at one of its meshes; made by `support`.

    Attributes:
        gearbox: with the torques of its couplings.
        mesh: which one.
    """

    gearbox: Gearbox
    mesh: int = eqx.field(static=True)

    @property
    def pair(self) -> GearPair:
        """The gears of the mesh."""
        return self.gearbox.pair(self.mesh)

    @property
    def torque(self) -> Scalar:
        """On the pinion [N m]."""
        return self.gearbox.pinion_torques()[self.mesh]

    def influence(self, y: Slices) -> Float[Array, "slices slices"]:
        """Bending, shear, torsion, bearings and housing of both shafts, and of all others through the housing.

        The torque of a unit force leaves each shaft at the end of the face behind which most of it leaves: rotations
        count from there. What the shaft winds up between its face and a coupling turns the whole gear and is not in it.
        """
        return _influence(self, real(y))

    def gap(self, y: Slices) -> Slices:
        """What other meshes, external loads and misalignment open, the force of other meshes even over their faces."""
        return _gap(self, real(y))


def support(gearbox: Gearbox, mesh: int = 0) -> ShaftSupport:
    """What the shafts do to a mesh of a gearbox.

    Args:
        gearbox: shafts, meshes, housing.
        mesh: number of the mesh, from 0.

    Raises:
        ValueError: for a number that no mesh has.
    """
    whole("support", "mesh", mesh, 0, len(gearbox.meshes) - 1)
    return ShaftSupport(gearbox, mesh)


class Acting(NamedTuple):
    """A mesh in the axes of the gearbox.

    Attributes:
        shafts: of pinion and wheel.
        positions: of the middles of their faces [mm].
        base_radii: [mm].
        normal: from the pinion's flank to the wheel's, along the line of action, in x, y, z, rx, ry.
        half: half the face width [mm].
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
    return Acting((first, second), (pinion.position, wheel.position), radii, normal, 0.5 * pair.face_width)


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


@program
def _influence(given: ShaftSupport, y: Slices) -> Float[Array, "slices slices"]:
    gearbox = given.gearbox
    bent = solve(system(gearbox, mesh_patterns(gearbox, given.mesh, y)), jnp.eye(len(y))).pattern
    where = acting(gearbox, given.mesh)
    for side in range(2):
        twisted = _twist_between(gearbox, given.mesh, side, y, where.positions[side] + y)
        bent = bent + where.base_radii[side] ** 2 * twisted
    return 0.5 * (bent + bent.T)


@program
def _gap(given: ShaftSupport, y: Slices) -> Slices:
    gearbox, mesh = given.gearbox, given.mesh
    patterns = side_by_side(mesh_patterns(gearbox, mesh, y), load_pattern(gearbox, without=mesh))
    load = jnp.zeros((len(y) + 1, 1)).at[-1].set(1.0)
    total = solve(system(gearbox, patterns), load).pattern[:-1, 0]
    where = acting(gearbox, mesh)
    for side, sign in enumerate((-1.0, 1.0)):
        at, torque = torques_on(gearbox, where.shafts[side], without=mesh)
        total = total + sign * where.base_radii[side] * (_twist_between(gearbox, mesh, side, y, at) @ torque)
    pair = given.pair
    return total + gearbox.meshes[mesh].misalignment.over_face(pair) * y / pair.face_width


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


def _twist_between(gearbox: Gearbox, mesh: int, side: int, y: Slices, at: Float[Array, " points"]):
    """Twist at face coordinates under unit torques at positions, from the end of the face [mrad per N mm]."""
    where = acting(gearbox, mesh)
    held, middle = gearbox.shafts[where.shafts[side]].beam, where.positions[side]
    others, torque = torques_on(gearbox, where.shafts[side], without=mesh)
    beyond = [jnp.abs(jnp.sum(jnp.where(flag, torque, 0.0))) for flag in (others < middle, others > middle)]
    left, right = middle - where.half, middle + where.half
    here, there = (middle + y)[:, None], at[None, :]
    from_left = twist(held, jnp.maximum(jnp.minimum(here, there), left)) - twist(held, left)
    from_right = twist(held, right) - twist(held, jnp.minimum(jnp.maximum(here, there), right))
    return jnp.where(beyond[1] > beyond[0], from_right, from_left)


def even_coordinates(width, slices: int) -> Slices:
    """Middles of slices of equal width over a face [mm]."""
    return real(width) * ((np.arange(slices) + 0.5) / slices - 0.5)
