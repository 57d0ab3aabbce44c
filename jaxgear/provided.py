"""Studies, commands and formats of installed packages, by their entry points."""

from typing import Any


def provided(group: str) -> dict[str, Any]:
    """Entry points by their names.

    Args:
        group: "studies", "commands" or "formats", in `pyproject.toml` the table
            `[project.entry-points."jaxgear.studies"]` and so on. A study is a subclass of `AbstractStudy`, a command a
            function with the options that `typer` reads from its signature, and a format, named by the end of its
            files, a function that writes a gear pair with the arguments of `write_design`.
    """
    from importlib import metadata  # imported when asked for: it takes longer than the commands need

    return {entry.name: entry for entry in metadata.entry_points(group=f"jaxgear.{group}")}
