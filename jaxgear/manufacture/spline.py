"""The wheel profile as it is dressed: the nominal involute up to a node, a polynomial beyond it.

The polynomial gives the half width x of the wheel over its height y (frame as in `wheel`): it starts on the nominal
involute at the node and replaces the modified flank up to the tip, as in "Design for manufacturing of a spur gears
profile modification based on the static transmission error for improving the dynamic behavior" (Int J Adv Manuf Technol
2023, doi 10.1007/s00170-023-12340-x, section 5, Figs. 20 and 21), which takes degree 2.
"""

from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..contact import Side
from ..metrics import removed_at
from ..microgeometry import (
    AbstractModification,
    EndRelief,
    LeadCrowning,
    LeadSlope,
    Scaled,
    TabulatedProfile,
    TipRelief,
    terms,
)
from ..numerics import Checked, Given, check, concrete, maximum, program, result
from ..numerics.fits import Criterion, fit
from ..tolerance import FlankPlace, flank_place
from .wheel import space_point

Scalar = Float[Array, ""]
Profile = Float[Array, " points"]
Degree = Literal[2, 3]

_BELOW, _BEYOND = 65, 129  # points below the node and beyond it
_SEARCHED = 257  # points among which the start of the relief is looked for
_NODES = 65  # among which the best one is looked for
START = 0.01  # um; a relief starts where more than this is removed, a tenth of what measuring machines resolve
_ROUNDING = 1e-6
_SHORTEST = 0.05  # of the active profile; a polynomial over less is none


class WheelSpline(Checked):
    """Wheel profile of an involute and a polynomial, and its deviation from the design along the active profile.

    Attributes:
        node_roll_length: node roll length of the node [mm].
        node_x, node_y: the node in the frame of the wheel [mm].
        coefficients: c_k [mm^(1 - k)], k = 1 ... degree: x = node_x + sum_k c_k (y - node_y)^k.
        roll_length: where the deviation is given, from the start of the active profile to the tip [mm].
        removed: material removed by the design [um].
        deviation: normal to the flank [um], positive where the spline removes more than the design.
        radial_deviation: the same along the height y of the wheel [um], the vertical difference of the publication;
            larger than the normal one by 1 / sin(inclination of the flank).
    """

    node_roll_length: Scalar = result("mm")
    node_x: Scalar = result("mm")
    node_y: Scalar = result("mm")
    coefficients: Float[Array, " degree"] = result("mm^(1-k)")
    roll_length: Profile = result("mm")
    removed: Profile = result("um")
    deviation: Profile = result("um")
    radial_deviation: Profile = result("um")

    @property
    def largest(self) -> Float[Array, "..."]:
        """Largest deviation normal to the flank, of either sign [um]."""
        return maximum(jnp.abs(self.deviation), -1)

    @property
    def ground(self) -> TabulatedProfile:
        """The flank that the wheel grinds, for the mesh: the design and the deviation."""
        # the node ends the involute and starts the polynomial: it stands there twice
        roll, ground = (jnp.delete(values, _BELOW) for values in (self.roll_length, self.removed + self.deviation))
        known = concrete(roll)
        if known is not None:  # a node at the start of the active profile leaves no involute: its places are one
            places = np.flatnonzero(np.diff(np.maximum.accumulate(known), prepend=-np.inf) > 0)
            roll, ground = roll[places], ground[places]
        return TabulatedProfile(roll, ground)

    def x(self, y: Float[Array, "..."]) -> Float[Array, "..."]:
        """Half width of the wheel [mm] at heights [mm] beyond the node."""
        steps = [c * (y - self.node_y) ** k for k, c in enumerate(self.coefficients, start=1)]
        return self.node_x + sum(steps)


def relief_start(side: Side, modification: AbstractModification, threshold: Given = START) -> Scalar:
    """Roll length at which the relief of the tip starts [mm]; differentiable.

    Of a single `TipRelief`, beside modifications along the face, it is the start by definition. Of anything else it is
    where, in the middle of the face, from there on up to the tip, more than a threshold [um] is removed: the start of
    the active profile where all of it is modified, and the tip where nothing is.

    Raises:
        ValueError: for a negative threshold.
    """
    check("threshold", threshold, "um", low=0.0)
    return _relief_start(side, modification, jnp.asarray(threshold, side.start_roll_length.dtype))


@program
def _relief_start(side: Side, modification: AbstractModification, threshold: Scalar) -> Scalar:
    length = _relief_length(modification)
    if length is not None:
        return jnp.maximum(side.tip_roll_length - length, side.start_roll_length)
    roll = jnp.linspace(side.start_roll_length, side.tip_roll_length, _SEARCHED)
    removed = removed_at(side, modification, roll)
    untouched = removed <= threshold
    last = _SEARCHED - 1 - jnp.argmax(untouched[::-1])
    cell = jnp.minimum(last, _SEARCHED - 2)
    rise = removed[cell + 1] - removed[cell]
    share = (threshold - removed[cell]) / jnp.where(rise > 0, rise, 1.0)
    found = roll[cell] + jnp.clip(share, 0.0, 1.0) * (roll[cell + 1] - roll[cell])
    found = jnp.where(untouched[-1], roll[-1], found)
    return jnp.where(jnp.any(untouched), found, roll[0])


def start_of_relief(side: Side, modification: AbstractModification) -> FlankPlace:
    """Start of the tip relief on the flank (`relief_start`)."""
    return flank_place(side, relief_start(side, modification))


def wheel_spline(
    side: Side,
    modification: AbstractModification,
    *,
    degree: Degree = 2,
    criterion: Criterion = "minimax",
    node: Given | None = None,
    tangent: bool = False,
) -> WheelSpline:
    """Fits involute and polynomial to the flank of a design; compiled and differentiable.

    Below the node the wheel grinds the nominal involute, so a relief of the root is a deviation there.

    Args:
        side: the gear's side of the contact, of `mesh.sides`.
        modification: modification of the flank, taken in the middle of the face.
        degree: degree of the polynomial, 2 or 3.
        criterion: what is made small: "least_squares", or "minimax" for the largest deviation.
        node: roll length of the node [mm], within the first 95 % of the active profile; None for the start of the
            relief (`relief_start`), or the end of these 95 % where that is earlier.
        tangent: the polynomial starts in the direction of the involute. Without it a kink is allowed, as at the start
            of a linear relief.

    Raises:
        ValueError: for another degree or criterion, or a node elsewhere.
    """
    _check(degree, criterion)
    start, tip = concrete(side.start_roll_length), concrete(side.tip_roll_length)
    if start is not None and tip is not None:
        last = float(tip - _SHORTEST * (tip - start))
        check("node", node, "mm", low=float(start) * (1 - _ROUNDING), high=last * (1 + _ROUNDING))
    node = None if node is None else jnp.asarray(node, side.start_roll_length.dtype)
    return _fitted(side, modification, node, degree, criterion, tangent)


def best_wheel_spline(
    side: Side,
    modification: AbstractModification,
    *,
    degree: Degree = 2,
    criterion: Criterion = "minimax",
    tangent: bool = False,
) -> WheelSpline:
    """`wheel_spline` with the node that makes the largest deviation least.

    Of 65 nodes along the active profile, of as many about the best of them, and of the start of the relief. The search
    compares: follow the gradient of `wheel_spline`.
    """
    _check(degree, criterion)
    first = side.start_roll_length
    length = (1 - _SHORTEST) * (side.tip_roll_length - first)
    share = jnp.linspace(0.0, 1.0, _NODES, dtype=length.dtype)

    def deviations(nodes: Array) -> Array:
        return _largest_at(side, modification, nodes, degree, criterion, tangent)

    start = relief_start(side, modification)[None]
    coarse = jnp.concatenate([first + share * length, start])
    around = coarse[jnp.argmin(deviations(coarse))] + (2 * share - 1) * length / (_NODES - 1)
    fine = jnp.concatenate([around, start])
    node = fine[jnp.argmin(deviations(fine))]
    return _fitted(side, modification, node, degree, criterion, tangent)


@program
def _largest_at(
    side: Side, modification: AbstractModification, nodes: Profile, degree: int, criterion: Criterion, tangent: bool
) -> Profile:
    """Largest deviation with each of several nodes."""
    return jax.vmap(lambda node: _fitted(side, modification, node, degree, criterion, tangent).largest)(nodes)


def _check(degree: int, criterion: str) -> None:
    if degree not in (2, 3):
        raise ValueError(f"degree = {degree!r} must be 2 or 3")
    if criterion not in ("least_squares", "minimax"):
        raise ValueError(f'criterion = {criterion!r} must be "least_squares" or "minimax"')


def _relief_length(modification: AbstractModification) -> Scalar | None:
    """Length of the tip relief [mm] if it is the only profile modification; else None."""
    parts = [part.modification if isinstance(part, Scaled) else part for part in terms(modification)]
    along = [part for part in parts if not isinstance(part, LeadCrowning | LeadSlope | EndRelief)]
    return along[0].length if len(along) == 1 and isinstance(along[0], TipRelief) else None


@program
def _fitted(
    side: Side,
    modification: AbstractModification,
    node: Scalar | None,
    degree: int,
    criterion: Criterion,
    tangent: bool,
) -> WheelSpline:
    start, tip = side.start_roll_length, side.tip_roll_length
    node = relief_start(side, modification) if node is None else node
    node = jnp.clip(node, start, tip - _SHORTEST * (tip - start))
    involute = jnp.linspace(start, node, _BELOW)
    beyond = node + jnp.linspace(0.0, 1.0, _BEYOND, dtype=node.dtype) * (tip - node)
    roll = jnp.concatenate([involute, beyond])
    removed = removed_at(side, modification, roll)
    x, y, angle = space_point(side, roll, removed)
    node_x, node_y, node_angle = space_point(side, node, jnp.zeros_like(node))
    height = y[-1] - node_y
    # without the node, where every power vanishes
    along, cosine = ((y - node_y) / height)[_BELOW + 1 :], jnp.cos(angle)[_BELOW + 1 :]
    width = x[_BELOW + 1 :] - node_x
    slope = jnp.tan(node_angle) * height if tangent else jnp.zeros_like(height)
    powers = range(2 if tangent else 1, degree + 1)
    columns = jnp.stack([cosine * along**power for power in powers], axis=1)
    found = fit(columns, cosine * (width - slope * along), criterion)
    scaled = jnp.concatenate([slope[None], found]) if tangent else found
    miss = 1e3 * cosine * (sum(c * along**k for k, c in enumerate(scaled, start=1)) - width)
    deviation = jnp.concatenate([-removed[: _BELOW + 1], miss])
    return WheelSpline(
        node_roll_length=node,
        node_x=node_x,
        node_y=node_y - side.gear.root_circle_radius,
        coefficients=scaled / height ** jnp.arange(1, degree + 1, dtype=height.dtype),
        roll_length=roll,
        removed=removed,
        deviation=deviation,
        radial_deviation=deviation / jnp.sin(angle),
    )
