"""The reference of design files: every table and key, generated from the classes that read them."""

import dataclasses
import inspect
import math
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import numpy as np

from ..compliance import AbstractBody, AbstractContact, AbstractTooth
from ..geometry import AbstractRimSupport, Material
from ..microgeometry import AbstractCurve, AbstractModification
from ..shafts import Misalignment
from ..vocabulary import quantities
from . import first_look, gearbox, imperial
from .design_file import file_section
from .flanks import FlankFileSection
from .gears import GearSection, PairSection, PlanetSection, RingSection
from .model_table import ModelSection, ResolutionSection
from .optimize_table import known_methods
from .table_keys import FileTable, family, meanings, section_of, snake, summary
from .tables import LoadSection, further_tables
from .value_types import allowed
from .variables import VariableSection

_HEAD = Path(__file__).with_name("reference_head.md")
_QUANTITIES = "Quantities"


def reference() -> str:
    """The reference of design files as Markdown: every table with keys, kinds, units, ranges, defaults and meanings."""
    tables = (line for title, section in _tables() for line in _table(title, section))
    contents = (f"- [{_heading(title)}](#{_anchor(title)})" for title in (*(one for one, _ in _tables()), _QUANTITIES))
    return (
        "\n".join([_HEAD.read_text(encoding="utf-8").rstrip(), "\nTables:\n", *contents, *tables, *_quantities()])
        + "\n"
    )


def checked_tables() -> dict[str, type[FileTable]]:
    """Tables whose keys `first_look` checks, by their kind."""
    further = further_tables(users=False)
    kinds = family(AbstractModification, users=False)
    return {
        "": file_section(further),
        **dict.fromkeys(first_look.GEARS, GearSection),
        "ring": RingSection,
        "planet": PlanetSection,
        "pair": PairSection,
        "load": LoadSection,
        "model": ModelSection,
        "misalignment": section_of(Misalignment),
        "resolution": ResolutionSection,
        first_look.MATERIAL: section_of(Material),
        first_look.VARIABLE: VariableSection,
        **further,
        **{first_look.MODIFICATION.format(name): section_of(cls) for name, cls in kinds.items()},
    }


def known_keys() -> dict[str, list[str]]:
    """Keys of these tables as a file may write them."""
    found = {}
    for kind, section in checked_tables().items():
        keys = section.every_key()
        found[kind] = [*keys, *imperial.names({name: key.number for name, key in keys.items()})]
    return found | {first_look.METHODS: [*known_methods()]}


def _heading(title: str) -> str:
    return f"`{title}`" if title.startswith("[") or '"' in title else title


def _anchor(title: str) -> str:
    """Where a heading is found, alike on GitHub and in the site: words in small letters, joined by hyphens."""
    return re.sub(r"[^\w -]", "", title).strip().lower().replace(" ", "-")


def _tables() -> Iterator[tuple[str, type[FileTable]]]:
    further = further_tables(users=False)
    yield "The top level", file_section(further)
    yield "[pinion], [wheel] and [sun]", GearSection
    yield "[ring]", RingSection
    yield from _types("support", AbstractRimSupport)
    yield "[planet]", PlanetSection
    yield "[materials.NAME], [pinion.material] and [wheel.material]", section_of(Material)
    yield "[pair]", PairSection
    yield from _types("[[pinion.modification]]", AbstractModification)
    yield '[[pinion.modification]] of type "file"', FlankFileSection
    yield from _types("curve", AbstractCurve)
    yield "[load]", LoadSection
    yield "[model]", ModelSection
    for key, base in (("tooth", AbstractTooth), ("body", AbstractBody), ("contact", AbstractContact)):
        yield from _types(key, base)
    yield "[misalignment]", section_of(Misalignment)
    yield "[resolution]", ResolutionSection
    yield "[variables.NAME]", VariableSection
    yield from gearbox.TABLES.items()
    for name, section in further.items():
        yield f"[{name}]", section
        yield from section.inner().items()


def _types(title: str, base: type[eqx.Module]) -> Iterator[tuple[str, type[FileTable]]]:
    for name, cls in family(base, users=False).items():
        yield f'{title} of type "{name}"', section_of(cls)


def _table(title: str, section: type[FileTable]) -> Iterator[str]:
    yield f"\n## {_heading(title)}\n"
    yield summary(section if section.__doc__ else section.source) + "\n"
    if not section.every_key():
        return
    texts = meanings(section.source) | meanings(section)
    yield "| Key | Value | Unit | Range | Default | Meaning |"
    yield "| --- | --- | --- | --- | --- | --- |"
    for name, key in section.every_key().items():
        number = key.number
        cells = [
            f"`{name}`",
            key.words,
            number.unit if number else "",
            allowed(dataclasses.replace(number, unit="")) if number else "",
            "required" if key.default is ... else _default(name, key.default, section.source),
            key.meaning or texts.get(name, ""),
        ]
        yield "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _quantities() -> Iterator[str]:
    yield f"\n## {_QUANTITIES}\n\nNames for `objective`, `of` and `results`.\n"
    yield "| Name | Unit | Meaning |"
    yield "| --- | --- | --- |"
    for name, quantity in quantities.items():
        yield f"| `{name}` | {quantity.unit} | {quantity.meaning} |"


def _default(name: str, default: Any, of: Callable[..., Any] | None) -> str:
    """Default of a key in Markdown, from the table or the class of the library; "" without one."""
    if default is None and of is not None:
        known = inspect.signature(of).parameters.get(name)
        default = None if known is None or known.default is inspect.Parameter.empty else known.default
        made = {field.name: field.default_factory for field in dataclasses.fields(of)} if isinstance(of, type) else {}
        maker = made.get(name)
        if isinstance(maker, type) and inspect.isabstract(maker.__bases__[0]):
            default = snake(maker.__name__)
    if isinstance(default, jax.Array | np.ndarray):
        default = np.asarray(default).tolist()
    if isinstance(default, bool):
        return f"`{str(default).lower()}`"
    if isinstance(default, float) and math.isfinite(default):
        return f"`{default:g}`"
    return f"`{default}`" if isinstance(default, int) else f'`"{default}"`' if isinstance(default, str) else ""
