"""Manufacturing deviations of a design: tolerances, random deviations within them, and charts of measuring machines.

Deviations are material removed in um, like modifications: positive into the flank, with either sign. Slopes turn about
the middle of the profile or the face, as `ProfileSlope` and `LeadSlope` do, and the waviness has neither mean nor
slope. Each deviation therefore corresponds to the deviation of the same name in a report of a gear measuring machine.
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
from .chart import table_traces as table_traces
from .deviation import Deviation as Deviation
from .deviation import GearDeviation as GearDeviation
from .deviation import ManufacturedGears as ManufacturedGears
from .deviation import deviated_material as deviated_material
from .limits import AbstractDistribution as AbstractDistribution
from .limits import GearTolerance as GearTolerance
from .limits import Tolerance as Tolerance
from .limits import ToleranceClass as ToleranceClass
from .limits import TruncatedNormal as TruncatedNormal
from .limits import Uniform as Uniform
from .limits import iso_rounded as iso_rounded
