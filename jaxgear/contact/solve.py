"""Contact of the loaded mesh over one base pitch."""

from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..compliance import AbstractCompliance
from ..geometry import GearPair, reduced_radius
from ..microgeometry import AbstractModification, NoModification, terms
from ..numerics import (
    ContactProblem,
    ContactSolution,
    Given,
    Known,
    concrete,
    minimum,
    opening,
    program,
    solve_contact,
    stored,
    tangent_stiffness,
)
from ..numerics.programs import begin
from .covering import may_take_more, more_pairs
from .cycle import MeshCycle
from .face_coupling import check_torque, ends_together, holds_at
from .mesh import Mesh, begin_mesh, resized
from .operating_point import OperatingPoint, Torque, operating_point_of
from .resolution import Resolution
from .slide import Own, RemovedMaterial, as_removed, for_contact, loaded_material, nothing_removed
from .status import Status, Statuses, status_of
from .support import AbstractSupport

Scalar = Float[Array, ""]
Curve = Float[Array, " positions"]
Load = Float[Array, "pairs slices positions"]


def solve(
    mesh: Mesh,
    torque: Torque,
    *,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
) -> MeshCycle:
    """Loaded tooth contact analysis of one design under one torque.

    Torque and modifications are taken in the precision of the mesh.

    Args:
        mesh: prepared mesh.
        torque: on the pinion [N m], scalar; or an `OperatingPoint`.
        pinion: modification of the pinion flank; None for the nominal involute.
        wheel: modification of the wheel flank; None for the nominal involute.

    Returns:
        the mesh cycle, differentiable with respect to every number in `mesh`, `torque` and the modifications. Where
        the number of pairs was left open, is too small for this load, and nothing is traced, it has more of them.
        While anything is traced the pairs stay as they are: the numbers are finite, and `status` says that more pairs
        are needed. `optimize.evaluate` gives NaN there.

    Raises:
        TypeError: for something else than a prepared mesh or a modification.
        ValueError: for a negative or non-finite torque, an array of torques, a modification that varies along the
            face on a mesh of one slice, or a torque that is not that of the gearbox which holds the gears.
    """
    check_mesh(mesh)
    operating_point = operating_point_of(torque, mesh.slice_width.dtype)
    check_torque(mesh.support_torque, operating_point.torque)
    pinion, wheel = flanks_of(mesh, pinion, wheel)
    # two programs: that of the contact, by far the longer one to compile, serves every kind of modification
    removed = material_of(mesh, operating_point.torque, pinion, wheel)
    cycle = mesh_cycle(
        mesh, operating_point, _solve_removed(for_contact(mesh), operating_point.torque, removed), pinion, wheel
    )
    wider = wider_mesh(mesh, cycle.status)
    return cycle if wider is None else solve(wider, operating_point, pinion=pinion, wheel=wheel)


def solve_removed(
    mesh: Mesh,
    torque: Torque,
    removed: RemovedMaterial | Given,
    *,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
) -> MeshCycle:
    """`solve` for the material removed: one compilation serves every kind of modification.

    Args:
        mesh: prepared mesh.
        torque: on the pinion [N m], scalar; or an `OperatingPoint`.
        removed: from both flanks together at every contact, as `removed_material` gives it; or the amount alone [um],
            shape (pairs, slices, positions), where the contacts stay at their nominal places.
        pinion, wheel: modifications for the cycle to carry, where they are known; `removed` alone is solved for.

    Raises:
        TypeError: for something else than a prepared mesh.
        ValueError: for a negative or non-finite torque, an array of torques, removed material of another shape, or a
            torque that is not that of the gearbox which holds the gears.
    """
    check_mesh(mesh)
    operating_point = operating_point_of(torque, mesh.slice_width.dtype)
    check_torque(mesh.support_torque, operating_point.torque)
    shape = jnp.shape(removed.amount if isinstance(removed, RemovedMaterial) else removed)
    wanted = (mesh.resolution.pairs, mesh.resolution.slices, mesh.resolution.positions)
    if shape != wanted:
        raise ValueError(f"removed has shape {shape}, must be {wanted} (pairs, slices, positions)")
    removed = removed if isinstance(removed, RemovedMaterial) else as_removed(mesh.resolution, removed)
    return mesh_cycle(
        mesh, operating_point, _solve_removed(for_contact(mesh), operating_point.torque, removed), pinion, wheel
    )


def known_at(cycle: MeshCycle, place: Array) -> Known:
    """The solution of a cycle at the position of this number."""
    found = (cycle.line_load, cycle.opening, cycle.transmission_error)
    return Known(*(jax.lax.dynamic_index_in_dim(each, place, axis=-1) for each in found))


def solve_known(
    mesh: Mesh, point: OperatingPoint, known: Known, pinion: AbstractModification, wheel: AbstractModification
) -> MeshCycle:
    """`solve` where the solution is known, its approach as transmission error: derivatives, without any iteration."""
    removed = material_of(mesh, point.torque, pinion, wheel)
    return mesh_cycle(mesh, point, _solve_removed(for_contact(mesh), point.torque, removed, known), pinion, wheel)


def removed_material(
    mesh: Mesh,
    torque: Torque,
    *,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
) -> RemovedMaterial:
    """Material removed from both flanks, as the contacts meet it.

    A small gap that varies across the contact acts with its mean, weighted by the Hertzian pressure; the contact slides
    down the slope of the flanks to where bulge and mean together are least, and is as wide as the load of unmodified
    flanks makes it; with a compliance that averages over the loaded width, as that by finite elements, it is as wide as
    its own load from a first solution does (see `slide`). The width grows with the torque, so that on flanks beyond
    what the first order holds for the transmission error can fall while the torque grows. Measured on a 19/48 pair of
    module 3, from 1 to 200 N m in 23 steps: none of 360 000 steps falls with tip reliefs and crowning, 3 % do with
    tables of random values between 0 and 5 um every 0.05 mm, which hold many places of rest. On material that is kept
    from one torque (`solve_removed`, `solve_at`) the transmission error always rises, with the slope 1 /
    `tangent_stiffness`.

    Args:
        mesh: prepared mesh.
        torque: on the pinion [N m], scalar; or an `OperatingPoint`.
        pinion: modification of the pinion flank; None for the nominal involute.
        wheel: modification of the wheel flank; None for the nominal involute.

    Returns:
        amount, contact shift and relative curvature of the flanks; fields add to the amount with `+`.

    Raises:
        TypeError: for something else than a prepared mesh or a modification.
        ValueError: for a negative or non-finite torque, an array of torques, or a modification that varies along the
            face on a mesh of one slice.
    """
    check_mesh(mesh)
    torque = operating_point_of(torque, mesh.slice_width.dtype).torque
    pinion, wheel = flanks_of(mesh, pinion, wheel)
    return material_of(mesh, torque, pinion, wheel)


def material_of(
    mesh: Mesh, torque: Scalar, pinion: AbstractModification, wheel: AbstractModification, own: Own | None = None
) -> RemovedMaterial:
    """`removed_material` of what is checked, with further modifications of every pair, see `slid_material`."""

    def first_contact(removed):
        contact = _solve_removed(for_contact(mesh), torque, removed)
        return contact["line_load"], contact["residual"]

    return loaded_material(mesh, torque, pinion, wheel, first_contact, own)


def begin_contact(
    pair: GearPair,
    compliance: AbstractCompliance,
    first: Resolution,
    resolution: Resolution,
    support: AbstractSupport | None = None,
) -> None:
    """Start to compile the programs that prepare a pair and solve its contact, where programs are kept.

    Call this early to overlap compilation with other work. The program that prepares the pair at the array sizes
    `first` is compiled before the others.
    """
    even = ends_together(pair, compliance)
    begin_mesh(pair, compliance, first, support, even)
    mesh = begin_mesh(pair, compliance, resolution, support, even)
    if mesh is not None:
        dtype = mesh.slice_width.dtype
        nothing = jax.eval_shape(lambda: nothing_removed(resolution, dtype))
        begin(_solve_removed, eqx.filter_eval_shape(for_contact, mesh), np.zeros((), dtype), nothing)


def check_mesh(mesh: object) -> None:
    """Raises a one-line `TypeError` for something else than a prepared mesh."""
    if not isinstance(mesh, Mesh):
        raise TypeError(f"mesh is a {type(mesh).__name__}, must be a Mesh: jaxgear.prepare makes one")


def check_alike(mesh: Mesh) -> None:
    """Raise for a mesh whose cycles differ from each other, in what follows gears over more than one.

    Raises:
        TypeError: for something else than a prepared mesh.
        ValueError: for a ring gear on arcs.
    """
    check_mesh(mesh)
    if not mesh.pair.wheel.alike:
        raise ValueError(
            "RingGear: support: on arcs every mesh cycle differs from the one before: only single mesh cycles are "
            "covered, for the rest hold the ring gear alike all round"
        )


def flanks_of(
    mesh: Mesh, pinion: AbstractModification | None, wheel: AbstractModification | None
) -> tuple[AbstractModification, AbstractModification]:
    """Both modifications, that of the nominal involute for None.

    Raises:
        TypeError: for something else than a modification.
        ValueError: for a modification that a mesh of one slice cannot show: it would have no effect. A traced amount
            counts.
    """
    for gear, modification in (("pinion", pinion), ("wheel", wheel)):
        if modification is not None and not isinstance(modification, AbstractModification):
            raise TypeError(
                f"{gear} is a {type(modification).__name__}, must be a modification such as TipRelief, or None"
            )
        for term in terms(modification or NoModification()):
            if mesh.resolution.slices == 1 and term.varies_along_face:
                raise ValueError(
                    f"{gear}: {term} varies along the face, which a mesh of 1 slice cannot show: prepare with "
                    "Resolution(slices=11)"
                )
    return pinion or NoModification(), wheel or NoModification()


def mesh_cycle(
    mesh: Mesh,
    operating_point: OperatingPoint,
    contact: dict[str, Any],
    pinion: AbstractModification | None,
    wheel: AbstractModification | None,
) -> MeshCycle:
    """Mesh cycle of a contact; the inputs do not pass through the compiled programs, which would copy them."""
    return MeshCycle(
        kinematics=mesh.kinematics,
        margins=mesh.margins,
        operating_point=operating_point,
        pinion=pinion,
        wheel=wheel,
        **contact,
    )


def wider_mesh(mesh: Mesh, status: Statuses) -> Mesh | None:
    """The mesh at the same positions where more pairs can touch, if their number was open, is too small and known."""
    if not more_pairs_help(mesh, status):
        return None
    if mesh.alternates:
        return replace(mesh, alternates=False)
    return resized(mesh, pairs=mesh.resolution.chosen_pairs + more_pairs(mesh.pair))


def more_pairs_help(mesh: Mesh, status: Statuses) -> bool:
    """Whether a result on a mesh whose number of pairs was left open needs more of them; False while it is traced."""
    known = concrete(status) if mesh.automatic else None
    if known is None or not (known == Status.MORE_PAIRS_NEEDED).any():
        return False
    return may_take_more(mesh.pair, mesh.path_of_contact, mesh.resolution)


class Contact(NamedTuple):
    """A contact problem and its solution.

    Attributes:
        gap: of the flanks with that of the support [um].
        solution: of all pairs.
        tangent_stiffness: of the teeth in contact [N/um].
        contained: where no pair touches that was taken to be too far from the mate.
    """

    gap: Load
    solution: ContactSolution
    tangent_stiffness: Curve
    contained: Bool[Array, " positions"]


def contact_of(mesh: Mesh, gap: Load, shift: Float[Array, "pairs #slices positions"], **given: Any) -> Contact:
    """The contact of a mesh.

    Args:
        mesh: prepared mesh.
        gap: of the undeformed flanks on rigid, parallel shafts [um].
        shift: of the centre of contact [mm].
        given: `load` [N], scalar or shape (positions,), or `approach` [um]; `compliance` in place of that of the mesh;
            the solution where it is `known`.
    """
    if "load" in given:
        given["start_law"] = mesh.law
    problem = ContactProblem(
        **{"compliance": mesh.own_structure, **given},
        law=mesh.law.moved(shift),
        gap=mesh.held(gap),
        lever=mesh.lever,
        weight=mesh.slice_width,
        coupling=mesh.coupling,
    )
    if problem.load is None or not mesh.alternates:
        solution = _solved(mesh, problem)
        everywhere = jnp.ones(solution.approach.shape, bool)
        return Contact(problem.gap, solution, tangent_stiffness(problem, solution), everywhere)
    return _of_two_pairs(mesh, problem)


def _of_two_pairs(mesh: Mesh, problem: ContactProblem) -> Contact:
    """The contact where in every slice only the two pairs next to the middle of the path can touch.

    They are the springs of the problem: of the even pairs the first one, of the odd pairs the second one.
    """
    coupling, known = problem.coupling, problem.known
    assert coupling is not None and coupling.scale is not None  # `pairs_alternate` asks for both
    distance = jnp.abs(mesh.kinematics.path)
    nearest = [jnp.argmin(distance[first::2], axis=0) for first in (0, 1)]
    chosen = jnp.stack([nearest[i % 2] == i // 2 for i in range(len(distance))])

    def springs(pairs: Array) -> Array:
        rows = [pairs[0], pairs[1]]
        for i in range(2, len(pairs)):
            rows[i % 2] = jnp.where(chosen[i], pairs[i], rows[i % 2])
        return jnp.stack([jnp.broadcast_to(row, chosen.shape[1:]) for row in rows])

    def pairs(springs: Array) -> Array:
        return jnp.stack([jnp.where(flag, springs[i % 2], jnp.zeros_like(springs[0])) for i, flag in enumerate(chosen)])

    touching = replace(coupling, scale=jnp.where(chosen, coupling.scale, 0.0))
    near = replace(
        problem,
        compliance=touching.local(2),
        law=jax.tree.map(springs, problem.law),
        start_law=jax.tree.map(springs, problem.start_law),
        gap=springs(problem.gap),
        lever=springs(problem.lever),
        coupling=touching,
        known=known and Known(springs(known.line_load), springs(known.opening), known.approach),
    )
    found = _solved(mesh, near)
    load = pairs(found.line_load)
    left = jnp.stack(opening(problem, list(load), found.approach))
    solution = replace(found, line_load=load, opening=left, in_contact=pairs(found.in_contact))
    apart = jnp.min(jnp.where(chosen, 0.0, left), axis=(0, 1)) >= 0
    return Contact(problem.gap, solution, tangent_stiffness(near, found), apart)


def _solved(mesh: Mesh, problem: ContactProblem) -> ContactSolution:
    """The solution of the problem.

    Helical bodies lean by the total load and move all slices alike by its moment (`face_coupling`): under a known load
    the one is a gap and the other part of the approach, which takes half the time of a support.
    """
    sizes, coupling = mesh.resolution, problem.coupling
    solve = partial(solve_contact, steps=sizes.newton_steps, tolerance=sizes.rtol)
    if problem.load is None or coupling is None or not mesh.leans:
        return solve(problem)
    assert coupling.support is not None and coupling.support_modes is not None
    even, leaning = coupling.support_modes.T
    by_load = coupling.support[1, 0] * even[0]
    total = jnp.atleast_1d(problem.load)
    gap = (leaning[:, None] * by_load * total[None])[None]
    upright = replace(coupling, support_modes=None, support=None)

    def leant(line_load: Load) -> Curve:
        force = problem.weight[:, None] * sum(lever * q for lever, q in zip(problem.lever, line_load))
        return by_load * jnp.sum(leaning[:, None] * force, axis=0)

    known = problem.known
    if known is not None:
        known = known._replace(approach=known.approach - leant(known.line_load))
    gap = stored(problem.gap + problem.lever * gap)
    found = solve(replace(problem, gap=gap, coupling=upright, known=known))
    return replace(found, approach=found.approach + leant(found.line_load))


def pair_forces(mesh: Mesh, line_load: Load) -> Float[Array, "pairs positions"]:
    """Force on the line of action that every pair contributes under line loads [N/mm], in N."""
    return jnp.sum(mesh.lever * line_load * mesh.slice_width[None, :, None], axis=1)


def contact_status(mesh: Mesh, contact: Contact, error: Curve, removed: RemovedMaterial) -> Statuses:
    """Status of the contact at every position, shape (positions,).

    Args:
        mesh: prepared mesh.
        contact: its contact.
        error: transmission error without the wind-up of the bodies [um].
        removed: material removed from the flanks.
    """
    # the deflection of the support closes no gap of pairs that are not carried along
    solution = contact.solution
    teeth, last = error - mesh.support_deflection(solution.line_load), outermost(mesh, removed)
    # what is not a number has not converged
    causes = {
        Status.NOT_CONVERGED: ~(solution.converged & (teeth < last) & contact.contained),
        Status.MORE_PAIRS_NEEDED: (teeth >= last) | ~contact.contained,
    }
    return status_of(causes, mesh.status)


def outermost(mesh: Mesh, removed: RemovedMaterial) -> Curve:
    """Transmission error from which the next pairs behind and ahead of those carried along may touch [um].

    They are taken to be modified as the last pair is where it begins and the first one where it ends the base pitch.
    What falls off there, as root relief does up the flank, may go on falling at the same rate, and a contact that
    slides there may slide farther: twice what sliding gains at the edge is taken off (of 4,000 random flanks of up to
    1000 um, one touches before), but never more than to unmodified flanks, or to twice the excess material of the path.
    """
    removed = jax.lax.stop_gradient(removed)
    amount, gain = removed.amount, _sliding_gain(mesh, removed.shift)
    edge = jnp.stack([amount[-1, :, 0], amount[0, :, -1]])
    fall = jnp.minimum(edge - jnp.stack([amount[-1, :, 1], amount[0, :, -2]]), 0.0)
    # positions without a solution, NaN, say nothing of the others
    excess = 2 * jnp.min(jnp.where(jnp.isnan(amount), 0.0, amount), initial=0.0)
    left = jnp.maximum(edge - 2 * gain, excess)[..., None] + fall[..., None] * _outer_steps(mesh)
    if mesh.support_gap is not None:
        left = left + mesh.outer_lever * mesh.support_gap[None, :, None]
    return jnp.min(mesh.outer_gap + left / mesh.outer_lever, axis=(0, 1))


def _outer_steps(mesh: Mesh) -> Float[Array, "2 #slices positions"]:
    """Distance of the outer contacts from the last one where it begins and the first one where it ends the base pitch,
    in steps of the latter from one position to the next.
    """
    pinion, wheel = (side.contact_roll_length for side in mesh.sides)
    second = min(1, mesh.resolution.positions - 1)  # of a single position there is no step, and nothing falls
    edges = [(pinion[-1, ..., 0], pinion[-1, ..., second]), (wheel[0, ..., -1], wheel[0, ..., -1 - second])]
    first, next_one = (jnp.stack(each)[..., None] for each in zip(*edges))
    one = jnp.maximum(jnp.abs(first - next_one), 1e-6 * jnp.abs(first))
    return jax.lax.stop_gradient(jnp.abs(mesh.outer_roll_length - first) / one)


def _sliding_gain(mesh: Mesh, shift) -> Float[Array, "2 slices"]:
    """Fall of the gap by a slope at the edges of the base pitch, R s^2 / 2, the larger of two positions [um]."""
    ends = [(-1, slice(None, 2)), (0, slice(-2, None))]
    rolls = [[side.contact_roll_length[pair, :, places] for side in mesh.sides] for pair, places in ends]
    gains = [500 * shift[pair, :, places] ** 2 / reduced_radius(*both) for (pair, places), both in zip(ends, rolls)]
    return jnp.stack([jnp.max(gain, axis=-1) for gain in gains])


@program
def _solve_removed(
    mesh: Mesh, torque: Scalar, removed: RemovedMaterial, known: Known | None = None
) -> dict[str, Array]:
    """The contact; where it is `known`, its approach is the transmission error."""
    force = _force(mesh, torque)
    removed = jax.tree.map(lambda field: field.astype(force.dtype), removed)
    # stored, or a compiler works the material out again for the few places that the status looks at
    removed = RemovedMaterial(stored(removed.amount), stored(removed.shift), removed.relative_curvature)
    gap = mesh.corner_gap + removed.amount
    windup = mesh.hub * force / mesh.pair.face_width
    known = known and known._replace(approach=known.approach - windup)
    contact = contact_of(mesh, gap, removed.shift, load=force, known=known)
    found = teeth_in_contact(mesh, contact, gap, removed)
    status = found["status"]
    if mesh.support_torque is not None:
        status = status_of({Status.OUT_OF_VALIDITY: ~holds_at(mesh.support_torque, torque)}, status)
    return found | {
        "transmission_error": found["transmission_error"] + windup,
        "tangent_stiffness": 1 / (1 / contact.tangent_stiffness + mesh.hub / mesh.pair.face_width),
        "status": status,
    }


def teeth_in_contact(mesh: Mesh, contact: Contact, gap: Load, removed: RemovedMaterial) -> dict[str, Array]:
    """Fields of a mesh cycle by its contact, without wind-up of the bodies."""
    solution = contact.solution
    return {
        "transmission_error": solution.approach,
        "unloaded_transmission_error": minimum(contact.gap / mesh.lever, axis=(0, 1)),
        "line_load": solution.line_load,
        "pair_force": pair_forces(mesh, solution.line_load),
        "opening": solution.opening,
        "gap": gap,
        "shift": removed.shift,
        "relative_curvature": removed.relative_curvature,
        "tangent_stiffness": contact.tangent_stiffness,
        "residual": solution.residual,
        "status": contact_status(mesh, contact, solution.approach, removed),
    }


def _force(mesh: Mesh, torque: Scalar) -> Scalar:
    """Force on the line of action [N]."""
    return 1e3 * torque / mesh.pair.pinion.base_radius
