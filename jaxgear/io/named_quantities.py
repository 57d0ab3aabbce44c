"""The names of quantities in a design file, some of which need one of its tables."""

from collections.abc import Iterator

from ..metrics import Quantity
from ..vocabulary import quantities
from .design_file import DesignFile
from .errors import DesignFileError, check_known
from .tables import FurtherTable


def quantity_named(design: DesignFile, key: str, name: str) -> str | Quantity:
    """Quantity of a vocabulary name, with settings from the table of the design file that it needs.

    Args:
        design: the design file.
        key: key that gives the name, for messages.
        name: name of the quantity, in either spelling.

    Raises:
        DesignFileError: for an unknown name, and for one that needs a table or a key that the file does not have.
    """
    check_known(key, name, quantities)
    every = quantities.every(name)
    if every[0].takes is None:
        return name
    lacks = [_missing(design, each) for each in every]
    if all(lacks):
        raise DesignFileError(key, f'"{every[0].name}" needs {" or ".join(lacks)}')
    quantity = every[lacks.index("")]
    assert quantity.takes is not None
    settings = design.tables.get(quantity.takes.table)
    if isinstance(settings, FurtherTable):
        return settings.quantity(design, key, quantity)
    return name if settings is None else quantity.with_settings(settings)


def quantities_of_tables(design: DesignFile) -> Iterator[Quantity]:
    """All quantities whose settings the design file gives, except those that need further solutions."""
    for quantity in (each for name in quantities for each in quantities.every(name)):
        if quantity.takes is None or _missing(design, quantity):
            continue
        settings = design.tables.get(quantity.takes.table)
        if isinstance(settings, FurtherTable):
            if quantity.name in settings.shown:
                yield settings.quantity(design, settings.table, quantity)
            continue
        yield quantity if settings is None else quantity.with_settings(settings)


def _missing(design: DesignFile, quantity: Quantity) -> str:
    """Table or key that a design file lacks for a quantity, "" for none."""
    assert quantity.takes is not None
    table, settings = quantity.takes.table, design.tables.get(quantity.takes.table)
    if quantity.needs == "dynamics":  # which other settings hold, and a file has a table for
        known = (settings, f"the table [{table}]"), (design.tables.get("dynamics"), "the table [dynamics]")
        for of, name in known:
            if of is None:
                return name
        speeds = getattr(design.tables.get("wear"), "speeds", None)  # the only such settings that have their own
        return "" if design.speed is not None or speeds else "load.speed"
    if settings is not None:
        unset = quantity.needs and getattr(settings, quantity.needs) is None
        return f"{table}.{quantity.needs}" if unset else ""
    if quantity.without is None:
        return f"the table [{table}]"
    for name in quantity.without:
        if getattr(design, name) is None:
            return f"load.{name}" + (f" or the table [{table}]" if name != "speed" else "")
    return ""
