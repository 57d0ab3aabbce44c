"""Rating of a gear pair after ISO 6336: load factors, pitting and bending safeties, life."""

from .mesh_geometry import MeshGeometry as MeshGeometry
from .mesh_geometry import mesh_geometry as mesh_geometry
from .settings import GearRating as GearRating
from .settings import Rating as Rating
