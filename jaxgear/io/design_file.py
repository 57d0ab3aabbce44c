"""Design files: a gear pair, its load, its flank modifications and their free parameters, as TOML."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from ..compliance import Compliance, legacy_compliance
from ..contact import Mesh, Operation, Resolution, fewest_pairs, prepare
from ..geometry import Gear, GearPair
from ..microgeometry import AbstractModification
from ..sizing import iso_stiffness
from . import schema, schema_sweep, template
from .errors import DesignFileError, refused
from .layout import Section
from .toml import decode, read
from .variables import increasing, read_variables

T = TypeVar("T", bound=Section)

# Tooth pairs are carried along up to this many times the deflection of a single pair after ISO 6336-1.
_DEFLECTIONS = 2.0
# Where gears are left open, at least as many as `prepare` takes for traced gears: contact ratios up to 3.
_OPEN_PAIRS = 4
# Slices where a modification varies along the face: the mean of a parabola over the middles of n slices is 1 / n^2 too
# small, so that 11 show a lead crowning to 1 %.
_SLICES = 11
# Torques of interest where the file names none, relative to the design torque.
_TORQUE_RANGE = (0.5, 2.0)


@dataclass(frozen=True)
class DesignFile:
    """A design file, checked: what it says is physically possible.

    Attributes:
        path: the file.
        title: free text, the file's stem if it has none.
        torque: design torque on the pinion [N m]; the middle of its bounds where it is a variable.
        torque_range: lowest and highest torque of interest [N m].
        speed: of the pinion [rpm], None if the file names none; the middle of its bounds where it is a variable.
        friction: mean coefficient of friction; used with a speed only, None for the library's default.
        bounds: (low, high) of every free parameter, in its unit.
        units: unit of every free parameter, "" for a pure number.
        application_factor: K_A of the rule-based relief.
        optimize: the table of that name; `optimize_request` makes sense of it.
        sweep: the table of that name, None if the file has none; `sweep_request` makes sense of it.
        tolerance: likewise, see `sweep_request`.
        open_case: numbers of gears, pair, model and load that are variables; a sweep alone can vary them.
    """

    path: Path
    title: str
    torque: float
    torque_range: tuple[float, float]
    speed: float | None
    friction: float | None
    bounds: dict[str, tuple[float, float]]
    units: dict[str, str]
    application_factor: float
    optimize: schema.OptimizeSection
    sweep: schema_sweep.SweepSection | None
    tolerance: schema_sweep.ToleranceSection | None
    open_case: tuple[template.Free, ...]
    _pair: template.Part
    _middle: GearPair
    _model: template.Part
    _compliance: Compliance
    _load: template.Part
    _resolution: Resolution
    _pairs_given: bool
    _parts: tuple[list[template.Part], list[template.Part]]

    def pair(self, parameters: Mapping[str, Any] | None = None) -> GearPair:
        """The gear pair.

        Args:
            parameters: value of every free parameter, they may be tracers; None for the middle of their bounds.
        """
        return self._middle if parameters is None else self._pair.build(parameters)

    def resolution(self, torque: float | None = None) -> Resolution:
        """The array sizes that the file asks for, with as few tooth pairs as the load needs where it names none.

        Args:
            torque: largest torque on the pinion [N m], None for the largest that the file names.

        Raises:
            DesignFileError: when no number of pairs is enough, because of a torque or modulus in another unit.
        """
        if self._pairs_given:
            return self._resolution
        torque = max(self.torque, self.torque_range[1]) if torque is None else torque
        line_load = 1e3 * torque / float(self._middle.pinion.base_radius * self._middle.face_width)
        deflection = _DEFLECTIONS * line_load / float(iso_stiffness(self._middle, line_load).single)
        try:
            pairs = fewest_pairs(self._middle, deflection=deflection)
        except ValueError:
            given = f"{torque:g} N m deflects a pair of teeth of module {float(self._middle.pinion.module):g} mm by"
            problem = f"{given} {deflection / _DEFLECTIONS:.3g} um: give the torque in N m, elastic moduli in MPa"
            raise DesignFileError(self.path, "load.torque", problem) from None
        if any(True for _ in self._pair.free()):  # other variants can have a larger contact ratio
            pairs = max(pairs, _OPEN_PAIRS)
        return replace(self._resolution, pairs=pairs)

    def mesh(self, resolution: Resolution | None = None) -> Mesh:
        """The prepared mesh.

        Args:
            resolution: array sizes in place of the file's.

        Raises:
            DesignFileError: when the resolution does not cover the path of contact.
        """
        resolution = self.resolution() if resolution is None else resolution
        key, compliance = "resolution", self._compliance
        return refused(self.path, key, prepare, self._middle, compliance=compliance, resolution=resolution)

    def sweep_mesh(self, resolution: Resolution) -> Mesh | Callable[[Mapping[str, Any]], Mesh]:
        """The prepared mesh; a function of the parameters that prepares it where numbers of the gears are free."""
        if not any(True for part in (self._pair, self._model) for _ in part.free()):
            return self.mesh(resolution)
        return lambda parameters: prepare(
            self.pair(parameters), compliance=self._model.build(parameters), resolution=resolution
        )

    def operation(self, parameters: Mapping[str, Any]) -> Operation:
        """Torque, speed and friction; pure and traceable.

        Args:
            parameters: value of every free parameter.
        """
        return self._load.build(parameters)

    def design(self, parameters: Mapping[str, Any]) -> tuple[AbstractModification, AbstractModification]:
        """Modifications of pinion and wheel; pure and traceable.

        Args:
            parameters: value of every free parameter, scalar.
        """
        if set(parameters) != set(self.bounds):
            raise ValueError(
                f"design: parameters {', '.join(sorted(parameters)) or '(none)'} must be those of the file: "
                f"{', '.join(sorted(self.bounds)) or '(none)'}"
            )
        pinion, wheel = self._parts
        return template.build(pinion, parameters), template.build(wheel, parameters)


def load_design(path: str | Path) -> DesignFile:
    """Reads and checks a design file.

    Args:
        path: TOML file; examples/spur_19_48.toml shows and lists what it can say.

    Raises:
        DesignFileError: for anything that is wrong with it, in one line that names the file and the key.
    """
    file = Path(path)
    top = decode(file, "", read(file), schema.FileSection)

    def section(name: str, struct: type[T]) -> T:
        return decode(file, name, getattr(top, name) or {}, struct)

    gears, parts = [], []
    for name in ("pinion", "wheel"):
        gear = section(name, schema.GearSection)
        gears.append(template.part_of(file, name, gear, Gear))
        keys = [f"{name}.modification[{i}]" for i in range(len(gear.modification))]
        tables = zip(keys, gear.modification)
        parts.append([template.parse(file, key, table, AbstractModification) for key, table in tables])
    pair = _pair(file, gears[0], gears[1], top.pair or {})
    load = _load(file, section("load", schema.LoadSection))
    operation = template.part_of(file, "load", load, Operation)
    model = _model(file, section("model", schema.ModelSection))
    optimize = section("optimize", schema.optimize_section())
    if top.optimize is not None and not top.variables and optimize.method not in schema.METHODS_WITHOUT_VARIABLES:
        raise DesignFileError(file, "optimize", "has no effect without [variables]")
    open_case = [*pair.free(), *model.free(), *operation.free()]
    bounds, units = read_variables(file, top.variables or {}, [*parts[0], *parts[1]], open_case)
    middle = {name: 0.5 * (low + high) for name, (low, high) in bounds.items()}
    usual = operation.checked(file, middle)
    design_torque = float(usual.torque)
    tolerance = None if top.tolerance is None else section("tolerance", schema_sweep.ToleranceSection)
    if tolerance is not None and top.sweep is None and optimize.manufactured is None:
        raise DesignFileError(file, "tolerance", "has no effect without [sweep] or optimize.manufactured")
    if top.sweep is not None and not top.variables:
        raise DesignFileError(file, "sweep", "has no effect without [variables]")
    return DesignFile(
        path=file,
        title=top.title or file.stem,
        torque=design_torque,
        torque_range=_torque_range(load, design_torque),
        speed=None if usual.speed is None else float(usual.speed),
        friction=None if usual.friction is None else float(usual.friction),
        bounds=bounds,
        units=units,
        application_factor=optimize.application_factor,
        optimize=optimize,
        sweep=None if top.sweep is None else section("sweep", schema_sweep.SweepSection),
        tolerance=tolerance,
        open_case=tuple(open_case),
        _pair=pair,
        _middle=pair.checked(file, middle),
        _model=model,
        _compliance=model.checked(file, middle),
        _load=operation,
        _resolution=_resolution(file, section("resolution", schema.ResolutionSection), [*parts[0], *parts[1]], bounds),
        _pairs_given=bool(top.resolution and "pairs" in top.resolution),
        _parts=(parts[0], parts[1]),
    )


def _pair(file: Path, pinion: template.Part, wheel: template.Part, table: schema.Tables) -> template.Part:
    rest = template.part_of(file, "pair", decode(file, "pair", table, schema.PairSection), GearPair)
    return template.Part(GearPair, {"pinion": pinion, "wheel": wheel, **rest.fields}, "pair")


def _load(file: Path, load: schema.LoadSection) -> schema.LoadSection:
    if load.torque_range is not None:
        low, high = load.torque_range
        increasing(file, "load.torque_range[1]", low, high, unit=" N m")
    if load.friction is not None and load.speed is None:
        raise DesignFileError(file, "load.friction", "has no effect without load.speed (flash temperature)")
    return load


def _resolution(file: Path, sizes: Section, parts: list[template.Part], bounds) -> Resolution:
    given = sizes.given()
    ends = [{name: limits[end] for name, limits in bounds.items()} for end in (0, 1)]
    for part in parts:
        if not any(part.build(parameters).varies_along_face for parameters in ends):
            continue
        if given.setdefault("slices", _SLICES) == 1:
            problem = f"must be at least 2, 1 cannot show {part.key}, which varies along the face"
            raise DesignFileError(file, "resolution.slices", f"{problem} ({_SLICES} where the key is left out)")
    return template.Part(Resolution, given, "resolution").checked(file, {})


def _torque_range(load: schema.LoadSection, torque: float) -> tuple[float, float]:
    low, high = load.torque_range or [share * torque for share in _TORQUE_RANGE]
    return low, high


def _model(file: Path, model: schema.ModelSection) -> template.Part:
    given = set(model.given()) - {"preset"}
    if model.preset == "default":
        return template.part_of(file, "model", model, Compliance)
    if given:
        raise DesignFileError(file, f"model.{min(given)}", 'cannot be combined with preset = "legacy"')
    return template.Part(legacy_compliance, {}, "model")
