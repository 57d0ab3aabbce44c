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
from . import schema_shafts as schema
from .errors import DesignFileError, check_file, referring, refuse_given, refused
from .gears import Materials, fixed_gear, fixed_material, with_quality
from .schema import FileSection
from .table_keys import decode, section_of
from .template import part_of


def over_slices(support: ShaftSupport, sizes: Resolution) -> TabulatedSupport:
    """Shafts that do at every torque what they do at one, as numbers over the slices of a mesh."""
    y = kinematics(support.pair, real(0.0), sizes, "strain").face_coordinate
    return TabulatedSupport(support.pair, support.influence(y), support.gap(y))


def left_out(support: ShaftSupport, sizes: Resolution, *, open_gears: bool, vibrates: bool) -> str:
    """What a mesh without them lacks, and why; "" where the shafts act.

    Args:
        support: the mesh on its shafts.
        sizes: of the mesh.
        open_gears: numbers of the gears or their model are variables.
        vibrates: the gears vibrate on the mesh.
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


def layout_of(table: Mapping[str, Any] | None, quality: list[int] | None) -> schema.LayoutSection | None:
    """The table of that name, with the quality classes of the gears where it has none of its own.

    Raises:
        DesignFileError: for anything that is wrong with it.
    """
    if table is None:
        return None
    if "bearing_span" in table:
        instead = 'misalignment = "class", or misalignment = { skew = ..., inclination = ..., bearing_span = ... }'
        raise DesignFileError("layout.bearing_span", f"has no effect without skew or inclination: write {instead}")
    return with_quality("layout", decode("layout", table, schema.LayoutSection), quality)


def support_of(
    top: FileSection,
    layout: schema.LayoutSection | None,
    pair: GearPair,
    torque: float,
    folder: Path,
    materials: Materials,
) -> ShaftSupport | None:
    """The mesh of pinion and wheel on its shafts; None for a file without a layout.

    Args:
        top: all tables.
        layout: the table of that name.
        pair: of the file.
        torque: of the file, on the pinion [N m].
        folder: of the design file.
        materials: of the file.

    Raises:
        DesignFileError: for tables that do not make a gearbox with pinion and wheel in it, or whose couplings bring
            another torque to the pinion.
    """
    if layout is None:
        refuse_given("", top, ["shafts", "meshes", "housing"], " without [layout]")
        return None
    if not top.shafts:
        raise DesignFileError("layout", "has no effect without [[shafts]]")
    _check_names(top.shafts)
    made = [_shaft(f"shafts[{i}]", each, pair, materials) for i, each in enumerate(top.shafts)]
    names = [gear.name for shaft in made for gear in shaft.gears]
    for name in _OWN:
        if name not in names:
            raise DesignFileError("shafts", f'no shaft carries the gear "{name}"')
    given = [_mesh(f"meshes[{i}]", each, pair) for i, each in enumerate(top.meshes)]
    given = given or [GearMesh(*_OWN, center_distance=pair.center_distance, axial_offset=pair.axial_offset)]
    own = [index for index, mesh in enumerate(given) if (mesh.pinion, mesh.wheel) == _OWN]
    if not own:
        raise DesignFileError("meshes", 'none is that of "pinion" and "wheel"')
    box = refused("meshes" if top.meshes else "shafts", Gearbox, made, given, None, layout.direction)
    brought = float(box.pinion_torques()[own[0]])
    if not np.isclose(brought, torque, rtol=_SAME_TORQUE):
        raise DesignFileError("load.torque", f"{torque:g} N m must be {brought:g} N m, which the couplings bring")
    if top.housing is not None:
        section = decode("housing", top.housing, schema.HousingSection)
        with referring("housing.file", section.file):
            check_file(folder / section.file)
        seats = refused("housing.file", read_housing, folder / section.file)
        box = refused("housing.file", replace, box, housing=seats)
    return support(box, own[0])


def _check_names(shafts: Sequence[Mapping[str, Any]]) -> None:
    """Refuses a name that is given twice, before anything is made of the second: that would be wrong for its place."""
    for kind in ("", "bearings", "gears"):
        first: dict[Any, str] = {}
        for i, shaft in enumerate(shafts):
            parts = shaft.get(kind) if kind else [shaft]
            for j, part in enumerate(parts if isinstance(parts, list) else []):
                key = f"shafts[{i}].{kind}[{j}].name" if kind else f"shafts[{i}].name"
                name = part.get("name") if isinstance(part, dict) else None
                if isinstance(name, str) and first.setdefault(name, key) != key:
                    raise DesignFileError(key, f'"{name}" is given twice, first as {first[name]}')


def _shaft(key: str, table: Mapping[str, Any], pair: GearPair, materials: Materials) -> Shaft:
    section = decode(key, table, schema.ShaftSection)
    material = fixed_material(f"{key}.material", section.material, materials)

    def each(name, make):
        return [make(f"{key}.{name}[{i}]", item) for i, item in enumerate(getattr(section, name))]

    return refused(
        key,
        Shaft,
        section.name,
        each("sections", lambda at, item: _plain(at, item, ShaftPart)),
        each("bearings", lambda at, item: _plain(at, item, MatrixBearing if "stiffness" in item else Bearing)),
        each("gears", lambda at, item: _gear(at, item, pair, materials, material)),
        each("couplings", lambda at, item: _plain(at, item, Coupling)),
        each("loads", lambda at, item: _plain(at, item, ShaftLoad)),
        material,
    )


def _plain(key: str, table: Mapping[str, Any], cls):
    """An object of numbers from its table."""
    return part_of(key, decode(key, table, section_of(cls, open=False)), cls).build({})


def _gear(key: str, table: Mapping[str, Any], pair: GearPair, materials: Materials, of_shaft: Material) -> MountedGear:
    section = decode(key, table, schema.MountedGearSection)
    if section.name in _OWN:
        if section.gear is not None:
            raise DesignFileError(f"{key}.gear", f"has no effect, [{section.name}] is the {section.name}")
        gear = getattr(pair, section.name)
    elif section.gear is None:
        raise DesignFileError(f"{key}.gear", f'missing, "{section.name}" is not the pinion or wheel of the file')
    else:
        gear = fixed_gear(f"{key}.gear", section.gear, materials)
    if section.integral and section.body_diameter is not None:
        raise DesignFileError(f"{key}.body_diameter", "has no effect on an integral gear")
    if section.integral and _differ(gear.material, of_shaft):
        problem = "a gear that is cut into its shaft is of its material, but these differ: material of [[shafts]]"
        raise DesignFileError(f"{key}.integral", problem)
    body = integral_diameter(gear) if section.integral else section.body_diameter
    return refused(key, MountedGear, section.name, gear, section.position, body)


def _differ(one: Material, other: Material) -> bool:
    """Whether elastic constants differ, as far as they are known."""
    pairs = (
        (concrete(one.elastic_modulus), concrete(other.elastic_modulus)),
        (concrete(one.poisson_ratio), concrete(other.poisson_ratio)),
    )
    return any(a is not None and b is not None and not np.isclose(a, b, rtol=_SAME_MATERIAL) for a, b in pairs)


def _mesh(key: str, table: Mapping[str, Any], pair: GearPair) -> GearMesh:
    section = decode(key, table, schema.MeshSection)
    numbers = {name: value for name, value in section.given().items() if name in ("angle", *_OF_PAIR)}
    if (section.pinion, section.wheel) == _OWN:
        for name in _OF_PAIR:
            if name in numbers:
                raise DesignFileError(f"{key}.{name}", f"has no effect, pair.{name} is that of the pair")
            numbers[name] = getattr(pair, name)
    if section.misalignment is not None:
        numbers["misalignment"] = _plain(f"{key}.misalignment", section.misalignment, Misalignment)
    return refused(key, GearMesh, section.pinion, section.wheel, **numbers)
