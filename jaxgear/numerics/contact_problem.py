"""Data and solution of a contact problem, and quantities of an iterate; `complementarity` states the conditions.

The iterate v holds the load of every spring in contact, and of every other one minus the load that would open it as far
as it is open.
"""

from abc import abstractmethod
from functools import reduce
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from .coupling import Rows, SliceCoupling, Slopes

Real = Float[Array, "..."]

# Springs are linear below this load (of a contact: 0.01 N/mm), where those of elastic contacts have no finite slope.
LOAD_FLOOR = 1e-2


class AbstractSpring(eqx.Module):
    """A deflection that increases with the load, elementwise; leaves have shape (springs, 1 or slices, positions)."""

    @abstractmethod
    def secant(self, load: Real) -> Real:
        """Deflection per load, at positive loads."""

    def slope(self, load: Real, secant: Real) -> Real:
        """Derivative of the deflection with respect to the load, given the `secant` at this load."""
        return secant + load * jax.jvp(self.secant, (load,), (jnp.ones_like(load),))[1]

    def deflection(self, load: Real) -> Real:
        """Deflection at any load that is not negative; zero at zero."""
        return load * self.secant(jnp.maximum(load, LOAD_FLOOR))

    def moved(self, distance: Real) -> "AbstractSpring":
        """Spring of a contact point that has moved by a distance; by default the same spring."""
        return self


class Known(NamedTuple):
    """Known solution of a problem: it is not iterated, and its derivatives are the derivatives of the problem.

    Attributes:
        line_load, opening, approach: as in `ContactSolution`.
    """

    line_load: Float[Array, "springs slices positions"]
    opening: Float[Array, "springs slices positions"]
    approach: Float[Array, " positions"]


class ContactProblem(eqx.Module):
    """Data of the contact problem.

    Attributes:
        compliance: C, of every slice on its own, shape (springs, springs, 1 or slices, positions).
        law: deflection h(q) of every spring.
        gap: gap of every spring without load, shape (springs, slices, positions).
        lever: closing of a spring per unit of common approach, positive, shape (springs, 1 or slices, positions).
        weight: width of each slice, shape (slices,).
        load: total load, scalar or shape (positions,); None where the approach is prescribed.
        approach: prescribed common approach d, shape (positions,); None where the load is.
        start_law: law that the solution starts from, close to h and shared by many problems, so that it is evaluated
            once for all of them; None for h.
        coupling: deflection of the slices under the loads of each other, and of their support; None where they only
            have the approach in common.
        known: solution of the problem where it has been found before; None where it is sought.

    Raises:
        ValueError: unless one of load and approach is given.
    """

    compliance: Float[Array, "springs springs #slices positions"]
    law: AbstractSpring
    gap: Float[Array, "springs slices positions"]
    lever: Float[Array, "springs #slices positions"]
    weight: Float[Array, " slices"]
    load: Float[Array, ""] | Float[Array, " positions"] | None = None
    approach: Float[Array, " positions"] | None = None
    start_law: AbstractSpring | None = None
    coupling: SliceCoupling | None = None
    known: Known | None = None

    def __check_init__(self) -> None:
        if (self.load is None) == (self.approach is None):
            raise ValueError("ContactProblem: one of load and approach must be given")

    @property
    def own_compliance(self) -> Float[Array, "springs #slices positions"]:
        """Deflection of every spring under an even load of its own."""
        own = jnp.stack([self.compliance[i, i] for i in range(len(self.compliance))])
        return own if self.coupling is None else own + self.coupling.own(self.weight, len(own))


class ContactSolution(eqx.Module):
    """Line loads, common approach, gaps under load, and residual of the conditions.

    Attributes:
        line_load: q, shape (springs, slices, positions).
        approach: d, shape (positions,).
        load: total load, shape (positions,).
        opening: y without the spring's own deflection, C q + gap - lever d, shape (springs, slices, positions): the
            remaining gap where it is positive, minus the contact deflection h(q) where the spring is loaded.
        in_contact: True for springs under load, shape (springs, slices, positions).
        residual: largest violation of any condition, relative to the approach and to the load, shape (positions,).
        converged: True if the residual is as small as it has to be, shape (positions,).
    """

    line_load: Float[Array, "springs slices positions"]
    approach: Float[Array, " positions"]
    load: Float[Array, " positions"]
    opening: Float[Array, "springs slices positions"]
    in_contact: Bool[Array, "springs slices positions"]
    residual: Float[Array, " positions"]
    converged: Bool[Array, " positions"]


def active_of(problem: ContactProblem, v: Rows) -> list[Bool[Array, "slices positions"]]:
    """True where the iterate is not negative; where all of it is negative and a load is given, at its largest entry."""
    if problem.load is None:
        return [row >= 0 for row in v]
    floor = jnp.minimum(reduce(jnp.maximum, [jnp.max(row, axis=0) for row in v]), 0.0)
    return [row >= floor[None] for row in v]


def carried_by(v: Rows) -> Rows:
    """Line loads of an iterate; differentiable at zero, where a spring in contact carries no load yet."""
    return [jnp.where(row >= 0, row, 0.0) for row in v]


def secants_under(problem: ContactProblem, load: Rows) -> Slopes:
    """Deflection per load of all springs, evaluated at once so that the program contains the law once."""
    return list(problem.law.secant(jnp.maximum(jnp.stack(load), LOAD_FLOOR)))


def slopes_under(problem: ContactProblem, load: Rows, secant: Slopes) -> Slopes:
    """Derivative of the deflection by the load of all springs; takes the secants under the same loads."""
    q, c = jnp.stack(load), jnp.stack(secant)
    return list(jnp.where(q > LOAD_FLOOR, problem.law.slope(jnp.maximum(q, LOAD_FLOOR), c), c))


def deflections_under(problem: ContactProblem, load: Rows) -> Float[Array, "springs slices positions"]:
    """Deflection of every spring."""
    return problem.law.deflection(jnp.stack(load))
