"""Load across the face against three-dimensional finite elements (see `reference/README.md`)."""

import functools
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from rich.console import Console
from rich.table import Table

import jaxgear as jg

from .cases import PAIR_COUNT, REFERENCE, strong

BOUNDS = Path(__file__).parent / "face_bounds.json"
# half as many as the reference: its line loads are compared as means of two neighbouring slices
SLICES = 12
_MARGIN = {"factor": 0.1, "rms": 0.1, "shift": 0.005, "ppte": 0.005}
_WIDTH = 120
_END = 3.0  # length of the end relief where a case has none [mm]

Slices = int | tuple[int, ...]  # their number, or widths in slices of the reference


@dataclass(frozen=True)
class FaceCase:
    """One operating point of the three-dimensional reference: name of the pair and of the case."""

    pair: str
    name: str

    def __str__(self) -> str:
        return f"{self.pair} {self.name}"


@dataclass(frozen=True)
class Face:
    """What a mesh cycle shows across the face.

    Attributes:
        line_load: [N/mm], shape (pairs, slices, positions).
        transmission_error: [um], shape (positions,).
        slices: over which the line loads are means.
    """

    line_load: np.ndarray
    transmission_error: np.ndarray
    slices: Slices

    @property
    def weight(self) -> np.ndarray:
        """Widths of the slices over their sum."""
        widths = _widths(self.slices)
        return np.asarray(widths) / sum(widths)

    @property
    def factor(self) -> float:
        """Largest over mean line load over the face of the most loaded pair, mean over the positions."""
        most = np.take_along_axis(self.line_load, self.line_load.max(axis=1).argmax(axis=0)[None, None], axis=0)[0]
        return float(np.mean(most.max(axis=0) / np.average(most, axis=0, weights=self.weight)))


@dataclass(frozen=True)
class Errors:
    """Errors of a mesh cycle.

    Attributes:
        factor: of `Face.factor` [%].
        rms: of all line loads, over the root mean square of those of the reference [%].
        shift: of the change of the mean transmission error against the aligned pair under the same torque [um]; None
            where the reference has none.
        ppte: of the change of the peak-to-peak transmission error against it [um].
    """

    factor: float
    rms: float
    shift: float | None
    ppte: float | None


TITLES = {
    "factor": "K \\[%]",
    "rms": "line load, rms \\[%]",
    "shift": "change of mean TE \\[um]",
    "ppte": "change of PPTE \\[um]",
}


@functools.cache
def _stored() -> dict:
    return json.loads((REFERENCE / "three_d.json").read_text())


def cases(pair: str | None = None) -> list[FaceCase]:
    """The cases of a pair, or all."""
    return [FaceCase(name, case) for name, data in _stored().items() for case in data["cases"] if pair in (None, name)]


def inputs(case: FaceCase) -> dict:
    """Torque [N m] and amounts of the modifications of the pinion [um, mm]."""
    return _stored()[case.pair]["cases"][case.name]


def aligned(case: FaceCase) -> FaceCase | None:
    """The case without modifications under the same torque."""
    for other in cases(case.pair):
        same = inputs(other)["torque_Nm"] == inputs(case)["torque_Nm"]
        if same and other != case and other.name.startswith("aligned"):
            return other
    return None


def _widths(slices: Slices) -> tuple[int, ...]:
    return (1,) * slices if isinstance(slices, int) else slices


def reference(case: FaceCase, slices: Slices = SLICES) -> Face:
    """By finite elements, the line loads as means over its slices that are in one of the given ones."""
    data = _stored()[case.pair]
    loaded = np.asarray(inputs(case)["line_load_N_per_mm"])  # positions, loaded pairs, slices
    load = np.zeros((data["positions"], PAIR_COUNT, data["slices"]))
    load[:, data["loaded_pairs"]] = loaded
    widths = np.asarray(_widths(slices)) * data["slices"] // sum(_widths(slices))
    means = np.add.reduceat(load, np.cumsum(widths) - widths, axis=-1) / widths
    return Face(np.moveaxis(means, 0, -1), np.asarray(inputs(case)["transmission_error_um"]), slices)


@functools.cache
def gear_pair(name: str) -> jg.GearPair:
    """The gears of a pair of the reference."""
    data = _stored()[name]
    gears = [
        jg.Gear(teeth, data["module"], face_width=data["face_width"], bore_diameter=bore)
        for teeth, bore in zip(data["teeth"], data["bore_diameter"])
    ]
    return strong(jg.GearPair(*gears))


def run(pair: str, *, slices: Slices = SLICES, coupled: bool = True) -> dict[FaceCase, Face]:
    """All cases of a pair by jaxgear in its default model, at the positions of the reference."""
    chosen = cases(pair)
    sizes = jg.Resolution(
        positions=_stored()[pair]["positions"],
        slices=len(_widths(slices)),
        slice_widths=_widths(slices),
        pairs=PAIR_COUNT,
        coupled_slices=coupled,
    )
    mesh = jg.prepare(gear_pair(pair), resolution=sizes)
    keys = "torque_Nm", "lead_slope_um", "lead_crowning_um", "end_relief_um"
    numbers = jnp.asarray([[inputs(case)[key] for key in keys] for case in chosen])

    def solved(values):
        torque, slope, crowning, end = values
        flank = jg.LeadSlope(slope) + jg.LeadCrowning(crowning) + jg.EndRelief(end, _END)
        cycle = jg.solve(mesh, torque, pinion=flank)
        return cycle.line_load, cycle.transmission_error, cycle.converged

    load, error, converged = map(np.asarray, jg.quick_jit(lambda of: jax.lax.map(solved, of))(numbers))
    if not converged.all():
        raise RuntimeError(f"{pair}: contact not converged")
    return {case: Face(*found, slices) for case, found in zip(chosen, zip(load, error))}


def errors(found: dict[FaceCase, Face]) -> dict[FaceCase, Errors]:
    """Errors of the cases."""
    return {case: _errors(case, found) for case in found}


def _errors(case: FaceCase, found: dict[FaceCase, Face]) -> Errors:
    face = found[case]
    slices = face.slices
    truth, even = reference(case, slices), aligned(case)
    shift = ppte = None
    if even is not None:
        shift = _change(np.mean, face, found[even]) - _change(np.mean, truth, reference(even, slices))
        ppte = _change(np.ptp, face, found[even]) - _change(np.ptp, truth, reference(even, slices))
    root = np.sqrt(face.weight)[:, None]
    difference, whole = root * (face.line_load - truth.line_load), root * truth.line_load
    return Errors(
        factor=100 * (face.factor / truth.factor - 1),
        rms=float(100 * np.linalg.norm(difference) / np.linalg.norm(whole)),
        shift=shift,
        ppte=ppte,
    )


def _change(measure, face: Face, even: Face) -> float:
    return float(measure(face.transmission_error) - measure(even.transmission_error))


def compare(pairs: Sequence[str] | None = None) -> dict[str, dict[FaceCase, Errors]]:
    """Errors of coupled and of uncoupled slices, {"coupled": {case: errors}, "uncoupled": ...}."""
    names = list(_stored()) if pairs is None else pairs
    return {
        title: {case: error for name in names for case, error in errors(run(name, coupled=coupled)).items()}
        for title, coupled in (("coupled", True), ("uncoupled", False))
    }


def print_face(results: dict[str, dict[FaceCase, Errors]]) -> None:
    """Reference and errors of every case, of coupled and uncoupled slices."""
    console = Console(width=_WIDTH)
    console.print("Across the face, against three-dimensional finite elements: coupled / uncoupled slices")
    table = Table("case")
    table.add_column("K", justify="right")
    for title in TITLES.values():
        table.add_column(title, justify="right")
    for case in results["coupled"]:
        cells = [" / ".join(_text(getattr(found[case], key), key) for found in results.values()) for key in TITLES]
        table.add_row(str(case), f"{reference(case).factor:.2f}", *cells)
    console.print(table)


def _text(value: float | None, key: str) -> str:
    return "-" if value is None else f"{value:+.{2 if key in ('shift', 'ppte') else 1}f}"


def exceeded(results: dict[FaceCase, Errors], bounds: dict[str, dict[str, float]]) -> list[str]:
    """One line for every error of the coupled slices that has grown past its recorded bound."""
    return [
        f"{case} {key}: {value:.4g} > {bounds[str(case)][key]:.4g}"
        for case, key, value in _values(results)
        # written so that nan counts as exceeded
        if not abs(value) <= bounds[str(case)][key] + _MARGIN[key]
    ]


def record(results: dict[FaceCase, Errors], path: Path = BOUNDS) -> None:
    """Writes the errors as the new bounds."""
    bounds: dict[str, dict[str, float]] = {}
    for case, key, value in _values(results):
        bounds.setdefault(str(case), {})[key] = float(f"{abs(value):.3g}")
    path.write_text(json.dumps(bounds, indent=2) + "\n")


def load_bounds(path: Path = BOUNDS) -> dict[str, dict[str, float]]:
    """Recorded errors per case and quantity."""
    return json.loads(path.read_text())


def _values(results: dict[FaceCase, Errors]) -> Iterator[tuple[FaceCase, str, float]]:
    for case, error in results.items():
        for key in TITLES:
            value = getattr(error, key)
            if value is not None:
                yield case, key, value
