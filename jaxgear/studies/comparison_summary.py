"""Designs side by side as plain data: every number of the designs, of the gears and of the model."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import equinox as eqx
import numpy as np

from ..contact import Mesh
from ..geometry import Gear
from ..io import DesignFile
from ..metrics import Finding
from ..numerics import Number, fields_of
from ..optimize import Verified
from ..shafts import RigidSupport
from . import manufactured
from .evaluation import Evaluation
from .gear_data import gears
from .side_by_side import Evaluations, diameters, reduction
from .summary_data import finding_data, flanks_data, model, sizes


def summary(
    file: DesignFile,
    mesh: Mesh,
    evaluations: Evaluations,
    torques: np.ndarray,
    found: Mapping[str, tuple[Finding, ...]],
) -> dict[str, Any]:
    """The designs, with the findings that were `found` of each."""
    pair = mesh.pair.coast if file.coast else mesh.pair  # of the hands that the file has
    return {
        "torque_Nm": file.signed_torque,
        "torque_range_Nm": file.torque_range,
        "speed_rpm": file.speed,
        "friction": file.friction,
        "gears": {name: _gear(getattr(pair, name)) | _drawn(drawn) for name, drawn in file.drawn.items()},
        "center_distance_mm": gears(file)["geometry"]["pair"]["center_distance_mm"],
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
        "resolution": sizes(mesh.resolution),
    }


def _design(evaluation: Evaluation) -> dict[str, Any]:
    return {
        **evaluation.metrics,
        "change_at_twice_the_positions": evaluation.grid_change,
        **({"objectives": evaluation.objectives} if evaluation.objectives else {}),
        **({"verified": _verified(evaluation.verified)} if evaluation.verified else {}),
        **manufactured.summary(evaluation),
        "failed_torques_Nm": evaluation.failed_torques,
        **flanks_data(evaluation.pinion, evaluation.wheel),
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
    """Drawing data of the file with `drawn_` before tooth thickness keys, to tell them from the numbers of the gear."""
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


def _misalignment(mesh: Mesh) -> dict[str, float]:
    """Misalignment over the face where the axes are not parallel [um]."""
    if not isinstance(mesh.support, RigidSupport):
        return {}
    return {"misalignment_um": float(mesh.support.misalignment.over_face(mesh.pair))}
