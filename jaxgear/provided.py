"""Studies, commands and formats of installed packages, by their entry points."""

from pathlib import Path
from typing import Any


def provided(group: str) -> dict[str, Any]:
    """Entry points by their names; without those of folders that have been deleted from this package.

    Args:
        group: "studies", "commands" or "formats", in `pyproject.toml` the table
            `[project.entry-points."jaxgear.studies"]` and so on. A study is a subclass of `AbstractStudy`, a command a
            function with the options that `typer` reads from its signature, and a format, named by the end of its
            files, a function that writes a gear pair with the arguments of `write_design`.
    """
    from importlib import metadata  # imported when asked for: it takes longer than the commands need

    return {entry.name: entry for entry in metadata.entry_points(group=f"jaxgear.{group}") if not _deleted(entry.value)}


def _deleted(place: str) -> bool:
    package, *folders = place.partition(":")[0].split(".")
    return package == __package__ and not Path(__file__).parent.joinpath(*folders[:1]).exists()
