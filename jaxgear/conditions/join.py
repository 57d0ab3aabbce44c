"""How the numbers of all cases become one: by the measures of `jaxgear.numerics.risk`, in every engine the same.

A quantile is that of Harrell and Davis everywhere. It follows many values, so that its gradient does too, and of few
samples it scatters less than the value that happens to stand at the level; of many, both are the same number.
"""

from typing import Literal

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..numerics import AbstractMeasure, CVaR, Mean, Quantile, Worst

Better = Literal["smaller", "larger"]


def joined(measure: AbstractMeasure, values, weights, better: Better = "smaller") -> Float[Array, ""]:
    """One number for the values of many cases, with failed ones, NaN, beyond all others.

    Args:
        measure: how they are joined.
        values: of all cases, shape (cases,).
        weights: of the cases, shape (cases,).
        better: which values are the good ones: where large ones are, the worst is the smallest, and the 95 % quantile
            is what 95 % of the cases exceed.

    Returns:
        the number; infinite on the bad side where failed cases have a share in it.
    """
    sign = 1.0 if better == "smaller" else -1.0
    bad = jnp.where(jnp.isfinite(values), sign * values, jnp.inf)
    return sign * measure(bad, weights)


def ranked(measure: AbstractMeasure, values: np.ndarray, better: Better = "smaller") -> np.ndarray:
    """`joined` for many values of equal weight along the first axis, on the host."""
    count, sign = len(values), 1.0 if better == "smaller" else -1.0
    edges = jnp.arange(count + 1) / count
    shares = np.diff(np.asarray(measure.spread(edges, jnp.asarray(count, edges.dtype)))).astype(values.dtype)
    ordered = np.sort(np.where(np.isfinite(values), sign * values, np.inf), axis=0)
    carried = shares > 0
    # from the smallest on, so that equal values give that value to the last bit; it is infinite where all have failed
    smallest = np.where(np.isfinite(ordered[0]), ordered[0], 0.0).astype(values.dtype)
    return sign * (smallest + np.tensordot(shares[carried], ordered[carried] - smallest, 1))


def label(measure: AbstractMeasure) -> str:
    """Short name of a measure, as the columns of a table carry it: mean, worst, q95, cvar95."""
    match measure:
        case Quantile():
            return f"q{100 * float(measure.level):g}"
        case CVaR():
            return f"cvar{100 * float(measure.level):g}"
        case Mean() | Worst():
            return type(measure).__name__.lower()
    return type(measure).__name__


def in_words(measure: AbstractMeasure) -> str:
    """The measure before the name of what it measures: "mean", "95 % quantile of"."""
    match measure:
        case Quantile():
            return f"{100 * float(measure.level):g} % quantile of"
        case CVaR():
            return f"{100 * float(measure.level):g} % CVaR of"
    return label(measure)
