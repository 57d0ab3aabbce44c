"""Interpolation between table points: piecewise linear, natural cubic, shape-preserving cubic.

Every curve is a cubic Hermite polynomial between neighbouring points; the methods differ in the slopes at the points.
Differentiable by values and positions.
"""

from collections.abc import Callable
from typing import Literal

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

Method = Literal["linear", "natural_cubic", "monotonic"]
Points = Float[Array, " points"]
Table = Float[Array, "points *columns"]


def interpolate(x: Float[Array, "..."], positions: Points, values: Points, method: Method) -> Float[Array, "..."]:
    """Value at x, of any shape; constant beyond the first and the last point.

    Args:
        x: places of interpolation.
        positions: increasing, at least 2.
        values: values at the positions.
        method: "linear", "natural_cubic" (natural cubic spline) or "monotonic" (no overshoot between the points).
    """
    return interpolate_columns(x, positions, values[:, None], method)(jnp.zeros_like(x, int))


def interpolate_columns(
    x: Float[Array, "..."], positions: Points, values: Table, method: Method
) -> Callable[[Int[Array, "..."]], Float[Array, "..."]]:
    """`interpolate` in every column of a table: a function from columns, which broadcast against x, to values there."""
    positions, values = positions.astype(x.dtype), values.astype(x.dtype)
    x = jnp.clip(x, positions[0], positions[-1])
    left = cell(x, positions)
    width = positions[left + 1] - positions[left]
    t = (x - positions[left]) / width
    if method == "linear":
        return lambda column: (1 - t) * values[left, column] + t * values[left + 1, column]
    slopes = (_natural_slopes if method == "natural_cubic" else _monotonic_slopes)(positions, values)

    def at(column):
        low, high = values[left, column], values[left + 1, column]
        start, end = slopes[left, column] * width, slopes[left + 1, column] * width
        rise = high - low
        return low + t * (start + t * (3 * rise - 2 * start - end + t * (start + end - 2 * rise)))

    return at


def cell(x: Float[Array, "..."], positions: Points) -> Int[Array, "..."]:
    """Number of the interval that contains x; the first or last one beyond the ends."""
    right = jnp.searchsorted(positions, jax.lax.stop_gradient(x), side="right", method="scan_unrolled")
    return jnp.clip(right - 1, 0, positions.shape[0] - 2)


def _natural_slopes(positions: Points, values: Table) -> Table:
    """Continuous curvature, none at the ends."""
    inverse = 1 / _widths(positions, values)
    secant = jnp.diff(values, axis=0) * inverse
    pull = 3 * secant * inverse
    flat = 1 / jnp.diff(positions)
    zero, one = jnp.zeros_like(flat[:1]), jnp.ones_like(flat[:1])
    right = jnp.concatenate([3 * secant[:1], pull[:-1] + pull[1:], 3 * secant[-1:]])
    return _tridiagonal(
        jnp.concatenate([zero, flat[:-1], one]),
        jnp.concatenate([2 * one, 2 * (flat[:-1] + flat[1:]), 2 * one]),
        jnp.concatenate([one, flat[1:], zero]),
        right,
    )


def _tridiagonal(below: Points, diagonal: Points, above: Points, right: Table) -> Table:
    """Solution of equations whose diagonal dominates, by elimination (see `dense` for why not by LAPACK)."""

    def forward(before, row):
        low, middle, high, value = row
        pivot = middle - low * before[0]
        return (here := (high / pivot, (value - low * before[1]) / pivot)), here

    def backward(after, row):
        return (here := row[1] - row[0] * after), here

    rows = below, diagonal, above, right
    _, eliminated = jax.lax.scan(forward, (jnp.zeros_like(above[0]), jnp.zeros_like(right[0])), rows)
    return jax.lax.scan(backward, jnp.zeros_like(right[0]), eliminated, reverse=True)[1]


def _monotonic_slopes(positions: Points, values: Table) -> Table:
    """Weighted harmonic mean of the neighbouring secants, zero where they differ in sign (Fritsch and Butland 1984,
    doi 10.1137/0905021); at the ends the three-point formula, limited so that the curve keeps the shape of the points
    (Moler 2004, Numerical Computing with MATLAB, 3.6)."""
    width = _widths(positions, values)
    secant = jnp.diff(values, axis=0) / width
    if secant.shape[0] == 1:
        return jnp.concatenate([secant, secant])
    before, after = secant[:-1], secant[1:]
    same = before * after > 0
    first, second = 2 * width[1:] + width[:-1], width[1:] + 2 * width[:-1]
    safe = [jnp.where(same, side, jnp.ones_like(side)) for side in (before, after)]
    mean = jnp.where(same, (first + second) / (first / safe[0] + second / safe[1]), jnp.zeros_like(before))
    start = _end_slope(width[:1], width[1:2], secant[:1], secant[1:2])
    end = _end_slope(width[-1:], width[-2:-1], secant[-1:], secant[-2:-1])
    return jnp.concatenate([start, mean, end])


def _end_slope(near, next_one, secant, next_secant):
    slope = ((2 * near + next_one) * secant - near * next_secant) / (near + next_one)
    turned = (jnp.sign(secant) != jnp.sign(next_secant)) & (jnp.abs(slope) > 3 * jnp.abs(secant))
    slope = jnp.where(turned, 3 * secant, slope)
    return jnp.where(jnp.sign(slope) == jnp.sign(secant), slope, jnp.zeros_like(slope))


def _widths(positions: Points, values: Table) -> Float[Array, "points-1 ..."]:
    """Widths of the intervals, along the first axis of the table."""
    return jnp.diff(positions).reshape(-1, *(1,) * (values.ndim - 1))
