"""The names of quantities in a design file, some of which need one of its tables."""

from collections.abc import Iterator

from ..dynamics import DYNAMIC_QUANTITIES
from ..metrics import Quantity, quantities
from ..metrics.settings import WithoutSettings, without_settings
from ..wear import WEAR_QUANTITIES
from .design_file import DesignFile
from .dynamics import dynamics_of
from .errors import DesignFileError, check_known
from .wear import wear_of


def quantity_named(design: DesignFile, key: str, name: str) -> str | Quantity:
    """What a name of the vocabulary means in a design file: some quantities come with settings of one of its tables.

    Args:
        design: the design file.
        key: where the name stands.
        name: in either spelling.

    Raises:
        DesignFileError: for an unknown name, and for one that needs a table or a key that the file does not have.
    """
    check_known(key, name, quantities)
    plain = quantities[name].name
    stands = without_settings(quantities[plain])
    if stands is None:
        return name
    missing = _missing(design, stands)
    if missing:
        raise DesignFileError(key, f'"{plain}" needs {missing}')
    if plain in DYNAMIC_QUANTITIES:
        return dynamic_quantity(design, key, plain)
    if plain in WEAR_QUANTITIES:
        return wear_quantity(design, plain)
    settings = design.tables.get(stands.table)
    return name if settings is None else settings.quantity(plain)


def quantities_of_tables(design: DesignFile) -> Iterator[Quantity]:
    """All quantities that need a speed, a lubricant or strengths, as far as a design file tells what they need."""
    for name, quantity in quantities.items():
        stands = without_settings(quantity)
        if stands is None or stands.of is None or _missing(design, stands):
            continue
        settings = design.tables.get(stands.table)
        yield quantity if settings is None else settings.quantity(name)


def _missing(design: DesignFile, stands: WithoutSettings) -> str:
    """What a design file lacks for a quantity of one of its tables; "" for nothing."""
    settings = design.tables.get(stands.table)
    if stands.needs == "dynamics":  # which other settings hold, and a file has a table for
        for known, name in (
            (settings, f"the table [{stands.table}]"),
            (design.tables.get("dynamics"), "the table [dynamics]"),
        ):
            if known is None:
                return name
        speeds = getattr(design.tables.get("wear"), "speeds", None)  # the only such settings that have their own
        return "" if design.speed is not None or speeds else "load.speed"
    if settings is not None:
        unset = stands.needs is not None and getattr(settings, stands.needs) is None
        return f"{stands.table}.{stands.needs}" if unset else ""
    if stands.otherwise is None:
        return f"the table [{stands.table}]"
    for name in stands.operating_point:
        if getattr(design, name) is None:
            return f"load.{name}" + (f" or the table [{stands.table}]" if name != "speed" else "")
    return ""


def dynamic_quantity(design: DesignFile, key: str, name: str) -> Quantity:
    """A dynamic quantity with the settings of the table [dynamics], which is there.

    Raises:
        DesignFileError: without a speed that the quantity needs.
    """
    if DYNAMIC_QUANTITIES[name].at_speed and design.speed is None:
        raise DesignFileError(key, f'"{name}" needs load.speed; "worst_{name}" is that of all speeds of [dynamics]')
    return dynamics_of(design).quantity(name)


def wear_quantity(design: DesignFile, name: str) -> Quantity:
    """A quantity of worn flanks with the settings of the table [wear], which has what the quantity needs."""
    section = design.tables["wear"]  # `quantity_named` has looked
    if section.largest_increment is not None and section.blocks is None:
        problem = f'missing, "{name}" needs it: wear.largest_increment is for the lives of `jaxgear wear` alone'
        raise DesignFileError("wear.blocks", problem)
    vibrates = WEAR_QUANTITIES[name].needs == "dynamics" or section.line_load == "dynamic"
    return wear_of(design, vibrates=vibrates).quantity(name)
