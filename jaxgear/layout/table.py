"""Table [layout] of a design file: settings of the flank line and profile layout."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

from ..conditions import LoadSpectrum
from ..io.design_file import DesignFile
from ..io.errors import DesignFileError, refused
from ..io.gears import both_classes
from ..io.table_keys import FileTable, entry, nested
from ..io.tables import FurtherTable
from ..io.template import Template
from ..io.value_types import QUALITY_CLASSES, choice, count, either, list_of, positive, real, switch
from ..numerics import Number
from ..shafts import Misalignment
from .cases import FlankLineTolerance, flank_line_tolerance, helix_slope_limits
from .flank_line import iso_end_relief_width

_AMOUNTS = list_of(real(Number("um", low=0.0)))
_FURTHER = list_of(real(Number("um")))
_LENGTHS = either(positive("mm"), list_of(positive("mm")), "a number or a list of numbers")
_HOURS = list_of(real(Number("h", low=0.0)))
_AXES = either(choice("class"), nested(Misalignment, open=False), '"class" or a table')


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
            and once for every support. Without them the flanks have what step 2 adds alone, as on shafts whose
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

    def variants(self, most: int | None = None) -> Self:
        """The table with all lists of numbers that are tried.

        Args:
            most: length of a list, of which every so many-th number is kept then; None for all.

        Raises:
            DesignFileError: for a number that is given twice, and lengths of a crowning.
        """
        if self.type == "profile_crowning":
            self.refuse(["length"], ' with type = "profile_crowning"')
        amounts = {
            "pinion_amounts": self.pinion_amounts,
            "wheel_amounts": self.wheel_amounts or self.pinion_amounts,
            "slopes": self.slopes or [0.0],
            "crownings": self.crownings or [0.0],
        }
        if isinstance(self.length, list):
            amounts["length"] = self.length
        for key, values in amounts.items():
            if len(set(values)) != len(values):
                raise DesignFileError(f"layout.profile.{key}", "must all be different")
        steps = {key: -(-len(values) // (most or len(values))) for key, values in amounts.items()}
        return self.changed(**{key: values[:: steps[key]] for key, values in amounts.items()})


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
        further: what step 2 adds to both gears so that the load stays off the edges, "crowning" or "end_relief".
        further_amount: "rule" takes C_b = f_Hbeta of ISO 6336-1 Annex B for both gears and more where that does not
            suffice; "least" takes the least that keeps the load off the edges.
        end_relief_width: width of the end reliefs over the common face; a tenth of it, at most a normal module (ISO
            6336-1 Annex B), without it.
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
    drive_only = classified = True

    quality_class: int | list[int] | None = entry(QUALITY_CLASSES)
    misalignment: str | Template | None = entry(_AXES)
    gear: str = entry(choice("pinion", "wheel"), "wheel")
    direction: str = entry(choice("counterclockwise", "clockwise"), "counterclockwise")
    further: str = entry(choice("crowning", "end_relief"), "crowning")
    further_amount: str = entry(choice("rule", "least"), "rule")
    end_relief_width: float | None = entry(positive("mm"))
    edge_share: float = entry(real(Number(low=0.0, high=1.0, open_low=True)), 1.0)
    negative_crowning: bool = entry(switch(), False)
    stations: int = entry(count(5, 1001), 41)
    torques: list[float] | None = entry(list_of(positive("N m")))
    hours: list[float] | None = entry(_HOURS)
    speeds: list[float] | None = entry(list_of(positive("rpm")))
    profile: ProfileSection | None = entry(nested(ProfileSection))

    @classmethod
    def read(cls, given: Mapping[str, Any], folder: Path) -> Self:
        """The table, see `FurtherTable.read`."""
        if "bearing_span" in given:
            instead = 'misalignment = "class", or misalignment = { skew = ..., inclination = ..., bearing_span = ... }'
            raise DesignFileError("layout.bearing_span", f"has no effect without skew or inclination: write {instead}")
        return super().read(given, folder)

    def check(self, design: DesignFile) -> None:
        """Refuses axes, a duty cycle or profile modifications that do not go together, and gears without shafts."""
        if design.support is None:
            raise DesignFileError("layout", "has no effect without [[shafts]]")
        _axes(self.misalignment, float(design.pair().face_width))
        self.duty_cycle(design)
        self._end_relief(design)
        if self.profile is not None:
            self.profile.variants()

    def varies_along_face(self) -> list[str]:
        """The flank lines of the gears that step 3 puts profile modifications on."""
        return [] if self.profile is None else ["the flank lines of layout.profile"]

    def tolerances(self, design: DesignFile) -> dict[str, FlankLineTolerance]:
        """Tolerances of the flank lines by the kind of their sum."""
        pair, classes = design.pair(), both_classes(self.quality_class)
        axes = _axes(self.misalignment, float(pair.face_width))
        return {
            kind: refused("layout.quality_class", flank_line_tolerance, pair, classes, axes, kind=kind)
            for kind in ("statistical", "maximum")
        }

    def duty_cycle(self, design: DesignFile) -> LoadSpectrum | None:
        """Torques, hours and speeds, for which the file has S-N curves; None without torques."""
        if self.torques is None:
            self.refuse(["hours", "speeds"], " without layout.torques")
            return None
        for key, numbers in (("hours", self.hours), ("speeds", self.speeds)):
            if numbers is None:
                raise DesignFileError(f"layout.{key}", "missing, layout.torques needs it")
        strength = design.tables.get("strength")
        for key in ("pitting_cycles", "bending_cycles"):  # given together with stress and exponent
            if strength is None or getattr(strength, key) is None:
                raise DesignFileError(f"strength.{key}", "missing, layout.torques needs it")
        for key, numbers in (("hours", self.hours), ("speeds", self.speeds)):
            if numbers is not None and len(numbers) != len(self.torques):
                problem = f"{len(numbers)} numbers must be as many as the {len(self.torques)} torques"
                raise DesignFileError(f"layout.{key}", problem)
        return refused("layout.torques", LoadSpectrum.from_hours, self.torques, self.hours, self.speeds)

    def options(self, design: DesignFile) -> dict[str, Any]:
        """Keyword arguments of `layout_flank_lines`."""
        load, relieved = self.duty_cycle(design), self.further == "end_relief"
        limits = helix_slope_limits(design.pair(), both_classes(self.quality_class), end_relief=relieved)
        return {
            "gear": self.gear,
            "further": limits if self.further_amount == "rule" else None,
            "end_relief": self._end_relief(design),
            "share": self.edge_share,
            "negative_crowning": self.negative_crowning,
            "stations": self.stations,
            **({} if load is None else {"duty_cycle": load, "strength": design.tables["strength"]}),
        }

    def _end_relief(self, design: DesignFile) -> float | None:
        """Width of the end reliefs [mm], within which the outermost stations and slices must lie; None for crowning."""
        if self.further == "crowning":
            self.refuse(["end_relief_width"], ' with further = "crowning"')
            return None
        pair = design.pair()
        face, width = float(pair.face_width), self.end_relief_width or float(iso_end_relief_width(pair))
        outermost = {"layout.stations": face / self.stations}
        if self.profile is not None:
            first, second, *_ = design.resolution().slice_edges
            outermost["resolution.slices"] = face * float(second - first)
        for key, size in outermost.items():
            if width <= 0.5 * size:
                problem = f"the outermost is {size:.3g} mm wide, must be less than {2 * width:.3g} mm"
                raise DesignFileError(key, f"{problem}, twice the width of the end relief")
        if width > 0.5 * face:
            raise DesignFileError(
                "layout.end_relief_width", f"{width:g} mm must be at most {0.5 * face:g} mm, half the face"
            )
        return width

    @classmethod
    def inner(cls) -> dict[str, type[FileTable]]:
        """Profile modifications."""
        return {"[layout.profile]": ProfileSection}


def _axes(section: str | Template | None, width: float):
    """Limits of the axes, as `flank_line_tolerance` takes them."""
    if not isinstance(section, Template):
        return section
    key, amounts = section.key, {name: float(value) for name, value in section.fields.items()}
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
    return section.build({})
