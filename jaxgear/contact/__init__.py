"""Loaded tooth contact: prepared meshes, unloaded gaps and the solution over one mesh cycle."""

from .component import ModifiedMesh as ModifiedMesh
from .cycle import MeshCycle as MeshCycle
from .cycle import removed_material as removed_material
from .cycle import solve as solve
from .cycle import solve_removed as solve_removed
from .mesh import Mesh as Mesh
from .mesh import Resolution as Resolution
from .mesh import fewest_pairs as fewest_pairs
from .mesh import prepare as prepare
