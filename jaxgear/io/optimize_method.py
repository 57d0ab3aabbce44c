"""Methods of a search and their options in the table [optimize] of a design file."""

import dataclasses
from collections.abc import Mapping
from typing import Any

from ..optimize import METHODS, Pareto
from ..optimize.projection import CURVES
from . import schema_optimize
from .design_file import DesignFile
from .errors import DesignFileError, check_known, refuse_given, refused
from .layout import Section
from .toml import decode

CURVE = "cubic"  # on which flanks without parameters are projected
PARETO = "pareto"


def check_method(name: str) -> None:
    """Refuses a name that is no method."""
    check_known("optimize.method", name, (*METHODS, PARETO, *schema_optimize.METHODS_WITHOUT_VARIABLES))


def made_by(name: str) -> type[Any]:
    """The class of a method with variables."""
    return Pareto if name == PARETO else METHODS[name]


def check_options(design: DesignFile, name: str, options: Mapping[str, Any]) -> None:
    """Whether a method with variables can be made of its options, and a method without them of its curve."""
    if name in schema_optimize.METHODS_WITHOUT_VARIABLES:
        check_known(f"optimize.{name}.curve", options.get("curve", CURVE), CURVES)
        return
    levels = options.get("levels")
    if isinstance(levels, dict) and set(levels) != set(design.bounds):
        problem = f"must name all variables and nothing else: {', '.join(design.bounds)}"
        raise DesignFileError("optimize.factorial.levels", problem)
    refused(f"optimize.{name}", made_by(name), **options)


def tables(section: schema_optimize.OptimizeSection) -> dict[str, Section]:
    """The tables of all methods, decoded."""
    layouts = schema_optimize.method_options().items()
    return {key: decode(f"optimize.{key}", getattr(section, key) or {}, layout) for key, layout in layouts}


def options_of(section: schema_optimize.OptimizeSection, name: str, *, of_the_file: bool) -> dict[str, Any]:
    """The options of a method; the file may name others where it is not the file that asks for the method."""
    options = {key: value for key, value in tables(section).get(name, ()) if value is not None}
    shared = {"starts": section.starts, "steps": section.steps, "seed": section.seed or 0}
    taken = {field.name for field in dataclasses.fields(METHODS[name])} if name in METHODS else set()
    if of_the_file:
        why = f' with method "{name}"'
        refuse_given("optimize", section, [key for key in ("starts", "steps") if key not in taken], why)
        if "seed" not in taken and section.manufactured is None:
            refuse_given("optimize", section, ["seed"], f"{why} and nominal gears")
    return options | {key: value for key, value in shared.items() if key in taken and value is not None}
