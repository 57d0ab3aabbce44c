"""Pictures of mesh cycles, flanks, many variants, manufactured gears and optimizations, one file per kind.

Every function draws into the Axes `ax`, or into a new figure of report size when `ax` is None, and returns the Axes.
None shows a window or changes matplotlib's settings; `save` writes the file.
"""

from .convergence import convergence as convergence
from .dynamics import bifurcation as bifurcation
from .dynamics import branches as branches
from .dynamics import order_tracks as order_tracks
from .dynamics import phase_portrait as phase_portrait
from .dynamics import speed_response as speed_response
from .dynamics import speed_scale as speed_scale
from .dynamics import waterfall as waterfall
from .face import face_gap as face_gap
from .face import line_load as line_load
from .fan import fan as fan
from .fan import ppte_distribution as ppte_distribution
from .fan import ppte_histogram as ppte_histogram
from .figure import emphasize as emphasize
from .figure import save as save
from .grinding import tooth_space as tooth_space
from .grinding import volumes as volumes
from .grinding import wheel_deviation as wheel_deviation
from .iterations import iterations_relief as iterations_relief
from .iterations import iterations_transmission_error as iterations_transmission_error
from .k_chart import k_chart as k_chart
from .lead_chart import lead_chart as lead_chart
from .load_sharing import load_sharing as load_sharing
from .meshing import meshing_diagram as meshing_diagram
from .optimizer_comparison import optimizer_comparison as optimizer_comparison
from .optimum_front import optimum_front as optimum_front
from .orders import transmission_error_orders as transmission_error_orders
from .parallel_coordinates import parallel_coordinates as parallel_coordinates
from .pareto import pareto as pareto
from .pressure import pressure as pressure
from .pressure_map import contact_pattern as contact_pattern
from .pressure_map import pressure_map as pressure_map
from .radar import radar as radar
from .response_surface import response_surface as response_surface
from .shaft import shaft_deflection as shaft_deflection
from .stiffness import mesh_stiffness as mesh_stiffness
from .tolerance_cases import face_load_factors as face_load_factors
from .tolerance_cases import tolerance_line_load as tolerance_line_load
from .topography import topography as topography
from .torque import face_load_over_torque as face_load_over_torque
from .torque import harris_map as harris_map
from .torque import ppte_over_torque as ppte_over_torque
from .transmission_error import transmission_error as transmission_error
from .variants import label as label
from .wear import lives as lives
from .wear import worn_flank as worn_flank
