"""Unilateral contact of a few nonlinear springs, coupled, under one common approach.

For every position the unknowns are the line loads q[p, s] >= 0 of P springs in S slices and the common approach d:

    y[p, s] = sum_j C[p, j] q[j, s] + h_p(q[p, s]) + gap[p, s] - lever[p] d >= 0,    q >= 0,    q y = 0,
    sum_{p, s} lever[p] w[s] q[p, s] = load.

C is symmetric positive semi-definite and h increases, so this is the optimality condition of a strictly convex
programme: the solution exists and is unique. It is found by Newton's method on the active set; slices meet only in d,
so each step is P x P eliminations and one scalar equation, and where they are coupled (`coupling`) a small dense
system at every position. Derivatives of any order come from the implicit function
theorem at the final active set, never from the iteration. Where d is prescribed instead of the load, the scalar
equation drops out and everything else stays.

The iterate v holds the load of every spring in contact, and of every other one minus the load that would open it as far
as it is open: its sign is the active set. All arrays keep the positions innermost and the P springs of an elimination
are unrolled, so that a compiler fuses a step into few loops; their laws are evaluated together, which halves a program
and takes no longer. Intermediate results that several loops need end with a division: compilers store those, but
evaluate cheaper expressions again in every loop.
"""

from dataclasses import replace
from functools import partial, reduce
from operator import add
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .contact_problem import (
    LOAD_FLOOR,
    ContactProblem,
    ContactSolution,
    active_of,
    carried_by,
    deflections_under,
    secants_under,
    slopes_under,
)
from .coupling import (
    Active,
    CoupledFactors,
    Curve,
    Inverse,
    Load,
    Rows,
    Slopes,
    couple,
    inverse_of,
    pressed_by,
    stiffness,
    with_inverse,
)
from .implicit import jvp_of_given
from .safe import unit

Matrix = Float[Array, "springs springs #slices positions"]


def eliminable(problem: ContactProblem) -> ContactProblem:
    """Problem with the quantities that all of its eliminations share."""
    if problem.coupling is None:
        return problem
    return eqx.tree_at(lambda p: p.coupling, problem, with_inverse(problem.coupling))


class Factors(NamedTuple):
    """The system of the active springs, eliminated.

    Attributes:
        inverse: inverse of C + slope, of every slice on its own; zero where springs are apart.
        per_slope: load per opening of every spring, about.
        coupled: what couples the slices.
    """

    inverse: Inverse
    per_slope: Slopes
    coupled: CoupledFactors | None


def eliminate(problem: ContactProblem, active: Active, slope: Slopes) -> Factors:
    """Eliminates the active springs of an `eliminable` problem.

    Args:
        problem: the data.
        active: True for springs in contact, (slices, positions) each.
        slope: slope of the springs.
    """
    inverse, per_slope = inverse_of(problem.compliance, active, slope)
    if problem.coupling is None:
        return Factors(inverse, per_slope, None)
    inverse = [[x / unit(x) for x in row] for row in inverse]  # read by several loops
    return Factors(inverse, per_slope, couple(problem.coupling, problem.weight, problem.lever, inverse))


class Response(NamedTuple):
    """Line loads and common approach of a linear system, and the further loads on the slices."""

    load: Rows
    approach: Curve
    pressed: Rows


def respond(
    problem: ContactProblem,
    factors: Factors,
    known: Rows,
    *,
    load: Load | None = None,
    approach: Curve | None = None,
) -> Response:
    """Solves deflection + slope x load = known + lever x approach on the active springs.

    Args:
        problem: the data.
        factors: factors from `eliminate`.
        known: right side; it does not count where springs are apart.
        load: total load; None where the approach is given.
        approach: None where the load is given.
    """
    within = _times(factors.inverse, known)
    if factors.coupled is None:
        rigid = _times(factors.inverse, list(problem.lever))
        if approach is None:
            assert load is not None  # one of both is given
            approach = (load - total(problem, within)) / total(problem, rigid)
        pressed = [lever * approach[None] for lever in problem.lever]
        return Response([row + x * approach[None] for row, x in zip(within, rigid)], approach, pressed)
    kept = unit(factors.inverse[0][0])
    within = [row / kept for row in within]
    pressed, approach = pressed_by(factors.coupled, within, load=load, approach=approach)
    pressed = [row / kept for row in pressed]
    added = _times(factors.inverse, pressed)
    return Response([row + more for row, more in zip(within, added)], approach, pressed)


def _times(matrix: Inverse | Matrix, rows: Slopes) -> Rows:
    return [reduce(add, [x * row for x, row in zip(each, rows)]) for each in matrix]


def left_after(problem: ContactProblem, found: Response, before: Rows) -> Rows:
    """Opening after a linearized step that adds the loads of `found` to those with the opening `before`."""
    own = _times(problem.compliance, found.load)
    return [y + start - pressed for y, start, pressed in zip(own, before, found.pressed)]


def load_per_approach(problem: ContactProblem, factors: Factors) -> Curve:
    """d load / d approach of the active springs."""
    if factors.coupled is not None:
        return stiffness(factors.coupled)
    return total(problem, _times(factors.inverse, list(problem.lever)))


def opening(problem: ContactProblem, load: Rows, approach: Curve) -> Rows:
    """Remaining gap y of every spring, without its own deflection."""
    return [y + gap for y, gap in zip(without_gap(problem, load, approach), problem.gap)]


def without_gap(problem: ContactProblem, load: Rows, approach: Curve) -> Rows:
    """Part of `opening` that load and approach cause: deflection - lever d, without the initial gap."""
    deflected = _times(problem.compliance, load)
    if problem.coupling is not None:
        further = problem.coupling.deflection(problem.weight, problem.lever, load)
        deflected = [own + more for own, more in zip(deflected, further)]
    return [row - lever * approach[None] for row, lever in zip(deflected, problem.lever)]


def total(problem: ContactProblem, load: Rows) -> Curve:
    """Total load of the line loads, times lever and slice width."""
    return jnp.sum(problem.weight[:, None] * sum(lever * q for lever, q in zip(problem.lever, load)), axis=0)


# Iterations for the load of a spring on its own at a prescribed approach.
_OWN_STEPS = 3
# Newton steps in single precision before those in the precision of the problem. The first one, with the secants under
# the loads of the start, finds most of the active set; of two more most positions are within single precision.
_NEAR_STEPS = 3
# Residual of a solution where the caller does not choose. In double precision that is a tenth of a femtometre on an
# approach of 10 um.
_TOLERANCE = {jnp.dtype(jnp.float32): 5e-6, jnp.dtype(jnp.float64): 1e-11}


def solve_contact(problem: ContactProblem, *, steps: int, tolerance: float | None = None) -> ContactSolution:
    """Solves the contact problem by at most a given number of Newton steps.

    Args:
        problem: the data.
        steps: largest number of Newton steps; the residual tells whether they were enough.
        tolerance: residual at which the iteration ends; None for 1e-11 in double and 5e-6 in single precision.

    Returns:
        the solution; it is differentiable with respect to every leaf of `problem`. Where a spring is just touching the
        derivative is one-sided. Loads and their derivatives are exactly zero where a prescribed approach closes no gap.
    """
    # a gap common to all springs only shifts the approach: without it light loads lose no digits to wide gaps
    tolerance = _TOLERANCE[problem.gap.dtype] if tolerance is None else tolerance
    closing = problem.gap / problem.lever
    common = jax.lax.stop_gradient(jnp.min(closing, axis=(0, 1)))
    problem = eqx.tree_at(lambda p: p.gap, problem, problem.lever * (closing - common[None, None]))
    if problem.approach is not None:
        problem = eqx.tree_at(lambda p: p.approach, problem, problem.approach - common)
    v, approach, residual = _solve(steps, tolerance, problem, common)
    load = carried_by(v)
    return ContactSolution(
        line_load=jnp.stack(load),
        approach=approach + common,
        load=total(problem, load),
        opening=jnp.stack(opening(problem, load, approach)),
        in_contact=jnp.stack(active_of(problem, v)),
        residual=residual,
        converged=residual < tolerance,
    )


def tangent_stiffness(problem: ContactProblem, solution: ContactSolution) -> Curve:
    """d load / d approach at the solution, for the springs in contact."""
    load = list(solution.line_load)
    slope = slopes_under(problem, load, secants_under(problem, load))
    return load_per_approach(problem, eliminate(eliminable(problem), list(solution.in_contact), slope))


@partial(jax.custom_jvp, nondiff_argnums=(0, 1))
def _solve(steps: int, tolerance: float, problem: ContactProblem, common: Curve) -> tuple[Rows, Curve, Curve]:
    """Iterate v, approach and residual; `common` is the part that was subtracted from all gaps."""
    if problem.known is not None:
        load, left, approach = jax.lax.stop_gradient(problem.known)
        return list(jnp.where(load > 0, load, -left)), approach - common, jnp.zeros_like(common)
    problem = eliminable(problem)
    single = _cast(problem, jnp.float32)
    v, approach = _cast(_near(single), common.dtype)
    approach = approach if problem.approach is None else problem.approach
    return _iterate(steps, tolerance, problem, single, common, v, approach)


def _near(problem: ContactProblem) -> tuple[Rows, Curve]:
    """Iterate and approach near the solution, by Newton steps in the precision of the problem.

    One loop holds the laws of the springs once, though its first step takes the secants of the start.
    """
    shared = problem if problem.start_law is None else replace(problem, law=problem.start_law)
    v, start = _start(shared)

    def advance(number, state):
        load = carried_by(state[0])
        exact = secants_under(problem, load)
        slope = slopes_under(problem, load, exact)
        chosen = [[jnp.where(number == 0, c, each) for c, each in zip(start, of)] for of in (exact, slope)]
        return _newton(problem, state[0], *chosen)

    return jax.lax.fori_loop(0, _NEAR_STEPS, advance, (v, jnp.zeros_like(problem.gap[0, 0])))


def _iterate(
    steps, tolerance, problem: ContactProblem, single: ContactProblem, common: Curve, v: Rows, approach: Curve
):
    """Newton steps until all positions are solved, each as a correction of the residual of the conditions.

    With slopes in single precision a step still gains six digits, at half the cost; so it does where coupled slices are
    eliminated in single precision. Others are eliminated quickly anyway.
    """
    eliminated = problem if problem.coupling is None else single

    def evaluated(v, approach):
        load = carried_by(v)
        secant, left = secants_under(problem, load), opening(problem, load, approach)
        return v, approach, secant, left, _residual(problem, load, approach, secant, left, common)

    def advance(state):
        count, (v, approach, secant, left, _) = state
        slope = slopes_under(single, *_cast((carried_by(v), secant), jnp.float32))
        return count + 1, evaluated(*_corrected(problem, eliminated, v, approach, secant, left, slope))

    def unfinished(state):
        count, (*_, residual) = state
        return (count < steps) & ~jnp.all(residual < tolerance)

    _, (v, approach, _, _, residual) = jax.lax.while_loop(unfinished, advance, (0, evaluated(v, approach)))
    return v, approach, residual


def _cast(tree, dtype):
    return jax.tree.map(lambda leaf: leaf if leaf.dtype == bool else leaf.astype(dtype), tree)


@partial(_solve.defjvp, symbolic_zeros=True)
def _solve_jvp(steps, tolerance, primals, tangents):
    (problem, common), (problem_dot, _) = primals, tangents
    v, approach, residual = _solve(steps, tolerance, problem, common)
    load = carried_by(v)

    def conditions(data):
        d = approach if data.approach is None else data.approach
        mismatch = jnp.stack(without_gap(data, load, d)) + deflections_under(data, load) + data.gap
        return mismatch, d if data.load is None else total(data, load) - data.load

    _, (mismatch_dot, last_dot) = jvp_of_given(conditions, problem, problem_dot)
    slope = slopes_under(problem, load, secants_under(problem, load))
    factors = eliminate(eliminable(problem), active_of(problem, v), slope)
    # the sum and the division keep the loops of reverse mode apart: its rows are stored before they are put together
    place = jnp.arange(len(v))[:, None, None]
    known = [-jnp.sum(jnp.where(place == i, mismatch_dot, 0.0), axis=0) / unit(row) for i, row in enumerate(v)]
    if problem.load is None:
        v_dot, approach_dot = respond(problem, factors, known, approach=jnp.zeros_like(approach)).load, last_dot
    else:
        v_dot, approach_dot, _ = respond(problem, factors, known, load=-last_dot)
    return (v, approach, residual), (v_dot, approach_dot, jnp.zeros_like(residual))


def _start(problem: ContactProblem) -> tuple[Rows, Slopes]:
    """Equal loads on all springs that can be in contact, and the secants under these loads.

    The secants do not depend on the gaps: for many problems that differ in their gaps alone they are evaluated once.
    """
    if problem.load is None:
        return _start_at(problem)
    even = problem.load / jnp.sum(problem.weight)
    loads = [jnp.broadcast_to(even, lever.shape) for lever in problem.lever]
    secant = secants_under(problem, loads)
    # gaps wider than the approach of any one spring that bears the load alone stay open
    alone = [
        jnp.max((gap + (c + own) * load) / lever, axis=0)
        for gap, c, own, lever, load in zip(problem.gap, secant, problem.own_compliance, problem.lever, loads)
    ]
    bound = jnp.min(jnp.stack(alone), axis=0)
    return [lever * bound[None] - gap for lever, gap in zip(problem.lever, problem.gap)], secant


def _start_at(problem: ContactProblem) -> tuple[Rows, Slopes]:
    """Contact wherever the approach closes the gap, and the secants under the loads of every spring on its own."""
    assert problem.approach is not None
    closed = [lever * problem.approach[None] - gap for lever, gap in zip(problem.lever, problem.gap)]
    load = [jnp.ones_like(row) for row in closed]
    for _ in range(_OWN_STEPS):
        secant = secants_under(problem, load)
        load = [row / (c + own) for row, c, own in zip(closed, secant, problem.own_compliance)]
    return closed, secants_under(problem, load)


def _newton(problem: ContactProblem, v: Rows, secant: Slopes, slope: Slopes) -> tuple[Rows, Curve]:
    """One Newton step on the active set; `secant` and `slope` belong to the loads of v."""
    active, carried = active_of(problem, v), carried_by(v)
    factors = eliminate(problem, active, slope)
    known = [-gap - (c - s) * q for gap, c, s, q in zip(problem.gap, secant, slope, carried)]
    found = respond(problem, factors, known, load=problem.load, approach=problem.approach)
    left = left_after(problem, found, list(problem.gap))
    return [
        jnp.where(flag, q, -y * inverse) for flag, q, y, inverse in zip(active, found.load, left, factors.per_slope)
    ], found.approach


def _corrected(
    problem: ContactProblem,
    eliminated: ContactProblem,
    v: Rows,
    approach: Curve,
    secant: Slopes,
    left: Rows,
    slope: Slopes,
) -> tuple[Rows, Curve]:
    """One Newton step as a correction of what is left of the conditions, in the precision of the problem to eliminate.

    `secant`, `slope` and the `opening` that is left belong to the loads of v and the approach.
    """
    active, carried = active_of(problem, v), carried_by(v)
    missing = None if problem.load is None else problem.load - total(problem, carried)
    still = None if problem.approach is None else jnp.zeros_like(approach)
    known = [-(y + c * q) for y, c, q in zip(left, secant, carried)]
    known, left, missing, still, slope = _cast((known, left, missing, still, slope), eliminated.gap.dtype)
    factors = eliminate(eliminated, active, slope)
    found = respond(eliminated, factors, known, load=missing, approach=still)
    left = left_after(eliminated, found, left)
    added, more, left, per_slope = _cast((found.load, found.approach, left, factors.per_slope), approach.dtype)
    return [
        jnp.where(flag, q + x, -y * inverse) for flag, q, x, y, inverse in zip(active, carried, added, left, per_slope)
    ], approach + more


def _residual(problem: ContactProblem, load: Rows, approach: Curve, secant: Slopes, left: Rows, common: Curve) -> Curve:
    """Largest violation of any condition, relative to the approach and to the load.

    Vanishing approach and load are not measured against zero, but against the rounding errors of `common` and of the
    load below which springs are linear.
    """
    worst, scale, softest = jnp.zeros_like(approach), jnp.abs(common), jnp.zeros_like(approach)
    for q, y, c, lever, own in zip(load, left, secant, problem.lever, problem.own_compliance):
        mismatch = y + c * q
        closing = jnp.abs(mismatch + lever * approach[None])
        worst = jnp.maximum(worst, jnp.max(jnp.where(q > 0, jnp.abs(mismatch), -mismatch), axis=0))
        scale = jnp.maximum(scale, jnp.max(jnp.where(q > 0, closing, 0.0), axis=0))
        softest = jnp.maximum(softest, jnp.max(own + c, axis=0))
    eps = jnp.finfo(worst.dtype).eps
    violation = worst / (scale + eps * LOAD_FLOOR * softest)
    if problem.load is None:
        return violation
    rounding = eps * (jnp.abs(common) / softest + LOAD_FLOOR) * jnp.sum(problem.weight)
    return jnp.maximum(violation, jnp.abs(total(problem, load) - problem.load) / (jnp.abs(problem.load) + rounding))
