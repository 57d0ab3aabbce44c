"""Gears at speed: mesh force, oscillators, steady states over speed, orbits and their bifurcations."""

from .force import AbstractMeshForce as AbstractMeshForce
from .force import DeadZone as DeadZone
from .force import RectangularStiffness as RectangularStiffness
from .oscillator import Excitation as Excitation
from .oscillator import Oscillator as Oscillator
from .response import SpeedResponse as SpeedResponse
from .speed_sweep import speed_sweep as speed_sweep
from .speed_sweep import steps_for as steps_for
from .systems import equivalent_mass as equivalent_mass
from .systems import inertia_of as inertia_of
from .systems import on_bearings as on_bearings
from .systems import torsional as torsional
from .systems import two_gears as two_gears
