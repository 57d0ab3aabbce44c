"""Orbits of a rectangular stiffness with contact loss in closed form: pieces of a damped oscillator and of free flight.

x'' + 2 zeta x' + k x = 1 with k = 0 out of contact; pieces end where the stiffness jumps and where x = 0.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq, fsolve

from .known import SHARE, stiffness

_SCAN = 64  # places of a piece between which a loss of contact, which ends the piece, is looked for
_ENDS = 1e-12  # of the time within a piece that lies past its begin, where x = 0 already
_CLOSED = 1e-11  # largest change of the state over an orbit
_GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(24)


@dataclass(frozen=True)
class ExactOrbit:
    """What the orbit does, to rounding.

    Attributes:
        x0, v0: at mesh position 0.
        rms: of the DTE about its mean.
        factor: largest force; the static one is 1.
        places: mesh positions at which contact is lost or made, of all cycles of the orbit, increasing.
    """

    x0: float
    v0: float
    rms: float
    factor: float
    places: np.ndarray


def exact_orbit(omega, near, *, zeta, ratio, periods=1) -> ExactOrbit:
    """The orbit next to a state, by Newton's method on the closed form.

    Raises:
        RuntimeError: where there is none.
    """
    cycle = 2 * np.pi / omega
    pair = tuple(float(k) for k in stiffness(ratio))

    def back(y):
        return _flown(y, cycle, pair, zeta, periods)[-1][-1] - y

    start, *_, message = fsolve(back, np.asarray(near, float), xtol=1e-14, full_output=True)
    if not np.abs(back(start)).max() <= _CLOSED:
        raise RuntimeError(f"exact_orbit: {message}")
    return _summary(start, _flown(start, cycle, pair, zeta, periods), cycle * periods, cycle, zeta)


def _flown(y, cycle, pair, zeta, periods):
    """Pieces (begin, duration, stiffness, state at the begin, state at the end) of some cycles."""
    pieces, y = [], np.asarray(y, float)
    for number in range(periods):
        for begin, end, k in ((0.0, SHARE, pair[0]), (SHARE, 1.0, pair[1])):
            time, until = (number + begin) * cycle, (number + end) * cycle
            while until - time > _ENDS * cycle:
                # x = 0 belongs to where the mass is going
                touching = y[0] > 0 or (y[0] == 0 and y[1] > 0)
                now = k if touching else 0.0
                length = _length(y, now, zeta, until - time)
                after = _moved(y, now, zeta, length)
                if length < until - time:
                    after[0] = 0.0
                pieces.append((time, length, now, y, after))
                time, y = time + length, after
    return pieces


def _length(y, k, zeta, longest):
    """Time to the next x = 0, or the longest."""
    times = longest * np.linspace(0.0, 1.0, _SCAN + 1)
    x = _moved(y, k, zeta, times)[0]
    if y[0] == 0:
        x[0] = np.sign(y[1]) * np.finfo(float).tiny
    passes = np.flatnonzero(x[:-1] * x[1:] < 0)
    for i in passes:
        low = times[i] if i or y[0] else times[1] * 1e-9
        if _moved(y, k, zeta, low)[0] * x[i + 1] < 0:
            return brentq(lambda t: _moved(y, k, zeta, t)[0], low, times[i + 1], xtol=1e-16, rtol=1e-15)
    return longest


def _moved(y, k, zeta, t):
    """State a time later within one piece, shape (2, ...)."""
    x, v = y
    fade = np.exp(-zeta * t)
    if k == 0:
        # v relaxes to the speed at which damping carries the load
        last = 1 / (2 * zeta)
        gone = np.exp(-2 * zeta * t)
        return np.array([x + last * t + (v - last) * (1 - gone) / (2 * zeta), last + (v - last) * gone])
    w = np.sqrt(k - zeta**2)
    a = x - 1 / k
    b = (v + zeta * a) / w
    c, s = np.cos(w * t), np.sin(w * t)
    return np.array([1 / k + fade * (a * c + b * s), fade * ((b * w - zeta * a) * c - (a * w + zeta * b) * s)])


def _summary(start, pieces, whole, cycle, zeta) -> ExactOrbit:
    first, second, factor, places = 0.0, 0.0, 0.0, []
    for begin, length, k, y, after in pieces:
        times = length * (_GAUSS + 1) / 2
        x, weights = _moved(y, k, zeta, times)[0], _WEIGHTS * length / 2
        first, second = first + weights @ x, second + weights @ x**2
        factor = max(factor, k * y[0], k * after[0], k * _highest(y, k, zeta, length))
        if after[0] == 0:
            places.append((begin + length) / cycle)
    mean = first / whole
    return ExactOrbit(*map(float, start), float(np.sqrt(second / whole - mean**2)), float(factor), np.asarray(places))


def _highest(y, k, zeta, length):
    """Largest x inside of a piece, at its ends if there is none."""
    times = length * np.linspace(0.0, 1.0, _SCAN + 1)
    v = _moved(y, k, zeta, times)[1]
    tops = np.flatnonzero((v[:-1] > 0) & (v[1:] <= 0))
    roots = (brentq(lambda t: _moved(y, k, zeta, t)[1], times[i], times[i + 1], xtol=1e-16) for i in tops)
    return max((_moved(y, k, zeta, t)[0] for t in roots), default=max(y[0], 0.0))
