"""Static equilibrium of all shafts of a gearbox on their bearings, with clearances, under meshes and other loads.

Unknowns are the forces f of all bearings on their shafts and the rigid-body displacements q of all shafts. With F the
flexibility of the shafts clamped at their left ends, R the displacements of their points per q, K the stiffness of the
bearings and C the compliance of the housing:

    u_b = F_bb f + F_bp p + R_b q        bearings under their forces and the loads p
    f = f_0 - K (u_b + C f)              the seats move by -C f
    R_b^T f + R_p^T p = 0                every shaft is in equilibrium
    u_p = F_pb f + F_pp p + R_p q

A load p is a vector in x, y, z, rx, ry at each of several points; u_p is the displacement conjugate to p in work.

A bearing with clearance c resists with k max(0, |u| - c) in the direction of the displacement u; the stiffness across
that direction is force over displacement, k (1 - c / |u|). A bearing without contact has no radial stiffness; axial and
tilting stiffness do not depend on the clearance. Newton's method finds the state under all loads, with mesh forces even
over their faces. A change of the distribution of a mesh force over its face is treated by the tangent at this state;
the sum and direction of the force are those of the state. Without clearances the system is linear and exact. Results
are NaN if a shaft floats in its clearances without contact, and if Newton's method does not converge.
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import gauss_legendre, implicit_root, solve_dense
from .gearbox import Gearbox
from .stepped_beam import DIRECTIONS, flexibility, rigid

_WAYS = len(DIRECTIONS)


class Patterns(NamedTuple):
    """Load patterns on one shaft; they also weight its displacements.

    Attributes:
        at: positions on the shaft [mm], shape (points,).
        vectors: components x, y, z, rx, ry of every pattern at each position [N, N mm].
    """

    at: Float[Array, " points"]
    vectors: Float[Array, "points 5 patterns"]


class System(NamedTuple):
    """Matrices of the equations above, rows of the bearings first.

    Attributes:
        flexibility: flexibility F of the clamped shafts [um/N, mrad/N, mrad/(N mm)].
        moving: displacements R per rigid-body displacement of the shafts, all shafts side by side.
        bearings: stiffness K of the bearings [N/um, N/mrad, N mm/mrad].
        housing: compliance C of the housing [um/N, mrad/N, mrad/(N mm)].
        unsupported: 1 for rigid-body displacements that no bearing resists, which stay zero; else 0.
        play: force f_0 of the bearings at zero displacement, extrapolated by their tangent K, which does not pass
            through the origin with clearance [N, N mm]; zero for linear bearings.
    """

    flexibility: Float[Array, "n n"]
    moving: Float[Array, "n movements"]
    bearings: Float[Array, "b b"]
    housing: Float[Array, "b b"]
    unsupported: Float[Array, " movements"]
    play: Float[Array, " b"]


class Equilibrium(NamedTuple):
    """Forces and displacements in equilibrium, one column for each load.

    Attributes:
        force: force of the bearings on their shafts [N, N mm].
        bearing: displacement of the shafts at the bearings [um, mrad].
        seat: displacement of the seats [um, mrad].
        pattern: displacement conjugate to every load pattern [um, mrad].
    """

    force: Float[Array, "b loads"]
    bearing: Float[Array, "b loads"]
    seat: Float[Array, "b loads"]
    pattern: Float[Array, "patterns loads"]


def system(gearbox: Gearbox, patterns: list[Patterns]) -> System:
    """Set up the equations of a gearbox.

    Args:
        gearbox: shafts, bearings, housing.
        patterns: load patterns of every shaft, the same number for each.
    """
    shafts = gearbox.shafts
    count = sum(len(shaft.bearings) for shaft in shafts)
    size = _WAYS * count + patterns[0].vectors.shape[-1]
    held = [bearing.matrix for shaft in shafts for bearing in shaft.bearings]
    total = jnp.zeros((size, size))
    moving, unsupported, first = [], [], 0
    for shaft, pattern in zip(shafts, patterns):
        own = len(shaft.bearings)
        at = jnp.concatenate([jnp.stack([bearing.position for bearing in shaft.bearings]), pattern.at])
        unit = jnp.eye(_WAYS * own, _WAYS * count, _WAYS * first).reshape(own, _WAYS, -1)
        vectors = jnp.zeros((len(at), _WAYS, size))
        vectors = vectors.at[:own, :, : _WAYS * count].set(unit).at[own:, :, _WAYS * count :].set(pattern.vectors)
        flat = vectors.reshape(-1, size)
        total = total + flat.T @ flexibility(shaft.beam, at).reshape(len(flat), -1) @ flat
        moving.append(flat.T @ rigid(at).reshape(-1, _WAYS))
        axial = sum(matrix[2, 2] for matrix in held[first : first + own])
        unsupported.append(jnp.zeros(_WAYS).at[2].set(jnp.where(axial > 0, 0.0, 1.0)))
        first += own
    stiffness = jnp.zeros((count, _WAYS, count, _WAYS))
    for index, matrix in enumerate(held):
        stiffness = stiffness.at[index, :, index].set(matrix)
    stiffness = stiffness.reshape(_WAYS * count, -1)
    housing = jnp.zeros_like(stiffness) if gearbox.housing is None else gearbox.housing.at(gearbox.bearing_names)
    movements = jnp.concatenate(moving, axis=1), jnp.concatenate(unsupported)
    return System(total, movements[0], stiffness, housing, movements[1], jnp.zeros(len(stiffness)))


def solve(of: System, loads: Float[Array, "patterns loads"], *, actual: bool = False) -> Equilibrium:
    """Forces and displacements under several loads, each a sum of the patterns.

    Args:
        of: equations of the gearbox.
        loads: factor of every pattern in every load, shape (patterns, loads).
        actual: True to include the bearing clearance, for a state under load; False for the change by a further load.
    """
    count = len(of.bearings)
    inner, across = of.flexibility[:count, :count], of.flexibility[:count, count:] @ loads
    here, there = of.moving[:count], of.moving[count:]
    # rows of stiff and of soft bearings are scaled to the same size
    size = 1 + jnp.abs(of.bearings) @ jnp.max(jnp.abs(inner), axis=1)
    upper = (
        jnp.concatenate([jnp.eye(count) + of.bearings @ (inner + of.housing), of.bearings @ here], axis=1)
        / size[:, None]
    )
    lower = jnp.concatenate([here.T, jnp.diag(of.unsupported)], axis=1)
    given = of.play[:, None] * float(actual) - of.bearings @ across
    right = jnp.concatenate([given / size[:, None], -there.T @ loads])
    found = solve_dense(jnp.concatenate([upper, lower]), right)
    force, moved = found[:count], found[count:]
    return Equilibrium(
        force,
        inner @ force + across + here @ moved,
        -of.housing @ force,
        of.flexibility[count:, :count] @ force + of.flexibility[count:, count:] @ loads + there @ moved,
    )


Slices = Float[Array, " slices"]
Scalar = Float[Array, ""]

# Number of points that represent the mesh force on another mesh: exact for an elastic line without steps; on the
# same face, for an idler gear, the wind-up has an error of 3 %.
_POINTS = 4


class Acting(NamedTuple):
    """Force of a mesh in the axes of the gearbox.

    Attributes:
        shafts: indices of the shafts of pinion and wheel.
        positions: positions of the middle of the common face on both shafts [mm].
        base_radii: base radii of pinion and wheel [mm].
        unit_forces: force on pinion and wheel in x, y, z, rx, ry per force along the line of action [N/N, N mm/N].
        half: half the common face width [mm].
    """

    shafts: tuple[int, int]
    positions: tuple[Scalar, Scalar]
    base_radii: tuple[Scalar, Scalar]
    unit_forces: tuple[Float[Array, "5"], Float[Array, "5"]]
    half: Scalar


def acting(gearbox: Gearbox, mesh: int) -> Acting:
    """Point of application and direction of the force of a mesh.

    Per unit force along the line of action, the tangential component on the wheel is cos(alpha_wt) and the radial
    component away from the pinion is sin(alpha_wt). Helical gears add an axial force F_ax = F tan(beta_b), which pushes
    the wheel away from the end of the face that enters the mesh first. The axial force is applied at the pitch point,
    independent of the mesh position, and tilts both shafts by the moment F_ax r_w.
    """
    given, pair = gearbox.meshes[mesh], gearbox.pair(mesh)
    (first, pinion), (second, wheel) = gearbox.place(given.pinion), gearbox.place(given.wheel)
    angle, alpha = jnp.deg2rad(given.angle), pair.working_pressure_angle
    away = jnp.stack([jnp.cos(angle), jnp.sin(angle)])
    forwards = gearbox.turning(first) * jnp.stack([-jnp.sin(angle), jnp.cos(angle)])
    normal = jnp.cos(alpha) * forwards + jnp.sin(alpha) * away
    axial = jnp.zeros(()) if pair.pinion.helix_angle is None else -pair.path_slope
    radii = pair.pinion.base_radius, pair.wheel.base_radius

    def on(sign: float, radius: Scalar) -> Float[Array, "5"]:
        x, y = -sign * radius / jnp.cos(alpha) * away  # of the pitch point, from the axis
        return sign * jnp.concatenate([normal, jnp.stack([axial, y * axial, -x * axial])])

    middles = pair.face_middles
    positions = pinion.position + middles[0], wheel.position + middles[1]
    return Acting((first, second), positions, radii, (on(-1.0, radii[0]), on(1.0, radii[1])), 0.5 * pair.face_width)


def mesh_patterns(gearbox: Gearbox, mesh: int, y: Slices) -> list[Patterns]:
    """Load patterns of unit forces between the flanks at face coordinates [mm], for every shaft."""
    where = acting(gearbox, mesh)
    found = []
    for index in range(len(gearbox.shafts)):
        if index in where.shafts:
            side = where.shafts.index(index)
            each = jnp.eye(len(y))[:, None, :] * where.unit_forces[side][None, :, None]
            found.append(Patterns(where.positions[side] + y, each))
        else:
            found.append(Patterns(jnp.zeros(0), jnp.zeros((0, 5, len(y)))))
    return found


def load_pattern(gearbox: Gearbox, without: int | None = None) -> list[Patterns]:
    """One pattern per shaft of all external loads and even mesh forces, except those of mesh `without`."""
    points, weights = gauss_legendre(_POINTS)
    at: list[list[Array]] = [[] for _ in gearbox.shafts]
    vectors: list[list[Array]] = [[] for _ in gearbox.shafts]
    torques = gearbox.pinion_torques()
    for mesh in range(len(gearbox.meshes)):
        if mesh == without:
            continue
        where = acting(gearbox, mesh)
        force = 1e3 * torques[mesh] / where.base_radii[0]
        for side in range(2):
            at[where.shafts[side]].extend(where.positions[side] + where.half * (2 * points - 1))
            vectors[where.shafts[side]].extend(force * weights[:, None] * where.unit_forces[side][None])
    for index, shaft in enumerate(gearbox.shafts):
        at[index].extend(load.position for load in shaft.loads)
        vectors[index].extend(load.vector for load in shaft.loads)
    empty = Patterns(jnp.zeros(0), jnp.zeros((0, 5, 1)))
    return [Patterns(jnp.stack(a), jnp.stack(v)[..., None]) if a else empty for a, v in zip(at, vectors)]


def side_by_side(first: list[Patterns], second: list[Patterns]) -> list[Patterns]:
    """Join the patterns of two lists shaft by shaft."""
    found = []
    for one, two in zip(first, second):
        left = jnp.concatenate([one.vectors, jnp.zeros((*one.vectors.shape[:2], two.vectors.shape[2]))], axis=2)
        right = jnp.concatenate([jnp.zeros((*two.vectors.shape[:2], one.vectors.shape[2])), two.vectors], axis=2)
        found.append(Patterns(jnp.concatenate([one.at, two.at]), jnp.concatenate([left, right])))
    return found


def torques_on(
    gearbox: Gearbox, shaft: int, without: int | None = None
) -> tuple[Float[Array, " points"], Float[Array, " points"]]:
    """Positions [mm] and torques [N mm] on a shaft, positive for driving torques; mesh `without` is left out.

    Mesh forces are even over their faces. The coupling without a given torque balances the others.
    """
    points, weights = gauss_legendre(_POINTS)
    at: list[Array] = []
    found: list[Array] = []
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


# Tolerance of the residual, relative to the largest load, over the square root of the machine precision.
_SOLVED = 1e-2


def system_under_load(gearbox: Gearbox, patterns: list[Patterns]) -> System:
    """Equations of a gearbox as `system`, with bearings with clearance replaced by their tangent at the loads."""
    found = system(gearbox, patterns)
    plays = [bearing.play for shaft in gearbox.shafts for bearing in shaft.bearings]
    if all(play is None for play in plays):
        return found
    clearance = jnp.stack([jnp.zeros(()) if play is None else play for play in plays])
    moved = _state(system(gearbox, load_pattern(gearbox)), clearance)
    law = partial(_force, found.bearings, clearance)
    tangent = jax.jacfwd(law)(moved)
    return found._replace(bearings=tangent, play=tangent @ moved - law(moved))


def _force(
    stiffness: Float[Array, "b b"], clearance: Float[Array, " bearings"], moved: Float[Array, " b"]
) -> Float[Array, " b"]:
    """Resisting forces of bearings with clearance [um], for displacements of shafts against seats [N, N mm]."""
    each = moved.reshape(-1, _WAYS)
    square = each[:, 0] ** 2 + each[:, 1] ** 2
    touching = square > clearance**2
    distance = jnp.sqrt(jnp.where(touching, square, 1.0))
    share = jnp.where(touching, clearance / distance, jnp.where(clearance > 0, 1.0, 0.0))
    free = jnp.concatenate([share[:, None] * each[:, :2], jnp.zeros_like(each[:, 2:])], axis=1)
    return stiffness @ (moved - free.ravel())


def _state(of: System, clearance: Float[Array, " bearings"]) -> Float[Array, " b"]:
    """Displacements of the shafts against the seats under the single load of a system [um, mrad]."""
    count = len(of.bearings)
    # only start and scales, on which the root does not depend; the direction has no derivative at zero load
    linear = jax.lax.stop_gradient(solve(of, jnp.ones((1, 1))))
    resisted = -linear.force[:, 0].reshape(-1, _WAYS)
    size = jnp.sqrt(jnp.sum(resisted[:, :2] ** 2, axis=1, keepdims=True))
    along = jnp.where(size > 0, resisted[:, :2] / jnp.where(size > 0, size, 1.0), 0.0)
    played = jnp.concatenate([clearance[:, None] * along, jnp.zeros_like(resisted[:, 2:])], axis=1).ravel()
    inner, across = of.flexibility[:count, :count] + of.housing, of.flexibility[:count, count]
    here, there = of.moving[:count], of.moving[count]
    # start: the linear solution, moved on by the clearance in the direction of the bearing force
    bent = linear.bearing[:, 0] - linear.seat[:, 0]
    arm = jnp.maximum(jnp.max(jnp.abs(here), axis=0), 1.0)
    moves = here / arm[None]
    first = solve_dense(moves.T @ moves, moves.T @ (bent + played - across - inner @ linear.force[:, 0]))
    load = jnp.maximum(jnp.max(jnp.abs(linear.force)), jnp.finfo(first.dtype).tiny)
    length = jnp.maximum(jnp.max(jnp.abs(played)), jnp.max(jnp.abs(bent)))

    def displaced(x: Array) -> Array:
        force, moves = load * x[:count], length / arm * x[count:]
        return inner @ force + across + here @ moves

    def conditions(x: Array) -> Array:
        force = load * x[:count]
        resisted = _force(of.bearings, clearance, displaced(x))
        stiff = 1 + jnp.abs(of.bearings) @ jnp.max(jnp.abs(inner), axis=1)
        balance = (here.T @ force + there) / (load * arm) + of.unsupported * x[count:]
        return jnp.concatenate([(force + resisted) / (load * stiff), balance])

    start = jnp.concatenate([linear.force[:, 0] / load, first / length])
    root = implicit_root(conditions, start)
    missed = jnp.max(jnp.abs(conditions(root))) > _SOLVED * jnp.sqrt(jnp.finfo(start.dtype).eps)
    return jnp.where(missed, jnp.nan, displaced(root))
