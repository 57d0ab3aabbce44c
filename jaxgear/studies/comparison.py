"""Designs that a study compares: unmodified, rule-based, and the design of the file or the optimum of its variables."""

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
from .study import Stages

Modifications = tuple[AbstractModification, AbstractModification]

_POSITIONS, _PAIRS = "positions of the mesh", "pairs of the mesh"  # no names of variables, which have no spaces


def search_of(design: DesignFile, *, quick: bool) -> Search | None:
    """Search for the optimum of the file; None if the file has no variables and no method that works without them."""
    if design.bounds or optimize_of(design).method in METHODS_WITHOUT_VARIABLES:
        return Search.of(design, quick=quick)
    return None


def first_mesh(design: DesignFile, torque: float, *, quick: bool) -> Mesh:
    """Mesh at the start of a search, with pairs of teeth for loads up to a torque [N m]."""
    size = design.resolution(torque)
    return jax.block_until_ready(design.mesh(coarse(size) if quick else size))


def rule_based(design: DesignFile) -> AbstractModification:
    """Tip relief of ISO 6336-1, the same for both gears."""
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
    """Mesh for a comparison of designs, and the designs (pinion, wheel) by name.

    Args:
        design: design file.
        torque: largest torque of the comparison [N m].
        search: search for the optimum; None for the modification of the file.
        checkpoints: checkpoints of the search; None to store nothing.
        stages: progress of the study; None for no messages.
        quick: True for coarse positions.
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
    """Final mesh and modifications (pinion, wheel) of a search, computed or loaded from a checkpoint.

    Args:
        design: design file.
        name: name of the design that the search finds, unique among the searches of a file.
        search: the search.
        mesh: mesh at its start.
        checkpoints, stages, quick: as for `compared`.
    """

    def found() -> Optimum:
        optimum = search(mesh, stages.step)
        return optimum.compromise if isinstance(optimum, Front) else optimum

    if search.method in METHODS_WITHOUT_VARIABLES:  # free-form flanks have no parameters to store
        optimum = found()
        return optimum.mesh, (optimum.pinion, optimum.wheel)
    lowest = design.design({name: low for name, (low, _) in design.bounds.items()})  # with contents of data files
    asked = name, quick, design.text, design.tables.get("lubricant"), design.tables.get("strength")
    kept = checkpoints.of(NamedArrays())((mesh, lowest, asked), lambda: _numbers(found()))
    numbers = {name: float(value) for name, value in kept.items()}
    sizes = dataclasses.replace(mesh.resolution, positions=int(numbers[_POSITIONS]), pairs=int(numbers[_PAIRS]))
    flanks = design.design({name: numbers[name] for name in design.bounds})
    if sizes == mesh.resolution:
        return mesh, flanks
    return prepare(mesh.pair, compliance=mesh.compliance, resolution=sizes, support=mesh.support), flanks


def _numbers(optimum: Optimum) -> dict[str, float]:
    """Numbers from which design and mesh of an optimum can be restored."""
    sizes = optimum.mesh.resolution
    return {**optimum.parameters, _POSITIONS: sizes.positions, _PAIRS: sizes.chosen_pairs}
