"""The public names, for type checkers and for `__init__.py`, which imports each when it is asked for."""

from .planetary import RexsPlanetaryStage as RexsPlanetaryStage
from .planetary import read_rexs_stage as read_rexs_stage
from .read import RexsPair as RexsPair
from .read import read_rexs as read_rexs
from .stages import RexsStage as RexsStage
from .stages import rexs_stages as rexs_stages
from .write import write_rexs as write_rexs
from .write_planetary import write_rexs_stage as write_rexs_stage
