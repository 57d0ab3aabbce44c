"""What an iterate of a contact problem tells of its springs.

The iterate v holds the load of every spring in contact, and of every other one minus the load that would open it as far
as it is open.
"""

from functools import reduce

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from .contact_problem import ContactProblem
from .elimination import Rows, Slopes
from .spring import LOAD_FLOOR


def active_of(problem: ContactProblem, v: Rows) -> list[Bool[Array, "slices positions"]]:
    """Where the iterate is not negative; if it is everywhere, the largest must bear the load."""
    if problem.load is None:
        return [row >= 0 for row in v]
    floor = jnp.minimum(reduce(jnp.maximum, [jnp.max(row, axis=0) for row in v]), 0.0)
    return [row >= floor[None] for row in v]


def carried_by(v: Rows) -> Rows:
    """Line loads of an iterate; differentiable at zero, where a spring in contact carries no load yet."""
    return [jnp.where(row >= 0, row, 0.0) for row in v]


def secants_under(problem: ContactProblem, load: Rows) -> Slopes:
    """Deflection per load of every spring; all springs at once, so that a program holds the law once."""
    return list(problem.law.secant(jnp.maximum(jnp.stack(load), LOAD_FLOOR)))


def slopes_under(problem: ContactProblem, load: Rows, secant: Slopes) -> Slopes:
    """Its derivative; the secants are those under the same loads."""
    q, c = jnp.stack(load), jnp.stack(secant)
    return list(jnp.where(q > LOAD_FLOOR, problem.law.slope(jnp.maximum(q, LOAD_FLOOR), c), c))


def deflections_under(problem: ContactProblem, load: Rows) -> Float[Array, "pairs slices positions"]:
    """Deflection of every spring."""
    return problem.law.deflection(jnp.stack(load))
