"""Unilateral contact of a few nonlinear springs, coupled, under one common approach.

For every position the unknowns are the line loads q[p, s] >= 0 of P springs in S slices and the common approach d:

    y[p, s] = sum_j C[p, j] q[j, s] + h_p(q[p, s]) + gap[p, s] - d >= 0,    q >= 0,    q y = 0,
    sum_{p, s} w[s] q[p, s] = load.

C is symmetric positive semi-definite and h increases, so this is the optimality condition of a strictly convex
programme: the solution exists and is unique. It is found by Newton's method on the active set; slices meet only in d,
so each step is P x P eliminations and one scalar equation. Derivatives of any order come from the implicit function
theorem at the final active set, never from the iteration.

All arrays keep the positions innermost and the P springs are unrolled: XLA then fuses a step into few loop nests.
"""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

Rows = list[Float[Array, "slices positions"]]


class ContactProblem(eqx.Module):
    """Data of the contact problem.

    Attributes:
        compliance: C, shape (pairs, pairs, positions).
        law: Module with `deflection(q)`; every leaf has shape (pairs, 1, positions).
        gap: shape (pairs, slices, positions).
        weight: width of each slice, shape (slices,).
        load: total load, scalar.
    """

    compliance: Float[Array, "pairs pairs positions"]
    law: eqx.Module
    gap: Float[Array, "pairs slices positions"]
    weight: Float[Array, " slices"]
    load: Float[Array, ""]


class ContactSolution(eqx.Module):
    """Line loads, common approach, what is left of the gaps, and how well the conditions hold.

    Attributes:
        line_load: q, shape (pairs, slices, positions).
        approach: d, shape (positions,).
        opening: y without the spring's own deflection, C q + gap - d, shape (pairs, slices, positions): the remaining gap
            where it is positive, minus the contact deflection h(q) where the spring is loaded.
        residual: largest violation of any condition, relative to the approach and to the load, shape (positions,).
    """

    line_load: Float[Array, "pairs slices positions"]
    approach: Float[Array, " positions"]
    opening: Float[Array, "pairs slices positions"]
    residual: Float[Array, " positions"]


def solve_contact(problem: ContactProblem, *, steps: int) -> ContactSolution:
    """Solves the contact problem with a fixed number of Newton steps.

    Args:
        problem: the data.
        steps: Newton steps; the residual tells whether they were enough.

    Returns:
        the solution; it is differentiable with respect to every leaf of `problem`. Where a spring is just touching the
        derivative is one-sided.
    """
    line_load, approach = _solve(steps, problem)
    rows = list(line_load)
    opening = jnp.stack([y - h for y, (h, _) in zip(_mismatch(problem, rows, approach), _law(problem, rows))])
    return ContactSolution(line_load, approach, opening, _residual(problem, line_load, approach))


def tangent_stiffness(problem: ContactProblem, solution: ContactSolution) -> Float[Array, " positions"]:
    """d load / d approach at the solution, for the springs in contact."""
    rows = list(solution.line_load)
    slopes = [slope for _, slope in _law(problem, rows)]
    active = _active(problem, rows, solution.approach)
    ones = [mask.astype(slope.dtype) for mask, slope in zip(active, slopes)]
    unit, _ = _eliminate(problem, slopes, active, ones, ones)
    return _total(problem, unit)


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _solve(steps: int, problem: ContactProblem):
    rows = [jnp.broadcast_to(problem.load / jnp.sum(problem.weight), gap.shape) for gap in problem.gap]
    active = _reachable(problem, rows)
    approach = jnp.zeros(problem.gap.shape[-1], problem.gap.dtype)
    for _ in range(steps):
        rows, approach = _newton(problem, rows, active)
        active = _active(problem, rows, approach)
    return jnp.stack(rows), approach


@_solve.defjvp
def _solve_jvp(steps, primals, tangents):
    (problem,), (problem_dot,) = primals, tangents
    line_load, approach = _solve(steps, problem)
    rows = list(line_load)

    def conditions(data):
        return _mismatch(data, rows, approach), _total(data, rows) - data.load

    (_, _), (mismatch_dot, total_dot) = jax.jvp(conditions, (problem,), (problem_dot,))
    slopes = [slope for _, slope in _law(problem, rows)]
    active = _active(problem, rows, approach)
    rows_dot, approach_dot = _balance(problem, slopes, active, [-dot for dot in mismatch_dot], -total_dot)
    return (line_load, approach), (jnp.stack(rows_dot), approach_dot)


def _newton(problem, rows, active):
    laws = _law(problem, rows)
    known = [-gap - (h - slope * q) for gap, (h, slope), q in zip(problem.gap, laws, rows)]
    slopes = [slope for _, slope in laws]
    rows, approach = _balance(problem, slopes, active, known, problem.load)
    return [jnp.maximum(q, 0.0) for q in rows], approach


def _balance(problem, slopes, active, known, load):
    """Solves (C + slope) q = known + d on the active rows, q = 0 on the others, together with sum w q = load."""
    ones = [mask.astype(k.dtype) for mask, k in zip(active, known)]
    unit, part = _eliminate(problem, slopes, active, ones, [jnp.where(m, k, 0.0) for m, k in zip(active, known)])
    approach = (load - _total(problem, part)) / _total(problem, unit)
    return [u * approach[None] + p for u, p in zip(unit, part)], approach


def _eliminate(problem, slopes, active, first, second) -> tuple[Rows, Rows]:
    """LDL^T solution of the active P x P systems for two right-hand sides, unrolled over the springs."""
    count = len(active)
    lower: dict[tuple[int, int], Array] = {}
    pivot: list[Array] = []
    a, b = list(first), list(second)
    for i in range(count):
        row = {}
        diagonal = jnp.where(active[i], problem.compliance[i, i][None] + slopes[i], 1.0)
        for j in range(i):
            entry = jnp.where(active[i] & active[j], problem.compliance[i, j][None], 0.0)
            for k in range(j):
                entry = entry - row[k] * lower[j, k]
            row[j] = entry
        for j in range(i):
            lower[i, j] = row[j] / pivot[j]
            diagonal = diagonal - row[j] * lower[i, j]
            a[i] = a[i] - lower[i, j] * a[j]
            b[i] = b[i] - lower[i, j] * b[j]
        pivot.append(diagonal)
    for i in reversed(range(count)):
        a[i], b[i] = a[i] / pivot[i], b[i] / pivot[i]
        for k in range(i + 1, count):
            a[i] = a[i] - lower[k, i] * a[k]
            b[i] = b[i] - lower[k, i] * b[k]
    return a, b


def _law(problem, rows) -> list[tuple[Array, Array]]:
    """Deflection and slope of every spring."""
    result = []
    for i, q in enumerate(rows):
        law = jax.tree.map(lambda leaf: leaf[i], problem.law)
        result.append(jax.jvp(law.deflection, (q,), (jnp.ones_like(q),)))
    return result


def _mismatch(problem, rows, approach) -> Rows:
    """y of every spring."""
    result = []
    for i, (h, _) in enumerate(_law(problem, rows)):
        elastic = h
        for j, q in enumerate(rows):
            elastic = elastic + problem.compliance[i, j][None] * q
        result.append(elastic + problem.gap[i] - approach[None])
    return result


def _total(problem, rows) -> Float[Array, " positions"]:
    return sum(jnp.sum(problem.weight[:, None] * q, axis=0) for q in rows)


def _active(problem, rows, approach) -> list[Array]:
    """Springs in contact. At zero load the one that touches first counts, so that the system stays regular."""
    slopes = [slope for _, slope in _law(problem, rows)]
    mismatch = _mismatch(problem, rows, approach)
    signal = [
        (problem.compliance[i, i][None] + slopes[i]) * rows[i] - mismatch[i] for i in range(len(rows))
    ]
    return _with_largest(signal, [s > 0 for s in signal])


def _reachable(problem, rows) -> list[Array]:
    """Springs that can be in contact: gaps wider than the approach of any one spring that bears the load alone cannot."""
    laws = _law(problem, rows)
    alone = [
        gap + h + problem.compliance[i, i][None] * q for i, (gap, (h, _), q) in enumerate(zip(problem.gap, laws, rows))
    ]
    bound = jnp.min(jnp.stack([jnp.max(a, axis=0) for a in alone]), axis=0)[None]
    signal = [bound - gap for gap in problem.gap]
    return _with_largest(signal, [s > 0 for s in signal])


def _with_largest(signal, active):
    largest = jnp.max(jnp.stack([jnp.max(s, axis=0) for s in signal]), axis=0)[None]
    return [mask | (s >= largest) for mask, s in zip(active, signal)]


def _residual(problem, line_load, approach) -> Float[Array, " positions"]:
    line_load, approach, problem = jax.lax.stop_gradient((line_load, approach, problem))
    rows = list(line_load)
    scale = jnp.max(jnp.abs(jnp.stack(_mismatch(problem, rows, jnp.zeros_like(approach)))) * (line_load > 0), axis=(0, 1))
    worst = jnp.zeros_like(approach)
    for q, y in zip(rows, _mismatch(problem, rows, approach)):
        violation = jnp.where(q > 0, jnp.abs(y), jnp.maximum(-y, 0.0))
        worst = jnp.maximum(worst, jnp.max(violation, axis=0))
    tiny = jnp.finfo(approach.dtype).tiny
    balance = jnp.abs(_total(problem, rows) - problem.load) / (jnp.abs(problem.load) + tiny)
    return jnp.maximum(worst / (scale + tiny), balance)
