"""Charts of a gear measuring machine: traces of a flank, their evaluation range and tolerance band, deviations.

Sign of the machines: deviations are normal to the flank and positive for excess material, so a relief is negative;
modifications count the material removed. The nominal involute is the zero line.
"""

from typing import Literal, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..contact import Side
from ..geometry import diameter, roll_angle
from ..metrics import removed_at
from ..microgeometry import AbstractModification, TabulatedFlank, TabulatedProfile
from ..numerics import Checked, Given, check, concrete, maximum, minimum, program, result, whole
from .limits import ToleranceClass, iso_rounded

Scalar = Float[Array, ""]
Points = Float[Array, " points"]
Marks = Bool[Array, " points"]

_POINTS = 101
_ROUNDING = 16  # of the last place
_SAME_PLACE = 1e-3  # mm; a micrometre along a flank changes nothing that a machine resolves
_EVALUATED = 0.95  # of the profile from the start of the active profile on (ISO 1328-1:2013, L_alpha)
_END = 0.05  # of the face width, left out at either end, or a module where that is less (ISO 1328-1:2013, L_beta)


class Trace(Checked):
    """One trace of a flank; every array has the shape (points,).

    Attributes:
        kind: "profile" along the tooth depth, or "helix" along the face.
        face_coordinate: face coordinate from the middle of the face [mm].
        roll_angle: [deg].
        roll_length: [mm].
        diameter: [mm].
        design: the design flank [um], positive for material added to the nominal involute.
        upper, lower: limits [um], the total tolerance spread evenly about the design; NaN outside the evaluation range,
            and everywhere without a tolerance.
    """

    kind: Literal["profile", "helix"] = eqx.field(static=True)
    face_coordinate: Points = result("mm")
    roll_angle: Points = result("deg")
    roll_length: Points = result("mm")
    diameter: Points = result("mm")
    design: Points = result("um")
    upper: Points = result("um")
    lower: Points = result("um")


class FlankPlace(NamedTuple):
    """Places along the profile as roll length, roll angle and diameter.

    Attributes:
        roll_length: [mm].
        roll_angle: [deg].
        diameter: [mm].
    """

    roll_length: Float[Array, "..."]
    roll_angle: Float[Array, "..."]
    diameter: Float[Array, "..."]


class FlankDeviations(NamedTuple):
    """Deviations of a measured trace from the design trace within the evaluation range (ISO 1328-1) [um].

    Excess material between the evaluation range of a profile and the tip counts for form and total, missing material
    there, a chamfer, does not; at the ends of the face nothing counts.

    Attributes:
        slope: f_Halpha or f_Hbeta, rise of the mean line between the ends of the evaluation range, `profile_range` or
            `helix_range`; positive for excess material towards the tip, or towards positive face coordinates. Machines
            that extend the mean line over the whole active profile or face tell more in the ratio of the lengths,
            1 / 0.95 for a profile.
        form: f_falpha or f_fbeta, width of the band about the mean line.
        total: F_alpha or F_beta, width of the band about the design.

    References:
        https://stein-sw.de/profil-formabweichung: regression within the evaluation range, and the excess material at
        the tip that the 2013 edition (DIN ISO 1328-1:2018) takes in.
    """

    slope: Scalar
    form: Scalar
    total: Scalar


def profile_range(side: Side) -> tuple[Scalar, Scalar]:
    """Roll lengths [mm] between which a profile is evaluated: 95 % of the active profile, from its start on."""
    start = side.start_roll_length
    return start, start + _EVALUATED * (side.tip_roll_length - start)


def helix_range(side: Side) -> tuple[Scalar, Scalar]:
    """Face coordinates [mm] between which a helix is evaluated: without 5 % of the face, or a module, at either end."""
    half = 0.5 * side.face_width - jnp.minimum(_END * side.face_width, side.gear.module)
    return -half, half


def flank_place(side: Side, roll_length: Float[Array, "..."]) -> FlankPlace:
    """Roll length [mm], roll angle [deg] and diameter [mm] of points on a flank, from their roll lengths [mm]."""
    return FlankPlace(roll_length, roll_angle(side.gear, roll_length), diameter(side.gear, roll_length))


def profile_trace(
    side: Side,
    modification: AbstractModification,
    tolerance: ToleranceClass | None = None,
    *,
    face_coordinate: Given = 0.0,
    roll_length: Points | None = None,
    points: int = _POINTS,
) -> Trace:
    """Profile trace of a flank, from the start of the active profile to the tip.

    Args:
        side: the gear's side of the contact, of `mesh.sides`.
        modification: modification of the flank.
        tolerance: class of the gear, for the band; None for no band.
        face_coordinate: face coordinate of the trace [mm].
        roll_length: where, shape (points,) [mm]; None for evenly spaced points.
        points: their number.

    Raises:
        ValueError: for less than 2 points, a face coordinate that is not finite, or a roll length that is negative, of
            a ring gear positive.
    """
    check("face_coordinate", face_coordinate, "mm")
    _check_roll_length(side, roll_length)
    if roll_length is None:
        whole("points", points, 2)
        roll_length = jnp.linspace(side.start_roll_length, side.tip_roll_length, points)
    dtype = side.start_roll_length.dtype
    return _profile(side, modification, tolerance, jnp.asarray(face_coordinate, dtype), jnp.asarray(roll_length, dtype))


def helix_trace(
    side: Side,
    modification: AbstractModification,
    tolerance: ToleranceClass | None = None,
    *,
    roll_length: Given | None = None,
    face_coordinate: Points | None = None,
    points: int = _POINTS,
) -> Trace:
    """Helix trace of a flank, across the face width of the gear.

    Args:
        side: the gear's side of the contact, of `mesh.sides`.
        modification: modification of the flank.
        tolerance: class of the gear, for the band; None for no band.
        roll_length: roll length of the trace [mm]; None for the pitch point.
        face_coordinate: where, shape (points,) [mm]; None for evenly spaced points.
        points: their number.

    Raises:
        ValueError: for less than 2 points, or a roll length that is negative, of a ring gear positive.
    """
    dtype = side.start_roll_length.dtype
    _check_roll_length(side, roll_length)
    roll = side.pitch_roll_length if roll_length is None else jnp.asarray(roll_length, dtype)
    if face_coordinate is None:
        whole("points", points, 2)
        face_coordinate = jnp.linspace(-0.5, 0.5, points, dtype=dtype) * side.face_width
    return _helix(side, modification, tolerance, roll, jnp.asarray(face_coordinate, dtype))


def _check_roll_length(side: Side, roll_length: Given | None) -> None:
    internal = side.gear.is_internal
    check("roll_length", roll_length, "mm", low=None if internal else 0.0, high=0.0 if internal else None)


@program
def _profile(
    side: Side, modification: AbstractModification, tolerance: ToleranceClass | None, face: Scalar, roll: Points
) -> Trace:
    inside = _between(roll, *profile_range(side))
    removed = removed_at(side, modification, roll, face[None])[0]
    total = None if tolerance is None else tolerance.profile_total
    return _trace("profile", side, roll, jnp.full_like(roll, face), removed, inside, total)


@program
def _helix(
    side: Side, modification: AbstractModification, tolerance: ToleranceClass | None, roll: Scalar, face: Points
) -> Trace:
    inside = _between(face, *helix_range(side))
    removed = removed_at(side, modification, roll[None], face)[:, 0]
    total = None if tolerance is None else tolerance.helix_total
    return _trace("helix", side, jnp.full_like(face, roll), face, removed, inside, total)


def table_traces(
    side: Side, table: TabulatedProfile | TabulatedFlank, tolerance: ToleranceClass | None = None
) -> list[Trace]:
    """Profile traces of a tabulated flank at the points of its table, such as measured points.

    Args:
        side: the gear's side of the contact, of `mesh.sides`.
        table: a flank table, or a profile table over roll lengths.
        tolerance: class of the gear, for the band; None for no band.
    """
    if isinstance(table, TabulatedFlank):
        roll, faces = table.roll_length, table.face_coordinate
    else:
        roll, faces = table.position, jnp.zeros((1,), table.position.dtype)
        if table.coordinate == "roll_angle":
            roll = jnp.deg2rad(roll) * side.base_radius
    return [profile_trace(side, table, tolerance, face_coordinate=face, roll_length=roll) for face in faces]


def flank_deviations(side: Side, design: Trace, measured: Trace) -> FlankDeviations:
    """Deviations of a measured trace from the design trace at the same places.

    The mean line is that of least squares over the points in the evaluation range.

    Raises:
        ValueError: for traces of other kinds or places, or with less than 2 points in the evaluation range.
    """
    if design.kind != measured.kind or design.design.shape != measured.design.shape:
        raise ValueError(
            f"measured is a {measured.kind} trace of {measured.design.shape[0]} points, must be a "
            f"{design.kind} trace of {design.design.shape[0]} points like the design"
        )
    place = design.roll_length if design.kind == "profile" else design.face_coordinate
    other = measured.roll_length if design.kind == "profile" else measured.face_coordinate
    low, high = profile_range(side) if design.kind == "profile" else helix_range(side)
    apart, inside = concrete(jnp.max(jnp.abs(place - other))), concrete(jnp.sum(_between(place, low, high)))
    if apart is not None and not apart <= _SAME_PLACE:
        raise ValueError(f"measured is {apart:.3g} mm off the places of the design, must be at them")
    if inside is not None and inside < 2:
        raise ValueError(f"{inside} points lie in the evaluation range, must be at least 2")
    end = side.tip_roll_length if design.kind == "profile" else high
    return _deviations(place, measured.design - design.design, low, high, end)


@program
def _deviations(place: Points, deviation: Points, low: Scalar, high: Scalar, end: Scalar) -> FlankDeviations:
    inside, counted = _between(place, low, high), _between(place, low, end)
    weight = inside.astype(deviation.dtype)
    count = jnp.sum(weight)
    centre, mean = jnp.sum(weight * place) / count, jnp.sum(weight * deviation) / count
    arm = weight * (place - centre)
    rate = jnp.sum(arm * deviation) / jnp.sum(arm * (place - centre))
    rest = deviation - mean - rate * (place - centre)
    return FlankDeviations(rate * (high - low), _band(rest, inside, counted), _band(deviation, inside, counted))


def _between(place: Points, low: Scalar, high: Scalar) -> Bool[Array, " points"]:
    """True for places within a range including its ends, up to rounding."""
    slack = _ROUNDING * jnp.finfo(place.dtype).eps * (jnp.abs(low) + jnp.abs(high))
    return (place >= low - slack) & (place <= high + slack)


def _band(values: Points, inside: Marks, counted: Marks) -> Scalar:
    """Range of values: the largest among `counted` points minus the smallest among `inside` points."""
    first = values[jnp.argmax(inside)]
    return maximum(jnp.where(counted, values, first)) - minimum(jnp.where(inside, values, first))


def _trace(
    kind: Literal["profile", "helix"],
    side: Side,
    roll: Points,
    face: Points,
    removed: Points,
    inside: Marks,
    total: Scalar | None,
) -> Trace:
    design = -removed
    half = jnp.nan if total is None else 0.5 * iso_rounded(total)
    band = jnp.where(inside, jnp.full_like(design, half), jnp.nan)
    place = flank_place(side, roll)
    return Trace(kind, face, place.roll_angle, roll, place.diameter, design, design + band, design - band)
