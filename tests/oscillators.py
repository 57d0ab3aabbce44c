"""Dimensionless oscillators whose orbits are known exactly, and those orbits: the ones of the benchmark."""

from benchmarks.dynamics.known import DEAD_ZONE as DEAD_ZONE
from benchmarks.dynamics.known import MORE_DAMPED as MORE_DAMPED
from benchmarks.dynamics.known import RECTANGULAR as RECTANGULAR
from benchmarks.dynamics.known import SHARE as SHARE
from benchmarks.dynamics.known import Known as Known
from benchmarks.dynamics.known import dead_zone as dead_zone
from benchmarks.dynamics.known import dead_zone_on_a_moving_base as dead_zone_on_a_moving_base
from benchmarks.dynamics.known import frequency as frequency
from benchmarks.dynamics.known import rectangular as rectangular
