"""The linear systems of a contact problem, with coupled slices or not, and what its loads deflect."""

from functools import reduce
from operator import add
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from .contact_problem import ContactProblem
from .coupling import CoupledFactors, couple, pressed_by, stiffness, with_inverse
from .elimination import Active, Curve, Inverse, Load, Rows, Slopes, inverse_of
from .safe import unit

Matrix = Float[Array, "springs springs #slices positions"]


def eliminable(problem: ContactProblem) -> ContactProblem:
    """The problem with what its eliminations need to be evaluated once."""
    if problem.coupling is None:
        return problem
    return eqx.tree_at(lambda p: p.coupling, problem, with_inverse(problem.coupling))


class Factors(NamedTuple):
    """The system of the active springs, eliminated.

    Attributes:
        inverse: of C + slope, of every slice on its own; zero where springs are apart.
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
        active: which springs are in contact, (slices, positions) each.
        slope: of the springs.
    """
    inverse, per_slope = inverse_of(problem.compliance, active, slope)
    if problem.coupling is None:
        return Factors(inverse, per_slope, None)
    inverse = [[x / unit(x) for x in row] for row in inverse]  # read by several loops
    return Factors(inverse, per_slope, couple(problem.coupling, problem.weight, problem.lever, inverse))


class Response(NamedTuple):
    """Line loads, common approach, and what presses the slices besides what is known."""

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
        factors: from `eliminate`.
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
    """`opening` after a step that has changed the loads by those found, from that `before`: the gap for a whole one."""
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
