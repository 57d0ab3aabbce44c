"""What is compared: errors of a model against the finite-element reference, with the accuracy that the project aims at."""

from dataclasses import dataclass

import numpy as np

import jaxgear as jg

from .cases import Case, Curves, gear_pair, reliefs

PATH_POINTS = "ABCDE"
# PPTE counts within 5 % or 0.1 um, whichever is larger: the same as 5 % of at least 2 um.
_SMALLEST_PPTE = 2.0


@dataclass(frozen=True)
class Quantity:
    """An error measure.

    Attributes:
        key: short name.
        title: what it is.
        unit: of the error.
        goal: largest error that the project aims at; None where it states none.
        why: what the remaining error of the default model comes from.
    """

    key: str
    title: str
    unit: str
    goal: float | None
    why: str


def errors(case: Case, model: Curves, truth: Curves) -> dict[str, float]:
    """All signed scalar errors of one case by the key of their quantity; largest-of-many errors are positive."""
    te, expected = model.transmission_error, truth.transmission_error
    mean, ppte = expected.mean(), np.ptp(expected)
    difference = te - expected
    share_error = np.abs(model.share - truth.share)
    flank = _flank_contact(model) & _flank_contact(truth)
    on_flank = np.isfinite(truth.pressure) & ((truth.force > 0) | (model.force > 0))
    smooth = on_flank & _away_from_edges(case, truth)
    highest = np.nanmax(truth.pressure)
    pressure = np.nan_to_num(model.pressure)
    pressure_error = np.abs(pressure - truth.pressure) / highest
    return {
        "mean": 100 * (te.mean() / mean - 1),
        "ppte": 100 * (np.ptp(te) - ppte) / max(ppte, _SMALLEST_PPTE),
        "ppte_um": np.ptp(te) - ppte,
        "rms": 100 * np.sqrt(np.mean(difference**2)) / mean,
        "shape": 100 * np.std(difference) / mean,
        "k1": 100 * (stiffness(model, 1) / stiffness(truth, 1) - 1),
        "k2": 100 * (stiffness(model, 2) / stiffness(truth, 2) - 1),
        "share_points": np.abs(share_at_points(case, model) - share_at_points(case, truth)).max(),
        "share_flank": share_error[:, flank].max(),
        "share": share_error.max(),
        "pressure_max": 100 * (pressure[on_flank].max() / highest - 1),
        "pressure": 100 * pressure_error[on_flank].max(),
        "pressure_smooth": 100 * pressure_error[smooth].max(),
    }


def stiffness(curves: Curves, pairs: int) -> float:
    """Largest secant stiffness [N/um] over the positions with that many loaded pairs."""
    chosen = (curves.force > 0).sum(axis=0) == pairs
    deflection = curves.transmission_error - curves.unloaded_transmission_error
    return (curves.force.sum(axis=0) / deflection)[chosen].max()


def share_at_points(case: Case, curves: Curves) -> np.ndarray:
    """Load share of a pair at the points A to E of its path, interpolated between positions."""
    path = jg.path_of_contact(gear_pair(case.pair))
    points = [path.start, path.inner_single, 0.0, path.outer_single, path.end]
    pairs, positions = curves.share.shape
    # the last pair of the axis is the first on the path, two base pitches before the reference pair's position
    travelled = np.arange(pairs * positions) / positions - (pairs - 2)
    return np.interp(np.array([float(p / path.base_pitch) for p in points]), travelled, curves.share[::-1].ravel())


def _flank_contact(curves: Curves) -> np.ndarray:
    """Positions in which no tip corner carries load."""
    return np.isfinite(curves.pressure).all(axis=0)


# Half widths between a contact and an edge beyond which Hertz's pressure holds within one percent in the reference.
_CLEARANCE = 2.0


def _away_from_edges(case: Case, curves: Curves) -> np.ndarray:
    """Contacts that stay clear of the tip corners and of the kinks where a relief starts, shape (pairs, positions)."""
    pair = gear_pair(case.pair)
    path = jg.path_of_contact(pair)
    pairs, positions = curves.force.shape
    travelled = np.arange(positions) / positions + (pairs - 2) / 2 - np.arange(pairs)[:, None]
    position = travelled * float(path.base_pitch)
    line_load = curves.force / float(pair.face_width)
    half_width = 2 * line_load / (np.pi * np.where(curves.pressure > 0, curves.pressure, np.inf))
    clear = np.isfinite(curves.pressure)
    roll_lengths = path.pinion_roll_length(position), path.wheel_roll_length(position)
    for gear, relief, roll_length in zip((pair.pinion, pair.wheel), reliefs(case), roll_lengths):
        tip = float(gear.tip_roll_length)
        # a step in roll length is roll length / base radius times longer on the flank
        stretch = np.maximum(np.asarray(roll_length), 0.0) / float(gear.base_radius)
        for edge in (tip, tip - float(relief.length)) if relief.amount > 0 else (tip,):
            clear &= np.abs(np.asarray(roll_length) - edge) * stretch > _CLEARANCE * half_width
    return clear


QUANTITIES = (
    Quantity("mean", "mean TE", "%", 2.5, ""),
    Quantity("ppte", "PPTE, relative to at least 2 um", "%", 5.0, ""),
    Quantity("ppte_um", "PPTE", "um", None, ""),
    Quantity("rms", "TE curve, rms / mean TE", "%", 2.0, ""),
    Quantity("shape", "same, means removed", "%", 2.0, ""),
    Quantity("k1", "largest single-pair stiffness", "%", 3.0, ""),
    Quantity("k2", "largest double-pair stiffness", "%", None, ""),
    Quantity("share_points", "load share at A, B, C, D, E", "", 0.02, ""),
    Quantity("share_flank", "load share, no corner loaded", "", 0.02, ""),
    Quantity("share", "load share, whole cycle", "", 0.02, ""),
    Quantity("pressure_max", "largest flank pressure", "%", None, ""),
    Quantity("pressure", "flank pressure, pointwise", "%", None, ""),
    Quantity("pressure_smooth", "same, clear of corners and kinks", "%", None, ""),
)
