"""The oscillator of a gear pair in plain arrays: what the baselines in C and SciPy integrate."""

from dataclasses import dataclass

import numpy as np

from jaxgear.dynamics import Oscillator
from jaxgear.dynamics.force_map import distances


@dataclass(frozen=True)
class Vibration:
    """One mass on the force of a mesh, mass x'' + damping x' + F(phase, x) = load.

    Attributes:
        mass, damping, load: [kg], [N s/um], [N].
        first_phase: mesh position with which the tables begin [base pitches].
        reach: dte of the last level beyond touching [um].
        start: where drive and coast flanks touch [um], shape (positions, 2).
        force, rise: at the levels of the DTE, and its slope over their number [N], shape (positions, 2, levels).
    """

    mass: float
    damping: float
    load: float
    first_phase: float
    reach: float
    start: np.ndarray
    force: np.ndarray
    rise: np.ndarray

    def places(self, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The tables at evenly spaced mesh positions from 0 to 1, shape (count + 1, ...): linear between their own."""
        positions = len(self.start)
        place = (np.arange(count + 1) / count - self.first_phase) * positions
        lower = np.floor(place).astype(int)
        share = place - lower

        def mixed(table):
            weight = share.reshape(-1, *(1,) * (table.ndim - 1))
            return (1 - weight) * table[lower % positions] + weight * table[(lower + 1) % positions]

        return mixed(self.start), mixed(self.force), mixed(self.rise)


def vibration_of(oscillator: Oscillator) -> Vibration:
    """Of a torsional oscillator on a force map."""
    of = oscillator.mesh_force
    rise = np.asarray(of.node_stiffness) * np.asarray(distances(of.reach, of.node_force.shape[-1]))
    numbers = oscillator.mass[0], oscillator.mesh_damping, oscillator.load[0], of.first_phase, of.reach
    tables = np.asarray(of.start).T, *(np.moveaxis(np.asarray(table), 0, 1) for table in (of.node_force, rise))
    return Vibration(*(float(number) for number in numbers), *tables)
