"""The search for the best design, compared with the unmodified pair and the rule-based relief."""

from dataclasses import dataclass
from typing import ClassVar, Self

from ..io import DesignFile, OptimizeRequest, optimize_request
from ..io.errors import naming
from ..microgeometry import NoModification
from ..tolerance import ManufacturedGears
from .checkpoints import Checkpoints
from .comparison import rule_based
from .comparison_result import ComparisonResult
from .comparison_run import ComparisonRun
from .manufactured import gears_of
from .progress import Stages
from .study import AbstractStudy


@dataclass(frozen=True)
class DesignOptimization(AbstractStudy[ComparisonResult]):
    """Find the best variables or flanks by the method and for the objective of the design file.

    Compares the unmodified pair, the rule-based tip relief of ISO 6336-1, and the optimum.

    Attributes:
        request: what the file asks for.
        manufactured: manufactured gears; None without the table [tolerance].
    """

    name: ClassVar = "optimize"
    takes_coast: ClassVar = True
    coarse: ClassVar = ""  # the result says it
    needs: ClassVar = ("scipy.optimize",)

    request: OptimizeRequest
    manufactured: ManufacturedGears | None

    @classmethod
    def of(cls, design: DesignFile, *, quick: bool = False, method: str | None = None) -> Self:
        """Optimization of a design file, see `AbstractStudy.of`; `method` replaces that of the file."""
        request = optimize_request(design, method=method, quick=quick)
        with naming(design.path):
            return cls(design, quick, request, gears_of(design, quick=quick))

    @property
    def folder(self) -> str:
        """Folder of the results of the method below that of the design file."""
        return f"{self.name}/{self.request.method}"

    def omits(self) -> str:
        """Nothing."""
        return ""

    def work_out(self, checkpoints: Checkpoints, stages: Stages) -> ComparisonResult:
        """All designs; keeps no checkpoints."""
        run = ComparisonRun(self.design, stages, quick=self.quick)
        run.prepare(finer=self.request.finer, verify=self.request.verify)
        relief, involute = rule_based(self.design), NoModification()
        run.search(self.request, {"unmodified": (involute, involute), "rule-based": (relief, relief)})
        return run.result(self.manufactured)
