"""Rating of a gear pair after ISO 6336: load factors, safeties of flank, root, scuffing and micropitting, life, losses.

oil = metrics.Lubricant(220.0, 19.0, 80.0, 0.6)
gear = GearRating("case_hardened", flank_roughness_rz=4.8, root_roughness_rz=20.0, quality_class=6)
rating = Rating(pinion=gear, wheel=gear, lubricant=oil, service_life=20_000.0)
found = rate(pair, 400.0, 1500.0, rating)
found.pitting.safety, found.bending.safety
thermal_rating(found, 400.0, 1500.0, rating).micropitting.bulk_temperature
"""

from .chain import PairRating as PairRating
from .chain import rate as rate
from .findings import rating_findings as rating_findings
from .load_factors import LoadFactors as LoadFactors
from .losses import splash_factor as splash_factor
from .mesh_geometry import MeshGeometry as MeshGeometry
from .mesh_geometry import mesh_geometry as mesh_geometry
from .quantities import RATING_QUANTITIES as RATING_QUANTITIES
from .settings import GearRating as GearRating
from .settings import Rating as Rating
from .thermal import ThermalRating as ThermalRating
from .thermal import thermal_rating as thermal_rating
from .thermal_quantities import THERMAL_QUANTITIES as THERMAL_QUANTITIES
