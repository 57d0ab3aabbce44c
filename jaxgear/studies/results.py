"""Files of the result of a study in a folder."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..io import write_summary
from .gear_data import gears
from .study import AbstractStudy, AbstractStudyResult
from .summary_data import identity, versions


def study_summary(study: AbstractStudy[Any], result: AbstractStudyResult) -> dict[str, Any]:
    """Contents of `summary.json`: the result between its design file and its gears, and what it leaves out."""
    design, left_out = study.design, "; ".join(line for line in (study.left_out, study.omits()) if line)
    return {
        **identity(design),
        **result.summary(),
        **gears(design),
        "versions": versions(),
        "quick": study.quick,
        **({"left_out": left_out} if left_out else {}),
    }


def write_results(
    folder: str | Path, study: AbstractStudy[Any], result: AbstractStudyResult, *, figures: bool = True
) -> tuple[dict[str, Any], list[Path]]:
    """Writes `summary.json`, the further files of a result and its figures.

    Args:
        folder: for the files; made where it is missing.
        study: the study.
        result: what it has found.
        figures: whether figures are drawn, which opens no window where the backend of matplotlib has none.

    Returns:
        the contents of `summary.json` and the files of the figures.

    Raises:
        OSError: when a file cannot be written.
    """
    data, folder = study_summary(study, result), Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    write_summary(folder / "summary.json", data)
    result.write(folder)
    return data, save_figures(folder, result.figures()) if figures else []


def save_figures(folder: Path, axes: Mapping[str, Any], *, bold: str | None = None) -> list[Path]:
    """Writes the figures that hold the axes, each under its name, the lines of one design bold; gives the files."""
    from .. import plot

    figures = {name: np.ravel(drawn)[0].figure for name, drawn in axes.items()}
    if bold is not None:
        for figure in figures.values():
            plot.emphasize(figure, bold)
    return [plot.save(figure, folder / f"{name}.png") for name, figure in figures.items()]
