"""Files of the active profile of a grinding wheel: dressing points as CSV, and a drawing as DXF."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..io import writing
from ..io.results import write_csv
from ..numerics import check
from .wheel import GrindingWheel, WheelProfile

_WHEEL_COLUMNS = ("flank", "x_mm", "y_mm", "gear_diameter_mm", "roll_length_mm", "modification_um")
_WHEEL_DIGITS = 6  # behind the decimal point of a millimetre: a nanometre
_MILLIMETRES = 4  # INSUNITS of DXF
_LAYER = "WHEEL_PROFILE"
_AXIS = "WHEEL_MIDDLE"


def write_wheel_points(
    path: str | Path, left: WheelProfile, right: WheelProfile | None = None, *, wheel: GrindingWheel | None = None
) -> Path:
    """Writes the active profile of a wheel as CSV, in its frame: origin on its outer diameter in the middle plane.

    Args:
        path: file to write.
        left: profile of the flank at negative x.
        right: profile of the flank at positive x; None where both are alike.
        wheel: adds the radius of the wheel at every point.

    Returns:
        the path.

    Raises:
        ValueError: when the file cannot be written, or for a wheel whose axis the profile would reach.
    """
    if wheel is not None:
        deepest = max(float(np.max(profile.y)) for _, _, profile in _sides(left, right))
        check("radius of wheel", wheel.radius, "mm", low=deepest, open_low=True)
    columns = _WHEEL_COLUMNS if wheel is None else (*_WHEEL_COLUMNS, "wheel_radius_mm")
    with writing(path):
        write_csv(Path(path), columns, _wheel_rows(_sides(left, right), wheel), f".{_WHEEL_DIGITS}f")
    return Path(path)


def _wheel_rows(sides, wheel: GrindingWheel | None) -> Iterator[tuple[Any, ...]]:
    for name, sign, profile in sides:
        x, y, *rest = (np.asarray(values, float) for values in profile)
        radius = [] if wheel is None else [float(wheel.radius) - y]
        yield from ((name, *(value + 0.0 for value in row)) for row in zip(sign * x, y, *rest, *radius))


def write_wheel_drawing(path: str | Path, left: WheelProfile, right: WheelProfile | None = None) -> Path:
    """Writes the active profile of a wheel as DXF (R2010, mm): one polyline per flank, and the middle plane.

    Args:
        path: file to write.
        left: profile of the flank at negative x.
        right: profile of the flank at positive x; None where both are alike.

    Returns:
        the path.

    Raises:
        ValueError: when the file cannot be written.
        ModuleNotFoundError: without the package ezdxf, which the extra `cad` installs.
    """
    try:
        from ezdxf.filemanagement import new
    except ModuleNotFoundError:
        raise ModuleNotFoundError(
            "write_wheel_drawing: DXF files need the package ezdxf: pip install jaxgear[cad]"
        ) from None
    drawing = new("R2010", units=_MILLIMETRES)
    drawing.linetypes.add("CENTER", [2.0, 1.25, -0.25, 0.25, -0.25])
    drawing.layers.add(_LAYER)
    drawing.layers.add(_AXIS, linetype="CENTER")
    plane = drawing.modelspace()
    for _, sign, profile in _sides(left, right):
        plane.add_lwpolyline(np.stack([sign * np.asarray(profile.x), profile.y], axis=1), dxfattribs={"layer": _LAYER})
    plane.add_line((0.0, 0.0), (0.0, float(left.y[-1])), dxfattribs={"layer": _AXIS})
    with writing(path):
        drawing.saveas(path)
    return Path(path)


def _sides(left: WheelProfile, right: WheelProfile | None):
    yield "left", -1.0, left
    yield "right", 1.0, left if right is None else right
