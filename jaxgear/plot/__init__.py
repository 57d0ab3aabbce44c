"""Pictures of mesh cycles, flank modifications, many variants and manufactured gears, one file per kind.

Every function draws into the Axes `ax`, or into a new figure of report size when `ax` is None, and returns the Axes.
None shows a window or changes matplotlib's settings; `save` writes the file.
"""

from .fan import fan as fan
from .fan import ppte_histogram as ppte_histogram
from .figure import save as save
from .k_chart import k_chart as k_chart
from .load_sharing import load_sharing as load_sharing
from .parallel_coordinates import parallel_coordinates as parallel_coordinates
from .pareto import pareto as pareto
from .pressure import pressure as pressure
from .pressure_map import pressure_map as pressure_map
from .radar import radar as radar
from .torque import harris_map as harris_map
from .torque import ppte_over_torque as ppte_over_torque
from .transmission_error import transmission_error as transmission_error
