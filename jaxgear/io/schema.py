"""The layout of a design file: one class per table, its fields are the allowed keys.

Numbers of modifications and curves may be the name of a variable instead. Defaults that belong to the library stay
there: None means that the key is absent.
"""

from typing import Annotated, Any

from .. import compliance
from ..geometry import Gear, GearPair
from ..numerics import Number
from .kinds import Choice, Either, ListOf, Real, Switch, Table, Text
from .layout import Section, section_of

Tables = dict[str, Any]
_SEED = 2**31 - 1  # what every generator of random numbers takes


def _count(low: int, high: int) -> Real:
    """A whole number; the upper limits keep a slip of the finger from filling the memory or compiling for hours."""
    return Real(Number(low=low, high=high, whole=True))


def _positive(unit: str) -> Real:
    return Real(Number(unit, low=0.0, open_low=True))


_NUMBER = Real()
_BOUND = Real(plausible=False)
_SHARE = Real(Number(low=0.0, high=1.0, open_low=True, open_high=True))
_TABLES = ListOf(Table(), empty=True)
_WEIGHTS = ListOf(Real(Number(low=0.0)))


class FileSection(Section):
    """The top level; the tables are decoded one by one, so that messages carry the full key."""

    pinion: Annotated[Tables, Table()]
    wheel: Annotated[Tables, Table()]
    load: Annotated[Tables, Table()]
    title: Annotated[str | None, Text()] = None
    pair: Annotated[Tables | None, Table()] = None
    model: Annotated[Tables | None, Table()] = None
    resolution: Annotated[Tables | None, Table()] = None
    variables: Annotated[Tables | None, Table(Table())] = None
    optimize: Annotated[Tables | None, Table()] = None
    sweep: Annotated[Tables | None, Table()] = None
    tolerance: Annotated[Tables | None, Table()] = None


class GearSection(section_of(Gear)):  # type: ignore[misc]
    """A gear and what is taken off its flanks."""

    modification: Annotated[list[Tables], _TABLES] = []


PairSection = section_of(GearPair, without=("pinion", "wheel"))


class LoadSection(Section):
    torque: Annotated[float, _positive("N m")]
    torque_range: Annotated[list[float] | None, ListOf(_positive("N m"), length=2)] = None
    speed: Annotated[float | None, _positive("rpm")] = None
    friction: Annotated[float | None, _positive("")] = None


BODIES: dict[str, type[compliance.AbstractBody]] = {
    "ring": compliance.ElasticRing,
    "sainsot": compliance.Sainsot,
    "half_plane": compliance.HalfPlane,
}
CONTACTS: dict[str, type[compliance.AbstractContact]] = {
    "depth": compliance.DepthReferenced,
    "weber": compliance.Weber,
    "constant": compliance.ConstantHertz,
    "center_distance": compliance.CenterDistance,
    "kovalskii": compliance.Kovalskii,
    "palmgren": compliance.Palmgren,
    "power": compliance.NonlinearPower,
}


class ModelSection(Section):
    preset: Annotated[str, Choice(("default", "legacy"))] = "default"
    plane: Annotated[str | None, Choice(("stress", "strain"))] = None
    body: Annotated[str, Choice(tuple(BODIES))] = "ring"
    hub_windup: Annotated[bool | None, Switch()] = None
    coupling: Annotated[bool | None, Switch()] = None
    contact: Annotated[str, Choice(tuple(CONTACTS))] = "depth"


class ResolutionSection(Section):
    positions: Annotated[int | None, _count(4, 4096)] = None
    slices: Annotated[int | None, _count(1, 1024)] = None
    pairs: Annotated[int | None, _count(2, 12)] = None
    patch_nodes: Annotated[int | None, _count(1, 64)] = None
    newton_steps: Annotated[int | None, _count(1, 100)] = None
    tolerance: Annotated[float | None, _SHARE] = None


class VariableSection(Section):
    low: Annotated[float, _BOUND]
    high: Annotated[float, _BOUND]
    unit: Annotated[str | None, Text(empty=True)] = None


class OptimizeSection(Section):
    method: Annotated[str | None, Text()] = None
    objective: Annotated[str | list[str] | None, Either(Text(), ListOf(Text()), "a string or a list of strings")] = None
    measure: Annotated[str | None, Choice(("mean", "worst", "quantile", "cvar"))] = None
    level: Annotated[float | None, _SHARE] = None
    torques: Annotated[list[float] | None, ListOf(_positive("N m"))] = None
    weights: Annotated[list[float] | None, _WEIGHTS] = None
    manufactured: Annotated[int | None, _count(1, 10_000)] = None
    seed: Annotated[int | None, _count(0, _SEED)] = None
    starts: Annotated[int | None, _count(1, 4096)] = None
    steps: Annotated[int | None, _count(10, 100_000)] = None
    application_factor: Annotated[float, Real(Number(low=0.0, high=100.0, open_low=True))] = 1.0
    constraint: Annotated[list[Tables], _TABLES] = []
    minimax: Annotated[Tables | None, Table()] = None
    genetic: Annotated[Tables | None, Table()] = None
    cma_es: Annotated[Tables | None, Table()] = None
    differential_evolution: Annotated[Tables | None, Table()] = None
    factorial: Annotated[Tables | None, Table()] = None
    pareto: Annotated[Tables | None, Table()] = None
    te_iteration: Annotated[Tables | None, Table()] = None
    free_form: Annotated[Tables | None, Table()] = None


class ConstraintSection(Section):
    of: Annotated[str | None, Text()] = None
    variables: Annotated[dict[str, float] | None, Table(_NUMBER)] = None
    low: Annotated[float | None, _NUMBER] = None
    high: Annotated[float | None, _NUMBER] = None


class MinimaxOptions(Section):
    rounds: Annotated[int | None, _count(1, 1000)] = None


class _EvolutionOptions(Section):
    population: Annotated[int | None, _count(4, 100_000)] = None
    generations: Annotated[int | None, _count(1, 100_000)] = None


class GeneticOptions(_EvolutionOptions):
    crossover: Annotated[float | None, Real(Number(low=0.0, high=1.0))] = None


class CMAESOptions(_EvolutionOptions):
    spread: Annotated[float | None, Real(Number(low=0.0, high=1.0, open_low=True))] = None


class DifferentialEvolutionOptions(_EvolutionOptions):
    pass


_LEVEL = _count(2, 10_000)


class FactorialOptions(Section):
    levels: Annotated[
        int | dict[str, int] | None,
        Either(_LEVEL, Table(_LEVEL), "a whole number, or a table with one entry per variable"),
    ] = None


class ParetoOptions(Section):
    points: Annotated[int | None, _count(2, 4096)] = None
    steps: Annotated[int | None, _count(1, 100_000)] = None


class IterationOptions(Section):
    start: Annotated[str, Choice(("unmodified", "given", "low_pressure"))] = "unmodified"
    max_relief: Annotated[float, _positive("um")] = 7.0
    tolerance: Annotated[float | None, _positive("um")] = None
    steps: Annotated[int | None, _count(1, 1000)] = None
    curve: Annotated[str | None, Text()] = None


class FreeFormOptions(Section):
    points: Annotated[int | None, _count(4, 500)] = None
    max_relief: Annotated[float | None, _positive("um")] = None
    curvature: Annotated[float | None, Real(Number(low=0.0))] = None
    steps: Annotated[int | None, _count(1, 10_000)] = None
    curve: Annotated[str | None, Text()] = None


# They seek the flanks themselves.
METHODS_WITHOUT_VARIABLES = ("te_iteration", "free_form")
# The tables [optimize.<method>] of the methods that have one.
METHOD_OPTIONS: dict[str, type[Section]] = {
    "minimax": MinimaxOptions,
    "genetic": GeneticOptions,
    "cma_es": CMAESOptions,
    "differential_evolution": DifferentialEvolutionOptions,
    "factorial": FactorialOptions,
    "pareto": ParetoOptions,
    "te_iteration": IterationOptions,
    "free_form": FreeFormOptions,
}


class SweepSection(Section):
    sampling: Annotated[str, Choice(("sobol", "latin_hypercube", "full_factorial", "list"))] = "sobol"
    samples: Annotated[int | None, _count(1, 2**40)] = None
    seed: Annotated[int | None, _count(0, _SEED)] = None
    levels: Annotated[
        int | dict[str, int | list[float]] | None,
        Either(
            _LEVEL,
            Table(Either(_LEVEL, ListOf(_NUMBER), "a whole number or a list of values")),
            "a whole number, or a table with one entry per variable",
        ),
    ] = None
    file: Annotated[str | None, Text()] = None
    torques: Annotated[list[float] | None, ListOf(_positive("N m"))] = None
    weights: Annotated[list[float] | None, _WEIGHTS] = None
    results: Annotated[list[str] | None, ListOf(Text())] = None
    part_rows: Annotated[int | None, _count(1, 2**24)] = None


_CLASS = Real(Number(whole=True))


class ToleranceSection(Section):
    quality_class: Annotated[
        int | list[int], Either(_CLASS, ListOf(_CLASS, length=2), "a whole number, or a list of two")
    ]
    misalignment: Annotated[float | None, Real(Number("um", low=0.0))] = None
    samples: Annotated[int, _count(2, 100_000)] = 64
    seed: Annotated[int, _count(0, _SEED)] = 0
