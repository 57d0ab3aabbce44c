"""Numbers of steady vibration in the vocabulary of quantities: objectives, limits, columns of sweeps.

A name alone does not say at which speeds, with which masses and damping: `Dynamics.quantity` gives the quantity, and a
design file has the table [dynamics].
"""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..contact import MeshCycle
from ..metrics import Quantity, quantities
from ..numerics import Checked, concrete, once
from ..numerics.reductions import Max
from .steady import SteadyNumbers

Numbers = Float[Array, "runs speeds"]


class Kind(NamedTuple):
    """A dynamic quantity before its settings are known.

    Attributes:
        field: of `SpeedResponse`.
        at_speed: at the speed of the operation; otherwise at all speeds of the settings.
        unit: "" for a pure number.
        meaning: in a few words.
    """

    field: str
    at_speed: bool
    unit: str
    meaning: str


_FIELDS = (
    ("dynamic_factor", "", "largest mesh force over the static one"),
    ("approach_rms", "um", "rms of the approach of the flanks about its mean"),
    ("no_contact", "", "share of the time without contact, which has no derivative"),
    ("coast_contact", "", "share of the time on the coast flanks, which has no derivative"),
)
DYNAMIC_QUANTITIES: Mapping[str, Kind] = {
    **{name: Kind(name, True, unit, f"{meaning}, at the speed of the pinion") for name, unit, meaning in _FIELDS},
    **{f"worst_{name}": Kind(name, False, unit, f"{meaning}, at its worst speed") for name, unit, meaning in _FIELDS},
}


def with_settings(name: str, settings: Checked) -> Quantity:
    """A dynamic quantity with the settings that it needs; equal settings make equal quantities.

    Args:
        name: one of `DYNAMIC_QUANTITIES`.
        settings: a `Dynamics` of concrete numbers.

    Raises:
        ValueError: for another name, or settings that are being traced.
    """
    if name not in DYNAMIC_QUANTITIES:
        raise ValueError(f'Dynamics: quantity "{name}" is not known, must be one of {", ".join(DYNAMIC_QUANTITIES)}')
    return _quantity(name, _WithSettings(name, type(settings), _plain(settings)))


@dataclasses.dataclass(frozen=True)
class _WithSettings:
    """The numbers of a cycle, whose worst counts; settings as plain data, so that programs know them again."""

    name: str
    make: type[Any]
    fields: tuple[tuple[str, Any], ...]

    def __call__(self, cycle: MeshCycle) -> Numbers:
        kind = DYNAMIC_QUANTITIES[self.name]
        # all quantities of the same settings come from one sweep
        found, converged = once(cycle, (self.make, self.fields, kind.at_speed), lambda: self._numbers(cycle, kind))
        # a map of contacts that were not found is no force
        return jnp.where(converged, getattr(found, kind.field), jnp.nan)

    def _numbers(self, cycle: MeshCycle, kind: Kind) -> tuple[SteadyNumbers, Bool[Array, ""]]:
        settings = self.make(**dict(self.fields))
        mesh, operation = cycle.mesh_for(self.name), cycle.operation
        if kind.at_speed:
            if operation.speed is None:
                raise ValueError(f"{self.name}: needs a speed, solve with Operation(torque, speed)")
            frequency = mesh_frequency(cycle.kinematics.pair.pinion.teeth, operation.speed)
            settings = dataclasses.replace(settings, mesh_frequencies=frequency[None])
        oscillator = settings.oscillator_of(cycle, mesh)
        return settings.numbers(oscillator), oscillator.converged


@dataclasses.dataclass(frozen=True)
class _WithoutSettings:
    """Stands in the vocabulary, where names are looked up."""

    name: str

    def __call__(self, cycle: MeshCycle) -> Numbers:
        raise ValueError(
            f'{self.name}: needs settings, give jaxgear.dynamics.Dynamics(...).quantity("{self.name}"), or a design '
            "file with the table [dynamics]"
        )


def mesh_frequency(teeth, speed):
    """Mesh frequency [Hz] of a gear by its speed [rpm]."""
    return teeth * speed / 60


def _quantity(name: str, of: Callable[[MeshCycle], Any]) -> Quantity:
    kind = DYNAMIC_QUANTITIES[name]
    return Quantity(name, of, kind.unit, kind.meaning, Max())


def _plain(settings: Checked) -> tuple[tuple[str, Any], ...]:
    names = [field.name for field in dataclasses.fields(settings)]
    return tuple((name, _hashable(name, getattr(settings, name))) for name in names)


def _hashable(name: str, value: Any) -> Any:
    if value is None or isinstance(value, str | int):
        return value
    known = concrete(value)
    if known is None:
        raise ValueError(f"Dynamics: {name} is being traced, a quantity needs numbers")
    return tuple(known.tolist()) if known.ndim else known.item()


quantities.add(*(_quantity(name, _WithoutSettings(name)) for name in DYNAMIC_QUANTITIES))
