"""Gears, their pairing, the generated tooth outline and the path of contact, of external and internal involute pairs.

`drawn_gear` makes a gear from the tooth thickness and the diameters on its drawing.

Coordinates and signs used everywhere:

- the pinion drives, the wheel is driven, whatever their tooth numbers;
- a point on a flank is named by its roll length rho = sqrt(r^2 - r_b^2), the radius of curvature of the involute [mm];
  it stays smooth down to the base circle, where pressure angles do not;
- `path` s is the position along the line of action from the pitch point [mm], positive towards the pinion tip (recess):
  rho_pinion = rho_C,pinion + s, rho_wheel = rho_C,wheel - s;
- `phase` psi counts base pitches, psi = 0 with the reference pair at the pitch point: s = psi p_b;
- radii, roll lengths and the number of teeth of a ring gear are negative within the formulas (ISO 21771), which are
  those of external gears; what a user gives and reads as a diameter is positive;
- helical gears run in their transverse section; the contact at the face coordinate y lies y tan(beta_b) ahead on the
  path: s = psi p_bt + y tan(beta_b).
"""

from . import material as _material
from .backlash import pair_with_backlash as pair_with_backlash
from .bevel import BevelPair as BevelPair
from .bevel import VirtualGear as VirtualGear
from .bevel import virtual_load as virtual_load
from .bevel import virtual_pair as virtual_pair
from .drawing import ToothProfile as ToothProfile
from .drawing import drawn_gear as drawn_gear
from .drawing import with_profile as with_profile
from .gear import Gear as Gear
from .gear import check_external as check_external
from .gear import check_spur as check_spur
from .involute import diameter as diameter
from .involute import roll_angle as roll_angle
from .involute import roll_length as roll_length
from .involute import tooth_thickness as tooth_thickness
from .margins import Margins as Margins
from .margins import margins_between as margins_between
from .material import Material as Material
from .outline import Outline as Outline
from .outline import outline as outline
from .pair import GearPair as GearPair
from .pair import explain as explain
from .pair import explicit as explicit
from .pair import is_even as is_even
from .pair import margins as margins
from .pair import pair_geometry as pair_geometry
from .pair import path_of_contact as path_of_contact
from .path import PathOfContact as PathOfContact
from .path import reduced_radius as reduced_radius
from .rim_support import AbstractRimSupport as AbstractRimSupport
from .rim_support import ElasticFoundation as ElasticFoundation
from .rim_support import SupportArcs as SupportArcs
from .ring_gear import RingGear as RingGear
from .thickness import Measures as Measures
from .thickness import ToothThickness as ToothThickness
from .thickness import allowance_of_balls as allowance_of_balls
from .thickness import allowance_of_span as allowance_of_span
from .thickness import measures as measures
from .thickness import over_balls as over_balls
from .thickness import span as span
from .thickness import teeth_spanned as teeth_spanned
from .thickness import with_thickness as with_thickness

STEEL: Material


def __getattr__(name: str) -> Material:
    if name == "STEEL":  # made when it is asked for, see `material`
        return _material.STEEL
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
