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
from .loads import acting, load_pattern, mesh_patterns, side_by_side, solve, torques_on
from .misalignment import Misalignment
from .operating_point import system_under_load
from .stepped_beam import ROUNDING, check_symmetric, semidefinite, symmetric, twist

Slices = Float[Array, " slices"]
Scalar = Float[Array, ""]


def _status(gears: GearPair, possible: Bool[Array, ""]) -> Statuses:
    return status_of({Status.SUPPORT_NOT_POSSIBLE: ~possible, Status.GEARS_CANNOT_RUN: ~margins(gears).valid})


class RigidSupport(AbstractSupport):
    """Rigid axes, which need not be parallel.

    Attributes:
        gears: the pair.
        misalignment: of their axes.
    """

    gears: GearPair
    misalignment: Misalignment = eqx.field(default_factory=Misalignment)

    @property
    def pair(self) -> GearPair:
        """`gears`."""
        return self.gears

    @property
    def status(self) -> Statuses:
        """Whether all numbers are in their ranges and the gears can run."""
        return _status(self.gears, within_limits(self))

    def influence(self, y: Slices) -> Float[Array, "slices slices"]:
        """Zero."""
        return jnp.zeros((len(y), len(y)))

    def gap(self, y: Slices) -> Slices:
        """Gap due to the misalignment [um]."""
        return self.misalignment.over_face(self.pair) * real(y) / self.pair.face_width


class TabulatedSupport(AbstractSupport):
    """Support given as a table by another program or a measurement; the same at every torque.

    Attributes:
        gears: the pair.
        matrix: influence, gap that opens in a slice under a unit force between the flanks of another, over slices of
            equal width. A mesh takes of it what its `face_modes` polynomials over the face can follow.
        opening: gap by everything else than the force of this mesh, in every slice; None for none.

    Raises:
        ValueError: for a matrix that is not square and symmetric, and other numbers of slices.
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
        """`gears`."""
        return self.gears

    @property
    def needs_even_slices(self) -> bool:
        return True

    @property
    def tabulated(self) -> Float[Array, "slices slices"]:
        """`matrix`."""
        return self.matrix

    @property
    def status(self) -> Statuses:
        """Whether all numbers are in their ranges, the gears can run, and no eigenvalue of the matrix is negative."""
        return _status(self.gears, within_limits(self) & semidefinite(symmetric(self.matrix)))

    def influence(self, y: Slices) -> Float[Array, "slices slices"]:
        """`matrix`, its symmetric part.

        Raises:
            ValueError: for another number of slices.
        """
        if len(y) != len(self.matrix):
            raise ValueError(
                f"TabulatedSupport: matrix has {len(self.matrix)} slices, the mesh has {len(y)}: "
                f"Resolution(slices={len(self.matrix)})"
            )
        return symmetric(self.matrix)

    def gap(self, y: Slices) -> Slices:
        """`opening`."""
        return jnp.zeros(len(y)) if self.opening is None else self.opening


class ShaftSupport(AbstractSupport):
    """The shafts of a gearbox at one of its meshes; made by `support`.

    Attributes:
        gearbox: with the torques of its couplings.
        mesh: number of the mesh, from 0.

    Raises:
        ValueError: for a number that no mesh has.
    """

    gearbox: Gearbox
    mesh: int = eqx.field(static=True)

    def check_together(self) -> None:
        if not self.gearbox.meshes:
            raise ValueError("ShaftSupport: gearbox has no mesh")
        whole("ShaftSupport: mesh", self.mesh, 0, len(self.gearbox.meshes) - 1)

    @property
    def pair(self) -> GearPair:
        """The gears of the mesh."""
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
        """Bending, shear, torsion, bearings and housing of both shafts, and of all others through the housing.

        The torque of a unit force leaves each shaft at the end of the face behind which most of it leaves: rotations
        count from there. What the shaft winds up between its face and a coupling turns the whole gear and is not in it.
        """
        return _influence(self, real(y))

    def gap(self, y: Slices) -> Slices:
        """Gap due to misalignment, external loads and other meshes with forces even over their faces [um]."""
        return _gap(self, real(y))


def support(gearbox: Gearbox, mesh: int = 0) -> ShaftSupport:
    """Support of a mesh by the shafts of a gearbox.

    Args:
        gearbox: shafts, meshes, housing.
        mesh: number of the mesh, from 0.

    Raises:
        ValueError: for a number that no mesh has.
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
    held, middle = gearbox.shafts[where.shafts[side]].beam, where.positions[side]
    others, torque = torques_on(gearbox, where.shafts[side], without=mesh)
    beyond = [jnp.abs(jnp.sum(jnp.where(flag, torque, 0.0))) for flag in (others < middle, others > middle)]
    left, right = middle - where.half, middle + where.half
    here, there = (middle + y)[:, None], at[None, :]
    from_left = twist(held, jnp.maximum(jnp.minimum(here, there), left)) - twist(held, left)
    from_right = twist(held, right) - twist(held, jnp.minimum(jnp.maximum(here, there), right))
    return jnp.where(beyond[1] > beyond[0], from_right, from_left)


def even_coordinates(width: Given, slices: int) -> Slices:
    """Middles of slices of equal width over a face [mm]."""
    return real(width) * ((np.arange(slices) + 0.5) / slices - 0.5)
