"""Checks of a gear pair on concrete values; traced pairs pass."""

from typing import TYPE_CHECKING

import jax
import numpy as np

from ..numerics import check
from .involute import diameter
from .outline import outline

if TYPE_CHECKING:
    from .gear import Gear
    from .pair import GearPair


def check_pair(pair: "GearPair") -> None:
    """Raises a `ValueError` when the pair cannot run; see `GearPair`."""
    if any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(pair)):
        return
    for name, unit in (("module", "mm"), ("pressure_angle", "deg")):
        ours, theirs = np.asarray(getattr(pair.pinion, name)), np.asarray(getattr(pair.wheel, name))
        if not np.array_equal(ours, theirs):
            raise ValueError(
                f"GearPair: wheel {name} = {float(theirs.flat[0]):g} {unit} must equal the pinion's, "
                f"{float(ours.flat[0]):g} {unit}"
            )
    closest = float(np.max(pair.pinion.base_radius + pair.wheel.base_radius))
    check("GearPair", "center_distance", pair.center_distance, "mm", low=closest, open_low=True)
    _check_thickness(pair)
    _check_contact(pair)


def _check_thickness(pair: "GearPair") -> None:
    """Teeth thicker than the mate's spaces cannot be assembled on the given centre distance."""
    if pair.center_distance is None:
        return
    free = float(np.max(_backlash_free(pair).working_center_distance))
    # single precision resolves a centre distance to about 1e-7 of its value
    check("GearPair", "center_distance", pair.center_distance, "mm (backlash-free)", low=free * (1 - 1e-6))


def _backlash_free(pair: "GearPair") -> "GearPair":
    return type(pair)(pair.pinion, pair.wheel)


def _check_contact(pair: "GearPair") -> None:
    from .path import path_of_contact

    path = path_of_contact(pair)
    ratio = np.asarray(path.contact_ratio)
    if (ratio < 1).any():
        raise ValueError(
            f"GearPair: contact ratio = {float(ratio.min()):.4g} must be at least 1: raise a tip_diameter or addendum, "
            "or lower center_distance"
        )
    active = {
        "pinion": (pair.pinion, path.pinion_roll_length(path.start), "wheel"),
        "wheel": (pair.wheel, path.wheel_roll_length(path.end), "pinion"),
    }
    for name, (gear, rho, mate) in active.items():
        _check_interference(name, gear, rho, mate)


def _check_interference(name: str, gear: "Gear", rho, mate: str) -> None:
    form = np.asarray(diameter(gear, outline(gear).form_roll_length))
    reached, inside = np.asarray(diameter(gear, rho)), np.asarray(rho) < 0
    # a micrometre of the radius below the form circle is within the accuracy of any generated outline
    if inside.any() or (reached < form - 2e-3).any():
        below = " (below the base circle)" if inside.any() else ""
        raise ValueError(
            f"GearPair: {mate} tip_diameter reaches the {name}'s flank at diameter {float(reached.flat[0]):.6g} mm"
            f"{below}, must be at least its form diameter {float(form.flat[0]):.6g} mm"
        )
