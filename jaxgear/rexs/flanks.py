"""The modifications of a flank as components of REXS, written and read.

Amounts are in mm and positive where material is removed; every component is additive. Lengths of the library are
written as diameters and face coordinates, which leave no question of where a length begins. A relief of b1 d + b2 d^2
is a linear and a parabolic one together. Other curves are written as points.

A parabola is read as d^2 of the depth d into the relief, with a tangential start. An arc of a circle of the same
height C over the length L lies within C^3 / (4 L^2) of it, which is read as the parabola where that is below 0.01 um.
The exponential and the logarithmic shape are refused: REXS names them without a formula.
"""

from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np

from ..io.errors import DesignFileError, problem
from ..microgeometry import (
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
from ..numerics import real
from .frame import Frame, same
from .model import Component, Model, shifted
from .points import flank_of, plain_terms, points, powers

FACES = ("datum_face", "non_datum_face")  # at negative and positive face coordinates of a written file
_ARC_ERROR = 0.01  # um: less than any machine holds
_RELIEFS = (TipRelief, RootRelief, EndRelief)
_EXACT = (*_RELIEFS, ProfileCrowning, ProfileSlope, LeadCrowning, LeadSlope)
_SHAPES = {1: "linear", 2: "parabolic"}  # of a relief, by the power of its depth
_Crowning = tuple[str, tuple[str, ...], tuple[str, ...], str]
# attributes of a crowning: its shape, both amounts, where they are given, and where nothing is removed
_PROFILE_CROWNING: _Crowning = (
    "shape_of_profile_crowning",
    ("profile_crowning_at_root", "profile_crowning_at_tip"),
    tuple(f"diameter_where_profile_crowning_{end}_is_specified" for end in ("root", "tip")),
    "profile_highest_point",
)
_HELIX_CROWNING: _Crowning = (
    "shape_of_helix_crowning",
    tuple(f"helix_crowning_amount_{face}" for face in FACES),
    tuple(f"coordinate_where_helix_crowning_is_specified_{face}" for face in FACES),
    "helix_highest_point",
)


def write_modification(
    model: Model,
    flanks: Iterable[Component],
    frame: Frame,
    modification: AbstractModification,
    *,
    owner: str,
    error: float,
) -> None:
    """Write the modification of both flanks of a gear.

    Args:
        model: the file.
        flanks: components of both flanks.
        frame: the flank within its pair.
        modification: modification of the library.
        owner: name of the gear, for messages.
        error: largest error of a curve that is written as points [um].

    Raises:
        DesignFileError: for a step, which no points can show.
    """
    for term in plain_terms(modification):
        for kind, values in _components(term, frame, owner, error):
            part = model.add(kind, "", is_additive_modification=(True, "none"), **values)
            for flank in flanks:
                model.relate("reference", origin=flank, referenced=part)


def _components(term: Any, frame: Frame, owner: str, error: float) -> Iterator[tuple[str, dict[str, tuple[Any, str]]]]:
    """Types of the components of a term, with (value, unit) of their attributes."""
    relief = type(term) in _RELIEFS
    shares = powers(term.curve) if relief else {0: 1.0}
    if type(term) not in _EXACT or shares is None or (isinstance(term, TipRelief) and frame.tip < float(term.length)):
        yield "topographical_modification", _points(term, frame, owner, error)
    elif not relief or float(term.length) > 0:
        for power, share in shares.items():
            amount = shifted(np.asarray(term.amount) if share == 1 else share * np.asarray(term.amount), -3), "mm"
            shape = {"shape_of_relief": _SHAPES[power]} if relief else {}
            for kind, words, amounts, lengths in _exact(term, frame):
                said = {name: (word, "none") for name, word in (shape | words).items()}
                yield kind, said | dict.fromkeys(amounts, amount) | {n: (mm, "mm") for n, mm in lengths.items()}


def _exact(term: Any, frame: Frame) -> list[tuple[str, dict[str, str], Iterable[str], dict[str, Any]]]:
    """Types of the components of a term, words, attributes of the amount, lengths [mm]; words and lengths by name."""
    start, tip, half = frame.start, frame.tip, 0.5 * frame.width
    length = float(getattr(term, "length", 0.0))
    match term:
        case TipRelief():
            ends = _diameters(frame, tip_relief_datum_diameter=tip - length, tip_relief_evaluation_reference=tip)
            return [("tip_relief", {}, ["tip_relief_depth"], ends)]
        case RootRelief():
            ends = _diameters(frame, root_relief_datum_diameter=start + length, root_relief_evaluation_reference=start)
            return [("root_relief", {}, ["root_relief_depth"], ends)]
        case EndRelief():
            return [
                (f"end_relief_{face}", {}, [f"end_relief_depth_{face}"], {
                    f"end_relief_length_{face}": length,
                    f"end_relief_evaluation_reference_{face}": frame.place(face, half),
                })
                for face, side in zip(FACES, ("negative", "positive"))
                if term.side in ("both", side)
            ]  # fmt: skip
        case ProfileCrowning():
            shape, amounts, places, top = _PROFILE_CROWNING
            ends = _diameters(frame, **dict(zip((*places, top), (start, tip, 0.5 * (start + tip)))))
            return [("profile_crowning", {shape: "parabolic"}, amounts, ends)]
        case LeadCrowning():
            shape, amounts, places, top = _HELIX_CROWNING
            return [("helix_crowning", {shape: "parabolic"}, amounts, dict(zip((*places, top), (-half, half, 0.0))))]
        case ProfileSlope():
            given = "diameter_where_profile_slope_amount_is_specified"
            ends = _diameters(frame, profile_evaluation_start=start, profile_evaluation_end=tip, **{given: tip})
            return [("profile_slope", {}, ["profile_slope"], ends)]
    words = {"helix_evaluation_reference": "helix_evaluation_length"}
    return [("helix_slope", words, ["helix_slope"], {"helix_evaluation_start": -half, "helix_evaluation_end": half})]


def _diameters(frame: Frame, **roll_lengths: float) -> dict[str, Any]:
    return {name: frame.diameter(roll_length) for name, roll_length in roll_lengths.items()}


def _points(term: AbstractModification, frame: Frame, owner: str, error: float) -> dict[str, tuple[Any, str]]:
    try:
        roll, face, amount = points(term, frame, error)
    except ValueError as reason:
        raise DesignFileError(owner, f"{type(term).__name__} {reason}") from None
    diameters, coordinates = np.meshgrid(frame.diameter(roll), face, indexing="ij")
    return {
        "type_of_interpolation_topographical_modification": ("linear", "none"),
        "diameters_of_topographical_modification": (diameters.ravel(), "mm"),
        "coordinates_of_topographical_modification": (coordinates.ravel(), "mm"),
        "topographical_modification_amounts": (shifted(amount.ravel(), -3), "mm"),
    }


def read_modification(component: Component, frame: Frame) -> Iterator[AbstractModification]:
    """The modifications that a component describes.

    Raises:
        DesignFileError: for missing or unsupported attributes.
    """
    if component.type not in _READERS:
        raise component.refuse("", "is not a supported modification")
    try:
        yield from _READERS[component.type](component, frame)
    except DesignFileError:
        raise
    except (ValueError, OverflowError) as error:  # numbers that together make no modification
        raise component.refuse("", problem(error)) from None


def _tip_relief(part: Component, frame: Frame) -> Iterator[AbstractModification]:
    start = _roll_length(part, "tip_relief_datum_diameter", frame)
    end = _roll_length(part, "tip_relief_evaluation_reference", frame, frame.tip)
    if not start < min(end, frame.tip):
        raise part.refuse(
            "tip_relief_datum_diameter", "must be less than the tip diameter and where the depth is given"
        )
    yield TipRelief(*_relief(part, "tip_relief_depth", frame.tip - start, end - start))


def _root_relief(part: Component, frame: Frame) -> Iterator[AbstractModification]:
    end = _roll_length(part, "root_relief_datum_diameter", frame)
    start = _roll_length(part, "root_relief_evaluation_reference", frame)
    if not end > start:
        raise part.refuse("root_relief_datum_diameter", "must be greater than the diameter where the depth is given")
    if end > frame.start:  # else it ends below the active profile
        yield RootRelief(*_relief(part, "root_relief_depth", end - frame.start, end - start))


def _end_relief(part: Component, frame: Frame) -> Iterator[AbstractModification]:
    face = part.type.removeprefix("end_relief_")
    place = f"end_relief_evaluation_reference_{face}"
    length, coordinate = part.needed(f"end_relief_length_{face}", "mm"), part.number(place, "mm")
    # from where the depth is given to the start of the relief
    given = length if coordinate is None else length - (0.5 * frame.width - frame.place(face, coordinate))
    if not given > 0:
        raise part.refuse(place, f"{coordinate:g} mm lies outside the relief")
    yield EndRelief(*_relief(part, f"end_relief_depth_{face}", length, given), side=frame.side(face))


def _relief(part: Component, name: str, length: float, given: float) -> tuple[Any, Any, AbstractCurve]:
    """Amount, length and curve of a relief, from the depth at a given distance from its start."""
    if part.flag("specify_tangential_transition", False):
        raise part.refuse("specify_tangential_transition", "is not supported, must be false")
    shape = part.choice("shape_of_relief", None, ["linear", "parabolic", "circular"])
    power = 1 if shape == "linear" else 2
    _check_arc(part, "shape_of_relief", shape, _amount(part, name), given)
    curve = Linear() if power == 1 else Power(real(2.0))
    return real(_at_end(part, name, length, given, power)), real(length), curve


def _profile_crowning(part: Component, frame: Frame) -> Iterator[AbstractModification]:
    shape, amounts, (at_root, at_tip), highest = _PROFILE_CROWNING
    tip, root = _roll_length(part, at_tip, frame, frame.tip), _roll_length(part, at_root, frame)
    top = _roll_length(part, highest, frame, 0.5 * (root + tip))
    if not root < top < tip:
        raise part.refuse(highest, "must lie between the diameters where the amounts are given")
    lengths = top - frame.start, frame.tip - top
    found = _crowning(part, shape, amounts, lengths, (top - root, tip - top))
    if same(*lengths) and _equal(*found):
        yield ProfileCrowning(real(found[0]))
        return
    for relief, amount, length in zip((RootRelief, TipRelief), found, lengths):
        if length > 0:
            yield relief(real(amount), real(length), Power(real(2.0)))


def _helix_crowning(part: Component, frame: Frame) -> Iterator[AbstractModification]:
    shape, amounts, places, name = _HELIX_CROWNING
    half, given, highest = 0.5 * frame.width, [part.number(place, "mm") for place in places], part.number(name, "mm")
    # from the middle towards each face
    ends = [half if at is None else frame.place(face, at) for face, at in zip(FACES, given)]
    top = 0.5 * (ends[0] - ends[1]) if highest is None else frame.place("datum_face", highest)
    if not -ends[1] < top < ends[0]:
        raise part.refuse(name, "must lie between the coordinates where the amounts are given")
    lengths = half - top, half + top
    found = _crowning(part, shape, amounts, lengths, (ends[0] - top, ends[1] + top))
    if same(top, 0.0) and _equal(*found):
        yield LeadCrowning(real(found[0]))
        return
    for face, amount, length in zip(FACES, found, lengths):
        if length > 0:
            yield EndRelief(real(amount), real(length), Power(real(2.0)), side=frame.side(face))


def _crowning(
    part: Component, shape: str, amounts: Iterable[str], lengths: Iterable[float], given: Iterable[float]
) -> list[float]:
    """Amounts [um] at both ends of the flank, from the amounts at given distances from the highest point."""
    found = []
    for name, length, there in zip(amounts, lengths, given):
        _check_arc(part, shape, part.choice(shape, "parabolic", ["parabolic", "circular"]), _amount(part, name), there)
        found.append(_at_end(part, name, max(length, 0.0), there, 2))
    return found


def _profile_slope(part: Component, frame: Frame) -> Iterator[AbstractModification]:
    start = _roll_length(part, "profile_evaluation_start", frame)
    end = _roll_length(part, "profile_evaluation_end", frame, frame.tip)
    given = _roll_length(part, "diameter_where_profile_slope_amount_is_specified", frame, end)
    if not given > start:
        raise part.refuse("profile_evaluation_start", "must be less than the diameter where the amount is given")
    yield ProfileSlope(real(_at_end(part, "profile_slope", frame.tip - frame.start, given - start, 1)))


def _helix_slope(part: Component, frame: Frame) -> Iterator[AbstractModification]:
    start, end = part.number("helix_evaluation_start", "mm"), part.number("helix_evaluation_end", "mm")
    known = ["facewidth", "helix_evaluation_length"]
    length = frame.width
    if part.choice("helix_evaluation_reference", known[start is not None and end is not None], known) == known[1]:
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
    """Amount [um] of a power law at a length [mm], from the amount at a given length."""
    amount = _amount(part, name)
    return amount if same(length, given) else amount * (length / given) ** power


def _check_arc(part: Component, name: str, shape: str, amount: float, length: float) -> None:
    """Raise for an arc of a circle that differs from the parabola."""
    error = abs(amount) * (1e-3 * amount / length) ** 2 / 4
    if shape == "circular" and error > _ARC_ERROR:
        raise part.refuse(name, f'"circular" is {error:.2g} um off the parabola, must be within {_ARC_ERROR:g} um')


def _equal(first: float, second: float) -> bool:
    return abs(first - second) <= 1e-12 * max(abs(first), abs(second))


_READERS: dict[str, Callable[[Component, Frame], Iterator[AbstractModification]]] = {
    "tip_relief": _tip_relief,
    "root_relief": _root_relief,
    **{f"end_relief_{face}": _end_relief for face in FACES},
    "profile_crowning": _profile_crowning,
    "profile_slope": _profile_slope,
    "helix_crowning": _helix_crowning,
    "helix_slope": _helix_slope,
    "topographical_modification": _topography,
}
