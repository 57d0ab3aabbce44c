"""Manufacturing deviations of a design: tolerances, and random deviations within them.

Deviations are material removed in um like every modification: positive into the flank, of either sign. Slopes turn
about the middle of the profile or the face, as `ProfileSlope` and `LeadSlope` do, and the waviness has neither mean nor
slope, so that each deviation is what a gear measuring machine reports under that name.
"""

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
