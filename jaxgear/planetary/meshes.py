"""Meshes of a planetary stage: force and tangent stiffness over approach and mesh position.

A stage needs one mesh of sun and planet and one of planet and ring: those of all planets differ by their phases. Face
coordinates are those of the pair of sun and planet. Seen from the same end of the face the planet turns the other way
than the sun, so that the mesh of a helical planet and ring is its mirror image, in which a planet of the sun's hand
drives: contact runs over the face of both meshes in the same direction. The wind-up of the gear bodies is left out of
the contact. The bore of a planet passes no torque, so that there is none; sun and ring wind up under all planets
together.
"""

from abc import abstractmethod
from typing import Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Shaped

from ..compliance.tooth import tooth_load
from ..contact import Mesh
from ..contact.mesh import prepare_from
from ..contact.prescribed import PrescribedContact, cycle_at_material, solve_at_material
from ..contact.slide import RemovedMaterial, for_contact
from ..contact.solve import check_alike, flanks_of, material_of
from ..contact.status import Status, Statuses, status_of
from ..geometry import explicit, pair_geometry
from ..geometry.gear import transverse_gear
from ..microgeometry import AbstractModification
from ..numerics import Checked, Given, changed, concrete, number
from ..numerics.spline import interpolate

Scalar = Float[Array, ""]
Curves = Float[Array, "planets positions"]
Planets = Float[Array, " planets"]
Flanks = tuple[AbstractModification | None, AbstractModification | None]  # of pinion and wheel of one mesh


class StageFlanks(NamedTuple):
    """Modifications of the flanks that carry; None for nominal involutes.

    Attributes:
        sun, planet_to_sun: of the mesh with the sun.
        planet_to_ring, ring: of the mesh with the ring.
    """

    sun: AbstractModification | None = None
    planet_to_sun: AbstractModification | None = None
    planet_to_ring: AbstractModification | None = None
    ring: AbstractModification | None = None

    @property
    def at_sun(self) -> Flanks:
        """Flanks of the mesh with the sun."""
        return self.sun, self.planet_to_sun

    @property
    def at_ring(self) -> Flanks:
        """Flanks of the mesh with the ring."""
        return self.planet_to_ring, self.ring


class MeshForces(NamedTuple):
    """Forces of the meshes of all planets, shape (planets, positions) each.

    Attributes:
        force: on the line of action [N].
        stiffness: d force / d approach [N/um].
        status: of the contact.
    """

    force: Curves
    stiffness: Curves
    status: Statuses


class AbstractLoadedMesh(eqx.Module):
    """Equal meshes of all planets, each at its phase, with everything known but the approaches."""

    @abstractmethod
    def forces(self, approach: Curves) -> MeshForces:
        """Forces at prescribed approaches of the teeth [um], shape (planets, positions); zero where they are apart."""


class AbstractPlacedMesh(eqx.Module):
    """Equal meshes of all planets, each at its phase.

    Attributes:
        width: common face width [mm].
        windup: wind-up of the body of sun or ring under the force of all planets together [um/N].
    """

    width: eqx.AbstractVar[Scalar]
    windup: eqx.AbstractVar[Scalar]

    @property
    @abstractmethod
    def positions(self) -> int:
        """Number of mesh positions over one base pitch."""

    @abstractmethod
    def loaded(self, force: Scalar, flanks: Flanks, slope: Planets | None = None) -> AbstractLoadedMesh:
        """The meshes with flank modifications.

        Args:
            force: mean force of a planet [N], at which the width of the contact is taken over which modifications are
                averaged.
            flanks: modifications of pinion and wheel; None for nominal involutes.
            slope: slope of the gap over the face [um/mm], shape (planets,); None for none.

        Raises:
            ValueError, TypeError: for modifications or slopes that such a mesh cannot have.
        """


class AbstractStageMesh(eqx.Module):
    """One mesh of a planetary stage at equally spaced mesh positions."""

    @abstractmethod
    def placed(self, phases: Planets, central: Literal[0, 1]) -> AbstractPlacedMesh:
        """The mesh of every planet.

        Args:
            phases: mesh positions of the planets at the stage's phase zero [base pitches], shape (planets,).
            central: number of the gear that is no planet: 0, the pinion, in the mesh with the sun, and 1, the wheel, in
                that with the ring.
        """


def _steps(phases: Planets, first: float, positions: int) -> tuple[Int[Array, " planets"], Planets]:
    """Whole steps of the positions from the first one to a phase, and what is left of a step, in [0, 1)."""
    steps = (phases - first) * positions
    below = jnp.floor(steps)
    return below.astype(int), steps - below


def _rolled(
    curves: Shaped[Array, "planets positions"], steps: Int[Array, " planets"]
) -> Shaped[Array, "planets positions"]:
    """Every curve from the position on that is this many steps behind its first one."""
    positions = curves.shape[-1]
    return jnp.take_along_axis(curves, (jnp.arange(positions)[None] + steps[:, None]) % positions, axis=-1)


class TableMesh(AbstractStageMesh, Checked):
    """A mesh given as a table, of another program for instance.

    Between the loads the force is a shape-preserving cubic of the approach, beyond the last one it is linear, and below
    the first one zero; between the positions approaches at equal load are linear.

    Attributes:
        approach: approach of the teeth without wind-up of the bodies [um], shape (positions, loads), at mesh positions
            k / positions; the first column is that of first contact.
        load: line loads [N/mm], shape (loads,), rising from zero.
        width: common face width [mm].
    """

    approach: Float[Array, "positions loads"] = number("um", shape=("positions", "loads"), fewest=3)
    load: Float[Array, " loads"] = number("N/mm", shape=("loads",), fewest=3, low=0.0)
    width: Scalar = number("mm", low=0.0, open_low=True)

    def check_together(self) -> None:
        if self.approach.shape[1] != self.load.shape[0]:
            raise ValueError(
                f"TableMesh: approach has {self.approach.shape[1]} columns, must have one for each of the "
                f"{self.load.shape[0]} loads"
            )

    def placed(self, phases: Planets, central: Literal[0, 1]) -> AbstractPlacedMesh:
        """The table of every planet from its own phase on."""
        steps, left = _steps(phases, 0.0, self.approach.shape[0])
        columns = self.approach.T.astype(phases.dtype)

        def of_planet(step: Array, left: Array) -> Array:
            return (1 - left) * jnp.roll(columns, -step, axis=1) + left * jnp.roll(columns, -step - 1, axis=1)

        # one point more, so far beyond the last one that the curve between them is its tangent there
        approach = jax.vmap(of_planet)(steps, left)
        load = self.load.astype(phases.dtype) * self.width.astype(phases.dtype)
        far = approach[:, -1:] + _FAR * (approach[:, -1:] - approach[:, -2:-1])
        last = load[-1:] + _FAR * (load[-1:] - load[-2:-1])
        knots = jnp.concatenate([approach, far], axis=1), jnp.concatenate([load, last])
        return PlacedTable(self.width, jnp.zeros_like(self.width), *knots)


_FAR = 100.0  # last intervals of a table beyond it


class PlacedTable(AbstractPlacedMesh, AbstractLoadedMesh):
    """Curves of the force over the approach of all planets; the wind-up of a table is not known, and zero.

    Attributes:
        knots: approaches of the points [um], shape (planets, loads, positions).
        force: forces there [N], shape (loads,).
    """

    width: Scalar
    windup: Scalar
    knots: Float[Array, "planets loads positions"]
    force: Float[Array, " loads"]

    @property
    def positions(self) -> int:
        """Number of mesh positions over one base pitch."""
        return self.knots.shape[-1]

    def loaded(self, force: Scalar, flanks: Flanks, slope: Planets | None = None) -> AbstractLoadedMesh:
        """The table itself.

        Raises:
            ValueError: for modifications and slopes: those of a table are in its numbers.
        """
        if any(each is not None for each in flanks):
            raise ValueError("a table holds the modifications of its flanks: none can be given for it")
        if slope is not None:
            raise ValueError("a table holds the load over the face: pins cannot tilt")
        return self

    def forces(self, approach: Curves) -> MeshForces:
        """Forces by interpolation; out of validity beyond the last load."""

        def force(approach: Array, knots: Array) -> Array:
            return interpolate(approach, knots, self.force, "monotonic")

        def with_slope(approach: Array, knots: Array) -> tuple[Array, Array]:
            return jax.jvp(lambda at: force(at, knots), (approach,), (jnp.ones_like(approach),))

        of_positions = jax.vmap(with_slope, in_axes=(0, 1))
        found, slope = jax.vmap(of_positions)(approach, self.knots)
        return MeshForces(found, slope, status_of({Status.OUT_OF_VALIDITY: approach > self.knots[:, -2]}))


class PreparedMesh(AbstractStageMesh):
    """A prepared mesh of the library.

    Attributes:
        mesh: prepared mesh, of the pair sun-planet or of the pair planet-ring.
    """

    mesh: Mesh

    def __check_init__(self) -> None:
        check_alike(self.mesh)

    def placed(self, phases: Planets, central: Literal[0, 1]) -> AbstractPlacedMesh:
        """The mesh of every planet, prepared at positions that fall on those of the stage."""
        mesh, sizes = self.mesh, self.mesh.resolution
        pair = mesh.pair.coast if central == 1 else mesh.pair
        steps, left = _steps(phases, sizes.first_phase, sizes.positions)

        def of_planet(left: Given) -> Mesh:
            first = sizes.first_phase + left / sizes.positions
            return prepare_from(first, pair, mesh.compliance, sizes, mesh.support, mesh.even)

        known = concrete(left)
        if known is None or any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(mesh)):
            planets = eqx.filter_vmap(of_planet)(left)
        else:  # by the programs that have prepared the mesh
            arrays, rest = zip(*(eqx.partition(of_planet(one), eqx.is_array) for one in known))
            planets = eqx.combine(jax.tree.map(lambda *leaves: jnp.stack(leaves), *arrays), rest[0])
        return PlacedMesh(mesh.pair.face_width, _windup(mesh, central), planets, steps)


def _windup(mesh: Mesh, gear: Literal[0, 1]) -> Scalar:
    """Wind-up of the body of one gear [um/N], without the deflection of helical gears along the axis."""
    pair = explicit(mesh.pair)
    if pair.pinion.helix_angle is not None:
        pair = changed(pair, pinion=transverse_gear(pair.pinion), wheel=transverse_gear(pair.wheel))
    outlines = pair_geometry(pair).outlines
    rolls = [side.contact_roll_length for side in mesh.sides]
    pinion, wheel = (tooth_load(outline, roll.reshape(len(roll), -1)) for outline, roll in zip(outlines, rolls))
    return mesh.compliance.hub(pinion, wheel)[gear] / mesh.pair.gears[gear].face_width


class PlacedMesh(AbstractPlacedMesh):
    """Prepared meshes of all planets.

    Attributes:
        mesh: meshes with the planets as an axis in front.
        steps: steps of the positions from the first of the mesh to the stage's phase zero, shape (planets,).
    """

    width: Scalar
    windup: Scalar
    mesh: Mesh
    steps: Int[Array, " planets"]

    @property
    def positions(self) -> int:
        """Number of mesh positions over one base pitch."""
        return self.mesh.resolution.positions

    def loaded(self, force: Scalar, flanks: Flanks, slope: Planets | None = None) -> "LoadedMesh":
        """The meshes with the material that modifications remove, and with the gap by a slope."""
        if slope is not None and self.mesh.resolution.slices == 1:
            raise ValueError("pins tilt over the face, which a mesh of 1 slice cannot show: Resolution(slices=11)")
        torque = 1e-3 * force * self.mesh.pair.pinion.base_radius[0]
        given, dtype = flanks_of(self.mesh, *flanks), self.mesh.slice_width.dtype

        def of_planet(mesh: Mesh, slope: Scalar | None) -> RemovedMaterial:
            removed = material_of(mesh, torque.astype(dtype), *given)
            return removed if slope is None else removed + slope.astype(dtype) * mesh.face_coordinate[None, :, None]

        removed = eqx.filter_vmap(of_planet)(self.mesh, slope)
        return LoadedMesh(for_contact(self.mesh), removed, self.steps)


class LoadedMesh(AbstractLoadedMesh):
    """Prepared meshes of all planets with the material removed from their flanks.

    Attributes:
        mesh, steps: as of `PlacedMesh`.
        removed: material removed, with the planets as an axis in front.
    """

    mesh: Mesh
    removed: RemovedMaterial
    steps: Int[Array, " planets"]

    def contact(self, approach: Curves) -> PrescribedContact:
        """Contact of every planet at its own positions, which begin with the first one of the mesh.

        Args:
            approach: at the positions of the stage [um], shape (planets, positions).
        """
        return eqx.filter_vmap(solve_at_material)(self.mesh, _rolled(approach, -self.steps), self.removed)

    def cycles(self, approach: Curves) -> dict[str, Array]:
        """Fields of a mesh cycle of every planet, with the planets as an axis in front; arguments as of `contact`."""
        return eqx.filter_vmap(cycle_at_material)(self.mesh, _rolled(approach, -self.steps), self.removed)

    def forces(self, approach: Curves) -> MeshForces:
        """Forces at the positions of the stage."""
        found = self.contact(approach)
        curves = found.force, found.tangent_stiffness, found.status
        force, stiffness, status = (_rolled(each, self.steps) for each in curves)
        return MeshForces(force, stiffness, status)
