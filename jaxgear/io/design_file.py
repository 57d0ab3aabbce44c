"""Design files: a gear pair, its load, its flank modifications and their free parameters, as TOML."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Array, Float

from ..compliance import AbstractCompliance
from ..contact import Mesh, OperatingPoint, Resolution, begin_contact, fewest_pairs, prepare
from ..geometry import GearPair
from ..metrics import Lubricant, Strength
from ..metrics.findings import LIMITS
from ..numerics import program
from ..shafts import AbstractSupport, Misalignment, RigidSupport, ShaftSupport
from ..sizing import iso_stiffness
from . import gearbox, rating, schema, schema_shafts, template, variables
from .errors import DesignFileError, naming, printable, refused
from .flanks import check_files
from .gearbox import layout_of, support_of
from .gears import both_classes, drawing_of, gear_of, materials_of, pair_of, quality_of
from .model import model_part, resolution_of, with_tables
from .schema import OptimizeSection
from .table_keys import decode
from .template import FileDesign, FileMesh
from .toml import read
from .variables import read_variables

# Tooth pairs are carried along up to this many times the deflection of a single pair after ISO 6336-1.
_DEFLECTIONS = 2.0
# A mesh force has to be known up to these, which vibration reaches.
_DYNAMIC_DEFLECTIONS = 5.5
# Where gears are left open, at least as many as `prepare` takes for traced gears: contact ratios up to 3.
_OPEN_PAIRS = 4
# Torques of interest where the file names none, relative to the design torque.
_TORQUE_RANGE = (0.5, 2.0)


@dataclass(frozen=True)
class DesignFile:
    """A design file, checked: what it says is physically possible.

    Attributes:
        path: the file.
        says: all that it held when it was read, as one text.
        title: free text, the file's stem if it has none.
        project: what the table of that name says, by its keys.
        torque: design torque on the pinion [N m]; the middle of its bounds where it is a variable.
        torque_range: lowest and highest torque of interest [N m].
        speed: of the pinion [rpm], None if the file names none; the middle of its bounds where it is a variable.
        friction: mean coefficient of friction; None for the library's default.
        quality_classes: flank tolerance classes of pinion and wheel, of the gears or of [tolerance]; None without.
        bounds: (low, high) of every free parameter, in its unit.
        units: unit of every free parameter, "" for a pure number.
        drawn: of pinion and wheel, what the file gives as name of the material and as measures of the tooth thickness.
        values: of the free parameters that name one, which `jaxgear analyze` takes.
        optimize: the table of that name; `optimize_request` makes sense of it.
        sweep: the table of that name, None if the file has none; `sweep_request` makes sense of it.
        tolerance: likewise, see `sweep_request`.
        dynamics: likewise, see `dynamics_request`.
        wear: likewise, see `wear_request`.
        lubricant: the oil; None if the file has none.
        strength: permissible stresses of both gears; None if the file has none.
        layout: likewise, see `layout_request`.
        support: the mesh on its shafts; None without them.
        design: makes the modifications of pinion and wheel from the free parameters.
        open_case: numbers of gears, pair, model, misalignment and load that are variables; a sweep alone can vary them.
    """

    path: Path
    says: str
    title: str
    project: dict[str, str]
    torque: float
    torque_range: tuple[float, float]
    speed: float | None
    friction: float | None
    quality_classes: tuple[int, int] | None
    bounds: dict[str, tuple[float, float]]
    units: dict[str, str]
    drawn: dict[str, dict[str, Any]]
    values: dict[str, float]
    optimize: OptimizeSection
    sweep: schema.SweepSection | None
    tolerance: schema.ToleranceSection | None
    dynamics: schema.DynamicsSection | None
    wear: schema.WearSection | None
    lubricant: Lubricant | None
    strength: Strength | None
    layout: schema_shafts.LayoutSection | None
    support: ShaftSupport | None
    design: FileDesign
    open_case: tuple[template.Free, ...]
    _pair: template.Part
    _middle: GearPair
    _model: template.Part
    _compliance: AbstractCompliance
    _misalignment: template.Part
    _support: RigidSupport | None
    _load: template.Part
    _resolution: Resolution

    def pair(self, parameters: Mapping[str, Any] | None = None) -> GearPair:
        """The gear pair.

        Args:
            parameters: value of every free parameter, they may be tracers; None for the middle of their bounds.
        """
        return self._middle if parameters is None else self._pair.build(parameters)

    def resolution(self, torque: float | None = None) -> Resolution:
        """The array sizes that the file asks for, with as few tooth pairs as the load needs where it names none.

        Args:
            torque: largest torque on the pinion [N m], None for the largest that [load] names; those that wear the
                flanks count besides.

        Raises:
            DesignFileError: when no number of pairs is enough, because of a torque or modulus in another unit.
        """
        if self._resolution.pairs is not None:
            return self._resolution
        torque = max(self.torque, self.torque_range[1]) if torque is None else torque
        torque = max([torque, *((self.wear and self.wear.torques) or ())])
        times = _DEFLECTIONS if self.dynamics is None else _DYNAMIC_DEFLECTIONS
        deflection = times * float(_single_deflection(self._middle, np.asarray(torque)))
        try:
            pairs = fewest_pairs(self._middle, deflection=deflection)
        except ValueError:
            given = f"deflects a pair of teeth of module {float(self._middle.pinion.module):g} mm by"
            given = f"{torque:g} N m {given} {deflection / times:.3g} um"
            for name, gear in (("pinion", self._middle.pinion), ("wheel", self._middle.wheel)):
                modulus, usual = float(gear.material.elastic_modulus), LIMITS["elastic modulus"]
                if modulus < usual.low:
                    material = self._pair.fields[name].fields["material"]
                    problem = f"{modulus:g} MPa is less than {usual.low:g} MPa ({usual.remark}), and {given}"
                    raise DesignFileError(f"{material.key}.elastic_modulus", problem, self.path) from None
            problem = f"{given}: give the torque in N m"
            raise DesignFileError("load.torque", problem, self.path) from None
        if self._pair.free():  # other variants can have a larger contact ratio
            pairs = max(pairs, _OPEN_PAIRS)
        return replace(self._resolution, pairs=pairs)

    @property
    def left_out(self) -> str:
        """What of shafts, bearings and housing `mesh` lacks and why, in words; "" for nothing."""
        if self.support is None:
            return ""
        vibrates = self.dynamics is not None
        return gearbox.left_out(self.support, self._resolution, open_gears=self._open_gears, vibrates=vibrates)

    @property
    def _open_gears(self) -> bool:
        return any(part.free() for part in (self._pair, self._model, self._misalignment))

    def _held(self, sizes: Resolution) -> AbstractSupport | None:
        if self.support is None or self.left_out:
            return self._support
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
            support = self._support if rigid else self._held(sizes)
        options = {"compliance": self._compliance, "resolution": sizes, "support": support}
        with naming(self.path):
            return refused("resolution", prepare, self._middle, **options)

    def begin_contact(self, first: Resolution, resolution: Resolution) -> None:
        """Starts to compile what prepares and solves the mesh, see `contact.begin_contact`."""
        begin_contact(self._middle, self._compliance, first, resolution, self._held(first))

    def sweep_mesh(self, resolution: Resolution) -> Mesh | Callable[[Mapping[str, Any]], Mesh]:
        """The prepared mesh; a function of the parameters that prepares it where numbers of the gears are free."""
        if not self._open_gears:
            return self.mesh(resolution)
        return FileMesh(self._pair, self._model, self._misalignment, resolution)

    def operating_point(self, parameters: Mapping[str, Any]) -> OperatingPoint:
        """Torque, speed and friction; pure and traceable.

        Args:
            parameters: value of every free parameter.
        """
        return self._load.build(parameters)


@program
def _single_deflection(pair: GearPair, torque) -> Float[Array, ""]:
    """Deflection of one pair of teeth that carries the torque [N m] alone, after ISO 6336-1 [um]."""
    line_load = 1e3 * torque / (pair.pinion.base_radius * pair.face_width)
    return line_load / iso_stiffness(pair, line_load).single


def read_design(file: Path) -> DesignFile:
    """Reads a design file and checks all but what only the tables of its commands say, see `load_design`.

    Raises:
        DesignFileError: for anything that is wrong with it, in one line that names the file and the key.
    """
    with naming(file):
        says = read(file)
        return _checked(file, json.dumps(says, sort_keys=True, default=str), decode("", says, schema.FileSection))


def _checked(file: Path, says: str, top: schema.FileSection) -> DesignFile:
    materials = materials_of(top)
    (pinion_says, pinion, pinion_flank), (wheel_says, wheel, wheel_flank) = (
        gear_of(name, getattr(top, name), materials, file.parent) for name in ("pinion", "wheel")
    )
    flanks = [*pinion_flank, *wheel_flank]
    pair, quality = pair_of(top, pinion, wheel), quality_of(pinion_says, wheel_says)
    load = variables.load_of(top.load)
    operating_point = template.part_of("load", load, OperatingPoint)
    stiffness = decode("model", top.model or {}, schema.ModelSection)
    model = model_part(stiffness)
    optimize = variables.optimize_of(top, stiffness)
    axes = template.part_of(
        "misalignment", decode("misalignment", top.misalignment or {}, schema.MisalignmentSection), Misalignment
    )
    open_case = [*pair.free(), *model.free(), *axes.free(), *operating_point.free()]
    open_flanks = [free for part in flanks for free in part.free()]
    both = {"pinion": pinion_says, "wheel": wheel_says}
    empty = [f"{name}.modification" for name, says_of in both.items() if says_of.given().get("modification") == []]
    bounds, units, values = read_variables(top.variables or {}, [*open_flanks, *open_case], empty)
    ends = [{name: limits[end] for name, limits in bounds.items()} for end in (0, 1)]
    middle = {name: 0.5 * (low + high) for name, (low, high) in bounds.items()}
    usual_pair = pair.build(middle)
    if not pair.free():
        check_files({"pinion": pinion_flank, "wheel": wheel_flank}, usual_pair)
    built = {part.key: [part.build(end) for end in ends] for part in flanks}
    built[axes.key] = [axes.build(end) for end in ends]
    uneven = [key for key, both in built.items() if any(one.varies_along_face for one in both)]
    if axes.key not in uneven:  # zeros are parallel axes
        axes = replace(axes, fields={})
    usual = operating_point.build(middle)
    torque = float(usual.torque)
    tolerance, sweep = variables.tolerance_of(top, quality), variables.sweep_of(top)
    low, high = load.torque_range or [share * torque for share in _TORQUE_RANGE]
    layout = layout_of(top.layout, quality)
    if layout is not None and axes.fields:
        raise DesignFileError("misalignment", "has no effect with [layout], which takes that of [[meshes]]")
    if layout is not None and layout.profile is not None:
        uneven.append("the flank lines of layout.profile")
    resolution = resolution_of(top.resolution or {}, uneven, bent=layout is not None and len(top.meshes) < 2)
    model = with_tables(model, stiffness, file.parent, pair, usual_pair)  # last, as it takes longer than all the rest
    classes = quality if tolerance is None else tolerance.quality_class
    return DesignFile(
        path=file,
        says=says,
        title=top.title or printable(file.stem),
        project=decode("project", top.project or {}, schema.ProjectSection).given(),
        torque=torque,
        torque_range=(low, high),
        speed=None if usual.speed is None else float(usual.speed),
        friction=None if usual.friction is None else float(usual.friction),
        quality_classes=None if classes is None else both_classes(classes),
        bounds=bounds,
        units=units,
        drawn={"pinion": drawing_of(pinion_says), "wheel": drawing_of(wheel_says)},
        values=values,
        optimize=optimize,
        sweep=sweep,
        tolerance=tolerance,
        dynamics=variables.optional("dynamics", top.dynamics, schema.DynamicsSection),
        wear=variables.optional("wear", top.wear, schema.WearSection),
        lubricant=rating.lubricant_of(top.lubricant, load, bounds, file.parent),
        strength=rating.strength_of(top.strength, file.parent),
        layout=layout,
        support=support_of(top, layout, usual_pair, torque, file.parent, materials),
        design=FileDesign(tuple(bounds), pinion_flank, wheel_flank),
        open_case=tuple(open_case),
        _pair=pair,
        _middle=usual_pair,
        _model=model,
        _compliance=model.build(middle),
        _misalignment=axes,
        _support=RigidSupport(usual_pair, axes.build(middle)) if axes.fields else None,
        _load=operating_point,
        _resolution=resolution,
    )
