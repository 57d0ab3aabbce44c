"""What the commands `analyze` and `optimize` do, with their options; `sweep` has its own module."""

import importlib
import threading
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..geometry import GearPair
from ..io import DesignFile, DesignFileError, optimize_request
from ..io.optimize import optimize_of
from ..microgeometry import AbstractModification, NoModification
from ..numerics import compile_quickly, program
from ..sizing import iso_relief
from .document import document
from .progress import Stages
from .run import default_folder, opened, run

_SEARCH, _FIGURES = ("scipy.optimize", "scipy.stats"), ("matplotlib.pyplot",)


def analyze(
    file: Path, output: Path | None, *, figures: bool, cache: bool, command: Sequence[str] | None = None
) -> bool:
    """Evaluates the unmodified pair and the modification of the file; False when a solution failed.

    A report is written where a `command` line is given.
    """
    asked = document(command, file)
    compile_quickly()
    with Stages() as stages:
        design = opened(file, cache=cache)
        free = [name for name in design.bounds if design.open_case or name not in design.values]
        if free:
            says = "give each a value or use jaxgear optimize"
            problem = f"analyze needs numbers, these are free: {', '.join(free)}; {says}"
            raise DesignFileError("variables", problem, file)
        with run(design, output or default_folder(file, "analyze"), stages) as current:
            import_ahead(*_FIGURES * figures)
            current.prepare()
            current.evaluate("unmodified", NoModification(), NoModification())
            pinion, wheel = design.design(design.values)
            if not (isinstance(pinion, NoModification) and isinstance(wheel, NoModification)):
                current.evaluate("modified", pinion, wheel)
            current.write(figures=figures, document=asked)
    return current.show()


def optimize(
    file: Path,
    output: Path | None,
    *,
    method: str | None,
    quick: bool,
    figures: bool,
    cache: bool,
    command: Sequence[str] | None = None,
) -> bool:
    """Searches the optimum and compares it; False when a solution failed or a constraint is not met.

    A report is written where a `command` line is given.
    """
    asked = document(command, file)
    compile_quickly()
    with Stages() as stages:
        design = opened(file, cache=cache)
        request = optimize_request(design, method=method, quick=quick)
        target = output or default_folder(file, "optimize", request.method, quick=quick)
        with run(design, target, stages) as current:
            import_ahead(*_SEARCH, *_FIGURES * figures)
            current.prepare(quick=quick, finer=request.finer, verify=request.verify)
            relief = rule_based(design)
            involute = NoModification()
            current.search(request, {"unmodified": (involute, involute), "rule-based": (relief, relief)})
            current.write(figures=figures, document=asked)
    return current.show()


def import_ahead(*modules: str) -> None:
    """Imports what is needed later in another thread: this one will wait for the compiler."""
    threading.Thread(target=lambda: [importlib.import_module(module) for module in modules]).start()


def rule_based(design: DesignFile) -> AbstractModification:
    """The relief of ISO 6336-1 for both tips."""
    return _iso_relief(design.pair(), np.asarray(design.torque), np.asarray(optimize_of(design).application_factor))


@program
def _iso_relief(pair: GearPair, torque, application_factor):
    return iso_relief(pair, torque, application_factor=application_factor)
