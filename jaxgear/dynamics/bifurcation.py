"""Where branches of periodic orbits turn or lose stability: the kinds of these points, and how they are noticed."""

from collections.abc import Callable
from typing import Literal, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..numerics import Checked, result
from .corrector import Corrected
from .orbit import Orbit, outside

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
        parameter: of the family, for an oscillator the mesh frequency [Hz].
        orbit: there.
        direction: of the deviation that neither grows nor decays, in the unknowns of `Orbit.monodromy`, of length one;
            for a complex pair its real part.
    """

    kind: Kind
    parameter: Scalar = result()
    orbit: Orbit
    direction: Float[Array, " unknowns"] = result()


class Tests(NamedTuple):
    """Numbers of a point of a branch that tell bifurcations.

    Attributes:
        level: part of the tangent along the parameter, zero at a fold; NaN where the parameter stands still.
        doubling: zero at a flip.
        moduli: of the multipliers, the largest first.
    """

    level: float
    doubling: float
    moduli: np.ndarray

    def crossed(self, other: "Tests") -> dict[Kind, Callable[["Tests"], float]]:
        """The kinds of bifurcation between two points, and the number that is zero there.

        At a fold and at a flip one multiplier crosses the unit circle. Where two more have done so they are a pair:
        the moduli in order change continuously, whatever becomes of the pairs elsewhere.
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
    """A located bifurcation with the direction of its deviation; None where the multipliers are not of its kind."""
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
    """The multiplier of a bifurcation: +1, -1, or that of the pair nearest to the unit circle, above the real axis."""
    if kind != "Neimark-Sacker":
        return 1.0 if kind == "fold" else -1.0
    apart = np.where(multipliers.imag > _REAL, np.abs(np.abs(multipliers) - 1), np.inf)
    return complex(multipliers[np.argmin(apart)])
