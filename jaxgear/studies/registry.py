"""Studies by name, of this package and of other packages; a study is imported on first use.

Another package provides studies as entry points of the group `jaxgear.studies`:

    [project.entry-points."jaxgear.studies"]
    heat = "my_package.heat:HeatStudy"
"""

import ast
import importlib
import importlib.util
from typing import Any

from ..provided import provided as provided_by

# studies of this package as `module:class`, by the names of their commands
OWN = {
    name: f"{__package__}.{place}"
    for name, place in {
        "analyze": "analysis:AnalysisStudy",
        "optimize": "analysis:OptimizationStudy",
        "sweep": "sweep:SweepStudy",
        "dynamics": "dynamics:DynamicsStudy",
        "wear": "wear:WearStudy",
        "revolution": "revolution:RevolutionStudy",
        "export": "export:ExportStudy",
    }.items()
}


def provided() -> dict[str, str]:
    """Studies provided by other installed packages as `module:class`, by the names of their commands."""
    return {name: entry.value for name, entry in provided_by("studies").items()}


def help_of(place: str) -> str:
    """Docstring of a study up to its first section, read without importing its module; "" without source code."""
    module, _, cls = place.partition(":")
    try:
        spec = importlib.util.find_spec(module)
        loader: Any = None if spec is None else spec.loader
        tree = ast.parse(loader.get_source(module))
    except (ImportError, AttributeError, SyntaxError, TypeError, ValueError):  # no such module, or no source
        return ""
    classes = {one.name: one for one in tree.body if isinstance(one, ast.ClassDef)}
    docstring = ast.get_docstring(classes[cls]) if cls in classes else None
    paragraphs = [" ".join(paragraph.split()) for paragraph in (docstring or "").split("\n\n")]
    first = next((number for number, one in enumerate(paragraphs) if one.startswith("Attributes:")), len(paragraphs))
    return "\n\n".join(paragraphs[:first])


def load(place: str) -> Any:
    """Import the class of a study.

    Args:
        place: class as `module:class`.

    Raises:
        ValueError: when it cannot be imported, or is not an `AbstractStudy`.
    """
    module, _, cls = place.partition(":")
    try:
        found = getattr(importlib.import_module(module), cls)
    except (ImportError, AttributeError) as error:
        raise ValueError(f"study {place}: cannot be imported: {error}") from error
    abstract = importlib.import_module(f"{__package__}.study").AbstractStudy
    if not (isinstance(found, type) and issubclass(found, abstract)):
        raise ValueError(f"study {place}: must be a subclass of jaxgear.studies.AbstractStudy")
    return found
