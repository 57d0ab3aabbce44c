"""Conversion of modifications to those of REXS, or to points of the flank for others.

Every point has its face coordinate, its diameter and its amount: three arrays of one length, which
cannot be misread. Points are denser where the flank is curved, so that the interpolation stays within a given error,
whether it is linear in the roll length, as this library does it, or in the diameter.
"""

from collections.abc import Iterable, Iterator

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from ..microgeometry import (
    AbstractCurve,
    AbstractModification,
    EndRelief,
    LeadCrowning,
    LeadSlope,
    Linear,
    NoModification,
    Parabolic,
    ParabolicLinear,
    Polynomial,
    Power,
    ProfileCrowning,
    ProfileSlope,
    Quadratic,
    RootRelief,
    Scaled,
    Sum,
    TabulatedFlank,
    TabulatedProfile,
    TipRelief,
)
from ..numerics import real
from .frame import Frame
from .model import Component

_SAME = 1e-6  # relative difference that files of fewer digits leave
# their amounts are proportional to what they remove
_PROPORTIONAL = (
    TipRelief,
    RootRelief,
    ProfileCrowning,
    ProfileSlope,
    LeadCrowning,
    LeadSlope,
    EndRelief,
    TabulatedProfile,
    TabulatedFlank,
)


def plain_terms(
    modification: AbstractModification, factor: Float[Array, "..."] | None = None
) -> Iterator[AbstractModification]:
    """The terms of a modification without sums and factors, except for factors of classes from outside the library."""
    if isinstance(modification, NoModification):
        return
    if isinstance(modification, Sum):
        for term in modification.terms:
            yield from plain_terms(term, factor)
    elif isinstance(modification, Scaled):
        yield from plain_terms(modification.modification, _product(factor, modification.factor))
    elif factor is None:
        yield modification
    elif isinstance(modification, _PROPORTIONAL) and type(modification) in _PROPORTIONAL:
        yield eqx.tree_at(lambda of: of.amount, modification, factor * modification.amount)
    else:
        yield Scaled(factor, modification)


def powers(curve: AbstractCurve) -> dict[int, float] | None:
    """Coefficients of a curve b1 d + b2 d^2, by power; None for other curves, also for those of users."""
    if not type(curve).__module__.startswith(AbstractCurve.__module__):
        return None
    match curve:
        case Linear():
            return {1: 1.0}
        case Parabolic():
            return {1: 0.44, 2: 0.56}
        case Power():
            return {int(curve.exponent): 1.0} if float(curve.exponent) in (1.0, 2.0) else None
        case ParabolicLinear():
            return {2: 1.0} if float(curve.node) == 1.0 else None
        case Quadratic():
            return _of_coefficients([curve.b0, curve.b1, curve.b2])
        case Polynomial():
            return _of_coefficients(curve.coefficients)
    return None


def joined(found: Iterable[AbstractModification]) -> list[AbstractModification]:
    """Modifications in which the linear and the quadratic part of a parabolic relief are one relief again."""
    result: list[AbstractModification] = []
    for term in found:
        if result and (one := _parabolic(result[-1], term)) is not None:
            result[-1] = one
        else:
            result.append(term)
    return result


def _parabolic(first: AbstractModification, second: AbstractModification) -> AbstractModification | None:
    if not (isinstance(first, TipRelief | RootRelief) and isinstance(second, type(first))):
        return None
    if powers(first.curve) != {1: 1.0} or powers(second.curve) != {2: 1.0}:
        return None
    amount = float(first.amount) + float(second.amount)
    linear = (powers(Parabolic()) or {})[1] * amount
    if not np.allclose(
        [float(first.length), float(first.amount)], [float(second.length), linear], rtol=_SAME, atol=0.0
    ):
        return None
    return type(first)(real(amount), first.length, Parabolic())


def _of_coefficients(coefficients) -> dict[int, float] | None:
    known = {power: float(value) for power, value in enumerate(coefficients) if float(value)}
    return known if set(known) <= {1, 2} else None


def _product(first, second):
    return second if first is None else first * second


_INSIDE = (0.25, 0.5, 0.75)  # of an interval: where its error is measured
_MOST = 2000  # lines along the profile, or across it; a relief of 20 um to 0.01 um needs about 100
_FEWEST = 9  # lines, before any are added
_POINTS = "topographical_modification_amounts"


def points(modification: AbstractModification, frame: Frame, error: float) -> tuple[np.ndarray, ...]:
    """Roll lengths [mm], face coordinates [mm] and amounts [um] of points whose interpolation keeps the error [um].

    Raises:
        ValueError: for a modification with a step.
    """
    known_roll, known_face = _knots(modification, frame)
    half, uneven = 0.5 * frame.width, modification.varies_along_face
    roll = _merged(np.linspace(frame.start, frame.tip, _FEWEST), known_roll)
    face = _merged(np.linspace(-half, half, _FEWEST), known_face) if uneven else np.array([-half, half])
    error = error / 2 if uneven else error  # the other half is for the other direction

    def along(rho):
        return _grid(modification, frame, rho, face).T

    roll = _refined(roll, along, [lambda rho: rho, frame.diameter], error)
    if uneven:
        face = _refined(face, lambda y: _grid(modification, frame, roll, y), [lambda y: y], error)
        roll = _refined(roll, along, [lambda rho: rho, frame.diameter], error)
    return roll, face, _grid(modification, frame, roll, face)


def flank_of(component: Component, frame: Frame) -> AbstractModification:
    """Modification of a component of type `topographical_modification`.

    Raises:
        DesignFileError: where the points are no grid, lie below the base circle, or are not interpolated linearly.
    """
    component.choice("type_of_interpolation_topographical_modification", "linear", ["linear"])
    if "diameters_of_topographical_modification" not in component.attributes:
        raise component.refuse("diameters_of_topographical_modification", "missing")
    diameter = component.numbers("diameters_of_topographical_modification", "mm")
    coordinate = component.numbers("coordinates_of_topographical_modification", "mm")
    amount = component.numbers(_POINTS, "mm", shift=3)
    if not len(diameter) == len(coordinate) == len(amount):
        given = f"{len(coordinate)} coordinates, {len(diameter)} diameters, {len(amount)} amounts"
        raise component.refuse(_POINTS, f"must be one per point, with its coordinate and diameter, not {given}")
    diameters, row = np.unique(diameter, return_inverse=True)
    coordinates, column = np.unique(frame.mirror * coordinate, return_inverse=True)
    roll = frame.roll_length(diameters)
    if np.isnan(roll).any():
        below = f"{diameters[0]:.9g} mm must be at least {2 * abs(frame.base_radius):.9g} mm, the base diameter"
        raise component.refuse("diameters_of_topographical_modification", below)
    grid = np.full((len(diameters), len(coordinates)), np.nan)
    grid[row, column] = amount
    if len(amount) != grid.size or np.isnan(grid).any() or len(diameters) < 2:
        wanted = "must be a full grid of at least 2 diameters, every point once"
        raise component.refuse(_POINTS, f"{wanted}: {len(amount)} points, {len(diameters)} x {len(coordinates)}")
    if frame.base_radius < 0:  # roll lengths of a ring gear grow inwards
        roll, grid = roll[::-1], grid[::-1]
    if (grid == grid[:, :1]).all():
        return TabulatedProfile(real(roll), real(grid[:, 0]))
    return TabulatedFlank(real(roll), real(coordinates), real(grid))


def _knots(modification: AbstractModification, frame: Frame) -> tuple[list[float], list[float]]:
    """Roll lengths and face coordinates at which a modification of the library has kinks."""
    if isinstance(modification, TipRelief):
        return [frame.tip - float(modification.length)], []
    if isinstance(modification, RootRelief):
        return [frame.start + float(modification.length)], []
    if isinstance(modification, EndRelief):
        start = 0.5 * frame.width - float(modification.length)
        return [], [-start, start]
    if isinstance(modification, TabulatedProfile):
        scale = 1.0 if modification.coordinate == "roll_length" else np.deg2rad(frame.base_radius)
        return list(scale * np.asarray(modification.position)), []
    if isinstance(modification, TabulatedFlank):
        return list(np.asarray(modification.roll_length)), list(np.asarray(modification.face_coordinate))
    return [], []


def _merged(places: np.ndarray, more: list[float]) -> np.ndarray:
    """Increasing places with `more` of them inside the range in place of their close neighbours."""
    low, high = places[0], places[-1]
    wanted = np.array([place for place in more if low < place < high])
    near = 1e-6 * (high - low)
    kept = [place for place in places[1:-1] if not len(wanted) or np.abs(wanted - place).min() > near]
    wanted = wanted[(wanted - low > near) & (high - wanted > near)]
    return np.unique(np.concatenate([[low], kept, wanted, [high]]))


def _refined(places: np.ndarray, values, scales, error: float) -> np.ndarray:
    """Places bisected until linear interpolation on every scale is within the error [um]."""
    doubtful = np.ones(len(places) - 1, bool)
    while doubtful.any():
        low, high = places[:-1][doubtful], places[1:][doubtful]
        if len(places) > _MOST or (high - low).min() < 1e-7 * (places[-1] - places[0]):
            raise ValueError(f"has a step, which no table shows to {error:g} um")
        at_low, at_high = values(low), values(high)
        worst = np.zeros(len(low))
        for share in _INSIDE:
            inside = low + share * (high - low)
            exact = values(inside)
            for scale in scales:
                along = (scale(inside) - scale(low)) / (scale(high) - scale(low))
                worst = np.maximum(worst, np.abs(at_low + along * (at_high - at_low) - exact).max(axis=0))
        still = worst > error
        middle = 0.5 * (low + high)[still]
        places, doubtful = _bisected(places, np.flatnonzero(doubtful)[still], middle)
    return places


def _bisected(places: np.ndarray, cells: np.ndarray, middle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places with the middles of some cells, and a mask of the new cells that are halves."""
    finer = np.insert(places, cells + 1, middle)
    return finer, np.isin(finer[:-1], middle) | np.isin(finer[1:], middle)


def _grid(modification: AbstractModification, frame: Frame, roll: np.ndarray, face: np.ndarray) -> np.ndarray:
    """Amounts of shape (roll lengths, face coordinates)."""
    along, across = np.meshgrid(roll, face, indexing="ij")
    return frame.removed(modification, along, across)
