"""Files of the result of a study in a folder."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from ..io import write_summary
from ..io.folder import CONTENTS
from ..report import Figure
from .gear_data import gears
from .study import AbstractStudy, AbstractStudyResult
from .summary_data import identity, versions


def study_summary(study: AbstractStudy[Any], result: AbstractStudyResult) -> dict[str, Any]:
    """Contents of `summary.json`: design file, result, gears, and the ignored tables of the file."""
    design, left_out = study.design, "; ".join(line for line in (study.left_out, study.omits()) if line)
    return {
        **identity(design),
        **result.inputs(),
        **result.summary(),
        **gears(design),
        "versions": versions(),
        "quick": study.quick,
        **({"left_out": left_out} if left_out else {}),
    }


def write_study_summary(folder: Path, study: AbstractStudy[Any], result: AbstractStudyResult) -> dict[str, Any]:
    """Write `summary.json`, the last file of a result, with a list of all files; returns its contents."""
    name = "summary.json"
    contents = sorted({name, *(path.name for path in folder.iterdir())})
    data = {**study_summary(study, result), CONTENTS: contents}
    write_summary(folder / name, data)
    return data


def write_results(
    folder: str | Path, study: AbstractStudy[Any], result: AbstractStudyResult, *, figures: bool = True
) -> tuple[dict[str, Any], list[Path]]:
    """Write the files of a result, its figures and `summary.json`.

    Args:
        folder: folder of the files; made if missing.
        study: the study.
        result: result of the study.
        figures: True to draw figures; no window opens with a non-interactive backend of matplotlib.

    Returns:
        the contents of `summary.json` and the files of the figures.

    Raises:
        OSError: when a file cannot be written.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    result.write(folder)
    files = list(save_figures(folder, result.figures())) if figures else []
    return write_study_summary(folder, study, result), files


def save_figures(folder: Path, figures: Iterable[Figure], *, bold: str | None = None) -> dict[Path, str]:
    """Write figures to files under their names, the lines of one design bold; returns the captions by file."""
    from .. import plot

    saved = {}
    for figure in figures:
        if bold is not None:
            plot.emphasize(figure.figure, bold)
        saved[plot.save(figure.figure, folder / f"{figure.name}.png")] = figure.caption
    return saved
