"""Modifications as REXS has them: a sum of parts, each with an amount of its own."""

from collections.abc import Iterable, Iterator

import equinox as eqx
import numpy as np

from ...microgeometry import (
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
from ...numerics import real

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


def plain_terms(modification: AbstractModification, factor=None) -> Iterator[AbstractModification]:
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
    """Coefficients of a curve that is b1 d + b2 d^2, by their powers; None for any other, a user's own too."""
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
    """Modifications with one parabolic relief in place of the linear and the quadratic part that REXS has of it."""
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
