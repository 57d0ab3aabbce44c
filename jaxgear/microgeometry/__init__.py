"""Flank modifications: profile and lead modifications, composed with `+` and factors.

Positive means material removed, in um, normal to the flank in the transverse plane (ISO 21771), which is along the line
of action. Profile lengths are roll lengths in mm (differences of radii of curvature) and are counted from the tip for a
`TipRelief`, from the start of the active profile for a `RootRelief`.
"""

from .base import AbstractModification as AbstractModification
from .base import Flank as Flank
from .base import NoModification as NoModification
from .base import Scaled as Scaled
from .base import Sum as Sum
from .base import terms as terms
from .curves import AbstractCurve as AbstractCurve
from .curves import Linear as Linear
from .curves import Parabolic as Parabolic
from .curves import ParabolicLinear as ParabolicLinear
from .curves import Polynomial as Polynomial
from .curves import Power as Power
from .curves import Quadratic as Quadratic
from .curves import Sinusoidal as Sinusoidal
from .curves import Spline as Spline
from .profile import EndRelief as EndRelief
from .profile import LeadCrowning as LeadCrowning
from .profile import LeadSlope as LeadSlope
from .profile import ProfileCrowning as ProfileCrowning
from .profile import ProfileSlope as ProfileSlope
from .profile import RootRelief as RootRelief
from .profile import TipRelief as TipRelief
from .tabulated import TabulatedFlank as TabulatedFlank
from .tabulated import TabulatedProfile as TabulatedProfile
