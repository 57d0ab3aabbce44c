"""How many contact analyses advance side by side, on one device and on all of them."""

import jax
import numpy as np
from jax.sharding import Mesh as DeviceMesh
from jax.sharding import NamedSharding, PartitionSpec

from ..contact import Mesh

# Contact points that advance side by side: on a CPU their arrays fit the cache, an accelerator needs many to be busy.
_SIDE_BY_SIDE = {"cpu": 2**12}
_SIDE_BY_SIDE_ELSEWHERE = 2**20
_MOST_DESIGNS = {"cpu": 512}
_AXIS = "designs"


def side_by_side(mesh: Mesh, cases: int = 1) -> int:
    """Designs of so many cases that advance side by side on a device, whatever the number of devices."""
    size, platform = mesh.resolution, jax.local_devices()[0].platform
    points = size.positions * size.slices * cases
    designs = max(_SIDE_BY_SIDE.get(platform, _SIDE_BY_SIDE_ELSEWHERE) // points, 1)
    return min(designs, _MOST_DESIGNS.get(platform, designs))


def padded(rows, multiple: int):
    """Rows repeated at the end up to a multiple.

    Whole batches only: a rest would be a program of its own, compiled for the length of the contact solution.
    """
    rows = np.asarray(rows)
    return np.concatenate([rows, np.repeat(rows[-1:], -len(rows) % multiple, axis=0)])


def local_devices() -> DeviceMesh:
    """All devices of this process."""
    return DeviceMesh(np.asarray(jax.local_devices()), (_AXIS,))


def everywhere(tree, devices: DeviceMesh):
    """Arrays copied to all devices, once and not per call."""
    return jax.device_put(tree, NamedSharding(devices, PartitionSpec()))


def divided(rows, devices: DeviceMesh):
    """Rows shared out among the devices; their number is a multiple of the number of devices."""
    return jax.device_put(rows, NamedSharding(devices, PartitionSpec(_AXIS)))


def over_devices(function, rows, shared, *, batch: int | None, devices: DeviceMesh):
    """function(shared, row) of every row, rows leading: each device takes its share, `batch` rows side by side.

    Args:
        function: traceable.
        rows: array or tree of arrays with as many leading entries, a multiple of batch and number of devices.
        shared: arrays that every device holds.
        batch: rows side by side on a device; None for one after the other, each of which may be a batch itself.
        devices: as `local_devices` gives them.
    """
    split, same = PartitionSpec(_AXIS), PartitionSpec()

    def on_device(rows, shared):
        return jax.lax.map(lambda row: function(shared, row), rows, batch_size=batch)

    # without the check of replication, which the loops of the contact solution do not pass
    return jax.shard_map(on_device, mesh=devices, in_specs=(split, same), out_specs=split, check_vma=False)(
        rows, shared
    )
