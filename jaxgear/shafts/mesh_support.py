"""Gap of a mesh over its face due to shafts, bearings and housing."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..contact.status import Status, Statuses, status_of
from ..contact.support import AbstractSupport
from ..geometry import GearPair, margins
from ..numerics import Given, concrete, number, program, real, whole, within_limits
from .gearbox import Gearbox
from .loads import acting, load_pattern, mesh_patterns, side_by_side, solve, system_under_load, torques_on
from .misalignment import Misalignment
from .stepped_beam import ROUNDING, check_symmetric, semidefinite, symmetric, twist

Slices = Float[Array, " slices"]
Scalar = Float[Array, ""]


def _status(gears: GearPair, possible: Bool[Array, ""]) -> Statuses:
    return status_of({Status.SUPPORT_NOT_POSSIBLE: ~possible, Status.GEARS_CANNOT_RUN: ~margins(gears).valid})


class RigidSupport(AbstractSupport):
    """Support by rigid axes, with a misalignment.

    Attributes:
        gears: gear pair.
        misalignment: misalignment of the axes.
    """

    gears: GearPair
    misalignment: Misalignment = eqx.field(default_factory=Misalignment)

    @property
    def pair(self) -> GearPair:
        """Gear pair of the support."""
        return self.gears

    @property
    def status(self) -> Statuses:
        """Status of the checks: numbers in their ranges, and gears that can run."""
        return _status(self.gears, within_limits(self))

    def influence(self, y: Slices) -> Float[Array, "slices slices"]:
        """Zero influence: the axes are rigid [um/N], shape (slices, slices)."""
        return jnp.zeros((len(y), len(y)))

    def gap(self, y: Slices) -> Slices:
        """Gap due to the misalignment at face coordinates [mm]; in um, shape (slices,)."""
        return self.misalignment.over_face(self.pair) * real(y) / self.pair.face_width


class TabulatedSupport(AbstractSupport):
    """Support given as a table by another program or a measurement; the same at every torque.

    Attributes:
        gears: gear pair.
        matrix: influence matrix [um/N], shape (slices, slices), for slices of equal width: gap that opens in one slice
            under a unit force between the flanks in another slice. A mesh represents it by `face_modes` polynomials
            over the face.
        opening: gap in every slice without the force of this mesh [um], shape (slices,); None for none.

    Raises:
        ValueError: for a matrix that is not square and symmetric, or an `opening` with another number of slices.
    """

    gears: GearPair
    matrix: Float[Array, "slices slices"] = number("um/N", shape=("slices", "slices"))
    opening: Slices | None = number("um", shape=("slices",), optional=True, default=None)

    def check_together(self) -> None:
        known = concrete(self.matrix)
        if known is not None:
            if known.shape[0] != known.shape[1]:
                raise ValueError(f"TabulatedSupport: matrix is {known.shape[0]} x {known.shape[1]}, must be square")
            check_symmetric("TabulatedSupport: matrix", known)
            values = np.linalg.eigvalsh(symmetric(known))
            if values[0] < -ROUNDING * values[-1]:
                raise ValueError(
                    f"TabulatedSupport: matrix has the eigenvalue {values[0]:.6g} um/N, must not be negative: a "
                    "support deflects under a force"
                )
        if self.opening is not None and len(self.opening) != len(self.matrix):
            raise ValueError(
                f"TabulatedSupport: opening has {len(self.opening)} slices, must have the {len(self.matrix)} of matrix"
            )

    @property
    def pair(self) -> GearPair:
        """Gear pair of the support."""
        return self.gears

    @property
    def needs_even_slices(self) -> bool:
        return True

    @property
    def tabulated(self) -> Float[Array, "slices slices"]:
        """Influence matrix as given [um/N], shape (slices, slices)."""
        return self.matrix

    @property
    def status(self) -> Statuses:
        """Status of the checks: numbers in their ranges, gears that can run, and a positive semidefinite matrix."""
        return _status(self.gears, within_limits(self) & semidefinite(symmetric(self.matrix)))

    def influence(self, y: Slices) -> Float[Array, "slices slices"]:
        """Symmetric part of `matrix` [um/N], shape (slices, slices).

        Raises:
            ValueError: if the number of slices differs from that of the matrix.
        """
        if len(y) != len(self.matrix):
            raise ValueError(
                f"TabulatedSupport: matrix has {len(self.matrix)} slices, the mesh has {len(y)}: "
                f"Resolution(slices={len(self.matrix)})"
            )
        return symmetric(self.matrix)

    def gap(self, y: Slices) -> Slices:
        """Gap without the force of this mesh, `opening` or zero [um], shape (slices,)."""
        return jnp.zeros(len(y)) if self.opening is None else self.opening


class ShaftSupport(AbstractSupport):
    """Support of a mesh by the shafts of a gearbox; made by `support`.

    Attributes:
        gearbox: gearbox, with the torques of its couplings.
        mesh: index of the mesh, from 0.

    Raises:
        ValueError: for an index without a mesh.
    """

    gearbox: Gearbox
    mesh: int = eqx.field(static=True)

    def check_together(self) -> None:
        if not self.gearbox.meshes:
            raise ValueError("ShaftSupport: gearbox has no mesh")
        whole("ShaftSupport: mesh", self.mesh, 0, len(self.gearbox.meshes) - 1)

    @property
    def pair(self) -> GearPair:
        """Gear pair of the mesh."""
        return self.gearbox.pair(self.mesh)

    @property
    def torque(self) -> Scalar:
        """Torque on the pinion [N m]."""
        return self.gearbox.pinion_torques()[self.mesh]

    @property
    def status(self) -> Statuses:
        """Status of the gearbox."""
        return self.gearbox.status

    def influence(self, y: Slices) -> Float[Array, "slices slices"]:
        """Influence matrix of shafts, bearings and housing at face coordinates [um/N], shape (slices, slices).

        It includes bending, shear, torsion, bearings and housing of both shafts, and the other shafts by way of the
        housing. The twist of a shaft is measured from the end of the face towards which most of its torque leaves. The
        wind-up between face and coupling turns the gear as a whole and is not included.
        """
        return _influence(self, real(y))

    def gap(self, y: Slices) -> Slices:
        """Gap due to misalignment, external loads, and other meshes with even line loads [um], shape (slices,)."""
        return _gap(self, real(y))


def support(gearbox: Gearbox, mesh: int = 0) -> ShaftSupport:
    """Support of a mesh by the shafts of a gearbox.

    Args:
        gearbox: shafts, meshes, housing.
        mesh: index of the mesh, from 0.

    Raises:
        ValueError: for an index without a mesh.
    """
    return ShaftSupport(gearbox, mesh)


@program
def _influence(given: ShaftSupport, y: Slices) -> Float[Array, "slices slices"]:
    gearbox = given.gearbox
    bent = solve(system_under_load(gearbox, mesh_patterns(gearbox, given.mesh, y)), jnp.eye(len(y))).pattern
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
    total = solve(system_under_load(gearbox, patterns), load, actual=True).pattern[:-1, 0]
    where = acting(gearbox, mesh)
    for side, sign in enumerate((-1.0, 1.0)):
        at, torque = torques_on(gearbox, where.shafts[side], without=mesh)
        total = total + sign * where.base_radii[side] * (_twist_between(gearbox, mesh, side, y, at) @ torque)
    pair = given.pair
    return total + gearbox.meshes[mesh].misalignment.over_face(pair) * y / pair.face_width


def _twist_between(
    gearbox: Gearbox, mesh: int, side: int, y: Slices, at: Float[Array, " points"]
) -> Float[Array, "slices points"]:
    """Twist at face coordinates under unit torques at positions, from the end of the face [mrad per N mm]."""
    where = acting(gearbox, mesh)
    beam, middle = gearbox.shafts[where.shafts[side]].beam, where.positions[side]
    others, torque = torques_on(gearbox, where.shafts[side], without=mesh)
    beyond = [jnp.abs(jnp.sum(jnp.where(flag, torque, 0.0))) for flag in (others < middle, others > middle)]
    left, right = middle - where.half, middle + where.half
    here, there = (middle + y)[:, None], at[None, :]
    from_left = twist(beam, jnp.maximum(jnp.minimum(here, there), left)) - twist(beam, left)
    from_right = twist(beam, right) - twist(beam, jnp.minimum(jnp.maximum(here, there), right))
    return jnp.where(beyond[1] > beyond[0], from_right, from_left)


def even_coordinates(width: Given, slices: int) -> Slices:
    """Face coordinates of the middles of slices of equal width [mm], shape (slices,)."""
    return real(width) * ((np.arange(slices) + 0.5) / slices - 0.5)
