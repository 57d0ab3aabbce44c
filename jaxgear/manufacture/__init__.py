"""How flanks are made and measured: form-grinding wheel, volumes ground off, charts of the measuring machine.

`drawn_gear` makes a gear from the tooth thickness and the diameters on its drawing. Functions of flanks take one gear's
side of the contact, of `mesh.sides`, and the modification. The quantities `pinion_quadratic_deviation`,
`pinion_removed_volume` and others are in the vocabulary.
"""

from .chart import FlankDeviations as FlankDeviations
from .chart import FlankPlace as FlankPlace
from .chart import Trace as Trace
from .chart import flank_deviations as flank_deviations
from .chart import flank_place as flank_place
from .chart import helix_range as helix_range
from .chart import helix_trace as helix_trace
from .chart import profile_range as profile_range
from .chart import profile_trace as profile_trace
from .chart import start_of_relief as start_of_relief
from .chart import table_traces as table_traces
from .drawn_gear import drawn_gear as drawn_gear
from .drawn_profile import ToothProfile as ToothProfile
from .drawn_profile import with_profile as with_profile
from .tooth_thickness import Measures as Measures
from .tooth_thickness import ToothThickness as ToothThickness
from .tooth_thickness import allowance_of_balls as allowance_of_balls
from .tooth_thickness import allowance_of_span as allowance_of_span
from .tooth_thickness import measures as measures
from .tooth_thickness import over_balls as over_balls
from .tooth_thickness import span as span
from .tooth_thickness import teeth_spanned as teeth_spanned
from .tooth_thickness import with_thickness as with_thickness
from .volume import GROUND_QUANTITIES as GROUND_QUANTITIES
from .volume import ReferenceVolumes as ReferenceVolumes
from .volume import ground_area as ground_area
from .volume import ground_volume as ground_volume
from .volume import reference_volumes as reference_volumes
from .volume import relative_volume as relative_volume
from .wheel import GrindingMargins as GrindingMargins
from .wheel import GrindingWheel as GrindingWheel
from .wheel import SpaceFlank as SpaceFlank
from .wheel import WheelProfile as WheelProfile
from .wheel import grinding_faults as grinding_faults
from .wheel import grinding_margins as grinding_margins
from .wheel import largest_wheel_radius as largest_wheel_radius
from .wheel import run_out as run_out
from .wheel import smallest_wheel_radius as smallest_wheel_radius
from .wheel import space_flank as space_flank
from .wheel import wheel_profile as wheel_profile
from .wheel_spline import WheelSpline as WheelSpline
from .wheel_spline import best_wheel_spline as best_wheel_spline
from .wheel_spline import relief_start as relief_start
from .wheel_spline import wheel_spline as wheel_spline
