"""Gears at speed: mesh force, oscillators, steady states over speed, orbits and their bifurcations."""

from .force import AbstractMeshForce as AbstractMeshForce
from .force import DeadZone as DeadZone
from .force import RectangularStiffness as RectangularStiffness
from .force_map import ForceMap as ForceMap
from .force_models import LoadedError as LoadedError
from .force_models import Tangent as Tangent
from .force_models import VaryingStiffness as VaryingStiffness
from .from_contact import mesh_force as mesh_force
from .motion import Motion as Motion
from .motion import motion as motion
from .oscillator import Excitation as Excitation
from .oscillator import Oscillator as Oscillator
from .quantities import DYNAMIC_QUANTITIES as DYNAMIC_QUANTITIES
from .quantities import mesh_frequency as mesh_frequency
from .response import SpeedResponse as SpeedResponse
from .settings import Dynamics as Dynamics
from .speed_sweep import speed_sweep as speed_sweep
from .speed_sweep import steps_for as steps_for
from .steady import SteadyNumbers as SteadyNumbers
from .systems import equivalent_mass as equivalent_mass
from .systems import inertia_of as inertia_of
from .systems import on_bearings as on_bearings
from .systems import torsional as torsional
from .systems import two_gears as two_gears
