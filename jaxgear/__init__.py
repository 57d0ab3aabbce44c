"""jaxgear: what a spur-gear flank modification does under load, and which one is best.

The pipeline in reading order, every step differentiable and vmappable:

    Gear, GearPair              geometry of an external involute spur pair
    TipRelief + LeadCrowning    microgeometry, composed with `+`
    default_compliance          teeth, gear bodies with coupled neighbours, Hertzian contact
    prepare, solve              loaded tooth contact over one base pitch -> MeshCycle
    peak_to_peak, ...           metrics on the MeshCycle
    monte_carlo                 what manufacturing tolerances make of it
    sweep                       any number of modifications -> SweepTable
    minimize, free_form         the best modification, by gradient and by other methods

The rest lives in the namespaces `jaxgear.geometry`, `compliance`, `contact`, `tolerance`, `conditions`, `metrics`,
`sizing`, `sweeps`, `optimize`, `plot` and `io`, with their `Abstract...` classes as extension points.

Units: mm for geometry, um for modifications and transmission error, N, N m (on the pinion), MPa, degrees in
constructors.
Importing jaxgear changes no JAX setting; switch on `jax_enable_x64` for double precision.
"""

import importlib
import importlib.metadata

from . import geometry as _geometry
from .compliance import Compliance as Compliance
from .compliance import default_compliance as default_compliance
from .compliance import legacy_compliance as legacy_compliance
from .conditions import LoadSpectrum as LoadSpectrum
from .contact import Mesh as Mesh
from .contact import MeshCycle as MeshCycle
from .contact import ModifiedMesh as ModifiedMesh
from .contact import Operation as Operation
from .contact import Resolution as Resolution
from .contact import fewest_pairs as fewest_pairs
from .contact import prepare as prepare
from .contact import solve as solve
from .contact import solve_at as solve_at
from .geometry import Gear as Gear
from .geometry import GearPair as GearPair
from .geometry import Material as Material
from .geometry import explain as explain
from .geometry import margins as margins
from .geometry import path_of_contact as path_of_contact
from .metrics import Quantity as Quantity
from .metrics import effective_contact_ratio as effective_contact_ratio
from .metrics import harmonics as harmonics
from .metrics import load_sharing as load_sharing
from .metrics import peak_to_peak as peak_to_peak
from .metrics import quantities as quantities
from .metrics import secant_stiffness as secant_stiffness
from .metrics import smooth_peak_to_peak as smooth_peak_to_peak
from .metrics import summary as summary
from .microgeometry import EndRelief as EndRelief
from .microgeometry import LeadCrowning as LeadCrowning
from .microgeometry import LeadSlope as LeadSlope
from .microgeometry import Linear as Linear
from .microgeometry import NoModification as NoModification
from .microgeometry import Parabolic as Parabolic
from .microgeometry import ParabolicLinear as ParabolicLinear
from .microgeometry import Polynomial as Polynomial
from .microgeometry import Power as Power
from .microgeometry import ProfileCrowning as ProfileCrowning
from .microgeometry import ProfileSlope as ProfileSlope
from .microgeometry import Quadratic as Quadratic
from .microgeometry import RootRelief as RootRelief
from .microgeometry import Sinusoidal as Sinusoidal
from .microgeometry import Spline as Spline
from .microgeometry import TabulatedFlank as TabulatedFlank
from .microgeometry import TabulatedProfile as TabulatedProfile
from .microgeometry import TipRelief as TipRelief
from .optimize import Constraint as Constraint
from .optimize import CVaR as CVaR
from .optimize import Mean as Mean
from .optimize import Quantile as Quantile
from .optimize import Worst as Worst
from .optimize import free_form as free_form
from .optimize import minimize as minimize
from .sizing import iso_relief as iso_relief
from .sizing import long_relief_length as long_relief_length
from .sizing import short_relief_length as short_relief_length
from .sweeps import FullFactorial as FullFactorial
from .sweeps import LatinHypercube as LatinHypercube
from .sweeps import Sobol as Sobol
from .sweeps import VariantList as VariantList
from .sweeps import monte_carlo as monte_carlo
from .sweeps import open_sweep as open_sweep
from .sweeps import sweep as sweep
from .tolerance import Tolerance as Tolerance

STEEL: Material
__version__: str

_LATE = ("io", "plot")  # what they import is not needed by anything else


def __getattr__(name: str):
    if name == "STEEL":  # made when it is asked for, see `jaxgear.geometry.material`
        return _geometry.STEEL
    if name == "__version__":
        return importlib.metadata.version(__name__)
    if name in _LATE:
        return importlib.import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
