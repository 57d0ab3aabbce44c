"""A sweep: variants in, table out, with the devices and the disk at work at the same time."""

import hashlib
import re
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from importlib import metadata
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..conditions import LoadSpectrum
from ..contact import Mesh, removed_material
from ..numerics import whole
from ..tolerance import Tolerance, sample_deviations
from .columns import CONVERGED, VARIANT, Column, parameter_columns
from .evaluate import Design, Evaluator, Pending
from .plan import AbstractPlan
from .store import MANIFEST, Manifest, Store
from .table import SweepTable, in_memory, open_sweep

Callback = Callable[[int, int], None]

PART_ROWS = 2**17
_IN_FLIGHT = 2  # parts: one that the devices work on while the host writes the other
_POLL = 0.2  # seconds between two looks for the parts of other processes


def sweep(
    design: Design,
    plan: AbstractPlan,
    *,
    mesh: Mesh,
    torque,
    results: Sequence[str] = ("ppte",),
    output: str | Path | None = None,
    tolerance: Tolerance | None = None,
    samples: int = 64,
    seed: int = 0,
    part_rows: int = PART_ROWS,
    title: str = "sweep",
    units: Mapping[str, str] | None = None,
    callback: Callback | None = None,
) -> SweepTable:
    """Evaluates every variant of a plan, on all local devices.

    With an output folder the rows are written part by part as Parquet, and memory does not depend on their number; the
    folder holds nothing else, so that `pandas.read_parquet(folder)` and `polars.scan_parquet(folder)` read it. An
    interrupted sweep resumes when it is called again with the same arguments: its table has the rows of an
    uninterrupted one to the last bit, on the same kind and number of devices (on another number to rounding). Parts
    that are damaged or displaced are evaluated again, with a warning of the logger "jaxgear" that names them. With
    several processes (`jax.distributed.initialize`) each writes its share of the parts into the same, shared folder,
    and all return the complete table.

    Args:
        design: makes (pinion, wheel) modifications from the named parameters; traced, so it must be pure.
        plan: the variants: `FullFactorial`, `LatinHypercube`, `Sobol` or `VariantList`.
        mesh: prepared mesh.
        torque: on the pinion [N m], scalar, or a `LoadSpectrum`.
        results: names of `metrics.RESULTS`; only these are computed.
        output: folder of the table; None keeps it in memory.
        tolerance: evaluates every variant under the same random deviations; None for the nominal design.
        samples: deviations of a tolerance.
        seed: of the deviations.
        part_rows: variants per file.
        title: of the table.
        units: of the parameters, for the table.
        callback: called as callback(variants done, variants of this process) before the first part, when those of an
            earlier call are done already, and after every part.

    Returns:
        the table. A variant whose modification is impossible or whose contact solution failed is a row with
        `converged` False and results NaN.

    Raises:
        ValueError: for arguments out of range, unknown results, and an output folder that cannot be used or holds a
            sweep of other settings.
    """
    whole("sweep", "part_rows", part_rows)
    load = LoadSpectrum.of(torque)
    deviations = None if tolerance is None else sample_deviations(tolerance, mesh, samples, seed=seed)
    example = dict(zip(plan.names, plan.rows(0, 1)[0]))
    evaluator = Evaluator(
        design,
        example,
        mesh=mesh,
        load=load,
        results=results,
        rows=min(part_rows, plan.size),
        deviations=deviations,
    )
    columns = _columns(plan, units or {}, evaluator)
    settings = {
        **_settings(design, example, plan, mesh, load, results),
        "columns": [column.name for column in columns],
        "variants": plan.size,
        "part_rows": part_rows,
        "tolerance": None if tolerance is None else {"limits": _digest(tolerance), "samples": samples, "seed": seed},
    }
    manifest = Manifest(title, tuple(columns), settings)
    if output is None:
        if jax.process_count() > 1:
            raise ValueError("sweep: output = None cannot gather the rows of several processes, name a shared folder")
        store, tables = Store("", manifest), []
        all_missing = dict.fromkeys(range(store.parts), True)
        _run(evaluator, plan, store, all_missing, lambda *part: tables.append(store.table(*part)), callback)
        return in_memory(title, columns, tables)
    store = Store(output, manifest)
    _fill(evaluator, plan, store, callback)
    return open_sweep(output)


def _fill(evaluator: Evaluator, plan: AbstractPlan, store: Store, callback: Callback | None) -> None:
    """Writes the missing parts of this process, and waits for those of the others."""
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
    """Evaluates parts and hands them to `keep(part, columns)` in order; `parts` tells of each whether it is missing."""
    rows = {part: store.span(part)[1] - store.span(part)[0] for part in parts}
    done, total = sum(rows[part] for part in parts if not parts[part]), sum(rows.values())
    report = callback or (lambda done, total: None)
    report(done, total)
    writer = ThreadPoolExecutor(1)
    under_way: deque[tuple[int, Future]] = deque()

    def finish(part: int, pending: Pending) -> None:
        keep(part, {**dict(zip(plan.names, pending.rows.T)), **pending.arrays()})

    def settle() -> None:
        nonlocal done
        part, future = under_way.popleft()
        future.result()
        done += rows[part]
        report(done, total)

    try:
        for part in (part for part in parts if parts[part]):
            pending = evaluator(plan.rows(*store.span(part)))
            under_way.append((part, writer.submit(finish, part, pending)))
            if len(under_way) >= _IN_FLIGHT:
                settle()
        while under_way:
            settle()
    finally:
        writer.shutdown(cancel_futures=True)


def _wait(there: Callable[[], bool]) -> None:
    while not there():
        time.sleep(_POLL)


def _columns(plan: AbstractPlan, units: Mapping[str, str], evaluator: Evaluator) -> list[Column]:
    names = [column.name for column in evaluator.columns]
    return [
        Column(VARIANT, "", "number"),
        *parameter_columns(plan, units, names),
        *evaluator.columns,
        Column(CONVERGED, "", "flag"),
    ]


def _settings(design, example, plan, mesh: Mesh, load: LoadSpectrum, results) -> dict[str, Any]:
    """Everything that determines the rows, as plain data."""
    return {
        "plan": plan.describe(),
        "torques_Nm": np.asarray(load.torques).tolist(),
        "weights": np.asarray(load.weights).tolist(),
        "results": list(results),
        "design": _design_digest(design, example, mesh, load),
        "mesh": _digest(mesh),
        "precision": str(mesh.phase.dtype),
        "platform": jax.local_devices()[0].platform,
        "jaxgear": _version("jaxgear"),
        "jax": jax.__version__,
    }


def _digest(tree) -> str:
    """Digest of the numbers and the structure of a pytree."""
    leaves, structure = jax.tree.flatten(tree)
    digest = hashlib.sha256(_without_addresses(str(structure)).encode())
    for leaf in leaves:
        array = np.asarray(leaf)
        digest.update(f"{array.dtype}{array.shape}".encode() + array.tobytes())
    return digest.hexdigest()


def _design_digest(design: Design, example: Mapping[str, float], mesh: Mesh, load: LoadSpectrum) -> str:
    """Digest of what the design computes: a function has no other identity that outlives the process."""

    def removed(parameters, mesh):
        pinion, wheel = design(parameters)
        return removed_material(mesh, load.torques[0], pinion=pinion, wheel=wheel)

    parameters = {name: jnp.asarray(value, mesh.phase.dtype) for name, value in example.items()}
    traced, _, _ = eqx.filter_make_jaxpr(removed)(parameters, mesh)
    text = _without_addresses(str(traced.jaxpr))
    return hashlib.sha256(text.encode() + _digest(traced.consts).encode()).hexdigest()


def _without_addresses(text: str) -> str:
    return re.sub(r" at 0x[0-9a-f]+", "", text)


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "unknown (not installed)"
