"""Gears at speed: mesh force, oscillators, steady states over speed, orbits and their bifurcations."""

from .force import AbstractMeshForce as AbstractMeshForce
from .force import DeadZone as DeadZone
from .force import RectangularStiffness as RectangularStiffness
from .force_map import ForceMap as ForceMap
from .force_models import LoadedError as LoadedError
from .force_models import Tangent as Tangent
from .force_models import VaryingStiffness as VaryingStiffness
from .from_contact import mesh_force as mesh_force
from .oscillator import Excitation as Excitation
from .oscillator import Oscillator as Oscillator
