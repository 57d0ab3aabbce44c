"""Loaded tooth contact: prepared meshes, unloaded gaps and the solution over one mesh cycle."""

from .cycle import MeshCycle as MeshCycle
from .cycle import solve as solve
from .mesh import Mesh as Mesh
from .mesh import Resolution as Resolution
from .mesh import prepare as prepare
