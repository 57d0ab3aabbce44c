"""Sweep: evaluation of all variants of a plan into a table; devices and disk work concurrently."""

import re
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh as DeviceMesh

from ..conditions import Conditions, Design, Parameters, Variants, cycle_status, joined, label, solve_case, variants
from ..conditions.cases import Loads
from ..conditions.join import divided, everywhere, local_devices, over_devices, padded, side_by_side
from ..contact import Mesh, solve
from ..contact.operating_point import Torque
from ..contact.status import Status, status_of
from ..metrics import Analysis, Quantity, share_settings
from ..numerics import AbstractMeasure, Callback, Mean, Quantile, Worst, kernel, program, whole
from ..numerics.durable import digest
from ..tolerance import ManufacturedGears
from ..version import version
from ..vocabulary import quantities, quantity_of
from .columns import CAUSE, CONVERGED, FLAG, NUMBER, STATUS, parameter_columns, result_columns
from .plan import AbstractPlan
from .store import MANIFEST, Manifest, Store, load_manifest
from .table import SweepTable, in_memory, open_sweep

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
    """Evaluation of variants in blocks of one size by a single compiled program.

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


PART_ROWS = 2**17  # largest default number of variants of a part
_PARTS = 64  # default number of parts of a sweep: an interruption costs a small share of it
_SHARED_ROWS = 1024  # least of a part where several processes, of any devices, have to agree
_IN_FLIGHT = 2  # parts: one that the devices work on while the host writes the other
_POLL = 0.2  # seconds between two looks for the parts of other processes


def sweep(
    mesh: Mesh | Callable[[Parameters], Mesh],
    torque: Loads | Callable[[Parameters], Torque],
    design: Design,
    plan: AbstractPlan,
    *,
    results: Sequence[str | Quantity] = ("ppte",),
    measures: Sequence[AbstractMeasure] | None = None,
    output: str | Path | None = None,
    manufactured: ManufacturedGears | None = None,
    part_rows: int | None = None,
    title: str = "sweep",
    units: Mapping[str, str] | None = None,
    callback: Callback | None = None,
) -> SweepTable:
    """Evaluate every variant of a plan, on all local devices.

    With an output folder the rows are written part by part as Parquet, and memory does not depend on their number; the
    folder holds nothing else, so that `pandas.read_parquet(folder)` and `polars.scan_parquet(folder)` read it. An
    interrupted sweep resumes when it is called again with the same arguments: its table has the rows of an
    uninterrupted one to the last bit, on the same kind and number of devices (on another number to rounding). Parts
    that are damaged or displaced are evaluated again, with a warning of the logger "jaxgear" that names them. With
    several processes (`jax.distributed.initialize`) each writes its share of the parts into the same, shared folder,
    and all return the complete table.

    The variables of the plan may be anything that a variant depends on. Those of the flanks go through `design`; with
    functions of them as `mesh` and `torque` they are also the macro geometry and the load:

        jg.sweep(
            lambda v: jg.prepare(pair_of(v["shift"]), resolution=jg.Resolution(positions=32)),
            lambda v: v["torque"],
            lambda v: (jg.TipRelief(v["amount"], 4.0), None),
            plan,
        )

    Args:
        mesh: prepared mesh; or a function of the named variables that prepares one, traced.
        torque: torque on the pinion [N m], a `LoadSpectrum`, or a function of the named variables that returns a
            torque.
        design: function that returns (pinion, wheel) modifications from the named variables; traced, so it must be
            pure.
        plan: variants: `FullFactorial`, `LatinHypercube`, `Sobol` or `VariantList`.
        results: names of `metrics.quantities`, or your own quantities; only these are computed.
        measures: measures over torques and manufactured gears, a column each; None for `Mean()` and `Worst()` of
            several torques, with manufactured gears `Mean()` and `Quantile(0.95)`.
        output: folder of the table; None to keep the table in memory.
        manufactured: manufactured gears, the same for every variant; None for nominal gears.
        part_rows: variants per file, of which an interruption costs those under way; None for 64 files of at most
            131072 variants and at least as many as the devices evaluate at once, or for those of the sweep that is
            resumed. The rows do not depend on it.
        title: title of the table.
        units: units of the parameters, for the table.
        callback: called as callback(variants done, variants of this process, None) before the first part, when those of
            an earlier call are done already, and after every part.

    Returns:
        the table. A variant whose modification, gear pair or load is impossible or whose contact solution failed is a
        row with `converged` False and results NaN; its column `status` holds the reason, the name of a
        `contact.Status` in small letters, such as "more_pairs_needed".

    Raises:
        TypeError: for something else than a plan, and for functions that need the value of a traced variable.
        ValueError: for arguments out of range, unknown results, variables on which nothing depends, and an output
            folder that cannot be used or holds a sweep of other settings.
    """
    if part_rows is not None:
        whole("part_rows", part_rows)
    if not isinstance(plan, AbstractPlan):
        kind = type(plan).__name__
        raise TypeError(f"plan is a {kind}, must be FullFactorial, LatinHypercube, Sobol or VariantList")
    example = plan.rows(0, 1)[0]
    made = variants(mesh, torque, design, names=plan.names, values=example, manufactured=manufactured)
    traced = made.traced(jnp.asarray(example))
    wanted = [quantity_of(of) for of in results]
    joins = _measures(made.conditions, measures)
    few = plan.size * made.conditions.count <= FEW
    if part_rows is None:
        part_rows = _part_rows(made, example, plan.size, output)
    rows = min(part_rows, plan.size)
    evaluator = Evaluator(made, example, results=wanted, measures=joins, rows=rows, few=few)
    names = [column.name for column in evaluator.columns]
    columns = [NUMBER, *parameter_columns(plan, units or {}, names), *evaluator.columns, FLAG, CAUSE]
    settings = {
        **_settings(made, example, _design_digest(traced), plan, wanted),
        "columns": [column.name for column in columns],
        "variants": plan.size,
        "part_rows": part_rows,
        "tolerance": None
        if manufactured is None
        else {
            "limits": _digest(manufactured.tolerance),
            "samples": manufactured.samples,
            "seed": manufactured.seed,
        },
    }
    manifest = Manifest(title, tuple(columns), settings)
    if output is None:
        if jax.process_count() > 1:
            raise ValueError("output = None cannot gather the rows of several processes, name a shared folder")
        store, tables = Store("", manifest), []
        all_missing = dict.fromkeys(range(store.parts), True)
        _run(evaluator, plan, store, all_missing, lambda *part: tables.append(store.table(*part)), callback)
        return in_memory(title, columns, tables)
    store = Store(output, manifest)
    _fill(evaluator, plan, store, callback)
    return open_sweep(output)


def _part_rows(made: Variants, example: np.ndarray, variants: int, output: str | Path | None) -> int:
    """Default number of variants per part: as in the sweep already in the folder, or for about `_PARTS` parts."""
    if output is None:
        return PART_ROWS
    if (Path(output) / MANIFEST).is_file():
        return int(load_manifest(Path(output)).settings["part_rows"])
    batch = side_by_side(made.mesh_shape(example), made.conditions.count)
    least = LEAST_STEPS * batch * len(jax.local_devices()) if jax.process_count() == 1 else _SHARED_ROWS
    return min(max(-(-variants // _PARTS), least), PART_ROWS)


def _fill(evaluator: Evaluator, plan: AbstractPlan, store: Store, callback: Callback | None) -> None:
    """Write the missing parts of this process, and wait for the parts of the others."""
    own, leader = range(jax.process_index(), store.parts, jax.process_count()), jax.process_index() == 0
    store.claim(leader=leader)
    if not leader:
        _wait((store.folder / MANIFEST).exists)
        store.claim(leader=False)
    store.clean(own)
    there = store.found()
    _run(evaluator, plan, store, {part: part not in there for part in own}, store.write, callback)
    _wait(lambda: len(store.found()) >= store.parts)


def _run(evaluator: Evaluator, plan: AbstractPlan, store: Store, parts: dict[int, bool], keep, callback) -> None:
    """Evaluate the parts and pass each to `keep(part, columns)` in order; `parts` is True for missing parts."""
    rows = {part: store.span(part)[1] - store.span(part)[0] for part in parts}
    done, total = sum(rows[part] for part in parts if not parts[part]), sum(rows.values())
    report = callback or (lambda done, total, best: None)
    report(done, total, None)
    writer = ThreadPoolExecutor(1)
    under_way: deque[tuple[int, Future[Any]]] = deque()

    def finish(part: int, values: np.ndarray, results: Callable[[], dict[str, np.ndarray]]) -> None:
        keep(part, {**dict(zip(plan.names, values.T)), **results()})

    def settle() -> None:
        nonlocal done
        part, future = under_way.popleft()
        future.result()
        done += rows[part]
        report(done, total, None)

    try:
        for part in (part for part in parts if parts[part]):
            values = plan.rows(*store.span(part))
            under_way.append((part, writer.submit(finish, part, values, evaluator(values))))
            if len(under_way) >= _IN_FLIGHT:
                settle()
        while under_way:
            settle()
    finally:
        writer.shutdown(cancel_futures=True)


def _wait(there: Callable[[], bool]) -> None:
    while not there():
        time.sleep(_POLL)


def _measures(conditions: Conditions, given: Sequence[AbstractMeasure] | None) -> tuple[AbstractMeasure, ...]:
    """Requested measures; default measures if none are given, none for a single case."""
    if given is None:
        if conditions.samples > 1:
            return Mean(), Quantile()
        return (Mean(), Worst()) if conditions.count > 1 else ()
    if conditions.count == 1:
        raise ValueError("measures have no effect: one torque and nominal gears are a single case")
    names = [label(measure) for measure in given]
    if not names or len(set(names)) != len(names):
        raise ValueError(f"measures {', '.join(names) or '(none)'} must be different and at least one")
    return tuple(given)


def _settings(made: Variants, example: np.ndarray, identity: str, plan: AbstractPlan, results) -> dict[str, Any]:
    """Everything that determines the rows, as plain data."""
    load = made.conditions.load
    fixed = isinstance(made.mesh, Mesh)
    return {
        "plan": plan.describe(),
        "torques_Nm": None if made.torque is not None else np.asarray(load.torques).tolist(),
        "speeds_rpm": None if load.speeds is None else np.asarray(load.speeds).tolist(),
        "friction": None if load.friction is None else float(load.friction),
        "weights": np.asarray(load.weights).tolist(),
        "results": [of.key for of in results],
        "quantities": _own_digest(made, example, results),
        "design": identity,
        "mesh": _digest(made.mesh) if fixed else None,
        "precision": str(made.mesh_shape(example).slice_width.dtype),
        "platform": jax.local_devices()[0].platform,
        "jaxgear": version(),
        "jax": jax.__version__,
    }


def _digest(tree) -> str:
    """Digest of the numbers and the structure of a pytree."""
    leaves, structure = jax.tree.flatten(tree)
    return digest(_without_addresses(str(structure)), leaves)


def _design_digest(traced) -> str:
    """Digest of a traced program and its constants, which identifies a function across processes."""
    return digest(_without_addresses(str(traced.jaxpr)) + _digest(traced.consts))


def _own_digest(made: Variants, example: np.ndarray, results: Sequence[Quantity]) -> str | None:
    """Digest of the programs of quantities outside the vocabulary; None without any."""
    own = [of for of in results if quantities.get(of.name) is not of]
    if not own:
        return None

    def cycle(values):
        variant = made(values)
        first = variant.cases.first
        return solve(variant.mesh, first, pinion=variant.pinion, wheel=variant.wheel), variant.mesh

    bare, settings = share_settings(own)
    shape = eqx.filter_eval_shape(cycle, jnp.asarray(example))

    def numbers(cycle, mesh):
        analysis = Analysis(cycle, mesh, settings)
        return [of(analysis) for of in bare]

    traced, _, _ = eqx.filter_make_jaxpr(numbers)(*shape)
    return _design_digest(traced)


def _without_addresses(text: str) -> str:
    return re.sub(r" at 0x[0-9a-f]+", "", text)
