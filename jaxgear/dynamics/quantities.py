"""Results of steady vibration as quantities: objectives, limits, columns of sweeps.

A quantity of dynamics needs speeds, masses and damping besides its name: `Dynamics.quantity` supplies them in Python,
the table [dynamics] in a design file.
"""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..metrics import Analysis, Quantity, Vocabulary
from ..numerics.reductions import Max
from .settings import Dynamics
from .steady import SteadyNumbers

Numbers = Float[Array, "runs speeds"]
Scalar = Float[Array, ""]

_FIELDS = (
    ("dynamic_factor", "", "largest mesh force over the static one"),
    ("dte_rms", "um", "rms of the dynamic transmission error about its mean"),
    ("contact_loss_share", "", "share of the time without contact, which has no derivative"),
    ("back_side_contact", "", "share of the time on the coast flanks, which has no derivative"),
)
AT_SPEED = tuple(name for name, *_ in _FIELDS)  # at the speed of the operating point, the others at all of the settings


def _numbers(field: str, at_speed: bool, analysis: Analysis, dynamics: Dynamics) -> Numbers:
    """Values of a quantity for all runs and speeds, which the quantity reduces to the worst."""
    # all quantities of the same settings come from one sweep
    found, converged = analysis.once(dynamics, ("runs", at_speed), lambda: _swept(at_speed, analysis, dynamics))
    # a map of contacts that were not found is no force
    return jnp.where(converged, getattr(found, field), jnp.nan)


def _swept(at_speed: bool, analysis: Analysis, dynamics: Dynamics) -> tuple[SteadyNumbers, Bool[Array, ""]]:
    mesh, speed = analysis.prepared_mesh, analysis.operating_point.speed
    if at_speed:
        if speed is None:
            raise ValueError("needs a speed, solve with OperatingPoint(torque, speed)")
        frequency = mesh_frequency(mesh.pair.pinion.teeth, speed)
        dynamics = replace(dynamics, mesh_frequencies=frequency[None])
    torque, deviation = analysis.cycle.torque, analysis.deviation
    oscillator, _ = dynamics.oscillator_and_mesh(mesh, torque, **analysis.flanks, deviation=deviation)
    return dynamics.numbers(oscillator), oscillator.converged


def mesh_frequency(teeth: Scalar, speed: Scalar) -> Scalar:
    """Mesh frequency [Hz] of a gear by its speed [rpm]."""
    return teeth * speed / 60


def _quantities(at_speed: bool) -> Iterator[Quantity]:
    for field, unit, meaning in _FIELDS:
        name, where = (field, "the speed of the pinion") if at_speed else (f"worst_{field}", "its worst speed")
        label = "largest dynamic factor" if name == "worst_dynamic_factor" else ""
        of = partial(_numbers, field, at_speed)
        yield Quantity(name, of, unit, f"{meaning}, at {where}", Max(), label=label, takes=Dynamics)


DYNAMIC_QUANTITIES = Vocabulary((*_quantities(True), *_quantities(False)))
