"""Measures over all cases, and batches of contact analyses on devices.

All quantiles are Harrell-Davis estimates. They depend on many values, and so do their gradients; for few samples they
scatter less than the value at the level, for many samples both are equal.
"""

from collections.abc import Callable
from typing import Literal, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh as DeviceMesh
from jax.sharding import NamedSharding, PartitionSpec
from jaxtyping import Array, Float

from ..contact import Mesh
from ..numerics import AbstractMeasure, CVaR, Mean, Numbers, Quantile, Worst

Better = Literal["smaller", "larger"]
Tree = TypeVar("Tree")  # of arrays, as are the next two
Shared = TypeVar("Shared")
Result = TypeVar("Result")


def joined(
    measure: AbstractMeasure,
    values: Float[Array, " cases"],
    weights: Float[Array, " cases"],
    better: Better = "smaller",
) -> Float[Array, ""]:
    """Measure of the values of all cases; failed cases, NaN, rank beyond all others.

    Args:
        measure: measure over the cases.
        values: values of all cases, shape (cases,).
        weights: weights of the cases, shape (cases,).
        better: direction of improvement; for "larger" the worst value is the smallest, and 95 % of the cases exceed the
            95 % quantile.

    Returns:
        the measure, shape (); infinite on the bad side if failed cases contribute to it.
    """
    sign = 1.0 if better == "smaller" else -1.0
    bad = jnp.where(jnp.isfinite(values), sign * values, jnp.inf)
    return sign * measure(bad, weights)


def ranked(measure: AbstractMeasure, values: np.ndarray, better: Better = "smaller") -> np.ndarray:
    """Measure of many values of equal weight over the first axis, computed on the host; see `joined`."""
    count, sign = len(values), 1.0 if better == "smaller" else -1.0
    edges = jnp.arange(count + 1) / count
    shares = np.diff(np.asarray(measure.spread(edges, jnp.asarray(count, edges.dtype)))).astype(values.dtype)
    ordered = np.sort(np.where(np.isfinite(values), sign * values, np.inf), axis=0)
    carried = shares > 0
    # from the smallest on, so that equal values give that value to the last bit; it is infinite where all have failed
    smallest = np.where(np.isfinite(ordered[0]), ordered[0], 0.0).astype(values.dtype)
    return sign * (smallest + np.tensordot(shares[carried], ordered[carried] - smallest, 1))


def label(measure: AbstractMeasure) -> str:
    """Short name of a measure for columns of tables: mean, worst, q95, cvar95."""
    match measure:
        case Quantile():
            return f"q{100 * float(measure.level):g}"
        case CVaR():
            return f"cvar{100 * float(measure.level):g}"
        case Mean() | Worst():
            return type(measure).__name__.lower()
    return type(measure).__name__


def in_words(measure: AbstractMeasure) -> str:
    """Measure as a prefix of the name of a quantity: "mean", "95 % quantile of"."""
    match measure:
        case Quantile():
            return f"{100 * float(measure.level):g} % quantile of"
        case CVaR():
            return f"{100 * float(measure.level):g} % CVaR of"
    return label(measure)


# Contact points that advance side by side: on a CPU their arrays fit the cache, an accelerator needs many to be busy.
_SIDE_BY_SIDE = {"cpu": 2**12}
_SIDE_BY_SIDE_ELSEWHERE = 2**20
_MOST_DESIGNS = {"cpu": 512}
_AXIS = "designs"


def side_by_side(mesh: Mesh, cases: int = 1) -> int:
    """Number of designs per batch on one device, for designs with a number of cases."""
    size, platform = mesh.resolution, jax.local_devices()[0].platform
    points = size.positions * size.slices * cases
    designs = max(_SIDE_BY_SIDE.get(platform, _SIDE_BY_SIDE_ELSEWHERE) // points, 1)
    return min(designs, _MOST_DESIGNS.get(platform, designs))


def padded(rows: Numbers, multiple: int) -> np.ndarray:
    """Rows padded to a multiple of a number by repeats of the last row.

    Only whole batches are evaluated: a shorter batch would need another compilation.
    """
    rows = np.asarray(rows)
    return np.concatenate([rows, np.repeat(rows[-1:], -len(rows) % multiple, axis=0)])


def local_devices() -> DeviceMesh:
    """All devices of this process."""
    return DeviceMesh(np.asarray(jax.local_devices()), (_AXIS,))


def everywhere(tree: Tree, devices: DeviceMesh) -> Tree:
    """Arrays copied to all devices once."""
    return jax.device_put(tree, NamedSharding(devices, PartitionSpec()))


def divided(rows: Tree, devices: DeviceMesh) -> Tree:
    """Rows distributed to the devices; their number must be a multiple of the number of devices."""
    return jax.device_put(rows, NamedSharding(devices, PartitionSpec(_AXIS)))


def over_devices(
    function: Callable[[Shared, Tree], Result], rows: Tree, shared: Shared, *, batch: int | None, devices: DeviceMesh
) -> Result:
    """Values of function(shared, row) for every row, leading axis (rows,), distributed to the devices.

    Args:
        function: traceable function.
        rows: array or tree of arrays with a leading axis (rows,), a multiple of batch and number of devices.
        shared: arrays copied to every device.
        batch: number of rows per batch on a device; None for rows in sequence, each of which may be a batch itself.
        devices: devices from `local_devices`.
    """
    split, same = PartitionSpec(_AXIS), PartitionSpec()

    def on_device(rows: Tree, shared: Shared) -> Result:
        return jax.lax.map(lambda row: function(shared, row), rows, batch_size=batch)

    # without the check of replication, which the loops of the contact solution do not pass
    return jax.shard_map(on_device, mesh=devices, in_specs=(split, same), out_specs=split, check_vma=False)(
        rows, shared
    )
