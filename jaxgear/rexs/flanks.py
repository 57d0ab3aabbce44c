"""The modifications of a flank as components of REXS, written and read.

Amounts are in mm and positive where material is removed; every component is additive. Lengths of the library are
written as diameters and face coordinates, which leave no question of where a length begins. A relief of b1 d + b2 d^2
is a linear and a parabolic one together. Other curves are written as points.

A parabola is read as d^2 of the depth d into the relief, with a tangential start. An arc of a circle of the same
height C over the length L lies within C^3 / (4 L^2) of it, which is read as the parabola where that is below 0.01 um.
The exponential and the logarithmic shape are refused: REXS names them without a formula.
"""

from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple

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
_SHAPES = {1: "linear", 2: "parabolic"}  # of a relief, by the power of its depth
_RELIEFS = {TipRelief: "tip", RootRelief: "root"}
_CROWNINGS = {ProfileCrowning: "profile_crowning", LeadCrowning: "helix_crowning"}
_EXACT = {*_RELIEFS, EndRelief, *_CROWNINGS, ProfileSlope, LeadSlope}
_TOO_FAR = {
    "tip": "must be less than the tip diameter and where the depth is given",
    "root": "must be greater than the diameter where the depth is given",
}


class _Rise(NamedTuple):
    """Amount of a component that rises from an origin to one end of the flank, with the names of its attributes.

    Places count towards that end [mm]: roll lengths towards the tip, negative ones towards the root, and distances from
    the middle of the face towards either face.

    Attributes:
        end: "tip", "root", "datum_face" or "non_datum_face".
        amount: attribute of the amount.
        place: attribute of the place where the amount is given: a diameter, or a face coordinate.
        origin: attribute of the place where the rise begins; of an end relief of its length.
    """

    end: str
    amount: str
    place: str
    origin: str

    @property
    def on_face(self) -> bool:
        """True for a rise over the face."""
        return self.end in FACES

    def end_place(self, frame: Frame) -> float:
        """Place of the end of the flank [mm]."""
        return {"tip": frame.tip, "root": -frame.start}.get(self.end, 0.5 * frame.width)

    def written(self, frame: Frame, place: float) -> Any:
        """Diameter or face coordinate of a place."""
        return frame.place(self.end, place) if self.on_face else frame.diameter(place)

    def read(self, part: Component, name: str, frame: Frame) -> float | None:
        """Place in an attribute; None where that is absent."""
        value = part.number(name, "mm")
        if value is None:
            return None
        if self.on_face:
            return frame.place(self.end, value)
        found = float(frame.roll_length(value))
        if np.isnan(found):
            base = f"{2 * abs(frame.base_radius):g} mm, the base diameter"
            raise part.refuse(name, f"{value:g} mm must be at least {base}")
        return found if self.end == "tip" else -found

    def needed(self, part: Component, name: str, frame: Frame) -> float:
        """Place in a required attribute."""
        found = self.read(part, name, frame)
        if found is None:
            raise part.refuse(name, "missing")
        return found

    def given_place(self, part: Component, frame: Frame) -> float:
        """Place where the amount is given: required at the root, else by default the end of the flank."""
        if self.end == "root":
            return self.needed(part, self.place, frame)
        found = self.read(part, self.place, frame)
        return self.end_place(frame) if found is None else found

    def relief(self, frame: Frame, amount: float, length: float, curve: AbstractCurve) -> AbstractModification:
        """Relief of the library at this end of the flank: amount [um], length [mm], curve."""
        numbers = real(amount), real(length), curve
        if self.on_face:
            return EndRelief(*numbers, side=frame.side(self.end))
        return (TipRelief if self.end == "tip" else RootRelief)(*numbers)


# one table for both ways: type of a component, its ends of the flank, and the attributes of the rise to an end
_NAMES = (
    ("{}_relief", ("tip", "root"), "{}_relief_depth {}_relief_evaluation_reference {}_relief_datum_diameter"),
    ("end_relief_{}", FACES, "end_relief_depth_{} end_relief_evaluation_reference_{} end_relief_length_{}"),
    ("profile_crowning", ("root", "tip"), "profile_crowning_at_{} diameter_where_profile_crowning_{}_is_specified "
     "profile_highest_point"),
    ("helix_crowning", FACES, "helix_crowning_amount_{} coordinate_where_helix_crowning_is_specified_{} "
     "helix_highest_point"),
    ("profile_slope", ("tip",), "profile_slope diameter_where_profile_slope_amount_is_specified "
     "profile_evaluation_start"),
)  # fmt: skip
_RISES: dict[str, list[_Rise]] = {}
for _kind, _ends, _attributes in _NAMES:
    for _end in _ends:
        _rise = _Rise(_end, *(name.format(_end) for name in _attributes.split()))
        _RISES.setdefault(_kind.format(_end), []).append(_rise)


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
    relief = hasattr(term, "curve")
    shares = powers(term.curve) if relief else {0: 1.0}
    if (
        type(term) not in _EXACT
        or shares is None
        or (isinstance(term, TipRelief) and 0 < frame.tip < float(term.length))
    ):
        yield "topographical_modification", _points(term, frame, owner, error)
    elif not relief or float(term.length) > 0:
        for power, share in shares.items():
            amount = shifted(np.asarray(term.amount) if share == 1 else share * np.asarray(term.amount), -3), "mm"
            shape = {"shape_of_relief": (_SHAPES[power], "none")} if relief else {}
            for kind, amounts, lengths, words in _exact(term, frame):
                values = {name: (length, "mm") for name, length in lengths.items()}
                yield kind, shape | words | dict.fromkeys(amounts, amount) | values


def _exact(term: Any, frame: Frame) -> Iterator[tuple[str, list[str], dict[str, Any], dict[str, tuple[str, str]]]]:
    """Types of the components of a term, attributes of its amount, lengths [mm] and (word, unit) by their names."""
    half = 0.5 * frame.width
    if isinstance(term, LeadSlope):
        words = {"helix_evaluation_reference": ("helix_evaluation_length", "none")}
        yield "helix_slope", ["helix_slope"], {"helix_evaluation_start": -half, "helix_evaluation_end": half}, words
        return
    if isinstance(term, ProfileSlope):
        kinds, words = ["profile_slope"], {}
    elif crowning := _CROWNINGS.get(type(term)):
        kinds, words = [crowning], {f"shape_of_{crowning}": ("parabolic", "none")}
    elif end := _RELIEFS.get(type(term)):
        kinds, words = [f"{end}_relief"], {}
    else:
        sides = zip(FACES, ("negative", "positive"))
        kinds, words = [f"end_relief_{face}" for face, side in sides if term.side in ("both", side)], {}
    for kind in kinds:
        rises = _RISES[kind]
        ends = [rise.end_place(frame) for rise in rises]
        # between both ends, at the start of the evaluation range, or by the length of a relief from its end
        origin = 0.5 * (ends[-1] - ends[0]) if len(rises) > 1 else frame.start
        lengths = {rise.place: rise.written(frame, end) for rise, end in zip(rises, ends)}
        if kind == "profile_slope":
            lengths["profile_evaluation_end"] = frame.diameter(frame.tip)
        if hasattr(term, "length"):
            origin = ends[0] - float(term.length)
        last = rises[-1]
        by_length = last.on_face and len(rises) == 1
        lengths[last.origin] = float(term.length) if by_length else last.written(frame, origin)
        yield kind, [rise.amount for rise in rises], lengths, words


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
    """Modifications of the library from a component.

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


def _relief(part: Component, frame: Frame) -> Iterator[AbstractModification]:
    (rise,) = _RISES[part.type]
    place, end = rise.given_place(part, frame), rise.end_place(frame)
    origin = end - part.needed(rise.origin, "mm") if rise.on_face else rise.needed(part, rise.origin, frame)
    if not origin < (min(place, end) if rise.end == "tip" else place):
        if rise.on_face:
            raise part.refuse(rise.place, f"{rise.written(frame, place):g} mm lies outside the relief")
        raise part.refuse(rise.origin, _TOO_FAR[rise.end])
    if not origin < end:  # it ends below the active profile
        return
    if part.flag("specify_tangential_transition", False):
        raise part.refuse("specify_tangential_transition", "is not supported, must be false")
    shape = part.choice("shape_of_relief", None, ["linear", "parabolic", "circular"])
    power = 1 if shape == "linear" else 2
    _check_arc(part, "shape_of_relief", shape, _amount(part, rise.amount), place - origin)
    amount = _at_end(part, rise.amount, end - origin, place - origin, power)
    yield rise.relief(frame, amount, end - origin, Linear() if power == 1 else Power(real(2.0)))


def _crowning(part: Component, frame: Frame) -> Iterator[AbstractModification]:
    first, second = rises = _RISES[part.type]
    low, high = (rise.given_place(part, frame) for rise in rises)
    highest = second.read(part, second.origin, frame)
    top = 0.5 * (high - low) if highest is None else highest
    if not -low < top < high:
        places = "coordinates" if first.on_face else "diameters"
        raise part.refuse(second.origin, f"must lie between the {places} where the amounts are given")
    shape, found = f"shape_of_{part.type}", []
    for rise, place, down in ((first, low, top), (second, high, -top)):
        word, length = part.choice(shape, "parabolic", ["parabolic", "circular"]), rise.end_place(frame) + down
        _check_arc(part, shape, word, _amount(part, rise.amount), place + down)
        found.append((_at_end(part, rise.amount, max(length, 0.0), place + down, 2), length))
    (one, before), (other, behind) = found
    if same(before, behind) and _equal(one, other):
        yield (LeadCrowning if first.on_face else ProfileCrowning)(real(one))
        return
    for rise, (amount, length) in zip(rises, found):
        if length > 0:
            yield rise.relief(frame, amount, length, Power(real(2.0)))


def _profile_slope(part: Component, frame: Frame) -> Iterator[AbstractModification]:
    (rise,) = _RISES[part.type]
    start, end = rise.needed(part, rise.origin, frame), rise.read(part, "profile_evaluation_end", frame)
    given = rise.read(part, rise.place, frame)
    given = given if given is not None else frame.tip if end is None else end
    if not given > start:
        raise part.refuse(rise.origin, "must be less than the diameter where the amount is given")
    yield ProfileSlope(real(_at_end(part, rise.amount, frame.tip - frame.start, given - start, 1)))


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
    **dict.fromkeys(("tip_relief", "root_relief", *(f"end_relief_{face}" for face in FACES)), _relief),
    **dict.fromkeys(_CROWNINGS.values(), _crowning),
    "profile_slope": _profile_slope,
    "helix_slope": _helix_slope,
    "topographical_modification": _topography,
}
