"""Table [optimize] of a design file: objective, method and options of a search."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any, Self

from ..compliance import TabulatedCompliance
from ..contact import Mesh
from ..metrics import Quantity
from ..numerics import AbstractMeasure, Callback, CVaR, Mean, Number, Quantile, Worst
from ..optimize import (
    METHODS,
    Constraint,
    Front,
    Optimum,
    Pareto,
    Problem,
    minimize,
    pareto,
)
from ..optimize.free_form import CURVES
from ..optimize.refine import POSITIONS
from ..optimize.rounding import check_steps, multiples
from ..tolerance import ManufacturedGears
from ..vocabulary import quantity_of
from ..wear import WEAR_QUANTITIES, Wear
from ..wear.settings import MOST_LIVES
from .design_file import DesignFile
from .errors import DesignFileError, check_known, naming, refused, suggestion
from .model_table import FINITE_ELEMENTS
from .named_quantities import quantity_named
from .table_keys import FileTable, entry, nested, section_of
from .tables import FurtherTable
from .tolerance_table import tolerance_of
from .value_types import (
    LEVEL,
    SEED,
    WEIGHTS,
    ValueType,
    choice,
    count,
    either,
    list_of,
    outside,
    positive,
    real,
    switch,
    table,
    text,
)

# They seek the flanks themselves.
METHODS_WITHOUT_VARIABLES = tuple(name for name, cls in METHODS.items() if not cls.takes_variables)
CURVE = "cubic"  # on which flanks without parameters are projected
PARETO = "pareto"


class _ConstraintSection(FileTable):
    """A limit, of either a quantity or a linear combination of variables.

    Attributes:
        of: name of a quantity.
        variables: coefficient of every variable of the combination.
        low: least value.
        high: greatest value.
    """

    of: str | None = entry(text())
    variables: dict[str, float] | None = entry(table(real()))
    low: float | None = entry(real(plausible=False))
    high: float | None = entry(real(plausible=False))


class _FactorialOptions(FileTable):
    source = METHODS["factorial"]

    levels: int | dict[str, int] | None = entry(
        either(LEVEL, table(LEVEL), "a whole number, or a table with one entry per variable")
    )


_ITERATION = section_of(METHODS["te_iteration"], ("search",), most=(("steps", 1000),), open=False)
_FREE_FORM = section_of(METHODS["free_form"], most=(("points", 500), ("steps", 10_000)), open=False)


class _Projected(FileTable):
    """Options of a method without variables.

    Attributes:
        curve: name of the curve that the flanks are projected on, such as "power"; "cubic" without it.
    """

    curve: str | None = entry(text())


class _IterationOptions(_Projected, _ITERATION):  # type: ignore[misc, valid-type]
    """Levels the transmission error by removing it from the flanks.

    Attributes:
        start: flanks of the first step: involutes ("unmodified"), the modifications of the file ("given"), or a relief
            designed for the lowest pressure ("low_pressure").
    """


class _FreeFormOptions(_Projected, _FREE_FORM):  # type: ignore[misc, valid-type]
    """Finds the flanks with the least PPTE, of any form, by sequential linear programming."""


def method_options() -> dict[str, type[FileTable]]:
    """The tables [optimize.<method>] of the methods that have one, of a user's own too: the fields of their classes."""
    shared = "starts", "steps", "seed"
    found = {name: section_of(cls, shared, open=False) for name, cls in METHODS.items() if cls.takes_variables}
    found |= {"factorial": _FactorialOptions, PARETO: section_of(Pareto)}
    found |= {"te_iteration": _IterationOptions, "free_form": _FreeFormOptions}
    return {name: section for name, section in found.items() if section.keys}


class _RoundingSection(FileTable):
    """Steps in which the result is wanted, such as a shop can make; 0 for all digits.

    Attributes:
        amount: step of the variables in um.
        length: step of the variables in mm.
        variables: steps of single variables by their names, each in the unit of its variable.
    """

    amount: float = entry(real(Number("um", low=0.0)), 0.5)
    length: float = entry(real(Number("mm", low=0.0)), 0.1)
    variables: dict[str, float] | None = entry(table(real(Number(low=0.0))))


class OptimizeSection(FurtherTable):
    """A search for the best values of the variables, or for flanks without any; what `jaxgear optimize` does.

    Attributes:
        method: name of the method; "slp" without it.
        objective: a quantity to be made small, or large where that is better; several for "pareto"; "ppte" without it.
        measure: joins the cases of several torques or manufactured gears into one number; "mean" without it.
        level: level of the measures "quantile" and "cvar".
        torques: torques on the pinion; the design torque alone without it.
        weights: weights of the torques.
        manufactured: pairs of manufactured gears under every torque; needs [tolerance].
        seed: seed of random searches and of the manufactured gears.
        starts: searches, of methods "slp", "adam" and "lbfgs".
        steps: most steps of every search, of the same methods; the result is in those of [optimize.rounding].
        application_factor: K_A of the rule-based relief.
        verify: True if the designs are evaluated with the finite-element structure too; without it they are where the
            gears can be meshed. A quick run never does.
        rounding: steps of the variables in which the search ends.
        constraint: limits of quantities or of combinations of variables.
    """

    table = "optimize"

    method: str | None = entry(text())
    objective: str | list[str] | None = entry(either(text(), list_of(text()), "a string or a list of strings"))
    measure: str | None = entry(choice("mean", "worst", "quantile", "cvar"))
    level: float | None = entry(real(Number(low=0.0, high=1.0, open_low=True, open_high=True)))
    torques: list[float] | None = entry(list_of(positive("N m")))
    weights: list[float] | None = entry(WEIGHTS)
    manufactured: int | None = entry(count(1, 10_000))
    seed: int | None = entry(SEED)
    starts: int | None = entry(count(1, 4096))
    steps: int | None = entry(count(10, 100_000))
    application_factor: float = entry(real(Number(low=0.0, high=100.0, open_low=True)), 1.0)
    verify: bool | None = entry(switch())
    rounding: _RoundingSection | None = entry(nested(_RoundingSection))
    constraint: list[_ConstraintSection] = entry(list_of(nested(_ConstraintSection), empty=True), [])

    @classmethod
    def every_key(cls) -> dict[str, ValueType]:
        """Keys of the table, with the options of the methods that are known by now."""
        options = method_options().items()
        return cls.keys | {
            name: dataclasses.replace(nested(section), meaning="options of the method.") for name, section in options
        }

    def check(self, design: DesignFile) -> None:
        """Check the table like a search by the method of the file."""
        if not design.bounds and self.method not in METHODS_WITHOUT_VARIABLES:
            raise DesignFileError("optimize", "has no effect without [variables]")
        if self.verify and isinstance(design.compliance, TabulatedCompliance):
            raise DesignFileError("optimize.verify", f'has no effect with model.structure = "{FINITE_ELEMENTS}"')
        if self.manufactured is not None and "tolerance" not in design.tables:
            raise DesignFileError("optimize.manufactured", "needs the table [tolerance]")
        check_known("optimize.method", self.method or _DEFAULT_METHOD, known_methods())
        for name in method_options():
            if self.fields.get(name) is not None:
                _check_options(design, name, self.options(name))
        _objectives(design, self)
        _measure(self)
        _constraints(design, self)
        _rounding(design, self)
        design.spectrum(self)

    def options(self, method: str) -> dict[str, Any]:
        """Options of a method, with the defaults of its keys; keys without a value are left out."""
        section = getattr(self, method, None) or method_options().get(method, FileTable)("")
        return {name: value for name in section.keys if (value := getattr(section, name)) is not None}

    @classmethod
    def inner(cls) -> dict[str, type[FileTable]]:
        """Constraints, rounding, and options of the methods."""
        options = {f"[optimize.{name}]": section for name, section in method_options().items()}
        return {"[[optimize.constraint]]": _ConstraintSection, "[optimize.rounding]": _RoundingSection, **options}


def optimize_of(design: DesignFile) -> OptimizeSection:
    """The table [optimize], with its defaults where the file has none."""
    return design.tables.get("optimize") or OptimizeSection("optimize")


def known_methods() -> tuple[str, ...]:
    """Names of all methods."""
    return (*METHODS, PARETO)


def _varies(name: str) -> bool:
    """True if a method optimizes the variables of a file."""
    return name in METHODS and METHODS[name].takes_variables


def _made_by(name: str) -> type[Any]:
    """The class of a method with variables."""
    return Pareto if name == PARETO else METHODS[name]


def _check_options(design: DesignFile, name: str, options: Mapping[str, Any]) -> None:
    """Raise if a method cannot be made of its options."""
    if name in METHODS_WITHOUT_VARIABLES:
        check_known(f"optimize.{name}.curve", options.get("curve", CURVE), CURVES)
        return
    levels = options.get("levels")
    if isinstance(levels, dict) and set(levels) != set(design.bounds):
        problem = f"must name all variables and nothing else: {', '.join(design.bounds)}"
        raise DesignFileError("optimize.factorial.levels", problem)
    refused(f"optimize.{name}", _made_by(name), **options)


def _options_of(section: OptimizeSection, name: str, *, of_the_file: bool) -> dict[str, Any]:
    """Options of a method; options of other methods are refused only if the file names the method."""
    options = section.options(name)
    shared = {"starts": section.starts, "steps": section.steps, "seed": section.seed or 0}
    taken = {field.name for field in dataclasses.fields(METHODS[name])} if _varies(name) else set()
    if of_the_file:
        why = f' with method "{name}"'
        section.refuse([key for key in ("starts", "steps") if key not in taken], why)
        if "seed" not in taken and section.manufactured is None:
            section.refuse(["seed"], f"{why} and nominal gears")
    return options | {key: value for key, value in shared.items() if key in taken and value is not None}


_DEFAULT_METHOD = "slp"
_FRONT = ("ppte", "max_contact_pressure")  # of a Pareto front where the file names no objectives
_MEASURES: Mapping[str, Callable[..., AbstractMeasure]] = {
    "mean": Mean,
    "worst": Worst,
    "quantile": Quantile,
    "cvar": CVaR,
}
_WITH_LEVEL = ("quantile", "cvar")
# Options of a quick look.
_QUICK: Mapping[str, dict[str, Any]] = {
    "slp": {"starts": 4, "rounds": 1, "steps": 10},
    "adam": {"starts": 4, "steps": 40},
    "lbfgs": {"starts": 4, "steps": 30},
    "genetic": {"population": 20, "generations": 10},
    "cma_es": {"population": 8, "generations": 20},
    "differential_evolution": {"population": 20, "generations": 10},
    "factorial": {"levels": 3},
    "pareto": {"points": 8, "steps": 5},
    "free_form": {"points": 12, "steps": 10},
}
_QUICK_GEARS = 4
_LASTING, _OVER_LIFE = "mean_ppte_over_life", {"starts": 4, "rounds": 1, "steps": 15}  # of the search over the life


@dataclasses.dataclass(frozen=True)
class Search:
    """Search defined by a design file; call it to run it.

    Attributes:
        design: the design file.
        method: name of the method.
        problem: arguments of `Problem` besides the mesh.
        options: arguments of `minimize` or `pareto` besides problem and callback.
        curve: named curve on which the flanks of a method without parameters are projected; None for the others.
        verify: True if the designs are to be evaluated with the finite-element structure too; None where the gears can
            be meshed.
    """

    design: DesignFile
    method: str
    problem: Mapping[str, Any]
    options: Mapping[str, Any]
    curve: str | None = None
    verify: bool | None = None

    @classmethod
    def of(cls, design: DesignFile, *, method: str | None = None, quick: bool = False) -> Self:
        """The search, checked.

        Args:
            design: the design file.
            method: method in place of that of the file.
            quick: few starts, steps and designs, for a first look.

        Raises:
            DesignFileError: for anything that is wrong with it, in one line that names the file and the key.
        """
        section = optimize_of(design)
        name = method or section.method or _DEFAULT_METHOD
        with naming(design.path):
            arguments = _arguments(design, section, name, of_the_file=method is None, quick=quick)
        return cls(design, name, *arguments, False if quick else section.verify)

    @property
    def finer(self) -> int | None:
        """Positions of the finer mesh on which the search ends; None if it ends on its own mesh or chooses later."""
        ends_on_finer = _varies(self.method) or self.method == PARETO
        return self.options.get("positions", POSITIONS) if ends_on_finer else None

    def over_life(self, settings: Wear) -> "Search | None":
        """The search of the same variables for the least mean PPTE over the life at the design torque.

        One gradient search without rounding, since every step of it wears a life. None where flanks are sought without
        variables, and where the file asks for a quantity of worn flanks itself.
        """
        asked = self.problem.get("objective", "ppte")
        if not _varies(self.method) or (isinstance(asked, Quantity) and asked.name in WEAR_QUANTITIES):
            return None
        kept = {name: self.problem[name] for name in ("design", "bounds", "constraints")}
        kept |= {"torque": self.design.spectrum(OptimizeSection("optimize"))}
        kept |= {"objective": settings.quantity(_LASTING)}
        options = {"method": METHODS[_DEFAULT_METHOD](**_OVER_LIFE), "positions": None}
        return dataclasses.replace(self, method=_DEFAULT_METHOD, problem=kept, options=options)

    def __call__(self, mesh: Mesh, callback: Callback | None = None) -> Optimum | Front:
        """Run the search on a prepared mesh."""
        search = pareto if self.method == PARETO else minimize
        return search(Problem(mesh, **self.problem), callback=callback, **self.options)


def _arguments(
    design: DesignFile, section: OptimizeSection, name: str, *, of_the_file: bool, quick: bool
) -> tuple[dict[str, Any], dict[str, Any], str | None]:
    """Arguments of the problem and of its search, and the curve of flanks without parameters."""
    flanks_alone = name in METHODS_WITHOUT_VARIABLES
    check_known("optimize.method", name, known_methods())
    if not design.bounds and not flanks_alone:
        raise DesignFileError("variables", "missing, nothing to optimize; use jaxgear analyze")
    for free in design.open_case:
        raise DesignFileError(free.key, f'"{free.name}" is a variable, which a sweep alone can vary here')
    options = _options_of(section, name, of_the_file=of_the_file)
    _check_options(design, name, options)
    curve = options.pop("curve", CURVE) if flanks_alone else None
    problem = {"torque": design.spectrum(section), **_goals(design, section, name, quick)}
    varies = name != "free_form"
    if name == "te_iteration":
        start = options.get("start")
        _check_iteration(design, start, section)
        if start == "low_pressure":
            options["search"] = METHODS[_DEFAULT_METHOD](**(_QUICK[_DEFAULT_METHOD] if quick else {}))
        varies = start in ("given", "low_pressure")
    if varies:
        problem |= {"design": design.design, "bounds": design.bounds}
    fewer = _QUICK.get(name, {}) if quick else {}
    search: dict[str, Any] = {"method": _made_by(name)(**options | fewer)}
    if _varies(name):
        search["rounding"] = _rounding(design, section)
    elif of_the_file:
        section.refuse(["rounding"], f' with method "{name}"')
    if quick:  # a quick look stays on its mesh
        search["positions"] = None
    return problem, search, curve


def _goals(design: DesignFile, section: OptimizeSection, name: str, quick: bool) -> dict[str, Any]:
    """Objective, measure, constraints and manufactured gears."""
    found: dict[str, Any] = {
        "objective": _objective(design, section, name),
        "measure": _measure(section),
        "constraints": _constraints(design, section),
    }
    if section.manufactured is not None:
        pairs = min(section.manufactured, _QUICK_GEARS) if quick else section.manufactured
        tolerance = tolerance_of(design)
        assert tolerance is not None  # by `check`
        found["manufactured"] = ManufacturedGears(tolerance, pairs, section.seed or 0)
    return found


def _objectives(
    design: DesignFile, section: OptimizeSection, default: tuple[str, ...] = ()
) -> tuple[str | Quantity, ...]:
    asked = section.objective or default
    named = (asked,) if isinstance(asked, str) else tuple(asked)
    return tuple(quantity_named(design, "optimize.objective", each) for each in named)


def _objective(design: DesignFile, section: OptimizeSection, name: str) -> str | Quantity | tuple[str | Quantity, ...]:
    """The objective of a method, or several."""
    objectives = _objectives(design, section, _FRONT if name == PARETO else ("ppte",))
    if (len(objectives) > 1) != (name == PARETO):
        problem = f'{len(objectives)} with method "{name}": method "pareto" takes several, the others take one'
        raise DesignFileError("optimize.objective", problem)
    if name in METHODS_WITHOUT_VARIABLES and objectives != ("ppte",):
        raise DesignFileError("optimize.objective", f'must be "ppte" with method "{name}"')
    return objectives if name == PARETO else objectives[0]


def _measure(section: OptimizeSection) -> AbstractMeasure:
    kind = section.measure or "mean"
    if section.torques is None and section.manufactured is None:
        why = " on a single case: give optimize.torques or optimize.manufactured"
        section.refuse(["measure"], why)
    if kind not in _WITH_LEVEL:
        section.refuse(["level"], f' with measure = "{kind}"')
    return _MEASURES[kind]() if section.level is None else _MEASURES[kind](section.level)


def _constraints(design: DesignFile, section: OptimizeSection) -> tuple[Constraint, ...]:
    return tuple(_constraint(design, each) for each in section.constraint)


def _constraint(design: DesignFile, section: _ConstraintSection) -> Constraint:
    key = section.key
    of: Any = section.variables if section.of is None else section.of
    unit = ""
    if of is None or (section.of is not None and section.variables is not None):
        raise DesignFileError(key, "needs either of = a quantity or variables = a table of coefficients")
    if isinstance(of, str):
        of = quantity_named(design, f"{key}.of", of)
        _check_reachable(design, f"{key}.low", of, section.low)
        unit = quantity_of(of).unit
    else:
        for name in of:
            if name not in design.bounds:
                problem = f'"{name}" is not a variable, {suggestion(name, design.bounds)}'
                raise DesignFileError(f"{key}.variables", problem)
    for name, limit in (("low", section.low), ("high", section.high)):
        if limit is not None and (problem := outside(Number(unit), limit)):
            raise DesignFileError(f"{key}.{name}", problem)
    return refused(key, Constraint, of, low=section.low, high=section.high)


_STEPS = {"um": "amount", "mm": "length"}  # keys of [optimize.rounding] by the unit of the variables


def _rounding(design: DesignFile, section: OptimizeSection) -> dict[str, float]:
    """Steps of the variables; a default step without a multiple within the bounds is left out."""
    asked = section.rounding or _RoundingSection("optimize.rounding")
    steps: dict[str, float] = {}
    for name, key in ((name, _STEPS[unit]) for name, unit in design.units.items() if unit in _STEPS):
        step = getattr(asked, key)
        if step and (key in asked.fields or multiples(step, *design.bounds[name])):
            steps[name] = step
    for name in asked.variables or {}:
        if name not in design.bounds:
            problem = f'"{name}" is not a variable, {suggestion(name, design.bounds)}'
            raise DesignFileError(f"{asked.key}.variables", problem)
    return refused(asked.key, check_steps, {**steps, **(asked.variables or {})}, design.bounds)


def _check_reachable(design: DesignFile, key: str, of: str | Quantity, low: float | None) -> None:
    """Raise for a lower limit of a life beyond the searched range of revolutions, which no design can satisfy."""
    lives = {"life_to_ppte": 1.0, "life_to_depth": MOST_LIVES}
    if low is None or not (isinstance(of, Quantity) and of.name in lives):
        return
    looked_at = design.tables["wear"].revolutions  # or there were no such quantity
    if low > lives[of.name] * looked_at:
        most = f"{lives[of.name] * looked_at:g}, the end of the searched range"
        raise DesignFileError(key, f"{low:g} must be at most {most}: wear.revolutions = {looked_at:g}")


def _check_iteration(design: DesignFile, start: str | None, section: OptimizeSection) -> None:
    """Raise for options that the iteration ignores: it levels the transmission error at the design torque only."""
    keys = ("measure", "level", "torques", "weights", "manufactured", "constraint")
    section.refuse(keys, ' with method "te_iteration"')
    if start == "given" and design.bounds:
        problem = '"given" needs numbers in the modifications, these are free: ' + ", ".join(design.bounds)
        raise DesignFileError("optimize.te_iteration.start", problem)
    if start == "low_pressure" and not design.bounds:
        problem = '"low_pressure" needs [variables], of which the relief of the start is designed'
        raise DesignFileError("optimize.te_iteration.start", problem)
