"""The analysis of the designs that a file gives as numbers."""

from dataclasses import dataclass
from typing import ClassVar, Self

from ..io import DesignFile, DesignFileError
from ..io.errors import naming
from ..microgeometry import NoModification
from ..tolerance import ManufacturedGears
from .checkpoints import Checkpoints
from .comparison_result import ComparisonResult
from .comparison_run import ComparisonRun
from .manufactured import gears_of
from .progress import Stages
from .study import AbstractStudy


@dataclass(frozen=True)
class DesignAnalysis(AbstractStudy[ComparisonResult]):
    """Analyze the unmodified pair and the modification of the design file.

    Attributes:
        manufactured: manufactured gears; None without the table [tolerance].
    """

    name: ClassVar = "analyze"
    takes_coast: ClassVar = True
    coarse: ClassVar = ""

    manufactured: ManufacturedGears | None

    @classmethod
    def of(cls, design: DesignFile, *, quick: bool = False) -> Self:
        """Analysis of a design file in which every variable has a value, see `AbstractStudy.of`."""
        free = [name for name in design.bounds if design.open_case or name not in design.values]
        if free:
            says = "give each a value or use jaxgear optimize"
            problem = f"analyze needs numbers, these are free: {', '.join(free)}; {says}"
            raise DesignFileError("variables", problem, design.path)
        with naming(design.path):
            return cls(design, quick, gears_of(design, quick=quick))

    def omits(self) -> str:
        """Nothing."""
        return ""

    def work_out(self, checkpoints: Checkpoints, stages: Stages) -> ComparisonResult:
        """Both designs; keeps no checkpoints."""
        run = ComparisonRun(self.design, stages, quick=self.quick)
        run.prepare()
        run.evaluate("unmodified", NoModification(), NoModification())
        pinion, wheel = self.design.design(self.design.values)
        if not (isinstance(pinion, NoModification) and isinstance(wheel, NoModification)):
            run.evaluate("modified", pinion, wheel)
        return run.result(self.manufactured)
