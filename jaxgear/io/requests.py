"""What the tables [dynamics], [wear] and [tolerance] of a design file ask for."""

import dataclasses
from typing import Any

import numpy as np

from ..conditions import LoadSpectrum
from ..dynamics import Dynamics
from ..dynamics.motion import SAMPLES
from ..tolerance import Tolerance, ToleranceClass
from ..wear import Wear
from .design_file import DesignFile
from .errors import DesignFileError, naming, problem, refuse_given, refused
from .schema import DynamicsSection, OptimizeSection, SweepSection, WearSection
from .template import part_of
from .variables import increasing


def load_of(design: DesignFile, table: str, section: OptimizeSection | SweepSection) -> LoadSpectrum:
    """The load spectrum of a table; the design torque where it names no torques."""
    if section.torques is None:
        refuse_given(table, section, ["weights"], f" without {table}.torques")
    return spectrum(design, table, section.torques or [design.torque], section.weights)


def spectrum(
    design: DesignFile,
    table: str,
    torques: list[float],
    weights: list[float] | None,
    speeds: list[float] | None = None,
) -> LoadSpectrum:
    """The load spectrum of keys of a table, at the speed of the file where it has no speeds of its own."""
    run_at = {"speeds": design.speed if speeds is None else speeds, "friction": design.friction}
    load = refused(f"{table}.{'torques' if speeds is None else 'speeds'}", LoadSpectrum, torques, **run_at)
    return load if weights is None else refused(f"{table}.weights", LoadSpectrum, torques, weights, **run_at)


def quality_classes(design: DesignFile) -> tuple[ToleranceClass, ToleranceClass] | None:
    """The flank tolerances of pinion and wheel where the file names their classes."""
    if design.quality_classes is None:
        return None
    first, second = design.quality_classes
    return _class_of(design, "pinion", first), _class_of(design, "wheel", second)


def _class_of(design: DesignFile, name: str, quality: int) -> ToleranceClass:
    gear = getattr(design.pair(), name)
    try:
        return ToleranceClass.of(gear, quality)
    except ValueError as error:
        field, _, text = problem(error).partition(" = ")
        key, text = (f"{name}.{field}", text) if hasattr(gear, field) else (name, problem(error))
        raise DesignFileError(key, f"{text} for tolerances of ISO 1328-1") from None


def tolerance_of(design: DesignFile) -> Tolerance | None:
    """The tolerance of the table [tolerance] if there is one; without lead deviations on a mesh of one slice."""
    section = design.tolerance
    if section is None:
        return None
    quality_classes(design)  # which names the gear that no class is made for
    given = {"quality_class": section.quality_class, "misalignment": section.misalignment}
    tolerance = refused("tolerance", Tolerance.from_class, design.pair(), **given)
    if design.resolution().slices > 1:
        return tolerance
    if section.misalignment is not None:
        needed = "needs resolution.slices of at least 2, one slice cannot show it"
        raise DesignFileError("tolerance.misalignment", needed)
    return tolerance.without_lead()


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
        settings = _dynamics_settings(design, section, _QUICK_NUMBER if quick else section.number)
        _check_run_up(settings, section.run_up)
        return DynamicsRequest(settings, tuple(factor * design.torque for factor in sorted(factors)), section.run_up)


def _check_run_up(settings: Dynamics, duration: float | None) -> None:
    """At least one mesh cycle for every sample."""
    if duration is None:
        return
    cycles = duration * float(settings.mesh_frequencies[0] + settings.mesh_frequencies[-1]) / 2
    if cycles < SAMPLES:
        raise DesignFileError("dynamics.run_up", f"{duration:g} s holds {cycles:.0f} mesh cycles, needs {SAMPLES}")


def dynamics_of(design: DesignFile) -> Dynamics:
    """The settings of the table [dynamics], which is there."""
    assert design.dynamics is not None
    return _dynamics_settings(design, design.dynamics, design.dynamics.number)


def _dynamics_settings(design: DesignFile, section: DynamicsSection, number: int) -> Dynamics:
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


_QUICK_BLOCKS = 4


@dataclasses.dataclass(frozen=True)
class WearRequest:
    """A study of wear over the life, checked.

    Attributes:
        settings: revolutions and coefficients.
        largest_increment: depth that a block wears off [um]; None for blocks of equal length.
    """

    settings: Wear
    largest_increment: float | None


def wear_request(design: DesignFile, *, quick: bool = False) -> WearRequest:
    """Checks what a design file says about its wear.

    Args:
        design: the design file.
        quick: few blocks, for a first look.

    Raises:
        DesignFileError: for anything that is wrong with it, in one line that names the file and the key.
    """
    with naming(design.path):
        section = design.wear
        if section is None:
            raise DesignFileError("wear", "missing; it says for how long the pair runs and how it wears")
        settings = _wear_settings(design, vibrates=section.line_load == "dynamic")
        if quick:
            return WearRequest(dataclasses.replace(settings, blocks=_QUICK_BLOCKS), None)
        return WearRequest(settings, section.largest_increment)


def _wear_settings(design: DesignFile, *, vibrates: bool) -> Wear:
    """The settings of the library: flanks wear under the static load unless the file says otherwise."""
    section = design.wear
    assert section is not None
    part = part_of("wear", section, Wear)
    if vibrates:
        speed = design.speed if section.speeds is None else section.speeds
        for known, name in ((design.dynamics, "the table [dynamics]"), (speed, "load.speed")):
            if known is None:
                raise DesignFileError("wear.line_load", f'"dynamic" needs {name}')
        fields = {**part.fields, "dynamics": dynamics_of(design), "line_load": section.line_load}
        part = dataclasses.replace(part, fields=fields)
    return dataclasses.replace(part.build({}), loads=_loads(design, section))


def _loads(design: DesignFile, section: WearSection) -> LoadSpectrum | None:
    """The spectrum of the table; None where it names no torques."""
    if section.torques is None:
        refuse_given("wear", section, ["weights", "speeds"], " without wear.torques")
        return None
    own = ("load.torque", *(["load.speed"] if section.speeds is not None else []))
    for free in design.open_case:
        if free.key.startswith("load.") and free.key not in own:
            raise DesignFileError("wear.torques", f'{free.key} is the variable "{free.name}", which they do not follow')
    return spectrum(design, "wear", section.torques, section.weights, section.speeds)
