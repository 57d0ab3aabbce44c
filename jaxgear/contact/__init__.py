"""Loaded tooth contact: prepared meshes, unloaded gaps and the solution over one mesh cycle."""

from .component import ModifiedMesh as ModifiedMesh
from .covering import fewest_pairs as fewest_pairs
from .covering import helical_slices as helical_slices
from .cycle import MeshCycle as MeshCycle
from .flank_table import flank_table as flank_table
from .kinematics import Kinematics as Kinematics
from .kinematics import Side as Side
from .mesh import Mesh as Mesh
from .mesh import prepare as prepare
from .operating_point import OperatingPoint as OperatingPoint
from .prescribed import PrescribedContact as PrescribedContact
from .prescribed import solve_at as solve_at
from .resolution import Resolution as Resolution
from .resolution import end_relief_widths as end_relief_widths
from .slide import RemovedMaterial as RemovedMaterial
from .solve import begin_contact as begin_contact
from .solve import removed_material as removed_material
from .solve import solve as solve
from .solve import solve_removed as solve_removed
from .status import Status as Status
from .support import AbstractSupport as AbstractSupport
