"""The gearbox that the tables [[shafts]], [[meshes]] and [housing] of a design file describe."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..contact import Resolution
from ..contact.kinematics import kinematics
from ..geometry import GearPair, Material
from ..numerics import concrete, real
from ..shafts import (
    Bearing,
    Coupling,
    Gearbox,
    GearMesh,
    MatrixBearing,
    Misalignment,
    MountedGear,
    Shaft,
    ShaftLoad,
    ShaftSupport,
    TabulatedSupport,
    integral_diameter,
    read_housing,
    support,
)
from ..shafts import Section as ShaftPart
from .errors import DesignFileError, check_file, referring, refused
from .gears import MATERIAL, GearSection, Materials, fixed_gear, fixed_material
from .table_keys import FileTable, entry, nested, section_of
from .template import Template
from .value_types import ValueType, list_of, switch, table, text


def _bearing(key: str, value: Any) -> Template:
    cls = MatrixBearing if "stiffness" in table().read(key, value) else Bearing
    return nested(cls, open=False).read(key, value)


def _several(cls: type[Any], *, empty: bool = True) -> ValueType:
    return list_of(nested(cls, open=False), empty=empty)


class _MountedGearSection(section_of(MountedGear, ("name", "gear"), open=False)):  # type: ignore[misc]
    """A gear on a shaft.

    Attributes:
        name: "pinion" or "wheel" for those of the file, another name for another gear.
        gear: keys of [pinion] for a gear with another name; its modifications have no part in a layout.
        integral: True if the gear is cut into the shaft, which its teeth stiffen; in place of `body_diameter`.
    """

    name: str = entry(text(), ...)
    gear: GearSection | None = entry(nested(GearSection))
    integral: bool = entry(switch(), False)


class ShaftSection(FileTable):
    """A stepped shaft with what sits on it.

    Attributes:
        name: name of the shaft.
        sections: sections from left to right, each with `length`, `diameter` and `bore`.
        bearings: each with `name`, `position`, `radial`, `axial`, `tilting` and `clearance`, or with `stiffness`, a
            matrix of 5 x 5 numbers, in place of all but the first two.
        gears: gears on the shaft.
        couplings: couplings where torque enters or leaves, each with `position` and `torque`; one of a gearbox has no
            torque.
        loads: loads from outside, each with `position`, `force` and `moment`.
        material: material of the shaft and what stiffens it, name in [materials] or elastic constants; "STEEL" without
            it.
    """

    name: str = entry(text(), ...)
    sections: list[Template] = entry(_several(ShaftPart, empty=False), ...)
    bearings: list[Template] = entry(list_of(ValueType("a table", _bearing)), ...)
    gears: list[_MountedGearSection] = entry(list_of(nested(_MountedGearSection), empty=True), [])
    couplings: list[Template] = entry(_several(Coupling), [])
    loads: list[Template] = entry(_several(ShaftLoad), [])
    material: str | Template | None = entry(MATERIAL)


class MeshSection(section_of(GearMesh, ("pinion", "wheel", "misalignment"), open=False)):  # type: ignore[misc]
    """Two gears that mesh, by their names.

    Attributes:
        pinion: the driving one.
        wheel: the driven one.
        misalignment: misalignment of their axes, with `skew`, `inclination`, `bearing_span` and `direct`.
    """

    pinion: str = entry(text(), ...)
    wheel: str = entry(text(), ...)
    misalignment: Template | None = entry(nested(Misalignment, open=False))


class HousingSection(FileTable):
    """Elastic housing that supports the bearing seats.

    Attributes:
        file: CSV or npz file beside the design file with the stiffness or compliance of the housing between the seats.
    """

    file: str = entry(text(), ...)


def over_slices(support: ShaftSupport, sizes: Resolution) -> TabulatedSupport:
    """Support by shafts that act alike at every torque, tabulated over the slices of a mesh."""
    y = kinematics(support.pair, real(0.0), sizes, "strain").face_coordinate
    return TabulatedSupport(support.pair, support.influence(y), support.gap(y))


def left_out(support: ShaftSupport, sizes: Resolution, *, open_gears: bool, vibrates: bool) -> str:
    """Message naming the shafts, bearings and housing that a mesh ignores and why; "" if the shafts support it.

    Args:
        support: shafts, bearings and housing of the mesh.
        sizes: array sizes of the mesh.
        open_gears: True if numbers of the gears or their model are variables.
        vibrates: True if the gears vibrate on the mesh.
    """
    why = _why_rigid(support, sizes, open_gears, vibrates)
    if not why:
        return ""
    parts = ["shafts", "bearings"]
    if support.gearbox.housing is not None:
        parts.append("housing")
    if any(mesh.misalignment.varies_along_face for mesh in support.gearbox.meshes):
        parts.append("the misalignment of [[meshes]]")
    named = f"{', '.join(parts[:-1])} and {parts[-1]}"
    return f"{named} are not part of this analysis, the gears stand rigid ({why}): jaxgear layout takes them"


def _why_rigid(support: ShaftSupport, sizes: Resolution, open_gears: bool, vibrates: bool) -> str:
    if vibrates:  # shafts without mass would lower the natural frequencies
        return "[dynamics] would need the inertia of the shafts too"
    if open_gears:
        return "the variables change the gears or their model"
    if len(support.gearbox.meshes) > 1:
        return "what other meshes do to them belongs to one torque"
    plays = [bearing.play for shaft in support.gearbox.shafts for bearing in shaft.bearings]
    if any(play is not None and concrete(play) != 0 for play in plays):
        return "bearings with clearance belong to one torque"
    if sizes.slices == 1:
        return "resolution.slices = 1 shows nothing over the face"
    if sizes.parts is not None:  # numbers over slices are for even ones, and shafts themselves for one torque
        return "resolution.slice_widths takes shafts at one torque"
    return "" if sizes.coupled_slices else "resolution.coupled_slices = false"


_OWN = "pinion", "wheel"
_OF_PAIR = "center_distance", "axial_offset"
_SAME_MATERIAL = 0.05  # relative, of elastic constants: as far as tables of steel differ
_SAME_TORQUE = 1e-3  # relative; what is left is rounding of ratios written by hand


def support_of(
    pair: GearPair,
    shafts: Sequence[ShaftSection],
    meshes: Sequence[MeshSection],
    housing: HousingSection | None,
    *,
    direction: tuple[str, str],
    torque: float,
    folder: Path,
    materials: Materials,
) -> ShaftSupport:
    """The mesh of pinion and wheel on its shafts.

    Args:
        pair: pair of the file.
        shafts, meshes, housing: the tables of these names.
        direction: sense of rotation of the first shaft, seen against z, after the key that gives it.
        torque: torque of the file, on the pinion [N m].
        folder: folder of the design file.
        materials: materials of the file.

    Raises:
        DesignFileError: for tables that do not make a gearbox with pinion and wheel in it, or whose couplings bring
            another torque to the pinion.
    """
    turning, sense = direction
    _check_names(shafts)
    made = [_shaft(each, pair, materials) for each in shafts]
    names = [gear.name for shaft in made for gear in shaft.gears]
    for name in _OWN:
        if name not in names:
            raise DesignFileError("shafts", f'no shaft carries the gear "{name}"')
    given = [_mesh(each, pair) for each in meshes]
    given = given or [GearMesh(*_OWN, center_distance=pair.center_distance, axial_offset=pair.axial_offset)]
    own = [index for index, mesh in enumerate(given) if (mesh.pinion, mesh.wheel) == _OWN]
    if not own:
        raise DesignFileError("meshes", 'missing, one must have pinion = "pinion" and wheel = "wheel"')
    box = refused("meshes" if meshes else "shafts", Gearbox, made, given, None, sense)
    if not pair.is_spur and box.turning(box.place(_OWN[0])[0]) < 0:
        problem = "makes the helical pinion turn clockwise, must be counterclockwise, seen against z, as of every pair"
        raise DesignFileError(turning, f"{problem}: count positions on shafts from the other end")
    brought = float(box.pinion_torques()[own[0]])
    if not np.isclose(brought, torque, rtol=_SAME_TORQUE):
        raise DesignFileError("load.torque", f"{torque:g} N m must be {brought:g} N m, that of the couplings")
    if housing is not None:
        with referring("housing.file", housing.file):
            check_file(folder / housing.file)
        seats = refused("housing.file", read_housing, folder / housing.file)
        box = refused("housing.file", replace, box, housing=seats)
    return support(box, own[0])


def _check_names(shafts: Sequence[ShaftSection]) -> None:
    """Raise if a name is given twice, before a second object of that name is made."""
    bearings = [bearing for shaft in shafts for bearing in shaft.bearings]
    gears = [gear for shaft in shafts for gear in shaft.gears]
    for parts in (shafts, bearings, gears):
        first: dict[str, str] = {}
        for part in parts:
            key, name = f"{part.key}.name", part.fields["name"]
            if first.setdefault(name, key) != key:
                raise DesignFileError(key, f'"{name}" is given twice, first as {first[name]}')


def _shaft(section: ShaftSection, pair: GearPair, materials: Materials) -> Shaft:
    material = fixed_material(section, section.material, materials)
    gears = [_gear(each, pair, materials, material) for each in section.gears]
    sections, bearings, couplings, loads = (
        [each.build({}) for each in several]
        for several in (section.sections, section.bearings, section.couplings, section.loads)
    )
    return refused(section.key, Shaft, section.name, sections, bearings, gears, couplings, loads, material)


def _gear(section: _MountedGearSection, pair: GearPair, materials: Materials, of_shaft: Material) -> MountedGear:
    key = section.key
    if section.name in _OWN:
        if section.gear is not None:
            raise DesignFileError(f"{key}.gear", f"has no effect, [{section.name}] is the {section.name}")
        gear = getattr(pair, section.name)
    elif section.gear is None:
        raise DesignFileError(f"{key}.gear", f'missing, "{section.name}" is not the pinion or wheel of the file')
    else:
        gear = fixed_gear(section.gear, materials)
    if section.integral:
        section.refuse(["body_diameter"], " on an integral gear")
    if section.integral and _differ(gear.material, of_shaft):
        problem = "a gear that is cut into its shaft is of its material, but these differ: material of [[shafts]]"
        raise DesignFileError(f"{key}.integral", problem)
    body = integral_diameter(gear) if section.integral else section.body_diameter
    return refused(key, MountedGear, section.name, gear, section.position, body)


def _differ(one: Material, other: Material) -> bool:
    """True if known elastic constants differ."""
    pairs = (
        (concrete(one.elastic_modulus), concrete(other.elastic_modulus)),
        (concrete(one.poisson_ratio), concrete(other.poisson_ratio)),
    )
    return any(a is not None and b is not None and not np.isclose(a, b, rtol=_SAME_MATERIAL) for a, b in pairs)


def _mesh(section: MeshSection, pair: GearPair) -> GearMesh:
    numbers = {name: value for name, value in section.fields.items() if name in ("angle", *_OF_PAIR)}
    if (section.pinion, section.wheel) == _OWN:
        for name in _OF_PAIR:
            if name in numbers:
                raise DesignFileError(f"{section.key}.{name}", f"has no effect, pair.{name} is that of the pair")
            numbers[name] = getattr(pair, name)
    if section.misalignment is not None:
        numbers["misalignment"] = section.misalignment.build({})
    return refused(section.key, GearMesh, section.pinion, section.wheel, **numbers)


# By their headings in the reference.
TABLES: Mapping[str, type[FileTable]] = {
    "[[shafts]]": ShaftSection,
    "[[shafts.sections]]": section_of(ShaftPart, open=False),
    "[[shafts.bearings]]": section_of(Bearing, open=False),
    "[[shafts.bearings]] with stiffness": section_of(MatrixBearing, open=False),
    "[[shafts.gears]]": _MountedGearSection,
    "[[shafts.couplings]]": section_of(Coupling, open=False),
    "[[shafts.loads]]": section_of(ShaftLoad, open=False),
    "[[meshes]]": MeshSection,
    "[meshes.misalignment]": section_of(Misalignment, open=False),
    "[housing]": HousingSection,
}
