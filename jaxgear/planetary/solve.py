"""Loaded contact of a planetary stage over one base pitch."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import Mesh
from ..microgeometry import AbstractModification
from ..numerics import Given, check, program, real
from .cycle import StageCycle
from .equilibrium import equilibrium
from .kinematics import mesh_force, planet_phases
from .meshes import AbstractPlacedMesh, AbstractStageMesh, PreparedMesh, StageFlanks
from .springs import linkage
from .stage import PlanetaryStage

# Line stiffness of steel gears [N/(mm um)], from which the search for the equilibrium begins (ISO 6336-1 has about 20)
_USUAL_STIFFNESS = 15.0


class PreparedStage(eqx.Module):
    """A stage prepared for `solve_stage`; made by `prepare_stage`.

    `dataclasses.replace(prepared, stage=...)` takes another stage with the same gears and places of planets: other
    errors, stiffnesses and supports.

    Attributes:
        stage: the stage.
        sun, ring: meshes of all planets with sun and ring.
    """

    stage: PlanetaryStage
    sun: AbstractPlacedMesh
    ring: AbstractPlacedMesh


def prepare_stage(
    stage: PlanetaryStage, *, sun: Mesh | AbstractStageMesh, ring: Mesh | AbstractStageMesh
) -> PreparedStage:
    """Prepare the meshes of all planets of a stage, each at its phase.

    What is prepared depends on the gears and the places of the planets alone: one prepared stage serves any torques,
    errors, stiffnesses and modifications.

    Args:
        stage: the stage.
        sun: mesh of sun and planet: a prepared mesh of that pair, or a `TableMesh`.
        ring: mesh of planet and ring, with as many positions.

    Raises:
        ValueError: for meshes of different numbers of positions.
        TypeError: for something else than meshes.
    """
    meshes = []
    for place, (name, mesh, phases) in enumerate(zip(("sun", "ring"), (sun, ring), planet_phases(stage))):
        if not isinstance(mesh, Mesh | AbstractStageMesh):
            raise TypeError(f"{name} is a {type(mesh).__name__}, must be a prepared mesh or a TableMesh")
        mesh = PreparedMesh(mesh) if isinstance(mesh, Mesh) else mesh
        meshes.append(mesh.placed(phases, 0 if place == 0 else 1))
    if meshes[0].positions != meshes[1].positions:
        raise ValueError(
            f"ring has {meshes[1].positions} positions, must have {meshes[0].positions}, as many as sun has"
        )
    return PreparedStage(stage, *meshes)


def solve_stage(
    prepared: PreparedStage,
    torque: Given,
    *,
    sun: AbstractModification | None = None,
    planet_to_sun: AbstractModification | None = None,
    planet_to_ring: AbstractModification | None = None,
    ring: AbstractModification | None = None,
) -> StageCycle:
    """Loaded tooth contact of all meshes of a planetary stage, in equilibrium with its supports.

    The phase of the stage is the mesh position of the sun and a planet at the angle zero. Ring and carrier are held
    against rotation, and the rotation of the sun is the transmission error. The forces act along the lines of action of
    the unloaded gears, without friction. The flanks are those that carry: each side of a planet has its own.

    Args:
        prepared: the prepared stage.
        torque: size of the torque on the driving member [N m], shape ().
        sun, planet_to_sun: modifications of the flanks of the mesh with the sun; None for the nominal involutes.
        planet_to_ring, ring: modifications of those of the mesh with the ring.

    Returns:
        the cycle, differentiable with respect to every number of stage, torque and modifications.

    Raises:
        ValueError: for a torque that is not greater than zero, and modifications of a table.
        TypeError: for something else than a prepared stage or a modification.
    """
    if not isinstance(prepared, PreparedStage):
        raise TypeError(f"prepared is a {type(prepared).__name__}, must be a PreparedStage: prepare_stage makes one")
    given = real(torque, "torque")
    if given.shape:
        raise ValueError(f"torque has shape {given.shape}, must be a single number; make many with jax.vmap")
    check("torque", given, "N m", low=0.0, open_low=True)
    given = given.astype(prepared.stage.gears.module.dtype)
    return _solved(prepared, given, StageFlanks(sun, planet_to_sun, planet_to_ring, ring))


@program
def _solved(prepared: PreparedStage, torque: Float[Array, ""], flanks: StageFlanks) -> StageCycle:
    stage, placed = prepared.stage, (prepared.sun, prepared.ring)
    force = mesh_force(stage, torque)
    springs = linkage(stage, force)
    mean = force / stage.planets
    given = zip(placed, (flanks.at_sun, flanks.at_ring), stage.gap_slopes(mean))
    sun, ring = (mesh.loaded(mean, modified, slope) for mesh, modified, slope in given)
    widths = jnp.stack([mesh.width.astype(force.dtype) for mesh in placed])
    usual = jnp.concatenate([_USUAL_STIFFNESS * widths, springs.pin])
    guess = jnp.broadcast_to(usual[:, None, None], (len(usual), stage.planets, prepared.sun.positions))
    found = equilibrium(springs, (sun, ring), guess)
    windup = (prepared.sun.windup + prepared.ring.windup).astype(force.dtype) * force
    approach = springs.stretch(found.motion) - springs.offset[:, :, None]
    return StageCycle.of(stage, torque, found, windup, approach[:2], flanks)
