"""The table [wear] of a design file."""

import dataclasses

from ..conditions import LoadSpectrum
from ..metrics import Quantity
from ..wear import Wear
from .design_file import DesignFile
from .dynamics_table import dynamics_of
from .errors import DesignFileError, naming
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

    line_load: str = entry(choice("static", "dynamic"), "static")
    largest_increment: float | None = entry(positive("um"))
    torques: list[float] | None = entry(list_of(positive("N m")))
    weights: list[float] | None = entry(WEIGHTS)
    speeds: list[float] | None = entry(list_of(positive("rpm")))

    def check(self, design: DesignFile) -> None:
        """As a study of all commands does."""
        wear_request(design)

    def quantity(self, design: DesignFile, key: str, quantity: Quantity) -> Quantity:
        """Quantity with the settings of [wear]; needs `blocks`, which are of equal length."""
        if self.largest_increment is not None and self.blocks is None:
            problem = (
                f'missing, "{quantity.name}" needs it: wear.largest_increment is for the lives of `jaxgear wear` alone'
            )
            raise DesignFileError("wear.blocks", problem)
        vibrates = quantity.needs == "dynamics" or self.line_load == "dynamic"
        return quantity.with_settings(wear_of(design, vibrates=vibrates))


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
        section = design.needed("wear", "it says for how long the pair runs and how it wears")
        settings = wear_of(design, vibrates=section.line_load == "dynamic")
        if quick:
            return WearRequest(dataclasses.replace(settings, blocks=_QUICK_BLOCKS), None)
        return WearRequest(settings, section.largest_increment)


def wear_of(design: DesignFile, *, vibrates: bool) -> Wear:
    """The settings of the table [wear], which the file has.

    Args:
        design: the design file.
        vibrates: the motion counts; otherwise flanks wear under the static load.
    """
    section = design.tables["wear"]
    part = part_of(section, Wear)
    if vibrates:
        speed = design.speed if section.speeds is None else section.speeds
        for known, name in ((design.tables.get("dynamics"), "the table [dynamics]"), (speed, "load.speed")):
            if known is None:
                raise DesignFileError("wear.line_load", f'"dynamic" needs {name}')
        part = part.having(dynamics=dynamics_of(design), line_load=section.line_load)
    return dataclasses.replace(part.build({}), loads=_loads(design, section))


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
