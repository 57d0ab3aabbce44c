"""Designs that a study compares, unmodified, rule-based, and of the file or optimal; results of a comparison."""

import csv
import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Self

import jax
import numpy as np

from ..contact import Mesh, prepare
from ..geometry import Gear, GearPair, PathOfContact, RingGear, explicit, pair_geometry
from ..io import DesignFile, Search, write_flanks
from ..io.optimize_table import METHODS_WITHOUT_VARIABLES, optimize_of
from ..io.tables import FurtherTable
from ..metrics import Finding
from ..microgeometry import AbstractModification, NoModification
from ..numerics import UnitKey, fields_of, program
from ..optimize import Front, Optimum, Verified
from ..report import Chapter, Figure, Part, Table, numbers, text, write_tables
from ..shafts import RigidSupport
from ..sizing import iso_relief
from ..vocabulary import quantities
from . import manufactured, side_by_side
from .checkpoints import Checkpoints, NamedArrays
from .evaluation import Evaluation, coarse
from .gear_data import FACTORS, gears, mounting, rating_page
from .study import AbstractStudyResult, Stages
from .summary import fields_data, finding_data, flanks_data, key_of, model, sizes

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


@dataclass(frozen=True)
class ComparisonResult(AbstractStudyResult):
    """Result of a comparison of designs.

    Attributes:
        design: design file.
        quick: True for coarse positions and few torques.
        mesh: mesh of the evaluations.
        torques: torques of the evaluations, over the range of the file [N m], shape (torques,).
        evaluations: evaluations by the name of the design, the unmodified design first.
        unusual: findings by the name of the design.
        unverified: reason for no verification by finite elements; "" if verified or not requested.
    """

    design: DesignFile
    quick: bool
    mesh: Mesh
    torques: np.ndarray
    evaluations: Mapping[str, Evaluation]
    unusual: Mapping[str, tuple[Finding, ...]]
    unverified: str

    def inputs(self) -> dict[str, Any]:
        """Load, tolerances, model, array sizes and further tables of the design file, as plain data."""
        file = self.design
        tables = {name: part for name in ("lubricant", "strength") if (part := file.tables.get(name)) is not None}
        return {
            UnitKey("torque", "N m"): file.signed_torque,
            UnitKey("torque_range", "N m"): file.torque_range,
            UnitKey("speed", "rpm"): file.speed,
            "friction": file.friction,
            **{name: fields_data(part, units=True) for name, part in tables.items()},
            **manufactured.tolerances(file),
            "model": model(self.mesh),
            "resolution": sizes(self.mesh.resolution),
        }

    def summary(self) -> dict[str, Any]:
        """Numbers of the gears and of every design, as plain data."""
        file, mesh, evaluations = self.design, self.mesh, self.evaluations
        pair = mesh.pair.coast if file.coast else mesh.pair  # with the hands of helix of the file
        ppte = {UnitKey(name, "um"): evaluation.ppte for name, evaluation in evaluations.items()}
        geometry = gears(file)["geometry"]
        return {
            "gears": {
                name: _gear(getattr(pair, name), geometry[name]) | _drawn(drawn) for name, drawn in file.drawn.items()
            },
            UnitKey("center_distance", "mm"): geometry["pair"]["center_distance_mm"],
            **_misalignment(mesh),
            "designs": {
                name: {**_design(evaluations[name]), "findings": [finding_data(finding) for finding in several]}
                for name, several in self.unusual.items()
            },
            UnitKey("ppte_reduction", "%"): _reduction(evaluations),
            "ppte_over_torque": {UnitKey("torque", "N m"): self.torques, **ppte},
            "iso_6336": self._rating(),
            **{name: part.data for name, part in self.parts.items()},
        }

    def _rating(self) -> dict[str, dict[str, float]]:
        return {name: {key: of.factors[key] for key in FACTORS} for name, of in self.evaluations.items()}

    def write(self, folder: Path) -> None:
        """Write the flanks of all designs to `flanks.csv`, and the files that further tables add."""
        write_flanks(folder / "flanks.csv", self.mesh, side_by_side.flanks(self.evaluations))
        for name, part in self.parts.items():
            if part.lines:
                with (folder / f"{name}.csv").open("w", newline="", encoding="utf-8") as file:
                    csv.writer(file).writerows(part.lines)

    def reported(self, folder: Path, facts: Sequence[tuple[str, str]], *, figures: bool) -> Self:
        """The result, after writing a workbook of the data of further tables if the library for it is installed."""
        for name, part in self.parts.items():
            if find_spec("xlsxwriter") is not None:
                tables = [table for chapter in part.chapters for table in chapter.tables]
                write_tables(folder / f"{name}.xlsx", facts, tables)
        return self

    @cached_property
    def parts(self) -> dict[str, Part]:
        """Parts that tables of the file add to the result for the main design, by their names."""
        name = side_by_side.main_name(self.evaluations)
        cycle = self.evaluations[name].cycle
        tables = {key: each for key, each in self.design.tables.items() if isinstance(each, FurtherTable)}
        found = {key: each.part(self.design, name, cycle) for key, each in tables.items()}
        return {key: each for key, each in found.items() if isinstance(each, Part)}

    def figures(self) -> Iterator[Figure]:
        """Figures of the designs, of their scatter over manufactured gears, and of what tables of the file add."""
        yield from side_by_side.figures(self.design, self.mesh, self.evaluations, self.torques)
        yield from manufactured.figures(self.evaluations)
        for part in self.parts.values():
            yield from (draw() for draw in part.figures)

    def tables(self) -> Iterator[Table]:
        """Tables of the designs side by side, and of further tables of the file."""
        yield side_by_side.table(self.design, self.evaluations)
        for part in self.parts.values():
            yield from part.tables

    def verdict(self) -> Iterator[str]:
        """Lines on the grid and its error, notes, and the mounting of the gears."""
        yield from (*side_by_side.grid(self.evaluations), *self.notes(), mounting(self.design))

    def notes(self) -> Iterator[str]:
        """Lines on manufactured gears, coast flanks, coarse positions and a missing verification."""
        yield from manufactured.lines(self.design, self.evaluations)
        if self.design.coast:
            yield "coast flanks: contact runs from pinion tip to pinion root, positions count against the rotation"
        if self.quick:
            yield "quick run, coarse positions and a short search: a preview, do not use for design"
        if self.unverified:
            yield f"not verified by finite elements: {self.unverified}"

    def findings(self) -> Iterator[str]:
        """Lines on values of the designs outside the usual range."""
        return side_by_side.finding_lines(self.unusual)

    def failures(self) -> Iterator[str]:
        """Lines on results that have not converged."""
        yield from (*side_by_side.failures(self.evaluations), *manufactured.failures(self.evaluations))

    def checks(self) -> Iterator[tuple[str, str]]:
        """Checks of a report: convergence of all designs, and their values by finite elements."""
        for name, evaluation in self.evaluations.items():
            yield f"{name}: converged", text(evaluation.metrics["converged"])
            yield f"{name}: failed torques [N m]", text(evaluation.failed_torques)
            if evaluation.verified is not None:
                for key, value in numbers(_verified(evaluation.verified)):
                    yield f"{name}: by finite elements, {key}", value

    def chapters(self) -> Iterator[Chapter]:
        """Chapters on robustness, further tables and ISO 6336 stresses."""
        yield from manufactured.pages(self.design, self.evaluations)
        for part in self.parts.values():
            yield from part.chapters
        if not self.parts:
            yield rating_page(self._rating())


def _design(evaluation: Evaluation) -> dict[str, Any]:
    return {
        **evaluation.metrics,
        "change_at_twice_the_positions": evaluation.grid_change,
        **({"objectives": evaluation.objectives} if evaluation.objectives else {}),
        **({"verified": _verified(evaluation.verified)} if evaluation.verified else {}),
        **manufactured.summary(evaluation),
        UnitKey("failed_torques", "N m"): evaluation.failed_torques,
        **flanks_data(evaluation.pinion, evaluation.wheel),
        UnitKey("time", "s"): evaluation.seconds,
    }


def _verified(found: Verified) -> dict[str, Any]:
    objectives = {"objectives": found.objectives} if found.objectives else {}
    return {"structure": "finite_element", quantities["ppte"].key: found.ppte, **objectives}


def _reduction(evaluations: side_by_side.Evaluations) -> float:
    """Reduction of the PPTE of the first design, which is unmodified, by the main design [%]."""
    before = next(iter(evaluations.values())).metrics["ppte_um"]
    return 100 * (1 - side_by_side.main(evaluations).metrics["ppte_um"] / before) if before else 0.0


# computed from other numbers if not given
_DERIVED = "tip_diameter", "tip_form_diameter", "bore_diameter", "rim_diameter"


def _gear(gear: Gear, geometry: Mapping[str, Any]) -> dict[str, Any]:
    """Numbers of a gear, with computed values where the file gives none."""
    fixed = gear.rim_diameter if isinstance(gear, RingGear) else gear.bore_diameter
    data: dict[str, Any] = {"bore_given": fixed is not None}
    for part in (gear, gear.material):
        for name, field in fields_of(type(part)).items():
            key = key_of(name, field)
            data[key] = geometry[key] if name in _DERIVED else np.asarray(getattr(part, name))
    return data


def _drawn(given: Mapping[str, Any]) -> dict[str, Any]:
    """Drawing data of the file; tooth thickness keys get the prefix `drawn_`, distinct from the numbers of the gear."""
    return {
        UnitKey(f"drawn_{key.name}", key.unit)
        if isinstance(key, UnitKey) and key.startswith("tooth_thickness")
        else key: value
        for key, value in given.items()
    }


def _misalignment(mesh: Mesh) -> dict[str, float]:
    """Misalignment over the face where the axes are not parallel [um]."""
    if not isinstance(mesh.support, RigidSupport):
        return {}
    return {UnitKey("misalignment", "um"): float(mesh.support.misalignment.over_face(mesh.pair))}
