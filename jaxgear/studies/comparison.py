"""The designs that a study compares: unmodified, rule-based, that of the file or the optimum of its variables."""

import dataclasses

import jax
import numpy as np

from ..contact import Mesh, prepare
from ..geometry import GearPair, PathOfContact, explicit, pair_geometry
from ..io import DesignFile, Search
from ..io.optimize_table import METHODS_WITHOUT_VARIABLES, optimize_of
from ..microgeometry import AbstractModification, NoModification
from ..numerics import program
from ..optimize import Front, Optimum
from ..sizing import iso_relief
from .checkpoints import Checkpoints, NamedArrays
from .evaluation import coarse
from .progress import Stages

Modifications = tuple[AbstractModification, AbstractModification]

_POSITIONS, _PAIRS = "positions of the mesh", "pairs of the mesh"  # no names of variables, which have no spaces


def search_of(design: DesignFile, *, quick: bool) -> Search | None:
    """The search that the file asks for; None where its modifications are numbers and it names no method."""
    if design.bounds or optimize_of(design).method in METHODS_WITHOUT_VARIABLES:
        return Search.of(design, quick=quick)
    return None


def first_mesh(design: DesignFile, torque: float, *, quick: bool) -> Mesh:
    """The mesh on which a search begins, up to a torque [N m]."""
    size = design.resolution(torque)
    return jax.block_until_ready(design.mesh(coarse(size) if quick else size))


def rule_based(design: DesignFile) -> AbstractModification:
    """The relief of ISO 6336-1 for both tips."""
    pair, factor = design.pair(), optimize_of(design).application_factor
    path = pair_geometry(explicit(pair)).path_of_contact
    return _iso_relief(pair, path, np.asarray(design.torque), np.asarray(factor))


@program
def _iso_relief(pair: GearPair, path: PathOfContact, torque, application_factor):
    return iso_relief(pair, torque, application_factor=application_factor, path=path)


def compared(
    design: DesignFile,
    torque: float,
    search: Search | None = None,
    checkpoints: Checkpoints | None = None,
    stages: Stages | None = None,
    *,
    quick: bool = False,
) -> tuple[Mesh, dict[str, Modifications]]:
    """The designs by their names, and the mesh on which they are compared, up to a torque [N m].

    Args:
        design: the design file.
        torque: largest of interest [N m].
        search: for the optimum; None for none.
        checkpoints: where what a search has found is kept; None keeps nothing.
        stages: told what goes on; None for silence.
        quick: on coarse positions.
    """
    stages = Stages() if stages is None else stages
    stages.begin("preparing the mesh")
    mesh = first_mesh(design, torque, quick=quick)
    involute = NoModification()
    relief = rule_based(design)
    designs: dict[str, Modifications] = {"unmodified": (involute, involute), "rule-based": (relief, relief)}
    if not design.bounds:
        given = design.design({})
        if any(not isinstance(flank, NoModification) for flank in given):
            designs["modified"] = given
    if search is not None:
        stages.begin(f"searching the optimum ({search.method})")
        checkpoints = Checkpoints() if checkpoints is None else checkpoints
        mesh, designs["optimum"] = sought(design, "optimum", search, mesh, checkpoints, stages, quick=quick)
    return mesh, designs


def sought(
    design: DesignFile,
    name: str,
    search: Search,
    mesh: Mesh,
    checkpoints: Checkpoints,
    stages: Stages,
    *,
    quick: bool,
) -> tuple[Mesh, Modifications]:
    """The mesh on which a search has ended, and what it has found, now or before the command was interrupted.

    Args:
        design: the design file.
        name: of what the search gives; one search of a file has it.
        search: to be run.
        mesh: on which it begins.
        checkpoints, stages, quick: as for `compared`.
    """

    def found() -> Optimum:
        optimum = search(mesh, stages.step)
        return optimum.compromise if isinstance(optimum, Front) else optimum

    if search.method in METHODS_WITHOUT_VARIABLES:  # there are no few numbers to keep
        optimum = found()
        return optimum.mesh, (optimum.pinion, optimum.wheel)
    lowest = design.design({name: low for name, (low, _) in design.bounds.items()})  # with what files hold
    asked = name, quick, design.says, design.tables.get("lubricant"), design.tables.get("strength")
    kept = checkpoints.of(NamedArrays())((mesh, lowest, asked), lambda: _numbers(found()))
    numbers = {name: float(value) for name, value in kept.items()}
    sizes = dataclasses.replace(mesh.resolution, positions=int(numbers[_POSITIONS]), pairs=int(numbers[_PAIRS]))
    flanks = design.design({name: numbers[name] for name in design.bounds})
    if sizes == mesh.resolution:
        return mesh, flanks
    return prepare(mesh.pair, compliance=mesh.compliance, resolution=sizes, support=mesh.support), flanks


def _numbers(optimum: Optimum) -> dict[str, float]:
    """Numbers that give design and mesh of an optimum again."""
    sizes = optimum.mesh.resolution
    return {**optimum.parameters, _POSITIONS: sizes.positions, _PAIRS: sizes.chosen_pairs}
