"""Applications: folders of this package and other packages that bring tables, quantities, studies, commands, formats.

Nothing of the package imports an application. A folder of this package says what it brings in `application.toml`, and
can be deleted; another package says the same in its `pyproject.toml`, under `[project.entry-points."jaxgear.tables"]`
and so on:

    [tables]
    rating = "jaxgear.rating.table:RatingSection"  # class with `table = "rating"`: of settings, or a `FurtherTable`
    [quantities]
    rating = "jaxgear.rating.quantities:RATING_QUANTITIES"  # a `Vocabulary`, added to that of the package
    [studies]
    rating = "jaxgear.rating.study:RatingStudy"  # a subclass of `AbstractStudy`, the command `rating`

The place of an entry is imported when a file, a quantity or a command is first asked for, not with the package.
"""

import functools
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any


def provided(group: str) -> dict[str, Any]:
    """Entry points by name; the folders of this package come first.

    Args:
        group: "tables", "quantities", "studies", "commands", "formats", "starters" or "functions". A command is a
            function with the options that `typer` reads from its signature; a format, named by the end of its files, a
            function that writes a gear pair with the arguments of `write_design`; a starter one that writes a file to
            begin with; a function one that `jaxgear` has under its name.
    """
    from importlib import metadata  # imported when asked for: it takes longer than the commands need

    own = {name: metadata.EntryPoint(name, place, f"jaxgear.{group}") for name, place in _of_folders(group)}
    others = metadata.entry_points(group=f"jaxgear.{group}")
    return own | {entry.name: entry for entry in others if entry.name not in own}


def _of_folders(group: str) -> Iterator[tuple[str, str]]:
    for application in _applications():
        yield from application.get(group, {}).items()


@functools.cache
def _applications() -> tuple[dict[str, Any], ...]:
    """Content of every `application.toml` of this package."""
    files = sorted(Path(__file__).parent.glob("*/application.toml"))
    return tuple(tomllib.loads(file.read_text(encoding="utf-8")) for file in files)
