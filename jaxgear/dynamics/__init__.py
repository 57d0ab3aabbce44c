"""Gears at speed: mesh force, oscillators, steady states over speed, orbits and their bifurcations."""

from .batch import speed_sweeps as speed_sweeps
from .bifurcation import Bifurcation as Bifurcation
from .bifurcation import Fold as Fold
from .bifurcation import fold_of as fold_of
from .continuation import Branch as Branch
from .continuation import follow_orbits as follow_orbits
from .force import AbstractMeshForce as AbstractMeshForce
from .force import DeadZone as DeadZone
from .force import RectangularStiffness as RectangularStiffness
from .orbit import Orbit as Orbit
from .orbit import find_orbit as find_orbit
from .orbit import settle as settle
from .orbit import steady_orbit as steady_orbit
from .orbit import steady_orbits as steady_orbits
from .oscillator import Excitation as Excitation
from .oscillator import Oscillator as Oscillator
from .response import SpeedResponse as SpeedResponse
from .run_up import RunUp as RunUp
from .run_up import run_up as run_up
from .speed_sweep import speed_sweep as speed_sweep
from .speed_sweep import steps_for as steps_for
from .systems import equivalent_mass as equivalent_mass
from .systems import inertia_of as inertia_of
from .systems import on_bearings as on_bearings
from .systems import torsional as torsional
from .systems import two_gears as two_gears
