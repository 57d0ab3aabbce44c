"""What a run writes as `summary.json`: every number of its designs, its gears and its model."""

import dataclasses
import platform
from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax
import numpy as np

from ..contact import Mesh, Resolution
from ..geometry import Gear
from ..io import DesignFile, describe
from ..io.table_keys import snake
from ..metrics import Finding
from ..numerics import Number, fields_of
from ..optimize import Verified
from ..shafts import RigidSupport
from . import manufactured
from .geometry import gears
from .report import Evaluations, diameters, reduction
from .study import Evaluation
from .version import version


def summary(
    file: DesignFile,
    mesh: Mesh,
    evaluations: Evaluations,
    torques: np.ndarray,
    found: Mapping[str, tuple[Finding, ...]],
) -> dict[str, Any]:
    """Contents of `summary.json`, with the findings that were `found` of every design."""
    of_gears = gears(file)
    return {
        **identity(file),
        "torque_Nm": file.torque,
        "torque_range_Nm": file.torque_range,
        "speed_rpm": file.speed,
        "friction": file.friction,
        "gears": {name: _gear(getattr(mesh.pair, name)) | _drawn(drawn) for name, drawn in file.drawn.items()},
        "center_distance_mm": of_gears["geometry"]["pair"]["center_distance_mm"],
        **_misalignment(mesh),
        **manufactured.tolerances(file),
        **{name: _numbers(part) for name in ("lubricant", "strength") if (part := file.tables.get(name)) is not None},
        "model": model(mesh),
        "designs": {
            name: {**_design(evaluations[name]), "findings": [finding_data(finding) for finding in several]}
            for name, several in found.items()
        },
        "ppte_reduction_percent": reduction(evaluations),
        "ppte_over_torque": {
            "torque_Nm": torques,
            **{f"{name}_um": evaluation.ppte for name, evaluation in evaluations.items()},
        },
        "iso_6336": {name: evaluation.factors for name, evaluation in evaluations.items()},
        **of_gears,
        "resolution": sizes(mesh.resolution),
        "versions": versions(),
    }


def identity(file: DesignFile) -> dict[str, Any]:
    """What every `summary.json` begins with."""
    project = {"project": file.tables["project"].given()} if "project" in file.tables else {}
    return {"title": file.title, "design_file": file.path.name, **project}


def _design(evaluation: Evaluation) -> dict[str, Any]:
    return {
        **evaluation.metrics,
        "change_at_twice_the_positions": evaluation.grid_change,
        **({"objectives": evaluation.objectives} if evaluation.objectives else {}),
        **({"verified": _verified(evaluation.verified)} if evaluation.verified else {}),
        **manufactured.summary(evaluation),
        "failed_torques_Nm": evaluation.failed_torques,
        "pinion_modification": describe(evaluation.pinion),
        "wheel_modification": describe(evaluation.wheel),
        "time_s": evaluation.seconds,
    }


def _verified(found: Verified) -> dict[str, Any]:
    objectives = {"objectives": found.objectives} if found.objectives else {}
    return {"structure": "finite_element", "ppte_um": found.ppte, **objectives}


def _gear(gear: Gear) -> dict[str, Any]:
    """Every number of a gear, with those that follow from others where the file gives none."""
    derived = dict(zip(("tip_diameter", "tip_form_diameter", "bore_diameter"), diameters(gear)))
    data: dict[str, Any] = {}
    for part in (gear, gear.material):
        for name, field in fields_of(type(part)).items():
            data[_key(name, field)] = np.asarray(derived.get(name, getattr(part, name)))
    data["bore_given"] = gear.bore_diameter is not None
    return data


def _drawn(given: Mapping[str, Any]) -> dict[str, Any]:
    """What the file gives beside the numbers of the gear, whose names stay those of the numbers that it means."""
    return {f"drawn_{name}" if name.startswith("tooth_thickness") else name: value for name, value in given.items()}


def _numbers(part: eqx.Module) -> dict[str, Any]:
    """Numbers and choices that a part has, by name and unit."""
    given = {field.name: getattr(part, field.name) for field in dataclasses.fields(part)}
    numbers = fields_of(type(part))
    return {
        _key(name, numbers[name]) if name in numbers else name: value
        for name, value in given.items()
        if value is not None
    }


def _key(name: str, field: Number) -> str:
    unit = "" if field.unit == "x module" else field.unit.replace(" ", "").replace("/", "_per_")
    return f"{name}_{unit}" if unit else name


def versions() -> dict[str, str]:
    """Of everything that a result depends on, by name."""
    return {
        "jaxgear": version(),
        "jax": jax.__version__,
        "numpy": np.__version__,
        "python": platform.python_version(),
        "platform": platform.platform(),
    }


def sizes(of: Resolution) -> dict[str, Any]:
    """Array sizes by name."""
    return {field.name: getattr(of, field.name) for field in dataclasses.fields(of)}


def model(mesh: Mesh) -> dict[str, Any]:
    """The compliance by the names of its parts, with their options, and its plane state."""
    return {"compliance": _options(mesh.compliance), "plane": mesh.compliance.plane}


def _misalignment(mesh: Mesh) -> dict[str, float]:
    """Misalignment over the face where the axes are not parallel [um]."""
    if not isinstance(mesh.support, RigidSupport):
        return {}
    return {"misalignment_um": float(mesh.support.misalignment.over_face(mesh.pair))}


def _options(part: eqx.Module) -> dict[str, Any]:
    """The type of a part and its options, in the words of a design file; of tables their sizes."""
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
    """A finding by name, place, value and what is usual."""
    return {"name": finding.name, "where": finding.where, "value": finding.value, **finding.limit._asdict()}
