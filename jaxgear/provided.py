"""Applications: folders of this package and other packages that bring tables, quantities, studies, commands, formats.

Nothing of the package imports an application; each is found by its lines in a `pyproject.toml`, and can be deleted:

    [project.entry-points."jaxgear.tables"]
    rating = "jaxgear.rating.table:RatingSection"  # class with `table = "rating"`: of settings, or a `FurtherTable`
    [project.entry-points."jaxgear.quantities"]
    rating = "jaxgear.rating.quantities:RATING_QUANTITIES"  # a `Vocabulary`, added to that of the package
    [project.entry-points."jaxgear.studies"]
    heat = "my_package.heat:HeatStudy"  # a subclass of `AbstractStudy`, the command `heat`

The place of an entry is imported when a file, a quantity or a command is first asked for, not with the package.
"""

from pathlib import Path
from typing import Any


def provided(group: str) -> dict[str, Any]:
    """Entry points by their names; without those of folders that have been deleted from this package.

    Args:
        group: "tables", "quantities", "studies", "commands" or "formats". A command is a function with the options
            that `typer` reads from its signature, and a format, named by the end of its files, a function that writes
            a gear pair with the arguments of `write_design`.
    """
    from importlib import metadata  # imported when asked for: it takes longer than the commands need

    return {entry.name: entry for entry in metadata.entry_points(group=f"jaxgear.{group}") if not _deleted(entry.value)}


def _deleted(place: str) -> bool:
    package, *folders = place.partition(":")[0].split(".")
    return package == __package__ and not Path(__file__).parent.joinpath(*folders[:1]).exists()
