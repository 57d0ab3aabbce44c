"""Free functions on a `MeshCycle`: what the loaded mesh means for noise, strength and losses.

Those of `flank` take a prepared `Mesh` and the modifications instead: what has to be ground.
"""

from ..numerics.reductions import AbstractReduction as AbstractReduction
from ..numerics.reductions import Average as Average
from ..numerics.reductions import Harmonic as Harmonic
from ..numerics.reductions import Max as Max
from ..numerics.reductions import Min as Min
from ..numerics.reductions import Range as Range
from ..numerics.reductions import Rms as Rms
from ..numerics.reductions import Value as Value
from .face_load import edge_load_factor as edge_load_factor
from .face_load import face_load_factor as face_load_factor
from .face_load import face_load_factors as face_load_factors
from .face_load import root_face_load_factor as root_face_load_factor
from .flank import FlankSurface as FlankSurface
from .flank import flank_surface as flank_surface
from .flank import gear_volume as gear_volume
from .flank import max_relief as max_relief
from .flank import profile_relief as profile_relief
from .flank import relief_reversal as relief_reversal
from .flank import removed_at as removed_at
from .flank import removed_volume as removed_volume
from .flash import flash_temperature as flash_temperature
from .load import ContactShock as ContactShock
from .load import contact_shock as contact_shock
from .load import effective_contact_ratio as effective_contact_ratio
from .load import load_sharing as load_sharing
from .loss import loss_factor as loss_factor
from .loss import ohlendorf_loss_factor as ohlendorf_loss_factor
from .plausibility import Doubt as Doubt
from .plausibility import plausibility as plausibility
from .quantity import Quantity as Quantity
from .quantity import quantities as quantities
from .quantity import quantity_of as quantity_of
from .report import summary as summary
from .root_stress import RootFactors as RootFactors
from .root_stress import RootStress as RootStress
from .root_stress import root_factors as root_factors
from .root_stress import root_stress as root_stress
from .stiffness import secant_stiffness as secant_stiffness
from .transmission_error import Harmonics as Harmonics
from .transmission_error import harmonics as harmonics
from .transmission_error import peak_to_peak as peak_to_peak
from .transmission_error import smooth_peak_to_peak as smooth_peak_to_peak
from .vocabulary import mean_removed_material as mean_removed_material
