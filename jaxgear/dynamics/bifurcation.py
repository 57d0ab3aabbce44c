"""Bifurcations of periodic orbits, where branches turn or lose stability: kinds and location."""

from collections.abc import Callable
from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..contact.status import Status, Statuses, WithStatus, status_of
from ..numerics import Checked, Numbers, kernel, real, result
from .orbit import Orbit, outside
from .oscillator import Oscillator
from .poincare import (
    STEPS,
    Corrected,
    Family,
    Place,
    Scales,
    change,
    corrected,
    family_of,
    first_direction,
    no_gradient,
    nodes_of,
    scaled,
)

Scalar = Float[Array, ""]
Kind = Literal["fold", "flip", "Neimark-Sacker"]

_REAL = 1e-6  # a multiplier with a smaller imaginary part is real
_LEVEL = 1e-8  # a branch whose tangent has a smaller part along the parameter stands still in it: rounding
_ON_CIRCLE = 1e-5  # largest distance from the unit circle of a located pair of multipliers


class Bifurcation(Checked):
    """An orbit at which a multiplier leaves or enters the unit circle.

    Attributes:
        kind: "fold" where the branch turns (multiplier +1), "flip" where the period doubles (-1), "Neimark-Sacker"
            where a pair of complex multipliers crosses the circle.
        parameter: parameter of the family; the mesh frequency [Hz] for an oscillator.
        orbit: orbit at the bifurcation.
        direction: unit vector of the critical deviation, which neither grows nor decays, in the unknowns of
            `Orbit.monodromy`; its real part for a complex pair.
    """

    kind: Kind
    parameter: Scalar = result()
    orbit: Orbit
    direction: Float[Array, " unknowns"] = result()


class Tests(NamedTuple):
    """Test functions of a point of a branch, whose changes indicate bifurcations.

    Attributes:
        level: component of the tangent along the parameter, zero at a fold; NaN if the parameter is constant.
        doubling: zero at a flip.
        moduli: moduli of the multipliers in descending order.
    """

    level: float
    doubling: float
    moduli: np.ndarray

    def crossed(self, other: "Tests") -> dict[Kind, Callable[["Tests"], float]]:
        """Kinds of bifurcation between two points, each with the test function that is zero at it.

        One multiplier crosses the unit circle at a fold and at a flip. Two further crossings are a complex pair: the
        sorted moduli change continuously, even where pairs form or separate.
        """
        found: dict[Kind, Callable[[Tests], float]] = {}
        if self.level * other.level < 0:
            found["fold"] = lambda tests: tests.level
        if self.doubling * other.doubling < 0:
            found["flip"] = lambda tests: tests.doubling
        here, there = (int(np.sum(outside(tests.moduli))) for tests in (self, other))
        if abs(there - here) - len(found) >= 2:
            second = max(here, there) - 1
            found["Neimark-Sacker"] = lambda tests: float(tests.moduli[second]) - 1
        return found


def tests_of(point: Corrected) -> Tests:
    """Test functions at a point of a branch."""
    multipliers = np.linalg.eigvals(np.asarray(point.monodromy))
    level = float(point.tangent[-1])
    return Tests(
        level=level if abs(level) > _LEVEL else float("nan"),
        doubling=float(np.prod(1 + multipliers).real),
        moduli=np.sort(np.abs(multipliers))[::-1],
    )


def bifurcation_at(kind: Kind, parameter: Scalar, point: Corrected, orbit: Orbit) -> Bifurcation | None:
    """Bifurcation at a located point, with its critical direction; None if the multipliers do not match the kind."""
    if kind == "fold":  # along the branch itself, where coordinates that turn freely have multipliers of one too
        direction = np.asarray(point.tangent[:-1])
    else:
        multipliers, vectors = np.linalg.eig(np.asarray(orbit.monodromy))
        which = int(np.argmin(np.abs(multipliers - critical(kind, multipliers))))
        apart = abs(abs(multipliers[which]) - 1)
        if kind == "Neimark-Sacker" and not (abs(multipliers[which].imag) > _REAL and apart < _ON_CIRCLE):
            return None
        direction = vectors[:, which].real
    direction = direction / np.linalg.norm(direction)
    return Bifurcation(kind=kind, parameter=parameter, orbit=orbit, direction=jnp.asarray(direction))


def critical(kind: Kind, multipliers: np.ndarray) -> complex:
    """Multiplier at the bifurcation: +1, -1, or the one with positive imaginary part nearest the unit circle."""
    if kind != "Neimark-Sacker":
        return 1.0 if kind == "fold" else -1.0
    apart = np.where(multipliers.imag > _REAL, np.abs(np.abs(multipliers) - 1), np.inf)
    return complex(multipliers[np.argmin(apart)])


_TRIALS = 40  # a bifurcation is found in about eight
_FLAT = 1e-8  # of the number that is zero at a bifurcation
_NARROW = 1e-7  # distance along a branch, scaled, to which a bifurcation is enclosed
_FIRST = 1e-3  # first step along a branch
_FURTHER, _FARTHEST = 1.5, 0.1  # factor on a secant that has not enclosed the bifurcation, and the longest step
# Half of the distance, as part of the size of an orbit, over which the growth of deviations is measured: what it
# leaves of the third derivative and of single precision is of the same size, 1e-5.
_ASIDE = 3e-3


class BifurcationPoint(WithStatus, Checked):
    """Result of `bifurcation_of`.

    Attributes:
        parameter: parameter at the bifurcation, differentiable; the mesh frequency [Hz] for an oscillator.
        displacement, velocity: start of the orbit at the bifurcation [um], [um/s], without derivatives, shape
            (coordinates,).
        test: value of the test function, which is zero at the bifurcation. For a fold it is the scaled slope of the
            parameter over the branch, not zero at a corner of the branch; for a flip the product of 1 + multiplier; for
            a Neimark-Sacker point the modulus of the pair minus 1.
        status: `converged` if a bifurcation was found.
    """

    parameter: Scalar = result()
    displacement: Float[Array, " coordinates"] = result("um")
    velocity: Float[Array, " coordinates"] = result("um/s")
    test: Scalar = result()
    status: Statuses = result()


def bifurcation_of(oscillator: Oscillator | Family, near: Bifurcation, *, steps: Numbers = STEPS) -> BifurcationPoint:
    """Locate the bifurcation of the same kind next to a known one, differentiable by every number of the oscillator.

    The branch is followed to a zero of the test function: the slope of the parameter at a fold, the distance of a
    multiplier from -1 at a flip, of a pair from the unit circle at a Neimark-Sacker point. With the equations
    E(y, parameter, p) of the bifurcation, which are the change of the unknowns y over the orbit and, but at a fold,
    the modulus of the critical multiplier, and the left null vector w of their derivative, w dE/dy = 0 (at a fold the
    first rows of the system of Moore and Spence, SIAM J. Numer. Anal. 17 (1980) 567-576), the orbit drops out:

        d parameter / d p = -(w dE/dp) / (w dE/d parameter).

    Of a multiplier mu with the eigenvectors phi and psi, psi phi = 1, d mu = psi d(M phi), where M phi is taken as the
    difference of two orbits on both sides along phi. So no second derivatives are needed, which a force with a kink
    does not have. Derivatives of first order are exact; those of higher order are not.

    Args:
        oscillator: oscillator, or a function of a parameter that returns an oscillator and a mesh frequency [Hz]; for
            derivatives an `equinox.Module` whose fields are the numbers to differentiate by.
        near: bifurcation of the same or a similar oscillator, from `Branch.bifurcations`.
        steps: steps of a mesh cycle, as for `find_orbit`.

    Raises:
        TypeError: for something else than an oscillator or a function, or than a bifurcation.
        ValueError: for steps out of order.
    """
    if not isinstance(near, Bifurcation):
        raise TypeError(f"near is of type {type(near).__name__}, must be a Bifurcation")
    dtype = near.orbit.displacement.dtype
    parameter = real(near.parameter).astype(dtype)
    nodes = nodes_of(steps)
    z = scaled(near.orbit.start, near.orbit.mesh_frequency)
    normal = jnp.append(near.direction, 0.0) if near.kind == "fold" else first_direction(len(z) + 1, dtype, 1.0)
    known = critical(near.kind, np.linalg.eigvals(np.asarray(near.orbit.monodromy)))
    multiplier = jnp.asarray(known, np.result_type(dtype, np.complex64) if isinstance(known, complex) else dtype)
    given = z, parameter, normal.astype(dtype), multiplier
    return _moved(family_of(oscillator), given, nodes, near.kind, near.orbit.periods)


@kernel
def _moved(family: Family, given, nodes, kind: Kind, periods: int) -> BifurcationPoint:
    z, parameter, normal, multiplier = no_gradient(given)
    scales = Scales(jnp.linalg.norm(z), parameter)
    begin = scales.place(z, parameter)
    search = no_gradient(
        _searched(no_gradient(family), kind, begin, normal, multiplier, scales, no_gradient(nodes), periods)
    )
    place = search.point.place
    pairs = no_gradient(_growing(search.point.monodromy, _critical(kind, search.point.monodromy, multiplier)))

    def equations(place, family):
        def over(place):
            return change(family, place, scales, nodes, periods)

        if kind == "fold":
            return over(place)
        growths = [left @ (over(place + by) - over(place - by)) / (2 * _ASIDE) for left, by in pairs]
        return jnp.append(over(place), sum(growths))

    unknowns = jax.jacfwd(lambda place: equations(place, no_gradient(family)))(place)
    left = no_gradient(_without(unknowns[:, :-1], unknowns[:, -1]))
    moved = left @ equations(place, family)
    at, value = scales.unknowns(place)
    _, frequency = no_gradient(family)(value)
    x, v = jnp.split(at, 2)
    return BifurcationPoint(
        parameter=value - scales.parameter * (moved - no_gradient(moved)) / no_gradient(left @ unknowns[:, -1]),
        displacement=x,
        velocity=v * 2 * jnp.pi * frequency,
        test=search.tests[1],
        status=status_of({Status.NOT_CONVERGED: ~(search.point.converged & search.enclosed)}),
    )


def _critical(kind: Kind, monodromy, near):
    """Critical multiplier of an orbit, the nearest one to a known multiplier."""
    if kind != "Neimark-Sacker":
        return near
    multipliers = jnp.linalg.eigvals(monodromy)
    return multipliers[jnp.argmin(jnp.abs(multipliers - near))]


def _growing(monodromy, multiplier):
    """Vectors of which the modulus of a multiplier is the sum of left M right, and places aside along the right ones.

    With the eigenvectors M phi = mu phi, psi M = mu psi and psi phi = 1 the modulus is Re(conj(mu) / |mu| psi M phi).
    """
    away = monodromy.astype(multiplier.dtype) - multiplier * jnp.eye(len(monodromy), dtype=multiplier.dtype)
    left, _, right = jnp.linalg.svd(away)
    left, right = left[:, -1].conj(), right[-1].conj()
    unit = multiplier / jnp.abs(multiplier).astype(multiplier.dtype)
    left = left * unit.conj() / (left @ right)
    pairs = (left.real, right.real), (-left.imag, right.imag)
    return [(one, jnp.append(_ASIDE * other, 0.0)) for one, other in pairs[: 2 if jnp.iscomplexobj(right) else 1]]


def _without(unknowns, along):
    """Combination of the equations that depends on the parameter but not on the unknowns."""
    left, sizes, _ = jnp.linalg.svd(unknowns)
    sizes = jnp.zeros(len(along), along.dtype).at[: len(sizes)].set(sizes)
    # squared, to suppress other directions; freely rotating coordinates add null vectors without the parameter
    rounding = 10 * jnp.finfo(along.dtype).eps ** 0.5 * jnp.max(sizes)
    combined = left @ ((along @ left) / (sizes**2 + rounding**2))
    return combined / jnp.linalg.norm(combined)


class _Search(NamedTuple):
    """State of the search: two places on the branch, next trial distance, and number of trials."""

    point: Corrected
    distances: Scalar
    tests: Scalar
    trial: Scalar
    bracketed: Bool[Array, ""]
    trials: Array

    @property
    def enclosed(self) -> Bool[Array, ""]:
        """True if a zero of the test function was found or enclosed; at a corner it can only be enclosed."""
        apart = jnp.abs(self.distances[1] - self.distances[0])
        return (self.trials > 1) & ((jnp.abs(self.tests[1]) < _FLAT) | (self.bracketed & (apart < _NARROW)))


def _searched(family: Family, kind: Kind, begin: Place, normal: Place, multiplier, scales, nodes, periods) -> _Search:
    """Search the zero of the test function of a kind along a normal, by false position (Illinois).

    Extended secants are used until the test function has changed its sign.
    """

    def at(distance):
        point = corrected(family, begin + distance * normal, normal, scales, nodes, periods)
        if kind == "fold":
            return point, point.tangent[-1] / jnp.sum(point.tangent * normal)
        if kind == "flip":
            return point, jnp.linalg.det(point.monodromy + jnp.eye(len(point.monodromy), dtype=normal.dtype))
        return point, jnp.abs(_critical(kind, point.monodromy, multiplier)) - 1

    def go_on(search):
        return ~search.enclosed & search.point.converged & (search.trials < _TRIALS)

    def advance(search):
        point, test = at(search.trial)
        other, last = search.distances
        old, newest = search.tests
        # the new place and that across the zero from it; one that stays for a second time counts half
        stays = search.bracketed & (test * newest > 0)
        distances = jnp.stack([jnp.where(stays, other, last), search.trial])
        tests = jnp.stack([jnp.where(stays, 0.5 * old, newest), test])
        bracketed = (tests[0] * tests[1] < 0) & (search.trials > 0)
        trial = _next(distances, tests, bracketed, search.trials)
        return _Search(point, distances, tests, trial, bracketed, search.trials + 1)

    zero = jnp.zeros((), begin.dtype)
    monodromy = jnp.eye(len(begin) - 1, dtype=begin.dtype)
    nothing = Corrected(begin, normal, monodromy, zero, jnp.array(True))
    start = _Search(nothing, jnp.stack([zero, zero]), jnp.stack([zero, zero]), zero, jnp.array(False), jnp.array(0))
    return jax.lax.while_loop(go_on, advance, start)


def _next(distances, tests, bracketed, trials) -> Scalar:
    """Next trial distance from two values of the test function."""
    rise = tests[1] - tests[0]
    secant = -tests[1] * (distances[1] - distances[0]) / jnp.where(rise == 0, 1.0, rise)
    ahead = jnp.where(bracketed, secant, jnp.clip(_FURTHER * secant, -_FARTHEST, _FARTHEST))
    return jnp.where(trials == 0, _FIRST, distances[1] + ahead)
