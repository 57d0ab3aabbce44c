"""The layout of a design file: one struct per table, its fields are the allowed keys.

Numbers of modifications and curves may be the name of a variable instead (`Value`). Defaults that belong to the library
stay there: None means that the key is absent.
"""

from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from .. import compliance, microgeometry

Value = float | str
Table = dict[str, Any]
Count = Annotated[int, Meta(ge=1)]


class Section(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """A table of the file."""


class FileSection(Section):
    """The top level; the tables are decoded one by one, so that messages carry the full key."""

    pinion: Table
    wheel: Table
    load: Table
    title: str = ""
    pair: Table | None = None
    model: Table | None = None
    resolution: Table | None = None
    variables: Table | None = None
    optimize: Table | None = None
    sweep: Table | None = None
    tolerance: Table | None = None


class MaterialSection(Section):
    elastic_modulus: float | None = None
    poisson_ratio: float | None = None
    density: float | None = None
    thermal_contact_coefficient: float | None = None


class GearSection(Section):
    teeth: int
    module: float
    face_width: float
    pressure_angle: float | None = None
    profile_shift: float | None = None
    addendum: float | None = None
    dedendum: float | None = None
    root_radius: float | None = None
    tip_diameter: float | None = None
    bore_diameter: float | None = None
    tip_edge_radius: float | None = None
    material: Table | None = None
    modification: list[Table] = []


class PairSection(Section):
    center_distance: float | None = None


class LoadSection(Section):
    torque: float
    torque_range: tuple[float, float] | None = None
    speed: float | None = None
    friction: float | None = None


class ModelSection(Section):
    preset: Literal["default", "legacy"] = "default"
    plane: Literal["stress", "strain"] | None = None
    body: str | None = None
    hub_windup: bool | None = None
    coupling: bool | None = None
    contact: str | None = None


class ResolutionSection(Section):
    """The upper limits keep a slip of the finger from filling the memory or compiling for hours."""

    positions: Annotated[int, Meta(ge=4, le=4096)] | None = None
    slices: Annotated[int, Meta(ge=1, le=1024)] | None = None
    pairs: Annotated[int, Meta(ge=2, le=12)] | None = None
    patch_nodes: Annotated[int, Meta(ge=1, le=64)] | None = None
    newton_steps: Annotated[int, Meta(ge=1, le=100)] | None = None
    tolerance: Annotated[float, Meta(gt=0, lt=1)] | None = None


class VariableSection(Section):
    low: float
    high: float
    unit: str | None = None


class OptimizeSection(Section):
    method: str | None = None
    objective: str | list[str] | None = None
    measure: Literal["mean", "worst", "quantile", "cvar"] | None = None
    level: Annotated[float, Meta(gt=0, lt=1)] | None = None
    torques: list[float] | None = None
    weights: list[float] | None = None
    manufactured: Annotated[int, Meta(ge=1, le=10_000)] | None = None
    seed: Annotated[int, Meta(ge=0)] | None = None
    starts: Annotated[int, Meta(ge=1, le=4096)] | None = None
    steps: Annotated[int, Meta(ge=10, le=100_000)] | None = None
    application_factor: float | None = None
    constraint: list[Table] = []
    minimax: Table | None = None
    genetic: Table | None = None
    cma_es: Table | None = None
    differential_evolution: Table | None = None
    factorial: Table | None = None
    pareto: Table | None = None
    te_iteration: Table | None = None
    free_form: Table | None = None


class ConstraintSection(Section):
    of: str | None = None
    variables: dict[str, float] | None = None
    low: float | None = None
    high: float | None = None


class MinimaxOptions(Section):
    rounds: Annotated[int, Meta(ge=1, le=1000)] | None = None


class _EvolutionOptions(Section):
    population: Annotated[int, Meta(ge=4, le=100_000)] | None = None
    generations: Annotated[int, Meta(ge=1, le=100_000)] | None = None


class GeneticOptions(_EvolutionOptions):
    crossover: Annotated[float, Meta(ge=0, le=1)] | None = None


class CMAESOptions(_EvolutionOptions):
    spread: Annotated[float, Meta(gt=0, le=1)] | None = None


class DifferentialEvolutionOptions(_EvolutionOptions):
    pass


class FactorialOptions(Section):
    levels: int | dict[str, int] | None = None


class ParetoOptions(Section):
    points: Annotated[int, Meta(ge=2, le=4096)] | None = None
    steps: Annotated[int, Meta(ge=1, le=100_000)] | None = None


class IterationOptions(Section):
    start: Literal["unmodified", "given", "low_pressure"] = "unmodified"
    max_relief: Annotated[float, Meta(gt=0)] = 7.0
    tolerance: Annotated[float, Meta(gt=0)] | None = None
    steps: Annotated[int, Meta(ge=1, le=1000)] | None = None
    curve: str | None = None


class FreeFormOptions(Section):
    points: Annotated[int, Meta(ge=4, le=500)] | None = None
    max_relief: Annotated[float, Meta(gt=0)] | None = None
    curvature: Annotated[float, Meta(ge=0)] | None = None
    steps: Annotated[int, Meta(ge=1, le=10_000)] | None = None
    curve: str | None = None


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
    sampling: Literal["sobol", "latin_hypercube", "full_factorial", "list"] = "sobol"
    samples: Annotated[int, Meta(ge=1, le=2**40)] | None = None
    seed: Annotated[int, Meta(ge=0)] | None = None
    levels: int | dict[str, int | list[float]] | None = None
    file: str | None = None
    torques: list[float] | None = None
    weights: list[float] | None = None
    results: list[str] | None = None
    part_rows: Annotated[int, Meta(ge=1, le=2**24)] | None = None


class ToleranceSection(Section):
    quality_class: int | tuple[int, int]
    misalignment: float | None = None
    samples: Annotated[int, Meta(ge=2, le=100_000)] = 64
    seed: Annotated[int, Meta(ge=0)] = 0


class _Plain(Section):
    """A curve without numbers."""


class _PowerCurve(Section):
    exponent: Value


class _ThreeCoefficients(Section):
    b0: Value
    b1: Value
    b2: Value


class _PolynomialCurve(Section):
    coefficients: list[Value]


class _ParabolicLinearCurve(Section):
    node: Value


class _SplineCurve(Section):
    values: list[Value]


class _Amount(Section):
    amount: Value


class _Relief(Section):
    amount: Value
    length: Value
    curve: Table | None = None


class _EndRelief(_Relief):
    side: Literal["both", "negative", "positive"] | None = None


class _TabulatedProfile(Section):
    position: list[float]
    amount: list[Value]
    coordinate: Literal["roll_length", "roll_angle"] | None = None
    method: Literal["linear", "cubic2", "monotonic"] | None = None


# `type` of a curve or modification -> its class in the library and its keys. The keys are the fields of the class.
CURVES: dict[str, tuple[type[microgeometry.AbstractCurve], type[Section]]] = {
    "linear": (microgeometry.Linear, _Plain),
    "parabolic": (microgeometry.Parabolic, _Plain),
    "parabolic_linear": (microgeometry.ParabolicLinear, _ParabolicLinearCurve),
    "power": (microgeometry.Power, _PowerCurve),
    "quadratic": (microgeometry.Quadratic, _ThreeCoefficients),
    "polynomial": (microgeometry.Polynomial, _PolynomialCurve),
    "sinusoidal": (microgeometry.Sinusoidal, _ThreeCoefficients),
    "spline": (microgeometry.Spline, _SplineCurve),
}
MODIFICATIONS: dict[str, tuple[type[microgeometry.AbstractModification], type[Section]]] = {
    "tip_relief": (microgeometry.TipRelief, _Relief),
    "root_relief": (microgeometry.RootRelief, _Relief),
    "profile_crowning": (microgeometry.ProfileCrowning, _Amount),
    "profile_slope": (microgeometry.ProfileSlope, _Amount),
    "lead_crowning": (microgeometry.LeadCrowning, _Amount),
    "lead_slope": (microgeometry.LeadSlope, _Amount),
    "end_relief": (microgeometry.EndRelief, _EndRelief),
    "tabulated_profile": (microgeometry.TabulatedProfile, _TabulatedProfile),
}
UNITS = {"amount": "um", "length": "mm"}  # of the keys that a variable can stand for; the others are pure numbers

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
