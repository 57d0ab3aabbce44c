"""Many variants into one table: plans, their evaluation on all devices, and a resumable store."""

from .plan import AbstractPlan as AbstractPlan
from .plan import FullFactorial as FullFactorial
from .plan import VariantList as VariantList
from .run import sweep as sweep
from .sampling import LatinHypercube as LatinHypercube
from .sampling import Sobol as Sobol
from .table import SweepTable as SweepTable
from .table import open_sweep as open_sweep
