"""The public names, for type checkers and for `__init__.py`, which imports each when it is asked for."""

from .files import write_wheel_drawing as write_wheel_drawing
from .files import write_wheel_points as write_wheel_points
from .spline import WheelSpline as WheelSpline
from .spline import best_wheel_spline as best_wheel_spline
from .spline import relief_start as relief_start
from .spline import start_of_relief as start_of_relief
from .spline import wheel_spline as wheel_spline
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
