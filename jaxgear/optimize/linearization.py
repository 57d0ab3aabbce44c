"""Quantities of a design in every case, with their slopes over the unit box."""

from collections.abc import Callable, Sequence
from functools import reduce
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..conditions import solved
from ..metrics import Analysis, Quantity

Vector = Float[Array, " parameters"]
Either = Array | np.ndarray  # traced, and taken to the host for a linear program


class Pieces(NamedTuple):
    """Piecewise linear value in every case, max(upper) - min(lower), with slopes over the unit box.

    Attributes:
        upper: values of the upper pieces, shape (cases, pieces); their slopes are `slope`, shape (cases, pieces,
            parameters).
        lower: values of the lower pieces, with slopes `lower_slope`; None for a value max(upper).
    """

    upper: Float[Either, "cases pieces"]
    slope: Float[Either, "cases pieces parameters"]
    lower: Float[Either, "cases pieces"] | None = None
    lower_slope: Float[Either, "cases pieces parameters"] | None = None

    @property
    def value(self) -> Float[Either, " cases"]:
        """Value in every case, max(upper) - min(lower), shape (cases,)."""
        top = self.upper.max(axis=1)
        return top if self.lower is None else top - self.lower.min(axis=1)

    def scaled(self, scale: Either | float, offset: Either | float) -> "Pieces":
        """Pieces of (value - offset) / scale, with a positive scale."""
        return Pieces(
            (self.upper - offset) / scale,
            self.slope / scale,
            None if self.lower is None else self.lower / scale,
            None if self.lower_slope is None else self.lower_slope / scale,
        )


class Linearization(NamedTuple):
    """Piecewise linear objectives and constraints at a point.

    Attributes:
        objectives: pieces of every objective.
        limits: pieces of the relative excess over every limit.
        fine: True if all contact solutions have converged and all values and slopes are finite.
    """

    objectives: tuple[Pieces, ...]
    limits: tuple[Pieces, ...]
    fine: Bool[Either, ""]


class Sloped(NamedTuple):
    """Values that a quantity reduces, with their slopes.

    Attributes:
        values: values, shape (..., values).
        slopes: slopes of the values over the unit box, shape (..., values, parameters).
    """

    values: Float[Array, "... values"]
    slopes: Float[Array, "... values parameters"]


def pieces_of(quantity: Quantity, sloped: Sloped, sign: int) -> Pieces:
    """Pieces of `sign` times a quantity, leading axis (cases,); exact if the quantity is made of extremes."""
    values, slopes = sloped
    factors = quantity.reduction.factors(sign)
    if factors is None:
        number, gradient = jax.vmap(jax.value_and_grad(quantity.reduction))(values)
        slope = jnp.einsum("cv,cvp->cp", gradient, slopes)
        return Pieces(sign * number[:, None], sign * slope[:, None])
    above, below = factors
    if below == 0:
        return Pieces(above * values, above * slopes)
    return Pieces(above * values, above * slopes, below * values, below * slopes)


def local_slopes(
    quantities: Sequence[Quantity], solve: Callable[[Any], Analysis], removed_of: Callable[..., Any], x: Vector
) -> tuple[list[Sloped], Bool[Array, ""]]:
    """Values and slopes of local quantities, and True if the contact has converged.

    The value of a local quantity at a position depends only on the material removed at that position: one gradient of
    the contact analysis, for the sum over the positions, gives the slopes at all positions.

    Args:
        quantities: local quantities.
        solve: function that analyses material removed.
        removed_of: function that returns the material removed at a point of the unit box, fields of shape (pairs,
            slices or 1, positions).
        x: point of the unit box, shape (parameters,).
    """

    def material(x):
        removed = removed_of(x)
        return removed, removed

    def curves(removed):
        analysis = solve(removed)
        each = [quantity.values(analysis) for quantity in quantities]
        each = [values.reshape(-1, values.shape[-1]) for values in each]
        return jnp.concatenate(each), (each, solved(analysis.cycle))

    slope, removed = jax.jacfwd(material, has_aux=True)(x)
    rows, back, (each, fine) = jax.vjp(curves, removed, has_aux=True)
    if len(rows) == 1:
        (share,) = back(jnp.ones_like(rows))
        slopes = _along(share, slope, "isp,ispx->px")[None]
    elif len(rows) <= len(x):
        chosen = jnp.broadcast_to(jnp.eye(len(rows), dtype=rows.dtype)[:, :, None], (len(rows), *rows.shape))
        (share,) = jax.vmap(back)(chosen)
        slopes = _along(share, slope, "kisp,ispx->kpx")
    else:  # fewer parameters than rows

        def along(direction):
            return jax.jvp(lambda removed: curves(removed)[0], (removed,), (direction,))[1]

        slopes = jax.vmap(along, in_axes=-1, out_axes=-1)(slope)
    ends = np.cumsum([len(values) for values in each])
    return [
        Sloped(values.ravel(), part.reshape(-1, len(x))) for values, part in zip(each, jnp.split(slopes, ends[:-1]))
    ], fine


def _along(share, slope, axes: str) -> Float[Array, "... positions parameters"]:
    """Derivatives by the parameters from the derivatives by the fields of the material removed (chain rule)."""
    each = [jnp.einsum(axes, *both) for both in zip(jax.tree.leaves(share), jax.tree.leaves(slope))]
    return reduce(jnp.add, each)


def any_slopes(
    quantities: Sequence[Quantity], analyze: Callable[[Vector], Analysis], x: Vector
) -> tuple[list[Sloped], Bool[Array, ""]]:
    """Values and slopes of any quantities at a point that `analyze` takes, and True if the contact has converged."""

    def numbers(x):
        analysis = analyze(x)
        each = [quantity.values(analysis).ravel() for quantity in quantities]
        return jnp.concatenate(each), (each, solved(analysis.cycle))

    count = jax.eval_shape(numbers, x)[0].shape[0]
    differentiate = jax.jacrev if count <= x.shape[0] else jax.jacfwd
    slopes, (each, fine) = differentiate(numbers, has_aux=True)(x)
    found, start = [], 0
    for values in each:
        found.append(Sloped(values, slopes[start : start + len(values)]))
        start += len(values)
    return found, fine
