"""Dimensionless model of a gear pair: polynomial clearance, multiple scales, dynamic profile modification.

from_mesh (a pair's numbers) -> DimensionlessModel -> Oscillator, for every tool of `jaxgear.dynamics`
                                                  -> LoadedMean -> resonances in closed form
                                                  -> settled_vibration -> dynamic_profile_modification -> tip_relief
"""

from .clearance import PUBLISHED as PUBLISHED
from .clearance import PolynomialClearance as PolynomialClearance
from .model import DimensionlessForce as DimensionlessForce
from .model import DimensionlessModel as DimensionlessModel
from .model import Identified as Identified
from .model import dimensionless_model as dimensionless_model
from .model import from_mesh as from_mesh
from .model import rectangular_harmonics as rectangular_harmonics
from .model import with_relief as with_relief
from .multiple_scales import Backbone as Backbone
from .multiple_scales import LoadedMean as LoadedMean
from .multiple_scales import Resonance as Resonance
from .multiple_scales import combination_forcing as combination_forcing
from .multiple_scales import damping_threshold as damping_threshold
from .multiple_scales import effective_forcing as effective_forcing
from .multiple_scales import forced_amplitude as forced_amplitude
from .multiple_scales import frequency_shift as frequency_shift
from .multiple_scales import loaded_mean as loaded_mean
from .multiple_scales import parametric_instability as parametric_instability
from .multiple_scales import primary_resonance as primary_resonance
from .multiple_scales import response_curve as response_curve
from .multiple_scales import sub_harmonic_resonance as sub_harmonic_resonance
from .multiple_scales import super_harmonic_resonance as super_harmonic_resonance
from .optimum import DynamicModification as DynamicModification
from .optimum import OperatingCondition as OperatingCondition
from .optimum import dynamic_profile_modification as dynamic_profile_modification
from .optimum import modification_table as modification_table
from .optimum import operating_conditions as operating_conditions
from .optimum import settled_vibration as settled_vibration
from .relief import CycleRelief as CycleRelief
from .relief import cycle_relief as cycle_relief
from .relief import largest_relief as largest_relief
from .relief import tip_relief as tip_relief
