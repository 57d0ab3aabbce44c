"""Shafts, bearings and housing that support a mesh: gap over its face, and load over its face.

shafts with sections, bearings, gears, couplings -> Gearbox with meshes and housing
-> bearing_reactions, elastic_line       displacements and forces
-> support(gearbox, mesh)                .influence(y) [um/N] and .gap(y) [um] over the face, for a contact
-> annex_e(support)                      line load and K_Hbeta with one mesh stiffness along the face
"""

from ..contact.support import AbstractSupport as AbstractSupport
from .face_load import FaceLoad as FaceLoad
from .face_load import annex_e as annex_e
from .face_load import face_load_factor as face_load_factor
from .face_load import mesh_stiffness as mesh_stiffness
from .face_load import root_face_load_factor as root_face_load_factor
from .face_load import tooth_height as tooth_height
from .gearbox import Gearbox as Gearbox
from .gearbox import GearMesh as GearMesh
from .housing import Housing as Housing
from .housing import condense as condense
from .housing import read_housing as read_housing
from .housing import spread_forces as spread_forces
from .housing import write_housing as write_housing
from .iso_method_c import iso_shaft_deflection as iso_shaft_deflection
from .iso_method_c import method_c as method_c
from .mesh_support import RigidSupport as RigidSupport
from .mesh_support import ShaftSupport as ShaftSupport
from .mesh_support import TabulatedSupport as TabulatedSupport
from .mesh_support import support as support
from .misalignment import Misalignment as Misalignment
from .misalignment import axis_tolerance as axis_tolerance
from .reactions import BearingReactions as BearingReactions
from .reactions import ElasticLine as ElasticLine
from .reactions import bearing_reactions as bearing_reactions
from .reactions import elastic_line as elastic_line
from .shaft import AbstractBearing as AbstractBearing
from .shaft import Bearing as Bearing
from .shaft import Coupling as Coupling
from .shaft import MatrixBearing as MatrixBearing
from .shaft import MountedGear as MountedGear
from .shaft import Section as Section
from .shaft import Shaft as Shaft
from .shaft import ShaftLoad as ShaftLoad
from .shaft import integral_diameter as integral_diameter
