"""Scatter of the results of designs over manufactured gears within the tolerances of the file."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from operator import attrgetter
from typing import Any

import numpy as np

from ..contact import Mesh
from ..io import DesignFile
from ..io.tolerance_table import manufactured_of
from ..report import Chapter, Figure, Record, numbers_of, table_of
from ..sweeps import Scatter, monte_carlo
from ..tolerance import ManufacturedGears
from .evaluation import Evaluation
from .side_by_side import Evaluations, main

_QUICK_PAIRS = 16


def scattered(
    design: DesignFile, mesh: Mesh, evaluations: Evaluations, gears: ManufacturedGears
) -> dict[str, Evaluation]:
    """Evaluations with their scatter over manufactured gears; all designs get the same samples."""
    of = mesh, design.torque, gears
    return {
        name: replace(found, scatter=monte_carlo(*of, pinion=found.pinion, wheel=found.wheel))
        for name, found in evaluations.items()
    }


def lines(design: DesignFile, evaluations: Evaluations) -> Iterator[str]:
    """Lines on the scatter of the main design; none without a table [tolerance]."""
    found = main(evaluations).scatter
    if found is not None:
        yield (
            f"{_pairs(design, found)}: PPTE {float(found.mean):.3f} um on average, 95 % below "
            f"{float(found.ppte_quantile95):.3f} um; {float(found.nominal_ppte):.3f} um without deviations"
        )


def failures(evaluations: Evaluations) -> Iterator[str]:
    """Line for every design with manufactured pairs that have not converged."""
    for name, scatter in _scatters(evaluations).items():
        if scatter.failed:
            count = f"{scatter.failed} of {scatter.ppte.shape[0]}"
            yield f"CONTACT SOLUTION NOT CONVERGED: {name}, {count} manufactured pairs; they count as the worst"


_RECORDS: tuple[Record[Scatter], ...] = (
    Record("nominal_ppte", "um", attrgetter("nominal_ppte"), "without deviations [um]"),
    Record("mean_ppte", "um", attrgetter("mean"), "mean [um]"),
    Record("std_ppte", "um", attrgetter("std"), "standard deviation [um]"),
    Record("q95_ppte", "um", attrgetter("ppte_quantile95"), "95 % quantile [um]"),
    Record("failed", "", attrgetter("failed"), "failed pairs", "d"),
    Record("pairs", "", lambda of: of.ppte.shape[0]),
)


def pages(design: DesignFile, evaluations: Evaluations) -> Iterator[Chapter]:
    """Chapter of a report on robustness; none without a table [tolerance]."""
    scatters = _scatters(evaluations)
    if scatters:
        title = f"PPTE over manufactured pairs, {design.torque:g} N m on the pinion"
        pairs = _pairs(design, next(iter(scatters.values())))
        text = f"{pairs}, drawn at random within the limits of ISO 1328-1:2013, the same for every design."
        even = " Deviations along the face are left out, as one slice cannot show them."
        text += even * (design.resolution().slices == 1)
        yield Chapter("Robustness", [text], tables=[table_of(_RECORDS, scatters, title, across=True)])


def summary(evaluation: Evaluation) -> dict[str, Any]:
    """Scatter of a design over manufactured gears, as plain data; empty without a scatter."""
    return {} if evaluation.scatter is None else {"manufactured": numbers_of(_RECORDS, evaluation.scatter)}


def figures(evaluations: Evaluations) -> Iterator[Figure]:
    """Figure of the scatter of all designs; nothing without a table [tolerance]."""
    from .. import plot

    samples = {name: np.asarray(scatter.ppte) for name, scatter in _scatters(evaluations).items()}
    if samples:
        yield Figure.of(plot.ppte_distribution, samples)


def _scatters(evaluations: Evaluations) -> Mapping[str, Scatter]:
    return {name: found.scatter for name, found in evaluations.items() if found.scatter is not None}


def _pairs(design: DesignFile, scatter: Scatter) -> str:
    return pairs_in_words(design, scatter.ppte.shape[0])


def gears_of(design: DesignFile, *, quick: bool) -> ManufacturedGears | None:
    """Manufactured gears of a design file; None without the table [tolerance]."""
    return manufactured_of(design, _QUICK_PAIRS if quick else None)


def left_out(design: DesignFile, why: str = "") -> str:
    """Message that an analysis ignores the table [tolerance] of the file; "" if the file has none."""
    if "tolerance" not in design.tables:
        return ""
    return "[tolerance] is not part of this analysis, the gears are nominal" + f" ({why})" * bool(why)


def tolerances(design: DesignFile) -> dict[str, Any]:
    """Table [tolerance] as plain data; empty without the table."""
    return {"tolerances": design.tables["tolerance"].fields} if "tolerance" in design.tables else {}


def pairs_in_words(design: DesignFile, count: int) -> str:
    """Number and quality class of manufactured pairs, in words."""
    classes = design.tables["tolerance"].quality_class
    named = "/".join(map(str, classes)) if isinstance(classes, list) else str(classes)
    return f"{count} manufactured pairs of quality class {named}"
