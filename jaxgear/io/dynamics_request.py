"""What the table [dynamics] of a design file asks for, and the quantities that need it."""

import dataclasses
from typing import Any

import numpy as np

from ..dynamics import DYNAMIC_QUANTITIES, Dynamics
from ..dynamics.run_up import SAMPLES
from ..metrics import Quantity
from .design_file import DesignFile
from .errors import DesignFileError, naming
from .schema_dynamics import DynamicsSection
from .template import part_of
from .variables import increasing

_QUICK_NUMBER = 24
_MINUTE = 60.0  # s


@dataclasses.dataclass(frozen=True)
class DynamicsRequest:
    """A study of the vibration over the speed, checked.

    Attributes:
        settings: speeds, and what vibrates.
        torques: on the pinion [N m], ascending.
        run_up: duration of a run-up [s]; None for none.
    """

    settings: Dynamics
    torques: tuple[float, ...]
    run_up: float | None = None


def dynamics_request(design: DesignFile, *, quick: bool = False) -> DynamicsRequest:
    """Checks what a design file says about its dynamics.

    Args:
        design: the design file.
        quick: few speeds, for a first look.

    Raises:
        DesignFileError: for anything that is wrong with it, in one line that names the file and the key.
    """
    with naming(design.path):
        section = design.dynamics
        if section is None:
            raise DesignFileError("dynamics", "missing; it says at which speeds the pair runs")
        factors = section.torque_factors
        if len(set(factors)) != len(factors):
            raise DesignFileError("dynamics.torque_factors", "must all be different")
        settings = _settings(design, section, _QUICK_NUMBER if quick else section.number)
        _check_run_up(settings, section.run_up)
        return DynamicsRequest(settings, tuple(factor * design.torque for factor in sorted(factors)), section.run_up)


def _check_run_up(settings: Dynamics, duration: float | None) -> None:
    """At least one mesh cycle for every sample."""
    if duration is None:
        return
    cycles = duration * float(settings.mesh_frequencies[0] + settings.mesh_frequencies[-1]) / 2
    if cycles < SAMPLES:
        raise DesignFileError("dynamics.run_up", f"{duration:g} s holds {cycles:.0f} mesh cycles, needs {SAMPLES}")


def dynamic_quantity(design: DesignFile, key: str, name: str) -> Quantity:
    """A dynamic quantity with the settings of the table [dynamics], which is there.

    Raises:
        DesignFileError: without a speed that the quantity needs.
    """
    assert design.dynamics is not None  # `quantity_named` has looked
    if DYNAMIC_QUANTITIES[name].at_speed and design.speed is None:
        raise DesignFileError(key, f'"{name}" needs load.speed; "worst_{name}" is that of all speeds of [dynamics]')
    return dynamics_of(design).quantity(name)


def dynamics_of(design: DesignFile) -> Dynamics:
    """The settings of the table [dynamics], which is there."""
    assert design.dynamics is not None
    return _settings(design, design.dynamics, design.dynamics.number)


def _settings(design: DesignFile, section: DynamicsSection, number: int) -> Dynamics:
    """The settings of the library."""
    low, high = _frequencies(design, section)
    part = part_of("dynamics", section, Dynamics)
    fields: dict[str, Any] = {**part.fields, "mesh_frequencies": np.linspace(low, high, number)}
    return dataclasses.replace(part, fields=fields).build({})


def _frequencies(design: DesignFile, section: DynamicsSection) -> tuple[float, float]:
    """Lowest and highest mesh frequency [Hz]."""
    given = [key for key in ("mesh_frequencies", "speeds") if getattr(section, key) is not None]
    if len(given) != 1:
        both = "mesh_frequencies and speeds are both given, must be one of them"
        missing = "needs mesh_frequencies [Hz] or speeds [rpm], the lowest and the highest of a range"
        raise DesignFileError("dynamics", both if given else missing)
    low, high = getattr(section, given[0])
    increasing(f"dynamics.{given[0]}[1]", low, high, unit=" Hz" if given == ["mesh_frequencies"] else " rpm")
    if given == ["mesh_frequencies"]:
        return low, high
    if any(free.key == "pinion.teeth" for free in design.open_case):
        raise DesignFileError("dynamics.speeds", "cannot be with pinion.teeth a variable: give mesh_frequencies")
    per_turn = float(design.pair().pinion.teeth) / _MINUTE
    return low * per_turn, high * per_turn
