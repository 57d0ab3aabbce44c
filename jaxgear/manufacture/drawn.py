"""Gears whose tooth thickness is given as on their drawing: over several teeth, over balls, or by both allowances."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..geometry import Gear
from ..numerics import Checked, concrete, count, fields_of, number
from .tooth_thickness import allowance_of_balls, allowance_of_span, over_balls, span

Limits = Float[Array, "..."]  # one number, or lower and upper limit

# By how much a tooth may come out thicker than without allowance [um]: a drawing rounds its lengths to a micrometre,
# which is up to half of that on a span and less over balls.
_ROUNDED = 1.0
_WAYS = "span", "over_balls", "tooth_thickness_allowance"
_BESIDE = {"span": "teeth_spanned", "over_balls": "ball_diameter"}  # what a measure needs


class ToothThickness(Checked):
    """What a drawing says of the thickness of the teeth, in one of three ways.

    Every one of them is a number, or both limits [lower, upper]: the tooth is then that in the middle of both.

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
        given = [name for name in _WAYS if getattr(self, name) is not None]
        for other, name in _BESIDE.items():
            if getattr(self, name) is not None and other not in given:
                raise ValueError(f"ToothThickness: {name}: has no effect without {other}")
            if other in given and getattr(self, name) is None:
                raise ValueError(f"ToothThickness: {name}: missing, {other} needs it")
        if not given:
            raise ValueError(f"ToothThickness: {_WAYS[0]}: missing, give one of {', '.join(_WAYS)}")
        if len(given) > 1:
            problem = f"cannot stand beside {given[0]}: either says how thick the tooth is"
            raise ValueError(f"ToothThickness: {given[1]}: {problem}")

    def allowance(self, gear: Gear) -> Limits:
        """Tooth thickness allowance of a gear [um]; one number, or the lower and the upper one.

        Raises:
            ValueError: for a measure that is not one of this gear, or of a tooth thicker than the rack makes it.
        """
        if (measured := self.span) is not None:
            teeth = self.teeth_spanned
            assert teeth is not None  # or it would not have been made
            of = partial(allowance_of_span, gear, teeth), partial(span, _without_allowance(gear), teeth)
            return _named("span", lambda: _rounded(measured, *of), teeth_spanned=teeth)
        if (over := self.over_balls) is not None:
            ball = self.ball_diameter
            of = partial(allowance_of_balls, gear, ball), partial(over_balls, _without_allowance(gear), ball)
            return _named("over_balls", lambda: _rounded(over, *of), ball_diameter=ball)
        assert self.tooth_thickness_allowance is not None
        return self.tooth_thickness_allowance


def drawn_gear(**given: Any) -> Gear:
    """A gear with what its drawing says: the arguments of `Gear` and those of `ToothThickness`.

    Raises:
        ValueError: for what either of them refuses, and for a `tooth_thickness_tolerance` beside lower and upper limit.
    """
    thickness = {name: given.pop(name) for name in fields_of(ToothThickness) if given.get(name) is not None}
    if not thickness:
        return Gear(**given)
    says = ToothThickness(**thickness)
    if given.get("tooth_thickness_tolerance") is not None:
        which = next(name for name in _WAYS if name in thickness)
        if which != "tooth_thickness_allowance" or np.ndim(thickness[which]):
            raise ValueError(f"Gear: tooth_thickness_tolerance: has no effect, give lower and upper limit of {which}")
        return Gear(**given, **thickness)
    return with_thickness(Gear(**given), says)


def with_thickness(gear: Gear, thickness: ToothThickness) -> Gear:
    """The gear with a tooth thickness in place of its own.

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
    """What is found, refused under the name of what was given, with the value of what was given beside it."""
    try:
        return found()
    except ValueError as error:
        shown = [f"with {key} = {value:g}" for key, value in beside.items() if concrete(value) is not None]
        text = ", ".join([str(error).partition(": ")[2], *shown])
        raise ValueError(f"ToothThickness: {name}: {text}") from error


def _rounded(measured: Limits, allowance_of: Callable[..., Limits], largest: Callable[[], Limits]) -> Limits:
    """The allowance of a measure, without the micrometre that a rounded one may make of none."""
    allowance = allowance_of(measured)
    known = concrete(allowance)
    if known is not None and known.max() > _ROUNDED:
        most = f"{float(largest()):.7g} mm, as the rack makes the tooth"
        raise ValueError(f"ToothThickness: {float(jnp.max(measured)):.7g} mm must be at most {most}")
    return jnp.where(allowance <= _ROUNDED, jnp.minimum(allowance, 0.0), allowance)
