"""The table [dynamics] of a design file."""

import dataclasses

import numpy as np

from ..dynamics import Dynamics
from ..dynamics.motion import SAMPLES
from ..dynamics.quantities import AT_SPEED
from ..metrics import Quantity
from .design_file import DesignFile
from .errors import DesignFileError, naming
from .table_keys import entry, part_of, section_of
from .tables import FurtherTable
from .value_types import count, list_of, positive
from .variables import increasing


class DynamicsSection(FurtherTable, section_of(Dynamics, ("mesh_frequencies",), open=False)):  # type: ignore[misc]
    """At which speeds the pair runs, and what vibrates; for `jaxgear dynamics` and for the quantities that need it.

    Attributes:
        mesh_frequencies: lowest and highest frequency of the mesh; either these or `speeds`.
        speeds: lowest and highest speed of the pinion.
        number: of speeds, at equal steps.
        torque_factors: torques of `jaxgear dynamics`, in design torques; 0.5, 1 and 2 without it.
        run_up: duration of a change of speed from the lowest to the highest in `jaxgear dynamics`, at constant
            acceleration; no run-up without it.
    """

    mesh_frequencies: list[float] | None = entry(list_of(positive("Hz"), length=2))
    speeds: list[float] | None = entry(list_of(positive("rpm"), length=2))
    number: int = entry(count(2, 10_000), 100)
    torque_factors: list[float] = entry(list_of(positive("")), [0.5, 1.0, 2.0])
    run_up: float | None = entry(positive("s"))

    def check(self, design: DesignFile) -> None:
        """As a study of all commands does."""
        dynamics_request(design)

    def quantity(self, design: DesignFile, key: str, quantity: Quantity) -> Quantity:
        """Quantity with the settings of [dynamics]; a quantity of one speed needs load.speed."""
        name = quantity.name
        if name in AT_SPEED and design.speed is None:
            raise DesignFileError(key, f'"{name}" needs load.speed; "worst_{name}" is that of all speeds of [dynamics]')
        return quantity.with_settings(dynamics_of(design))


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
        section = design.needed("dynamics", "it says at which speeds the pair runs")
        factors = section.torque_factors
        if len(set(factors)) != len(factors):
            raise DesignFileError("dynamics.torque_factors", "must all be different")
        settings = dynamics_of(design, _QUICK_NUMBER if quick else None)
        _check_run_up(settings, section.run_up)
        return DynamicsRequest(settings, tuple(factor * design.torque for factor in sorted(factors)), section.run_up)


def _check_run_up(settings: Dynamics, duration: float | None) -> None:
    """At least one mesh cycle for every sample."""
    if duration is None:
        return
    cycles = duration * float(settings.mesh_frequencies[0] + settings.mesh_frequencies[-1]) / 2
    if cycles < SAMPLES:
        raise DesignFileError("dynamics.run_up", f"{duration:g} s holds {cycles:.0f} mesh cycles, needs {SAMPLES}")


def dynamics_of(design: DesignFile, number: int | None = None) -> Dynamics:
    """The settings of the table [dynamics], which the file has, at a number of speeds; None for that of the file."""
    section = design.tables["dynamics"]
    frequencies = np.linspace(*_frequencies(design, section), number or section.number)
    return part_of(section, Dynamics).having(mesh_frequencies=frequencies).build({})


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
