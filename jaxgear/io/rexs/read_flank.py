"""The modifications of a flank from components of REXS.

A parabola is taken as d^2 of the depth d into the relief, with a tangential start. An arc of a circle of the same
height C over the length L lies within C^3 / (4 L^2) of it, which is read as the parabola where that is below 0.01 um.
The exponential and the logarithmic shape are refused: REXS names them without a formula.
"""

from collections.abc import Callable, Iterator

from ...microgeometry import (
    AbstractCurve,
    AbstractModification,
    EndRelief,
    LeadCrowning,
    LeadSlope,
    Linear,
    Power,
    ProfileCrowning,
    ProfileSlope,
    RootRelief,
    TipRelief,
)
from ...numerics import real
from ..errors import DesignFileError, problem
from .rexs_model import Component
from .topography import flank_of
from .values import Frame, same

_ARC_ERROR = 0.01  # um: less than any machine holds


def read_modification(component: Component, frame: Frame) -> Iterator[AbstractModification]:
    """The modifications that a component describes.

    Raises:
        DesignFileError: for what is missing or not of the library.
    """
    read = _READERS.get(component.type)
    if read is None:
        raise component.refuse("", "is not a supported modification")
    try:
        yield from read(component, frame)
    except DesignFileError:
        raise
    except (ValueError, OverflowError) as error:  # numbers that together make no modification
        raise component.refuse("", problem(error)) from None


def _tip_relief(part: Component, frame: Frame) -> Iterator[AbstractModification]:
    start = _roll_length(part, "tip_relief_datum_diameter", frame)
    end = _roll_length(part, "tip_relief_evaluation_reference", frame, frame.tip)
    length = frame.tip - start
    if not start < min(end, frame.tip):
        raise part.refuse(
            "tip_relief_datum_diameter", "must be less than the tip diameter and where the depth is given"
        )
    curve, power = _relief_shape(part, _amount(part, "tip_relief_depth"), end - start)
    yield TipRelief(real(_at_end(part, "tip_relief_depth", length, end - start, power)), real(length), curve)


def _root_relief(part: Component, frame: Frame) -> Iterator[AbstractModification]:
    end = _roll_length(part, "root_relief_datum_diameter", frame)
    start = _roll_length(part, "root_relief_evaluation_reference", frame)
    length = end - frame.start
    if not end > start:
        raise part.refuse("root_relief_datum_diameter", "must be greater than the diameter where the depth is given")
    if length <= 0:  # it ends below the active profile
        return
    curve, power = _relief_shape(part, _amount(part, "root_relief_depth"), end - start)
    yield RootRelief(real(_at_end(part, "root_relief_depth", length, end - start, power)), real(length), curve)


def _end_relief(face: str) -> Callable[[Component, Frame], Iterator[AbstractModification]]:
    depth, place = f"end_relief_depth_{face}", f"end_relief_evaluation_reference_{face}"

    def read(part: Component, frame: Frame) -> Iterator[AbstractModification]:
        length, end = part.needed(f"end_relief_length_{face}", "mm"), 0.5 * frame.width
        coordinate = part.number(place, "mm")
        # from where the depth is given to the start of the relief
        given = length if coordinate is None else length - (end - frame.place(face, coordinate))
        if not given > 0:
            raise part.refuse(place, f"{coordinate:g} mm lies outside the relief")
        curve, power = _relief_shape(part, _amount(part, depth), given)
        yield EndRelief(real(_at_end(part, depth, length, given, power)), real(length), curve, side=frame.side(face))

    return read


def _profile_crowning(part: Component, frame: Frame) -> Iterator[AbstractModification]:
    tip = _roll_length(part, "diameter_where_profile_crowning_tip_is_specified", frame, frame.tip)
    root = _roll_length(part, "diameter_where_profile_crowning_root_is_specified", frame)
    top = _roll_length(part, "profile_highest_point", frame, 0.5 * (root + tip))
    at_root, at_tip = "profile_crowning_at_root", "profile_crowning_at_tip"
    if not root < top < tip:
        raise part.refuse("profile_highest_point", "must lie between the diameters where the amounts are given")
    for amount, length in ((at_root, top - root), (at_tip, tip - top)):
        _crowning_shape(part, "shape_of_profile_crowning", _amount(part, amount), length)
    towards_root, towards_tip = top - frame.start, frame.tip - top
    first = _at_end(part, at_root, max(towards_root, 0.0), top - root, 2)
    last = _at_end(part, at_tip, max(towards_tip, 0.0), tip - top, 2)
    if same(towards_root, towards_tip) and _equal(first, last):
        yield ProfileCrowning(real(first))
        return
    if towards_root > 0:
        yield RootRelief(real(first), real(towards_root), Power(real(2.0)))
    if towards_tip > 0:
        yield TipRelief(real(last), real(towards_tip), Power(real(2.0)))


def _profile_slope(part: Component, frame: Frame) -> Iterator[AbstractModification]:
    start = _roll_length(part, "profile_evaluation_start", frame)
    end = _roll_length(part, "profile_evaluation_end", frame, frame.tip)
    given = _roll_length(part, "diameter_where_profile_slope_amount_is_specified", frame, end)
    if not given > start:
        raise part.refuse("profile_evaluation_start", "must be less than the diameter where the amount is given")
    yield ProfileSlope(real(_at_end(part, "profile_slope", frame.tip - frame.start, given - start, 1)))


def _helix_crowning(part: Component, frame: Frame) -> Iterator[AbstractModification]:
    faces, half = ("datum_face", "non_datum_face"), 0.5 * frame.width
    given = [part.number(f"coordinate_where_helix_crowning_is_specified_{face}", "mm") for face in faces]
    # from the middle towards each face
    ends = [half if at is None else frame.place(face, at) for face, at in zip(faces, given)]
    highest = part.number("helix_highest_point", "mm")
    top = 0.5 * (ends[0] - ends[1]) if highest is None else frame.place("datum_face", highest)
    if not -ends[1] < top < ends[0]:
        raise part.refuse("helix_highest_point", "must lie between the coordinates where the amounts are given")
    amounts = []
    for face, there, length in ((faces[0], ends[0] - top, half - top), (faces[1], ends[1] + top, half + top)):
        name = f"helix_crowning_amount_{face}"
        _crowning_shape(part, "shape_of_helix_crowning", _amount(part, name), there)
        amounts.append((face, _at_end(part, name, max(length, 0.0), there, 2), length))
    if same(top, 0.0) and _equal(amounts[0][1], amounts[1][1]):
        yield LeadCrowning(real(amounts[0][1]))
        return
    for face, amount, length in amounts:
        if length > 0:
            yield EndRelief(real(amount), real(length), Power(real(2.0)), side=frame.side(face))


def _helix_slope(part: Component, frame: Frame) -> Iterator[AbstractModification]:
    start, end = part.number("helix_evaluation_start", "mm"), part.number("helix_evaluation_end", "mm")
    usual = "facewidth" if start is None or end is None else "helix_evaluation_length"
    known = ["facewidth", "helix_evaluation_length"]
    length = frame.width
    if part.choice("helix_evaluation_reference", usual, known) == "helix_evaluation_length":
        if start is None or end is None or not end > start:
            raise part.refuse("helix_evaluation_end", "must be given, and greater than helix_evaluation_start")
        length = end - start
    yield LeadSlope(real(-frame.mirror * frame.datum * _at_end(part, "helix_slope", frame.width, length, 1)))


def _topography(part: Component, frame: Frame) -> Iterator[AbstractModification]:
    yield flank_of(part, frame)


def _roll_length(part: Component, name: str, frame: Frame, default: float | None = None) -> float:
    """Roll length at a diameter."""
    diameter = part.number(name, "mm")
    if diameter is None:
        if default is None:
            raise part.refuse(name, "missing")
        return default
    found = float(frame.roll_length(diameter))
    if not found >= 0:
        raise part.refuse(name, f"{diameter:g} mm must be at least {2 * frame.base_radius:g} mm, the base diameter")
    return found


def _amount(part: Component, name: str) -> float:
    """An amount [um]."""
    amount = part.number(name, "mm", shift=3)
    if amount is None:
        raise part.refuse(name, "missing")
    return amount


def _at_end(part: Component, name: str, length: float, given: float, power: int) -> float:
    """The amount [um] of a power law at another length than that for which it is given [mm]."""
    amount = _amount(part, name)
    return amount if same(length, given) else amount * (length / given) ** power


def _relief_shape(part: Component, amount: float, length: float) -> tuple[AbstractCurve, int]:
    """The curve of a relief, and the power of the depth that it is."""
    if part.flag("specify_tangential_transition", False):
        raise part.refuse("specify_tangential_transition", "is not supported, must be false")
    shape = part.choice("shape_of_relief", None, ["linear", "parabolic", "circular"])
    if shape == "linear":
        return Linear(), 1
    _check_arc(part, "shape_of_relief", shape, amount, length)
    return Power(real(2.0)), 2


def _crowning_shape(part: Component, name: str, amount: float, length: float) -> None:
    _check_arc(part, name, part.choice(name, "parabolic", ["parabolic", "circular"]), amount, length)


def _check_arc(part: Component, name: str, shape: str, amount: float, length: float) -> None:
    """Refuses an arc that is no parabola."""
    error = abs(amount) * (1e-3 * amount / length) ** 2 / 4
    if shape == "circular" and error > _ARC_ERROR:
        raise part.refuse(name, f'"circular" is {error:.2g} um off the parabola, must be within {_ARC_ERROR:g} um')


def _equal(first: float, second: float) -> bool:
    return abs(first - second) <= 1e-12 * max(abs(first), abs(second))


_READERS: dict[str, Callable[[Component, Frame], Iterator[AbstractModification]]] = {
    "tip_relief": _tip_relief,
    "root_relief": _root_relief,
    "end_relief_datum_face": _end_relief("datum_face"),
    "end_relief_non_datum_face": _end_relief("non_datum_face"),
    "profile_crowning": _profile_crowning,
    "profile_slope": _profile_slope,
    "helix_crowning": _helix_crowning,
    "helix_slope": _helix_slope,
    "topographical_modification": _topography,
}
