"""The table `[optimize]` of a design file, its limits, and the options of the methods."""

import inspect
from typing import Annotated, Any

from pydantic import create_model

from ..numerics import Number
from ..optimize import METHODS, Pareto
from .kinds import LEVEL, SEED, WEIGHTS, choice, count, either, list_of, positive, real, switch, table, text
from .layout import Section, section_of

Tables = dict[str, Any]

_NUMBER = real()
_NAMES = either(text(), list_of(text()), "a string or a list of strings")
_SHARE = real(Number(low=0.0, high=1.0, open_low=True, open_high=True))
_TABLES = list_of(table(), empty=True)


class OptimizeSection(Section):
    """A search for the best values of the variables, or for flanks without any.

    Attributes:
        method: name of the method; "slp" without it.
        objective: a quantity to be made small, or large where that is better; several for "pareto"; "ppte" without it.
        measure: joins the cases of several torques or manufactured gears into one number; "mean" without it.
        level: of the measures "quantile" and "cvar".
        torques: on the pinion; the design torque alone without it.
        weights: of the torques.
        manufactured: pairs of manufactured gears under every torque; needs [tolerance].
        seed: of random searches and of the manufactured gears.
        starts: searches, of methods "slp", "adam" and "lbfgs".
        steps: most steps of every search, of the same methods.
        application_factor: K_A of the rule-based relief.
        verify: whether the designs are evaluated with the finite-element structure too; without it they are where the
            gears can be meshed. A quick run never does.
        constraint: limits of quantities or of combinations of variables.
    """

    method: Annotated[str | None, text()] = None
    objective: Annotated[str | list[str] | None, _NAMES] = None
    measure: Annotated[str | None, choice("mean", "worst", "quantile", "cvar")] = None
    level: Annotated[float | None, _SHARE] = None
    torques: Annotated[list[float] | None, list_of(positive("N m"))] = None
    weights: Annotated[list[float] | None, WEIGHTS] = None
    manufactured: Annotated[int | None, count(1, 10_000)] = None
    seed: Annotated[int | None, SEED] = None
    starts: Annotated[int | None, count(1, 4096)] = None
    steps: Annotated[int | None, count(10, 100_000)] = None
    application_factor: Annotated[float, real(Number(low=0.0, high=100.0, open_low=True))] = 1.0
    verify: Annotated[bool | None, switch()] = None
    constraint: Annotated[list[Tables], _TABLES] = []


class ConstraintSection(Section):
    """A limit, of either a quantity or a linear combination of variables.

    Attributes:
        of: name of a quantity.
        variables: coefficient of every variable of the combination.
        low: least value.
        high: greatest value.
    """

    of: Annotated[str | None, text()] = None
    variables: Annotated[dict[str, float] | None, table(_NUMBER)] = None
    low: Annotated[float | None, real(plausible=False)] = None
    high: Annotated[float | None, real(plausible=False)] = None


class FactorialOptions(Section):
    levels: Annotated[
        int | dict[str, int] | None,
        either(LEVEL, table(LEVEL), "a whole number, or a table with one entry per variable"),
    ] = None


class IterationOptions(Section):
    start: Annotated[str, choice("unmodified", "given", "low_pressure")] = "unmodified"
    max_relief: Annotated[float, positive("um")] = 7.0
    max_pressure: Annotated[float | None, positive("MPa")] = None
    rtol: Annotated[float | None, positive("")] = None
    steps: Annotated[int | None, count(1, 1000)] = None
    curve: Annotated[str | None, text()] = None


class FreeFormOptions(Section):
    points: Annotated[int | None, count(4, 500)] = None
    max_relief: Annotated[float | None, positive("um")] = None
    curvature: Annotated[float | None, real(Number(low=0.0))] = None
    steps: Annotated[int | None, count(1, 10_000)] = None
    curve: Annotated[str | None, text()] = None


# They seek the flanks themselves.
METHODS_WITHOUT_VARIABLES = ("te_iteration", "free_form")


def method_options() -> dict[str, type[Section]]:
    """The tables [optimize.<method>] of the methods that have one, of a user's own too: the fields of their classes."""
    found = {name: section_of(cls, ("starts", "steps", "seed"), open=False) for name, cls in METHODS.items()}
    found |= {"factorial": FactorialOptions, "pareto": section_of(Pareto)}
    found |= {"te_iteration": IterationOptions, "free_form": FreeFormOptions}
    return {name: section for name, section in found.items() if section.model_fields}


def optimize_section() -> type[OptimizeSection]:
    """The table [optimize] with those of the methods."""
    methods = method_options()
    texts = "".join(f"\n    {name}: options of the method." for name in methods)
    tables: dict[str, Any] = {name: (Annotated[Tables | None, table()], None) for name in methods}
    text = inspect.cleandoc(OptimizeSection.__doc__ or "") + texts  # Python 3.13 removes the indentation by itself
    return create_model("OptimizeSection", __base__=OptimizeSection, __doc__=text, **tables)
