"""Speed sweeps of many oscillators, shared out among devices, a batch of them at a time."""

import dataclasses
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp

from ..conditions.batches import divided, local_devices, over_devices, padded
from ..numerics import kernel, whole
from .oscillator import Oscillator
from .response import SpeedResponse
from .speed_sweep import checked_frequencies, prepared, swept

# Oscillators side by side: on a CPU the rows of their mesh forces stay in the cache, an accelerator needs many.
_SIDE_BY_SIDE, _SIDE_BY_SIDE_ELSEWHERE = 32, 4096


def side_by_side(owner: str, batch: int | None) -> int:
    """Oscillators that advance side by side on a device; None for as many as suit it."""
    elsewhere = jax.local_devices()[0].platform != "cpu"
    return whole(owner, "batch", (_SIDE_BY_SIDE_ELSEWHERE if elsewhere else _SIDE_BY_SIDE) if batch is None else batch)


def speed_sweeps(oscillators: Oscillator, mesh_frequencies, *, batch: int | None = None, **options: Any):
    """`speed_sweep` of many oscillators: designs, torques, or both.

    What is in memory besides the results does not grow with their number.

    Args:
        oscillators: with one axis in front of every array, as `jax.vmap` of what makes one gives them.
        mesh_frequencies: [Hz], increasing, shape (speeds,), the same for all.
        batch: oscillators that advance side by side on a device; None for as many as suit the device.
        options: the others of `speed_sweep`, the same for all; but for `start`, each begins at its static equilibrium.

    Returns:
        a `SpeedResponse` whose arrays have the axis of the oscillators in front.

    Raises:
        ValueError: in one line for a single oscillator, and as `speed_sweep`.
        TypeError: for an unknown option.
    """
    owner = "speed_sweeps"
    frequencies = checked_frequencies(owner, mesh_frequencies)
    if oscillators.mass.ndim != 2:
        raise ValueError(
            f"{owner}: oscillators have masses of shape {oscillators.mass.shape}, must be (oscillators, coordinates); "
            "make them with jax.vmap"
        )
    batch = side_by_side(owner, batch)
    sizes, limits = prepared(owner, oscillators, frequencies, **options)
    devices, count = local_devices(), len(oscillators.mass)
    share = -(-count // devices.size)
    batch = min(batch, share)
    rows = jax.tree.map(lambda part: padded(part, batch * devices.size), oscillators)
    found = _all_swept(divided(rows, devices), (frequencies, limits), sizes, batch, devices)
    found = jax.tree.map(lambda part: part[:count], found)
    return dataclasses.replace(found, direction=options.get("direction", "up"))


@kernel
def _all_swept(oscillators, shared, sizes, batch: int, devices) -> SpeedResponse:
    return over_devices(partial(_of_one, sizes), oscillators, shared, batch=batch, devices=devices)


def _of_one(sizes, shared, oscillator) -> SpeedResponse:
    frequencies, limits = shared
    return swept(oscillator, jnp.asarray(frequencies), None, limits, sizes)
