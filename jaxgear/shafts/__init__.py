"""Shafts, bearings and housing under a mesh: what they make of the gap over its face, and of the load there."""

from .bearing import AbstractBearing as AbstractBearing
from .bearing import Bearing as Bearing
from .bearing import MatrixBearing as MatrixBearing
from .gearbox import Gearbox as Gearbox
from .gearbox import GearMesh as GearMesh
from .housing import Housing as Housing
from .misalignment import Misalignment as Misalignment
from .misalignment import axis_tolerance as axis_tolerance
from .reactions import BearingReactions as BearingReactions
from .reactions import ElasticLine as ElasticLine
from .reactions import bearing_reactions as bearing_reactions
from .reactions import elastic_line as elastic_line
from .reactions import with_and_without_housing as with_and_without_housing
from .shaft import Coupling as Coupling
from .shaft import MountedGear as MountedGear
from .shaft import Section as Section
from .shaft import Shaft as Shaft
from .shaft import ShaftLoad as ShaftLoad
from .shaft import integral_diameter as integral_diameter
from .support import AbstractSupport as AbstractSupport
from .support import RigidSupport as RigidSupport
from .support import ShaftSupport as ShaftSupport
from .support import support as support
