"""Contact over whole revolutions of gears with deviations of single teeth."""

from .orders import NamedOrder as NamedOrder
from .orders import named_orders as named_orders
from .orders import over_revolution as over_revolution
from .orders import shaft_orders as shaft_orders
from .orders import side_bands as side_bands
from .orders import tooth_shares as tooth_shares
from .orders import tooth_to_tooth_error as tooth_to_tooth_error
from .orders import total_composite_error as total_composite_error
from .quantities import REVOLUTION_QUANTITIES as REVOLUTION_QUANTITIES
from .settings import Teeth as Teeth
from .solve import Revolution as Revolution
from .solve import solve_revolution as solve_revolution
from .teeth import TeethDeviations as TeethDeviations
from .teeth import Undulation as Undulation
