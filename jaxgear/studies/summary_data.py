"""Common parts of `summary.json`: design file, modifications, model, findings and versions."""

import dataclasses
import platform
from typing import Any

import equinox as eqx
import jax
import numpy as np

from ..contact import Mesh, Resolution
from ..io import DesignFile, describe
from ..io.table_keys import snake
from ..metrics import Finding
from ..microgeometry import AbstractModification
from ..numerics import Number, UnitKey, fields_of
from ..version import version


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
