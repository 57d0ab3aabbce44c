"""Pictures of mesh cycles, flanks, many variants, manufactured gears and optimizations, one file per kind.

Every function draws into the Axes `ax`, or into a new figure of report size if `ax` is None, and returns the Axes.
No function opens a window or changes the settings of matplotlib; `save` writes the file.
"""

from .dynamics import bifurcation as bifurcation
from .dynamics import branches as branches
from .dynamics import order_tracks as order_tracks
from .dynamics import phase_portrait as phase_portrait
from .dynamics import speed_response as speed_response
from .dynamics import speed_scale as speed_scale
from .dynamics import transmission_error_orders as transmission_error_orders
from .dynamics import waterfall as waterfall
from .figure import emphasize as emphasize
from .figure import panels as panels
from .figure import same_styles as same_styles
from .figure import save as save
from .flank import contact_pattern as contact_pattern
from .flank import face_gap as face_gap
from .flank import k_chart as k_chart
from .flank import lead_chart as lead_chart
from .flank import line_load as line_load
from .flank import plane_of_action as plane_of_action
from .flank import pressure_map as pressure_map
from .flank import topography as topography
from .front import convergence as convergence
from .front import iterations_relief as iterations_relief
from .front import iterations_transmission_error as iterations_transmission_error
from .front import optimum_front as optimum_front
from .front import parallel_coordinates as parallel_coordinates
from .front import pareto as pareto
from .mesh_cycle import load_sharing as load_sharing
from .mesh_cycle import mesh_stiffness as mesh_stiffness
from .mesh_cycle import pressure as pressure
from .mesh_cycle import transmission_error as transmission_error
from .revolution import order_spectrum as order_spectrum
from .revolution import revolution as revolution
from .shafts import shaft_deflection as shaft_deflection
from .variants import face_load_over_torque as face_load_over_torque
from .variants import fan as fan
from .variants import harris_map as harris_map
from .variants import ppte_distribution as ppte_distribution
from .variants import ppte_over_overlap as ppte_over_overlap
from .variants import ppte_over_torque as ppte_over_torque
from .variants import radar as radar
from .variants import response_surface as response_surface
from .wear import wear_history as wear_history
from .wear import worn_flank as worn_flank
