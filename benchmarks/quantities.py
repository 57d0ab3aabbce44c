"""What is compared: errors of a model against the finite-element reference, and the accuracy that is aimed at."""

from dataclasses import dataclass

import numpy as np

from .cases import Case, Curves, gear_pair, path_of_contact, relief_lengths

PATH_POINTS = "ABCDE"
_SMALLEST_PPTE = 2.0  # a smaller one is not divided by [um]: next to an optimum any error would be large


@dataclass(frozen=True)
class Quantity:
    """An error measure.

    Attributes:
        key: short name.
        title: what it is.
        unit: of the error.
    """

    key: str
    title: str
    unit: str


def errors(case: Case, model: Curves, truth: Curves) -> dict[str, float]:
    """All scalar errors of one case by the key of their quantity, signed unless they are the largest of many.

    A stiffness is left out where the reference never has that many loaded pairs.

    Args:
        case: the case.
        model: curves of the model, at the positions of the reference.
        truth: curves of the reference.
    """
    te, expected = model.transmission_error, truth.transmission_error
    mean, ppte = expected.mean(), np.ptp(expected)
    difference = te - truth.transmission_error
    share_error = np.abs(model.share - truth.share)
    flank = _flank_contact(model) & _flank_contact(truth)
    on_flank = np.isfinite(truth.pressure) & ((truth.force > 0) | (model.force > 0))
    smooth = on_flank & _away_from_edges(case, truth) & (truth.share > _LIGHT_SHARE)
    highest = np.nanmax(truth.pressure)
    pressure = np.nan_to_num(model.pressure)
    pressure_error = np.abs(pressure - truth.pressure) / highest
    found = {
        "mean": 100 * (te.mean() / mean - 1),
        "ppte": 100 * (np.ptp(te) - ppte) / max(ppte, _SMALLEST_PPTE),
        "ppte_um": np.ptp(te) - ppte,
        "rms": 100 * np.sqrt(np.mean(difference**2)) / mean,
        "shape": 100 * np.std(difference) / mean,
        "share_points": np.abs(share_at_points(case, model) - share_at_points(case, truth)).max(),
        "share_flank": share_error[:, flank].max(),
        "share": share_error.max(),
        "pressure_max": 100 * (pressure[on_flank].max() / highest - 1),
        "pressure": 100 * pressure_error[on_flank].max(),
        "pressure_smooth": 100 * pressure_error[smooth].max(),
    }
    for key, count in (("k1", 1), ("k2", 2)):
        if np.isfinite(stiffness(truth, count)):
            found[key] = 100 * (stiffness(model, count) / stiffness(truth, count) - 1)
    return found


def stiffness(curves: Curves, pairs: int) -> float:
    """Largest secant stiffness [N/um] over the positions with that many loaded pairs; nan if there are none."""
    chosen = (curves.force > 0).sum(axis=0) == pairs
    deflection = curves.transmission_error - curves.unloaded_transmission_error
    return (curves.force.sum(axis=0) / deflection)[chosen].max() if chosen.any() else np.nan


def share_at_points(case: Case, curves: Curves) -> np.ndarray:
    """Load share of a pair at the points A to E of its path, interpolated between positions."""
    path = path_of_contact(case.pair)
    points = [path.start, path.inner_single, 0.0, path.outer_single, path.end]
    pairs, positions = curves.share.shape
    # the last pair of the axis is the first on the path, two base pitches before the reference pair's position
    travelled = np.arange(pairs * positions) / positions - (pairs - 2)
    return np.interp(np.array(points) / path.base_pitch, travelled, curves.share[::-1].ravel())


def _flank_contact(curves: Curves) -> np.ndarray:
    """Positions in which no tip corner carries load."""
    return np.isfinite(curves.pressure).all(axis=0)


# Half widths between a contact and an edge beyond which Hertz's pressure holds within one percent in the reference.
_CLEARANCE = 2.0
# Below this load share the reference resolves a contact with a few elements only and its pressure is rough.
_LIGHT_SHARE = 0.1


def _away_from_edges(case: Case, curves: Curves) -> np.ndarray:
    """Contacts that stay clear of the tip corners and of the kinks where a relief starts, shape (pairs, positions)."""
    pair = gear_pair(case.pair)
    path = path_of_contact(case.pair)
    pairs, positions = curves.force.shape
    travelled = np.arange(positions) / positions + (pairs - 2) / 2 - np.arange(pairs)[:, None]
    position = travelled * path.base_pitch
    roll_lengths = path.pinion_pitch_roll_length + position, path.wheel_pitch_roll_length - position
    half_width = _half_width(case, curves.force, roll_lengths)
    clear = np.isfinite(curves.pressure)
    for gear, relieved, roll_length in zip((pair.pinion, pair.wheel), relief_lengths(case), roll_lengths):
        tip = float(gear.tip_roll_length)
        # a step in roll length is roll length / base radius times longer on the flank
        stretch = np.maximum(roll_length, 0.0) / float(gear.base_radius)
        for edge in (tip, tip - relieved):
            clear &= np.abs(roll_length - edge) * stretch > _CLEARANCE * half_width
    return clear


def _half_width(case: Case, force: np.ndarray, roll_lengths: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Hertzian half width [mm]; both gears are of one material."""
    pair = gear_pair(case.pair)
    first, second = (np.maximum(roll_length, 0.0) for roll_length in roll_lengths)
    reduced = first * second / (first + second)
    material = pair.pinion.material
    relaxed = 1.0 if case.plane == "stress" else 1 - float(material.poisson_ratio) ** 2
    compliance = 2 * relaxed / float(material.elastic_modulus)
    return np.sqrt(4 / np.pi * force / float(pair.face_width) * reduced * compliance)


# What the errors of the pressures of every model here come from.
PRESSURE_NOTE = (
    "The model gives Hertz's pressure of the involutes. Where the patch covers the kinked start of a relief the finite "
    "elements find up to 55 % more (singular for linear reliefs, so it grows with every refinement). Clear of kinks "
    "and tip corners the difference is that of the load."
)
QUANTITIES = (
    Quantity("mean", "mean TE", "%"),
    Quantity("ppte", "PPTE, of at least 2 um", "%"),
    Quantity("ppte_um", "PPTE", "um"),
    Quantity("rms", "TE curve, rms / mean TE", "%"),
    Quantity("shape", "TE variation, rms / mean TE", "%"),
    Quantity("k1", "single-pair stiffness", "%"),
    Quantity("k2", "double-pair stiffness", "%"),
    Quantity("share_points", "load share at A, B, C, D, E", ""),
    Quantity("share_flank", "load share, flank only", ""),
    Quantity("share", "load share, whole cycle", ""),
    Quantity("pressure_max", "largest flank pressure", "%"),
    Quantity("pressure", "flank pressure, everywhere", "%"),
    Quantity("pressure_smooth", "flank pressure, smooth flank", "%"),
)
