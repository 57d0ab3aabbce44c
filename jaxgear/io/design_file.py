"""Design files: a gear pair, its load, its flank modifications and their free parameters, as TOML."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from ..compliance import Beam, Compliance, ElasticRing, legacy_compliance
from ..contact import Mesh, Resolution, fewest_pairs, prepare
from ..geometry import Gear, GearPair
from ..microgeometry import AbstractModification
from ..sizing import iso_stiffness
from . import schema, schema_sweep, template
from .errors import DesignFileError, refused, suggestion
from .kinds import outside
from .layout import Section
from .toml import decode, read

T = TypeVar("T", bound=Section)

# Tooth pairs are carried along up to this many times the deflection of a single pair after ISO 6336-1.
_DEFLECTIONS = 2.0
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
        torque: design torque on the pinion [N m].
        torque_range: lowest and highest torque of interest [N m].
        speed: of the pinion [rpm], None if the file names none.
        friction: mean coefficient of friction; used with a speed only, None for the library's default.
        bounds: (low, high) of every free parameter, in its unit.
        units: unit of every free parameter, "" for a pure number.
        application_factor: K_A of the rule-based relief.
        optimize: the table of that name; `optimize_request` makes sense of it.
        sweep: the table of that name, None if the file has none; `sweep_request` makes sense of it.
        tolerance: likewise, see `sweep_request`.
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
    _pair: GearPair
    _compliance: Compliance
    _resolution: Resolution
    _pairs_given: bool
    _parts: tuple[list[template.Part], list[template.Part]]

    def pair(self) -> GearPair:
        """The gear pair."""
        return self._pair

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
        line_load = 1e3 * torque / float(self._pair.pinion.base_radius * self._pair.face_width)
        deflection = _DEFLECTIONS * line_load / float(iso_stiffness(self._pair, line_load).single)
        try:
            pairs = fewest_pairs(self._pair, deflection=deflection)
        except ValueError:
            given = f"{torque:g} N m deflects a pair of teeth of module {float(self._pair.pinion.module):g} mm by about"
            problem = f"{given} {deflection / _DEFLECTIONS:.3g} um: give the torque in N m, elastic moduli in MPa"
            raise DesignFileError(self.path, "load.torque", problem) from None
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
        return refused(self.path, key, prepare, self._pair, compliance=compliance, resolution=resolution)

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
        gears.append(template.part_of(file, name, gear, Gear, open=False))
        keys = [f"{name}.modification[{i}]" for i in range(len(gear.modification))]
        tables = zip(keys, gear.modification)
        parts.append([template.parse(file, key, table, AbstractModification) for key, table in tables])
    pair = _pair(file, *gears, top.pair or {})
    load = _load(file, section("load", schema.LoadSection))
    optimize = section("optimize", schema.OptimizeSection)
    if top.optimize is not None and not top.variables and optimize.method not in schema.METHODS_WITHOUT_VARIABLES:
        raise DesignFileError(file, "optimize", "has no effect without [variables]")
    bounds, units = _variables(file, top.variables or {}, [*parts[0], *parts[1]])
    tolerance = None if top.tolerance is None else section("tolerance", schema_sweep.ToleranceSection)
    if tolerance is not None and top.sweep is None and optimize.manufactured is None:
        raise DesignFileError(file, "tolerance", "has no effect without [sweep] or optimize.manufactured")
    if top.sweep is not None and not top.variables:
        raise DesignFileError(file, "sweep", "has no effect without [variables]")
    return DesignFile(
        path=file,
        title=top.title or file.stem,
        torque=load.torque,
        torque_range=_torque_range(load),
        speed=load.speed,
        friction=load.friction,
        bounds=bounds,
        units=units,
        application_factor=optimize.application_factor,
        optimize=optimize,
        sweep=None if top.sweep is None else section("sweep", schema_sweep.SweepSection),
        tolerance=tolerance,
        _pair=pair,
        _compliance=_compliance(file, section("model", schema.ModelSection)),
        _resolution=_resolution(file, section("resolution", schema.ResolutionSection), [*parts[0], *parts[1]], bounds),
        _pairs_given=bool(top.resolution and "pairs" in top.resolution),
        _parts=(parts[0], parts[1]),
    )


def _pair(file: Path, pinion: template.Part, wheel: template.Part, table: schema.Tables) -> GearPair:
    rest = template.part_of(file, "pair", decode(file, "pair", table, schema.PairSection), GearPair, open=False)
    pair = template.Part(GearPair, {"pinion": pinion, "wheel": wheel, **rest.fields}, "pair")
    return pair.checked(file, {})


def _load(file: Path, load: schema.LoadSection) -> schema.LoadSection:
    if load.torque_range is not None:
        _increasing(file, "load.torque_range[1]", *load.torque_range, unit=" N m")
    if load.friction is not None and load.speed is None:
        raise DesignFileError(file, "load.friction", "has no effect without load.speed (flash temperature)")
    return load


def _resolution(file: Path, sizes: schema.ResolutionSection, parts: list[template.Part], bounds) -> Resolution:
    given = sizes.given()
    ends = [{name: limits[end] for name, limits in bounds.items()} for end in (0, 1)]
    for part in parts:
        if not any(part.build(parameters).varies_along_face for parameters in ends):
            continue
        if given.setdefault("slices", _SLICES) == 1:
            problem = f"must be at least 2, 1 cannot show {part.key}, which varies along the face"
            raise DesignFileError(file, "resolution.slices", f"{problem} ({_SLICES} where the key is left out)")
    return Resolution(**given)


def _torque_range(load: schema.LoadSection) -> tuple[float, float]:
    low, high = load.torque_range or [share * load.torque for share in _TORQUE_RANGE]
    return low, high


def _compliance(file: Path, model: schema.ModelSection) -> Compliance:
    given = set(model.given()) - {"preset"}
    if model.preset == "legacy":
        if given:
            raise DesignFileError(file, f"model.{min(given)}", 'cannot be combined with preset = "legacy"')
        return legacy_compliance()
    body, contact = schema.BODIES[model.body], schema.CONTACTS[model.contact]
    options = {name: getattr(model, name) for name in ("hub_windup", "coupling") if name in given}
    if options and body is not ElasticRing:
        raise DesignFileError(file, f"model.{min(options)}", f'has no effect with body = "{model.body}"')
    return Compliance(Beam(), body(**options), contact(), model.plane or "stress")


def _variables(file: Path, tables: schema.Tables, parts: list[template.Part]):
    """Bounds and units of the free parameters, each declared once and used at least once."""
    bounds: dict[str, tuple[float, float]] = {}
    units: dict[str, str] = {}
    for name, table in tables.items():
        key = f"variables.{name}"
        variable = decode(file, key, table, schema.VariableSection)
        _increasing(file, f"{key}.high", variable.low, variable.high)
        bounds[name] = (variable.low, variable.high)
    for part in parts:
        for free in part.free():
            unit = free.number.unit
            if free.name not in bounds:
                known = suggestion(free.name, bounds) if bounds else "there is no [variables] table"
                raise DesignFileError(file, free.key, f'"{free.name}" is not a variable, {known}')
            other = units.setdefault(free.name, unit)
            if other != unit:
                problem = f"{free.name} stands for {_quantity(unit)} here and for {_quantity(other)} elsewhere"
                raise DesignFileError(file, free.key, problem)
            for end, bound in zip(("low", "high"), bounds[free.name]):
                if problem := outside(free.number, bound):
                    raise DesignFileError(file, f"variables.{free.name}.{end}", f"{problem} as {free.key}")
    for name, table in tables.items():
        if name not in units:
            raise DesignFileError(file, f"variables.{name}", "is declared but used in no modification")
        unit = table.get("unit")
        if unit is not None and unit != units[name]:
            raise DesignFileError(file, f"variables.{name}.unit", f'"{unit}" must be "{units[name]}" as it is used')
    for part in parts:
        for end in (0, 1):
            part.checked(file, {name: limits[end] for name, limits in bounds.items()})
    return bounds, {name: units[name] for name in bounds}


def _quantity(unit: str) -> str:
    return f"a quantity in {unit}" if unit else "a pure number"


def _increasing(file: Path, key: str, low: float, high: float, unit: str = "") -> None:
    if high <= low:
        raise DesignFileError(file, key, f"{high:g}{unit} must be greater than {low:g}{unit}")
