"""What the table [layout] of a design file asks for."""

import dataclasses

import numpy as np

from ..conditions import LoadSpectrum
from ..layout import (
    Endurance,
    FlankLineTolerance,
    SNCurve,
    flank_line_tolerance,
    helix_slope_limits,
    without_housing,
)
from ..shafts import Misalignment, ShaftSupport
from .design_file import DesignFile
from .errors import DesignFileError, naming, refuse_given, refused
from .gears import both_classes
from .schema_shafts import LayoutSection, MisalignmentSection, ProfileSection, WoehlerSection
from .table_keys import decode
from .template import part_of

_QUICK_STATIONS, _QUICK_AMOUNTS = 21, 3
_TORQUES, _QUICK_TORQUES = 25, 7  # over the range of the file


@dataclasses.dataclass(frozen=True)
class LayoutRequest:
    """A layout of flank lines and profiles, checked.

    Attributes:
        supports: the mesh on its shafts, in the housing first where there is one, then on rigid seats.
        tolerances: by name.
        options: of `layout_flank_lines`.
        torques: on the pinion, at which K_Hbeta is told: the range of the file, and those of the duty cycle [N m].
        profile: what step 3 tries; None for no step 3.
        profile_torque: on the pinion, of step 3 [N m].
    """

    supports: dict[str, ShaftSupport]
    tolerances: dict[str, FlankLineTolerance]
    options: dict
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
        section, support = design.layout, design.support
        if section is None or support is None:
            raise DesignFileError("layout", "missing; it says for which tolerances the flank lines are designed")
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
            **_life(section),
        }
        housed = support.gearbox.housing is not None
        supports = {"housing": support, "rigid seats": without_housing(support)} if housed else {"rigid seats": support}
        profile = _profile(section, quick)
        range_of_file = np.linspace(*design.torque_range, _QUICK_TORQUES if quick else _TORQUES)
        torques = np.union1d(range_of_file, section.torques or [])
        torque = _profile_torque(design, profile)
        return LayoutRequest(supports, tolerances, options, torques, profile, torque)


def check_layout(design: DesignFile, section: LayoutSection) -> None:
    """Checks the table [layout] for commands that do not need it.

    Raises:
        DesignFileError: for anything that is wrong with it, in one line that names the key.
    """
    _axes(section.misalignment, float(design.pair().face_width))
    _life(section)
    _profile(section, quick=False)


def _check_open(design: DesignFile) -> None:
    """Refuses what a layout finds itself."""
    if design.bounds:
        raise DesignFileError("variables", f"layout needs numbers, these are free: {', '.join(design.bounds)}")
    for gear, parts in (("pinion", design.design.pinion), ("wheel", design.design.wheel)):
        if parts:
            raise DesignFileError(f"{gear}.modification", "layout finds the modifications, leave them out")


def _axes(given: str | dict | None, width: float):
    """Limits of the axes, as `flank_line_tolerance` takes them."""
    if not isinstance(given, dict):
        return given
    key = "layout.misalignment"
    section = decode(key, given, MisalignmentSection)
    amounts = section.given()
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
    return part_of(key, section, Misalignment).build({})


def _life(section: LayoutSection) -> dict:
    """Duty cycle and endurance."""
    keys = ["hours", "speeds", "pitting", "bending"]
    if section.torques is None:
        refuse_given("layout", section, keys, " without layout.torques")
        return {}
    for key in keys:
        if getattr(section, key) is None:
            raise DesignFileError(f"layout.{key}", "missing, layout.torques needs it")
    for key in ("hours", "speeds"):
        count, wanted = len(getattr(section, key)), len(section.torques)
        if count != wanted:
            raise DesignFileError(f"layout.{key}", f"{count} numbers must be as many as the {wanted} torques")
    load = refused("layout.torques", LoadSpectrum.from_hours, section.torques, section.hours, section.speeds)
    lines = [_woehler(key, getattr(section, key)) for key in ("pitting", "bending")]
    return {"duty_cycle": load, "endurance": Endurance(*lines)}


def _woehler(name: str, table) -> SNCurve:
    key = f"layout.{name}"
    return part_of(key, decode(key, table, WoehlerSection), SNCurve).build({})


def _profile(layout: LayoutSection, quick: bool) -> ProfileSection | None:
    if layout.profile is None:
        return None
    section = decode("layout.profile", layout.profile, ProfileSection)
    if section.type == "profile_crowning" and section.length is not None:
        raise DesignFileError("layout.profile.length", 'has no effect with type = "profile_crowning"')
    amounts = {
        "pinion_amounts": section.pinion_amounts,
        "wheel_amounts": section.wheel_amounts or section.pinion_amounts,
        "slopes": section.slopes or [0.0],
        "crownings": section.crownings or [0.0],
    }
    for key, values in amounts.items():
        if len(set(values)) != len(values):
            raise DesignFileError(f"layout.profile.{key}", "must all be different")
    if quick:
        amounts = {key: values[:: -(-len(values) // _QUICK_AMOUNTS)] for key, values in amounts.items()}
    return section.changed(**amounts)


def _profile_torque(design: DesignFile, section: ProfileSection | None) -> float:
    return design.torque if section is None else section.torque_factor * design.torque
