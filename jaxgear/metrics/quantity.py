"""Analysis of a design, and its named quantities for tables, objectives, limits, reports and design files."""

import difflib
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar, Literal, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.extend.core import get_opaque_trace_state
from jaxtyping import Array, Float

from ..contact import Mesh, MeshCycle, OperatingPoint, removed_material
from ..numerics import Checked, UnitKey, over_batch
from ..numerics.reductions import AbstractReduction, Value

_Found = TypeVar("_Found")
Settings = TypeVar("Settings", bound=Checked)


class Analysis:
    """Mesh cycle of a design under a load, with further analyses that are computed on first use and then reused.

    Most quantities need only a mesh cycle. Quantities with further solutions on the mesh, such as vibration and wear,
    need an analysis:

        worst = Dynamics(frequencies, damping_ratio=0.05).quantity("worst_dynamic_factor")
        worst(Analysis(cycle, mesh))

    Make an analysis next to its cycle, inside a function that `jax.jit` or `jax.vmap` traces; it is not a pytree.

    Attributes:
        cycle: solved mesh cycle of the design.
        mesh: prepared mesh of the cycle; None if no quantity needs it.
        shared: settings shared by several quantities, see `share_settings`.
    """

    def __init__(self, cycle: MeshCycle, mesh: Mesh | None = None, shared: Sequence[Checked] = ()) -> None:
        """Make an analysis from a cycle and its mesh.

        Raises:
            ValueError: for a mesh and a cycle with batch axes: use `jax.vmap` over the cycle, so that the mesh is not
                repeated.
        """
        if cycle.batch_ndim and mesh is not None:
            use = "jax.vmap(lambda cycle: quantity(Analysis(cycle, mesh)))"
            raise ValueError(f"Analysis: the cycle has batch axes, use {use}")
        self.cycle, self.mesh, self.shared = cycle, mesh, tuple(shared)
        self._found: list[tuple[Any, Any, Any, Any]] = []

    @property
    def operating_point(self) -> OperatingPoint:
        """Torque, speed and friction of the cycle."""
        return self.cycle.operating_point

    @property
    def flanks(self) -> dict[str, Any]:
        """Modifications of pinion and wheel, by these names."""
        return {"pinion": self.cycle.pinion, "wheel": self.cycle.wheel}

    @property
    def prepared_mesh(self) -> Mesh:
        """Prepared mesh, for quantities with further solutions.

        Raises:
            ValueError: if the analysis has no mesh.
        """
        if self.mesh is None:
            raise ValueError("needs the prepared mesh besides the cycle, give it Analysis(cycle, mesh)")
        return self.mesh

    @property
    def deviation(self) -> Float[Array, "pairs slices positions"]:
        """Material removed by deviations, in addition to the modifications [um], shape (pairs, slices, positions).

        If the cycle does not contain its modifications, it is the total material removed.

        Raises:
            ValueError: if the analysis has no mesh.
        """
        cycle, mesh = self.cycle, self.prepared_mesh
        removed = removed_material(mesh, cycle.torque, **self.flanks)
        deviation = cycle.gap - mesh.corner_gap - removed.amount
        if cycle.pinion is None or cycle.wheel is None:
            return deviation
        return jax.lax.stop_gradient(deviation)  # of the design it does not depend but by rounding

    def once(self, settings: Checked, what: Hashable, work: Callable[[], _Found]) -> _Found:
        """Result of work(), computed once per settings and name; compilers do not merge equal loops.

        A result computed during one trace is not reused in another trace.

        Args:
            settings: settings that the work depends on, compared by identity.
            what: name of the result.
            work: traceable function that depends on nothing else that changes.
        """
        now = get_opaque_trace_state()
        for trace, known, name, found in self._found:
            if trace == now and known is settings and name == what:
                return found
        found = work()
        self._found.append((now, settings, what, found))
        return found

    def in_precision(self, settings: Settings) -> Settings:
        """Settings with their numbers in the precision of the cycle."""
        dtype = self.cycle.transmission_error.dtype

        def cast(leaf: Any) -> Any:
            return leaf.astype(dtype) if eqx.is_inexact_array(leaf) else leaf

        return self.once(settings, "settings", lambda: jax.tree.map(cast, settings))


Numbers = Float[Array, "..."]


class AbstractSettings(Checked):
    """Settings that some quantities need besides a mesh cycle: lubricant, strengths, masses, running time.

    A quantity with settings names their class in `takes`; the method `quantity` of the settings returns the quantity
    computed with them. Define your own class like those of the library:

        class Microphone(AbstractSettings):
            table = "microphone"
            distance: Array = number("m", low=0.0, open_low=True)

        def level(analysis, microphone):
            return jnp.ptp(analysis.cycle.transmission_error) / microphone.distance

        quantities.add(Quantity("level", level, "um/m", takes=Microphone))
        Microphone(distance=0.5).quantity("level")

    Attributes:
        table: table of a design file, whose keys are the fields; "" for none.
    """

    table: ClassVar[str] = ""

    def quantity(self, name: str) -> "Quantity":
        """Quantity computed with these settings, for objectives, constraints, sweeps, Pareto fronts and tables.

        The settings may be traced: programs compiled for a quantity also serve other values of the settings.

        Args:
            name: name in the vocabulary, without the unit.

        Raises:
            ValueError: for an unknown quantity of these settings, and if a required field is missing.
        """
        known = _OF_SETTINGS.get(type(self), {})
        if name not in known:
            raise ValueError(
                f'{type(self).__name__}: quantity "{name}" is not known, must be one of {", ".join(known)}'
            )
        return known[name].with_settings(self)


class Shared(eqx.Module):
    """Placeholder of settings in a quantity: index of the shared settings of an `Analysis`, see `share_settings`."""

    number: int = eqx.field(static=True)


class Quantity(eqx.Module):
    """Named quantity of a mesh cycle with unit; call it with a cycle or an `Analysis`.

    Every argument for a quantity takes a name of the vocabulary or your own quantity:

        ripple = Quantity("ripple", lambda cycle: cycle.tangent_stiffness, "N/um", reduction=Range())

    Attributes:
        name: name in tables and design files.
        of: computes it from one solved cycle, or with `takes` from an `Analysis` and the settings: a single number, or
            an array that the reduction makes one of. Traced, so it must be pure; every use of one quantity shares
            compiled programs as long as it is the same function.
        unit: "" for a pure number.
        meaning: meaning in a few words.
        reduction: reduction of an array to one number, over all its axes. Linear programs keep the extremes of `Max`,
            `Min` and `Range` exact; gradient methods soften them.
        better: "smaller" or "larger": direction of improvement for objectives, worst cases and fronts.
        local: True if positions are the last axis and the value at a position depends only on the material removed at
            that position, as for transmission error, line load and pressure. It only saves time.
        label: name in tables and figures; "" for the name in words.
        form: format of the value in tables, as in `format`.
        takes: class of the required settings; None for a cycle alone.
        needs: field of the settings that must be given; "" for none.
        without: operating-point fields that can replace the settings; `of` then gets None. None if settings are always
            required.
        settings: settings of the quantity, which may be traced; None in the vocabulary.
    """

    name: str = eqx.field(static=True)
    of: Callable[..., Any] = eqx.field(static=True)
    unit: str = eqx.field(static=True, default="")
    meaning: str = eqx.field(static=True, default="")
    reduction: AbstractReduction = eqx.field(static=True, default=Value())
    better: Literal["smaller", "larger"] = eqx.field(static=True, default="smaller")
    local: bool = eqx.field(static=True, default=False)
    label: str = eqx.field(static=True, default="")
    form: str = eqx.field(static=True, default=".4g")
    takes: type[AbstractSettings] | None = eqx.field(static=True, default=None, kw_only=True)
    needs: str = eqx.field(static=True, default="", kw_only=True)
    without: tuple[str, ...] | None = eqx.field(static=True, default=None, kw_only=True)
    settings: AbstractSettings | Shared | None = eqx.field(default=None, kw_only=True)

    @property
    def words(self) -> str:
        """Label of the quantity, or its name in words."""
        return self.label or self.name.replace("_", " ")

    @property
    def heading(self) -> str:
        """Label with the unit: `PPTE [um]`, `contact ratio`."""
        return self.key.heading

    @property
    def named(self) -> str:
        """Name with the unit in brackets, for objectives: `ppte [um]`."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    @property
    def key(self) -> UnitKey:
        """Name with the unit, for tables and summaries: `ppte_um`, `max_line_load_N_per_mm`."""
        return UnitKey(self.name, self.unit, self.words)

    @property
    def sign(self) -> int:
        """Sign of the quantity in a minimization: 1 if smaller values are better, else -1."""
        return 1 if self.better == "smaller" else -1

    def __repr__(self) -> str:
        given = "" if self.settings is None else f", settings={self.settings!r}"
        return f"Quantity({self.named!r}, {self.meaning!r}{given})"

    def with_settings(self, settings: AbstractSettings) -> "Quantity":
        """Copy of the quantity that is computed with settings.

        Raises:
            TypeError: for settings of another class than `takes`.
            ValueError: if the field `needs` of the settings is None.
        """
        given = type(settings).__name__
        if self.takes is None or not isinstance(settings, self.takes):
            raise TypeError(f"{self.name}: takes {getattr(self.takes, '__name__', 'no settings')}, not {given}")
        if self.needs and getattr(settings, self.needs) is None:
            raise ValueError(f'{given}: quantity "{self.name}" needs {self.needs}')
        return replace(self, settings=settings)

    def __call__(self, analysis: Analysis | MeshCycle) -> Numbers:
        """Value of the quantity; with the leading axes of a batched cycle."""
        if isinstance(analysis, MeshCycle):
            return over_batch(lambda cycle: self(Analysis(cycle)))(analysis)
        return self.reduction(self.values(analysis).ravel())

    def values(self, analysis: Analysis | MeshCycle) -> Float[Array, "..."]:
        """Values of one cycle before the reduction, in their own shape.

        Raises:
            ValueError: if the result is neither a number nor an array, or an array without a reduction, and if settings
                are missing.
        """
        if isinstance(analysis, MeshCycle):
            analysis = Analysis(analysis)
        try:
            given = self.of(analysis.cycle) if self.takes is None else self._with_settings(analysis, self.takes)
        except ValueError as error:
            error.args = (f"{self.name}: {error}",)
            raise
        try:
            values = jnp.asarray(given)
        except (TypeError, ValueError):
            raise ValueError(f"{self.name}: gives {type(given).__name__}, must be a number or an array") from None
        if isinstance(self.reduction, Value) and values.size != 1:
            raise ValueError(
                f"{self.name}: gives an array of shape {values.shape}, must be a single number; "
                "a Quantity(name, of, reduction=Max()) says what to make of it"
            )
        return values.astype(analysis.cycle.transmission_error.dtype)

    def _with_settings(self, analysis: Analysis, takes: type[AbstractSettings]) -> Any:
        settings = analysis.shared[self.settings.number] if isinstance(self.settings, Shared) else self.settings
        if settings is not None:
            return self.of(analysis, analysis.in_precision(settings))
        if self.without is None:
            name = f"{takes.__module__.rpartition('.')[0]}.{takes.__name__}"
            table = f", or a design file with the table [{takes.table}]" if takes.table else ""
            raise ValueError(f'needs settings, give {name}(...).quantity("{self.name}"){table}')
        return self.of(analysis, None)


# of every vocabulary, by the class of the settings and the name
_NEAR = 0.6  # similarity of a misspelt name
_OF_SETTINGS: dict[type[AbstractSettings], dict[str, Quantity]] = {}


class Vocabulary(Mapping[str, Quantity]):
    """Quantities by name, looked up in both spellings, "ppte" and "ppte_um"."""

    def __init__(
        self, known: Iterable[Quantity] = (), *, further: Callable[[], Iterable[Quantity]] | None = None
    ) -> None:
        """Make a vocabulary.

        Args:
            known: quantities of the vocabulary.
            further: function that returns further quantities, called at the first look-up.
        """
        self._here: dict[str, Quantity] = {}
        self._others: dict[str, list[Quantity]] = {}
        self._further: Callable[[], Iterable[Quantity]] | None = None
        self.add(*known)
        self._further = further

    @property
    def _known(self) -> dict[str, Quantity]:
        if self._further is not None:
            further, self._further = self._further, None
            self.add(*further())
        return self._here

    def add(self, *quantities: Quantity) -> None:
        """Add quantities.

        A name that is taken may be that of another quantity too where both are of settings: which of them is meant is
        then said by the settings, `every`.

        Raises:
            ValueError: for a name that exists already.
        """
        for quantity in quantities:
            known = self.every(quantity.name)
            taken = [each.takes for each in known]
            if known and (None in taken or quantity.takes in (*taken, None)):
                raise ValueError(f'quantities: "{quantity.name}" exists already')
            if known:
                self._others.setdefault(quantity.name, []).append(quantity)
            else:
                self._here[quantity.name] = quantity
            if quantity.takes is not None:
                _OF_SETTINGS.setdefault(quantity.takes, {})[quantity.name] = quantity

    def __getitem__(self, name: str) -> Quantity:
        found = self._find(name)
        if found is None:
            raise KeyError(f"quantities: {self.not_known(name)}")
        return found

    def __contains__(self, name: object) -> bool:
        return self._find(name) is not None  # without the search for the nearest name, which takes long

    def __iter__(self) -> Iterator[str]:
        return iter(self._known)

    def __len__(self) -> int:
        return len(self._known)

    def every(self, name: object) -> tuple[Quantity, ...]:
        """All quantities of a name in either spelling, one per class of settings; empty if unknown."""
        found = self._find(name)
        return () if found is None else (found, *self._others.get(found.name, ()))

    def not_known(self, name: object) -> str:
        """Message that a name is unknown, with the nearest known name."""
        known = [*self, *(each.key for each in self.values())]
        near = difflib.get_close_matches(str(name), known, n=1, cutoff=_NEAR)
        hint = f'did you mean "{near[0]}"?' if near else f"must be one of {', '.join(self)}"
        return f'"{name}" is not known, {hint}'

    def quantity_of(self, of: str | Quantity | Callable[[MeshCycle], Any]) -> Quantity:
        """Quantity of a name in either spelling, of a `Quantity`, or of a function of a cycle.

        Args:
            of: name, quantity, or function that returns a single number; a quantity made of a function has its name.

        Raises:
            ValueError: for an unknown name, with the nearest known one.
        """
        if isinstance(of, Quantity):
            return of
        if not isinstance(of, str):
            return Quantity(getattr(of, "__name__", type(of).__name__), of)
        found = self._find(of)
        if found is None:
            raise ValueError(self.not_known(of))
        return found

    def _find(self, name: object) -> Quantity | None:
        if name in self._known:
            return self._known[str(name)]
        return next((quantity for quantity in self._known.values() if quantity.key == name), None)


def share_settings(quantities: Sequence[Quantity]) -> tuple[tuple[Quantity, ...], tuple[AbstractSettings, ...]]:
    """Separate quantities from their settings, without duplicates, so that the quantities can be static arguments.

    An `Analysis` with these settings computes results shared by several quantities only once.

    Args:
        quantities: quantities with settings, concrete or traced.

    Returns:
        the quantities with a `Shared` in place of settings, and the settings, for `Analysis(cycle, mesh, settings)`.
    """
    settings: list[AbstractSettings] = []
    bare = []
    for quantity in quantities:
        own = quantity.settings
        if isinstance(own, AbstractSettings):
            number = next((number for number, known in enumerate(settings) if _same(known, own)), len(settings))
            settings += [own] * (number == len(settings))
            quantity = replace(quantity, settings=Shared(number))
        bare.append(quantity)
    return tuple(bare), tuple(settings)


def _same(one: AbstractSettings, other: AbstractSettings) -> bool:
    """True if two settings are the same object or have equal concrete numbers."""
    if one is other:
        return True
    flat: list[Any] = [jax.tree.flatten(settings) for settings in (one, other)]
    (leaves, structure), (others, like) = flat
    if structure != like:
        return False
    if any(isinstance(leaf, jax.core.Tracer) for leaf in (*leaves, *others)):
        return False
    return all(np.shape(leaf) == np.shape(each) and np.array_equal(leaf, each) for leaf, each in zip(leaves, others))
