"""Internal pairs, their ring gears held all round and on arcs, against finite elements (see `reference/README.md`)."""

import functools
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from rich.console import Console
from rich.table import Table

import jaxgear as jg
from jaxgear.geometry import SupportArcs

from .cases import PAIR_COUNT, REFERENCE

BOUNDS = Path(__file__).parent / "internal_bounds.json"
# What a cycle is called close by: mean TE [%], PPTE [%] or [um].
CLOSE = {"mean": 3.0, "ripple": 7.0, "ripple_um": 0.15}
_MARGIN = {"mean": 0.1, "ripple_um": 0.005, "rms": 0.1}
_POSITIONS = 256
_SHARP = 1e-3  # radius of the tip edges [mm]
_WIDTH = 120


@dataclass(frozen=True)
class Errors:
    """Errors of the transmission error over a mesh cycle.

    Attributes:
        mean: of the mean [%].
        ripple: of the peak-to-peak value [%].
        ripple_um: of the peak-to-peak value [um].
        rms: root mean square of the curve over its mean [%].
    """

    mean: float
    ripple: float
    ripple_um: float
    rms: float

    @property
    def close(self) -> bool:
        """True if the errors are within `CLOSE`."""
        even = abs(self.ripple) <= CLOSE["ripple"] or abs(self.ripple_um) <= CLOSE["ripple_um"]
        return even and abs(self.mean) <= CLOSE["mean"]


TITLES = {"mean": "mean TE \\[%]", "ripple_um": "PPTE \\[um]", "rms": "rms \\[%]"}
Results = dict[str, dict[str, Errors]]  # by pair with support, plane and structure, then by torque and modification
Structure = Callable[[jg.GearPair, str], jg.compliance.AbstractCompliance]
FINITE_ELEMENTS = "finite elements"


@functools.cache
def stored() -> dict:
    """Supports, gears, modifications and curves of the reference."""
    return json.loads((REFERENCE / "internal.json").read_text())


def closed_form(pair: jg.GearPair, plane: str) -> jg.compliance.AbstractCompliance:
    """The default structure."""
    return jg.default_compliance(plane)


def gear_pair(name: str, support: str) -> jg.GearPair:
    """The pair of that name on one of the supports."""
    data, arcs = stored()["pairs"][name]["gears"], stored()["supports"][support]
    both = {**data["both"], "tip_edge_radius": _SHARP}
    held = None if arcs is None else SupportArcs(**arcs)
    return jg.GearPair(jg.Gear(**both, **data["planet"]), jg.RingGear(**both, **data["ring"], support=held))


def run(name: str, group: str, structure: Structure = closed_form) -> dict[str, Errors]:
    """Errors of all cycles of a pair; the group is the support and the plane of the reference."""
    support, plane = group.split()
    data = stored()["pairs"][name]
    curves, modifications = data["curves"][group], data["modifications"]
    sizes = jg.Resolution(positions=_POSITIONS, pairs=PAIR_COUNT)
    gears = gear_pair(name, support)
    mesh = jg.prepare(gears, compliance=structure(gears, plane), resolution=sizes)

    def solved(values):
        torque, amount, length, coefficients = values
        flanks = [jg.TipRelief(amount[gear], length, jg.Polynomial(coefficients)) for gear in (0, 1)]
        cycle = jg.solve(mesh, torque, pinion=flanks[0], wheel=flanks[1])
        return cycle.transmission_error, cycle.converged

    cases = [key.split() for key in curves]
    numbers = [jnp.asarray([float(torque) for torque, _ in cases])]
    for field in ("amount", "length", "coefficients"):
        numbers.append(jnp.asarray([modifications[modification][field] for _, modification in cases]))
    found, converged = map(np.asarray, jg.quick_jit(lambda of: jax.lax.map(solved, of))(tuple(numbers)))
    if not converged.all():
        raise RuntimeError(f"{name} {group}: contact not converged")
    pitch, phase = float(mesh.path_of_contact.base_pitch), np.asarray(mesh.phase)
    return {key: errors(np.asarray(curves[key]), phase, curve, pitch) for key, curve in zip(curves, found)}


def errors(truth: np.ndarray, phase: np.ndarray, curve: np.ndarray, base_pitch: float) -> Errors:
    """Errors of a curve at finer positions, which are the mean of both gears; the reference holds the ring gear.

    On arcs the curves do not close: positions of the ring gear before the first one take its value.
    """
    wheel = phase - 0.5e-3 * curve / base_pitch
    curve = np.interp(np.arange(truth.size) / truth.size, wheel, curve)
    ripple = float(np.ptp(truth))
    return Errors(
        mean=100 * float(curve.mean() / truth.mean() - 1),
        ripple=100 * (float(np.ptp(curve)) / ripple - 1),
        ripple_um=float(np.ptp(curve)) - ripple,
        rms=100 * float(np.sqrt(np.mean((curve - truth) ** 2)) / truth.mean()),
    )


def compare() -> Results:
    """Errors of every cycle; those of rims held all round by the finite-element structure too."""
    groups = [(name, group) for name, data in stored()["pairs"].items() for group in data["curves"]]
    found = {f"{name} {group}": run(name, group) for name, group in groups}
    for name, group in groups:
        if stored()["supports"][group.split()[0]] is None:
            found[f"{name} {group}, {FINITE_ELEMENTS}"] = run(name, group, jg.finite_element_compliance)
    return found


def print_internal(results: Results) -> None:
    """Worst errors by pair, support and plane, and the cycles that are not close."""
    console = Console(width=_WIDTH)
    table = Table("pair, support, plane", title="Internal pairs, against finite elements", title_justify="left")
    table.add_column("cycles", justify="right")
    for title in TITLES.values():
        table.add_column(title, justify="right")
    for group, of in results.items():
        table.add_row(group, str(len(of)), *(f"{value:.2f}" for value in _worst(of).values()))
    console.print(table)
    far = [f"{group} {case}" for group, of in results.items() for case, error in of.items() if not error.close]
    console.print(f"{len(far)} of {sum(map(len, results.values()))} cycles beyond {CLOSE}: {', '.join(far)}")


def exceeded(results: Results, path: Path = BOUNDS) -> list[str]:
    """One line for every error that has grown past its recorded bound."""
    bounds = json.loads(path.read_text())
    return [
        f"{group} {key}: {value:.4g} > {bounds[group][key]:.4g}"
        for group, key, value in _values(results)
        # written so that nan counts as exceeded
        if not value <= bounds[group][key] + _MARGIN[key]
    ]


def record(results: Results, path: Path = BOUNDS) -> None:
    """Writes the worst errors as the new bounds."""
    bounds: dict[str, dict[str, float]] = {}
    for group, key, value in _values(results):
        bounds.setdefault(group, {})[key] = float(f"{value:.3g}")
    path.write_text(json.dumps(bounds, indent=2) + "\n")


def _values(results: Results) -> Iterator[tuple[str, str, float]]:
    for group, of in results.items():
        for key, value in _worst(of).items():
            yield group, key, value


def _worst(of: dict[str, Errors]) -> dict[str, float]:
    return {key: float(np.max([abs(getattr(error, key)) for error in of.values()])) for key in TITLES}
