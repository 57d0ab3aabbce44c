"""What the table [wear] of a design file asks for, and the quantities that need it."""

import dataclasses

from ..conditions import LoadSpectrum
from ..metrics import Quantity
from ..wear import WEAR_QUANTITIES, Wear
from .cases import spectrum
from .design_file import DesignFile
from .dynamics_request import dynamics_of
from .errors import DesignFileError, naming, refuse_given
from .schema_wear import WearSection
from .template import part_of

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
        settings = _settings(design, vibrates=section.line_load == "dynamic")
        if quick:
            return WearRequest(dataclasses.replace(settings, blocks=_QUICK_BLOCKS), None)
        return WearRequest(settings, section.largest_increment)


def wear_quantity(design: DesignFile, name: str) -> Quantity:
    """A quantity of worn flanks with the settings of the table [wear], which has what the quantity needs."""
    section = design.wear
    assert section is not None  # `quantity_named` has looked
    if section.largest_increment is not None and section.blocks is None:
        problem = f'missing, "{name}" needs it: wear.largest_increment is for the lives of `jaxgear wear` alone'
        raise DesignFileError("wear.blocks", problem)
    vibrates = WEAR_QUANTITIES[name].needs == "dynamics" or section.line_load == "dynamic"
    return _settings(design, vibrates=vibrates).quantity(name)


def _settings(design: DesignFile, *, vibrates: bool) -> Wear:
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
