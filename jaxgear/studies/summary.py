"""Files of the result of a study in a folder, and the parts of `summary.json` that studies have in common."""

import dataclasses
import platform
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import numpy as np

from ..contact import Mesh, Resolution
from ..io import DesignFile, describe, write_summary
from ..io.folder import CONTENTS
from ..io.table_keys import snake
from ..metrics import Finding
from ..microgeometry import AbstractModification
from ..numerics import Number, UnitKey, fields_of
from ..report import Figure
from ..version import version
from .gear_data import gears
from .study import AbstractStudy, AbstractStudyResult


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


def identity(file: DesignFile) -> dict[str, Any]:
    """Title, file name and project data, the beginning of every `summary.json`."""
    project = {"project": file.tables["project"].fields} if "project" in file.tables else {}
    return {"title": file.title, "design_file": file.path.name, **project}


def flanks_data(pinion: AbstractModification, wheel: AbstractModification) -> dict[str, Any]:
    """Modifications of both gears by their parts, as plain data."""
    return {"pinion_modification": describe(pinion), "wheel_modification": describe(wheel)}


def versions() -> dict[str, str]:
    """Versions of everything that a result depends on, by name."""
    return {
        "jaxgear": version(),
        "jax": jax.__version__,
        "numpy": np.__version__,
        "python": platform.python_version(),
        "platform": platform.platform(),
    }


def sizes(of: Resolution) -> dict[str, Any]:
    """Array sizes by name; `slide_steps` is the number in use, also if it was chosen automatically."""
    given = {field.name: getattr(of, field.name) for field in dataclasses.fields(of)}
    return given | {"slide_steps": of.chosen_slide_steps}


def model(mesh: Mesh) -> dict[str, Any]:
    """Parts of the compliance by name, with their options, and its plane state, as plain data."""
    return {"compliance": _options(mesh.compliance), "plane": mesh.compliance.plane}


def _options(part: eqx.Module) -> dict[str, Any]:
    """Type and options of a part, in the words of a design file; for tables their sizes."""
    data: dict[str, Any] = {"type": snake(type(part).__name__)}
    for field in dataclasses.fields(part):
        value = getattr(part, field.name)
        if isinstance(value, eqx.Module):
            data[field.name] = _options(value)
        elif np.ndim(value):
            data[field.name] = " x ".join(map(str, np.shape(value))) + " values"
        elif value is not None and field.name != "plane":
            data[field.name] = value if isinstance(value, str | bool | int) else np.asarray(value)
    return data


def finding_data(finding: Finding) -> dict[str, Any]:
    """Name, place, value and usual range of a finding, as plain data."""
    return {"name": finding.key, "where": finding.where, "value": finding.value, **finding.usual._asdict()}


def key_of(name: str, number: Number | None) -> UnitKey:
    """Key of a field, with the unit of a number."""
    return UnitKey(name, "" if number is None or number.unit == "x module" else number.unit)


def fields_data(part: eqx.Module, *, units: bool = False) -> dict[str, Any]:
    """Fields of a part, and of parts within it, that are not None; by name, or by name and unit."""
    given = {field.name: getattr(part, field.name) for field in dataclasses.fields(part)}
    numbers = fields_of(type(part)) if units else {}
    return {
        key_of(name, numbers.get(name)): fields_data(value) if isinstance(value, eqx.Module) else value
        for name, value in given.items()
        if value is not None
    }
