"""The public names, for type checkers and for `__init__.py`, which imports each when it is asked for."""

from .estimate import Identified as Identified
from .estimate import identify as identify
from .estimate import period_of as period_of
from .measurement import Measurement as Measurement
from .measurement import read_measurement as read_measurement
from .study import IdentificationResult as IdentificationResult
from .study import IdentificationStudy as IdentificationStudy
