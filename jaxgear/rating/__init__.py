"""Rating of a gear pair after ISO 6336: load factors, pitting and bending safeties, life.

oil = metrics.Lubricant(220.0, 19.0, 80.0, 0.6)
gear = GearRating("case_hardened", flank_roughness_rz=4.8, root_roughness_rz=20.0, quality_class=6)
found = rate(pair, 400.0, 1500.0, Rating(pinion=gear, wheel=gear, lubricant=oil, service_life=20_000.0))
found.pitting.safety, found.bending.safety
"""

from .chain import PairRating as PairRating
from .chain import rate as rate
from .findings import rating_findings as rating_findings
from .load_factors import LoadFactors as LoadFactors
from .mesh_geometry import MeshGeometry as MeshGeometry
from .mesh_geometry import mesh_geometry as mesh_geometry
from .settings import GearRating as GearRating
from .settings import Rating as Rating
