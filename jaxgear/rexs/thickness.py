"""Tooth thickness of a gear in REXS: limits on the chord, on the span or over balls, and the generating shift."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ..geometry import Gear, allowance_of_balls, measures, over_balls
from ..io.errors import refused
from ..numerics import real
from .model import Component
from .open_numbers import Completed, rack_by_hand

GENERATED = "generated_addendum_modification_coefficient"
CHORDS = "chordal_tooth_thickness_upper_deviation", "chordal_tooth_thickness_lower_deviation"
SPANS = "upper_backlash_allowance_referenced_to_span", "lower_backlash_allowance_referenced_to_span"
BALLS = "upper_backlash_allowance_balls_or_pins", "lower_backlash_allowance_balls_or_pins"
_SHIFT_DIGITS = 1e-3  # by which profile shifts in files are rounded
_DIGITS = 6  # of an allowance [um] behind the point: further ones are of the way through chord or span
_CLOSE = 1e-9  # difference of profile shifts that mean the same


def write_thickness(gear: Gear) -> dict[str, tuple[Any, str]]:
    """Deviations of chord and span as attributes, beside the span without an allowance; nothing without allowances."""
    upper, tolerance = float(gear.tooth_thickness_allowance), float(gear.tooth_thickness_tolerance)
    if not upper and not tolerance:
        return {}
    limits = upper, upper - tolerance  # um
    diameter, arc = _nominal(gear)
    found: dict[str, tuple[Any, str]] = {}
    for name, allowance in zip(CHORDS, (1e-3 * limit for limit in limits)):
        # d (sin((s + E) / d) - sin(s / d)), without the difference of two near numbers
        half = 0.5 * allowance / diameter
        found[name] = float(2 * diameter * np.cos((arc + 0.5 * allowance) / diameter) * np.sin(half)), "mm"
    none = real(0.0)
    span = measures(replace(gear, tooth_thickness_allowance=none, tooth_thickness_tolerance=none))
    if not np.isfinite(span.span):
        return found
    cosine = float(np.cos(np.deg2rad(gear.pressure_angle)))
    found |= {name: (limit * cosine, "mum") for name, limit in zip(SPANS, limits)}
    return found | {
        "number_of_teeth_for_span_measurement": (int(span.teeth), "none"),
        "span_measurement": (span.span, "mm"),
    }


def read_thickness(gear: Component, made: Gear) -> dict[str, Any]:
    """Upper tooth thickness allowance and tolerance [um], from deviations of chord, span or dimension over balls.

    Of several measures the first is used, as they are equivalent; a single limit is both upper and lower limit.
    """
    for names, limits, allowance in _deviations(gear, made):
        given = [limit for limit in limits if limit is not None]
        if not given:
            continue
        # no deviation is no allowance, whatever the measure is rounded to on the way
        high, low = (
            refused(gear.where(names[0]), allowance, limit) if limit else 0.0 for limit in (given[0], given[-1])
        )
        if low > high:
            raise gear.refuse(names[1], f"{given[-1]:g} must be at most the upper one, {given[0]:g}")
        if high > 0:
            raise gear.refuse(names[0], f"{given[0]:g} makes the tooth {high:.4g} um thicker, must be at most 0")
        high, low = round(high, _DIGITS), round(low, _DIGITS)
        tolerance = round(high - low, _DIGITS)
        return {"tooth_thickness_allowance": real(high), "tooth_thickness_tolerance": real(tolerance)}
    return {}


def _deviations(
    gear: Component, made: Gear
) -> Iterator[tuple[tuple[str, str], list[float | None], Callable[..., Any]]]:
    """Names of both limits, upper one first, their values, and the function from a value to the allowance [um]."""
    yield CHORDS, [gear.number(name, "mm") for name in CHORDS], lambda chord: _of_chord(made, chord)
    cosine = float(np.cos(np.deg2rad(made.pressure_angle)))
    yield SPANS, [gear.number(name, "mum") for name in SPANS], lambda span: span / cosine
    balls = [gear.number(name, "mm") for name in BALLS]
    ball = gear.needed("diameter_of_measuring_ball_or_pin", "mm") if balls != [None, None] else 0.0
    yield BALLS, balls, lambda by: float(allowance_of_balls(made, ball, float(over_balls(made, ball)) + by))


def as_cut(settings: Component, made: Gear, owner: str, completed: Completed) -> Gear:
    """Gear with the tooth thickness by its generating profile shift, unless deviations of the thickness are given.

    x_E = x + A_sn / (2 m_n tan(alpha_n)) (ISO 21771) of a file is that of an allowance A_sn between both limits.
    """
    generated = settings.number(GENERATED, "none")
    if generated is None:
        return made
    shift, upper, tolerance = (
        float(number) for number in (made.profile_shift, made.tooth_thickness_allowance, made.tooth_thickness_tolerance)
    )
    thinner = 2e3 * float(made.module) * np.tan(np.deg2rad(float(made.pressure_angle)))  # um, for a shift of 1
    if not upper and not tolerance and generated < shift - _CLOSE:
        allowance = round(float(thinner * (generated - shift)), _DIGITS)
        completed.say(f"{owner}.tooth_thickness_allowance", allowance, f"um, by {GENERATED}")
        return refused(settings.where(GENERATED), replace, made, tooth_thickness_allowance=real(allowance))
    least = shift + (upper - tolerance) / thinner
    if not least - _SHIFT_DIGITS <= generated <= shift + _CLOSE:
        problem = f"{generated:g} must be at least {least:g}, that of the tooth thickness, and at most {shift:g}, x"
        raise settings.refuse(GENERATED, f"{problem}; {rack_by_hand(owner)}")
    return made


def _nominal(gear: Gear) -> tuple[float, float]:
    """Diameter of the reference circle and tooth thickness on its arc without an allowance [mm] (ISO 21771).

    Both of the normal section, whose circle has the curvature of the reference cylinder there, d / cos(beta)^2.
    """
    module, shift, angle = float(gear.module), float(gear.profile_shift), np.deg2rad(float(gear.pressure_angle))
    return 2 * float(gear.pitch_radius / gear.helix_cosine**2), float(
        module * (0.5 * np.pi + 2 * shift * np.tan(angle))
    )


def _of_chord(made: Gear, chord: float) -> float:
    """Allowance on the arc of the reference circle [um], from the allowance on the chord [mm]."""
    diameter, arc = _nominal(made)
    if not -arc < chord < arc:
        raise ValueError(f"{chord:g} mm must be greater than {-arc:.4g} mm and at most 0 mm")
    # E from sin(s/d + E/d) = sin(s/d) + A/d
    return float(1e3 * diameter * (np.arcsin(np.sin(arc / diameter) + chord / diameter) - arc / diameter)) + 0.0
