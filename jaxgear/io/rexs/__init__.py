"""REXS files (https://www.rexs.info): the open exchange format for gearbox data, read and written."""

from .read import RexsPair as RexsPair
from .read import read_rexs as read_rexs
from .stages import RexsStage as RexsStage
from .stages import rexs_stages as rexs_stages
from .write import write_rexs as write_rexs
