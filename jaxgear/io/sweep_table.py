"""Table [sweep] of a design file: variants and results of a sweep."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ..conditions import LoadSpectrum
from ..contact import OperatingPoint
from ..metrics import Quantity
from ..sweeps import AbstractPlan, FullFactorial, LatinHypercube, Sobol
from ..tolerance import ManufacturedGears
from .design_file import DesignFile
from .errors import DesignFileError, naming, referring, refused
from .named_quantities import quantity_named
from .rows import read_variants
from .table_keys import entry
from .tables import FurtherTable, Rest
from .tolerance_table import manufactured_of
from .value_types import LEVEL, SEED, WEIGHTS, choice, count, either, list_of, positive, real, table, text

# The keys that a kind of sampling takes, the first of which it needs; what another kind takes has no effect and is
# refused.
_KEYS = {
    "sobol": ("samples", "seed"),
    "latin_hypercube": ("samples", "seed"),
    "full_factorial": ("levels",),
    "list": ("file",),
}
_RESULTS = ("ppte", "max_flank_pressure", "effective_contact_ratio")


_LEVELS = either(
    LEVEL,
    table(either(LEVEL, list_of(real()), "a whole number or a list of values")),
    "a whole number, or a table with one entry per variable",
)


class SweepSection(FurtherTable):
    """Variants to be evaluated by `jaxgear sweep`.

    Attributes:
        sampling: how they are spread over the bounds of the variables.
        samples: number of variants, of "sobol" and "latin_hypercube".
        seed: of the same.
        levels: values per variable, of "full_factorial": one number, or a number or list of values per variable.
        file: CSV or Parquet file of the variants, of "list".
        torques: on the pinion; the design torque alone without it.
        weights: of the torques.
        results: quantities to be listed.
        part_rows: variants per file of the table; without it there are about 64 files.
    """

    table = "sweep"

    sampling: str = entry(choice("sobol", "latin_hypercube", "full_factorial", "list"), "sobol")
    samples: int | None = entry(count(1, 2**40))
    seed: int | None = entry(SEED)
    levels: int | dict[str, int | list[float]] | None = entry(_LEVELS)
    file: str | None = entry(text())
    torques: list[float] | None = entry(list_of(positive("N m")))
    weights: list[float] | None = entry(WEIGHTS)
    results: list[str] | None = entry(list_of(text()))
    part_rows: int | None = entry(count(1, 2**24))

    def check_beside(self, rest: Rest) -> None:
        """Refuses variants of nothing, and what another kind of sampling takes."""
        if not rest.bounds:
            raise DesignFileError("sweep", "has no effect without [variables]")
        others = [key for key in ("samples", "seed", "levels", "file") if key not in _KEYS[self.sampling]]
        self.refuse(others, f' with sampling = "{self.sampling}"')

    def check(self, design: DesignFile) -> None:
        """As a sweep does, but for a file of variants."""
        _results(design, self)
        _load(design, self)
        needed = _KEYS[self.sampling][0]  # the command line may give it
        if self.sampling != "list" and getattr(self, needed) is not None:
            _plan(design, self)


@dataclasses.dataclass(frozen=True)
class SweepRequest:
    """A sweep, checked.

    Attributes:
        plan: the variants.
        load: torques and their weights, or the operating point as a function of the variables.
        highest_torque: that a variant can have [N m].
        results: names of results, or quantities.
        part_rows: variants per file of the table, None for the library's default.
        manufactured: manufactured gears, None where the file has no tolerances.
    """

    plan: AbstractPlan
    load: LoadSpectrum | Callable[[Mapping[str, Any]], OperatingPoint]
    highest_torque: float
    results: tuple[str | Quantity, ...]
    part_rows: int | None
    manufactured: ManufacturedGears | None


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
    section = design.needed("sweep", "it says which variants to evaluate")
    if samples is not None:
        if "samples" not in _KEYS[section.sampling]:
            problem = f'"{section.sampling}" takes no number of samples from the command line'
            raise DesignFileError("sweep.sampling", problem)
        section = section.changed(samples=samples)
    if most is not None and section.samples is not None:
        section = section.changed(samples=min(section.samples, most))
    results = _results(design, section)
    load, highest = _load(design, section)
    return SweepRequest(
        plan=_plan(design, section),
        load=load,
        highest_torque=highest,
        results=results,
        part_rows=section.part_rows,
        manufactured=manufactured_of(design),
    )


def _results(design: DesignFile, section: SweepSection) -> tuple[str | Quantity, ...]:
    wanted, results = section.results or _RESULTS, []
    for index, name in enumerate(wanted):
        results.append(quantity_named(design, f"sweep.results[{index}]", name))
        if name in wanted[:index]:
            raise DesignFileError(f"sweep.results[{index}]", f'"{name}" is given twice')
    return tuple(results)


def _load(design: DesignFile, section: SweepSection):
    """The load and the highest torque."""
    variables = {free.key: free.name for free in design.open_case if free.key.startswith("load.")}
    if not variables:
        load = design.spectrum(section)
        return load, float(np.max(load.torques))
    key, name = next(iter(variables.items()))
    section.refuse(["torques", "weights"], f', {key} is "{name}"')
    torque = variables.get("load.torque")
    return design.operating_point, design.torque if torque is None else design.bounds[torque][1]


def _plan(design: DesignFile, section: SweepSection) -> AbstractPlan:
    kind = section.sampling
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
