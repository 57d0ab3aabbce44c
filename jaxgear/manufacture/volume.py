"""Volume that finishing takes off a gear, and its ratio to that of reference reliefs.

"Design for manufacturing of a spur gears profile modification based on the static transmission error for improving the
dynamic behavior" (Int J Adv Manuf Technol 2023, doi 10.1007/s00170-023-12340-x, section 5, Fig. 22) compares the volume
of its reliefs with linear and parabolic ones from the pitch point of the same amount at the tip.
"""

from collections.abc import Iterator
from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import MeshCycle, Side
from ..geometry import outline
from ..metrics import Quantity, Vocabulary, gear_volume, removed_at
from ..microgeometry import AbstractCurve, AbstractModification, Linear, NoModification, Quadratic, TipRelief
from ..numerics import Given, check, concrete, program, real, safe_divide
from ..numerics.reductions import Max
from .spline import wheel_spline

Scalar = Float[Array, ""]


class ReferenceVolumes(NamedTuple):
    """Volumes [mm^3] that tip reliefs of one amount take off one gear.

    Attributes:
        linear_from_pitch, parabolic_from_pitch: that start at the pitch point.
        linear_from_fewest_pairs, parabolic_from_fewest_pairs: that start where the contact of the fewest pairs ends
            towards the tip: single contact below a contact ratio of 2, double contact from there to 3.
    """

    linear_from_pitch: Scalar
    parabolic_from_pitch: Scalar
    linear_from_fewest_pairs: Scalar
    parabolic_from_fewest_pairs: Scalar


def reference_volumes(side: Side, amount: Given) -> ReferenceVolumes:
    """Volumes of the reference reliefs of a gear.

    At a contact ratio of n and a fraction, n pairs are the fewest, and the next pair joins them over the fraction of a
    base pitch before a tooth leaves at its tip: the length of the reliefs from there. At a whole contact ratio as many
    pairs touch everywhere and these reliefs are none.

    Args:
        side: the gear's side of the contact, of `mesh.sides`.
        amount: amount at the tip [um].

    Raises:
        ValueError: for a negative amount, or a contact ratio below 1.
    """
    check("amount", amount, "um", low=0.0)
    check("contact ratio", concrete(_contact_ratio(side)), "", low=1.0)
    return _reference_volumes(side, jnp.asarray(amount, side.start_roll_length.dtype))


@program
def _reference_volumes(side: Side, amount: Scalar) -> ReferenceVolumes:
    ratio = _contact_ratio(side)
    joined = (ratio - jnp.floor(ratio)) * side.gear.base_pitch
    volumes = [_relieved(side, amount, length, curve) for length in (_addendum(side), joined) for curve in _curves()]
    return ReferenceVolumes(*volumes)


def _contact_ratio(side: Side) -> Scalar:
    return (side.tip_roll_length - side.start_roll_length) / side.gear.base_pitch


def ground_volume(side: Side, modification: AbstractModification, *, stock: Given = 0.0) -> Scalar:
    """Volume that grinding removes from one gear [mm^3]: modification and grinding stock.

    Args:
        side: the gear's side of the contact, of `mesh.sides`.
        modification: modification of both flanks of every tooth.
        stock: machining allowance normal to the flank [um], from the form circle to the tip and over the face.

    Raises:
        ValueError: for a negative stock.
    """
    check("stock", stock, "um", low=0.0)
    return gear_volume(side, modification) + 1e-3 * stock * ground_area(side)


def ground_area(side: Side) -> Scalar:
    """Area of all flanks of one gear from the form circle to the tip, over its face [mm^2].

    2 z b (L_tip^2 - L_form^2) / (2 r_b cos(beta_b)): every point of an involute helicoid is inclined to the transverse
    section by the base helix angle. The volume of any grinding stock is its thickness times this.
    """
    form, tip = outline(side.gear).form_roll_length, side.tip_roll_length
    profile = (tip**2 - form**2) / (2 * side.base_radius)
    return 2 * side.gear.teeth * side.face_width * profile / jnp.cos(side.gear.base_helix_angle)


def relative_volume(side: Side, modification: AbstractModification, *, parabolic: bool = False) -> Scalar:
    """Removed volume over the volume of a linear or parabolic relief from the pitch point with the same tip amount.

    Zero where nothing is removed at the tip.
    """
    curve = _curves()[parabolic]
    amount = jnp.maximum(removed_at(side, modification, side.tip_roll_length[None])[0], 0.0)
    # volumes of a relief are proportional to its amount
    per_um = _relieved(side, jnp.ones_like(amount), _addendum(side), curve)
    return safe_divide(gear_volume(side, modification), amount * per_um)


def _addendum(side: Side) -> Scalar:
    """Roll length from the pitch point to the tip [mm]; profile shift can move the pitch point beyond the tip."""
    return jnp.maximum(side.tip_roll_length - side.pitch_roll_length, 0.0)


def _curves() -> tuple[AbstractCurve, AbstractCurve]:
    """Linear and parabolic curve; a function, so that the import creates no array."""
    return Linear(), Quadratic(real(0.0), real(0.0), real(1.0))


def _relieved(side: Side, amount, length: Scalar, curve: AbstractCurve) -> Scalar:
    return gear_volume(side, TipRelief(amount, length, curve))


_DEGREES = {2: "quadratic", 3: "cubic"}


def _of_gear(index: int, function):
    """A function of a gear's side and modification as one of a cycle."""

    def of(cycle: MeshCycle):
        modification = (cycle.pinion, cycle.wheel)[index]
        return function(cycle.sides[index], NoModification() if modification is None else modification)

    return of


def _deviation(degree):
    return lambda side, modification: jnp.abs(wheel_spline(side, modification, degree=degree).deviation)


def _area(side: Side, _):
    return ground_area(side)


def _relative(parabolic: bool):
    return lambda side, modification: relative_volume(side, modification, parabolic=parabolic)


def _quantities() -> Iterator[Quantity]:
    for index, gear in enumerate(("pinion", "wheel")):
        for degree, name in _DEGREES.items():
            meaning = f"of the flank from the best wheel of involute and {name} polynomial, {gear}"
            yield Quantity(f"{gear}_{name}_deviation", _of_gear(index, _deviation(degree)), "um", meaning, Max())
        area = f"area of the flanks that are ground, {gear}"
        yield Quantity(f"{gear}_ground_area", _of_gear(index, _area), "mm2", area)
        yield Quantity(f"{gear}_removed_volume", _of_gear(index, gear_volume), "mm3", f"material ground off, {gear}")
        for parabolic, name in ((False, "linear"), (True, "parabolic")):
            meaning = f"removed volume per that of a {name} relief from the pitch point, {gear}"
            of = _of_gear(index, _relative(parabolic))
            yield Quantity(f"{gear}_volume_over_{name}", of, meaning=meaning)


GROUND_QUANTITIES = Vocabulary(_quantities())
