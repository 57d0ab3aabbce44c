"""The layout of the tables [[shafts]], [[meshes]], [housing] and [layout]."""

from typing import Any

from ..layout import SNCurve
from ..numerics import Number
from ..shafts import Bearing, Coupling, GearMesh, MatrixBearing, Misalignment, MountedGear, ShaftLoad
from ..shafts import Section as ShaftPart
from .table_keys import FileTable, key, section_of
from .value_types import QUALITY_CLASSES, choice, count, either, list_of, positive, real, switch, table, text

Tables = dict[str, Any]

_ROWS, _ROWS_OR_NONE = list_of(table()), list_of(table(), empty=True)
_AMOUNTS = list_of(real(Number("um", low=0.0)))
_FURTHER = list_of(real(Number("um")))
_HOURS = list_of(real(Number("h", low=0.0)))
_AXES = either(choice("class"), table(), '"class" or a table')

PartSection = section_of(ShaftPart, open=False)
BearingSection = section_of(Bearing, open=False)
MatrixBearingSection = section_of(MatrixBearing, open=False)
CouplingSection = section_of(Coupling, open=False)
LoadOnShaftSection = section_of(ShaftLoad, open=False)
MisalignmentSection = section_of(Misalignment, open=False)
WoehlerSection = section_of(SNCurve, open=False)


class ShaftSection(FileTable):
    """A stepped shaft with what sits on it.

    Attributes:
        name: of the shaft.
        sections: from left to right, each with `length`, `diameter` and `bore`.
        bearings: each with `name`, `position`, `radial`, `axial`, `tilting` and `clearance`, or with `stiffness`, a
            matrix of 5 x 5 numbers, in place of all but the first two.
        gears: on the shaft.
        couplings: where torque enters and leaves, each with `position` and `torque`; one of a gearbox has no torque.
        loads: from outside, each with `position`, `force` and `moment`.
        material: of the shaft and what stiffens it, name in [materials] or elastic constants; "STEEL" without it.
    """

    name: str = key(text(), ...)
    sections: list[Tables] = key(_ROWS, ...)
    bearings: list[Tables] = key(_ROWS, ...)
    gears: list[Tables] = key(_ROWS_OR_NONE, [])
    couplings: list[Tables] = key(_ROWS_OR_NONE, [])
    loads: list[Tables] = key(_ROWS_OR_NONE, [])
    material: Any = key(either(text(), table(), "the name of a material, or a table"))


class MountedGearSection(section_of(MountedGear, ("name", "gear"), open=False)):  # type: ignore[misc]
    """A gear on a shaft.

    Attributes:
        name: "pinion" or "wheel" for those of the file, another name for another gear.
        gear: of another name, the keys of [pinion]; its modifications have no part in a layout.
        integral: whether it is cut into the shaft, which its teeth stiffen; in place of `body_diameter`.
    """

    name: str = key(text(), ...)
    gear: Tables | None = key(table())
    integral: bool = key(switch(), False)


class MeshSection(section_of(GearMesh, ("pinion", "wheel", "misalignment"), open=False)):  # type: ignore[misc]
    """Two gears that mesh, by their names.

    Attributes:
        pinion: the driving one.
        wheel: the driven one.
        misalignment: of their axes, with `skew`, `inclination`, `bearing_span` and `direct`.
    """

    pinion: str = key(text(), ...)
    wheel: str = key(text(), ...)
    misalignment: Tables | None = key(table())


class HousingSection(FileTable):
    """What holds the bearing seats.

    Attributes:
        file: CSV or npz file beside the design file with the stiffness or compliance of the housing between the seats.
    """

    file: str = key(text(), ...)


class LayoutSection(FileTable):
    """What `jaxgear layout` does.

    Attributes:
        quality_class: flank tolerance class of ISO 1328-1, of both gears or of pinion and wheel; that of the gears
            without it.
        misalignment: largest deviations of the axes, each of either sign: `skew` and `inclination` over the
            `bearing_span`, or `direct`, f_ma over the face, as in [misalignment]; "class" takes those of ISO/TR 10064-3
            by F_beta of the quality class, which over the face are the same for every bearing span. Parallel axes
            without it.
        gear: whose flank line levels the load.
        direction: in which the first shaft turns, seen against z.
        further_crowning: "rule" takes C_b = f_Hbeta of ISO 6336-1 Annex B for both gears and more where that does not
            suffice; "least" as little as keeps the load off the edges.
        edge_share: of the largest load inside, up to which the end of a face may be loaded.
        negative_crowning: whether the crowning of step 1 may be negative.
        stations: over the face, of the one-dimensional analysis.
        torques: on the pinion, of a duty cycle; the load is levelled at the design torque without it.
        hours: at every torque.
        speeds: of the pinion at every torque.
        pitting: S-N curve of the flanks, with `endurance`, `exponent` and `cycles`.
        bending: what the tooth roots bear, likewise.
        profile: profile modifications to be tried in step 3; none without it.
    """

    quality_class: int | list[int] | None = key(QUALITY_CLASSES)
    misalignment: str | Tables | None = key(_AXES)
    gear: str = key(choice("pinion", "wheel"), "wheel")
    direction: str = key(choice("counterclockwise", "clockwise"), "counterclockwise")
    further_crowning: str = key(choice("rule", "least"), "rule")
    edge_share: float = key(real(Number(low=0.0, high=1.0, open_low=True)), 1.0)
    negative_crowning: bool = key(switch(), False)
    stations: int = key(count(5, 1001), 41)
    torques: list[float] | None = key(list_of(positive("N m")))
    hours: list[float] | None = key(_HOURS)
    speeds: list[float] | None = key(list_of(positive("rpm")))
    pitting: Tables | None = key(table())
    bending: Tables | None = key(table())
    profile: Tables | None = key(table())


class ProfileSection(FileTable):
    """Profile modifications that step 3 tries, those of both gears in all combinations.

    Attributes:
        type: of the modification.
        pinion_amounts: amounts on the pinion.
        wheel_amounts: amounts on the wheel; those of the pinion without it.
        slopes: helix slopes of either sign on top of the flank line of the wheel, over the common face, crossed with
            the amounts; none without it.
        crownings: crownings of either sign, likewise.
        length: of a tip relief; the long one, over the zone of double contact, without it.
        torque_factor: torque of the contact analysis, in design torques.
        shafts: whether the contact feels shafts, bearings and housing, with the flank lines of both steps and once for
            every support. Without them it has the further crowning alone, as on shafts whose bending is compensated.
    """

    type: str = key(choice("tip_relief", "profile_crowning"), "tip_relief")
    pinion_amounts: list[float] = key(_AMOUNTS, ...)
    wheel_amounts: list[float] | None = key(_AMOUNTS)
    slopes: list[float] | None = key(_FURTHER)
    crownings: list[float] | None = key(_FURTHER)
    length: float | None = key(positive("mm"))
    torque_factor: float = key(positive(""), 0.9)
    shafts: bool = key(switch(), True)
