"""Table [sweep] of a design file: variants and results of a sweep."""

from collections.abc import Callable, Mapping
from typing import Any, Self

import numpy as np

from ..conditions import LoadSpectrum
from ..contact import OperatingPoint
from ..metrics import Quantity
from ..sweeps import AbstractPlan, FullFactorial, LatinHypercube, Sobol
from .design_file import DesignFile
from .errors import DesignFileError, referring, refused
from .named_quantities import quantity_named
from .rows import read_variants
from .table_keys import entry
from .tables import FurtherTable
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
        sampling: distribution of the variants over the bounds of the variables.
        samples: number of variants, of "sobol" and "latin_hypercube".
        seed: seed of "sobol" and "latin_hypercube".
        levels: values per variable, of "full_factorial": one number, or a number or list of values per variable.
        file: CSV or Parquet file of the variants, of "list".
        torques: torques on the pinion; the design torque alone without it.
        weights: weights of the torques.
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

    def check(self, design: DesignFile) -> None:
        """As a sweep does, but for a file of variants; refuses variants of nothing, and keys of another sampling."""
        if not design.bounds:
            raise DesignFileError("sweep", "has no effect without [variables]")
        others = [key for key in ("samples", "seed", "levels", "file") if key not in _KEYS[self.sampling]]
        self.refuse(others, f' with sampling = "{self.sampling}"')
        self.quantities(design)
        self.load(design)
        needed = _KEYS[self.sampling][0]  # the command line may give it
        if self.sampling != "list" and getattr(self, needed) is not None:
            self.plan(design)

    def arguments(self, design: DesignFile) -> dict[str, Any]:
        """Arguments of `jaxgear.sweep` besides design and mesh, and the highest torque of all variants [N m]."""
        results, (load, highest) = self.quantities(design), self.load(design)
        return {
            "plan": self.plan(design),
            "load": load,
            "highest_torque": highest,
            "results": results,
            "manufactured": manufactured_of(design),
            **({} if self.part_rows is None else {"part_rows": self.part_rows}),
            "title": design.title,
            "units": design.units,
        }

    def with_samples(self, samples: int | None, most: int | None) -> Self:
        """The table with another number of samples.

        Args:
            samples: number of variants; None for that of the table.
            most: upper limit; None without one.

        Raises:
            DesignFileError: for a kind of sampling without a number of samples.
        """
        if samples is not None and "samples" not in _KEYS[self.sampling]:
            problem = f'"{self.sampling}" takes no number of samples from the command line'
            raise DesignFileError("sweep.sampling", problem)
        count = self.samples if samples is None else samples
        return self if count is None else self.changed(samples=count if most is None else min(count, most))

    def quantities(self, design: DesignFile) -> tuple[str | Quantity, ...]:
        """The results, with settings from the tables of the design file where they take some."""
        wanted, results = self.results or _RESULTS, []
        for index, name in enumerate(wanted):
            results.append(quantity_named(design, f"sweep.results[{index}]", name))
            if name in wanted[:index]:
                raise DesignFileError(f"sweep.results[{index}]", f'"{name}" is given twice')
        return tuple(results)

    def load(self, design: DesignFile) -> tuple[LoadSpectrum | Callable[[Mapping[str, Any]], OperatingPoint], float]:
        """Torques and weights, or the operating point as a function of the variables, and the highest torque [N m]."""
        variables = {free.key: free.name for free in design.open_case if free.key.startswith("load.")}
        if not variables:
            load = design.spectrum(self)
            return load, float(np.max(load.torques))
        key, name = next(iter(variables.items()))
        self.refuse(["torques", "weights"], f', {key} is "{name}"')
        torque = variables.get("load.torque")
        return design.operating_point, design.torque if torque is None else design.bounds[torque][1]

    def plan(self, design: DesignFile) -> AbstractPlan:
        """The variants."""
        kind = self.sampling
        needed = _KEYS[kind][0]
        if getattr(self, needed) is None:
            raise DesignFileError(f"sweep.{needed}", f'missing, sampling = "{kind}" needs it')
        bounds, seed = design.bounds, self.seed or 0
        if kind == "list":
            with referring("sweep.file", str(self.file)):
                return read_variants(design.path.parent / str(self.file), bounds, design.units)
        if kind == "full_factorial":
            return refused("sweep.levels", FullFactorial, bounds, self.levels or 0)
        make = Sobol if kind == "sobol" else LatinHypercube
        return refused("sweep.samples", make, bounds, self.samples or 0, seed=seed)
