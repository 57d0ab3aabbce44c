"""The tables [dynamics], [wear], [lubricant] and [strength] of a design file; the last two may stand in files."""

import dataclasses

import numpy as np

from ..conditions import LoadSpectrum
from ..dynamics import Dynamics
from ..dynamics.motion import SAMPLES
from ..dynamics.settings import AT_SPEED
from ..metrics import Lubricant, Quantity, Strength
from ..numerics import Number
from ..wear import Wear
from .design_file import DesignFile
from .errors import DesignFileError
from .table_keys import entry, section_of, template_of
from .tables import FILE, FurtherTable, SettingsTable
from .value_types import WEIGHTS, choice, count, list_of, outside, positive
from .variables import increasing


class DynamicsSection(FurtherTable, section_of(Dynamics, ("mesh_frequencies",), open=False)):  # type: ignore[misc]
    """At which speeds the pair runs, and what vibrates; for `jaxgear dynamics` and for the quantities that need it.

    Attributes:
        mesh_frequencies: lowest and highest frequency of the mesh; either these or `speeds`.
        speeds: lowest and highest speed of the pinion.
        number: number of speeds, at equal steps.
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
            number: number of speeds; None for that of the table.

        Raises:
            DesignFileError: for speeds that are no range, and a run-up of less than a mesh cycle for every sample.
        """
        frequencies = np.linspace(*_frequencies(design, self), number or self.number)
        settings = template_of(self, Dynamics).having(mesh_frequencies=frequencies).build({})
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


class WearSection(FurtherTable, section_of(Wear, ("dynamics", "loads"), open=False)):  # type: ignore[misc]
    """How long the pair runs, and how fast it wears; for `jaxgear wear` and for the quantities that need it.

    Attributes:
        line_load: line load that wears the flanks; "dynamic" is that of the steady motion, which needs the table
            [dynamics] and load.speed.
        largest_increment: wear depth per block of `jaxgear wear`, exceeded by at most a tenth; blocks of equal length
            without it. Quantities and the search over the life take `blocks` in any case.
        torques: torques on the pinion, of a load spectrum that wears one flank; the load of the file without it.
        weights: shares of the revolutions at every torque; equal shares without it.
        speeds: speeds of the pinion at every torque; that of the file without it.
    """

    table = "wear"
    drive_only = True

    line_load: str = entry(choice("static", "dynamic"), "static")
    torques: list[float] | None = entry(list_of(positive("N m")))
    weights: list[float] | None = entry(WEIGHTS)
    speeds: list[float] | None = entry(list_of(positive("rpm")))

    def check(self, design: DesignFile) -> None:
        """Refuses a spectrum, dynamics or a load that do not go together."""
        self.settings(design)

    def quantity(self, design: DesignFile, key: str, quantity: Quantity) -> Quantity:
        """Quantity with the settings of [wear]; needs `blocks`, which are of equal length."""
        if self.largest_increment is not None and self.blocks is None:
            problem = (
                f'missing, "{quantity.name}" needs it: wear.largest_increment is for the lives of `jaxgear wear` alone'
            )
            raise DesignFileError("wear.blocks", problem)
        settings = self.settings(design, vibrates=quantity.needs == "dynamics")
        return quantity.with_settings(dataclasses.replace(settings, largest_increment=None))

    def settings(self, design: DesignFile, *, vibrates: bool = False) -> Wear:
        """The settings that the table stands for.

        Args:
            design: the design file.
            vibrates: True if the motion counts under a static line load too.
        """
        part = template_of(self, Wear)
        if vibrates or self.line_load == "dynamic":
            speed = design.speed if self.speeds is None else self.speeds
            for known, name in ((design.tables.get("dynamics"), "the table [dynamics]"), (speed, "load.speed")):
                if known is None:
                    raise DesignFileError("wear.line_load", f'"dynamic" needs {name}')
            part = part.having(dynamics=design.tables["dynamics"].settings(design), line_load=self.line_load)
        return dataclasses.replace(part.build({}), loads=_loads(design, self))


def _loads(design: DesignFile, section: WearSection) -> LoadSpectrum | None:
    """The spectrum of the table; None where it names no torques."""
    load = design.spectrum(section)
    if section.torques is None:
        return None
    own = ("load.torque", *(["load.speed"] if section.speeds is not None else []))
    for free in design.open_case:
        if free.key.startswith("load.") and free.key not in own:
            raise DesignFileError("wear.torques", f'{free.key} is the variable "{free.name}", which they do not follow')
    return load


# that only a rating after ISO/TS 6336-20, -21 and -22 counts
_OF_RATING = (
    *("fzg_stage", "structure_factor", "run_in", "micropitting_test", "micropitting_test_film"),
    *("pinion_immersion", "wheel_immersion", "splash_factor", "oil_volume"),
)
_SPEED = Number("rpm", low=0.0, open_low=True)


class LubricantSection(SettingsTable, section_of(Lubricant, open=False)):  # type: ignore[misc]
    """The oil, for friction, temperatures, film and scuffing; needs a load.speed greater than 0."""

    table = "lubricant"

    def check(self, design: DesignFile) -> None:
        """Refuses a lubricant without motion, its friction beside that of the load, and keys that rate nothing."""
        if "rating" not in design.tables:
            for name in _OF_RATING:
                if getattr(self, name) is not None:
                    raise DesignFileError(f"lubricant.{name}", "has no effect without [rating]")
        key, slowest = "load.speed", design.speed
        if slowest is None:
            raise DesignFileError("lubricant", "has no effect without load.speed")
        for free in design.open_case:
            if free.key == key:
                key, slowest = f"variables.{free.name}.low", design.bounds[free.name][0]
        if too_slow := outside(_SPEED, slowest):
            raise DesignFileError(key, f"{too_slow} with [lubricant]: no film without motion")
        if design.friction is not None:
            for name in ("friction", "friction_factor"):
                if getattr(self, name) is not None:
                    raise DesignFileError(f"lubricant.{name}", "has no effect beside load.friction")


class StrengthSection(SettingsTable, section_of(Strength, open=False)):  # type: ignore[misc]
    """Permissible stresses, for the safety factors."""

    table = "strength"

    def check(self, design: DesignFile) -> None:
        """Refuses a table without any stress."""
        if not self.fields.keys() - {FILE}:
            raise DesignFileError("strength", "is empty; it gives the permissible stresses")
        if not self.fields.keys() - {FILE, "load_factor"}:
            raise DesignFileError("strength.load_factor", "has no effect without permissible stresses")
