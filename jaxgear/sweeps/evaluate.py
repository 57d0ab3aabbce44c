"""Evaluation of many variants on all local devices by one compiled program."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh as DeviceMesh
from jax.sharding import NamedSharding, PartitionSpec

from ..conditions import LoadSpectrum
from ..contact import Mesh, solve, solve_removed
from ..metrics import RESULTS
from ..microgeometry import AbstractModification
from ..numerics import maximum, minimum
from ..tolerance import Deviation, deviated_material
from .columns import CONVERGED, result_columns
from .possible import Possible

Design = Callable[[Mapping[str, Any]], tuple[AbstractModification | None, AbstractModification | None]]

_AXIS = "designs"
_SHARE = 0.95  # of the manufactured gears that are no worse than the quantile
# Contact points that advance side by side: on a CPU their arrays fit the cache, an accelerator needs many to be busy.
_SIDE_BY_SIDE = {"cpu": 2**12}
_SIDE_BY_SIDE_ELSEWHERE = 2**20
_MOST_DESIGNS = {"cpu": 512}
# A loop of one step is unrolled by the compiler and rounds differently: with two or more, the rows do not depend on how
# many devices share them.
_LEAST_STEPS = 2


class _Program(NamedTuple):
    """What is compiled for: everything that is neither an array nor its shape."""

    design: Design
    names: tuple[str, ...]
    results: tuple[str, ...]
    batch: int
    devices: DeviceMesh


class Evaluator:
    """Evaluates variants in blocks of one size, so that one compilation serves them all.

    Attributes:
        columns: the result columns.
        capacity: rows that a call evaluates; fewer are padded.
    """

    def __init__(
        self,
        design: Design,
        example: Mapping[str, float],
        *,
        mesh: Mesh,
        load: LoadSpectrum,
        results: Sequence[str],
        rows: int,
        deviations: Deviation | None = None,
    ):
        """Prepares the evaluation on all local devices.

        Args:
            design: makes (pinion, wheel) modifications from the named parameters.
            example: a value of every parameter.
            mesh: prepared mesh.
            load: torques and their weights.
            results: names of results.
            rows: largest number of variants of a call.
            deviations: sampled deviations, the same for every variant.

        Raises:
            ValueError: for unknown results, and for whatever the design or a result refuses.
        """
        torques = np.asarray(load.torques)
        samples = 1 if deviations is None else len(jax.tree.leaves(deviations)[0])
        self.columns = result_columns(results, torques.tolist(), scattered=deviations is not None)
        self._devices = DeviceMesh(np.asarray(jax.local_devices()), (_AXIS,))
        batch = _batch(mesh, cases=len(torques) * samples)
        steps = max(-(-rows // (batch * self._devices.size)), _LEAST_STEPS)
        self.capacity = steps * batch * self._devices.size
        self._program = _Program(design, tuple(example), tuple(results), batch, self._devices)
        # the sharding of every call: copied to the devices once, not per call
        self._data = jax.device_put((mesh, load, deviations), NamedSharding(self._devices, PartitionSpec()))
        self._dtype = np.dtype(mesh.phase.dtype)
        values = np.asarray(list(example.values()))
        self.possible = Possible(design, tuple(example), values)
        jax.eval_shape(partial(_numbers, self._program, *self._data), values.astype(self._dtype))

    def __call__(self, rows: np.ndarray) -> "Pending":
        """Starts the evaluation of at most `capacity` rows; the devices go on while the host does something else."""
        padded = np.empty((self.capacity, rows.shape[1]), self._dtype)
        padded[: len(rows)], padded[len(rows) :] = rows, rows[-1]
        placed = jax.device_put(padded, NamedSharding(self._devices, PartitionSpec(_AXIS)))
        return Pending(self, rows, *_evaluate(self._program, placed, self._data))


class Pending:
    """An evaluation that is under way."""

    def __init__(self, evaluator: Evaluator, rows: np.ndarray, values: list[jax.Array], converged: jax.Array):
        self.rows = rows
        self._evaluator, self._values, self._converged = evaluator, values, converged

    def arrays(self) -> dict[str, np.ndarray]:
        """Waits for the result columns and the flag; the numbers of failed variants are NaN."""
        count = len(self.rows)
        fine = np.asarray(self._converged)[:count] & self._evaluator.possible(self.rows)
        columns = {}
        for column, values in zip(self._evaluator.columns, self._values):
            numbers = np.asarray(values)[:count]
            columns[column.name] = numbers if fine.all() else np.where(fine, numbers, np.nan)
        return {**columns, CONVERGED: fine}


@partial(jax.jit, static_argnums=0)
def _evaluate(program: _Program, rows, data):
    split, everywhere = PartitionSpec(_AXIS), PartitionSpec()

    def on_device(rows, data):
        return jax.lax.map(partial(_numbers, program, *data), rows, batch_size=program.batch)

    # without the check of replication, which the loops of the contact solution do not pass
    run = jax.shard_map(on_device, mesh=program.devices, in_specs=(split, everywhere), out_specs=split, check_vma=False)
    return run(rows, data)


def _numbers(program: _Program, mesh: Mesh, load: LoadSpectrum, deviations, values):
    """Numbers of one variant in the order of the result columns, and whether all of it converged."""
    pinion, wheel = program.design({name: values[i] for i, name in enumerate(program.names)})

    def cycle_numbers(torque, deviation):
        if deviation is None:
            cycle = solve(mesh, torque, pinion=pinion, wheel=wheel)
        else:
            removed = deviated_material(mesh, torque, deviation, pinion=pinion, wheel=wheel)
            cycle = solve_removed(mesh, torque, removed)
        numbers = [RESULTS[name].of(cycle) for name in program.results]
        # the transmission error is asked too: reductions of the backend can drop NaN
        fine = jnp.all(cycle.converged) & jnp.isfinite(jnp.sum(cycle.transmission_error))
        return numbers, fine & jnp.all(jnp.isfinite(jnp.stack(numbers)))

    if deviations is None:
        return _over_torques(cycle_numbers, load, None, program.results)
    sampled, fine = jax.vmap(lambda deviation: _over_torques(cycle_numbers, load, deviation, program.results))(
        deviations
    )
    per_result = len(sampled) // len(program.results)
    statistics = []
    for index, values in enumerate(sampled):
        worst = RESULTS[program.results[index // per_result]].worst
        level = jnp.asarray(_SHARE if worst == "max" else 1 - _SHARE, values.dtype)
        statistics += [jnp.mean(values), jnp.quantile(values, level)]
    return statistics, jnp.all(fine)


def _over_torques(cycle_numbers, load: LoadSpectrum, deviation, results):
    """Numbers at one torque; or the weighted mean, the worst, and those at every torque."""
    if len(load.torques) == 1:
        return cycle_numbers(load.torques[0], deviation)
    numbers, fine = jax.vmap(lambda torque: cycle_numbers(torque, deviation))(load.torques)
    flat = []
    for name, values in zip(results, numbers):
        worst = maximum(values) if RESULTS[name].worst == "max" else minimum(values)
        flat += [jnp.sum(load.weights * values), worst, *values]
    return flat, jnp.all(fine)


def _batch(mesh: Mesh, *, cases: int) -> int:
    """Variants that advance side by side, the same for every number of devices."""
    size, platform = mesh.resolution, jax.local_devices()[0].platform
    points = size.positions * size.slices * cases
    designs = max(_SIDE_BY_SIDE.get(platform, _SIDE_BY_SIDE_ELSEWHERE) // points, 1)
    return min(designs, _MOST_DESIGNS.get(platform, designs))
