"""Folders of applications can be deleted: what is left imports, and its commands run."""

import ast
import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import jaxgear
from jaxgear.provided import provided

PACKAGE = Path(jaxgear.__file__).parent
# folders of the package that no other one imports
APPLICATIONS = ("dimensionless", "explorer", "identification", "layout", "manufacture", "planetary", "rating", "rexs")
# imports every module, shows the help and analyzes a pair
REST = """
import pathlib, pkgutil, sys, importlib
import jaxgear
root = pathlib.Path(jaxgear.__file__).parent
for module in pkgutil.walk_packages([str(root)], "jaxgear."):
    if module.name != "jaxgear.__main__":
        importlib.import_module(module.name)
from jaxgear.cli import main
for arguments in (["--help"], ["analyze", "pair.toml", "--output", "out", "--no-figures"]):
    try:
        main(arguments)
    except SystemExit as end:
        assert not end.code, (arguments, end.code)
"""
DESIGN = """
[pinion]
teeth = 20
module = 2.0
face_width = 10.0
[wheel]
teeth = 30
module = 2.0
face_width = 10.0
[load]
torque = 20.0
[resolution]
positions = 16
"""


def module_of(path: Path) -> list[str]:
    return ["jaxgear", *path.relative_to(PACKAGE).with_suffix("").parts]


def imported(path: Path):
    """Modules and names that a file of the package imports, as dotted paths."""
    package = module_of(path)[:-1]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = (
                [*package[: len(package) - node.level + 1], *filter(None, [node.module])]
                if node.level
                else [node.module]
            )
            yield from (".".join([*base, alias.name]) for alias in node.names)


@pytest.mark.parametrize("folder", APPLICATIONS)
def test_no_other_module_imports_an_application(folder):
    application = f"jaxgear.{folder}"
    users = [
        path.relative_to(PACKAGE).as_posix()
        for path in PACKAGE.rglob("*.py*")
        if path.suffix in (".py", ".pyi") and PACKAGE / folder not in path.parents
        if any(f"{name}.".startswith(f"{application}.") for name in imported(path))
    ]
    assert users == []


def test_a_folder_declares_what_it_has_itself():
    """All that it brings is found in it, so that nothing is left behind where it is deleted."""
    for file in PACKAGE.glob("*/application.toml"):
        for group, entries in tomllib.loads(file.read_text(encoding="utf-8")).items():
            for name, place in entries.items():
                found = provided(group)[name]
                assert place.startswith(f"jaxgear.{file.parent.name}") and found.value == place and found.load()


def test_without_applications_the_rest_imports_and_runs(tmp_path):
    copy = tmp_path / "jaxgear"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    for folder in APPLICATIONS:
        shutil.rmtree(copy / folder)
    (tmp_path / "pair.toml").write_text(DESIGN)
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-c", REST], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "summary.json").exists()
