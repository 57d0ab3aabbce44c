"""The search for the best design, compared with the unmodified pair and the rule-based relief."""

from dataclasses import dataclass
from typing import ClassVar, Self

from ..io import DesignFile, Search
from ..io.errors import naming
from ..io.tolerance_table import tolerance_of
from ..microgeometry import NoModification
from ..tolerance import Tolerance
from .checkpoints import Checkpoints
from .comparison import rule_based
from .comparison_result import ComparisonResult
from .comparison_run import ComparisonRun
from .progress import Stages
from .study import AbstractStudy


@dataclass(frozen=True)
class DesignOptimization(AbstractStudy[ComparisonResult]):
    """Find the best variables or flanks by the method and for the objective of the design file.

    Without a word about them that is the least peak-to-peak transmission error (PPTE) at the design torque. Compares
    the unmodified pair, the rule-based tip relief of ISO 6336-1, and the optimum.

    Attributes:
        search: search for the optimum.
        tolerance: of manufactured gears; None without the table [tolerance].
    """

    name: ClassVar = "optimize"
    takes_coast: ClassVar = True
    coarse: ClassVar = ""  # the result says it
    needs: ClassVar = ("scipy.optimize",)

    search: Search
    tolerance: Tolerance | None

    @classmethod
    def of(cls, design: DesignFile, *, quick: bool = False, method: str | None = None) -> Self:
        """Optimization of a design file, see `AbstractStudy.of`; `method` replaces that of the file."""
        search = Search.of(design, method=method, quick=quick)
        with naming(design.path):
            return cls(design, quick, search, tolerance_of(design))

    @property
    def folder(self) -> str:
        """Folder of the results of the method below that of the design file."""
        return f"{self.name}/{self.search.method}"

    def omits(self) -> str:
        """Nothing."""
        return ""

    def work_out(self, checkpoints: Checkpoints, stages: Stages) -> ComparisonResult:
        """All designs; keeps no checkpoints."""
        run = ComparisonRun(self.design, stages, quick=self.quick)
        run.prepare(finer=self.search.finer, verify=self.search.verify)
        relief, involute = rule_based(self.design), NoModification()
        run.search(self.search, {"unmodified": (involute, involute), "rule-based": (relief, relief)})
        return run.result(self.tolerance)
