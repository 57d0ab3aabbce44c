"""What the table [optimize] of a design file asks for."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

from ..contact import Mesh
from ..metrics import quantities
from ..numerics import AbstractMeasure, Callback, CVaR, Mean, Quantile, Worst
from ..optimize import (
    METHODS,
    Constraint,
    Front,
    Optimum,
    Pareto,
    free_form,
    iterate_from_low_pressure,
    iterate_transmission_error,
    minimize,
    pareto,
)
from ..optimize.projection import CURVES
from ..tolerance import Tolerance
from . import schema
from .cases import load_of, tolerance_of
from .design_file import DesignFile
from .errors import DesignFileError, refused, suggestion
from .layout import Section
from .toml import decode

_DEFAULT_METHOD = "minimax"
_CURVE = "cubic"  # on which flanks without parameters are projected
_FRONT = ("ppte", "max_contact_pressure")  # of a Pareto front where the file names no objectives
_PARETO = "pareto"
_MEASURES: Mapping[str, Callable[..., AbstractMeasure]] = {
    "mean": Mean,
    "worst": Worst,
    "quantile": Quantile,
    "cvar": CVaR,
}
_WITH_LEVEL = ("quantile", "cvar")
# Options of a quick look.
_QUICK: Mapping[str, dict[str, Any]] = {
    "minimax": {"starts": 4, "rounds": 1, "steps": 10},
    "adam": {"starts": 4, "steps": 40},
    "lbfgs": {"starts": 4, "steps": 30},
    "genetic": {"population": 20, "generations": 10},
    "cma_es": {"population": 8, "generations": 20},
    "differential_evolution": {"population": 20, "generations": 10},
    "factorial": {"levels": 3},
    "pareto": {"points": 8, "steps": 5},
    "te_iteration": {},
    "free_form": {"points": 12, "steps": 10},
}
_QUICK_GEARS = 4


@dataclasses.dataclass(frozen=True)
class OptimizeRequest:
    """An optimization, checked; call it to run it.

    Attributes:
        method: its name.
        curve: named curve on which the flanks of a method without parameters are projected; None for the others.
    """

    method: str
    curve: str | None
    _design: DesignFile
    _options: dict[str, Any]
    _common: dict[str, Any]
    _first: dict[str, Any]  # options of the search for a relief to start from

    def __call__(self, mesh: Mesh, callback: Callback | None = None) -> Optimum | Front:
        """Runs it on a prepared mesh."""
        design = self._design
        if self.method == "free_form":
            return free_form(mesh, callback=callback, **self._common, **self._options)
        if self.method == "te_iteration":
            return self._iterate(mesh, callback)
        if self.method == _PARETO:
            common = self._common | {"objectives": self._common["objective"], "method": Pareto(**self._options)}
            del common["objective"]
            return pareto(design.design, design.bounds, mesh=mesh, callback=callback, **common)
        kind = METHODS[self.method](**self._options)
        return minimize(design.design, design.bounds, mesh=mesh, method=kind, callback=callback, **self._common)

    def _iterate(self, mesh: Mesh, callback: Callback | None) -> Optimum:
        design, options = self._design, dict(self._options)
        start, pinion, wheel = options.pop("start"), None, None
        if start == "low_pressure":
            method = METHODS[_DEFAULT_METHOD](**self._first)
            given: dict[str, Any] = {"mesh": mesh, "torque": design.torque, "method": method, "callback": callback}
            return iterate_from_low_pressure(design.design, design.bounds, **given, **options)
        if start == "given":
            pinion, wheel = design.design({})
        return iterate_transmission_error(mesh, design.torque, pinion=pinion, wheel=wheel, callback=callback, **options)


def optimize_request(design: DesignFile, *, method: str | None = None, quick: bool = False) -> OptimizeRequest:
    """Checks what a design file says about an optimization.

    Args:
        design: the design file.
        method: in place of the file's.
        quick: few starts, steps and designs, for a first look.

    Raises:
        DesignFileError: for anything that is wrong with it, in one line that names the file and the key.
    """
    section = design.optimize
    name = method or section.method or _DEFAULT_METHOD
    known = (*METHODS, _PARETO, *schema.METHODS_WITHOUT_VARIABLES)
    if name not in known:
        raise DesignFileError(design.path, "optimize.method", f'"{name}" is not known, {suggestion(name, known)}')
    if not design.bounds and name not in schema.METHODS_WITHOUT_VARIABLES:
        raise DesignFileError(design.path, "variables", "missing, nothing to optimize; use jaxgear analyze")
    for free in design.open_case:
        raise DesignFileError(design.path, free.key, f'"{free.name}" is a variable, which a sweep alone can vary here')
    options = {key: _options(design, key, table) for key, table in schema.method_options().items()}.get(name, {})
    shared = {field.name for field in dataclasses.fields(METHODS[name])} if name in METHODS else set()
    for key in ("starts", "steps"):
        value = getattr(section, key)
        if value is not None and key in shared:
            options[key] = value
        elif value is not None and method is None:
            raise DesignFileError(design.path, f"optimize.{key}", f'has no effect with method "{name}"')
    curve = options.pop("curve", _CURVE) if name in schema.METHODS_WITHOUT_VARIABLES else None
    if curve is not None and curve not in CURVES:
        raise DesignFileError(
            design.path, f"optimize.{name}.curve", f'"{curve}" is not known, {suggestion(curve, CURVES)}'
        )
    if "seed" in shared:
        options["seed"] = section.seed or 0
    elif section.seed is not None and section.manufactured is None and method is None:
        raise DesignFileError(design.path, "optimize.seed", f'has no effect with method "{name}" and perfect gears')
    common = _common(design, section, name, quick)
    if name == "te_iteration":
        _check_iteration(design, options["start"], section)
        common = {}
    elif name != "free_form":
        _check_levels(design, options.get("levels"))
        make: type[Any] = Pareto if name == _PARETO else METHODS[name]
        refused(design.path, f"optimize.{name}", lambda: make(**options))
    if quick:
        options = {**options, **_QUICK.get(name, {})}
        if name not in (_PARETO, "te_iteration"):  # a quick look stays on its mesh
            common = {**common, "positions": None}
    return OptimizeRequest(name, curve, design, options, common, _QUICK[_DEFAULT_METHOD] if quick else {})


def _check_levels(design: DesignFile, levels) -> None:
    if isinstance(levels, dict) and set(levels) != set(design.bounds):
        problem = f"must name all variables and nothing else: {', '.join(design.bounds)}"
        raise DesignFileError(design.path, "optimize.factorial.levels", problem)


def _options(design: DesignFile, name: str, section: type[Section]) -> dict[str, Any]:
    """The table of one method."""
    table = getattr(design.optimize, name) or {}
    options = decode(design.path, f"optimize.{name}", table, section)
    return {key: value for key in type(options).model_fields if (value := getattr(options, key)) is not None}


def _common(design: DesignFile, section: schema.OptimizeSection, name: str, quick: bool) -> dict[str, Any]:
    """Objective, cases and constraints."""
    objectives = _objectives(section, name)
    for objective in objectives:
        if objective not in quantities:
            problem = f'"{objective}" is not known, {suggestion(objective, quantities)}'
            raise DesignFileError(design.path, "optimize.objective", problem)
    if (len(objectives) > 1) != (name == "pareto"):
        problem = f'{len(objectives)} with method "{name}": method "pareto" takes several, the others take one'
        raise DesignFileError(design.path, "optimize.objective", problem)
    if objectives != ["ppte"] and name in schema.METHODS_WITHOUT_VARIABLES:
        raise DesignFileError(design.path, "optimize.objective", f'must be "ppte" with method "{name}"')
    found: dict[str, Any] = {
        "torque": load_of(design, "optimize", section.torques, section.weights),
        "measure": _measure(design, section),
        "constraints": _constraints(design, section),
        "seed": section.seed or 0,
        **_gears(design, section, quick),
    }
    if name == "free_form":
        return found
    return {**found, "objective": tuple(objectives) if name == _PARETO else objectives[0]}


def _objectives(section: schema.OptimizeSection, name: str) -> list[str]:
    if section.objective is None:
        return list(_FRONT) if name == "pareto" else ["ppte"]
    return section.objective if isinstance(section.objective, list) else [section.objective]


def _constraints(design: DesignFile, section: schema.OptimizeSection) -> tuple[Constraint, ...]:
    tables = enumerate(section.constraint)
    return tuple(_constraint(design, f"optimize.constraint[{number}]", table) for number, table in tables)


def _measure(design: DesignFile, section: schema.OptimizeSection) -> AbstractMeasure:
    kind = section.measure or "mean"
    if section.measure is not None and section.torques is None and section.manufactured is None:
        problem = "has no effect on a single case: give optimize.torques or optimize.manufactured"
        raise DesignFileError(design.path, "optimize.measure", problem)
    if section.level is None:
        return _MEASURES[kind]()
    if kind not in _WITH_LEVEL:
        raise DesignFileError(design.path, "optimize.level", f'has no effect with measure = "{kind}"')
    return _MEASURES[kind](section.level)


def _gears(design: DesignFile, section: schema.OptimizeSection, quick: bool) -> dict[str, Any]:
    if section.manufactured is None:
        return {}
    if design.tolerance is None:
        raise DesignFileError(design.path, "optimize.manufactured", "needs the table [tolerance]")
    tolerance: Tolerance = tolerance_of(design, design.tolerance)
    samples = min(section.manufactured, _QUICK_GEARS) if quick else section.manufactured
    return {"tolerance": tolerance, "samples": samples}


def _constraint(design: DesignFile, key: str, table: schema.Tables) -> Constraint:
    section = decode(design.path, key, table, schema.ConstraintSection)
    if (section.of is None) == (section.variables is None):
        raise DesignFileError(design.path, key, "needs either of = a quantity or variables = a table of coefficients")
    if section.of is not None and section.of not in quantities:
        raise DesignFileError(
            design.path, f"{key}.of", f'"{section.of}" is not known, {suggestion(section.of, quantities)}'
        )
    for name in section.variables or {}:
        if name not in design.bounds:
            problem = f'"{name}" is not a variable, {suggestion(name, design.bounds)}'
            raise DesignFileError(design.path, f"{key}.variables", problem)
    of = section.of if section.of is not None else section.variables
    return refused(design.path, key, lambda: Constraint(of, low=section.low, high=section.high))  # type: ignore[arg-type]


def _check_iteration(design: DesignFile, start: str, section: schema.OptimizeSection) -> None:
    """The iteration levels the transmission error at the design torque and knows nothing else."""
    for key in ("measure", "level", "torques", "weights", "manufactured"):
        if getattr(section, key) is not None:
            raise DesignFileError(design.path, f"optimize.{key}", 'has no effect with method "te_iteration"')
    if section.constraint:
        raise DesignFileError(design.path, "optimize.constraint", 'has no effect with method "te_iteration"')
    if start == "given" and design.bounds:
        problem = '"given" needs numbers in the modifications, these are free: ' + ", ".join(design.bounds)
        raise DesignFileError(design.path, "optimize.te_iteration.start", problem)
    if start == "low_pressure" and not design.bounds:
        problem = '"low_pressure" needs [variables], of which the relief of the start is designed'
        raise DesignFileError(design.path, "optimize.te_iteration.start", problem)
