"""Helical pairs against three-dimensional finite elements of whole gears (see `reference/README.md`)."""

import functools
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from rich.console import Console
from rich.table import Table

import jaxgear as jg

from .cases import PAIR_COUNT, REFERENCE

BOUNDS = Path(__file__).parent / "helical_bounds.json"
# What a case is called close by: mean TE [%], PPTE [%] or [um], factor [%], line load [%].
CLOSE = {"mean": 4.0, "ripple": 8.0, "ripple_um": 0.1, "factor": 6.0, "load": 8.0}
_MARGIN = {"mean": 0.1, "ripple": 0.3, "factor": 0.2, "load": 0.2, "ends": 1.0}
_WIDTH = 120
_FINER = 2  # slices of the mesh in one of the reference, so that PPTE no longer depends on them
_SEEN = 0.5  # share of the mean from which the load of an end slice is compared


@dataclass(frozen=True)
class Errors:
    """Errors of a mesh cycle.

    Attributes:
        mean: of the mean transmission error [%].
        ripple: of the peak-to-peak transmission error [%].
        factor: of the largest over the mean line load of the face, summed over pairs, averaged over the cycle [%].
        load: of this line load but for the end slices, root mean square over its mean [%].
        ends: of the end slice that is farther off, of those with at least half of the mean line load [%].
        ripple_um: as `ripple` [um].
    """

    mean: float
    ripple: float
    factor: float
    load: float
    ends: float
    ripple_um: float

    @property
    def close(self) -> bool:
        """Whether all are within `CLOSE`."""
        even = abs(self.ripple) <= CLOSE["ripple"] or abs(self.ripple_um) <= CLOSE["ripple_um"]
        return even and all(abs(getattr(self, key)) <= CLOSE[key] for key in ("mean", "factor", "load"))


TITLES = {
    "mean": "mean TE \\[%]",
    "ripple": "PPTE \\[%]",
    "factor": "K \\[%]",
    "load": "line load, rms \\[%]",
    "ends": "end slices \\[%]",
}


@functools.cache
def stored() -> dict:
    """Gears and cases of the reference."""
    return json.loads((REFERENCE / "helical.json").read_text())


def gear_pair(name: str) -> jg.GearPair:
    """Positive y enters first, as in the reference: a right hand that turns counterclockwise."""
    data = stored()[name]
    gears = [
        jg.Gear(
            teeth,
            data["normal_module"],
            face_width=data["face_width"],
            bore_diameter=bore,
            helix_angle=hand * data["helix_angle"],
        )
        for teeth, bore, hand in zip(data["teeth"], data["bore_diameter"], (1.0, -1.0))
    ]
    return jg.GearPair(*gears)


def run(name: str) -> dict[str, Errors]:
    """Errors of all cases of a pair, at positions of the reference and with contacts at their nominal place.

    Line loads are means over its slices, each of which is several of the mesh.
    """
    data = stored()[name]
    cases, slices = data["cases"], len(next(iter(data["cases"].values()))["face_load"])
    sizes = jg.Resolution(positions=data["positions"], slices=_FINER * slices, pairs=PAIR_COUNT, slide_steps=0)
    mesh = jg.prepare(gear_pair(name), resolution=sizes)
    lengths = [data["relief_part"] * (side.tip_roll_length - side.pitch_roll_length) for side in mesh.sides]
    keys = "torque_Nm", "tip_relief_um", "lead_crowning_um", "lead_slope_um"

    def solved(values):
        torque, relief, crowning, slope = values
        pinion, wheel = (jg.TipRelief(relief, length, jg.Linear()) for length in lengths)
        cycle = jg.solve(mesh, torque, pinion=jg.LeadCrowning(crowning) + jg.LeadSlope(slope) + pinion, wheel=wheel)
        load = jnp.mean(jnp.sum(cycle.line_load, axis=0), axis=-1)
        return jnp.mean(load.reshape(slices, _FINER), axis=-1), cycle.transmission_error, cycle.converged

    numbers = jnp.asarray([[case[key] for key in keys] for case in cases.values()])
    load, error, converged = map(np.asarray, jg.quick_jit(lambda of: jax.lax.map(solved, of))(numbers))
    if not converged.all():
        raise RuntimeError(f"{name}: contact not converged")
    return {f"{name} {case}": _errors(*found) for case, *found in zip(cases, cases.values(), load, error)}


def _errors(case: dict, load: np.ndarray, error: np.ndarray) -> Errors:
    found, true = load / load.mean(), np.asarray(case["face_load"])
    ends = [100 * (found[end] / true[end] - 1) for end in (0, -1) if true[end] > _SEEN]
    return Errors(
        mean=100 * float(error.mean() / case["mean_te_um"] - 1),
        ripple=100 * float(np.ptp(error) / case["ppte_um"] - 1),
        factor=100 * float(found.max() / true.max() - 1),
        load=100 * float(np.sqrt(np.mean((found - true)[1:-1] ** 2))),
        ends=float(max(ends, key=abs, default=0.0)),
        ripple_um=float(np.ptp(error) - case["ppte_um"]),
    )


def compare() -> dict[str, Errors]:
    """Errors of every case."""
    return {case: error for name in stored() for case, error in run(name).items()}


def print_helical(results: dict[str, Errors]) -> None:
    """Errors of every case, and how many are close."""
    console = Console(width=_WIDTH)
    table = Table("case", title="Helical pairs, against three-dimensional finite elements", title_justify="left")
    for title in TITLES.values():
        table.add_column(title, justify="right")
    for case, error in results.items():
        table.add_row(case, *(f"{getattr(error, key):+.1f}" for key in TITLES))
    console.print(table)
    close = sum(error.close for error in results.values())
    console.print(f"{close} of {len(results)} cases within {CLOSE}", highlight=False)


def exceeded(results: dict[str, Errors], path: Path = BOUNDS) -> list[str]:
    """One line for every error that has grown past its recorded bound."""
    bounds = json.loads(path.read_text())
    return [
        f"{case} {key}: {value:.4g} > {bounds[case][key]:.4g}"
        for case, key, value in _values(results)
        # written so that nan counts as exceeded
        if not abs(value) <= bounds[case][key] + _MARGIN[key]
    ]


def record(results: dict[str, Errors], path: Path = BOUNDS) -> None:
    """Writes the errors as the new bounds."""
    bounds: dict[str, dict[str, float]] = {}
    for case, key, value in _values(results):
        bounds.setdefault(case, {})[key] = float(f"{abs(value):.3g}")
    path.write_text(json.dumps(bounds) + "\n")


def _values(results: dict[str, Errors]) -> Iterator[tuple[str, str, float]]:
    for case, error in results.items():
        for key in TITLES:
            yield case, key, getattr(error, key)
