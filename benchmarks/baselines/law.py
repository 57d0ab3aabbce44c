"""The contact law and its slope in NumPy: depth-referenced Hertz with the softening of the nearest tip corner.

The formulas and their sources stand in `jaxgear.compliance.hertz` and `jaxgear.compliance.edge`.
"""

import numpy as np

from .problem import Law

# the two constants of the law, as in jaxgear
LOAD_FLOOR = 1e-6
APEX_DISTANCE = 1.82


def deflection(law: Law, load: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Approach of the flanks [um] and its derivative by the line load [um per N/mm].

    Args:
        law: arrays that broadcast against `load` when pinion and wheel are taken apart.
        load: line load [N/mm], not negative.
    """
    shifted = load + LOAD_FLOOR
    squared = law.width_factor * shifted
    log_squared = np.log(squared)
    # bracket: deflection over load; growth: its derivative by ln(load + floor)
    bracket, growth = np.zeros_like(squared), np.zeros_like(squared)
    for compliance, depth, poisson in zip(law.compliance, law.depth, law.poisson):
        root = np.sqrt(depth**2 + squared)
        reach = root + depth
        change = 0.5 * squared / (root * reach)
        bracket += compliance * (np.log(reach) - 0.5 * log_squared - poisson * depth / reach)
        growth += compliance * (change - 0.5 + poisson * depth / reach * change)
    position = law.distance / np.sqrt(squared)
    cut, cut_growth, mean_log, mean_growth = _truncated(position)
    log_span = np.log(law.reach / APEX_DISTANCE) - 0.5 * log_squared - mean_log
    bracket += 1e3 * (law.truncation * cut + law.wedge * 0.25 * np.logaddexp(0.0, 4 * log_span))
    # the position falls with the square root of the load
    onset = 1 / (1 + np.exp(-4 * log_span))
    growth += 1e3 * (law.truncation * cut_growth + law.wedge * onset * (-0.5 - mean_growth))
    return load * bracket, bracket + growth * load / shifted


def _truncated(position):
    """Phi and the mean logarithm of a contact cut off at the corner, each with its derivative by ln(load)."""
    cut_off = position < 1
    tau = np.where(cut_off, position, 0.0)
    root = np.sqrt(tau**2 + 3)
    inside = tau > 0
    length = np.where(inside, 2 / 3 * (tau + root), 2 / (root - np.minimum(tau, 0.0)))
    half = 0.5 * length - tau
    sagitta = np.where(inside, half**2, length * (0.25 * length - tau))
    # d length / d tau = length / root
    sagitta_slope = np.where(inside, half * (length / root - 2), length * ((0.5 * length - tau) / root - 1))
    phi = 0.5 * sagitta + length**2 / 16 + 0.5 * np.log(2 / length) - 0.25
    phi_slope = 0.5 * sagitta_slope + (length**2 / 8 - 0.5) / root
    full = np.where(cut_off, 2.0, position)
    growth = full + np.sqrt(full**2 - 1)
    mean_log = np.where(cut_off, np.log(0.25 * length) + 0.5, np.log(0.5 * growth) + 0.5 / growth**2)
    mean_slope = np.where(cut_off, 1 / root, 2 / growth)
    by_log_load = -0.5 * position
    return (
        np.where(cut_off, phi, 0.0),
        np.where(cut_off, by_log_load * phi_slope, 0.0),
        mean_log,
        by_log_load * mean_slope,
    )
