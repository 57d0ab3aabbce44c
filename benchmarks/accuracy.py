"""How far jaxgear is from finite elements: `python -m benchmarks.accuracy`.

Compares the default model, the usual published model and the default with one ingredient changed with 76 finite-element
mesh cycles (`reference/README.md`), internal pairs with 115 others, then the load across the face and helical pairs
with three-dimensional ones. Exit code 1 when an error of the default model has grown past `accuracy_bounds.json`,
`internal_bounds.json`, `face_bounds.json` or `helical_bounds.json`.
"""

import jax

jax.config.update("jax_enable_x64", True)

import argparse  # noqa: E402
import json  # noqa: E402
import sys  # noqa: E402
from collections.abc import Iterable, Sequence  # noqa: E402
from concurrent.futures import ThreadPoolExecutor  # noqa: E402
from pathlib import Path  # noqa: E402

import numpy as np  # noqa: E402

from . import face, helical, internal  # noqa: E402
from .cases import PAIRS, PLANES, Case, reference, select  # noqa: E402
from .models import MODELS, Model, run  # noqa: E402
from .quantities import QUANTITIES, errors  # noqa: E402
from .report import Errors, print_detail, print_summary  # noqa: E402

BOUNDS = Path(__file__).parent / "accuracy_bounds.json"
# A recorded worst error may grow by this much before the benchmark fails: room for other JAX versions and processors,
# and for changes elsewhere that nobody would call a loss of accuracy.
_MARGIN = 1.05
_MARGIN_BY_UNIT = {"%": 0.05, "um": 0.002, "": 0.0005}


def compare(models: Sequence[Model], cases: Sequence[Case]) -> Errors:
    """Errors of every model in every case, {model name: {case: {quantity: error}}}.

    Raises:
        ValueError: when there is nothing to compare.
    """
    if not cases or not models:
        raise ValueError("nothing to compare: no cases or no models")
    # most of the time is compilation, which runs outside Python's lock
    with ThreadPoolExecutor(max_workers=2) as pool:
        curves = dict(zip((model.name for model in models), pool.map(lambda model: run(model, cases), models)))
    return {
        name: {case: errors(case, found[case], reference(case)) for case in cases} for name, found in curves.items()
    }


def worst(results: dict[Case, dict[str, float]]) -> dict[str, dict[str, float]]:
    """Largest absolute error per gear pair and quantity."""
    pairs = sorted({case.pair for case in results})
    return {
        pair: {
            quantity.key: _largest(
                error[quantity.key] for case, error in results.items() if case.pair == pair and quantity.key in error
            )
            for quantity in QUANTITIES
        }
        for pair in pairs
    }


def _largest(values: Iterable[float]) -> float:
    """Largest absolute value; nan if one is nan, zero of none."""
    return float(np.max(np.abs([*values]), initial=0.0))


def exceeded(results: dict[Case, dict[str, float]], bounds: dict[str, dict[str, float]]) -> list[str]:
    """One line for every error that has grown past its recorded bound."""
    lines = []
    for pair, found in worst(results).items():
        for quantity in QUANTITIES:
            allowed = bounds[pair][quantity.key] * _MARGIN + _MARGIN_BY_UNIT[quantity.unit]
            # written so that nan counts as exceeded
            if not found[quantity.key] <= allowed:
                lines.append(f"{pair} {quantity.title}: {found[quantity.key]:.4g} {quantity.unit} > {allowed:.4g}")
    return lines


def load_bounds(path: Path = BOUNDS) -> dict[str, dict[str, float]]:
    """Recorded worst errors per gear pair and quantity."""
    return json.loads(path.read_text())


def _record(results, path: Path) -> None:
    rounded = {pair: {key: float(f"{value:.4g}") for key, value in row.items()} for pair, row in worst(results).items()}
    path.write_text(json.dumps(rounded, indent=2) + "\n")


def _arguments(argv) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.accuracy", description=__doc__.split("\n\n")[0])
    parser.add_argument("--cases", default=",".join(PAIRS), help="gear pairs, for example A,B (default: all)")
    parser.add_argument("--quick", action="store_true", help="default model, plane stress only, two dimensions")
    parser.add_argument(
        "--face", action="store_true", help="internal, helical pairs and the load across the face alone"
    )
    parser.add_argument("--detail", action="store_true", help="one table per quantity with every case")
    parser.add_argument("--figures", metavar="DIR", type=Path, help="write the figures to this folder")
    parser.add_argument("--record", action="store_true", help="record the worst errors as the new bounds")
    arguments = parser.parse_args(argv)
    some = arguments.quick or arguments.cases != ",".join(PAIRS)
    if arguments.record and some:
        parser.error("--record needs all cases: leave out --quick and --cases")
    if arguments.face and some:
        parser.error("--face has no use for --quick and --cases")
    arguments.across = not some
    return arguments


def main(argv: Sequence[str] | None = None, models: Sequence[Model] = MODELS, bounds: Path = BOUNDS) -> int:
    """Runs the benchmark; the first of the models is held to the bounds. Returns the exit code."""
    arguments = _arguments(argv)
    lines = [] if arguments.face else _sections(arguments, models, bounds)
    if arguments.across:
        lines += _across(record=arguments.record)
    if not arguments.record:
        print("\n".join(["", "Worse than recorded:", *lines]) if lines else "\nWithin the recorded bounds.")
    return 1 if lines else 0


def _across(*, record: bool) -> list[str]:
    """Compares internal and helical pairs and the load across the face; one line for every error beyond its bound."""
    inside, results, inclined = internal.compare(), face.compare(), helical.compare()
    internal.print_internal(inside)
    face.print_face(results)
    helical.print_helical(inclined)
    if record:
        face.record(results["coupled"])
        helical.record(inclined)
        internal.record(inside)
        print(f"recorded {internal.BOUNDS}, {face.BOUNDS}, {helical.BOUNDS}")
        return []
    across = face.exceeded(results["coupled"], face.load_bounds()) + helical.exceeded(inclined)
    return internal.exceeded(inside) + across


def _sections(arguments: argparse.Namespace, models: Sequence[Model], bounds: Path) -> list[str]:
    """Compares the mesh cycles of two dimensions; one line for every error beyond its bound."""
    cases = select(arguments.cases.split(","), PLANES[:1] if arguments.quick else PLANES)
    models = models[:1] if arguments.quick else models
    results = compare(models, cases)
    if arguments.detail:
        print_detail(results)
    print_summary(results, {model.name: model.goals for model in models})
    if arguments.figures:
        from .figures import write_figures

        for path in write_figures(arguments.figures, results):
            print(f"wrote {path}")
    held = results[models[0].name]
    if arguments.record:
        _record(held, bounds)
        print(f"recorded {bounds}")
        return []
    return exceeded(held, load_bounds(bounds))


if __name__ == "__main__":
    sys.exit(main())
