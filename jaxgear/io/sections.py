"""Tables of a design file that make sense by themselves, or beside one other."""

from typing import Any, TypeVar

from pydantic import BaseModel

from . import schema, schema_optimize, schema_sweep
from .errors import DesignFileError
from .gears import with_quality
from .schema_optimize import METHODS_WITHOUT_VARIABLES
from .stiffness import FINITE_ELEMENTS
from .toml import decode
from .variables import increasing

S = TypeVar("S", bound=BaseModel)


def optional(name: str, table: schema.Tables | None, section: type[S]) -> S | None:
    """What a table says; None where the file has none of that name."""
    return None if table is None else decode(name, table, section)


def load_of(table: schema.Tables) -> schema.LoadSection:
    """Of what the gears carry."""
    load = decode("load", table, schema.LoadSection)
    if load.torque_range is not None:
        low, high = load.torque_range
        increasing("load.torque_range[1]", low, high, unit=" N m")
    return load


def optimize_of(top: schema.FileSection, stiffness: schema.ModelSection) -> Any:
    """The search, with its defaults where the file has no such table."""
    optimize = decode("optimize", top.optimize or {}, schema_optimize.optimize_section())
    if top.optimize is not None and not top.variables and optimize.method not in METHODS_WITHOUT_VARIABLES:
        raise DesignFileError("optimize", "has no effect without [variables]")
    if optimize.verify and stiffness.structure == FINITE_ELEMENTS:
        raise DesignFileError("optimize.verify", f'has no effect with model.structure = "{FINITE_ELEMENTS}"')
    return optimize


def sweep_of(top: schema.FileSection) -> schema_sweep.SweepSection | None:
    """Variants to be evaluated; None without such a table."""
    if top.sweep is not None and not top.variables:
        raise DesignFileError("sweep", "has no effect without [variables]")
    return optional("sweep", top.sweep, schema_sweep.SweepSection)


def tolerance_of(top: schema.FileSection, quality: Any) -> schema_sweep.ToleranceSection | None:
    """Deviations of manufactured gears, by the quality classes of the gears where it names none; None without it."""
    tolerance = optional("tolerance", top.tolerance, schema_sweep.ToleranceSection)
    return None if tolerance is None else with_quality("tolerance", tolerance, quality)
