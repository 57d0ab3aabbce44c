"""Steady states over speed with `scipy.integrate.solve_ivp`, as one would write it without a library for gears."""

from math import floor, sqrt

import numpy as np
from scipy.integrate import solve_ivp

from .vibration import Vibration

_FIRST_STEP = 0.3  # distance of the first two levels in that of evenly spaced ones
_NEWTON = 1e6
_MOST_PERIODS = 4
_CYCLES = 8  # per call
_APART = 30.0  # tolerances by which the cycles of an orbit of several differ
_SAMPLES = 512  # of a recorded cycle


class ScipySweep:
    """One design and one method with its relative tolerance."""

    def __init__(self, vibration: Vibration, method: str, tolerance: float):
        self._of, self._method, self._tolerance = vibration, method, tolerance
        # single numbers of nested lists are read in half the time that those of arrays take
        self._start, self._force, self._rise = (
            part.tolist() for part in (vibration.start, vibration.force, vibration.rise)
        )
        self._levels = vibration.force.shape[-1]

    def force(self, phase: float, q: float) -> float:
        """Force [N] at a mesh position and a DTE [um]."""
        of, count = self._of, len(self._start)
        place = (phase - of.first_phase) * count
        lower = floor(place)
        share = place - lower
        a, b = lower % count, (lower + 1) % count
        first, second = self._start[a], self._start[b]
        begin = (1 - share) * first[0] + share * second[0], (1 - share) * first[1] + share * second[1]
        drive = q >= 0.5 * (begin[0] - begin[1])
        closed = q - begin[0] if drive else -q - begin[1]
        if closed <= 0:
            return 0.0
        side = 0 if drive else 1
        part = closed / of.reach
        bend = (1 - _FIRST_STEP) / _FIRST_STEP**2
        if part < 1:
            level = 2 * part / (_FIRST_STEP * (1 + sqrt(1 + 4 * bend * part)))
        else:
            level = 1 + (part - 1) / (2 - _FIRST_STEP)
        level *= self._levels - 1
        below = min(int(level), self._levels - 2)
        ahead = level - below
        inside = min(ahead, 1.0)
        force, later, rise, late = (table[i][side] for table in (self._force, self._rise) for i in (a, b))
        low = (1 - share) * force[below] + share * later[below]
        jump = (1 - share) * force[below + 1] + share * later[below + 1] - low
        slope = (1 - share) * rise[below] + share * late[below]
        end = (1 - share) * rise[below + 1] + share * late[below + 1]
        cubic = slope + inside * (3 * jump - 2 * slope - end + inside * (slope + end - 2 * jump))
        found = low + inside * cubic + end * (ahead - inside)
        return found if drive else -found

    def speed(self, frequency: float, state, *, tolerance: float, most_cycles: int) -> np.ndarray:
        """K_v, rms of the DTE [um] and mesh cycles integrated, negative where it did not settle."""
        of, scale = self._of, np.array([1.0, 1 / (2 * np.pi * frequency)])

        def rate(t, y):
            x, v = y.tolist()
            return v, _NEWTON * (of.load - self.force(t * frequency, x) - of.damping * v) / of.mass

        states, cycle, period = [np.asarray(state, float)], 0, 0
        while cycle < most_cycles and not period:
            ends = (cycle + np.arange(1, _CYCLES + 1)) / frequency
            states += list(self._solved(rate, cycle / frequency, states[-1], ends, scale).T)
            cycle += _CYCLES
            period = _period(np.asarray(states) * scale, tolerance)
        count = period or _MOST_PERIODS
        times = (cycle + np.arange(1, count * _SAMPLES + 1) / _SAMPLES) / frequency
        x = self._solved(rate, cycle / frequency, states[-1], times, scale)[0]
        forces = [self.force(t * frequency, q) for t, q in zip(times, x)]
        return np.array([max(forces) / of.load, x.std(), (cycle + count) * (1 if period else -1)])

    def _solved(self, rate, begin, state, times, scale):
        options = {"method": self._method, "rtol": self._tolerance, "atol": self._tolerance / scale}
        return solve_ivp(rate, (begin, times[-1]), state, t_eval=times, **options).y


def _period(states: np.ndarray, tolerance: float) -> int:
    """Cycles after which the last state repeats, 0 for none."""
    nearest = np.inf
    for n in range(1, min(_MOST_PERIODS, len(states) - 1) + 1):
        away = np.abs(states[-1] - states[-1 - n]).max() / np.abs(states[-1]).max()
        if away < tolerance and nearest > _APART * tolerance:
            return n
        nearest = min(nearest, away)
    return 0
