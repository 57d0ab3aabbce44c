"""Numbers of steady vibration in the vocabulary of quantities: objectives, limits, columns of sweeps.

A name alone does not say at which speeds, with which masses and damping: `Dynamics.quantity` gives the quantity, and a
design file has the table [dynamics].
"""

import dataclasses
from collections.abc import Mapping
from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..contact import MeshCycle
from ..metrics import Quantity, quantities
from ..metrics.settings import WithoutSettings, WithSettings
from ..numerics import once
from ..numerics.reductions import Max
from .steady import SteadyNumbers

Numbers = Float[Array, "runs speeds"]


class _Kind(NamedTuple):
    """A dynamic quantity before its settings are known.

    Attributes:
        field: of `SpeedResponse`.
        at_speed: at the speed of the operating point; otherwise at all speeds of the settings.
        unit: "" for a pure number.
        meaning: in a few words.
    """

    field: str
    at_speed: bool
    unit: str
    meaning: str


_FIELDS = (
    ("dynamic_factor", "", "largest mesh force over the static one"),
    ("dte_rms", "um", "rms of the dynamic transmission error about its mean"),
    ("contact_loss_share", "", "share of the time without contact, which has no derivative"),
    ("back_side_contact", "", "share of the time on the coast flanks, which has no derivative"),
)
DYNAMIC_QUANTITIES: Mapping[str, _Kind] = {
    **{name: _Kind(name, True, unit, f"{meaning}, at the speed of the pinion") for name, unit, meaning in _FIELDS},
    **{f"worst_{name}": _Kind(name, False, unit, f"{meaning}, at its worst speed") for name, unit, meaning in _FIELDS},
}


def _numbers_of(given: WithSettings, cycle: MeshCycle) -> Numbers:
    """The numbers of a cycle, whose worst counts."""
    kind = DYNAMIC_QUANTITIES[given.name]
    # all quantities of the same settings come from one sweep
    found, converged = once(cycle, (given.make, given.fields, kind.at_speed), lambda: _swept(given, cycle, kind))
    # a map of contacts that were not found is no force
    return jnp.where(converged, getattr(found, kind.field), jnp.nan)


def _swept(given: WithSettings, cycle: MeshCycle, kind: _Kind) -> tuple[SteadyNumbers, Bool[Array, ""]]:
    settings = given.settings
    mesh, operating_point = cycle.mesh_for(given.name), cycle.operating_point
    if kind.at_speed:
        if operating_point.speed is None:
            raise ValueError(f"{given.name}: needs a speed, solve with OperatingPoint(torque, speed)")
        frequency = mesh_frequency(cycle.kinematics.pair.pinion.teeth, operating_point.speed)
        settings = dataclasses.replace(settings, mesh_frequencies=frequency[None])
    oscillator = settings.oscillator_of(cycle, mesh)
    return settings.numbers(oscillator), oscillator.converged


def mesh_frequency(teeth, speed):
    """Mesh frequency [Hz] of a gear by its speed [rpm]."""
    return teeth * speed / 60


def _quantity(name: str, kind: _Kind) -> Quantity:
    stands = WithoutSettings(name, "jaxgear.dynamics.Dynamics", "dynamics", given=_numbers_of)
    label = "largest dynamic factor" if name == "worst_dynamic_factor" else ""
    return Quantity(name, stands, kind.unit, kind.meaning, Max(), label=label)


quantities.add(*(_quantity(name, kind) for name, kind in DYNAMIC_QUANTITIES.items()), package=__package__)
