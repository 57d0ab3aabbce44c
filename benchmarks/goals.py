"""The accuracy that the project aims at, cycle by cycle."""

from dataclasses import dataclass

from .quantities import QUANTITIES

_QUANTITIES = {quantity.key: quantity for quantity in QUANTITIES}


@dataclass(frozen=True)
class Goal:
    """A limit on an error of every mesh cycle.

    Attributes:
        key: of the quantity.
        limit: largest absolute error, in the quantity's unit.
        alternative: key and limit of a second quantity: a cycle that keeps it meets the goal too.
        part: share of the cycles that have to meet it.
        why: what the model's remaining error comes from.
    """

    key: str
    limit: float
    alternative: tuple[str, float] | None = None
    part: float = 1.0
    why: str = ""

    def __str__(self) -> str:
        limits = ((self.key, self.limit), *((self.alternative,) if self.alternative else ()))
        within = " or ".join(f"{limit:g} {_QUANTITIES[key].unit}".strip() for key, limit in limits)
        return f"{_QUANTITIES[self.key].title} within {within}"

    def met(self, errors: dict[str, float]) -> bool:
        """Whether a cycle meets the goal; one without the quantity does, one whose error is not a number does not."""
        if self.key not in errors or abs(errors[self.key]) <= self.limit:
            return True
        return self.alternative is not None and abs(errors[self.alternative[0]]) <= self.alternative[1]


_SOFT = "The tooth's beam on the elastic ring is slightly softer than the finite elements."
_SMALL = (
    "A well relieved pair has a small PPTE on a large mean: there the one percent by which a pair alone is too soft "
    "counts in full."
)
DEFAULT_GOALS = (
    Goal("mean", 1.5, why=_SOFT),
    Goal("ppte", 5.0, ("ppte_um", 0.1), why=_SMALL),
    Goal("rms", 1.5, why=_SOFT),
    Goal("k1", 3.0, why=_SOFT),
    Goal("share_points", 0.02),
    Goal("share_flank", 0.02),
    Goal("share", 0.02),
)
FINITE_ELEMENT_STRUCTURE_GOALS = (
    Goal("mean", 0.5),
    Goal("ppte", 2.0, ("ppte_um", 0.05), part=0.95),
    Goal("share", 0.01),
)
