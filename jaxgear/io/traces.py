"""Charts for a measuring machine as CSV.

Columns end in their unit; `design_um` and `measured_um` have the sign of the machines, positive for excess material.
"""

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..manufacture import Trace
from .folder import writing

_PLACE = {
    "face_coordinate_mm": "face_coordinate",
    "roll_angle_deg": "roll_angle",
    "roll_length_mm": "roll_length",
    "diameter_mm": "diameter",
    "design_um": "design",
    "upper_um": "upper",
    "lower_um": "lower",
}
MEASURED = "measured_um"
_SAME_PLACE = 1e-3  # mm, of a measured and a designed point
_DIGITS = 9  # behind the decimal point: what is read and written again does not drift


def write_traces(path: str | Path, traces: Sequence[Trace], measured: Sequence[Trace] | None = None) -> Path:
    """Writes traces of a flank as CSV, one row per point, as measuring machines and their operators read them.

    Columns: trace, face_coordinate_mm, roll_angle_deg, roll_length_mm, diameter_mm, design_um, upper_um, lower_um and,
    with `measured`, measured_um. Limits are empty outside the evaluation range.

    Args:
        path: file to write.
        traces: of one flank, of `profile_trace` and `helix_trace`.
        measured: of the same places, trace by trace; None for the design alone.

    Returns:
        the path.

    Raises:
        ValueError: when the file cannot be written, or measured traces have other places.
    """
    columns = {name: [np.asarray(getattr(trace, field)) for trace in traces] for name, field in _PLACE.items()}
    if measured is not None:
        shapes = [[np.shape(trace.design) for trace in many] for many in (traces, measured)]
        if shapes[0] != shapes[1]:
            raise ValueError(f"write_traces: measured has traces of {shapes[1]} points, must be {shapes[0]}")
        for number, (one, other) in enumerate(zip(traces, measured)):
            for field in ("roll_length", "face_coordinate"):
                if not np.allclose(getattr(one, field), getattr(other, field), rtol=0, atol=_SAME_PLACE):
                    raise ValueError(f"write_traces: {field} of measured trace {number} is not that of the design")
        columns[MEASURED] = [np.asarray(trace.design) for trace in measured]
    with writing(path), Path(path).open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["trace", *columns])
        for number, trace in enumerate(traces):
            for row in zip(*(values[number] for values in columns.values())):
                writer.writerow([trace.kind, *map(_text, row)])
    return Path(path)


def _text(value: float) -> str:
    """The shortest text of a number, nothing for NaN."""
    return "" if np.isnan(value) else repr(round(float(value), _DIGITS) + 0.0)
