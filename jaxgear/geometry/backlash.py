"""Gear pairs with a specified backlash."""

from dataclasses import replace
from typing import Literal

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import Given, check, concrete, optional_real, program, real
from .gear import Gear
from .margins import distance_with, play_between
from .pair import GearPair
from .path import working_pressure_angle

Scalar = Float[Array, ""]
By = Literal["both", "pinion", "wheel", "center_distance"]

_BY = "both", "pinion", "wheel", "center_distance"
# Tolerance by which the other numbers may leave more than the specified backlash [um]: it is rounded to a micrometre.
_ROUNDED = 1.0


def pair_with_backlash(
    pinion: Gear,
    wheel: Gear,
    backlash: Given,
    *,
    center_distance: Given | None = None,
    axial_offset: Given = 0.0,
    by: By = "both",
) -> GearPair:
    """Gear pair with a given backlash of the unloaded, unmodified flanks, at the middle of the tolerances.

    The normal backlash is the backlash due to the centre distance, minus cos(normal pressure angle) times the sum of
    both mean tooth thickness allowances (ISO 21771).

    Args:
        pinion: driving gear.
        wheel: driven gear.
        backlash: normal backlash j_bn [um]; the backlash on the transverse line of action is j_bn / cos(beta_b).
        center_distance: centre distance [mm]; None for the backlash-free centre distance of the nominal tooth
            thicknesses.
        axial_offset: offset of the middle of the wheel face from the middle of the pinion face [mm].
        by: quantity adjusted to reach the backlash: the tooth thickness of "both" gears by the same amount, of the
            "pinion" or of the "wheel" alone, or the "center_distance".

    Raises:
        ValueError: if the other numbers leave more backlash than specified, if `center_distance` is both given and to
            be adjusted, and for all errors of `GearPair`.
    """
    if by not in _BY:
        raise ValueError(f"by = {by!r} must be one of {', '.join(_BY)}")
    backlash, distance = real(backlash), optional_real(center_distance)
    check("GearPair: backlash", backlash, "um", low=0.0)
    if by == "center_distance":
        if distance is not None:
            raise ValueError('GearPair: center_distance: cannot be given, by = "center_distance" finds it')
        distance = _distance(pinion, wheel, backlash / jnp.cos(pinion.base_helix_angle))
        return GearPair(pinion, wheel, distance, axial_offset=real(axial_offset))
    check("GearPair: center_distance", distance, "mm", low=0.0, open_low=True)
    play = _play(pinion, wheel, distance) * jnp.cos(pinion.base_helix_angle)
    _check_enough(backlash, play)
    missing = backlash - play
    missing = jnp.where(missing >= -_ROUNDED, jnp.maximum(missing, 0.0), missing)
    thinned = ("pinion", "wheel") if by == "both" else (by,)
    less = missing / (len(thinned) * jnp.cos(jnp.deg2rad(pinion.pressure_angle)))
    gears = {"pinion": pinion, "wheel": wheel}
    gears |= {name: _thinner(gears[name], less) for name in thinned}
    return GearPair(gears["pinion"], gears["wheel"], distance, real(axial_offset))


def _thinner(gear: Gear, less: Scalar) -> Gear:
    return replace(gear, tooth_thickness_allowance=gear.tooth_thickness_allowance - less)


@program
def _play(pinion: Gear, wheel: Gear, center_distance: Scalar | None) -> Scalar:
    if center_distance is None:
        return play_between(pinion, wheel, None)
    return play_between(pinion, wheel, jnp.tan(working_pressure_angle(pinion, wheel, center_distance)))


_distance = program(distance_with)


def _check_enough(backlash: Scalar, play: Scalar) -> None:
    wanted, there = concrete(backlash), concrete(play)
    if wanted is not None and there is not None and wanted < there - _ROUNDED:
        left = f"{float(there):.6g} um, which centre distance and tooth thicknesses leave"
        raise ValueError(f"GearPair: backlash = {float(wanted):g} um must be at least {left}")
