"""The public names, for type checkers and for `__init__.py`, which imports each when it is asked for."""

from .read import RexsPair as RexsPair
from .read import RexsStage as RexsStage
from .read import read_rexs as read_rexs
from .read import rexs_stages as rexs_stages
from .write import write_rexs as write_rexs
