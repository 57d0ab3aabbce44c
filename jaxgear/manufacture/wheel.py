"""The form-grinding wheel: its profile is that of the tooth space, and what limits its size.

Frame: origin in the gear centre, y along the centreline of the space outwards, x to the side of the flank. The normal
of the involute at a roll length L touches the base circle at T = r_b (sin phi, cos phi) with phi = theta + atan(L/r_b),
where theta is half the angle of the space there; the flank point lies on it at P = T + (L - h) n, n = (-cos phi,
sin phi), with the material h that the modification removes. That is exact: the modification is measured on the normal.

A wheel that is fed along the axis of a spur gear, its own axis across it, copies its axial section into the tooth
space: the profile does not depend on the wheel's radius. Frame of the wheel: origin on its outer diameter in its
middle plane, x along its axis, y towards its axis; the wheel reaches down to the root circle.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import Side
from ..geometry import check_external, check_spur, outline
from ..geometry.involute import load_angle
from ..metrics import removed_at
from ..microgeometry import AbstractModification
from ..numerics import Checked, Given, check, concrete, minimum, number, program, result, whole

Profile = Float[Array, " points"]

_POINTS = 201  # of a profile, by default


class SpaceFlank(NamedTuple):
    """One flank of a tooth space, in the middle of the face.

    Attributes:
        roll_length: roll length of the unmodified flank [mm], shape (points,).
        x: from the centreline of the space [mm].
        y: distance from the gear centre along the centreline [mm].
        inclination: inclination of the unmodified flank to the centreline, positive where the space widens outwards
            [rad].
        removed: material that the modification removes, along the normal [um].
    """

    roll_length: Profile
    x: Profile
    y: Profile
    inclination: Profile
    removed: Profile


def space_flank(
    side: Side, modification: AbstractModification, roll_length: Profile | None = None, *, points: int = _POINTS
) -> SpaceFlank:
    """The flank of a tooth space of one gear: the involute minus the modification.

    Args:
        side: the gear's side of the contact, of `mesh.sides`.
        modification: modification of this flank; the other one is its mirror image where both are alike.
        roll_length: where [mm], shape (points,); None for evenly spaced points from the form circle to the tip.
        points: their number.

    Raises:
        ValueError: for less than 2 points.
    """
    return _space_flank(side, modification, roll_length, whole("points", points, 2))


@program
def _space_flank(
    side: Side, modification: AbstractModification, roll_length: Profile | None, points: int
) -> SpaceFlank:
    if roll_length is None:
        roll_length = jnp.linspace(outline(side.gear).form_roll_length, side.tip_roll_length, points)
    removed = removed_at(side, modification, roll_length)
    x, y, inclination = space_point(side, roll_length, removed)
    return SpaceFlank(roll_length, x, y, inclination, removed)


def space_point(
    side: Side, roll_length: Float[Array, "..."], removed: Float[Array, "..."]
) -> tuple[Float[Array, "..."], ...]:
    """Coordinates x, y [mm] and inclination [rad] of points of a flank after the removal of material [um]."""
    gear = side.gear
    check_external(gear)
    check_spur(gear)
    base = jnp.broadcast_to(gear.base_radius, roll_length.shape)
    angle = jnp.pi / gear.teeth + load_angle(gear, roll_length)
    left = roll_length - 1e-3 * removed
    x = base * jnp.sin(angle) - left * jnp.cos(angle)
    return x, base * jnp.cos(angle) + left * jnp.sin(angle), angle


Scalar = Float[Array, ""]

_SUBSTITUTIONS = 3  # each makes the error smaller by the slope of the flank, 0.01 at most


class WheelProfile(NamedTuple):
    """Active profile of the wheel for one flank, from the form circle to the tip form circle of the gear.

    A chamfer is not ground: without one the tip form circle is the tip circle.

    Attributes:
        x: from the middle plane of the wheel [mm], shape (points,).
        y: distance from the wheel's outer diameter towards its axis [mm].
        diameter: diameter of the gear, on which the point grinds [mm].
        roll_length: roll length of the unmodified flank [mm]; the last is longer than that of the tip by what is
            removed there.
        removed: material removed by the modification [um].
    """

    x: Profile
    y: Profile
    diameter: Profile
    roll_length: Profile
    removed: Profile


class GrindingMargins(Checked):
    """Numbers that are positive where a wheel can grind a tooth space.

    Attributes:
        form_clearance: roll length of the active profile above the form circle, where the wheel meets the fillet [mm].
        tip_width: width of the wheel where it starts to grind, on the form circle [mm]: the ground sides must not meet.
        widening: least angle between the ground flank and the centreline of the space [deg]; a space that narrows
            outwards cannot be left radially, and the dressing tool does not reach behind the wheel's edge.
    """

    form_clearance: Scalar = result("mm")
    tip_width: Scalar = result("mm")
    widening: Scalar = result("deg")


class GrindingWheel(Checked):
    """Size of a wheel.

    Attributes:
        radius: outer radius [mm].
        flange_radius: flange radius of the flanges or the spindle that hold it [mm].
    """

    radius: Scalar = number("mm", low=0.0, open_low=True)
    flange_radius: Scalar = number("mm", low=0.0, default=0.0)

    def check_together(self) -> None:
        radius, flange = concrete(self.radius), concrete(self.flange_radius)
        if radius is not None and flange is not None and not flange < radius:
            raise ValueError(f"GrindingWheel: flange_radius = {flange:g} mm must be less than radius = {radius:g} mm")


@program
def wheel_profile(side: Side, modification: AbstractModification, *, points: int = 201) -> WheelProfile:
    """Active profile of the wheel that grinds a flank.

    Args:
        side: the gear's side of the contact, of `mesh.sides`.
        modification: modification of the flank, taken in the middle of the face; what varies along the face comes from
            the feed.
        points: evenly spaced in roll length from the form circle to where the modified flank meets the tip form circle.

    Raises:
        ValueError: for less than 2 points.
    """
    whole("points", points, 2)
    roll = jnp.linspace(outline(side.gear).form_roll_length, _end(side, modification), points)
    flank = space_flank(side, modification, roll)
    y = flank.y - side.gear.root_circle_radius
    return WheelProfile(flank.x, y, 2 * jnp.hypot(flank.x, flank.y), flank.roll_length, flank.removed)


@program
def grinding_margins(side: Side, modification: AbstractModification) -> GrindingMargins:
    """Margins of a tooth space that a form wheel can grind; differentiable."""
    flank = space_flank(side, modification)
    angle = jnp.arctan2(jnp.diff(flank.x), jnp.diff(flank.y))
    clearance = side.start_roll_length - outline(side.gear).form_roll_length
    return GrindingMargins(clearance, 2 * flank.x[0], jnp.rad2deg(minimum(angle)))


def smallest_wheel_radius(side: Side, flange_radius: Given) -> Scalar:
    """Least outer radius [mm] that keeps flanges of a radius [mm] off the tip circle at full depth.

    Raises:
        ValueError: for a negative radius.
    """
    check("flange_radius", flange_radius, "mm", low=0.0)
    return _depth(side) + flange_radius


def run_out(side: Side, radius: Given) -> Scalar:
    """Travel of the wheel axis beyond the face until the wheel has left the tooth space [mm], for a wheel radius [mm].

    A chord of the wheel at full depth t: sqrt(t (2 R - t)). A shoulder beside the gear must be farther away.

    Raises:
        ValueError: for a wheel that is smaller than the teeth are high.
    """
    depth = _depth(side)
    known = concrete(depth)
    check("radius", radius, "mm", low=None if known is None else float(known), open_low=True)
    return jnp.sqrt(depth * (2 * radius - depth))


def largest_wheel_radius(side: Side, gap: Given) -> Scalar:
    """Largest outer radius [mm] whose `run_out` stays within a gap to a shoulder [mm] that is as high as the teeth.

    Raises:
        ValueError: for a gap that is smaller than the teeth are high: so is the radius of any wheel for it.
    """
    depth = _depth(side)
    known = concrete(depth)
    check("gap", gap, "mm", low=None if known is None else float(known), open_low=True)
    return (depth**2 + gap**2) / (2 * depth)


def grinding_faults(wheel: GrindingWheel, side: Side, modification: AbstractModification) -> tuple[str, ...]:
    """Reasons why no wheel can grind a concrete gear, one line each; empty if one can."""
    margins, faults = grinding_margins(side, modification), []
    for name, value, unit in (
        ("form_clearance", margins.form_clearance, "mm"),
        ("tip_width", margins.tip_width, "mm"),
        ("widening", margins.widening, "deg"),
    ):
        if not float(value) > 0:
            faults.append(f"grinding: {name} = {float(value):.4g} {unit} must be greater than 0 {unit}")
    least = float(smallest_wheel_radius(side, wheel.flange_radius))
    if float(wheel.radius) < least:
        faults.append(f"GrindingWheel: radius = {float(wheel.radius):g} mm must be at least {least:.6g} mm")
    return tuple(faults)


def _end(side: Side, modification: AbstractModification) -> Scalar:
    """Roll length whose point of the modified flank lies on the tip form circle [mm].

    Where a relief h moves the tip of the nominal flank inwards, the flank goes on to L - h(L) = L_tip, by substitution.
    """
    end = tip = side.tip_roll_length
    for _ in range(_SUBSTITUTIONS):
        end = tip + 1e-3 * removed_at(side, modification, end[None])[0]
    return end


def _depth(side: Side) -> Scalar:
    """Radial distance from the root to the tip circle [mm]."""
    return side.gear.tip_radius - side.gear.root_circle_radius
