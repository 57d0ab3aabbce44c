"""The table [dynamics] of a design file."""

import numpy as np

from ..dynamics import Dynamics
from ..dynamics.motion import SAMPLES
from ..dynamics.quantities import AT_SPEED
from ..metrics import Quantity
from .design_file import DesignFile
from .errors import DesignFileError
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

    table = "dynamics"
    drive_only = True

    mesh_frequencies: list[float] | None = entry(list_of(positive("Hz"), length=2))
    speeds: list[float] | None = entry(list_of(positive("rpm"), length=2))
    number: int = entry(count(2, 10_000), 100)
    torque_factors: list[float] = entry(list_of(positive("")), [0.5, 1.0, 2.0])
    run_up: float | None = entry(positive("s"))

    def check(self, design: DesignFile) -> None:
        """Refuses speeds, torques or a run-up that do not go together."""
        self.torques(design)
        self.settings(design)

    def quantity(self, design: DesignFile, key: str, quantity: Quantity) -> Quantity:
        """Quantity with the settings of [dynamics]; a quantity of one speed needs load.speed."""
        name = quantity.name
        if name in AT_SPEED and design.speed is None:
            raise DesignFileError(key, f'"{name}" needs load.speed; "worst_{name}" is that of all speeds of [dynamics]')
        return quantity.with_settings(self.settings(design))

    def settings(self, design: DesignFile, number: int | None = None) -> Dynamics:
        """The settings that the table stands for.

        Args:
            design: the design file.
            number: of speeds; None for that of the table.

        Raises:
            DesignFileError: for speeds that are no range, and a run-up of less than a mesh cycle for every sample.
        """
        frequencies = np.linspace(*_frequencies(design, self), number or self.number)
        settings = part_of(self, Dynamics).having(mesh_frequencies=frequencies).build({})
        if self.run_up is not None:
            cycles = self.run_up * float(settings.mesh_frequencies[0] + settings.mesh_frequencies[-1]) / 2
            if cycles < SAMPLES:
                problem = f"{self.run_up:g} s holds {cycles:.0f} mesh cycles, needs {SAMPLES}"
                raise DesignFileError("dynamics.run_up", problem)
        return settings

    def torques(self, design: DesignFile) -> tuple[float, ...]:
        """Torques of a study on the pinion [N m], ascending."""
        factors = self.torque_factors
        if len(set(factors)) != len(factors):
            raise DesignFileError("dynamics.torque_factors", "must all be different")
        return tuple(factor * design.torque for factor in sorted(factors))


_MINUTE = 60.0  # s


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
