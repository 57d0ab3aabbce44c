"""The loaded mesh over one base pitch."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..microgeometry import AbstractModification, NoModification, terms
from ..numerics import ContactProblem, check, minimum, real, safe_sqrt, solve_contact, tangent_stiffness
from .mesh import Mesh

Scalar = Float[Array, ""]
Curve = Float[Array, " positions"]
Load = Float[Array, "pairs slices positions"]


class MeshCycle(eqx.Module):
    """Result of `solve`: one modification under one torque, over one base pitch.

    Of many cycles made by `jax.vmap`, take properties and metrics under `jax.vmap` too: they know one cycle's axes.

    Attributes:
        mesh: the prepared mesh.
        torque: on the pinion [N m].
        phase: mesh position in base pitches, shape (positions,).
        transmission_error: loaded, on the line of action, positive when the wheel lags [um].
        unloaded_transmission_error: the same at vanishing load [um].
        line_load: [N/mm], shape (pairs, slices, positions).
        opening: remaining gap [um] where positive, minus the contact deflection where loaded.
        gap: gap of the undeformed flanks at zero transmission error [um]: corner gap plus both modifications.
        tangent_stiffness: d force / d transmission error at fixed position [N/um].
        residual: largest relative violation of the contact conditions, shape (positions,).
        converged: where the residual is below the resolution's tolerance and no pair beyond those carried along could
            touch, shape (positions,).
    """

    mesh: Mesh
    torque: Scalar
    phase: Curve
    transmission_error: Curve
    unloaded_transmission_error: Curve
    line_load: Load
    opening: Load
    gap: Load
    tangent_stiffness: Curve
    residual: Curve
    converged: Array

    @property
    def force(self) -> Scalar:
        """Total force on the line of action [N]."""
        return _force(self.mesh, self.torque)

    @property
    def pair_force(self) -> Float[Array, "pairs positions"]:
        """Force on the line of action that every pair contributes [N]; the pairs of a position sum to `force`."""
        return self.mesh.lever * jnp.sum(self.line_load * self.mesh.slice_width[None, :, None], axis=1)

    @property
    def contact_pressure(self) -> Load:
        """Largest Hertzian pressure on the flank [MPa]; zero where the pair is apart or touches with a tip corner.

        p = sqrt(q E* / (pi R)) (Hertz), with the plane moduli of the compliance model.
        """
        from ..metrics.pressure import flank_pressure

        return flank_pressure(self)

    @property
    def corner_pressure(self) -> Load:
        """Hertzian pressure of the tip edge on the mate's flank [MPa]; zero on the theoretical path of contact."""
        from ..metrics.pressure import corner_pressure

        return corner_pressure(self)

    def __str__(self) -> str:
        from ..metrics.report import describe

        return describe(self)


def solve(
    mesh: Mesh,
    torque,
    *,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
) -> MeshCycle:
    """Loaded tooth contact analysis of one design under one torque.

    Args:
        mesh: prepared mesh.
        torque: on the pinion [N m], scalar.
        pinion: modification of the pinion flank; None for the nominal involute.
        wheel: modification of the wheel flank; None for the nominal involute.

    Returns:
        the mesh cycle, differentiable with respect to every number in `mesh`, `torque` and the modifications.

    Raises:
        ValueError: for a negative or non-finite torque, and for a modification that varies along the face on a mesh of
            one slice.
    """
    check("solve", "torque", torque, "N m", low=0.0)
    _check_slices(mesh, pinion=pinion, wheel=wheel)
    return _solve(mesh, real(torque), pinion, wheel)


def solve_removed(mesh: Mesh, torque, removed: Load) -> MeshCycle:
    """`solve` for material removed as an array: one compilation serves every kind of modification.

    Args:
        mesh: prepared mesh.
        torque: on the pinion [N m], scalar.
        removed: material removed from both flanks together at every contact [um], as `removed_material` gives it.
    """
    check("solve_removed", "torque", torque, "N m", low=0.0)
    return _solve_removed(mesh, real(torque), removed)


@eqx.filter_jit
def _solve(mesh: Mesh, torque: Scalar, pinion, wheel) -> MeshCycle:
    return _solve_removed(mesh, torque, _removed_material(mesh, torque, pinion, wheel))


@eqx.filter_jit
def _solve_removed(mesh: Mesh, torque: Scalar, removed: Load) -> MeshCycle:
    torque = torque.astype(mesh.phase.dtype)
    force = _force(mesh, torque)
    gap = mesh.corner_gap[:, None] + removed
    problem = ContactProblem(mesh.structure, mesh.law, gap, mesh.lever, mesh.slice_width, force)
    solution = solve_contact(problem, steps=mesh.resolution.newton_steps, tolerance=mesh.resolution.tolerance)
    windup = mesh.hub * force / mesh.pair.face_width
    contact_stiffness = tangent_stiffness(problem, solution)
    unloaded = minimum(gap / mesh.lever[:, None], axis=(0, 1))
    return MeshCycle(
        mesh=mesh,
        torque=torque,
        phase=mesh.phase,
        transmission_error=solution.approach + windup,
        unloaded_transmission_error=unloaded,
        line_load=solution.line_load,
        opening=solution.opening,
        gap=gap,
        tangent_stiffness=1 / (1 / contact_stiffness + mesh.hub / mesh.pair.face_width),
        residual=solution.residual,
        converged=solution.solved & (solution.approach - unloaded < mesh.outer_gap),
    )


def removed_material(
    mesh: Mesh,
    torque,
    *,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
) -> Load:
    """Material removed from both flanks, averaged over the contact with the weight of the Hertzian pressure [um].

    To first order a small gap that varies across the contact acts with its pressure-weighted mean. The half width is
    that of one pair that carries the full load.

    Args:
        mesh: prepared mesh.
        torque: on the pinion [N m], scalar.
        pinion: modification of the pinion flank; None for the nominal involute.
        wheel: modification of the wheel flank; None for the nominal involute.

    Returns:
        shape (pairs, slices, positions).

    Raises:
        ValueError: for a modification that varies along the face on a mesh of one slice.
    """
    _check_slices(mesh, pinion=pinion, wheel=wheel)
    return _removed_material(mesh, real(torque), pinion, wheel)


def _check_slices(mesh: Mesh, **flanks: AbstractModification | None) -> None:
    """Refuses what a mesh of one slice cannot show: it would be ignored without a word. A traced amount counts."""
    if mesh.resolution.slices > 1:
        return
    for gear, modification in flanks.items():
        for term in terms(modification or NoModification()):
            if term.varies_along_face:
                raise ValueError(
                    f"{gear}: {term} varies along the face, which a mesh of 1 slice cannot show: prepare with "
                    "Resolution(slices=11)"
                )


@eqx.filter_jit
def _removed_material(mesh: Mesh, torque: Scalar, pinion, wheel) -> Load:
    half_width = safe_sqrt(mesh.width_factor * _force(mesh, torque) / mesh.pair.face_width)
    weights = list(mesh.patch_weight)
    flanks = [mesh.flanks(place * half_width) for place in mesh.patch_place]
    sizes = mesh.resolution
    total = jnp.zeros((sizes.pairs, sizes.slices, sizes.positions), mesh.phase.dtype)
    for modification, points in zip((pinion, wheel), zip(*flanks)):
        # every term on its own, since most vary along the profile or along the face only
        for term in terms(modification or NoModification()):
            total = total + sum(weight * term(point) for weight, point in zip(weights, points)) / sum(weights)
    return total


def _force(mesh: Mesh, torque: Scalar) -> Scalar:
    """Force on the line of action [N]."""
    return 1e3 * torque / mesh.pair.pinion.base_radius
