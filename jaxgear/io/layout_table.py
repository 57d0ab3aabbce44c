"""Table [layout] of a design file: settings of the flank line and profile layout."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..conditions import LoadSpectrum
from ..layout import (
    FlankLineTolerance,
    flank_line_tolerance,
    helix_slope_limits,
    without_housing,
)
from ..metrics import Strength
from ..numerics import Number
from ..shafts import Misalignment, ShaftSupport
from .design_file import DesignFile
from .errors import DesignFileError, naming, refused
from .gears import both_classes, with_quality
from .table_keys import FileTable, built, entry, nested, section_of
from .tables import FurtherTable, Rest
from .value_types import QUALITY_CLASSES, choice, count, either, list_of, positive, real, switch

_AMOUNTS = list_of(real(Number("um", low=0.0)))
_FURTHER = list_of(real(Number("um")))
_LENGTHS = either(positive("mm"), list_of(positive("mm")), "a number or a list of numbers")
_HOURS = list_of(real(Number("h", low=0.0)))
_AXES = either(choice("class"), nested(section_of(Misalignment, open=False)), '"class" or a table')


class ProfileSection(FileTable):
    """Profile modifications that step 3 tries, those of both gears in all combinations.

    Attributes:
        type: type of the modification.
        pinion_amounts: amounts on the pinion.
        wheel_amounts: amounts on the wheel; those of the pinion without it.
        slopes: helix slopes of either sign on top of the flank line of the wheel, over the common face, crossed with
            the amounts; none without it.
        crownings: crownings of either sign, likewise.
        length: length of the tip reliefs, or several, crossed with the amounts; that of the zone of double contact
            (long relief) without it.
        torque_factor: torque of the contact analysis, in design torques.
        shafts: whether the contact analysis includes shafts, bearings and housing, with the flank lines of both steps
            and once for every support. Without them the flanks have the further crowning alone, as on shafts whose
            deflection is compensated.
    """

    type: str = entry(choice("tip_relief", "profile_crowning"), "tip_relief")
    pinion_amounts: list[float] = entry(_AMOUNTS, ...)
    wheel_amounts: list[float] | None = entry(_AMOUNTS)
    slopes: list[float] | None = entry(_FURTHER)
    crownings: list[float] | None = entry(_FURTHER)
    length: float | list[float] | None = entry(_LENGTHS)
    torque_factor: float = entry(positive(""), 0.9)
    shafts: bool = entry(switch(), True)


class LayoutSection(FurtherTable):
    """Layout of flank lines and profile modifications by `jaxgear layout`.

    Attributes:
        quality_class: flank tolerance class of ISO 1328-1, one for both gears or one each for pinion and wheel; the
            classes of the gears without it.
        misalignment: largest deviations of the axes, each of either sign: `skew` and `inclination` over the
            `bearing_span`, or `direct`, f_ma over the face, as in [misalignment]; "class" takes those of ISO/TR 10064-3
            by F_beta of the quality class, which over the face are the same for every bearing span. Parallel axes
            without it.
        gear: gear with the flank line that levels the load.
        direction: sense of rotation of the first shaft, seen against z.
        further_crowning: "rule" takes C_b = f_Hbeta of ISO 6336-1 Annex B for both gears and more where that does not
            suffice; "least" takes the least crowning that keeps the load off the edges.
        edge_share: permissible line load at an end of the face, as a share of the largest one inside.
        negative_crowning: True if the crowning of step 1 may be negative.
        stations: number of stations over the face in the analysis of ISO 6336-1 Annex E.
        torques: torques on the pinion of a duty cycle, with the S-N curves of [strength]; the load is levelled at the
            design torque without it.
        hours: operating hours at every torque.
        speeds: speed of the pinion at every torque.
        profile: profile modifications to be tried in step 3; no step 3 without it.
    """

    table = "layout"

    quality_class: int | list[int] | None = entry(QUALITY_CLASSES)
    misalignment: str | FileTable | None = entry(_AXES)
    gear: str = entry(choice("pinion", "wheel"), "wheel")
    direction: str = entry(choice("counterclockwise", "clockwise"), "counterclockwise")
    further_crowning: str = entry(choice("rule", "least"), "rule")
    edge_share: float = entry(real(Number(low=0.0, high=1.0, open_low=True)), 1.0)
    negative_crowning: bool = entry(switch(), False)
    stations: int = entry(count(5, 1001), 41)
    torques: list[float] | None = entry(list_of(positive("N m")))
    hours: list[float] | None = entry(_HOURS)
    speeds: list[float] | None = entry(list_of(positive("rpm")))
    profile: ProfileSection | None = entry(nested(ProfileSection))

    @classmethod
    def read(cls, given: Mapping[str, Any], rest: Rest) -> object:
        """The table, with the quality classes of the gears where it has none of its own."""
        if "bearing_span" in given:
            instead = 'misalignment = "class", or misalignment = { skew = ..., inclination = ..., bearing_span = ... }'
            raise DesignFileError("layout.bearing_span", f"has no effect without skew or inclination: write {instead}")
        return with_quality(super().read(given, rest), rest.quality_classes)

    def check(self, design: DesignFile) -> None:
        """As a layout does, but for what it finds itself."""
        _axes(self.misalignment, float(design.pair().face_width))
        _life(self, design.tables.get("strength"))
        _profile(self, quick=False)

    @classmethod
    def inner(cls) -> dict[str, type[FileTable]]:
        """Profile modifications."""
        return {"[layout.profile]": ProfileSection}


_QUICK_STATIONS, _QUICK_AMOUNTS = 21, 3
_TORQUES, _QUICK_TORQUES = 25, 7  # over the range of the file


@dataclasses.dataclass(frozen=True)
class LayoutRequest:
    """A layout of flank lines and profiles, checked.

    Attributes:
        supports: the mesh on its shafts, in the housing first where there is one, then on rigid seats.
        tolerances: by name.
        options: of `layout_flank_lines`.
        torques: on the pinion, at which K_Hbeta is computed: the range of the file, and those of the duty cycle [N m].
        profile: what step 3 tries; None for no step 3.
        profile_torque: on the pinion, of step 3 [N m].
    """

    supports: dict[str, ShaftSupport]
    tolerances: dict[str, FlankLineTolerance]
    options: dict[str, Any]
    torques: np.ndarray
    profile: ProfileSection | None
    profile_torque: float


def layout_request(design: DesignFile, *, quick: bool = False) -> LayoutRequest:
    """Checks what a design file says about a layout.

    Args:
        design: the design file.
        quick: fewer stations and profile modifications, for a first look.

    Raises:
        DesignFileError: for anything that is wrong with it, in one line that names the file and the key.
    """
    with naming(design.path):
        section = design.needed("layout", "it says for which tolerances the flank lines are designed")
        support = design.support
        assert support is not None  # every file with the table has one
        _check_open(design)
        pair = support.pair
        classes = both_classes(section.quality_class)
        axes = _axes(section.misalignment, float(pair.face_width))
        tolerances = {
            kind: refused("layout.quality_class", flank_line_tolerance, pair, classes, axes, kind=kind)
            for kind in ("statistical", "maximum")
        }
        further = helix_slope_limits(pair, classes) if section.further_crowning == "rule" else None
        options = {
            "gear": section.gear,
            "further": further,
            "share": section.edge_share,
            "negative_crowning": section.negative_crowning,
            "stations": min(section.stations, _QUICK_STATIONS) if quick else section.stations,
            **_life(section, design.tables.get("strength")),
        }
        housed = support.gearbox.housing is not None
        supports = {"housing": support, "rigid seats": without_housing(support)} if housed else {"rigid seats": support}
        profile = _profile(section, quick)
        range_of_file = np.linspace(*design.torque_range, _QUICK_TORQUES if quick else _TORQUES)
        torques = np.union1d(range_of_file, section.torques or [])
        torque = design.torque if profile is None else profile.torque_factor * design.torque
        return LayoutRequest(supports, tolerances, options, torques, profile, torque)


def _check_open(design: DesignFile) -> None:
    """Refuses what a layout finds itself."""
    if design.bounds:
        raise DesignFileError("variables", f"layout needs numbers, these are free: {', '.join(design.bounds)}")
    for gear, parts in (("pinion", design.design.pinion), ("wheel", design.design.wheel)):
        if parts:
            raise DesignFileError(f"{gear}.modification", "layout finds the modifications, leave them out")


def _axes(section: str | FileTable | None, width: float):
    """Limits of the axes, as `flank_line_tolerance` takes them."""
    if not isinstance(section, FileTable):
        return section
    key, amounts = section.at, section.given()
    span = amounts.pop("bearing_span", None)
    for name, value in amounts.items():
        if value < 0:
            raise DesignFileError(f"{key}.{name}", f"{value:g} um must be at least 0 um: it counts with either sign")
    if span is not None and not amounts.keys() & {"skew", "inclination"}:
        raise DesignFileError(f"{key}.bearing_span", "has no effect without skew or inclination")
    if span is not None and span < width:
        raise DesignFileError(f"{key}.bearing_span", f"{span:g} mm must be at least {width:g} mm, the face width")
    if not amounts:
        raise DesignFileError(key, "must have skew or inclination over a bearing_span, or direct")
    return built(section)


def _life(section: LayoutSection, strength: Strength | None) -> dict[str, Any]:
    """Duty cycle and strength."""
    keys = ["hours", "speeds"]
    if section.torques is None:
        section.refuse(keys, " without layout.torques")
        return {}
    for key in keys:
        if getattr(section, key) is None:
            raise DesignFileError(f"layout.{key}", "missing, layout.torques needs it")
    for key in ("pitting_cycles", "bending_cycles"):  # given together with stress and exponent
        if strength is None or getattr(strength, key) is None:
            raise DesignFileError(f"strength.{key}", "missing, layout.torques needs it")
    for key in keys:
        count, wanted = len(getattr(section, key)), len(section.torques)
        if count != wanted:
            raise DesignFileError(f"layout.{key}", f"{count} numbers must be as many as the {wanted} torques")
    load = refused("layout.torques", LoadSpectrum.from_hours, section.torques, section.hours, section.speeds)
    return {"duty_cycle": load, "strength": strength}


def _profile(layout: LayoutSection, quick: bool) -> ProfileSection | None:
    section = layout.profile
    if section is None:
        return None
    if section.type == "profile_crowning":
        section.refuse(["length"], ' with type = "profile_crowning"')
    amounts = {
        "pinion_amounts": section.pinion_amounts,
        "wheel_amounts": section.wheel_amounts or section.pinion_amounts,
        "slopes": section.slopes or [0.0],
        "crownings": section.crownings or [0.0],
    }
    if isinstance(section.length, list):
        amounts["length"] = section.length
    for key, values in amounts.items():
        if len(set(values)) != len(values):
            raise DesignFileError(f"layout.profile.{key}", "must all be different")
    if quick:
        amounts = {key: values[:: -(-len(values) // _QUICK_AMOUNTS)] for key, values in amounts.items()}
    return section.changed(**amounts)
