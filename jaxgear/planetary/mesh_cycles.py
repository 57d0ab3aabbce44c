"""Mesh cycles of all planets of a solved stage: line loads, pressures and root stresses of every tooth contact."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import Mesh, MeshCycle, OperatingPoint
from ..contact.solve import flanks_of, mesh_cycle
from ..contact.status import Statuses
from ..metrics import root_stress
from ..numerics import Given, changed, check, maximum, program, real
from .cycle import StageCycle
from .kinematics import mesh_force, relative_speeds
from .meshes import Flanks, LoadedMesh, PlacedMesh
from .solve import PreparedStage

Scalar = Float[Array, ""]
Planets = Float[Array, " planets"]
Curves = Float[Array, "planets positions"]


class PerMesh(NamedTuple):
    """One number for the mesh of every planet with sun and ring, shape (planets,) each."""

    sun: Planets
    ring: Planets


class PerFlank(NamedTuple):
    """One number for the flanks of every planet's meshes, shape (planets,) each.

    Attributes:
        sun, planet_to_sun: of the mesh with the sun.
        planet_to_ring, ring: of the mesh with the ring.
    """

    sun: Planets
    planet_to_sun: Planets
    planet_to_ring: Planets
    ring: Planets


class StageMeshes(eqx.Module):
    """Contacts of all 2N meshes of a stage; made by `mesh_cycles`.

    Both cycles have the planets as an axis in front, and so has what functions and quantities of `jaxgear.metrics` give
    for them: `jaxgear.quantities["max_flank_pressure"](meshes.sun)` has shape (planets,). Their pinions are the sun and
    the planet.

    The transmission error of such a cycle is the approach of the teeth of this mesh, without wind-up of the bodies, and
    its torque that of the mean force of this planet. The force varies over the positions. Position k is the mesh
    position `phase[planet, k]` of that planet's mesh.

    Attributes:
        sun: cycles of the meshes of sun and planets.
        ring: cycles of the meshes of planets and ring.
    """

    sun: MeshCycle
    ring: MeshCycle

    @property
    def flank_pressure(self) -> PerMesh:
        """Largest Hertzian pressure on the flanks over the cycle [MPa], on both flanks of a mesh alike."""
        return PerMesh(_peaks(self.sun).flank_pressure, _peaks(self.ring).flank_pressure)

    @property
    def corner_pressure(self) -> PerMesh:
        """Largest pressure of a tip corner over the cycle [MPa], see `MeshCycle.corner_pressure`."""
        return PerMesh(_peaks(self.sun).corner_pressure, _peaks(self.ring).corner_pressure)

    @property
    def root_stress(self) -> PerFlank:
        """Largest local root stress of the teeth over the cycle [MPa], see `metrics.root_stress`.

        A tooth of sun and ring bends one way. A tooth of a planet bends both ways in each of its turns: the root that
        the flank towards the sun pulls is pressed by the load on the flank towards the ring. Its permissible stress is
        that of reversed bending, about 0.7 of that of pulsating bending (ISO 6336-5).
        """
        return PerFlank(*_peaks(self.sun).root_stress, *_peaks(self.ring).root_stress)

    @property
    def mean_stiffness(self) -> PerMesh:
        """Mean tangent stiffness of the teeth of every planet's mesh [N/um], without wind-up of the bodies."""
        return PerMesh(*(jnp.mean(each.tangent_stiffness, axis=-1) for each in (self.sun, self.ring)))

    @property
    def max_flank_pressure(self) -> Scalar:
        """Largest Hertzian pressure on the flanks of all meshes [MPa]."""
        return maximum(jnp.stack(self.flank_pressure))

    @property
    def max_corner_pressure(self) -> Scalar:
        """Largest pressure of a tip corner in all meshes [MPa]."""
        return maximum(jnp.stack(self.corner_pressure))

    @property
    def status(self) -> Statuses:
        """Status of all contacts, shape (2, planets, positions)."""
        return jnp.stack([self.sun.status, self.ring.status])


class _Peaks(NamedTuple):
    """Largest values over the cycle, shape (planets,) each; root stress of pinion and wheel."""

    flank_pressure: Planets
    corner_pressure: Planets
    root_stress: tuple[Planets, Planets]


def _peaks(cycle: MeshCycle) -> _Peaks:
    return _peaks_of(changed(cycle, pinion=None, wheel=None))


@program
def _peaks_of(cycle: MeshCycle) -> _Peaks:
    root = root_stress(cycle)
    fields = cycle.contact_pressure, cycle.corner_pressure, root.pinion, root.wheel
    flank, corner, pinion, wheel = (maximum(field, (-3, -2, -1)) for field in fields)
    return _Peaks(flank, corner, (pinion, wheel))


def mesh_cycles(
    prepared: PreparedStage, cycle: StageCycle, *, speed: Given | None = None, friction: Given | None = None
) -> StageMeshes:
    """Contacts of all meshes of a solved stage, at the forces of its equilibrium.

    Every mesh is solved once more, at the approaches that the equilibrium has found.

    Args:
        prepared: the prepared stage of the cycle.
        cycle: the solved stage.
        speed: speed of the driving member [rpm], for losses and lubrication; the cycles have that of their pinions
            relative to the carrier.
        friction: mean coefficient of friction of all meshes; None for that of a lubricant.

    Returns:
        the cycles, differentiable as the cycle of the stage is.

    Raises:
        ValueError: for a stage whose meshes are tables, or a cycle with batch axes or of another stage.
        TypeError: for something else than a prepared stage and its cycle.
    """
    if not isinstance(prepared, PreparedStage) or not isinstance(cycle, StageCycle):
        raise TypeError(
            f"prepared and cycle are a {type(prepared).__name__} and a {type(cycle).__name__}, must be a PreparedStage "
            "and its StageCycle: prepare_stage and solve_stage make them"
        )
    shape, wanted = cycle.sun_force.shape, (prepared.stage.planets, prepared.sun.positions)
    if shape != wanted:
        raise ValueError(
            f"cycle has forces of shape {shape}, must have {wanted} (planets, positions) of the prepared stage; for "
            "many cycles use jax.vmap"
        )
    placed: list[PlacedMesh] = []
    for name, mesh in (("sun", prepared.sun), ("ring", prepared.ring)):
        if not isinstance(mesh, PlacedMesh):
            raise ValueError(f"{name} is a table, which holds no contacts: must be a prepared mesh")
        placed.append(mesh)
    speeds: tuple[Given | None, Given | None] = None, None
    if speed is not None:
        check("speed", speed, "rpm", low=0.0)
        relative = relative_speeds(cycle.stage, speed)
        speeds = relative.sun, relative.planet
    force = mesh_force(cycle.stage, cycle.torque) / cycle.stage.planets
    curves = (cycle.sun_approach, cycle.sun_force), (cycle.ring_approach, cycle.ring_force)
    flanks = cycle.flanks.at_sun, cycle.flanks.at_ring
    given = zip(placed, curves, flanks, cycle.stage.gap_slopes(force), speeds)
    sun, ring = (
        _cycles(_loaded(mesh, force, modified, slope), mesh.mesh, *of_planets, modified, turning, friction)
        for mesh, of_planets, modified, slope, turning in given
    )
    return StageMeshes(sun, ring)


def _cycles(
    loaded: LoadedMesh,
    mesh: Mesh,
    approach: Curves,
    forces: Curves,
    flanks: Flanks,
    speed: Given | None,
    friction: Given | None,
) -> MeshCycle:
    """Cycles of one mesh of all planets."""
    dtype = mesh.slice_width.dtype
    pinion, wheel = flanks_of(mesh, *flanks)
    running = [None if each is None else real(each).astype(dtype) for each in (speed, friction)]

    def of_planet(mesh: Mesh, force: Scalar, contact: dict[str, Array]) -> MeshCycle:
        point = OperatingPoint(1e-3 * force * mesh.pair.pinion.base_radius, *running)
        return mesh_cycle(mesh, point, contact, pinion, wheel)

    contacts = _contacts(loaded, approach.astype(dtype))
    return eqx.filter_vmap(of_planet)(mesh, jnp.mean(forces, axis=-1).astype(dtype), contacts)


# two programs: that of the contacts, by far the longer one to compile, serves every kind of modification
@program
def _loaded(placed: PlacedMesh, force: Scalar, flanks: Flanks, slope: Planets | None) -> LoadedMesh:
    return placed.loaded(force, flanks, slope)


@program
def _contacts(loaded: LoadedMesh, approach: Curves) -> dict[str, Array]:
    return loaded.cycles(approach)
