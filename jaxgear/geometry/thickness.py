"""Tooth thickness as drawings give it: over several teeth, over balls, or as an allowance (ISO 21771).

The numbers are those of unmodified flanks: a relief may not reach where the anvils or balls touch.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..numerics import Checked, Given, Numbers, bracketed_root, check, concrete, count, number, real, whole
from .gear import Gear
from .involute import involute
from .outline import outline

Scalar = Float[Array, ""]

_USUAL_BALL = 1.7  # diameter of a ball [modules]
_WIDEST = 3.0  # tan(pressure angle) at the ball centre, about 72 degrees


def teeth_spanned(gear: Gear) -> int:
    """Number of teeth k over which a span is measured, of a concrete gear.

    The anvils then touch nearest to the diameter d + 2 x m_n, where tan(alpha_v) = sqrt((d + 2 x m_n)^2 - d_b^2) / d_b:
    k = z / pi (tan(alpha_v) / cos(beta_b)^2 - inv(alpha_t)) - 2 x tan(alpha_n) / pi + 0.5, rounded, and at least 2.
    """
    return int(_teeth_spanned(gear))


def _teeth_spanned(gear: Gear) -> Scalar:
    tangent = jnp.tan(jnp.deg2rad(gear.pressure_angle))
    radius = gear.pitch_radius + gear.profile_shift * gear.module
    touched = jnp.sqrt(jnp.maximum((radius / gear.base_radius) ** 2 - 1, 0.0))
    touched = touched / jnp.cos(gear.base_helix_angle) ** 2
    exact = gear.teeth / jnp.pi * (touched - _pitch_involute(gear))
    return jnp.maximum(jnp.round(exact - 2 * gear.profile_shift * tangent / jnp.pi + 0.5), 2.0)


def span(gear: Gear, teeth: int) -> Scalar:
    """Base tangent length W_k [mm] over a number of teeth k, normal to the flanks: (k - 1) p_bn + s_bn.

    W_k = m_n cos(alpha_n) (pi (k - 0.5) + z inv(alpha_t)) + 2 x m_n sin(alpha_n) + E_sns cos(alpha_n). Across the face
    of a helical gear it takes W_k sin(beta_b).

    Args:
        gear: the gear, with its tooth thickness allowance.
        teeth: k, see `teeth_spanned`.

    Raises:
        ValueError: unless k is a whole number from 1 to the number of teeth, where the anvils miss the involute, or for
            a face of a helical gear that is too narrow.
    """
    if gear.is_internal:
        raise ValueError("gear is a RingGear, which has no base tangent length: measure it between balls")
    most = concrete(gear.teeth)
    whole("teeth", teeth, 1, float("inf") if most is None else float(most))
    found = _span(gear, teeth)
    _check_touched("teeth", teeth, "", _half_span(gear, found), gear)
    across, width = concrete(_across(gear, found)), concrete(gear.face_width)
    if across is not None and width is not None and across > width:
        taken = f"takes {float(across):.4g} mm of the face, must take at most {float(width):.4g} mm, the face width"
        raise ValueError(f"span: teeth = {teeth:g} {taken}: such a helical gear is measured over fewer, or over balls")
    return found


def _span(gear: Gear, teeth: Given) -> Scalar:
    alpha = jnp.deg2rad(gear.pressure_angle)
    nominal = jnp.pi * (teeth - 0.5) + gear.teeth * _pitch_involute(gear)
    shifted = 2 * gear.profile_shift * gear.module * jnp.sin(alpha)
    return jnp.cos(alpha) * (gear.module * nominal + 1e-3 * gear.mean_tooth_thickness_allowance) + shifted


def _pitch_involute(gear: Gear) -> Scalar:
    """inv(alpha_t)."""
    return involute(jnp.tan(gear.transverse_pressure_angle))


def _half_span(gear: Gear, length: Scalar) -> Scalar:
    """Roll length at which the anvils touch over a length [mm]."""
    return 0.5 * length * jnp.cos(gear.base_helix_angle)


def _across(gear: Gear, length: Scalar) -> Scalar:
    """Length along the face that a length across the teeth takes [mm]."""
    return length * jnp.abs(jnp.sin(gear.base_helix_angle))


def over_balls(gear: Gear, ball: Given) -> Scalar:
    """Dimension over two balls M_dK [mm] in one transverse section, or over pins, which is the same for spur gears.

    Between two balls of a ring gear, with its negative numbers of teeth and diameters.

    inv(alpha_Kt) = inv(alpha_t) + D_M / (z m_n cos(alpha_n)) - pi / (2 z) + 2 x tan(alpha_n) / z + E_sns / (m_n z); the
    centres of the balls lie on d_K = d_b / cos(alpha_Kt). M_dK = d_K + D_M for an even number of teeth; for an odd one
    the balls are half a pitch off the diameter, M_dK = d_K cos(pi / (2 z)) + D_M.

    Args:
        gear: the gear, with its tooth thickness allowance.
        ball: diameter D_M [mm], about 1.7 modules, so that the balls touch the flanks and stand out of the tip circle.

    Raises:
        ValueError: for a ball that falls onto the root circle, does not stand out of the spaces or misses the involute.
    """
    check("ball", ball, "mm", low=0.0, open_low=True)
    wanted, radius, touched = _ball(gear, ball)
    _check_ball(gear, ball, wanted, radius)
    _check_touched("ball", ball, " mm", touched, gear)
    return gear.signed(2 * radius * _offset(gear) + ball)


def _ball(gear: Gear, ball: Given) -> tuple[Scalar, Scalar, Scalar]:
    """inv(alpha_Kt), radius of the ball's centre and roll length where it touches [mm]."""
    wanted = _thick(gear, ball, 1e-3 * gear.mean_tooth_thickness_allowance)
    tangent = bracketed_root(_missing, jnp.full_like(wanted, 1e-6), jnp.full_like(wanted, _WIDEST), wanted)
    # the ball's centre lies on the normal of the flank where it touches, which is inclined to the transverse section
    along = 0.5 * ball * jnp.cos(gear.base_helix_angle)
    return wanted, gear.base_radius * jnp.sqrt(1 + tangent**2), gear.base_radius * tangent - along


class Measures(NamedTuple):
    """Measures of the tooth thickness; lengths are NaN where anvils or balls miss the flanks.

    Attributes:
        teeth: number k of teeth spanned.
        span: base tangent length W_k [mm].
        ball: ball diameter D_M [mm].
        over_balls: dimension M_dK over two balls [mm].
    """

    teeth: Scalar
    span: Scalar
    ball: Scalar
    over_balls: Scalar


def measures(gear: Gear, teeth: Given | None = None, ball: Given | None = None) -> Measures:
    """`span` and `over_balls` of a gear, which may be traced.

    Args:
        gear: the gear, with its tooth thickness allowance.
        teeth: k; None for `teeth_spanned`.
        ball: D_M [mm]; None for 1.7 modules.
    """
    teeth = _teeth_spanned(gear) if teeth is None else real(teeth)
    ball = _USUAL_BALL * gear.module if ball is None else real(ball)
    first, (wanted, centre, touched) = _span(gear, teeth), _ball(gear, ball)
    form = outline(gear).form_roll_length

    def missing(length: Array, found: Array) -> Array:
        return jnp.where((form <= length) & (length <= gear.tip_roll_length), found, jnp.nan)

    outside = (wanted > 0) & (centre - 0.5 * ball >= gear.root_circle_radius) & (centre + 0.5 * ball >= gear.tip_radius)
    over = jnp.where(outside, gear.signed(2 * centre * _offset(gear) + ball), jnp.nan)
    can_span = jnp.asarray(not gear.is_internal) & (_across(gear, first) <= gear.face_width)
    fits = jnp.where(can_span, first, jnp.nan)
    return Measures(teeth, missing(_half_span(gear, first), fits), ball, missing(touched, over))


def allowance_of_span(gear: Gear, teeth: int, measured: Numbers) -> Float[Array, "..."]:
    """Tooth thickness allowance E_sns [um] of a base tangent length W_k [mm] over k teeth; the inverse of `span`.

    Args:
        gear: the gear; its own allowance does not count.
        teeth: k.
        measured: W_k [mm], of any shape.

    Raises:
        ValueError: for a length that is not within a base pitch of that of the gear without allowance.
    """
    alpha = jnp.deg2rad(gear.pressure_angle)
    nominal = span(gear, teeth) - 1e-3 * gear.mean_tooth_thickness_allowance * jnp.cos(alpha)
    measured = real(measured)
    _check_near("measured", measured, nominal, gear)
    return 1e3 * (measured - nominal) / jnp.cos(alpha)


def allowance_of_balls(gear: Gear, ball: Given, measured: Numbers) -> Float[Array, "..."]:
    """Tooth thickness allowance E_sns [um] of a dimension over balls M_dK [mm]; the inverse of `over_balls`.

    Args:
        gear: the gear; its own allowance does not count.
        ball: diameter D_M [mm].
        measured: M_dK [mm], of any shape.

    Raises:
        ValueError: for a dimension that puts the balls inside the base circle, or makes the tooth thicker or thinner by
            more than a base pitch.
    """
    check("ball", ball, "mm", low=0.0, open_low=True)
    measured = real(measured)
    ratio = (gear.signed(measured) - ball) / (2 * gear.base_radius * _offset(gear))
    least = concrete(gear.signed(2 * gear.base_radius * _offset(gear) + ball))
    check("measured", measured, "mm", low=None if least is None else float(least), open_low=True)
    tangent = jnp.sqrt(ratio**2 - 1)
    thicker = gear.module * gear.signed(gear.teeth) * (involute(tangent) - _thick(gear, ball, 0.0))
    found, pitch = concrete(thicker), concrete(gear.base_pitch)
    if found is not None and pitch is not None and np.abs(found).max() > float(pitch):
        worst = np.argmax(np.abs(found))
        given = f"measured = {float(np.ravel(measured)[worst]):g} mm"
        thicker_by = float(np.ravel(found)[worst])
        raise ValueError(f"{given} makes the tooth {thicker_by:.3g} mm thicker, must be within {float(pitch):.3g} mm")
    return 1e3 * thicker


def _thick(gear: Gear, ball: Given, allowance: Given) -> Scalar:
    """inv(alpha_Kt) of a ball between the flanks of a gear with an allowance [mm]."""
    tangent = jnp.tan(jnp.deg2rad(gear.pressure_angle))
    space = (jnp.pi / 2 - 2 * gear.profile_shift * tangent - allowance / gear.module) / gear.signed(gear.teeth)
    return _pitch_involute(gear) + ball / (2 * gear.base_radius * jnp.cos(gear.base_helix_angle)) - space


def _missing(tangent: Scalar, wanted: Scalar) -> Scalar:
    return involute(tangent) - wanted


def _offset(gear: Gear) -> Scalar:
    """Factor on the distance of the ball centres: cos(pi / (2 z)) for an odd number of teeth, else 1."""
    odd = jnp.mod(jnp.round(gear.teeth), 2) == 1
    return jnp.where(odd, jnp.cos(jnp.pi / (2 * gear.teeth)), 1.0)


def _check_ball(gear: Gear, ball: Given, wanted: Scalar, radius: Scalar) -> None:
    known = [concrete(value) for value in (ball, wanted, radius, gear.root_circle_radius, gear.tip_radius)]
    if any(value is None for value in known):
        return
    size, room, centre, root, tip = (float(value) for value in known if value is not None)
    if room <= 0 or centre - size / 2 < root:
        raise ValueError(f"ball = {size:g} mm touches no flanks above the root circle, must be larger")
    if centre + size / 2 < tip:
        raise ValueError(f"ball = {size:g} mm does not protrude beyond the tip circle, must be larger")


def _check_touched(name: str, value: Given, unit: str, touched: Scalar, gear: Gear) -> None:
    """Refuses anvils or balls that would touch at a roll length [mm] where there is no involute."""
    known = [concrete(each) for each in (touched, outline(gear).form_roll_length, gear.tip_roll_length)]
    if any(each is None for each in known):
        return
    at, form, tip = (float(each) for each in known if each is not None)
    if not form <= at <= tip:
        place = f"would touch the flank at a roll length of {at:.4g} mm"
        raise ValueError(f"{name} = {value:g}{unit} {place}, must be within {form:.4g} and {tip:.4g} mm")


def _check_near(name: str, value: Array, nominal: Scalar, gear: Gear) -> None:
    middle, pitch = concrete(nominal), concrete(gear.base_pitch)
    if middle is not None and pitch is not None:
        check(name, value, "mm", low=float(middle - pitch), high=float(middle + pitch))


def _check_spanned(gear: Gear, measured: Array, teeth: Given) -> None:
    """Refuses a span that is that of another number of teeth."""
    known = [concrete(each) for each in (measured, teeth, _span(_without_allowance(gear), teeth), gear.base_pitch)]
    if any(each is None for each in known):
        return
    size, over, nominal, transverse = (float(np.max(each)) for each in known if each is not None)
    pitch = transverse * float(jnp.cos(gear.base_helix_angle))
    meant = over + round((size - nominal) / pitch)
    if meant != over and meant >= 1:
        raise ValueError(
            f"ToothThickness: teeth_spanned = {over:g} does not go with span = {size:.7g} mm: the rack makes "
            f"{nominal:.6g} mm over {over:g} and {nominal + (meant - over) * pitch:.6g} mm over {meant:g} teeth"
        )


Limits = Float[Array, "..."]  # one number, or lower and upper limit

# By how much a tooth may come out thicker than without allowance [um]: a drawing rounds its lengths to a micrometre,
# which is up to half of that on a span and less over balls.
_ROUNDED = 1.0
WAYS = "span", "over_balls", "tooth_thickness_allowance"
_BESIDE = {"span": "teeth_spanned", "over_balls": "ball_diameter"}  # what a measure needs


class ToothThickness(Checked):
    """Tooth thickness on a drawing, given in one of three ways.

    Each is a number, or both limits [lower, upper]: the tooth is then in the middle of them.

    Attributes:
        span: base tangent length W_k over `teeth_spanned` teeth [mm].
        teeth_spanned: k.
        over_balls: dimension M_dK over two balls or pins of `ball_diameter` [mm].
        ball_diameter: D_M [mm].
        tooth_thickness_allowance: E_sni and E_sns on the reference cylinder [um]; see `Gear`.

    Raises:
        ValueError: for none or several of the three ways, a way without its second number, an upper limit below the
            lower one.
    """

    span: Limits | None = number("mm", low=0.0, open_low=True, limits=True, optional=True, default=None)
    teeth_spanned: int | None = count(low=1, optional=True, default=None)
    over_balls: Limits | None = number("mm", low=0.0, open_low=True, limits=True, optional=True, default=None)
    ball_diameter: Limits | None = number("mm", low=0.0, open_low=True, optional=True, default=None)
    tooth_thickness_allowance: Limits | None = number("um", high=0.0, limits=True, optional=True, default=None)

    def check_together(self) -> None:
        given = [name for name in WAYS if getattr(self, name) is not None]
        for other, name in _BESIDE.items():
            if getattr(self, name) is not None and other not in given:
                raise ValueError(f"ToothThickness: {name}: has no effect without {other}")
            if other in given and getattr(self, name) is None:
                raise ValueError(f"ToothThickness: {name}: missing, {other} needs it")
        if not given:
            raise ValueError(f"ToothThickness: {WAYS[0]}: missing, give one of {', '.join(WAYS)}")
        if len(given) > 1:
            problem = f"cannot be given with {given[0]}: give one of them"
            raise ValueError(f"ToothThickness: {given[1]}: {problem}")

    def allowance(self, gear: Gear) -> Limits:
        """Tooth thickness allowance of a gear [um]; one number, or the lower and the upper one.

        Raises:
            ValueError: for a measure that is not one of this gear, or of a tooth thicker than the rack makes it.
        """
        if (measured := self.span) is not None:
            teeth = self.teeth_spanned
            assert teeth is not None  # or it would not have been made
            _check_spanned(gear, measured, teeth)
            of = partial(allowance_of_span, gear, teeth), partial(span, _without_allowance(gear), teeth)
            return _named("span", lambda: _rounded(measured, *of), teeth_spanned=teeth)
        if (over := self.over_balls) is not None:
            ball = self.ball_diameter
            assert ball is not None  # likewise
            of = partial(allowance_of_balls, gear, ball), partial(over_balls, _without_allowance(gear), ball)
            return _named("over_balls", lambda: _rounded(over, *of), ball_diameter=ball)
        assert self.tooth_thickness_allowance is not None
        return self.tooth_thickness_allowance


def with_thickness(gear: Gear, thickness: ToothThickness) -> Gear:
    """Copy of a gear with another tooth thickness.

    Raises:
        ValueError: for a measure that is not one of this gear, or of a tooth thicker than the rack makes it.
    """
    allowance = thickness.allowance(gear)
    low, high = (allowance[0], allowance[1]) if allowance.ndim else (allowance, allowance)
    # limits that were traced may be the wrong way round: such a gear is none, and nothing made with it converges
    tolerance = jnp.where(high >= low, high - low, jnp.nan)
    thinned = partial(replace, gear, tooth_thickness_allowance=high, tooth_thickness_tolerance=tolerance)
    for name, other in _BESIDE.items():
        if getattr(thickness, name) is not None:
            return _named(name, thinned, **{other: getattr(thickness, other)})
    return thinned()


def _without_allowance(gear: Gear) -> Gear:
    zero = jnp.zeros_like(gear.module)
    return replace(gear, tooth_thickness_allowance=zero, tooth_thickness_tolerance=zero)


def _named(name: str, found: Callable[[], Any], **beside: Any) -> Any:
    """Result of `found()`; its errors are raised under the name of the drawing with the values of `beside`."""
    try:
        return found()
    except ValueError as error:
        shown = [f"with {key} = {value:g}" for key, value in beside.items() if concrete(value) is not None]
        text = ", ".join([str(error), *shown])
        raise ValueError(f"ToothThickness: {name}: {text}") from error


def _rounded(measured: Limits, allowance_of: Callable[..., Limits], largest: Callable[[], Limits]) -> Limits:
    """The allowance of a measure, without the micrometre that a rounded one may make of none."""
    allowance = allowance_of(measured)
    known = concrete(allowance)
    if known is not None and known.max() > _ROUNDED:
        most = f"{float(largest()):.7g} mm, as the rack makes the tooth"
        raise ValueError(f"{float(jnp.max(measured)):.7g} mm must be at most {most}")
    return jnp.where(allowance <= _ROUNDED, jnp.minimum(allowance, 0.0), allowance)
