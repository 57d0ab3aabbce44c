"""The designs that a study compares: unmodified, rule-based, that of the file or the optimum of its variables."""

import dataclasses
from pathlib import Path
from typing import Any

import jax

from ..contact import Mesh, prepare
from ..io import DesignFile, OptimizeRequest, optimize_request
from ..io.optimize import METHODS_WITHOUT_VARIABLES, optimize_of
from ..microgeometry import AbstractModification, NoModification
from ..optimize import Front, Optimum
from .commands import rule_based
from .progress import Stages
from .run import coarse
from .study import Kept, runs_beside

Modifications = tuple[AbstractModification, AbstractModification]

_POSITIONS, _PAIRS = "positions of the mesh", "pairs of the mesh"  # no names of variables, which have no spaces


def search_of(design: DesignFile, *, quick: bool) -> OptimizeRequest | None:
    """The search that the file asks for; None where its modifications are numbers and it names no method."""
    if design.bounds or optimize_of(design).method in METHODS_WITHOUT_VARIABLES:
        return optimize_request(design, quick=quick)
    return None


def first_mesh(design: DesignFile, torque: float, *, quick: bool) -> Mesh:
    """The mesh on which a search begins, up to a torque [N m]."""
    size = design.resolution(torque)
    return jax.block_until_ready(design.mesh(coarse(size) if quick else size))


def compared(
    design: DesignFile, torque: float, search: OptimizeRequest | None, target: Path, stages: Stages, *, quick: bool
) -> tuple[Mesh, dict[str, Modifications]]:
    """The designs by their names, and the mesh on which they are compared, up to a torque [N m].

    Args:
        design: the design file.
        torque: largest of interest [N m].
        search: for the optimum; None for none.
        target: result folder, beside which what a search has found is kept until the results are there.
        stages: told what goes on.
        quick: on coarse positions.
    """
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
        mesh, designs["optimum"] = sought(design, "optimum", search, mesh, target, stages, quick=quick)
    return mesh, designs


def sought(
    design: DesignFile, name: str, search: OptimizeRequest, mesh: Mesh, target: Path, stages: Stages, *, quick: bool
) -> tuple[Mesh, Modifications]:
    """The mesh on which a search has ended, and what it has found, now or before the command was interrupted.

    Args:
        design: the design file.
        name: of what the search gives; one search of a file has it.
        search: to be run.
        mesh: on which it begins.
        target, stages, quick: as for `compared`.
    """

    def found() -> Optimum:
        optimum = search(mesh, stages.step)
        return optimum.compromise if isinstance(optimum, Front) else optimum

    if search.method in METHODS_WITHOUT_VARIABLES:  # there are no few numbers to keep
        optimum = found()
        return optimum.mesh, (optimum.pinion, optimum.wheel)
    lowest = design.design({name: low for name, (low, _) in design.bounds.items()})  # with what files hold
    asked = name, quick, design.says, design.tables.get("lubricant"), design.tables.get("strength")
    numbers = Kept(runs_beside(target), _Numbers())((mesh, lowest, asked), lambda: _numbers(found()))
    sizes = dataclasses.replace(mesh.resolution, positions=int(numbers[_POSITIONS]), pairs=int(numbers[_PAIRS]))
    flanks = design.design({name: numbers[name] for name in design.bounds})
    if sizes == mesh.resolution:
        return mesh, flanks
    return prepare(mesh.pair, compliance=mesh.compliance, resolution=sizes, support=mesh.support), flanks


def _numbers(optimum: Optimum) -> dict[str, float]:
    """Numbers that give design and mesh of an optimum again."""
    sizes = optimum.mesh.resolution
    return {**optimum.parameters, _POSITIONS: sizes.positions, _PAIRS: sizes.chosen_pairs}


class _Numbers:
    """Named numbers as arrays."""

    def arrays(self, found: dict[str, float]) -> dict[str, Any]:
        """All of them."""
        return found

    def result(self, arrays: dict[str, Any]) -> dict[str, float]:
        """The numbers."""
        return {name: float(value) for name, value in arrays.items()}
