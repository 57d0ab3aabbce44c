"""Analysis and optimization: designs evaluated side by side on one mesh, and the search for the best of them."""

import dataclasses
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import jax

from ..compliance import Compliance, TabulatedCompliance
from ..contact import Mesh
from ..io import DesignFile, DesignFileError, Search
from ..io.errors import naming
from ..microgeometry import AbstractModification, NoModification
from ..optimize import (
    Front,
    Optimum,
    Problem,
    Projection,
    begin_verification,
    judged,
    project,
    structure_for,
    verification,
)
from ..tolerance import ManufacturedGears
from . import manufactured, side_by_side
from .checkpoints import Checkpoints
from .comparison import ComparisonResult, Modifications, rule_based
from .evaluation import Evaluation, coarse, evaluation_of, torques_of
from .optimization_result import COMPROMISE, OptimizationResult
from .study import AbstractStudy, Stages


class ComparisonRun:
    """Evaluate designs on one mesh and collect their results.

    Args:
        design: design file.
        stages: progress of the study.
        quick: True for coarse positions and few torques.
    """

    def __init__(self, design: DesignFile, stages: Stages, *, quick: bool = False) -> None:
        self.design, self._stages, self._quick = design, stages, quick
        self._evaluations: dict[str, Evaluation] = {}
        self._problem: Problem | None = None  # problem whose objectives are evaluated for all designs
        self._optimum: Optimum | None = None
        self._front: Front | None = None
        self._projection: Projection | None = None
        self._second: TabulatedCompliance | None = None  # compliance for the verification
        self._unverified = ""  # reason for no verification

    def prepare(self, *, finer: int | None = None, verify: bool | None = False) -> None:
        """Prepare the mesh, and the finite-element structure for the verification.

        Args:
            finer: number of positions on which a search will end; None without a search.
            verify: True to evaluate the designs also with the finite-element structure; None to do so if possible.

        Raises:
            DesignFileError: if the verification is required but not possible.
        """
        self._stages.begin("preparing the mesh")
        size = self.design.resolution()
        if finer is not None:
            self.design.begin_contact(size, dataclasses.replace(size, positions=max(finer, size.positions)))
        self._mesh: Mesh = jax.block_until_ready(self.design.mesh(coarse(size) if self._quick else size))
        self._searched_at = self._mesh.resolution.positions
        self._torques = torques_of(self.design, quick=self._quick)
        whole = next(iter(self.design.part_of), "")
        if whole:  # its quantities would be verified by nothing
            self._unverified = f"finite-element structures are of pairs, [{whole}] is more than one"
            if verify:
                raise DesignFileError("optimize.verify", self._unverified, self.design.path)
        elif verify or (verify is None and isinstance(self._mesh.compliance, Compliance)):
            self._make_tables(finer, required=verify is not None)

    def _make_tables(self, finer: int | None, *, required: bool) -> None:
        """Make the compliance tables before the search, so that an error or interruption here loses no optimum."""
        if self._mesh.pair.is_spur:  # helical pairs raise an error at once
            self._stages.begin("finite-element tables of pinion and wheel, made once and kept")
        try:
            self._second = structure_for(self._mesh)
        except ValueError as error:
            if required:
                raise DesignFileError("optimize.verify", str(error), self.design.path) from None
            self._unverified = str(error)
            return
        begin_verification(self._mesh, self._second, finer)

    def evaluate(self, name: str, pinion: AbstractModification, wheel: AbstractModification) -> None:
        """Evaluate a design and store its results under a name."""
        self._stages.begin(f"solving the {name} design")
        found = evaluation_of(self.design, self._mesh, self._torques, pinion, wheel)
        if self._problem is not None:
            found = dataclasses.replace(found, objectives=judged(self._problem, pinion, wheel))
        self._evaluations[name] = found

    def search(self, search: Search, beside: Mapping[str, Modifications]) -> None:
        """Find the optimum, and for free-form flanks its projection on the named curve.

        The optimum and the designs `beside` it are evaluated on the final mesh of the search, with its objectives.
        """
        self._stages.begin(f"searching the optimum ({search.method})")
        began = time.perf_counter()
        found = search(self._mesh, self._stages.step)
        self._front = found if isinstance(found, Front) else None
        optimum = found.compromise if isinstance(found, Front) else found
        spent = time.perf_counter() - began
        self._mesh, self._problem = optimum.mesh, optimum.problem
        for name, modifications in beside.items():
            self.evaluate(name, *modifications)
        name = "optimum" if self._front is None else COMPROMISE
        self.evaluate(name, optimum.pinion, optimum.wheel)
        evaluated = dataclasses.replace(self._evaluations[name], seconds=spent)
        self._evaluations[name] = evaluated
        # with several torques it belongs to another torque than the table
        ppte = float(evaluated.metrics["ppte_um"])
        self._optimum = optimum = dataclasses.replace(optimum, cycle=evaluated.cycle, ppte=ppte)
        if search.curve is not None:
            self._stages.begin(f"projecting the flanks on a {search.curve} curve")
            self._projection = projection = project(optimum, search.curve)
            self.evaluate(f"as {search.curve}", projection.pinion, projection.wheel)
        if self._second is not None:
            self._verify(self._second)

    def _verify(self, second: TabulatedCompliance) -> None:
        """Evaluate all designs again with the finite-element structure."""
        self._stages.begin("verifying with the finite-element structure")
        by_finite_elements = verification(self._mesh, second, self._problem)
        for name, claimed in self._evaluations.items():
            found = by_finite_elements(claimed.cycle, claimed.objectives, claimed.pinion, claimed.wheel)
            self._evaluations[name] = dataclasses.replace(claimed, verified=found)

    def result(self, gears: ManufacturedGears | None) -> ComparisonResult:
        """Result of the comparison, with the scatter of all designs; None for nominal gears only."""
        evaluations = self._evaluations
        if gears is not None:
            self._stages.begin("manufacturing the designs within their tolerances")
            of = self.design, self._mesh, evaluations
            evaluations = manufactured.scattered(*of, gears)
        unusual = side_by_side.findings(self.design, self._mesh, evaluations)
        common = self.design, self._quick, self._mesh, self._torques, evaluations, unusual, self._unverified
        if self._optimum is None:
            return ComparisonResult(*common)
        found = self._optimum, self._front, self._projection, self._searched_at
        return OptimizationResult(*common, *found)


@dataclass(frozen=True)
class AnalysisStudy(AbstractStudy[ComparisonResult]):
    """Analyze the unmodified pair and the modification of the design file.

    Attributes:
        gears: manufactured gears; None without the table [tolerance].
    """

    name: ClassVar = "analyze"
    takes_coast: ClassVar = True
    coarse: ClassVar = ""

    gears: ManufacturedGears | None

    @classmethod
    def of(cls, design: DesignFile, *, quick: bool = False) -> Self:
        """Analysis of a design file in which every variable has a value, see `AbstractStudy.of`."""
        free = [name for name in design.bounds if design.open_case or name not in design.values]
        if free:
            says = "give each a value or use jaxgear optimize"
            problem = f"analyze needs numbers, these are free: {', '.join(free)}; {says}"
            raise DesignFileError("variables", problem, design.path)
        with naming(design.path):
            return cls(design, quick, manufactured.gears_of(design, quick=quick))

    def omits(self) -> str:
        """Empty message: no table of the file is ignored."""
        return ""

    def work_out(self, checkpoints: Checkpoints, stages: Stages) -> ComparisonResult:
        """Evaluate both designs; writes no checkpoints."""
        run = ComparisonRun(self.design, stages, quick=self.quick)
        run.prepare()
        run.evaluate("unmodified", NoModification(), NoModification())
        pinion, wheel = self.design.design(self.design.values)
        if not (isinstance(pinion, NoModification) and isinstance(wheel, NoModification)):
            run.evaluate("modified", pinion, wheel)
        return run.result(self.gears)


@dataclass(frozen=True)
class OptimizationStudy(AbstractStudy[ComparisonResult]):
    """Find the best variables or flanks by the method and for the objective of the design file.

    The default objective is the peak-to-peak transmission error (PPTE) at the design torque. The command compares the
    unmodified pair, the rule-based tip relief of ISO 6336-1, and the optimum.

    Attributes:
        search: search for the optimum.
        gears: manufactured gears; None without the table [tolerance].
    """

    name: ClassVar = "optimize"
    takes_coast: ClassVar = True
    coarse: ClassVar = ""  # the result reports it
    needs: ClassVar = ("scipy.optimize",)

    search: Search
    gears: ManufacturedGears | None

    @classmethod
    def of(cls, design: DesignFile, *, quick: bool = False, method: str | None = None) -> Self:
        """Optimization of a design file, see `AbstractStudy.of`; `method` replaces that of the file."""
        search = Search.of(design, method=method, quick=quick)
        with naming(design.path):
            return cls(design, quick, search, manufactured.gears_of(design, quick=quick))

    @property
    def folder(self) -> str:
        """Folder of the results, one per method."""
        return f"{self.name}/{self.search.method}"

    def omits(self) -> str:
        """Empty message: no table of the file is ignored."""
        return ""

    def work_out(self, checkpoints: Checkpoints, stages: Stages) -> ComparisonResult:
        """Search the optimum and evaluate all designs; writes no checkpoints."""
        run = ComparisonRun(self.design, stages, quick=self.quick)
        run.prepare(finer=self.search.finer, verify=self.search.verify)
        relief, involute = rule_based(self.design), NoModification()
        run.search(self.search, {"unmodified": (involute, involute), "rule-based": (relief, relief)})
        return run.result(self.gears)
