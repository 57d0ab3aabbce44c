"""Several runs through the same speeds in one program, for one oscillator or many designs, on all devices."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool

from ..conditions.join import divided, local_devices, over_devices, padded
from ..numerics import Numbers, kernel, program, whole
from .oscillator import Oscillator
from .response import SpeedResponse
from .speed_sweep import check_single, checked_frequencies, prepared, steps_for, swept

# Oscillators side by side: on a CPU the rows of their mesh forces stay in the cache, an accelerator needs many.
_SIDE_BY_SIDE, _SIDE_BY_SIDE_ELSEWHERE = 32, 4096


def side_by_side(batch: int | None) -> int:
    """Number of oscillators per batch on a device; None for the default of the device."""
    elsewhere = jax.local_devices()[0].platform != "cpu"
    return whole("batch", (_SIDE_BY_SIDE_ELSEWHERE if elsewhere else _SIDE_BY_SIDE) if batch is None else batch)


Responses = dict[str, SpeedResponse]
Direction = Literal["up", "down"]
_Directions = tuple[tuple[str, Direction], ...]  # names and directions of runs

# Designs whose mesh forces are made at the same time: those of a CPU fit its cache.
_MADE_TOGETHER, _MADE_TOGETHER_ELSEWHERE = 4, 64


class Run(NamedTuple):
    """Options of `speed_sweep` for one run through the speeds."""

    direction: Direction = "up"
    kick: Any = None
    kicks: Sequence[float] | jax.Array = ()


def with_like_kicks(runs: Mapping[str, Run]) -> dict[str, Run]:
    """Runs padded to the same number of kicks; padding kicks do nothing."""
    most = max(len(run.kicks) for run in runs.values())
    return {name: run._replace(kicks=(*run.kicks, *[1.0] * (most - len(run.kicks)))) for name, run in runs.items()}


def speed_runs(oscillator: Oscillator, mesh_frequencies: Numbers, runs: Mapping[str, Run], **options: Any) -> Responses:
    """Speed sweeps of one oscillator for several runs, in sequence in one program.

    Args:
        oscillator: a single oscillator.
        mesh_frequencies: increasing mesh frequencies [Hz], shape (speeds,).
        runs: options of every run, by name.
        options: further options of `speed_sweep`, except `start`.

    Raises:
        ValueError: as `speed_sweep`.
    """
    frequencies = checked_frequencies(mesh_frequencies)
    check_single(oscillator)
    if options.get("steps") is None:
        options["steps"] = steps_for(oscillator, frequencies)
    sizes, limits = _prepared(frequencies, runs, options)
    return _named(_of_one(oscillator, (frequencies, limits), sizes), _directions_of(runs))


def design_runs(
    make: Callable[[Any], Oscillator],
    designs: Any,
    mesh_frequencies: Numbers,
    runs: Mapping[str, Run],
    *,
    keep: Callable[[Responses], Any] | None = None,
    batch: int | None = None,
    **options: Any,
) -> Any:
    """Speed sweeps of many designs for several runs; oscillators are made batch by batch.

    Apart from the returned values, the memory does not grow with the number of designs.

    Args:
        make: function that returns the oscillator of one design; traced. The program is compiled once per function.
        designs: array or tree of arrays with a leading axis (designs,).
        mesh_frequencies: increasing mesh frequencies [Hz], shape (speeds,), the same for all designs.
        runs: options of every run, by name.
        keep: function of the responses of one design that returns the values to keep, a tree of arrays; traced. None to
            keep the responses.
        batch: number of designs per batch on a device; None for the default of the device.
        options: further options of `speed_sweep`, except `start`; `steps` are required, for instance by `steps_for` of
            the stiffest design.

    Returns:
        the kept values with a leading axis (designs,). For a design whose contacts have not converged, floating-point
        values are NaN, and every speed has the status of the contacts.

    Raises:
        ValueError: as `speed_sweep`, without `steps`, and for designs without a common leading axis.
    """
    frequencies = checked_frequencies(mesh_frequencies)
    if options.get("steps") is None:
        raise ValueError("steps must be given, as steps_for of the stiffest design gives them")
    return _in_batches(make, designs, frequencies, runs, keep=keep, batch=batch, **options)


def _in_batches(
    make, designs: Any, frequencies, runs: Mapping[str, Run], *, keep=None, batch: int | None, **options
) -> Any:
    """Runs of many designs as from `design_runs`, with checked frequencies."""
    lengths = {jnp.shape(part)[:1] for part in jax.tree.leaves(designs)}
    if len(lengths) != 1 or not all(lengths) or lengths == {(0,)}:
        raise ValueError("designs must be arrays with one leading axis, the same and not 0 for all")
    sizes, limits = _prepared(frequencies, runs, options)
    devices, (count,) = local_devices(), lengths.pop()
    batch = min(side_by_side(batch), -(-count // devices.size))

    def batches(part):
        rows = padded(part, batch * devices.size)
        return rows.reshape(-1, batch, *rows.shape[1:])

    rows = divided(jax.tree.map(batches, designs), devices)
    found = _of_designs(rows, (frequencies, limits), make, keep, _directions_of(runs), sizes, devices)
    found = jax.tree.map(lambda part: part.reshape(-1, *part.shape[2:])[:count], found)
    return found if keep else _named(found, _directions_of(runs), axis=1)


def speed_sweeps(
    oscillators: Oscillator, mesh_frequencies: Numbers, *, batch: int | None = None, **options: Any
) -> SpeedResponse:
    """Speed sweeps of many oscillators: designs, torques, or both.

    Apart from the results, the memory does not grow with the number of oscillators.

    Args:
        oscillators: oscillators with a leading axis on every array, for instance made with `jax.vmap`.
        mesh_frequencies: increasing mesh frequencies [Hz], shape (speeds,), the same for all.
        batch: number of oscillators per batch on a device; None for the default of the device.
        options: further options of `speed_sweep`, the same for all, except `start`: all start at static equilibrium.

    Returns:
        a `SpeedResponse` with a leading axis (oscillators,) on every array. For an oscillator whose contacts have not
        converged, floating-point values are NaN, and every speed has the status of the contacts.

    Raises:
        ValueError: in one line for a single oscillator, and as `speed_sweep`.
        TypeError: for an unknown option.
    """
    frequencies = checked_frequencies(mesh_frequencies)
    if oscillators.mass.ndim != 2:
        raise ValueError(
            f"oscillators have masses of shape {oscillators.mass.shape}, must be (oscillators, coordinates); "
            "make them with jax.vmap"
        )
    if options.get("steps") is None:
        options["steps"] = steps_for(oscillators, frequencies)
    run = Run(**{name: options.pop(name) for name in Run._fields if name in options})
    return _in_batches(_itself, oscillators, frequencies, {"": run}, batch=batch, **options)[""]


def _itself(oscillator: Oscillator) -> Oscillator:
    return oscillator


def _prepared(frequencies, runs: Mapping[str, Run], options: dict):
    """Static sizes of all runs, and the limits of each with a leading axis (runs,)."""
    each = [prepared(None, frequencies, **run._asdict(), **options) for run in with_like_kicks(runs).values()]
    return each[0][0], jax.tree.map(lambda *parts: jnp.stack(parts), *(limits for _, limits in each))


@kernel
def _of_one(oscillator: Oscillator, shared, sizes) -> SpeedResponse:
    """Responses with the axis of the runs in front."""
    frequencies, limits = shared
    # one after the other: side by side every one would wait for the others, each at another speed
    return jax.lax.map(lambda of_run: swept(oscillator, frequencies, None, of_run, sizes), limits)


@kernel
def _of_designs(rows, shared, make, keep, directions: _Directions, sizes, devices):
    """Responses of designs in batches, or `keep` of them, with the axes of batches and designs in front."""
    together = _MADE_TOGETHER if devices.devices.flat[0].platform == "cpu" else _MADE_TOGETHER_ELSEWHERE

    def of_design(shared, oscillator):
        frequencies, limits = shared
        converged = oscillator.converged
        # the others of a batch do not wait for a motion that is none
        limits = limits._replace(
            most_cycles=jnp.where(converged, limits.most_cycles, jnp.zeros_like(limits.most_cycles))
        )
        found = _of_one(oscillator, (frequencies, limits), sizes)
        found = replace(jax.tree.map(partial(_or_nothing, converged), found), status=found.status)
        return keep(_named(found, directions)) if keep else found

    def of_batch(shared, batch):
        oscillators = jax.lax.map(make, batch, batch_size=together)
        return jax.vmap(partial(of_design, shared))(oscillators)

    return over_devices(of_batch, rows, shared, batch=None, devices=devices)


def _or_nothing(converged: Bool[Array, ""], part: Array) -> Array:
    """Array if the mesh force has converged, else NaN (0 for integers)."""
    nothing = jnp.nan if jnp.issubdtype(part.dtype, jnp.floating) else 0
    return jnp.where(converged, part, jnp.full((), nothing, part.dtype))


def _directions_of(runs: Mapping[str, Run]) -> _Directions:
    return tuple((name, run.direction) for name, run in runs.items())


def _named(found: SpeedResponse, directions: _Directions, axis: int = 0) -> Responses:
    """Split responses along the axis of the runs; returns them by the name of the run."""
    each = _along(found, axis)
    return {name: replace(one, direction=direction) for one, (name, direction) in zip(each, directions, strict=True)}


@program
def _along(found: SpeedResponse, axis: int) -> list[SpeedResponse]:
    """Split a batch of responses along an axis."""
    leaves, structure = jax.tree.flatten(found)
    return [jax.tree.unflatten(structure, parts) for parts in zip(*(jnp.unstack(leaf, axis=axis) for leaf in leaves))]
