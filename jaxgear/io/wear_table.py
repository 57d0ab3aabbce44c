"""The table [wear] of a design file."""

import dataclasses

from ..conditions import LoadSpectrum
from ..metrics import Quantity
from ..wear import Wear
from .design_file import DesignFile
from .errors import DesignFileError
from .table_keys import entry, part_of, section_of
from .tables import FurtherTable
from .value_types import WEIGHTS, choice, list_of, positive


class WearSection(FurtherTable, section_of(Wear, ("dynamics", "loads"), open=False)):  # type: ignore[misc]
    """How long the pair runs, and how fast it wears; for `jaxgear wear` and for the quantities that need it.

    Attributes:
        line_load: line load that wears the flanks; "dynamic" is that of the steady motion, which needs the table
            [dynamics] and load.speed.
        largest_increment: wear depth per block of `jaxgear wear`, exceeded by at most a tenth; blocks of equal length
            without it. Quantities and the search over the life take `blocks` in any case.
        torques: on the pinion, of a load spectrum that wears one flank; the load of the file without it.
        weights: shares of the revolutions at every torque; equal shares without it.
        speeds: of the pinion at every torque; that of the file without it.
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
        part = part_of(self, Wear)
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
