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

Units: mm for geometry, um for modifications and transmission error, N, N m (on the pinion), MPa, degrees in
    constructors.
Importing jaxgear changes no JAX setting; switch on `jax_enable_x64` for double precision.
"""

from . import geometry as _geometry
from .compliance import Beam as Beam
from .compliance import CenterDistance as CenterDistance
from .compliance import Compliance as Compliance
from .compliance import ConstantHertz as ConstantHertz
from .compliance import DepthReferenced as DepthReferenced
from .compliance import ElasticRing as ElasticRing
from .compliance import HalfPlane as HalfPlane
from .compliance import Kovalskii as Kovalskii
from .compliance import NonlinearPower as NonlinearPower
from .compliance import Palmgren as Palmgren
from .compliance import Sainsot as Sainsot
from .compliance import Weber as Weber
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
from .contact import removed_material as removed_material
from .contact import solve as solve
from .contact import solve_at as solve_at
from .contact import solve_removed as solve_removed
from .geometry import Gear as Gear
from .geometry import GearPair as GearPair
from .geometry import Margins as Margins
from .geometry import Material as Material
from .geometry import PathOfContact as PathOfContact
from .geometry import diameter as diameter
from .geometry import explain as explain
from .geometry import margins as margins
from .geometry import path_of_contact as path_of_contact
from .geometry import roll_angle as roll_angle
from .geometry import roll_length as roll_length
from .geometry import tooth_thickness as tooth_thickness
from .metrics import Quantity as Quantity
from .metrics import contact_shock as contact_shock
from .metrics import effective_contact_ratio as effective_contact_ratio
from .metrics import flash_temperature as flash_temperature
from .metrics import harmonics as harmonics
from .metrics import load_sharing as load_sharing
from .metrics import loss_factor as loss_factor
from .metrics import max_relief as max_relief
from .metrics import ohlendorf_loss_factor as ohlendorf_loss_factor
from .metrics import peak_to_peak as peak_to_peak
from .metrics import profile_relief as profile_relief
from .metrics import quantities as quantities
from .metrics import relief_reversal as relief_reversal
from .metrics import removed_volume as removed_volume
from .metrics import root_factors as root_factors
from .metrics import root_stress as root_stress
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
from .optimize import CMAES as CMAES
from .optimize import LBFGS as LBFGS
from .optimize import Adam as Adam
from .optimize import Constraint as Constraint
from .optimize import CVaR as CVaR
from .optimize import DifferentialEvolution as DifferentialEvolution
from .optimize import Factorial as Factorial
from .optimize import Front as Front
from .optimize import Genetic as Genetic
from .optimize import Iterate as Iterate
from .optimize import Limit as Limit
from .optimize import Mean as Mean
from .optimize import Minimax as Minimax
from .optimize import Optimum as Optimum
from .optimize import Pareto as Pareto
from .optimize import Problem as Problem
from .optimize import Projection as Projection
from .optimize import Quantile as Quantile
from .optimize import Worst as Worst
from .optimize import free_form as free_form
from .optimize import iterate_transmission_error as iterate_transmission_error
from .optimize import make_problem as make_problem
from .optimize import minimize as minimize
from .optimize import pareto as pareto
from .optimize import project as project
from .sizing import crowning_for_misalignment as crowning_for_misalignment
from .sizing import crowning_for_tolerance as crowning_for_tolerance
from .sizing import dynamic_relief as dynamic_relief
from .sizing import effective_relief as effective_relief
from .sizing import end_relief_amount as end_relief_amount
from .sizing import end_relief_length as end_relief_length
from .sizing import equivalent_misalignment as equivalent_misalignment
from .sizing import iso_crowning as iso_crowning
from .sizing import iso_end_relief as iso_end_relief
from .sizing import iso_relief as iso_relief
from .sizing import iso_stiffness as iso_stiffness
from .sizing import long_relief_length as long_relief_length
from .sizing import mesh_stiffness_relief as mesh_stiffness_relief
from .sizing import relief_amount as relief_amount
from .sizing import run_in_relief as run_in_relief
from .sizing import short_relief_length as short_relief_length
from .sweeps import FullFactorial as FullFactorial
from .sweeps import LatinHypercube as LatinHypercube
from .sweeps import Scatter as Scatter
from .sweeps import Sobol as Sobol
from .sweeps import SweepTable as SweepTable
from .sweeps import VariantList as VariantList
from .sweeps import monte_carlo as monte_carlo
from .sweeps import open_sweep as open_sweep
from .sweeps import sweep as sweep
from .tolerance import Deviation as Deviation
from .tolerance import GearDeviation as GearDeviation
from .tolerance import GearTolerance as GearTolerance
from .tolerance import Tolerance as Tolerance
from .tolerance import ToleranceClass as ToleranceClass
from .tolerance import TruncatedNormal as TruncatedNormal
from .tolerance import Uniform as Uniform
from .tolerance import deviated_material as deviated_material
from .tolerance import iso_rounded as iso_rounded
from .tolerance import sample_deviations as sample_deviations

STEEL: Material


def __getattr__(name: str):
    if name == "STEEL":  # made when it is asked for, see `jaxgear.geometry.material`
        return _geometry.STEEL
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
