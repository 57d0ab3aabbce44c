"""Pictures of mesh cycles and flank modifications, one file per kind.

Every function draws into the Axes `ax`, or into a new figure of report size when `ax` is None, and returns the Axes.
None shows a window or changes matplotlib's settings; `save` writes the file.
"""

from .figure import save as save
from .k_chart import k_chart as k_chart
from .load_sharing import load_sharing as load_sharing
from .pressure import pressure as pressure
from .pressure_map import pressure_map as pressure_map
from .torque import harris_map as harris_map
from .torque import ppte_over_torque as ppte_over_torque
from .transmission_error import transmission_error as transmission_error
