"""What the tables [sweep] and [tolerance] of a design file ask for."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ..conditions import LoadSpectrum
from ..contact import OperatingPoint
from ..metrics import Quantity
from ..sweeps import AbstractPlan, FullFactorial, LatinHypercube, Sobol
from ..tolerance import Tolerance
from .design_file import DesignFile
from .errors import DesignFileError, naming, referring, refuse_given, refused
from .named_quantities import quantity_named
from .requests import load_of, tolerance_of
from .rows import read_variants
from .schema import SweepSection

# The keys that a kind of sampling takes, the first of which it needs; what another kind takes has no effect and is
# refused.
_KEYS = {
    "sobol": ("samples", "seed"),
    "latin_hypercube": ("samples", "seed"),
    "full_factorial": ("levels",),
    "list": ("file",),
}
_RESULTS = ("ppte", "max_flank_pressure", "effective_contact_ratio")


@dataclasses.dataclass(frozen=True)
class SweepRequest:
    """A sweep, checked.

    Attributes:
        plan: the variants.
        load: torques and their weights, or the operating point as a function of the variables.
        highest_torque: that a variant can have [N m].
        results: names of results, or quantities.
        part_rows: variants per file of the table, None for the library's default.
        tolerance: of the gears, None where the file has none.
        samples, seed: of the tolerance's deviations.
    """

    plan: AbstractPlan
    load: LoadSpectrum | Callable[[Mapping[str, Any]], OperatingPoint]
    highest_torque: float
    results: tuple[str | Quantity, ...]
    part_rows: int | None
    tolerance: Tolerance | None
    samples: int | None
    seed: int


def sweep_request(design: DesignFile, *, samples: int | None = None, most: int | None = None) -> SweepRequest:
    """Checks what a design file says about a sweep.

    Args:
        design: the design file.
        samples: number of variants in place of the file's.
        most: upper limit of a number of samples, for a quick look.

    Raises:
        DesignFileError: for anything that is wrong with it, in one line that names the file and the key.
    """
    with naming(design.path):
        return _request(design, samples, most)


def _request(design: DesignFile, samples: int | None, most: int | None) -> SweepRequest:
    section = design.sweep
    if section is None:
        raise DesignFileError("sweep", "missing; it says which variants to evaluate")
    if samples is not None:
        if "samples" not in _KEYS[section.sampling]:
            problem = f'"{section.sampling}" takes no number of samples from the command line'
            raise DesignFileError("sweep.sampling", problem)
        section = section.changed(samples=samples)
    if most is not None and section.samples is not None:
        section = section.changed(samples=min(section.samples, most))
    results = _results(design, section)
    tolerance = design.tolerance
    load, highest = _load(design, section)
    return SweepRequest(
        plan=_plan(design, section),
        load=load,
        highest_torque=highest,
        results=results,
        part_rows=section.part_rows,
        tolerance=tolerance_of(design),
        samples=None if tolerance is None else tolerance.samples,
        seed=0 if tolerance is None else tolerance.seed,
    )


def check_sweep(design: DesignFile, section: SweepSection) -> None:
    """Checks the table [sweep] for commands that do not need it, but for a file of variants.

    Raises:
        DesignFileError: for anything that is wrong with it, in one line that names the key.
    """
    _results(design, section)
    _load(design, section)
    _check_keys(section)
    needed = _KEYS[section.sampling][0]  # the command line may give it
    if section.sampling != "list" and getattr(section, needed) is not None:
        _plan(design, section)


def _results(design: DesignFile, section: SweepSection) -> tuple[str | Quantity, ...]:
    wanted, results = section.results or _RESULTS, []
    for index, name in enumerate(wanted):
        results.append(quantity_named(design, f"sweep.results[{index}]", name))
        if name in wanted[:index]:
            raise DesignFileError(f"sweep.results[{index}]", f'"{name}" is there twice')
    return tuple(results)


def _load(design: DesignFile, section: SweepSection):
    """The load and the highest torque."""
    variables = {free.key: free.name for free in design.open_case if free.key.startswith("load.")}
    if not variables:
        load = load_of(design, "sweep", section)
        return load, float(np.max(load.torques))
    key, name = next(iter(variables.items()))
    refuse_given("sweep", section, ["torques", "weights"], f', {key} is "{name}"')
    torque = variables.get("load.torque")
    return design.operating_point, design.torque if torque is None else design.bounds[torque][1]


def _check_keys(section: SweepSection) -> None:
    others = [key for key in ("samples", "seed", "levels", "file") if key not in _KEYS[section.sampling]]
    refuse_given("sweep", section, others, f' with sampling = "{section.sampling}"')


def _plan(design: DesignFile, section: SweepSection) -> AbstractPlan:
    kind = section.sampling
    _check_keys(section)
    needed = _KEYS[kind][0]
    if getattr(section, needed) is None:
        raise DesignFileError(f"sweep.{needed}", f'missing, sampling = "{kind}" needs it')
    bounds, seed = design.bounds, section.seed or 0
    if kind == "list":
        with referring("sweep.file", str(section.file)):
            return read_variants(design.path.parent / str(section.file), bounds, design.units)
    if kind == "full_factorial":
        return refused("sweep.levels", FullFactorial, bounds, section.levels or 0)
    make = Sobol if kind == "sobol" else LatinHypercube
    return refused("sweep.samples", make, bounds, section.samples or 0, seed=seed)
