"""The tables of a design file: those of every file, and further ones, each by a class that says its name.

A class with the attribute `table = "name"` is the table [name], and is known to design files without being listed: one
derived from `FurtherTable`, or a class of settings derived from `Checked`, of the library, of a user's own module, or
of an application (see `jaxgear.provided`). `DesignFile.tables["name"]` is then an object of it.
"""

import functools
import inspect
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, Self

from ..contact import MeshCycle, OperatingPoint
from ..geometry import GearPair
from ..metrics import Finding, Quantity
from ..microgeometry import AbstractModification
from ..numerics import Checked, Number
from ..provided import provided
from .errors import DesignFileError, join, referring
from .table_keys import FileTable, decode, descendants, entry, section_of, template_of
from .template import Free
from .toml import read
from .value_types import ValueType, list_of, positive, real, text

FILE = "file"  # key of a table that stands in a file of its own


def _either_side() -> ValueType:
    """A torque of either sign, but not zero; a variable stands for a positive one."""
    amount = real(Number("N m", low=0.0, open_low=True), open=True)

    def read(key: str, value: Any) -> Any:
        negative = isinstance(value, int | float) and value < 0
        return -amount.read(key, -value) if negative else amount.read(key, value)

    return ValueType(amount.words, read, Number("N m"))


class LoadSection(section_of(OperatingPoint)):  # type: ignore[misc]
    """Under what the pair runs.

    Attributes:
        torque: design torque on the pinion, not zero. A negative one is carried by the coast flanks, which analyze,
            optimize and sweep then take in place of the drive flanks, with the `coast_modification` of the gears where
            they have one; all other torques of the file are amounts.
        torque_range: lowest and highest torque of interest; half and twice the design torque without it.
        speed: speed of the pinion, for temperatures, film and loss.
        friction: mean coefficient of friction, for efficiency and, with a speed, loss and temperatures; in place of the
            law of [lubricant].
    """

    torque: float | Free = entry(_either_side(), ...)
    torque_range: list[float] | None = entry(list_of(positive("N m"), length=2))


class Whole(NamedTuple):
    """Gears and load of what a pair is a part of.

    Attributes:
        pairs: all its pairs, that of the file first.
        flanks: modifications of pinion and wheel of every pair.
        quality_classes: flank tolerance classes of pinion and wheel of every pair; None for a pair without.
        torque: torque on its driving member [N m].
        speed: speed of its driving member [rpm]; None for none.
    """

    pairs: tuple[GearPair, ...]
    flanks: tuple[tuple[AbstractModification, AbstractModification], ...]
    quality_classes: tuple[tuple[int, int] | None, ...]
    torque: float
    speed: float | None


class FurtherTable(FileTable):
    """A table that a file may have besides those of gears, load and model.

    Attributes:
        drive_only: True if the table knows the drive flanks alone; a file with a negative torque is refused then.
        classified: True if its `quality_class` is that of the gears where these have one, and required elsewhere.
        direction: sense of rotation of the first shaft, where the table has such a key.
        shown: names of the quantities of the table that every analysis of a design gives.
        called: what a file with the table calls tables of the pair, by the names that these have without it.
        whole: what the pair is a part of, in words, for studies of the pair alone; "" for a pair.
    """

    drive_only: ClassVar[bool] = False
    classified: ClassVar[bool] = False
    direction: str | None = None
    shown: ClassVar[tuple[str, ...]] = ()
    called: ClassVar[Mapping[str, str]] = {}
    whole: ClassVar[str] = ""

    @classmethod
    def read(cls, given: Mapping[str, Any], folder: Path) -> Self:
        """The table as it is in the file.

        Args:
            given: content of the table.
            folder: folder of the file, to which its paths are relative.

        Raises:
            DesignFileError: for anything that is wrong with it, in one line that names the key.
        """
        return decode(cls.table, given, cls)

    @classmethod
    def pair_content(cls, content: Mapping[str, Any]) -> Mapping[str, Any]:
        """Content of a file with the table as that of a file of a pair; by default the same."""
        return content

    def extended(self, design: Any, content: Mapping[str, Any]) -> Any:
        """The `DesignFile` of the pair with what the table adds; by default the same.

        Args:
            design: the `DesignFile` of `pair_content`.
            content: content of the file.
        """
        return design

    def whole_of(self, design: Any, parameters: Mapping[str, Any]) -> Whole:
        """All gears of the whole that the pair is a part of, for a table that says `whole`.

        Args:
            design: the `DesignFile`.
            parameters: value of every free parameter.
        """
        raise NotImplementedError(f"[{self.table}] is not about several pairs")

    @property
    def value(self) -> object:
        """The object that `DesignFile.tables` holds for the table, by default the table itself."""
        return self

    def check(self, design: Any) -> None:
        """Raises a `DesignFileError` where the table does not go together with the rest of a design file."""

    def varies_along_face(self) -> list[str]:
        """Names of what makes the load vary along the face, which needs several slices; by default nothing."""
        return []

    def findings(self, design: Any, cycle: MeshCycle) -> tuple[Finding, ...]:
        """Findings about a solved design by the numbers of the table; by default none.

        Args:
            design: the `DesignFile`.
            cycle: cycle of a design with its flanks, under the design torque.
        """
        return ()

    def part(self, design: Any, name: str, cycle: MeshCycle) -> object:
        """Tables, chapters and data that the table adds to an analysis, a `report.Template`; by default None.

        Args:
            design: the `DesignFile`.
            name: name of the design that the result is about.
            cycle: cycle of the design with its flanks, under the design torque.
        """
        return None

    def quantity(self, design: Any, key: str, quantity: Quantity) -> Quantity:
        """A quantity of the settings that the table stands for, with them.

        Args:
            design: the `DesignFile`, which has what the quantity needs.
            key: key that names the quantity.
            quantity: quantity of the vocabulary.

        Raises:
            DesignFileError: where the table does not say all that the quantity needs; by default nothing.
        """
        raise DesignFileError(key, f'"{quantity.name}" takes settings, which [{self.table}] does not give')

    @classmethod
    def inner(cls) -> Mapping[str, type[FileTable]]:
        """Tables within it, by their headings in the reference."""
        return {}


class SettingsTable(FurtherTable):
    """A table whose keys are the fields of a class of settings, of which `DesignFile.tables` holds an object.

    Attributes:
        file: TOML file beside the design file, with any of the other keys; no key is in both.
    """

    file: str | None = entry(text())

    @property
    def value(self) -> object:
        """The settings."""
        return template_of(self, self.source).build({})

    @classmethod
    def read(cls, given: Mapping[str, Any], folder: Path) -> Self:
        """The table with the keys that stand in its file, see `FurtherTable.read`."""
        name = decode(cls.table, {FILE: given[FILE]} if FILE in given else {}, SettingsTable).file
        if name is None:
            return decode(cls.table, given, cls)
        with referring(f"{cls.table}.{FILE}", name):
            held: dict[str, Any] = read(folder / name)
        for twice in held.keys() & given.keys():
            raise DesignFileError(join(cls.table, twice), f"is given in {name} too")
        try:
            return decode(cls.table, {**held, **given}, cls)
        except DesignFileError as error:
            own = error.key.removeprefix(f"{cls.table}.")
            if own.partition("[")[0] in held:
                raise DesignFileError(f"{cls.table}.{FILE}", f"{name}: {own}: {error.problem}") from None
            raise


def further_tables(*, users: bool = True) -> dict[str, type[FurtherTable]]:
    """The further tables by their names.

    A user's class cannot take the place of one of the library; of two of his own with one name the later is meant.

    Args:
        users: users with those that are defined outside the library.
    """
    _import_tables()
    found = [cls for base in (Checked, FurtherTable) for cls in descendants(base) if _names_a_table(cls)]
    library = {cls.table: cls for cls in found if cls.__module__.startswith("jaxgear.")}
    own = {cls.table: cls for cls in found if users and cls.table not in library}
    return {name: _table_of(cls) for name, cls in sorted((library | own).items())}


@functools.cache
def _import_tables() -> None:
    """Imports all of this package and the tables of applications: a class is a table once it exists."""
    package = sys.modules[__package__]
    for name in package.__all__:
        getattr(package, name)
    for place in provided("tables").values():
        place.load()


def _names_a_table(cls: Any) -> bool:
    """Whether a class is a further table: it says the name itself, whatever it is derived from or made of."""
    return bool(vars(cls).get("table")) and isinstance(cls.table, str) and not inspect.isabstract(cls)


@functools.cache
def _table_of(cls: Any) -> type[FurtherTable]:
    """The table of a class of settings, which knows nothing of design files, or of one that does."""
    if issubclass(cls, FurtherTable):
        return cls
    return type(cls.__name__, (SettingsTable, section_of(cls, open=False)), {"__doc__": cls.__doc__})


class ProjectSection(FurtherTable):
    """Texts for the head of the report and for `summary.json`.

    Attributes:
        name: name of the project.
        number: number of the project or order.
        customer: customer of the project.
        drawing: number of the drawing.
        revision: revision of the drawing.
        author: who made the design.
        remark: further text.
    """

    table = "project"

    name: str | None = entry(text())
    number: str | None = entry(text())
    customer: str | None = entry(text())
    drawing: str | None = entry(text())
    revision: str | None = entry(text())
    author: str | None = entry(text())
    remark: str | None = entry(text())
