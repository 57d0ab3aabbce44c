"""Many variants, loads or manufactured gears: tables of plans in a resumable store, and the scatter of one design."""

from .columns import Column as Column
from .columns import axis_label as axis_label
from .columns import described as described
from .columns import over_torques as over_torques
from .monte_carlo import Scatter as Scatter
from .monte_carlo import monte_carlo as monte_carlo
from .plan import AbstractPlan as AbstractPlan
from .plan import FullFactorial as FullFactorial
from .plan import LatinHypercube as LatinHypercube
from .plan import Sobol as Sobol
from .plan import VariantList as VariantList
from .run import sweep as sweep
from .table import SweepTable as SweepTable
from .table import open_sweep as open_sweep
