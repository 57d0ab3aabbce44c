"""Layers import only what comes before them, and importing the library has no side effects."""

import ast
import functools
import importlib
import importlib.metadata
import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest

import jaxgear

PACKAGE = Path(jaxgear.__file__).parent
ORDER = (
    "version",
    "provided",
    "numerics",
    "geometry",
    "microgeometry",
    "compliance",
    "contact",
    "shafts",
    "metrics",
    "tolerance",
    "conditions",
    "revolution",
    "dynamics",
    "dimensionless",
    "wear",
    "vocabulary",
    "sizing",
    "sweeps",
    "optimize",
    "io",
    "plot",
    "report",
    "studies",
    "cli",
    "rating",
    "identification",
    "layout",
    "planetary",
    "manufacture",
    "rexs",
    "explorer",
)
FILES = sorted(PACKAGE.rglob("*.py"))


def layer(path: Path) -> str:
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return parts[0]


@functools.cache
def tree_of(path: Path):
    return ast.parse(path.read_text(encoding="utf-8"))


@functools.cache
def nodes(path: Path):
    """All nodes of a file, and those at its module level."""
    tree = tree_of(path)
    return [*ast.walk(tree)], set(tree.body)


def imported(path: Path):
    """Layers that a file imports, at module level or inside functions."""
    package = ("jaxgear", *path.relative_to(PACKAGE).parts[:-1])
    for node in nodes(path)[0]:
        if isinstance(node, ast.ImportFrom) and node.level:
            base = package[: len(package) - node.level + 1]
            names = [node.module] if node.module else [alias.name for alias in node.names]
            for name in names:
                target = (*base, *name.split("."))
                if len(target) > 1:
                    yield target[1]
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "jaxgear":
            yield (node.module or "").split(".")[1]


def test_layers_import_only_earlier_ones():
    wrong = [
        f"{path.relative_to(PACKAGE)} imports {other}"
        for path in FILES
        if layer(path) not in ("__init__", "__main__")
        for other in imported(path)
        if other != layer(path) and ORDER.index(other) >= ORDER.index(layer(path))
    ]
    assert wrong == []


# imported where they are used, so that the library starts fast and without what it does not need
HEAVY = {
    "evosax",
    "ezdxf",
    "importlib",
    "jinja2",
    "matplotlib",
    "optax",
    "plotly",
    "pyarrow",
    "xarray",
    "xlsxwriter",
    "jaxgear.layout.figures",
    "jaxgear.planetary.figures",
    "jaxgear.rating.figures",
    "jaxgear.plot",
}
# so do the commands, and their help without any of the library
_NAMES = "jax_setup", "new", "run"
COMMANDS = {*(f"jaxgear.cli.{name}" for name in _NAMES), "jaxgear.rexs.convert", "jaxgear.explorer.serve"}


def hidden(path: Path):
    """Packages, of jaxgear with the layer, that a file imports anywhere but at module level."""
    package = ("jaxgear", *path.relative_to(PACKAGE).parts[:-1])
    inner, outer = nodes(path)
    for node in inner:
        if node in outer:
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield (node.module or "").split(".")[0]
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1]
            yield from (".".join((*base, node.module or alias.name)) for alias in node.names)


def test_no_import_hides_a_circle():
    """None inside a function, none under TYPE_CHECKING, but for packages that are heavy."""
    places = {PACKAGE / "cli" / "app.py", PACKAGE / "rexs" / "command.py", PACKAGE / "explorer" / "command.py"}
    places.add(PACKAGE / "explorer" / "notebook.py")
    launcher = PACKAGE / "cli" / "launcher.py"
    files = [path for path in FILES if path != launcher]  # no part of the package when it runs: it comes before
    found = {path: set(hidden(path)) - HEAVY - (COMMANDS if path in places else set()) for path in files}
    assert {path: names for path, names in found.items() if names} == {}


# what is imported by a name that is data
BY_NAME = {
    "cli/run.py": "libraries that a study will need, in another thread",
    "studies/registry.py": "studies, those of other packages by their entry points",
}


def test_nothing_else_is_imported_by_its_name():
    """No module of the package, and no class of it is named in a string."""
    sources = {path.relative_to(PACKAGE).as_posix(): path.read_text(encoding="utf-8") for path in FILES}
    assert {place for place, source in sources.items() if "import_module" in source} == set(BY_NAME)
    texts = {
        node.value
        for path in FILES
        for node in nodes(path)[0]
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value.startswith("jaxgear.")
    }
    assert [text for text in texts if any(part[:1].isupper() for part in text.split("."))] == []


def test_the_check_sees_imports():
    assert {"geometry", "numerics"} <= set(imported(PACKAGE / "contact" / "mesh.py"))


def test_numerics_has_no_gear_word():
    words = ("gear", "tooth", "teeth", "flank", "pinion", "wheel", "mesh")
    for path in (PACKAGE / "numerics").glob("*.py"):
        text = path.read_text(encoding="utf-8").lower()
        if path.name == "__init__.py":
            text = text.replace("without a gear word", "")
        text = text.replace("jax.sharding.mesh", "")  # of devices
        assert not [word for word in words if word in text], path.name


# public functions and methods that do not say the type of every parameter and of their result, and why
OF_ANY_TYPE = {
    "explorer/notebook.py explore": "returns a page, whose libraries may be missing",
    "cli/new.py new": "passes options of another function on",
    "contact/status.py WithStatus.converged": "of the kind of array that the status is, of JAX or NumPy",
    "contact/solve.py contact_of": "takes forces or approaches, each of a type of its own",
    "dynamics/runs.py design_runs": "designs are a tree of arrays of any kind, options those of another function",
    "dynamics/runs.py speed_runs": "passes options of another function on",
    "dynamics/runs.py speed_sweeps": "likewise",
    "dynamics/settings.py Dynamics.oscillator_and_mesh": "likewise",
    "dynamics/settings.py Dynamics.runs_of": "designs are a tree of arrays of any kind, as what is kept of them",
    "dynamics/settling.py steady_state": "takes two classes of the file that imports it",
    "numerics/implicit.py at_root": "passes on what a function and its search are given",
    "io/design_file.py DesignFile.needed": "a further table has a class of its own",
    "io/design_file.py DesignFile.spectrum": "takes any table with torques and weights",
    "io/gears.py with_quality": "takes any table with quality classes",
    "io/table_keys.py as_field": "a value of a file, for a field of any type",
    "io/table_keys.py entry": "stands for the value of a key, whose annotation says the type",
    "io/tables.py FurtherTable.check": "takes a `DesignFile`, whose file imports this one",
    "io/tables.py FurtherTable.extended": "likewise",
    "io/tables.py FurtherTable.findings": "likewise",
    "io/tables.py FurtherTable.part": "likewise",
    "io/tables.py FurtherTable.quantity": "likewise",
    "io/tables.py FurtherTable.whole_of": "likewise",
    "io/template.py Template.build": "makes an object of the class that the template names",
    "rexs/model.py checked_object": "data of a file, of any type",
    "studies/registry.py load": "a class of a file that is imported when it is asked for",
    "sweeps/store.py Store.table": "an object of a package that is imported when it is asked for",
    "sweeps/table.py SweepTable.to_arrow": "likewise",
    "sweeps/table.py SweepTable.to_pandas": "likewise",
    "sweeps/table.py SweepTable.to_xarray": "likewise",
    "geometry/drawing.py drawn_gear": "takes the arguments of two classes, each of a type of its own",
    "numerics/fields.py count": "stands for the value of a field, whose annotation says the type",
    "numerics/fields.py number": "likewise",
    "numerics/fields.py result": "likewise",
}


def public(body, owner=""):
    """Public functions and methods, with constructors and operators: names and nodes."""
    for node in body:
        name = getattr(node, "name", "_")
        if name.startswith("_") and not name.endswith("__"):
            continue
        if isinstance(node, ast.ClassDef):
            yield from public(node.body, f"{owner}{name}.")
        elif isinstance(node, ast.FunctionDef):
            yield owner + name, node


def untyped(body):
    """Names of those that leave a type out or say `Any`."""
    for name, node in public(body):
        given = node.args
        every = [*given.posonlyargs, *given.args, *given.kwonlyargs, given.vararg, given.kwarg]
        hints = [part.annotation for part in every if part and not ("." in name and part.arg in ("self", "cls"))]
        if any(hint is None or ast.unparse(hint) == "Any" for hint in [*hints, node.returns]):
            yield name


def typed_files():
    """Places in the package of the files of its layers, and what is at their module level."""
    for path in FILES:
        if layer(path) in ORDER:
            yield path.relative_to(PACKAGE).as_posix(), tree_of(path).body


def test_files_of_results_are_named_where_they_are_made():
    above = ("report", "cli")
    for path in FILES:
        if layer(path) in above or path.name == "folder.py":
            texts = [node.value for node in nodes(path)[0] if isinstance(node, ast.Constant)]
            assert not [text for text in texts if re.fullmatch(r"[a-z_]+\.(png|csv|parquet)", str(text))]


def test_public_signatures_are_typed():
    assert {f"{place} {name}" for place, body in typed_files() for name in untyped(body)} == set(OF_ANY_TYPE)


TORQUE_BY_KEYWORD = {
    "dimensionless/model.py dimensionless_model": "that of an excitation",
    "io/gearbox.py support_of": "one of the keys of a file",
    "io/write_design.py write_design": "likewise: a file may do without most of them",
    "io/write_design.py write_stage_design": "likewise",
    "io/write_design.py write_starter": "likewise",
    "planetary/starter.py write_stage_starter": "likewise",
    "rexs/write.py write_rexs": "likewise",
    "rexs/write_planetary.py write_rexs_stage": "likewise",
    "rexs/convert.py convert": "likewise",
}


def test_the_load_comes_by_place():
    """After what is analysed and before the options, which come by keyword."""
    by_keyword = {
        f"{place} {name}"
        for place, body in typed_files()
        for name, node in public(body)
        if "torque" in [part.arg for part in node.args.kwonlyargs]
    }
    assert by_keyword == set(TORQUE_BY_KEYWORD)


def test_the_check_sees_what_is_not_typed():
    source = (
        "def typed(a: int, *, b: tuple[Any, ...]) -> None: ...\n"
        "def bare(a: int, b: Any) -> None: ...\n"
        "def _own(a): ...\n"
        "class Kind:\n"
        "    def __init__(self, a) -> None: ...\n"
        "    def at(self, *given) -> None: ...\n"
        "    @property\n"
        "    def size(self): ...\n"
        "    def _own(self, a): ...\n"
    )
    assert [*untyped(ast.parse(source).body)] == ["bare", "Kind.__init__", "Kind.at", "Kind.size"]


def in_a_new_process(script):
    return subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)


def test_import_is_silent_and_changes_nothing():
    script = (
        "import jax, sys\n"
        "before = dict(jax.config.values)\n"
        "import jaxgear\n"
        "assert dict(jax.config.values) == before\n"
        "assert 'matplotlib' not in sys.modules and 'typer' not in sys.modules\n"
        "assert 'pyarrow' not in sys.modules\n"
        "for name in dir(jaxgear):\n"
        "    if name not in ('plot', 'STEEL'):\n"
        "        getattr(jaxgear, name)\n"
        "assert not {'matplotlib', 'optax', 'typer', 'pyarrow', 'evosax'} & set(sys.modules)\n"
        "assert dict(jax.config.values) == before\n"
        "import jaxgear.cli.run\n"
        "jax.config.update('jax_num_cpu_devices', 3)\n"  # nothing has chosen the devices either
        "jax.config.update('jax_enable_x64', True)\n"
        "assert jax.device_count() == 3\n"
        "assert jaxgear.STEEL.density.dtype == 'float64'\n"
    )
    done = in_a_new_process(script)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


@pytest.mark.parametrize("code", ["import jaxgear", "from jaxgear.cli import main; main(['optimize', '--help'])"])
def test_what_needs_no_library_imports_none(code):
    script = (
        "import atexit, sys\natexit.register(lambda: print({'equinox', 'jax', 'numpy', 'scipy'} & set(sys.modules)))\n"
    )
    done = in_a_new_process(script + code)
    assert (done.returncode, done.stdout.splitlines()[-1], done.stderr) == (0, "set()", "")


def test_public_names_may_be_imported_first_where_jax_traces():
    """Nothing at module level is made by JAX, or it would be a tracer for ever."""
    script = (
        "import jax, sys\n"
        "import jaxgear\n"
        "def use(x):\n"
        "    for name in dir(jaxgear):\n"
        "        getattr(jaxgear, name)\n"
        "    return x\n"
        "jax.jit(use)(1.0)\n"
        "assert 'jaxgear.optimize' in sys.modules\n"
        "for name, module in list(sys.modules.items()):\n"
        "    if name.startswith('jaxgear'):\n"
        "        assert not [key for key, value in vars(module).items() if isinstance(value, jax.core.Tracer)], name\n"
    )
    done = in_a_new_process(script)
    assert (done.returncode, done.stderr) == (0, "")


def test_an_unknown_name_is_refused_as_python_does():
    with pytest.raises(AttributeError, match="^module 'jaxgear' has no attribute 'tip_relief'$"):
        jaxgear.tip_relief  # noqa: B018
    with pytest.raises(ImportError, match="cannot import name 'tip_relief' from 'jaxgear'"):
        from jaxgear import tip_relief  # noqa: F401


def test_flat_names_are_few_and_the_rest_has_its_namespace():
    flat = [name for name in dir(jaxgear) if not name.startswith("_") and not inspect.ismodule(getattr(jaxgear, name))]
    assert len(flat) <= 68
    for namespace in ("sizing", "tolerance", "optimize", "sweeps", "plot", "io"):
        assert inspect.ismodule(getattr(jaxgear, namespace)), namespace


def test_no_function_shadows_a_package():
    for folder in PACKAGE.iterdir():
        if (folder / "__init__.py").exists():
            importlib.import_module(f"jaxgear.{folder.name}")
            assert inspect.ismodule(getattr(jaxgear, folder.name)), folder.name


def test_the_version_is_that_of_the_installed_package():
    assert jaxgear.__version__ == importlib.metadata.version("jaxgear")


def test_tests_share_sizes_and_import_no_other_test():
    """What several tests need is in modules of its own; every other size of arrays compiles programs of its own."""
    sizes = set()
    for path in Path(__file__).parent.glob("test_*.py"):
        for node in nodes(path)[0]:
            modules = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            modules += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            assert not any(name.startswith("test_") for name in modules), path
            if isinstance(node, ast.Call) and ast.unparse(node.func).endswith("Resolution"):
                sizes.add(ast.unparse(node))
    assert len(sizes) <= 50, sorted(sizes)
