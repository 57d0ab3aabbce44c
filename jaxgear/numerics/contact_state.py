"""What an iterate of a contact problem tells of its springs.

The iterate v holds the load of every spring in contact, and of every other one minus the load that would open it as far
as it is open.
"""

from functools import reduce
from operator import itemgetter

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool

from .contact_problem import ContactProblem
from .elimination import Rows, Slopes
from .spring import LOAD_FLOOR, AbstractSpring


def active_of(problem: ContactProblem, v: Rows) -> list[Bool[Array, "slices positions"]]:
    """Where the iterate is not negative; if it is everywhere, the largest must bear the load."""
    if problem.load is None:
        return [row >= 0 for row in v]
    floor = jnp.minimum(reduce(jnp.maximum, [jnp.max(row, axis=0) for row in v]), 0.0)
    return [row >= floor[None] for row in v]


def carried_by(v: Rows) -> Rows:
    """Line loads of an iterate; differentiable at zero, where a spring in contact carries no load yet."""
    return [jnp.where(row >= 0, row, 0.0) for row in v]


def laws_of(problem: ContactProblem) -> list[AbstractSpring]:
    """The law of every spring."""
    return [jax.tree.map(itemgetter(i), problem.law) for i in range(problem.lever.shape[0])]


def secants_under(problem: ContactProblem, load: Rows) -> Slopes:
    """Deflection per load of every spring."""
    return [law.secant(jnp.maximum(q, LOAD_FLOOR)) for law, q in zip(laws_of(problem), load)]


def slopes_under(problem: ContactProblem, load: Rows, secant: Slopes) -> Slopes:
    """Its derivative; the secants are those under the same loads."""
    return [
        jnp.where(q > LOAD_FLOOR, law.slope(jnp.maximum(q, LOAD_FLOOR), c), c)
        for law, q, c in zip(laws_of(problem), load, secant)
    ]
