"""The public names, for type checkers and for `__init__.py`, which imports each when it is asked for."""

from .analysis import Analysis as Analysis
from .checkpoints import Checkpoints as Checkpoints
from .checkpoints import NamedArrays as NamedArrays
from .comparison import compared as compared
from .comparison_result import ComparisonResult as ComparisonResult
from .dynamics import DynamicsStudy as DynamicsStudy
from .dynamics_result import DynamicsResult as DynamicsResult
from .evaluation import Evaluation as Evaluation
from .evaluation import evaluate as evaluate
from .layout import LayoutStudy as LayoutStudy
from .layout_result import LayoutResult as LayoutResult
from .optimization import Optimization as Optimization
from .progress import Progress as Progress
from .progress import Stages as Stages
from .results import study_summary as study_summary
from .results import write_results as write_results
from .study import AbstractStudy as AbstractStudy
from .study import AbstractStudyResult as AbstractStudyResult
from .wear import WearStudy as WearStudy
from .wear_result import WearResult as WearResult

__all__: list[str]
