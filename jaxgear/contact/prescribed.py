"""Contact of the mesh at a prescribed transmission error, or under a force of every position: for dynamics and wear."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..microgeometry import AbstractModification
from ..numerics import Checked, Numbers, check, program, real, result
from .face_coupling import check_torque
from .mesh import Mesh
from .operating_point import Torque, operating_point_of
from .slide import RemovedMaterial, for_contact, loaded_material
from .solve import check_mesh, contact_of, contact_status, flanks_of, pair_forces, teeth_in_contact
from .status import Status, Statuses, WithStatus, status_of

# Newton steps of a mesh of several slices from the approach of all springs in series to that of the teeth: the force of
# contacts that stiffen bends one way, so that the steps come from one side and double their digits.
_SERIES_STEPS = 4
# what may be missed of the approach [um, and relative to it] before the last correction, which is of second order
_MET = 1e-3

Scalar = Float[Array, ""]
Curve = Float[Array, " positions"]
Load = Float[Array, "pairs slices positions"]


class PrescribedContact(WithStatus, Checked):
    """Result of `solve_at`.

    Attributes:
        transmission_error: that was prescribed [um], shape (positions,).
        force: total force on the line of action [N], shape (positions,).
        pair_force: what every pair contributes [N], shape (pairs, positions).
        line_load: [N/mm], shape (pairs, slices, positions); exactly zero where nothing touches, as are the forces.
        tangent_stiffness: d force / d transmission error [N/um] on the material that is met; it counts only where there
            is contact.
        residual: largest relative violation of the contact conditions, shape (positions,).
        status: of every position, as of a `MeshCycle`, shape (positions,).
    """

    transmission_error: Curve = result("um")
    force: Curve = result("N")
    pair_force: Float[Array, "pairs positions"] = result("N")
    line_load: Load = result("N/mm")
    tangent_stiffness: Curve = result("N/um")
    residual: Curve = result()
    status: Statuses = result()


def solve_at(
    mesh: Mesh,
    transmission_error: Numbers,
    torque: Torque,
    *,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
) -> PrescribedContact:
    """Contact at a prescribed transmission error of the teeth: the force that it takes, zero where they are apart.

    The wind-up of the gear bodies between bore and root is a spring of its own in series, that all pairs share
    (`mesh.hub`): the error here is without it. That of a cycle is `solve_at` of

        cycle.transmission_error - mesh.hub * cycle.force / mesh.pair.face_width

    Args:
        mesh: prepared mesh.
        transmission_error: without the wind-up of the bodies [um], scalar or shape (positions,).
        torque: on the pinion [N m], at which the width of the contact is taken over which modifications are averaged:
            that of the mean load. With a compliance that averages over the loaded width it is that of a first solution,
            and the loads which that finds at the prescribed error make the widths of the second one.
        pinion: modification of the pinion flank; None for the nominal involute.
        wheel: modification of the wheel flank; None for the nominal involute.

    Returns:
        the contact, differentiable with respect to every number.

    Raises:
        TypeError: for something else than a prepared mesh or a modification.
        ValueError: for a transmission error that is not finite or has another shape, and as `solve`.
    """
    check_mesh(mesh)
    error, positions = real(transmission_error), mesh.resolution.positions
    if error.shape not in ((), (positions,)):
        raise ValueError(f"transmission_error has shape {error.shape}, must be a single number or ({positions},)")
    check("transmission_error", error, "um")
    torque = operating_point_of(torque, mesh.slice_width.dtype).torque
    check_torque(mesh.support_torque, torque)
    flanks, prepared = flanks_of(mesh, pinion, wheel), for_contact(mesh)
    error = jnp.broadcast_to(error.astype(torque.dtype), (positions,))

    def first_contact(removed):
        contact = solve_at_material(prepared, error, removed)
        return contact.line_load, contact.residual

    return solve_at_material(prepared, error, loaded_material(mesh, torque, *flanks, first_contact))


@program
def solve_at_material(
    mesh: Mesh, approach: Curve, removed: RemovedMaterial, shared: Scalar | None = None
) -> PrescribedContact:
    """Contact at a prescribed approach of the teeth; of a mesh of one slice with a shared compliance [um/N] in series.

    Its deflection is then part of the approach and of the tangent stiffness, not of the transmission error.
    """
    structure = mesh.own_structure
    if shared is not None:
        structure = structure + shared * mesh.slice_width[0] * mesh.lever[:, None] * mesh.lever[None]
    gap = mesh.corner_gap + removed.amount
    contact = contact_of(mesh, gap, removed.shift, approach=approach, compliance=structure)
    solution = contact.solution
    pair_force = pair_forces(mesh, solution.line_load)
    force = jnp.sum(pair_force, axis=0)
    error = approach if shared is None else approach - shared * force
    return PrescribedContact(
        transmission_error=error,
        force=force,
        pair_force=pair_force,
        line_load=solution.line_load,
        tangent_stiffness=contact.tangent_stiffness,
        residual=solution.residual,
        status=contact_status(mesh, contact, error, removed),
    )


@program
def cycle_at_material(mesh: Mesh, approach: Curve, removed: RemovedMaterial) -> dict[str, Array]:
    """Fields of a `MeshCycle` at a prescribed approach of the teeth, its transmission error."""
    gap = mesh.corner_gap + removed.amount
    return teeth_in_contact(mesh, contact_of(mesh, gap, removed.shift, approach=approach), gap, removed)


class ForcedContact(WithStatus, eqx.Module):
    """Contact under forces that differ from position to position.

    Attributes:
        line_load: [N/mm], shape (pairs, slices, positions).
        status: of every position, shape (positions,).
    """

    line_load: Load
    status: Statuses


@program
def solve_forces(mesh: Mesh, force: Curve, removed: RemovedMaterial) -> ForcedContact:
    """Contact under a force on the line of action at every mesh position [N], at least zero, shape (positions,)."""
    contact = contact_of(mesh, mesh.corner_gap + removed.amount, removed.shift, load=force)
    status = contact_status(mesh, contact, contact.solution.approach, removed)
    return ForcedContact(contact.solution.line_load, status)


class SeriesContact(WithStatus, eqx.Module):
    """Contact at a prescribed approach of teeth and what they share in series, shape (positions,) each.

    Attributes:
        force: [N].
        stiffness: its slope over the approach [N/um].
        transmission_error: of the teeth alone, as `solve_at` takes it [um].
        status: of the contact.
    """

    force: Curve
    stiffness: Curve
    transmission_error: Curve
    status: Statuses


def solve_series(mesh: Mesh, approach: Curve, removed: RemovedMaterial, compliance: Scalar) -> SeriesContact:
    """Contact at a prescribed approach of the teeth and what they share in series, whose deflection is part of it.

    Args:
        mesh: prepared mesh.
        approach: of teeth, wind-up of the bodies (`mesh.hub`) and series compliance together [um], shape (positions,).
        removed: material removed from the flanks.
        compliance: further one in series, of shafts for instance [um/N].
    """
    shared = mesh.hub / mesh.pair.face_width + compliance
    if mesh.resolution.slices == 1:  # a compliance that couples all pairs: one solution is enough
        found = solve_at_material(mesh, approach, removed, shared)
        return SeriesContact(found.force, found.tangent_stiffness, found.transmission_error, found.status)

    def step(error, _):
        found = solve_at_material(mesh, error, removed)
        softened = 1 + shared * found.tangent_stiffness
        missed = approach - error - shared * found.force
        stiffness = found.tangent_stiffness / softened
        met = jnp.abs(missed) <= _MET * (1 + jnp.abs(approach))
        status = status_of({Status.NOT_CONVERGED: ~met}, found.status)
        return error + missed / softened, SeriesContact(found.force + stiffness * missed, stiffness, error, status)

    return jax.tree.map(lambda part: part[-1], jax.lax.scan(step, approach, length=_SERIES_STEPS)[1])
