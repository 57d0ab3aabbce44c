"""What a contact problem is given by, and what solves it; `complementarity` states the conditions."""

import equinox as eqx
from jaxtyping import Array, Bool, Float

from .coupling import Coupling
from .spring import AbstractSpring


class ContactProblem(eqx.Module):
    """Data of the contact problem.

    Attributes:
        compliance: C, shape (pairs, pairs, positions).
        law: h(q) of every spring.
        gap: shape (pairs, slices, positions).
        lever: what a spring closes per unit of common approach, positive, shape (pairs, positions).
        weight: width of each slice, shape (slices,).
        load: total load, scalar or shape (positions,); None where the approach is prescribed.
        approach: prescribed common approach d, shape (positions,); None where the load is.
        start_law: a law like h that many problems share, which spares each of them the evaluations that its solution
            starts from; None for h.
        coupling: how slices are elastically coupled, whose `weight` then is that of the slices over their mean,
            None where all have one; None where only the approach is common.

    Raises:
        ValueError: unless one of load and approach is given.
    """

    compliance: Float[Array, "pairs pairs positions"]
    law: AbstractSpring
    gap: Float[Array, "pairs slices positions"]
    lever: Float[Array, "pairs positions"]
    weight: Float[Array, " slices"]
    load: Float[Array, ""] | Float[Array, " positions"] | None = None
    approach: Float[Array, " positions"] | None = None
    start_law: AbstractSpring | None = None
    coupling: Coupling | None = None

    def __check_init__(self):
        if (self.load is None) == (self.approach is None):
            raise ValueError("ContactProblem: one of load and approach must be given")


class ContactSolution(eqx.Module):
    """Line loads, common approach, what is left of the gaps, and how well the conditions hold.

    Attributes:
        line_load: q, shape (pairs, slices, positions).
        approach: d, shape (positions,).
        load: total load, shape (positions,).
        opening: y without the spring's own deflection, C q + gap - lever d, shape (pairs, slices, positions): the
            remaining gap where it is positive, minus the contact deflection h(q) where the spring is loaded.
        in_contact: which springs carry load, shape (pairs, slices, positions).
        residual: largest violation of any condition, relative to the approach and to the load, shape (positions,).
        solved: whether the residual is as small as it has to be, shape (positions,).
    """

    line_load: Float[Array, "pairs slices positions"]
    approach: Float[Array, " positions"]
    load: Float[Array, " positions"]
    opening: Float[Array, "pairs slices positions"]
    in_contact: Bool[Array, "pairs slices positions"]
    residual: Float[Array, " positions"]
    solved: Bool[Array, " positions"]
