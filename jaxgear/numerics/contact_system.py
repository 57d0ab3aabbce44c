"""The linear systems of a contact problem, with coupled slices or not, and what its loads deflect."""

import equinox as eqx
import jax.numpy as jnp

from .contact_problem import ContactProblem
from .coupling import CoupledFactors, Response, couple, respond, stiffness, with_inverses
from .elimination import (
    Active,
    Curve,
    Factors,
    Load,
    Rows,
    Slopes,
    at_approach,
    balance,
    factorize,
    over_slices,
    product,
)


def eliminable(problem: ContactProblem) -> ContactProblem:
    """The problem with what its eliminations need to be evaluated once."""
    if problem.coupling is None:
        return problem
    return eqx.tree_at(lambda p: p.coupling, problem, with_inverses(problem.coupling, problem.compliance))


def eliminate(problem: ContactProblem, active: Active, slope: Slopes) -> Factors | CoupledFactors:
    """Eliminates the active springs of an `eliminable` problem.

    Args:
        problem: the data.
        active: which springs are in contact, (slices, positions) each.
        slope: of the springs.
    """
    if problem.coupling is None:
        return factorize(problem.compliance, problem.lever, active, slope)
    assert problem.coupling.held is not None
    return couple(problem.coupling, problem.lever, factorize(problem.coupling.held.local, problem.lever, active, slope))


def given_load(
    problem: ContactProblem, factors: Factors | CoupledFactors, known: Rows, load: Load
) -> tuple[Rows, Curve]:
    """Line loads of the active springs and approach: deflection + slope x load = known + lever x approach."""
    if isinstance(factors, CoupledFactors):
        return respond(problem.weight, factors, known, load=load)[:2]
    return balance(problem.weight, factors, known, load)


def given_approach(problem: ContactProblem, factors: Factors | CoupledFactors, known: Rows, approach: Curve) -> Rows:
    """Line loads of the active springs."""
    if isinstance(factors, CoupledFactors):
        return respond(problem.weight, factors, known, approach=approach).load
    return at_approach(factors, known, approach)


def step(problem: ContactProblem, factors: Factors | CoupledFactors, known: Rows) -> tuple[Rows, Curve, Rows]:
    """Line loads of the active springs, approach and `opening` for what the problem prescribes."""
    if not isinstance(factors, CoupledFactors):
        if problem.approach is not None:
            load, approach = at_approach(factors, known, problem.approach), problem.approach
        else:
            assert problem.load is not None  # one of both is given
            load, approach = balance(problem.weight, factors, known, problem.load)
        return load, approach, opening(problem, load, approach)
    found = respond(problem.weight, factors, known, load=problem.load, approach=problem.approach)
    return found.load, found.approach, _left(factors, found, list(problem.gap))


def correction(
    problem: ContactProblem, factors: CoupledFactors, known: Rows, left: Rows, missing: Curve | None
) -> tuple[Rows, Curve, Rows]:
    """Changes of line loads and approach in a step with coupled slices, and `opening` after the step.

    Args:
        problem: the data.
        factors: factors of the active springs.
        known: remaining overlap of the active springs.
        left: `opening` before the step.
        missing: prescribed load minus the present one; None where the approach is prescribed.
    """
    approach = None if missing is not None else jnp.zeros_like(problem.gap[0, 0])
    found = respond(problem.weight, factors, known, load=missing, approach=approach)
    return found.load, found.approach, _left(factors, found, left)


def _left(factors: CoupledFactors, found: Response, gap: Rows) -> Rows:
    held = factors.coupling.held
    assert held is not None  # set by `with_inverses` before every elimination
    return [
        sum(c * q for c, q in zip(row, found.load)) + start - pressed
        for row, start, pressed in zip(held.local_slices, gap, found.pressed)
    ]


def load_per_approach(problem: ContactProblem, factors: Factors | CoupledFactors) -> Curve:
    """d load / d approach of the active springs."""
    if isinstance(factors, CoupledFactors):
        return stiffness(problem.weight, factors)
    return product(problem.weight, factors, factors.lever, factors.lever)


def opening(problem: ContactProblem, load: Rows, approach: Curve) -> Rows:
    """Remaining gap y of every spring, without its own deflection."""
    return [y + gap for y, gap in zip(without_gap(problem, load, approach), problem.gap)]


def without_gap(problem: ContactProblem, load: Rows, approach: Curve) -> Rows:
    """Part of `opening` that load and approach cause: C q - lever d, without the initial gap."""
    if problem.coupling is not None:
        deflected = problem.coupling.deflection(problem.compliance, problem.lever, load)
        return [row - lever * approach[None] for row, lever in zip(deflected, problem.levers)]
    result = []
    for row, lever in zip(problem.compliance, problem.levers):
        result.append(sum(c * q for c, q in zip(over_slices(row), load)) - lever * approach[None])
    return result


def total(problem: ContactProblem, load: Rows) -> Curve:
    """Total load of the line loads, times lever and slice width."""
    if problem.lever.ndim == 3:
        return jnp.sum(problem.weight[:, None] * sum(lever * q for lever, q in zip(problem.lever, load)), axis=0)
    return sum(lever * jnp.sum(problem.weight[:, None] * q, axis=0) for lever, q in zip(problem.lever, load))
