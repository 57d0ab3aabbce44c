"""Pairs made for a backlash, as a drawing or a specification names it."""

from dataclasses import replace
from typing import Literal

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import Given, check, concrete, optional_real, program, real
from .gear import Gear
from .margins import play_between, thickening
from .pair import GearPair
from .path import backlash_free_involute, pressure_angle_of, working_pressure_angle

Scalar = Float[Array, ""]
By = Literal["both", "pinion", "wheel", "center_distance"]

_BY = "both", "pinion", "wheel", "center_distance"
# By how much the other numbers may leave more than the backlash [um], which is rounded to a micrometre.
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
    """A pair with a given play between its unloaded, unmodified flanks, in the middle of their tolerances.

    Normal to the flanks that is the play of the centre distance, less cos(normal pressure angle) times both mean tooth
    thickness allowances (ISO 21771).

    Args:
        pinion: driving gear.
        wheel: driven gear.
        backlash: normal backlash j_bn [um]: on the line of action of spur gears, there j_bn / cos(beta_b) of helical
            ones.
        center_distance: [mm]; None for the backlash-free one of the nominal tooth thicknesses.
        axial_offset: of the middle of the wheel's face from that of the pinion's [mm].
        by: what makes the backlash: the tooth thickness of "both" gears, thinned alike, that of the "pinion" or the
            "wheel" alone, or the "center_distance" of the gears as they are.

    Raises:
        ValueError: for less backlash than the other numbers leave, a centre distance that is given and wanted, and what
            `GearPair` refuses.
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


@program
def _distance(pinion: Gear, wheel: Gear, backlash: Scalar) -> Scalar:
    """Centre distance [mm] that leaves a backlash."""
    both = pinion.base_radius + wheel.base_radius
    opened = 0.5e-3 * (backlash + thickening(pinion, wheel)) / both
    return both / jnp.cos(pressure_angle_of(backlash_free_involute(pinion, wheel) + opened))


def _check_enough(backlash: Scalar, play: Scalar) -> None:
    wanted, there = concrete(backlash), concrete(play)
    if wanted is not None and there is not None and wanted < there - _ROUNDED:
        left = f"{float(there):.6g} um, which centre distance and tooth thicknesses leave"
        raise ValueError(f"GearPair: backlash = {float(wanted):g} um must be at least {left}")
