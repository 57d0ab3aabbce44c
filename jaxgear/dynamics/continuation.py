"""Branches of periodic orbits over a parameter, followed through folds by their arclength."""

from collections.abc import Callable
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
import scipy  # its packages load when they are used
from jaxtyping import Array, Bool, Complex, Float

from ..numerics import Checked, Given, Numbers, check, kernel, program, real, result, whole
from .bifurcation import Bifurcation, Kind, Tests, bifurcation_at, tests_of
from .orbit import Orbit, orbit_at
from .oscillator import Oscillator, State
from .poincare import (
    STEPS,
    Corrected,
    Family,
    OverSpeed,
    Place,
    Scales,
    corrected,
    family_of,
    first_direction,
    nodes_of,
    scaled,
    steps_at,
)

Scalar = Float[Array, ""]
Ended = Literal["range", "points", "closed", "joined", "lost"]

# Control of the steps along a branch: a corrector of few evaluations makes them longer, one of many shorter.
_FEW, _MANY = 4, 7
_LONGER, _SHORTER = 1.4, 0.6
_TURN = 0.95  # least cosine of the angle between neighbouring tangents
_SHORTEST = 1e-3  # of the first step; shorter ones turn with the corner of a branch, however sharp
_LONGEST = 4.0
_LOCATED = 1e-6  # part of a step to which a bifurcation is located


class Branch(Checked):
    """Periodic orbits along a branch, stable and unstable, in the order in which it was followed.

    Attributes:
        parameter: parameter of the family, shape (points,); the mesh frequency [Hz] for an oscillator.
        orbits: orbits, every array with the leading axis (points,).
        bifurcations: bifurcations in the order of the branch; `before` gives their places.
        before: index of the first point after every bifurcation.
        ended: reason for the end of the branch: "range" (the parameter reached an end of its range), "points" (largest
            number of points), "closed" (the branch returned to its start), "joined" (it reached the branch of orbits of
            half the period), "lost" (Newton's method failed).
    """

    parameter: Float[Array, " points"] = result()
    orbits: Orbit
    bifurcations: tuple[Bifurcation, ...]
    before: tuple[int, ...]
    ended: Ended

    @property
    def mesh_frequency(self) -> Float[Array, " points"]:
        """Mesh frequency of every orbit [Hz]."""
        return self.orbits.mesh_frequency

    @property
    def multipliers(self) -> Complex[Array, "points unknowns"]:
        """Floquet multipliers of every orbit."""
        return self.orbits.multipliers

    @property
    def stable(self) -> Bool[Array, " points"]:
        """True for every stable orbit."""
        return self.orbits.stable


def follow_orbits(
    oscillator: Oscillator | Family,
    start: Orbit | Bifurcation,
    *,
    within: tuple[float, float],
    direction: Literal["up", "down"] = "up",
    parameter: Given | None = None,
    step: float = 0.02,
    points: int = 500,
    steps: Numbers = STEPS,
    callback: Callable[[int, Orbit], None] | None = None,
) -> Branch:
    """Follow a branch of periodic orbits through its folds until the parameter leaves a range.

    Pseudo-arclength continuation: a step along the tangent, then Newton's method across it. Steps grow and shrink with
    the work of Newton's method. Between points at which a multiplier has crossed the unit circle the bifurcation is
    located. The loop runs on the host; its points share one compiled function.

    Args:
        oscillator: oscillator, followed over its mesh frequency; or a function of a parameter that returns an
            oscillator and a mesh frequency [Hz].
        start: orbit on the branch; or a flip of another branch, from which orbits of twice the period branch off.
        within: smallest and largest parameter.
        direction: direction of the parameter at the start; ignored for a start at a flip.
        parameter: parameter at the start, if a function and an orbit are given; None for the mesh frequency of the
            orbit.
        step: first step along the branch, relative to the parameter and to the size of the orbit.
        points: largest number of points.
        steps: steps of a mesh cycle, as for `find_orbit`.
        callback: called with the number of every point and its orbit.

    Raises:
        TypeError: if an argument is not an oscillator, a function or a start.
        ValueError: for a bifurcation other than a flip as start, a start outside the range, or a number out of its
            range.
    """
    if direction not in ("up", "down"):
        raise ValueError(f'direction = {direction!r} must be "up" or "down"')
    check("step", real(step), "", low=0.0, open_low=True, high=1.0)
    whole("points", points, 2)
    follower = _Follower(family_of(oscillator), start, within, direction, parameter, nodes_of(steps))
    return follower.followed(float(step), points, callback)


class _Follower:
    """The state of a host loop along one branch."""

    def __init__(self, family, start, within, direction, parameter, nodes):
        flip = isinstance(start, Bifurcation)
        if flip and start.kind != "flip":
            raise ValueError(f'start is a bifurcation of kind "{start.kind}", must be a flip')
        orbit = start.orbit if isinstance(start, Bifurcation) else start
        if not isinstance(orbit, Orbit):
            raise TypeError(f"start is of type {type(start).__name__}, must be an Orbit or a flip")
        if parameter is not None and (flip or isinstance(family, OverSpeed)):
            raise ValueError("parameter belongs to a function of it that starts from an orbit")
        given = start.parameter if flip else orbit.mesh_frequency if parameter is None else parameter
        self.family, self.periods = family, orbit.periods * (2 if flip else 1)
        dtype = orbit.displacement.dtype
        self.nodes, at = nodes, real(given).astype(dtype)
        self.low, self.high = (float(end) for end in within)
        check("parameter of the start", at, "", low=self.low, high=self.high)
        self.scales, place, ahead = _first(orbit.start, orbit.mesh_frequency, at, direction == "up")
        self.point, self.orbit = self.at(place, ahead)
        if not bool(self.point.converged):
            raise ValueError("there is no orbit of the branch near the start")
        if flip:
            self.point = self.point._replace(tangent=jnp.append(start.direction, 0.0).astype(dtype))
        self.begin, self.tests = self.point, tests_of(self.point)
        self.kept, self.bifurcations, self.before = [self.orbit], [], []
        self.parameters = [at]

    def at(self, guess, normal) -> tuple[Corrected, Orbit]:
        return _point(self.family, guess, normal, self.scales, self.nodes, self.periods)

    def along(self, distance) -> tuple[Corrected, Orbit]:
        """Corrected point at a distance along the tangent."""
        return self.at(self.point.place + distance * self.point.tangent, self.point.tangent)

    def followed(self, step: float, points: int, callback) -> Branch:
        shortest, longest = _SHORTEST * step, _LONGEST * step
        ended: Ended = "points"
        while len(self.kept) < points:
            point, orbit = self.along(step)
            turn = float(jnp.sum(point.tangent * self.point.tangent))
            if not bool(point.converged) or (turn < _TURN and step > shortest):
                if step <= shortest:
                    ended = "lost"
                    break
                step = max(0.5 * step, shortest)
                continue
            if not self.low <= self.parameter(point) <= self.high:
                self.take_last(point)
                ended = "range"
                break
            if len(self.kept) > 1 and _joins(self.orbit, orbit):  # the first may be the flip itself
                ended = "joined"
                break
            self.note(point, orbit, step)
            closed = len(self.kept) > 3 and self.passes_begin(point, step)
            self.take(point, orbit)
            if callback is not None:
                callback(len(self.kept), orbit)
            if closed:
                ended = "closed"
                break
            evaluations = int(point.evaluations)
            factor = _LONGER if evaluations <= _FEW else _SHORTER if evaluations >= _MANY else 1.0
            step = min(max(factor * step, shortest), longest)
        return self.branch(ended)

    def parameter(self, point: Corrected) -> float:
        return float(self.scales.unknowns(point.place)[1])

    def take(self, point: Corrected, orbit: Orbit) -> None:
        tests = tests_of(point)
        # where the parameter stands still, the direction that it had
        self.tests = tests._replace(level=self.tests.level) if np.isnan(tests.level) else tests
        self.point, self.orbit = point, orbit
        self.kept.append(orbit)
        self.parameters.append(self.scales.unknowns(point.place)[1])

    def take_last(self, beyond: Corrected) -> None:
        """Add the point at the end of the range."""
        end = self.low if self.parameter(beyond) < self.low else self.high
        here, there = float(self.point.place[-1]), float(beyond.place[-1])
        target = end / float(self.scales.parameter)
        guess = self.point.place + (target - here) / (there - here) * (beyond.place - self.point.place)
        guess = guess.at[-1].set(target)
        sign = 1.0 if there > here else -1.0
        point, orbit = self.at(guess, first_direction(len(guess), guess.dtype, sign))
        if bool(point.converged):
            self.take(point, orbit)

    def passes_begin(self, point: Corrected, step: float) -> bool:
        apart = float(jnp.linalg.norm(point.place - self.begin.place))
        return apart < step and float(jnp.sum(point.tangent * self.begin.tangent)) > 0

    def note(self, point: Corrected, orbit: Orbit, step: float) -> None:
        """Locate the bifurcations up to the next point."""
        tests = tests_of(point)
        found = [self.located(kind, test, tests, step) for kind, test in self.tests.crossed(tests).items()]
        for _, bifurcation in sorted(found, key=lambda item: item[0]):
            if bifurcation is not None:
                self.bifurcations.append(bifurcation)
                self.before.append(len(self.kept))

    def located(
        self, kind: Kind, test: Callable[[Tests], float], beyond: Tests, step: float
    ) -> tuple[float, Bifurcation | None]:
        """A bifurcation before the next point, and its distance.

        By Brent's method, which halves the distance where the branch has a corner, at which the tangent jumps.
        """
        known = {0.0: test(self.tests), step: test(beyond)}

        def at(distance: float) -> float:
            return known[distance] if distance in known else test(tests_of(self.along(distance)[0]))

        middle = scipy.optimize.brentq(at, 0.0, step, xtol=_LOCATED * step)
        point, orbit = self.along(middle)
        return middle, bifurcation_at(kind, self.scales.unknowns(point.place)[1], point, orbit)

    def branch(self, ended: Ended) -> Branch:
        orbits = jax.tree.map(lambda *parts: jnp.asarray(np.stack(parts)), *self.kept)
        return Branch(
            parameter=jnp.asarray(np.stack(self.parameters)),
            orbits=orbits,
            bifurcations=tuple(self.bifurcations),
            before=tuple(self.before),
            ended=ended,
        )


@program
def _first(start: State, frequency: Scalar, parameter: Scalar, up: bool) -> tuple[Scales, Place, Place]:
    """Scales of a branch, and the place of its first orbit with the direction in which the parameter changes."""
    z = scaled(start, frequency)
    scales = Scales(jnp.linalg.norm(z), jnp.maximum(jnp.abs(parameter), 1e-30))
    return scales, scales.place(z, parameter), first_direction(len(z) + 1, z.dtype, 1.0 if up else -1.0)


@kernel
def _point(family, guess, normal, scales: Scales, nodes, periods: int) -> tuple[Corrected, Orbit]:
    point = corrected(family, guess, normal, scales, nodes, periods)
    z, parameter = scales.unknowns(point.place)
    oscillator, frequency = family(parameter)
    steps = steps_at(oscillator, nodes)
    return point, orbit_at(oscillator, z, steps, frequency, periods, monodromy=point.monodromy)


def _joins(here: Orbit, there: Orbit) -> bool:
    """True if an orbit of half the period lies between two neighbouring orbits: their halves are exchanged."""
    return here.periods % 2 == 0 and float(np.dot(_odd(here), _odd(there))) < 0


def _odd(orbit: Orbit) -> np.ndarray:
    """DTE and scaled DTE rate at the start of an orbit, minus their values half an orbit later [um]."""
    scale = 2 * np.pi * float(orbit.mesh_frequency)
    halves = (np.split(np.asarray(part), 2) for part in (orbit.dte, orbit.dte_rate / scale))
    return np.array([first[0] - second[0] for first, second in halves])
