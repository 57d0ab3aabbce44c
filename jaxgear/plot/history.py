"""One base pitch of several pairs read as the whole history of one pair, or as two pitches of the mesh."""

import numpy as np

from ..contact import MeshCycle

PATH_LABEL = "path of contact from the pitch point [mm]"
PHASE_LABEL = "mesh phase [base pitches]"


def pair_history(cycle: MeshCycle, values) -> tuple[np.ndarray, np.ndarray]:
    """What one pair goes through from first to last contact.

    All pairs are alike and follow each other at one base pitch, so the pairs of a cycle, put in the order of their path
    positions, are the stages of one pair.

    Args:
        cycle: solved mesh cycle.
        values: shape (pairs, ..., positions).

    Returns:
        the path positions [mm], shape (pairs * positions,), and the values there, shape (..., pairs * positions).
    """
    path = np.asarray(cycle.kinematics.path).ravel()
    stages = np.moveaxis(np.asarray(values), 0, -2)
    stages = stages.reshape(*stages.shape[:-2], -1)
    order = np.argsort(path, kind="stable")
    return path[order], stages[..., order]


def path_limits(cycles) -> tuple[float, float]:
    """Path range that holds the path of contact and all loaded corner contact of these cycles, with some air [mm]."""
    low, high = [], []
    for cycle in cycles:
        contact = cycle.kinematics.path_of_contact
        loaded = np.asarray(cycle.kinematics.path)[np.asarray(cycle.pair_force) > 0]
        air = 0.1 * float(contact.base_pitch)
        low.append(min(float(contact.start), loaded.min(initial=np.inf)) - air)
        high.append(max(float(contact.end), loaded.max(initial=-np.inf)) + air)
    return min(low), max(high)


def two_pitches(phase, curve) -> tuple[np.ndarray, np.ndarray]:
    """Phase and curve over two base pitches, closed at the end.

    Args:
        phase: equally spaced over one base pitch, shape (positions,).
        curve: periodic values, shape (..., positions).
    """
    phase, curve = np.asarray(phase), np.asarray(curve)
    ends = [phase, phase + 1, phase[:1] + 2]
    return np.concatenate(ends), np.concatenate([curve, curve, curve[..., :1]], axis=-1)
