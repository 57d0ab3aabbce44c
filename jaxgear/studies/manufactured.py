"""Scatter of the results of designs over manufactured gears within the tolerances of the file."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ..contact import Mesh
from ..io import DesignFile
from ..io.tolerance_table import manufactured_of
from ..report import Chapter, Table
from ..sweeps import Scatter, monte_carlo
from ..tolerance import ManufacturedGears
from .evaluation import Evaluation
from .side_by_side import Evaluations, main

_QUICK_PAIRS = 16


def scattered(
    design: DesignFile, mesh: Mesh, evaluations: Evaluations, gears: ManufacturedGears
) -> dict[str, Evaluation]:
    """The evaluations with their scatter over manufactured gears, the same for all designs."""
    of = mesh, design.torque, gears
    return {
        name: replace(found, scatter=monte_carlo(*of, pinion=found.pinion, wheel=found.wheel))
        for name, found in evaluations.items()
    }


def lines(design: DesignFile, evaluations: Evaluations) -> Iterator[str]:
    """The main design in words; nothing without a table [tolerance]."""
    found = main(evaluations).scatter
    if found is not None:
        yield (
            f"{_pairs(design, found)}: PPTE {float(found.mean):.3f} um on average, 95 % below "
            f"{float(found.ppte_quantile95):.3f} um; {float(found.nominal_ppte):.3f} um without deviations"
        )


def failures(evaluations: Evaluations) -> Iterator[str]:
    """A line for every design of which manufactured pairs have failed."""
    for name, scatter in _scatters(evaluations).items():
        if scatter.failed:
            count = f"{scatter.failed} of {scatter.ppte.shape[0]}"
            yield f"CONTACT SOLUTION NOT CONVERGED: {name}, {count} manufactured pairs; they count as the worst"


def pages(design: DesignFile, evaluations: Evaluations) -> list[Chapter]:
    """The part of the report about robustness; nothing without a table [tolerance]."""
    scatters = _scatters(evaluations)
    if not scatters:
        return []
    table = Table(("", *scatters), title=f"PPTE over manufactured pairs, {design.torque:g} N m on the pinion")
    for label, of in (
        ("without deviations [um]", lambda scatter: scatter.nominal_ppte),
        ("mean [um]", lambda scatter: scatter.mean),
        ("standard deviation [um]", lambda scatter: scatter.std),
        ("95 % quantile [um]", lambda scatter: scatter.ppte_quantile95),
    ):
        table.add_row(label, *(f"{float(of(scatter)):.3f}" for scatter in scatters.values()))
    table.add_row("failed pairs", *(str(scatter.failed) for scatter in scatters.values()))
    scatter = next(iter(scatters.values()))
    text = (
        f"{_pairs(design, scatter)}, drawn at random within the limits of ISO 1328-1:2013, the same for every design."
    )
    even = " Deviations along the face are left out, as one slice cannot show them."
    return [Chapter("Robustness", [text + (even if design.resolution().slices == 1 else "")], tables=[table])]


def summary(evaluation: Evaluation) -> dict[str, Any]:
    """The scatter of a design as plain data."""
    scatter = evaluation.scatter
    if scatter is None:
        return {}
    return {
        "manufactured": {
            "pairs": scatter.ppte.shape[0],
            "failed": scatter.failed,
            "nominal_ppte_um": float(scatter.nominal_ppte),
            "mean_ppte_um": float(scatter.mean),
            "std_ppte_um": float(scatter.std),
            "q95_ppte_um": float(scatter.ppte_quantile95),
        }
    }


def figures(evaluations: Evaluations) -> dict[str, Any]:
    """Axes with the scatter of all designs; empty without a table [tolerance]."""
    scatters = _scatters(evaluations)
    if not scatters:
        return {}
    from .. import plot

    samples = {name: np.asarray(scatter.ppte) for name, scatter in scatters.items()}
    return {"ppte_distribution": plot.ppte_distribution(samples)}


def _scatters(evaluations: Evaluations) -> Mapping[str, Scatter]:
    return {name: found.scatter for name, found in evaluations.items() if found.scatter is not None}


def _pairs(design: DesignFile, scatter: Scatter) -> str:
    return pairs_in_words(design, scatter.ppte.shape[0])


def gears_of(design: DesignFile, *, quick: bool) -> ManufacturedGears | None:
    """The manufactured pairs that a design is judged by; None without the table [tolerance]."""
    return manufactured_of(design, _QUICK_PAIRS if quick else None)


def left_out(design: DesignFile, why: str = "") -> str:
    """That an analysis is of nominal gears though the file has tolerances; "" where it has none."""
    if "tolerance" not in design.tables:
        return ""
    return "[tolerance] is not part of this analysis, the gears are nominal" + f" ({why})" * bool(why)


def tolerances(design: DesignFile) -> dict[str, Any]:
    """Table [tolerance] as plain data; empty without the table."""
    return {"tolerances": design.tables["tolerance"].fields} if "tolerance" in design.tables else {}


def pairs_in_words(design: DesignFile, count: int) -> str:
    """How many manufactured pairs of which class."""
    classes = design.tables["tolerance"].quality_class
    named = "/".join(map(str, classes)) if isinstance(classes, list) else str(classes)
    return f"{count} manufactured pairs of quality class {named}"
