"""Hook of mkdocs: a page of the reference for every package, with all its public functions and classes."""

import ast
import functools
import re
from pathlib import Path

import griffe
from mkdocs.structure.files import File

PACKAGE = Path(__file__).parent.parent / "jaxgear"
# in the order of the pipeline; what they import from one another stands on the page of its owner
PACKAGES = (
    "geometry microgeometry compliance compliance.finite_element contact shafts metrics tolerance conditions "
    "revolution dynamics rating dimensionless wear manufacture planetary sizing sweeps optimize layout io studies "
    "report identification rexs explorer plot numerics"
).split()
_NAMES = re.compile(r" +(?:\w+, )+\w+:")  # with which a line of a docstring begins


def on_config(config):
    """Adds the pages to the navigation."""
    config.nav.append({"API reference": [{name: _page(name)} for name in PACKAGES]})
    return config


def on_files(files, config):
    """Adds the pages to the files of the site."""
    for name in PACKAGES:
        files.append(File.generated(config, _page(name), content=_content(name)))
    return files


def public_names(package: str) -> list[str]:
    """Functions and classes of a package, as its `__init__.py` or `.pyi` says it: `from .module import name as name`.

    Each as `module.name`: a module and its function may be called alike.
    """
    folder = PACKAGE.joinpath(*package.split("."))
    if not folder.exists():  # a single module
        return sorted(name for name in _defined(folder) if not name.startswith("_"))
    init = next(path for path in (folder / "__init__.pyi", folder / "__init__.py") if path.exists())
    found = []
    for node in ast.parse(init.read_text("utf-8")).body:
        if isinstance(node, ast.ImportFrom) and node.level == 1 and node.module:
            defined = _defined(init.parent.joinpath(*node.module.split(".")))
            names = [alias.name for alias in node.names if alias.asname == alias.name]
            found += [f"{node.module}.{name}" for name in names if name in defined]
    return found


@functools.cache
def _defined(module: Path) -> frozenset[str]:
    """Functions and classes of a module; what a package within a package gives has a page of its own, or none."""
    file = module.with_suffix(".py")
    tree = ast.parse(file.read_text("utf-8")) if file.exists() else ast.Module([], [])
    return frozenset(node.name for node in tree.body if isinstance(node, ast.FunctionDef | ast.ClassDef))


class NamesTogether(griffe.Extension):
    """Docstrings say `pinion, wheel: ...` of fields alike, of which the parser would take the second one for a type."""

    def on_instance(self, *, obj: griffe.Object, **_) -> None:
        if obj.docstring is not None:
            obj.docstring.value = "\n".join(map(_together, obj.docstring.value.splitlines()))


def _together(line: str) -> str:
    """A line of a docstring with no-break spaces between the names with which it begins."""
    names = _NAMES.match(line)
    if names is None:
        return line
    return names[0].replace(", ", ",\N{NO-BREAK SPACE}") + line[names.end() :]


def _page(package: str) -> str:
    return f"api/{package}.md"


def _content(package: str) -> str:
    whole = f"# jaxgear.{package}\n\n::: jaxgear.{package}\n    options: {{members: false, show_root_heading: false}}\n"
    return "\n".join([whole, *(f"::: jaxgear.{package}.{name}\n" for name in public_names(package))])
