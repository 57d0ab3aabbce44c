"""Where branches of periodic orbits turn or lose stability, and how the turning points move."""

from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..numerics import Checked, kernel, real, result
from .corrector import Corrected, Family, Scales, change, corrected, family_of, held
from .orbit import Orbit
from .poincare import STEPS, nodes_of, scaled

Scalar = Float[Array, ""]
Kind = Literal["fold", "flip", "Neimark-Sacker"]

_REAL = 1e-6  # a multiplier with a smaller imaginary part is real
_LEVEL = 1e-8  # a branch whose tangent has a smaller part along the parameter stands still in it: rounding
_TRIALS = 40  # a fold is found in about eight
_FLAT = 1e-8  # slope of the parameter along a branch at a fold, both scaled
_NARROW = 1e-7  # distance along a branch, scaled, to which a fold is enclosed
_FIRST = 1e-3  # first step along a branch
_FURTHER, _FARTHEST = 1.5, 0.1  # factor on a secant that has not enclosed the fold, and the longest step


class Bifurcation(Checked):
    """An orbit at which a multiplier leaves or enters the unit circle.

    Attributes:
        kind: "fold" where the branch turns (multiplier +1), "flip" where the period doubles (-1), "Neimark-Sacker"
            where a pair of complex multipliers crosses the circle.
        parameter: of the family, for an oscillator the mesh frequency [Hz].
        orbit: there.
        direction: of the deviation that neither grows nor decays, in the unknowns of `Orbit.monodromy`, of length one;
            for a complex pair its real part.
    """

    kind: Kind
    parameter: Scalar = result()
    orbit: Orbit
    direction: Float[Array, " unknowns"] = result()


class Fold(Checked):
    """Result of `fold_of`.

    Attributes:
        parameter: at which the branch turns; for an oscillator the mesh frequency [Hz]; differentiable.
        displacement, velocity: start of the orbit there [um], [um/s], without derivatives, shape (coordinates,).
        slope: of the parameter over the branch, both scaled: zero at a fold, but not where the branch has a corner.
        converged: whether a fold was found.
    """

    parameter: Scalar = result()
    displacement: Float[Array, " coordinates"] = result("um")
    velocity: Float[Array, " coordinates"] = result("um/s")
    slope: Scalar = result()
    converged: Bool[Array, ""] = result()


class Tests(NamedTuple):
    """Numbers that change sign along a branch at a bifurcation; NaN where one does not apply."""

    fold: float
    flip: float
    neimark_sacker: float

    def crossed(self, other: "Tests") -> list[Kind]:
        """The kinds of bifurcation between two points."""
        kinds: tuple[Kind, ...] = ("fold", "flip", "Neimark-Sacker")
        return [kind for kind, here, there in zip(kinds, self, other) if here * there < 0]

    def of(self, kind: Kind) -> float:
        """The number of one kind."""
        return {"fold": self.fold, "flip": self.flip, "Neimark-Sacker": self.neimark_sacker}[kind]


def tests_of(point: Corrected, orbit: Orbit) -> Tests:
    """Test functions at a point of a branch."""
    multipliers = np.linalg.eigvals(np.asarray(orbit.monodromy))
    pairs = np.abs(multipliers[np.abs(multipliers.imag) > _REAL])
    level = float(point.tangent[-1])
    return Tests(
        fold=level if abs(level) > _LEVEL else float("nan"),
        flip=float(np.prod(1 + multipliers).real),
        neimark_sacker=float(pairs.max() - 1) if len(pairs) else float("nan"),
    )


def bifurcation_at(kind: Kind, parameter: Scalar, point: Corrected, orbit: Orbit) -> Bifurcation:
    """A located bifurcation with the direction of its deviation."""
    if kind == "fold":  # along the branch itself, where coordinates that turn freely have multipliers of one too
        direction = np.asarray(point.tangent[:-1])
    else:
        multipliers, vectors = np.linalg.eig(np.asarray(orbit.monodromy))
        outside = np.abs(multipliers + 1) if kind == "flip" else np.abs(np.abs(multipliers) - 1)
        if kind == "Neimark-Sacker":
            outside = np.where(np.abs(multipliers.imag) > _REAL, outside, np.inf)
        direction = vectors[:, np.argmin(outside)].real
    direction = direction / np.linalg.norm(direction)
    return Bifurcation(kind=kind, parameter=parameter, orbit=orbit, direction=jnp.asarray(direction))


def fold_of(oscillator: Any, near: Bifurcation, *, steps: Any = STEPS) -> Fold:
    """The fold next to one that was found, as a function of every number of the oscillator.

    The branch is followed across the fold to where its parameter is stationary. There the unknowns y of the orbit drop
    out to first order: with the change G(y, parameter, p) over the orbit and the left null vector of its derivative,
    psi dG/dy = 0 (the first rows of the system of Moore and Spence, SIAM J. Numer. Anal. 17 (1980) 567-576),

        d parameter / d p = -(psi dG/dp) / (psi dG/d parameter).

    It needs no second derivatives, which a force with a kink does not have. Derivatives of first order are exact;
    those of higher order are not.

    Args:
        oscillator: that moves, or a function of a parameter that gives an oscillator and a mesh frequency [Hz]; for
            derivatives a function that is an `equinox.Module` and holds what they are taken by.
        near: a fold of the same or a similar oscillator, from `Branch.bifurcations`.
        steps: of a mesh cycle, as for `find_orbit`.

    Raises:
        TypeError: for something else than an oscillator or a function.
        ValueError: for a bifurcation of another kind, or steps out of order.
    """
    if near.kind != "fold":
        raise ValueError(f'fold_of: near is a bifurcation of kind "{near.kind}", must be a fold')
    dtype = near.orbit.displacement.dtype
    parameter = real(near.parameter).astype(dtype)
    nodes = nodes_of("fold_of", steps)
    z = scaled(near.orbit.start, near.orbit.mesh_frequency)
    return _fold(family_of(oscillator), z, parameter, near.direction, nodes, near.orbit.periods)


@kernel
def _fold(family: Family, z, parameter, direction, nodes, periods: int) -> Fold:
    z, parameter, direction = held((z, parameter, direction))
    scales = Scales(jnp.linalg.norm(z), parameter)
    begin, normal = scales.place(z, parameter), jnp.append(direction, jnp.zeros_like(parameter))
    search = held(_turning(held(family), begin, normal, scales, held(nodes), periods))
    place = search.point.place

    def across(place, family):
        return change(family, place, scales, nodes, periods)

    unknowns = jax.jacfwd(lambda place: across(place, held(family)))(place)
    left = held(jnp.linalg.svd(unknowns[:, :-1])[0][:, -1])
    moved = jnp.sum(left * across(place, family)) / held(jnp.sum(left * unknowns[:, -1]))
    at, value = scales.unknowns(place)
    oscillator, frequency = held(family)(value)
    x, v = jnp.split(at, 2)
    return Fold(
        parameter=value - scales.parameter * (moved - held(moved)),
        displacement=x,
        velocity=v * 2 * jnp.pi * frequency,
        slope=search.slopes[1],
        converged=search.point.converged & search.found,
    )


class _Search(NamedTuple):
    """Two places on the branch, the distance to try next, and how far the search is."""

    point: Corrected
    distances: Scalar
    slopes: Scalar
    trial: Scalar
    bracketed: Bool[Array, ""]
    trials: Array

    @property
    def found(self) -> Bool[Array, ""]:
        """Whether a slope of zero has been met or enclosed; at the corner of a branch it can only be enclosed."""
        apart = jnp.abs(self.distances[1] - self.distances[0])
        return (self.trials > 1) & ((jnp.abs(self.slopes[1]) < _FLAT) | (self.bracketed & (apart < _NARROW)))


def _turning(family, place, normal, scales, nodes, periods) -> _Search:
    """Where the slope of the parameter over the distance along a normal is zero: false position (Illinois).

    Until the slope has changed its sign, secants that go somewhat too far.
    """

    def at(distance):
        point = corrected(family, place + distance * normal, normal, scales, nodes, periods)
        return point, point.tangent[-1] / jnp.sum(point.tangent * normal)

    def go_on(search):
        return ~search.found & search.point.converged & (search.trials < _TRIALS)

    def advance(search):
        point, slope = at(search.trial)
        other, last = search.distances
        old, newest = search.slopes
        # the new place and that across the zero from it; one that stays for a second time counts half
        stays = search.bracketed & (slope * newest > 0)
        distances = jnp.stack([jnp.where(stays, other, last), search.trial])
        slopes = jnp.stack([jnp.where(stays, 0.5 * old, newest), slope])
        bracketed = (slopes[0] * slopes[1] < 0) & (search.trials > 0)
        return _Search(
            point, distances, slopes, _next(distances, slopes, bracketed, search.trials), bracketed, search.trials + 1
        )

    zero = jnp.zeros((), place.dtype)
    nothing = Corrected(place, normal, zero, jnp.array(True))
    begin = _Search(nothing, jnp.stack([zero, zero]), jnp.stack([zero, zero]), zero, jnp.array(False), jnp.array(0))
    return jax.lax.while_loop(go_on, advance, begin)


def _next(distances, slopes, bracketed, trials) -> Scalar:
    """The distance to try after two slopes."""
    rise = slopes[1] - slopes[0]
    secant = -slopes[1] * (distances[1] - distances[0]) / jnp.where(rise == 0, 1.0, rise)
    ahead = jnp.where(bracketed, secant, jnp.clip(_FURTHER * secant, -_FARTHEST, _FARTHEST))
    return jnp.where(trials == 0, _FIRST, distances[1] + ahead)
