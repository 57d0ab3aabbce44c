"""Unilateral contact of a few nonlinear springs, coupled, under one common approach.

For every position the unknowns are the line loads q[p, s] >= 0 of P springs in S slices and the common approach d:

    y[p, s] = sum_j C[p, j] q[j, s] + h_p(q[p, s]) + gap[p, s] - lever[p] d >= 0,    q >= 0,    q y = 0,
    sum_{p, s} lever[p] w[s] q[p, s] = load.

C is symmetric positive semi-definite and h increases, so this is the optimality condition of a strictly convex
programme: the solution exists and is unique. It is found by Newton's method on the active set; slices meet only in d,
so each step is P x P eliminations and one scalar equation. Derivatives of any order come from the implicit function
theorem at the final active set, never from the iteration.

All arrays keep the positions innermost and the P springs are unrolled: XLA then fuses a step into few loop nests.
"""

from functools import partial
from operator import itemgetter
from typing import NamedTuple

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
        lever: what a spring closes per unit of common approach, positive, shape (pairs, positions).
        weight: width of each slice, shape (slices,).
        load: total load, scalar.
    """

    compliance: Float[Array, "pairs pairs positions"]
    law: eqx.Module
    gap: Float[Array, "pairs slices positions"]
    lever: Float[Array, "pairs positions"]
    weight: Float[Array, " slices"]
    load: Float[Array, ""]


class ContactSolution(eqx.Module):
    """Line loads, common approach, what is left of the gaps, and how well the conditions hold.

    Attributes:
        line_load: q, shape (pairs, slices, positions).
        approach: d, shape (positions,).
        opening: y without the spring's own deflection, C q + gap - lever d, shape (pairs, slices, positions): the
            remaining gap where it is positive, minus the contact deflection h(q) where the spring is loaded.
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
    # a gap common to all springs only shifts the approach: without it light loads lose no digits to wide gaps
    common = jax.lax.stop_gradient(jnp.min(problem.gap / problem.lever[:, None], axis=(0, 1)))
    problem = eqx.tree_at(lambda p: p.gap, problem, problem.gap - (problem.lever * common[None])[:, None])
    line_load, approach = _solve(steps, problem)
    state = _evaluate(problem, list(line_load), approach)
    opening = jnp.stack([y - h for y, h in zip(state.mismatch, state.deflection)])
    return ContactSolution(line_load, approach + common, opening, _residual(problem, state, common))


def tangent_stiffness(problem: ContactProblem, solution: ContactSolution) -> Float[Array, " positions"]:
    """d load / d approach at the solution, for the springs in contact."""
    state = _evaluate(problem, list(solution.line_load), solution.approach)
    levers = _levers(problem, state)
    unit, _ = _eliminate(problem, state, levers, levers)
    return _total(problem, unit)


class _State(NamedTuple):
    """An iterate with everything that follows from it, a list over the springs in every field but one."""

    load: Rows
    approach: Float[Array, " positions"]
    deflection: Rows  # h
    slope: Rows  # dh/dq
    mismatch: Rows  # y
    active: Rows  # in contact


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _solve(steps: int, problem: ContactProblem):
    state = jax.lax.fori_loop(0, steps, lambda _, state: _newton(problem, state), _start(problem))
    return jnp.stack(state.load), state.approach


@_solve.defjvp
def _solve_jvp(steps, primals, tangents):
    (problem,), (problem_dot,) = primals, tangents
    line_load, approach = _solve(steps, problem)
    state = _evaluate(problem, list(line_load), approach)

    def conditions(data):
        return _mismatch(data, state.load, _deflection(data, state.load), approach), _total(
            data, state.load
        ) - data.load

    _, (mismatch_dot, total_dot) = jax.jvp(conditions, (problem,), (problem_dot,))
    load_dot, approach_dot = _balance(problem, state, [-dot for dot in mismatch_dot], -total_dot)
    return (line_load, approach), (jnp.stack(load_dot), approach_dot)


def _start(problem: ContactProblem) -> _State:
    """Equal loads on every spring that can be in contact at all.

    Gaps wider than the approach of any one spring that bears the load alone stay open.
    """
    load = [jnp.broadcast_to(problem.load / jnp.sum(problem.weight), gap.shape) for gap in problem.gap]
    state = _evaluate(problem, load, jnp.zeros(problem.gap.shape[-1], problem.gap.dtype))
    alone = [
        jnp.max(gap + h + problem.compliance[i, i][None] * q / problem.lever[i][None], axis=0) / problem.lever[i]
        for i, (gap, h, q) in enumerate(zip(problem.gap, state.deflection, load))
    ]
    bound = jnp.min(jnp.stack(alone), axis=0)
    signal = [(lever * bound)[None] - gap for lever, gap in zip(problem.lever, problem.gap)]
    return state._replace(active=_positive(signal, bound))


def _newton(problem: ContactProblem, state: _State) -> _State:
    """One Newton step on the active set, followed by the new set."""
    known = [-gap - (h - slope * q) for gap, h, slope, q in zip(problem.gap, state.deflection, state.slope, state.load)]
    load, approach = _balance(problem, state, known, problem.load)
    return _evaluate(problem, [jnp.maximum(q, 0.0) for q in load], approach)


def _evaluate(problem: ContactProblem, load: Rows, approach) -> _State:
    deflection, slope = jax.jvp(lambda rows: _deflection(problem, rows), (load,), ([jnp.ones_like(q) for q in load],))
    mismatch = _mismatch(problem, load, deflection, approach)
    signal = [(problem.compliance[i, i][None] + slope[i]) * load[i] - mismatch[i] for i in range(len(load))]
    return _State(load, approach, deflection, slope, mismatch, _positive(signal, approach))


def _positive(signal: Rows, approach) -> Rows:
    """Where the signal is positive; at zero load the largest counts, so that the system stays regular."""
    largest, smallest = (
        extreme(jnp.stack([extreme(s, axis=0) for s in signal]), axis=0) for extreme in (jnp.max, jnp.min)
    )
    # A compiler may evaluate the signal twice, for the maximum and for the comparison, with different rounding: without
    # this margin no spring at all might be left.
    size = jnp.maximum(jnp.abs(largest), jnp.abs(smallest)) + jnp.abs(approach)
    floor = jnp.minimum(largest - 8 * jnp.finfo(size.dtype).eps * size, 0.0)[None]
    return [s >= floor for s in signal]


def _balance(problem, state, known, load):
    """Solves (C + slope) q = known + lever d on the active rows, q = 0 on the others, with sum lever w q = load."""
    levers = _levers(problem, state)
    unit, part = _eliminate(problem, state, levers, [jnp.where(mask, k, 0.0) for mask, k in zip(state.active, known)])
    approach = (load - _total(problem, part)) / _total(problem, unit)
    return [u * approach[None] + p for u, p in zip(unit, part)], approach


def _eliminate(problem, state, first: Rows, second: Rows) -> tuple[Rows, Rows]:
    """LDL^T solution of the active P x P systems for two right-hand sides, unrolled over the springs."""
    active, slopes = state.active, state.slope
    count = len(active)
    lower: dict[tuple[int, int], Array] = {}
    pivot: list[Array] = []
    a, b = list(first), list(second)
    for i in range(count):
        row: dict[int, Array] = {}
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


def _deflection(problem, load: Rows) -> Rows:
    """h of every spring."""
    return [jax.tree.map(itemgetter(i), problem.law).deflection(q) for i, q in enumerate(load)]


def _mismatch(problem, load: Rows, deflection: Rows, approach) -> Rows:
    """y of every spring."""
    result = []
    for i, elastic in enumerate(deflection):
        for j, q in enumerate(load):
            elastic = elastic + problem.compliance[i, j][None] * q
        result.append(elastic + problem.gap[i] - (problem.lever[i] * approach)[None])
    return result


def _total(problem, load: Rows) -> Float[Array, " positions"]:
    return sum(lever * jnp.sum(problem.weight[:, None] * q, axis=0) for lever, q in zip(problem.lever, load))


def _levers(problem, state) -> Rows:
    """Levers of the springs in contact, zero elsewhere."""
    return [jnp.where(mask, lever[None], 0.0) for mask, lever in zip(state.active, problem.lever)]


def _residual(problem: ContactProblem, state: _State, common) -> Float[Array, " positions"]:
    """Largest violation; `common` is the part of the approach that has been taken out of the gaps."""
    problem, state = jax.lax.stop_gradient((problem, state))
    worst, scale = jnp.zeros_like(state.approach), jnp.abs(common)
    softest = jnp.zeros_like(state.approach)
    for i, (q, y, slope) in enumerate(zip(state.load, state.mismatch, state.slope)):
        closed = q > 0
        violation = jnp.where(closed, jnp.abs(y), jnp.maximum(-y, 0.0))
        closing = (problem.lever[i] * state.approach)[None]
        worst = jnp.maximum(worst, jnp.max(violation, axis=0))
        scale = jnp.maximum(scale, jnp.max(jnp.where(closed, jnp.abs(y + closing), 0.0), axis=0))
        softest = jnp.maximum(softest, problem.compliance[i, i] + jnp.max(slope, axis=0))
    tiny, eps = jnp.finfo(worst.dtype).tiny, jnp.finfo(worst.dtype).eps
    # the load that a rounding error of the approach makes, so that zero load is not measured against zero
    rounding = eps * jnp.abs(common) * jnp.sum(problem.weight) / softest
    balance = jnp.abs(_total(problem, state.load) - problem.load) / (jnp.abs(problem.load) + rounding + tiny)
    return jnp.maximum(worst / (scale + tiny), balance)
