"""What is made small, and within which limits: numbers of a candidate design by name, and constraints on them."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import MeshCycle
from ..metrics import RESULTS, Result, max_relief, relief_reversal, removed_volume
from ..microgeometry import AbstractModification
from ..numerics import Checked, check, optional_real

Scalar = Float[Array, ""]

# A constraint counts as kept up to this part of its limit (of 1 where the limit is zero).
FEASIBLE = 1e-3


class Candidate(eqx.Module):
    """A design in one case: what an objective or a constraint of your own is computed from.

    Attributes:
        parameters: its free parameters.
        pinion, wheel: the modifications they make.
        cycle: mesh cycle of the case, with the deviations of its gears where there are any.
    """

    parameters: Mapping[str, Scalar]
    pinion: AbstractModification
    wheel: AbstractModification
    cycle: MeshCycle


Number = Callable[[Candidate], Scalar]


class Quantity(NamedTuple):
    """A named number of a candidate, and whether it takes the contact solution; see `jaxgear.metrics.Result`."""

    of: Number
    unit: str
    meaning: str
    of_contact: bool = False


def _of_cycle(result: Result) -> Quantity:
    return Quantity(lambda candidate: result.of(candidate.cycle), result.unit, result.meaning, of_contact=True)


def _of_flanks(function) -> Number:
    return lambda candidate: function(candidate.cycle.kinematics, candidate.pinion, candidate.wheel)


# All that an objective or a constraint can name: the results of a mesh cycle, and what the flanks say by themselves.
QUANTITIES: Mapping[str, Quantity] = MappingProxyType(
    {
        **{name: _of_cycle(result) for name, result in RESULTS.items()},
        "max_relief": Quantity(_of_flanks(max_relief), "um", "largest material removed from a flank"),
        "relief_reversal": Quantity(_of_flanks(relief_reversal), "um", "by how much removal fails to be monotone"),
        "removed_volume": Quantity(_of_flanks(removed_volume), "mm3", "material ground off all flanks"),
    }
)
PPTE = "ppte"


class Constraint(Checked):
    """A number of the design that has to stay within limits, in every case.

    Attributes:
        of: name of a quantity, such as "max_flank_pressure"; or coefficients by the name of a free parameter, for a
            linear constraint on them; or a function of a `Candidate`.
        low, high: limits in the unit of the number; None for no limit.
    """

    of: str | Mapping[str, float] | Number = eqx.field(static=True)
    low: Scalar | None = eqx.field(converter=optional_real, default=None)
    high: Scalar | None = eqx.field(converter=optional_real, default=None)

    def __post_init__(self):
        if isinstance(self.of, Mapping):  # as a static field it has to be hashable
            self.of = tuple(self.of.items())  # type: ignore[assignment]

    def __check_init__(self):
        if isinstance(self.of, str):
            known("Constraint", self.of)
        if self.low is None and self.high is None:
            raise ValueError("Constraint: low or high must be given")
        check("Constraint", "low", self.low, "")
        check("Constraint", "high", self.high, "", low=self.low)

    @property
    def linear(self) -> bool:
        """Whether it is a linear constraint on the free parameters."""
        return isinstance(self.of, tuple)

    @property
    def name(self) -> str:
        """What it limits, in words."""
        if isinstance(self.of, str):
            return self.of
        if self.linear:
            return " + ".join(f"{factor:g} {name}" for name, factor in self._terms)
        return getattr(self.of, "__name__", "constraint")

    @property
    def of_contact(self) -> bool:
        """Whether it takes the contact solution; a function of your own is taken to do so."""
        return QUANTITIES[self.of].of_contact if isinstance(self.of, str) else not self.linear

    @property
    def parameters(self) -> tuple[str, ...]:
        """The free parameters that a linear constraint names."""
        return tuple(name for name, _ in self._terms)

    @property
    def _terms(self) -> tuple[tuple[str, float], ...]:
        return self.of if self.linear else ()  # type: ignore[return-value]

    def value(self, candidate: Candidate) -> Scalar:
        """The number."""
        if self.linear:
            return jnp.sum(jnp.stack([factor * candidate.parameters[name] for name, factor in self._terms]))
        return number(self.of)(candidate)  # type: ignore[arg-type]

    def excess(self, value: Scalar) -> list[Scalar]:
        """By how much each limit is passed, relative to the limit; negative inside."""
        over = []
        for limit, sign in ((self.high, 1.0), (self.low, -1.0)):
            if limit is not None:
                limit = limit.astype(value.dtype)
                over.append(sign * (value - limit) / jnp.where(limit == 0, 1.0, jnp.abs(limit)))
        return over


def name_of(of: str | Number) -> str:
    """What an objective is called."""
    return of if isinstance(of, str) else getattr(of, "__name__", "objective")


def number(of: str | Callable[[Any], Scalar]) -> Number:
    """The function behind a name, or the function itself."""
    return QUANTITIES[of].of if isinstance(of, str) else of


def known(owner: str, name: str) -> None:
    """Raises a `ValueError` for a name that is not a quantity."""
    if name not in QUANTITIES:
        raise ValueError(f'{owner}: "{name}" is not known, must be one of {", ".join(QUANTITIES)}')
