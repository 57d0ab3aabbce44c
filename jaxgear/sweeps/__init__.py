"""Many variants, loads or manufactured gears: tables of plans in a resumable store, and the scatter of one design."""

from .monte_carlo import Scatter as Scatter
from .monte_carlo import monte_carlo as monte_carlo
from .plan import AbstractPlan as AbstractPlan
from .plan import FullFactorial as FullFactorial
from .plan import VariantList as VariantList
from .run import sweep as sweep
from .sampling import LatinHypercube as LatinHypercube
from .sampling import Sobol as Sobol
from .table import SweepTable as SweepTable
from .table import open_sweep as open_sweep
from .torques import over_torques as over_torques
