"""Named quantities of a mesh cycle: one open vocabulary for tables, objectives, limits, reports and design files."""

import difflib
import importlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import MeshCycle
from ..numerics import over_batch
from ..numerics.reductions import AbstractReduction, Value

Numbers = Float[Array, "..."]


@dataclass(frozen=True)
class Quantity:
    """A number of a mesh cycle, with its name and unit; call it with a cycle.

    A name of the vocabulary, or a quantity of your own, is taken wherever a quantity is asked for:

        ripple = Quantity("ripple", lambda cycle: cycle.tangent_stiffness, "N/um", reduction=Range())

    Attributes:
        name: as tables and design files call it.
        of: computes it from one solved cycle: a single number, or an array that the reduction makes one of. Traced, so
            it must be pure; every use of one quantity shares compiled programs as long as it is the same function.
        unit: "" for a pure number.
        meaning: in a few words.
        reduction: makes one number of an array, over all its axes. Linear programs keep the extremes of `Max`, `Min`
            and `Range` exact, and gradient methods soften them.
        better: whether small or large values are the better ones: what is minimized, worst, or on a front.
        local: whether the array has positions last and its values at a position depend on the material removed at that
            position alone, as those of transmission error, line load and pressure do. It only saves time.
        label: as tables and figures call it; "" for the name in words.
        form: how tables format the number, as in `format`.
    """

    name: str
    of: Callable[[MeshCycle], Any]
    unit: str = ""
    meaning: str = ""
    reduction: AbstractReduction = Value()
    better: Literal["smaller", "larger"] = "smaller"
    local: bool = False
    label: str = ""
    form: str = ".4g"

    @property
    def words(self) -> str:
        """The label, or else the name in words."""
        return self.label or self.name.replace("_", " ")

    @property
    def heading(self) -> str:
        """In words with the unit: `PPTE [um]`, `contact ratio`."""
        return f"{self.words} [{self.unit}]" if self.unit else self.words

    @property
    def named(self) -> str:
        """Name with the unit in brackets, as objectives carry it: `ppte [um]`."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    @property
    def key(self) -> str:
        """Name with the unit, as tables and summaries carry it: `ppte_um`, `max_line_load_N_per_mm`."""
        suffix = self.unit.replace(" ", "").replace("/", "_per_")
        return f"{self.name}_{suffix}" if suffix else self.name

    @property
    def sign(self) -> int:
        """1 where small values are the better ones, else -1."""
        return 1 if self.better == "smaller" else -1

    def __call__(self, cycle: MeshCycle) -> Numbers:
        """The number, of every cycle where the cycle has leading axes from `jax.vmap`."""
        return over_batch(lambda cycle: self.reduction(self.values(cycle).ravel()))(cycle)

    def values(self, cycle: MeshCycle) -> Float[Array, "..."]:
        """What is reduced, of one cycle, in its own shape.

        Raises:
            ValueError: when it is neither a number nor an array, or an array without a reduction.
        """
        given = self.of(cycle)
        try:
            values = jnp.asarray(given)
        except (TypeError, ValueError):
            raise ValueError(f"{self.name}: gives {type(given).__name__}, must be a number or an array") from None
        if isinstance(self.reduction, Value) and values.size != 1:
            raise ValueError(
                f"{self.name}: gives an array of shape {values.shape}, must be a single number; "
                "a Quantity(name, of, reduction=Max()) says what to make of it"
            )
        return values.astype(cycle.transmission_error.dtype)


class Vocabulary(Mapping[str, Quantity]):
    """Quantities by name. Packages add theirs; names are looked up in both spellings, "ppte" and "ppte_um".

    Which of the packages a program has imported, and in which order, changes neither what is known nor its order.
    """

    def __init__(self, packages: tuple[str, ...] = ()) -> None:
        """Holds nothing yet.

        Args:
            packages: those whose import adds quantities, in reading order; imported when a name is not found without.
        """
        self._by_package: dict[str, dict[str, Quantity]] = {package: {} for package in packages}
        self._unread = [*reversed(packages)]

    def add(self, *quantities: Quantity, package: str = "") -> None:
        """Adds quantities.

        Args:
            quantities: the quantities.
            package: that they come with.

        Raises:
            ValueError: for a name that is taken.
        """
        own = self._by_package.setdefault(package, {})
        if not package:
            self._read_all()  # what the packages call theirs is taken
        for quantity in quantities:
            if self._find(quantity.name) is not None:
                raise ValueError(f'quantities: "{quantity.name}" is there already')
            own[quantity.name] = quantity

    def __getitem__(self, name: str) -> Quantity:
        found = self._known(name)
        if found is None:
            raise KeyError(f"quantities: {self.not_known(name)}")
        return found

    def __contains__(self, name: object) -> bool:
        return self._known(name) is not None  # without the search for the nearest name, which takes long

    def __iter__(self) -> Iterator[str]:
        self._read_all()
        return iter([name for known in self._by_package.values() for name in known])

    def __len__(self) -> int:
        self._read_all()
        return sum(map(len, self._by_package.values()))

    def not_known(self, name: object) -> str:
        """That a name is not known, with the nearest known one."""
        known = [*self, *(each.key for each in self.values())]
        near = difflib.get_close_matches(str(name), known, n=1, cutoff=0.5)
        hint = f'did you mean "{near[0]}"?' if near else f"must be one of {', '.join(self)}"
        return f'"{name}" is not known, {hint}'

    def _known(self, name: object) -> Quantity | None:
        """A quantity, looked for in packages that are not imported yet too."""
        if self._find(name) is None:
            self._read_all()
        return self._find(name)

    def _find(self, name: object) -> Quantity | None:
        for known in self._by_package.values():
            if name in known:
                return known[str(name)]
            for quantity in known.values():
                if quantity.key == name:
                    return quantity
        return None

    def _read_all(self) -> None:
        while self._unread:  # popped first: a package looks names up while it is being imported
            importlib.import_module(self._unread.pop())


# later layers, so they are not imported here but when one of their names is asked for
quantities = Vocabulary(
    ("jaxgear.metrics", "jaxgear.dynamics", "jaxgear.wear", "jaxgear.manufacture"),
)


def quantity_of(of: str | Quantity | Callable[[MeshCycle], Any], owner: str = "quantity") -> Quantity:
    """The quantity that is meant by a name in either spelling, a `Quantity`, or a function of a cycle.

    Args:
        of: the quantity; a function is taken for a quantity of its own name that gives a single number.
        owner: who asks, for the message.

    Raises:
        ValueError: for an unknown name, with the nearest known one.
    """
    if isinstance(of, Quantity):
        return of
    if callable(of):
        return Quantity(getattr(of, "__name__", type(of).__name__), of)
    if of in quantities:
        return quantities[of]
    raise ValueError(f"{owner}: {quantities.not_known(of)}")
