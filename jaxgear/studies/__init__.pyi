"""The public names, for type checkers and for `__init__.py`, which imports each when it is asked for."""

from .analysis import AnalysisStudy as AnalysisStudy
from .analysis import OptimizationStudy as OptimizationStudy
from .checkpoints import Checkpoints as Checkpoints
from .checkpoints import NamedArrays as NamedArrays
from .comparison import ComparisonResult as ComparisonResult
from .comparison import compared as compared
from .comparison import rule_based as rule_based
from .comparison import search_of as search_of
from .dynamics import DynamicsStudy as DynamicsStudy
from .dynamics_result import DynamicsResult as DynamicsResult
from .evaluation import Evaluation as Evaluation
from .evaluation import evaluation_of as evaluation_of
from .export import ExportResult as ExportResult
from .export import ExportStudy as ExportStudy
from .optimization_result import OptimizationResult as OptimizationResult
from .revolution import RevolutionResult as RevolutionResult
from .revolution import RevolutionStudy as RevolutionStudy
from .study import AbstractStudy as AbstractStudy
from .study import AbstractStudyResult as AbstractStudyResult
from .study import Progress as Progress
from .study import Stages as Stages
from .summary import study_summary as study_summary
from .summary import write_results as write_results
from .sweep import SweepResult as SweepResult
from .sweep import SweepStudy as SweepStudy
from .wear import WearResult as WearResult
from .wear import WearStudy as WearStudy
from .wear_scatter import manufactured_wear as manufactured_wear

__all__: list[str]
