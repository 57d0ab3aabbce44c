"""Constraints on quantities and on free parameters."""

from collections.abc import Callable, Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.typing import DTypeLike
from jaxtyping import Array, Float

from ..contact import MeshCycle
from ..metrics import Quantity
from ..numerics import Checked, Numbers, check, optional_real
from ..vocabulary import quantity_of

Scalar = Float[Array, ""]
Violation = jax.Array | np.ndarray | float
Objective = str | Quantity | Callable[[MeshCycle], Any]

# Safety margin, relative to the limit (to 1 if the limit is zero), from which searches count an excess: peaks between
# the
# positions of the mesh stay within the limit.
FEASIBLE = 5e-4
_KEPT = 0.5 * FEASIBLE  # up to this excess a design of a search counts as one that keeps its limits


def counted(violation: Violation) -> Violation:
    """Violation for the comparison of designs: zero within the tolerance."""
    where = jnp.where if isinstance(violation, jax.Array) else np.where
    return where(violation <= _KEPT, 0.0, violation)


class Constraint(Checked):
    """Limits of a quantity, or of a weighted sum of the free parameters, in every case of a problem.

        Constraint("max_flank_pressure", high=1500.0)
        Constraint({"pinion_amount": 1.0, "wheel_amount": -1.0}, low=0.0)  # pinion_amount >= wheel_amount

    Attributes:
        quantity: limited quantity, given by its name, as a `Quantity`, or as a function of a mesh cycle; None where a
            sum of parameters is limited.
        terms: pairs (name of a free parameter, factor) of the limited sum; empty where a quantity is limited.
        low, high: least and largest allowed value, in the unit of the quantity or of the sum, shape (); None for no
            limit. One of them at least is given.
    """

    quantity: Quantity | None
    terms: tuple[tuple[str, float], ...] = eqx.field(static=True)
    low: Scalar | None = eqx.field(converter=optional_real)
    high: Scalar | None = eqx.field(converter=optional_real)

    def __init__(
        self, of: Objective | Mapping[str, float], *, low: Numbers | None = None, high: Numbers | None = None
    ) -> None:
        self.quantity = None if isinstance(of, Mapping) else quantity_of(of)
        self.terms = tuple(of.items()) if isinstance(of, Mapping) else ()
        self.low, self.high = optional_real(low), optional_real(high)

    def __check_init__(self) -> None:
        if self.quantity is None and not self.terms:
            raise ValueError("Constraint: a linear constraint must name at least one free parameter")
        if self.low is None and self.high is None:
            raise ValueError("Constraint: low or high must be given")
        check("Constraint: low", self.low, "")
        check("Constraint: high", self.high, "", low=self.low)

    def of_parameters(self, parameters: Mapping[str, Any]) -> Scalar:
        """Weighted sum of the free parameters that a linear constraint limits, shape ()."""
        return sum(factor * parameters[name] for name, factor in self.terms)

    @property
    def name(self) -> str:
        """Name of the quantity, or the sum as text: "1 pinion_amount + -1 wheel_amount"."""
        if self.quantity is not None:
            return self.quantity.name
        return " + ".join(f"{factor:g} {name}" for name, factor in self.terms)

    @property
    def unit(self) -> str:
        """Unit of the limits; "" for a pure number and for a sum of parameters."""
        return "" if self.quantity is None else self.quantity.unit

    @property
    def sides(self) -> list[tuple[int, Scalar]]:
        """Limits, each with 1 for an upper and -1 for a lower one."""
        return [(sign, limit) for sign, limit in ((1, self.high), (-1, self.low)) if limit is not None]

    def margin(self, limit: Scalar, dtype: DTypeLike) -> Scalar | float:
        """Safety margin of a search inside a limit, relative to the limit; zero for limits on free parameters."""
        if self.quantity is None:
            return 0.0
        if self.low is None or self.high is None:
            return FEASIBLE
        return jnp.minimum(FEASIBLE, 0.25 * (self.high - self.low) / scale_of(limit, dtype)).astype(dtype)

    def excess(self, value: Scalar) -> list[Scalar]:
        """Relative excess over each limit, counted from its `margin`; negative inside."""
        return [
            sign * (value - limit.astype(value.dtype)) / scale_of(limit, value.dtype) + self.margin(limit, value.dtype)
            for sign, limit in self.sides
        ]


def scale_of(limit: Scalar, dtype: DTypeLike) -> Scalar:
    """Reference of a relative excess: size of the limit, 1 where it is zero."""
    limit = limit.astype(dtype)
    return jnp.where(limit == 0, 1.0, jnp.abs(limit)).astype(dtype)
