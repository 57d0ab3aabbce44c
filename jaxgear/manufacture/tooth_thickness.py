"""Tooth thickness as drawings give it: over several teeth, over balls, or as an allowance (ISO 21771, spur gears).

The numbers are those of unmodified flanks: a relief may not reach where the anvils or balls touch.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..geometry import Gear, outline
from ..geometry.involute import involute
from ..numerics import bracketed_root, check, concrete, real, whole

Scalar = Float[Array, ""]

_USUAL_BALL = 1.7  # diameter of a ball [modules]
_WIDEST = 3.0  # tan(pressure angle) at the ball centre, about 72 degrees


def teeth_spanned(gear: Gear) -> int:
    """Number of teeth k over which a span is measured, of a concrete gear.

    The anvils then touch nearest to the diameter d + 2 x m, where tan(alpha_v) = sqrt((d + 2 x m)^2 - d_b^2) / d_b:
    k = z / pi (tan(alpha_v) - inv(alpha)) - 2 x tan(alpha) / pi + 0.5, rounded, and at least 2.
    """
    return int(_teeth_spanned(gear))


def _teeth_spanned(gear: Gear) -> Scalar:
    tangent = jnp.tan(jnp.deg2rad(gear.pressure_angle))
    radius = gear.pitch_radius + gear.profile_shift * gear.module
    touched = jnp.sqrt(jnp.maximum((radius / gear.base_radius) ** 2 - 1, 0.0))
    exact = gear.teeth / jnp.pi * (touched - involute(tangent))
    return jnp.maximum(jnp.round(exact - 2 * gear.profile_shift * tangent / jnp.pi + 0.5), 2.0)


def span(gear: Gear, teeth: int) -> Scalar:
    """Base tangent length W_k [mm] over a number of teeth k: (k - 1) p_b + s_b.

    W_k = m cos(alpha) (pi (k - 0.5) + z inv(alpha)) + 2 x m sin(alpha) + E_sns cos(alpha).

    Args:
        gear: the gear, with its tooth thickness allowance.
        teeth: k, see `teeth_spanned`.

    Raises:
        ValueError: unless k is a whole number from 1 to the number of teeth, or where the anvils miss the involute.
    """
    most = concrete(gear.teeth)
    whole("span", "teeth", teeth, 1, float("inf") if most is None else float(most))
    found = _span(gear, teeth)
    _check_touched("span", "teeth", teeth, "", 0.5 * found, gear)
    return found


def _span(gear: Gear, teeth) -> Scalar:
    alpha = jnp.deg2rad(gear.pressure_angle)
    nominal = jnp.pi * (teeth - 0.5) + gear.teeth * involute(jnp.tan(alpha))
    shifted = 2 * gear.profile_shift * gear.module * jnp.sin(alpha)
    return jnp.cos(alpha) * (gear.module * nominal + 1e-3 * gear.mean_tooth_thickness_allowance) + shifted


def over_balls(gear: Gear, ball) -> Scalar:
    """Dimension over two balls M_dK [mm], or over pins, which is the same for spur gears.

    inv(alpha_K) = inv(alpha) + D_M / (z m cos(alpha)) - pi / (2 z) + 2 x tan(alpha) / z + E_sns / (m z); the centres of
    the balls lie on d_K = d_b / cos(alpha_K). M_dK = d_K + D_M for an even number of teeth; for an odd one the balls
    are half a pitch off the diameter, M_dK = d_K cos(pi / (2 z)) + D_M.

    Args:
        gear: the gear, with its tooth thickness allowance.
        ball: diameter D_M [mm], about 1.7 modules, so that the balls touch the flanks and stand out of the tip circle.

    Raises:
        ValueError: for a ball that falls onto the root circle, does not stand out of the spaces or misses the involute.
    """
    check("over_balls", "ball", ball, "mm", low=0.0, open_low=True)
    wanted, radius, touched = _ball(gear, ball)
    _check_ball(gear, ball, wanted, radius)
    _check_touched("over_balls", "ball", ball, " mm", touched, gear)
    return 2 * radius * _offset(gear) + ball


def _ball(gear: Gear, ball) -> tuple[Scalar, Scalar, Scalar]:
    """inv(alpha_K), radius of the ball's centre and roll length where it touches [mm]."""
    wanted = _thick(gear, ball, 1e-3 * gear.mean_tooth_thickness_allowance)
    tangent = bracketed_root(_missing, jnp.full_like(wanted, 1e-6), jnp.full_like(wanted, _WIDEST), wanted)
    # the ball's centre lies on the normal of the involute where it touches
    return wanted, gear.base_radius * jnp.sqrt(1 + tangent**2), gear.base_radius * tangent - 0.5 * ball


class Measures(NamedTuple):
    """What the tooth thickness of a gear measures; lengths are NaN where anvils or balls miss the involute.

    Attributes:
        teeth: k of the span.
        span: W_k [mm].
        ball: D_M [mm].
        over_balls: M_dK [mm].
    """

    teeth: Scalar
    span: Scalar
    ball: Scalar
    over_balls: Scalar


def measures(gear: Gear, teeth=None, ball=None) -> Measures:
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

    def missing(length, found):
        return jnp.where((form <= length) & (length <= gear.tip_roll_length), found, jnp.nan)

    outside = (wanted > 0) & (centre - 0.5 * ball >= gear.root_circle_radius) & (centre + 0.5 * ball >= gear.tip_radius)
    over = jnp.where(outside, 2 * centre * _offset(gear) + ball, jnp.nan)
    return Measures(teeth, missing(0.5 * first, first), ball, missing(touched, over))


def allowance_of_span(gear: Gear, teeth: int, measured) -> Float[Array, "..."]:
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
    _check_near("allowance_of_span", "measured", measured, nominal, gear)
    return 1e3 * (measured - nominal) / jnp.cos(alpha)


def allowance_of_balls(gear: Gear, ball, measured) -> Float[Array, "..."]:
    """Tooth thickness allowance E_sns [um] of a dimension over balls M_dK [mm]; the inverse of `over_balls`.

    Args:
        gear: the gear; its own allowance does not count.
        ball: diameter D_M [mm].
        measured: M_dK [mm], of any shape.

    Raises:
        ValueError: for a dimension that puts the balls inside the base circle, or makes the tooth thicker or thinner by
            more than a base pitch.
    """
    check("allowance_of_balls", "ball", ball, "mm", low=0.0, open_low=True)
    measured = real(measured)
    ratio = (measured - ball) / (2 * gear.base_radius * _offset(gear))
    least = concrete(2 * gear.base_radius * _offset(gear) + ball)
    check("allowance_of_balls", "measured", measured, "mm", low=None if least is None else float(least), open_low=True)
    tangent = jnp.sqrt(ratio**2 - 1)
    thicker = gear.module * gear.teeth * (involute(tangent) - _thick(gear, ball, 0.0))
    found, pitch = concrete(thicker), concrete(gear.base_pitch)
    if found is not None and pitch is not None and np.abs(found).max() > float(pitch):
        worst = np.argmax(np.abs(found))
        given = f"allowance_of_balls: measured = {float(np.ravel(measured)[worst]):g} mm"
        thicker_by = float(np.ravel(found)[worst])
        raise ValueError(f"{given} makes the tooth {thicker_by:.3g} mm thicker, must be within {float(pitch):.3g} mm")
    return 1e3 * thicker


def _thick(gear: Gear, ball, allowance) -> Scalar:
    """inv(alpha_K) of a ball between the flanks of a gear with an allowance [mm]."""
    tangent = jnp.tan(jnp.deg2rad(gear.pressure_angle))
    space = (jnp.pi / 2 - 2 * gear.profile_shift * tangent - allowance / gear.module) / gear.teeth
    return involute(tangent) + ball / (2 * gear.base_radius) - space


def _missing(tangent: Scalar, wanted: Scalar) -> Scalar:
    return involute(tangent) - wanted


def _offset(gear: Gear) -> Scalar:
    """What brings the two balls together where the number of teeth is odd."""
    odd = jnp.mod(jnp.round(gear.teeth), 2) == 1
    return jnp.where(odd, jnp.cos(jnp.pi / (2 * gear.teeth)), 1.0)


def _check_ball(gear: Gear, ball, wanted: Scalar, radius: Scalar) -> None:
    known = [concrete(value) for value in (ball, wanted, radius, gear.root_circle_radius, gear.tip_radius)]
    if any(value is None for value in known):
        return
    size, room, centre, root, tip = (float(value) for value in known if value is not None)
    if room <= 0 or centre - size / 2 < root:
        raise ValueError(f"over_balls: ball = {size:g} mm touches no flanks above the root circle, must be larger")
    if centre + size / 2 < tip:
        raise ValueError(f"over_balls: ball = {size:g} mm does not stand out of the tip circle, must be larger")


def _check_touched(owner: str, name: str, value, unit: str, touched: Scalar, gear: Gear) -> None:
    """Refuses anvils or balls that would touch at a roll length [mm] where there is no involute."""
    known = [concrete(each) for each in (touched, outline(gear).form_roll_length, gear.tip_roll_length)]
    if any(each is None for each in known):
        return
    at, form, tip = (float(each) for each in known if each is not None)
    if not form <= at <= tip:
        place = f"would touch the flank at a roll length of {at:.4g} mm"
        raise ValueError(f"{owner}: {name} = {value:g}{unit} {place}, must be within {form:.4g} and {tip:.4g} mm")


def _check_near(owner: str, name: str, value, nominal: Scalar, gear: Gear) -> None:
    middle, pitch = concrete(nominal), concrete(gear.base_pitch)
    if middle is not None and pitch is not None:
        check(owner, name, value, "mm", low=float(middle - pitch), high=float(middle + pitch))
