"""Gears at speed: mesh force, oscillators, steady states over speed, orbits and their bifurcations."""

from .force import AbstractMeshForce as AbstractMeshForce
from .force import DeadZone as DeadZone
from .force import RectangularStiffness as RectangularStiffness
from .oscillator import Excitation as Excitation
from .oscillator import Oscillator as Oscillator
