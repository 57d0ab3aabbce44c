"""Design files: a gear pair, its load, its flank modifications and their free parameters, as TOML."""

import json
import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from ..compliance import AbstractCompliance
from ..compliance.iso_6336 import single_stiffness
from ..conditions import LoadSpectrum
from ..contact import Mesh, OperatingPoint, Resolution, begin_contact, fewest_pairs, prepare
from ..contact.contact_width import full_load
from ..geometry import GearPair, Material
from ..metrics.findings import LIMITS
from ..microgeometry import AbstractModification
from ..numerics import program
from ..shafts import AbstractSupport, Misalignment, RigidSupport, ShaftSupport
from . import gearbox
from .errors import DesignFileError, calling, join, naming, printable, refused
from .flanks import check_files
from .gears import (
    AnyGear,
    GearSection,
    PairSection,
    PlanetSection,
    RingSection,
    both_classes,
    check_pitches,
    drawing_of,
    flank_of,
    gear_template,
    longest_path,
    materials_of,
    pair_of,
    quality_of,
    with_quality,
)
from .model_table import ModelSection, ResolutionSection, model_template, resolution_of, with_tables
from .table_keys import FileTable, decode, entry, nested, summary, template_of
from .tables import FurtherTable, LoadSection, further_tables
from .template import Free, Template, build
from .toml import read
from .value_types import list_of, table, text
from .variables import VariableSection, increasing, read_variables

T = TypeVar("T")

# Tooth pairs are carried along up to this many times the deflection of a single pair after ISO 6336-1.
_DEFLECTIONS = 2.0
# A mesh force has to be known up to these, which vibration reaches.
_DYNAMIC_DEFLECTIONS = 5.5
# Where gears are left open, at least as many as `prepare` takes for traced gears: contact ratios up to 3.
_OPEN_PAIRS = 4
# Deflection of a pair of teeth under the whole load [um per mm of module]: beyond a quarter of the module nothing is
# linear, of whatever material.
_MOST_DEFLECTION = 250.0
# Torques of interest where the file names none, relative to the design torque.
_TORQUE_RANGE = (0.5, 2.0)


_TURNING = "shafts", "counterclockwise"  # of the first shaft where no table says its direction
_ONLY_DRIVE = "which {} does not know: give a positive torque"


class FileSection(FileTable):
    """The tables of a file, and its title.

    Attributes:
        pinion: the driving gear.
        wheel: the driven gear.
        ring: a driven ring gear in place of the wheel; the pinion is then a planet.
        sun: the sun of a planetary stage, with [stage] and in place of the pinion.
        planet: the planets of a planetary stage, with [stage] and in place of the wheel.
        load: torque and speed.
        title: free text; the name of the file without it.
        materials: materials of gears and shafts, by name; "STEEL" is built in.
        pair: centre distance and mounting of the gears.
        model: stiffness model; the default model without it.
        misalignment: deviation of the axes; parallel ones without it.
        resolution: array sizes; the defaults without it.
        variables: numbers left open, with their bounds.
        shafts: shafts that carry the gears, with their bearings.
        meshes: meshes of the gears on the shafts; that of pinion and wheel alone without it.
        housing: elastic housing of the bearings; rigid seats without it.
    """

    pinion: GearSection = entry(nested(GearSection), ...)
    wheel: GearSection | None = entry(nested(GearSection))
    ring: RingSection | None = entry(nested(RingSection))
    sun: GearSection | None = entry(nested(GearSection))
    planet: GearSection | None = entry(nested(PlanetSection))
    load: LoadSection = entry(nested(LoadSection), ...)
    title: str | None = entry(text())
    materials: dict[str, Template] | None = entry(table(nested(Material)))
    pair: PairSection = entry(nested(PairSection), PairSection("pair"))
    model: ModelSection = entry(nested(ModelSection), ModelSection("model"))
    misalignment: Template = entry(nested(Misalignment), Template(Misalignment, {}, "misalignment"))
    resolution: FileTable = entry(nested(ResolutionSection), ResolutionSection("resolution"))
    variables: dict[str, VariableSection] = entry(table(nested(VariableSection)), {})
    shafts: list[gearbox.ShaftSection] = entry(list_of(nested(gearbox.ShaftSection), empty=True), [])
    meshes: list[gearbox.MeshSection] = entry(list_of(nested(gearbox.MeshSection), empty=True), [])
    housing: gearbox.HousingSection | None = entry(nested(gearbox.HousingSection))

    @property
    def driven(self) -> AnyGear:
        """Wheel or ring gear."""
        given = [each for each in (self.wheel, self.ring) if each is not None]
        if not given:
            raise DesignFileError("wheel", "missing, this key is required")
        if len(given) > 1:
            raise DesignFileError("ring", "has no effect beside [wheel]: a pair has one driven gear")
        return given[0]


def file_section(further: Mapping[str, type[FurtherTable]]) -> type[FileSection]:
    """Keys of a whole file, including further tables."""
    texts = {name: summary(cls) for name, cls in further.items()}
    keys = {name: replace(table(), meaning=text[:1].lower() + text[1:]) for name, text in texts.items()}
    return type("FileSection", (FileSection,), {**keys, "__doc__": FileSection.__doc__})


class FileDesign(eqx.Module):
    """The flanks of a design file as a function of its free parameters; pure and traceable.

    Attributes:
        names: names of the parameters.
        pinion, wheel: the modifications, which are added up.
    """

    names: tuple[str, ...] = eqx.field(static=True)
    pinion: list[Template]
    wheel: list[Template]

    def __call__(self, parameters: Mapping[str, Any]) -> tuple[AbstractModification, AbstractModification]:
        """Modifications of pinion and wheel.

        Args:
            parameters: value of every free parameter, scalar.
        """
        if set(parameters) != set(self.names):
            raise ValueError(
                f"design: parameters {', '.join(sorted(parameters)) or '(none)'} must be those of the file: "
                f"{', '.join(sorted(self.names)) or '(none)'}"
            )
        return build(self.pinion, parameters), build(self.wheel, parameters)


class _MeshParts(NamedTuple):
    """Inputs of a prepared mesh.

    Attributes:
        pair: gear pair.
        compliance: stiffness model.
        support: misaligned axes; None for parallel ones.
    """

    pair: GearPair
    compliance: AbstractCompliance
    support: RigidSupport | None


class _FileMesh(eqx.Module):
    """The prepared mesh of a design file as a function of its free parameters; pure and traceable."""

    pair: Template
    model: Template
    misalignment: Template
    resolution: Resolution
    coast: bool = eqx.field(static=True)

    def free(self) -> list[Free]:
        """Every open number."""
        return [*self.pair.free(), *self.model.free(), *self.misalignment.free()]

    def parts(self, parameters: Mapping[str, Any]) -> _MeshParts:
        """Gear pair, stiffness model and misaligned axes of the mesh."""
        pair, compliance = self.pair.build(parameters), self.model.build(parameters)
        axes = RigidSupport(pair, self.misalignment.build(parameters)) if self.misalignment.fields else None
        return _MeshParts(pair, compliance, axes)

    def __call__(self, parameters: Mapping[str, Any]) -> Mesh:
        """The mesh."""
        parts = self.parts(parameters)
        pair = parts.pair.coast if self.coast else parts.pair
        return prepare(pair, compliance=parts.compliance, resolution=self.resolution, support=parts.support)


@dataclass(frozen=True)
class DesignFile:
    """A checked design file, which is physically possible.

    Attributes:
        path: the file.
        text: the whole file as it was read, as one text.
        title: free text, the file's stem if it has none.
        torque: amount of the design torque on the pinion [N m]; the middle of its bounds where it is a variable.
        coast: True if the torque is negative: mesh and modifications are those of the coast flanks, see
            `GearPair.coast`, while `pair` has the gears of the file.
        torque_range: lowest and highest torque of interest [N m].
        speed: speed of the pinion [rpm], None if the file names none; the middle of its bounds where it is a variable.
        friction: mean coefficient of friction; None for the library's default.
        quality_classes: flank tolerance classes of pinion and wheel, of the gears or of [tolerance]; None without.
        drawn: name of the material and measured tooth thickness of pinion and wheel, as given in the file.
        bounds: (low, high) of every free parameter, in its unit.
        units: unit of every free parameter, "" for a pure number.
        values: values of the free parameters that name one, which `jaxgear analyze` takes.
        open_case: numbers of gears, pair, model, misalignment and load that are variables; a sweep alone can vary them.
        design: makes the modifications of pinion and wheel from the free parameters.
        support: the mesh on its shafts; None without them.
        tables: the further tables that the file has, by their names: an object of the class of each, see `io.tables`.
    """

    path: Path
    text: str
    title: str
    torque: float
    coast: bool
    torque_range: tuple[float, float]
    speed: float | None
    friction: float | None
    quality_classes: tuple[int, int] | None
    drawn: dict[str, dict[str, Any]]
    bounds: dict[str, tuple[float, float]]
    units: dict[str, str]
    values: dict[str, float]
    open_case: tuple[Free, ...]
    design: FileDesign
    support: ShaftSupport | None
    tables: dict[str, Any]
    _load: Template
    _mesh: _FileMesh
    _middle: _MeshParts
    _longest: GearPair

    def needed(self, name: str, why: str) -> Any:
        """Further table that a command needs.

        Raises:
            DesignFileError: where the file does not have it.
        """
        if name not in self.tables:
            raise DesignFileError(name, f"missing; {why}")
        return self.tables[name]

    def spectrum(self, section: Any) -> LoadSpectrum:
        """Load spectrum of a table with torques, weights and, optionally, speeds.

        Without torques it is the design torque, without speeds it runs at that of the file.

        Raises:
            DesignFileError: for weights or speeds that are not of the torques.
        """
        if section.torques is None:
            known = [name for name in ("weights", "speeds") if name in section.keys]
            section.refuse(known, f" without {section.key}.torques")
        torques, speeds = section.torques or [self.torque], getattr(section, "speeds", None)
        run_at = {"speeds": self.speed if speeds is None else speeds, "friction": self.friction}
        key = f"{section.key}.{'torques' if speeds is None else 'speeds'}"
        load = refused(key, LoadSpectrum, torques, **run_at)
        given = section.weights
        return load if given is None else refused(f"{section.key}.weights", LoadSpectrum, torques, given, **run_at)

    @property
    def part_of(self) -> dict[str, str]:
        """Notes that the pair is a part of something, by the tables that say so, as [stage]; empty for a pair alone."""
        return {name: each.whole for name, each in self.tables.items() if isinstance(each, FurtherTable) and each.whole}

    @property
    def materials(self) -> tuple[str | None, str | None]:
        """Names of the materials of pinion and wheel; None where the file names none."""
        return self.drawn["pinion"].get("material"), self.drawn["wheel"].get("material")

    def pair(self, parameters: Mapping[str, Any] | None = None) -> GearPair:
        """The gear pair.

        Args:
            parameters: value of every free parameter, they may be tracers; None for the middle of their bounds.
        """
        return self._middle.pair if parameters is None else self._mesh.pair.build(parameters)

    @property
    def compliance(self) -> AbstractCompliance:
        """The stiffness model, with all variables in the middle of their bounds."""
        return self._middle.compliance

    @property
    def _meshing(self) -> GearPair:
        """Pair with the flanks that carry the torque as its drive flanks."""
        return self._middle.pair.coast if self.coast else self._middle.pair

    @property
    def signed_torque(self) -> float:
        """Design torque on the pinion [N m], negative on the coast flanks."""
        return -self.torque if self.coast else self.torque

    @property
    def load_in_words(self) -> str:
        """Design torque in words, with a note for coast flanks."""
        return f"{self.signed_torque:g} N m{', coast flanks,' * self.coast}"

    def check_drive(self, owner: str) -> None:
        """Raises a `DesignFileError` for coast flanks, which a command or a table does not know."""
        if self.coast:
            problem = f"{self.signed_torque:g} N m is carried by the coast flanks, {_ONLY_DRIVE.format(owner)}"
            raise DesignFileError("load.torque", problem, self.path)

    def resolution(self, torque: float | None = None) -> Resolution:
        """Array sizes of the file, with as few tooth pairs as the load needs if the file gives no number.

        Args:
            torque: largest torque on the pinion [N m], None for the largest that [load] names; those that wear the
                flanks count besides.

        Raises:
            DesignFileError: when no number of pairs is enough, because of a torque or modulus in another unit.
        """
        if self._mesh.resolution.pairs is not None:
            return self._mesh.resolution
        torque = max(self.torque, self.torque_range[1]) if torque is None else torque
        torque = max([torque, *(("wear" in self.tables and self.tables["wear"].torques) or ())])
        pair, times = self._middle.pair, _DYNAMIC_DEFLECTIONS if "dynamics" in self.tables else _DEFLECTIONS
        deflection = times * float(_single_deflection(pair, np.asarray(torque)))
        pairs = None
        if deflection <= times * _MOST_DEFLECTION * float(pair.pinion.module):
            with suppress(ValueError):
                pairs = fewest_pairs(pair, deflection=deflection)
        if pairs is None:
            given = f"deflects a pair of teeth of module {float(pair.pinion.module):g} mm by"
            given = f"{torque:g} N m {given} {deflection / times:.3g} um"
            for name, gear in (("pinion", pair.pinion), ("wheel", pair.wheel)):
                modulus, usual = float(gear.material.elastic_modulus), LIMITS["elastic modulus"]
                if modulus < usual.low:
                    material = self._mesh.pair.fields[name].fields["material"]
                    problem = f"{modulus:g} MPa is less than {usual.low:g} MPa ({usual.remark}), and {given}"
                    raise DesignFileError(f"{material.key}.elastic_modulus", problem, self.path)
            most = f"{_MOST_DEFLECTION:g} um per mm of module"
            problem = f"{given}, must be at most {most}: give the torque in N m"
            raise DesignFileError("load.torque", problem, self.path)
        if self._mesh.pair.free():  # other variants can have a larger contact ratio
            further = float(self._longest.overlap_ratio - pair.overlap_ratio)
            pairs = max(pairs + math.ceil(further), _OPEN_PAIRS)
        return replace(self._mesh.resolution, pairs=pairs)

    @property
    def takes_more_pairs(self) -> bool:
        """True if the file leaves the number of tooth pairs open."""
        return self._mesh.resolution.pairs is None

    @property
    def left_out(self) -> str:
        """Message naming the shafts, bearings and housing that `mesh` ignores and why, "" for none."""
        if self.support is None:
            return ""
        options = {"open_gears": bool(self._mesh.free()), "vibrates": "dynamics" in self.tables}
        return gearbox.left_out(self.support, self._mesh.resolution, **options)

    def _support(self, sizes: Resolution) -> AbstractSupport | None:
        if self.support is None or self.left_out:
            return self._middle.support
        return gearbox.over_slices(self.support, sizes)

    def mesh(
        self, resolution: Resolution | None = None, support: AbstractSupport | None = None, *, rigid: bool = False
    ) -> Mesh:
        """The prepared mesh.

        Args:
            resolution: array sizes in place of the file's.
            support: shafts, bearings and housing; None for those of the file, where they are the same at every torque
                (see `left_out`), or its misalignment.
            rigid: without the file's shafts.

        Raises:
            DesignFileError: when the resolution does not cover the path of contact.
        """
        sizes = resolution or self.resolution()
        if support is None:
            support = self._middle.support if rigid else self._support(sizes)
        options = {"compliance": self._middle.compliance, "resolution": sizes, "support": support}
        with naming(self.path):
            return refused("resolution", prepare, self._meshing, **options)

    def begin_contact(self, first: Resolution, resolution: Resolution) -> None:
        """Start to compile the programs that prepare and solve the mesh, see `contact.begin_contact`."""
        begin_contact(self._meshing, self._middle.compliance, first, resolution, self._support(first))

    def sweep_mesh(self, resolution: Resolution) -> Mesh | Callable[[Mapping[str, Any]], Mesh]:
        """Prepared mesh; if numbers of the gears are variables, a function of the parameters that prepares it."""
        return replace(self._mesh, resolution=resolution) if self._mesh.free() else self.mesh(resolution)

    @property
    def load(self) -> Template:
        """Torque, speed and friction, with the variables among them open."""
        return self._load

    @property
    def misalignment(self) -> Template:
        """Misalignment of the axes, with the variables in it open; without fields for parallel axes."""
        return self._mesh.misalignment

    def operating_point(self, parameters: Mapping[str, Any]) -> OperatingPoint:
        """Torque, speed and friction; pure and traceable.

        Args:
            parameters: value of every free parameter.
        """
        return self._load.build(parameters)


@program
def _single_deflection(pair: GearPair, torque) -> Float[Array, ""]:
    """Deflection of one pair of teeth that carries the torque [N m] alone, after ISO 6336-1 [um]."""
    line_load = full_load(pair, torque)
    return line_load / single_stiffness(pair, line_load)[1]


def load_design(path: str | Path) -> DesignFile:
    """Reads and checks a design file, the tables of all commands included.

    Left to the commands is what their options can change (the method of a search, the number of variants), files of
    variants, and which numbers may be variables.

    Args:
        path: TOML file; examples/spur_19_48.toml shows and lists what it can say.

    Raises:
        DesignFileError: for anything that is wrong with it, in one line that names the file and the key.
    """
    file = Path(path)
    with naming(file):
        return checked(file, read(file))


def checked(file: Path, given: dict[str, Any]) -> DesignFile:
    """Design file with a content in place of that of its file, as `load_design` checks it.

    Raises:
        DesignFileError: for anything that is wrong with it, in one line that names the file and the key.
    """
    with naming(file):
        content = given
        further = {name: cls for name, cls in further_tables().items() if name not in FileSection.keys}
        used = [cls for name, cls in further.items() if name in content]
        with calling({own: name for cls in used for own, name in cls.called.items()}):
            for cls in used:
                content = dict(cls.pair_content(content))
            design, sections = _read(file, content, further)
            for each in sections:
                design = each.extended(design, given)
            for each in sections:
                each.check(design)
    return design


def design_of(path: Path, content: dict[str, Any]) -> DesignFile:
    """Design file of a pair with a content in place of that of its file, without further tables.

    Raises:
        DesignFileError: for anything that is wrong with it.
    """
    return _read(path, content, {})[0]


def _only(names: set[str], of: Mapping[str, T]) -> dict[str, T]:
    """The items of some names."""
    return {name: value for name, value in of.items() if name in names}


def _check_coast(content: Mapping[str, Any], further: Mapping[str, type[FurtherTable]], torque: float) -> None:
    """Raises a `DesignFileError` for tables that know the drive flanks alone."""
    tables = {name: f"[{name}]" for name, cls in further.items() if cls.drive_only}
    for name, shown in sorted({**tables, "misalignment": "[misalignment]", "shafts": "[[shafts]]"}.items()):
        if name in content:
            problem = f"{torque:g} N m is carried by the coast flanks, {_ONLY_DRIVE.format(shown)}"
            raise DesignFileError("load.torque", problem)


def _read(
    file: Path, content: dict[str, Any], further: Mapping[str, type[FurtherTable]]
) -> tuple[DesignFile, list[FurtherTable]]:
    top = decode("", content, file_section(further))
    folder, load = file.parent, top.load
    if load.torque_range is not None:
        increasing("load.torque_range[1]", load.torque_range[0], load.torque_range[1], unit=" N m")
    coast = False
    if not isinstance(load.torque, Free) and load.torque < 0:
        _check_coast(content, further, load.torque)
        load, coast = load.changed(torque=-load.torque), True
    top.refuse(["sun", "planet"], " without [stage]")
    materials = materials_of(top.materials)
    gears = {"pinion": top.pinion, "wheel": top.driven}
    check_pitches(*gears.values())
    pair = pair_of(top.pair, *(gear_template(section, materials) for section in gears.values()))
    flanks, unused = (
        {name: flank_of(section, folder, pair.fields[name], coast=side) for name, section in gears.items()}
        for side in (coast, not coast)
    )
    others = [part for parts in unused.values() for part in parts]
    axes, point = top.misalignment, template_of(load, OperatingPoint)
    model = model_template(top.model)
    open_case = [*pair.free(), *model.free(), *axes.free(), *point.free()]
    modifications = [*flanks["pinion"], *flanks["wheel"]]
    empty = [f"{name}.modification" for name, section in gears.items() if section.fields.get("modification") == []]
    open_flanks = [free for part in modifications for free in part.free()]
    behind = [free for part in others for free in part.free()]
    bounds, units, values = read_variables(top.variables, [*open_flanks, *open_case, *behind], empty)
    used = {free.name for free in (*open_flanks, *open_case)}  # others are of the flanks that carry nothing
    bounds, units, values = _only(used, bounds), _only(used, units), _only(used, values)
    middle = {name: 0.5 * (low + high) for name, (low, high) in bounds.items()}
    usual_pair, usual = pair.build(middle), point.build(middle)
    longest = longest_path(usual_pair, pair, bounds)
    if not pair.free():
        check_files(flanks, usual_pair)
    ends = [{name: limits[end] for name, limits in bounds.items()} for end in (0, 1)]
    uneven = [part.key for part in (*modifications, axes) if any(part.build(end).varies_along_face for end in ends)]
    if axes.key not in uneven:  # zeros are parallel axes
        axes = replace(axes, fields={})
    torque, quality = float(usual.torque), quality_of(top.pinion, top.driven)
    sections = {name: cls.read(content[name], folder) for name, cls in further.items() if name in content}
    sections |= {name: with_quality(section, quality) for name, section in sections.items() if section.classified}
    tables: dict[str, Any] = {name: section.value for name, section in sections.items()}
    uneven += [name for section in sections.values() for name in section.varies_along_face()]
    support = None
    if top.shafts:
        if axes.fields:
            raise DesignFileError("misalignment", "has no effect with [[shafts]], which take that of [[meshes]]")
        turning = [(join(table.key, "direction"), table.direction) for table in sections.values() if table.direction]
        options: dict[str, Any] = {"torque": torque, "folder": folder, "materials": materials}
        shafts = usual_pair, top.shafts, top.meshes, top.housing
        support = gearbox.support_of(*shafts, direction=next(iter(turning), _TURNING), **options)
    else:
        top.refuse(["meshes", "housing"], " without [[shafts]]")
    sizes = resolution_of(top.resolution, uneven, bent=support is not None and len(top.meshes) < 2, longest=longest)
    model = with_tables(model, top.model, folder, pair, usual_pair)  # last, as it takes longer than all the rest
    mesh = _FileMesh(pair, model, axes, sizes, coast)
    classes = tables["tolerance"].quality_class if "tolerance" in tables else quality
    low, high = load.torque_range or [share * torque for share in _TORQUE_RANGE]
    design = DesignFile(
        path=file,
        text=json.dumps(content, sort_keys=True, default=str),
        title=top.title or printable(file.stem),
        torque=torque,
        coast=coast,
        torque_range=(low, high),
        speed=None if usual.speed is None else float(usual.speed),
        friction=None if usual.friction is None else float(usual.friction),
        quality_classes=None if classes is None else both_classes(classes),
        drawn={name: drawing_of(section) for name, section in gears.items()},
        bounds=bounds,
        units=units,
        values=values,
        open_case=tuple(open_case),
        design=FileDesign(tuple(bounds), flanks["pinion"], flanks["wheel"]),
        support=support,
        tables=tables,
        _load=point,
        _mesh=mesh,
        _middle=mesh.parts(middle),
        _longest=longest,
    )
    return design, [*sections.values()]
