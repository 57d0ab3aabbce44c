"""Evaluation of many variants on all local devices by one compiled program."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh as DeviceMesh

from ..conditions import Variants, cycle_status, joined, solve_case
from ..conditions.join import divided, everywhere, local_devices, over_devices, padded, side_by_side
from ..contact.status import Status, status_of
from ..metrics import Analysis, Quantity, share_settings
from ..numerics import AbstractMeasure, kernel, program
from .columns import CONVERGED, STATUS, result_columns

# A loop of one step is unrolled by the compiler and rounds differently: with two or more, the rows do not depend on how
# many devices share them.
LEAST_STEPS = 2
# Contact analyses up to which a program that is compiled in a third of the time, to run half as fast, is done sooner.
FEW = 256


class _Task(NamedTuple):
    """Static arguments of the compiled evaluation: everything that is neither an array nor its shape."""

    rest: tuple[Any, ...]
    results: tuple[Quantity, ...]
    batch: int
    devices: DeviceMesh


class Evaluator:
    """Evaluates variants in blocks of one size, so that one compilation serves them all.

    Attributes:
        columns: columns of the results.
        capacity: number of rows of a call; fewer rows are padded.
    """

    def __init__(
        self,
        variants: Variants,
        example: np.ndarray,
        *,
        results: Sequence[Quantity],
        measures: Sequence[AbstractMeasure],
        rows: int,
        few: bool = False,
    ) -> None:
        """Prepares the evaluation on all local devices.

        Args:
            variants: variants as functions of the variables.
            example: a value of every variable.
            results: quantities to evaluate.
            measures: measures over the cases of a variant; empty for a single case.
            rows: largest number of variants of a call.
            few: True if compilation takes longer than all evaluations.

        Raises:
            ValueError: for no or repeated results, and for all errors of the variants or of a result.
        """
        conditions = variants.conditions
        self.columns = result_columns(results, conditions, measures)
        self._devices = local_devices()
        mesh = variants.mesh_shape(example)
        batch = side_by_side(mesh, conditions.count)
        steps = max(-(-rows // (batch * self._devices.size)), LEAST_STEPS)
        self.capacity = steps * batch * self._devices.size
        bare, settings = share_settings(results)
        arrays, rest = eqx.partition((variants, tuple(measures), settings), eqx.is_array)
        self._evaluate = _evaluate_few if few else _evaluate
        self._task = _Task(rest, bare, batch, self._devices)
        self._data = everywhere(arrays, self._devices)
        self._dtype = np.dtype(mesh.slice_width.dtype)
        jax.eval_shape(partial(_numbers, self._task, self._data), example.astype(self._dtype))

    def __call__(self, rows: np.ndarray) -> Callable[[], dict[str, np.ndarray]]:
        """Start the evaluation of at most `capacity` rows, asynchronously to the host.

        Returns:
            function that waits for the evaluation and returns the result columns, the flag and the numbers of `Status`;
            results of failed variants are NaN.
        """
        placed = divided(padded(rows.astype(self._dtype), self.capacity), self._devices)
        values, status = self._evaluate(self._task, placed, self._data)

        def finished() -> dict[str, np.ndarray]:
            count = len(rows)
            given = np.where(np.isfinite(rows).all(axis=1), Status.CONVERGED, Status.OUT_OF_VALIDITY)
            causes = np.maximum(np.asarray(status)[:count], given.astype(np.int8))
            fine = causes == Status.CONVERGED
            columns = {}
            for column, of_column in zip(self.columns, values):
                numbers = np.asarray(of_column)[:count]
                columns[column.name] = numbers if fine.all() else np.where(fine, numbers, np.nan)
            return {**columns, CONVERGED: fine, STATUS: causes}

        return finished


@kernel
def _evaluate(task: _Task, rows, data):
    return over_devices(partial(_numbers, task), rows, data, batch=task.batch, devices=task.devices)


@program
def _evaluate_few(task: _Task, rows, data):
    return over_devices(partial(_numbers, task), rows, data, batch=task.batch, devices=task.devices)


def _numbers(task: _Task, data, values):
    """Numbers of one variant in the order of the result columns, and its status over all cases."""
    variants, measures, settings = eqx.combine(data, task.rest)
    variant = variants(values)

    def of_case(operating_point, deviation):
        cycle = solve_case(variant.mesh, operating_point, variant.pinion, variant.wheel, deviation)
        analysis = Analysis(cycle, variant.mesh, settings)
        numbers = jnp.stack([of(analysis) for of in task.results])
        infinite = ~jnp.all(jnp.isfinite(numbers))
        return numbers, status_of({Status.NOT_CONVERGED: infinite}, cycle_status(cycle))

    numbers, status = variant.cases.each(of_case)
    flat = []
    for of, of_cases in zip(task.results, numbers.T):
        flat += _joined(of_cases, variant.cases, measures, of.better)
    return flat, jnp.maximum(jnp.max(status), variant.status)


def _joined(values, cases, measures, better):
    """A result's numbers of all cases in the order of its columns."""
    if not measures:
        return [values[0]]
    found = [joined(measure, values, cases.weights, better) for measure in measures]
    if len(cases.torque) == 1:
        return found
    by_torque = values.reshape(len(cases.torque), cases.samples)
    if cases.samples == 1:
        return [*found, *by_torque[:, 0]]
    alike = jnp.ones_like(by_torque[0])
    return [*found, *(joined(measure, row, alike, better) for row in by_torque for measure in measures)]
