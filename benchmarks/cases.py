"""The finite-element reference cases and the same cases as jaxgear inputs (see `reference/README.md`)."""

import csv
import functools
import json
from dataclasses import dataclass
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

import jaxgear as jg

REFERENCE = Path(__file__).parent / "reference"
PAIRS = ("A", "B", "C", "D", "E", "I", "L")
PLANES = ("stress", "strain")
PAIR_COUNT = 4


@dataclass(frozen=True)
class Case:
    """One operating point: gear pair, plane state, torque on the pinion [N m] and name of the modification."""

    pair: str
    plane: str
    torque: float
    modification: str

    def __str__(self) -> str:
        return f"{self.pair} {self.plane} {self.torque:g} N m {self.modification}"


@dataclass(frozen=True)
class Curves:
    """One mesh cycle. Pair axis in the order of jaxgear: 0 leads the reference pair 1 by one base pitch.

    Attributes:
        transmission_error: [um], shape (positions,).
        unloaded_transmission_error: [um], shape (positions,).
        force: [N], shape (pairs, positions).
        pressure: [MPa], shape (pairs, positions); nan where a tip corner carries load.
    """

    transmission_error: np.ndarray
    unloaded_transmission_error: np.ndarray
    force: np.ndarray
    pressure: np.ndarray

    @property
    def share(self) -> np.ndarray:
        """Share of every pair in the total force."""
        return self.force / self.force.sum(axis=0)


@functools.cache
def inputs() -> dict:
    """Gear data, planes, torques and modifications of every pair, as stored."""
    return json.loads((REFERENCE / "cases.json").read_text())


def select(pairs=PAIRS, planes=PLANES) -> list[Case]:
    """All cases of the given pairs and planes, where the reference has them.

    Raises:
        ValueError: for an unknown pair or plane, and when nothing is left.
    """
    unknown = sorted(set(pairs) - set(PAIRS)) + sorted(set(planes) - set(PLANES))
    if unknown:
        raise ValueError(f"unknown cases {', '.join(unknown)}: choose from {', '.join(PAIRS + PLANES)}")
    found = [
        Case(pair, plane, float(torque), modification)
        for pair in pairs
        for plane in planes
        if plane in inputs()[pair]["planes"]
        for torque in inputs()[pair]["torques"]
        for modification in inputs()[pair]["modifications"]
    ]
    if not found:
        raise ValueError("no cases selected: nothing to compare")
    return found


def strong(tree):
    """The tree with NumPy-typed leaves: Python floats are weakly typed in JAX, integers not, and both kinds retrace."""
    return jax.tree.map(lambda leaf: jnp.asarray(np.asarray(leaf)), tree)


@functools.cache
def gear_pair(name: str) -> jg.GearPair:
    """The gear pair of that name; every pair has the same pytree structure, so one compilation serves all."""
    data = inputs()[name]
    material = jg.Material(data["elastic_modulus"], data["poisson_ratio"])
    gears = [
        jg.Gear(
            gear["teeth"],
            data["module"],
            profile_shift=gear["profile_shift"],
            face_width=data["face_width"],
            bore_diameter=gear["bore_diameter"],
            tip_diameter=gear["tip_diameter"],
            material=material,
            **data["rack"],
        )
        for gear in data["gears"]
    ]
    return strong(jg.GearPair(*gears))


@functools.cache
def path_of_contact(name: str) -> jg.geometry.PathOfContact:
    """Path of contact of the pair of that name, as Python floats."""
    return jax.tree.map(float, jg.path_of_contact(gear_pair(name)))


@functools.cache
def modifications(case: Case) -> tuple[jg.microgeometry.Sum, jg.microgeometry.Sum]:
    """Modifications of pinion and wheel: a tip relief and a profile crowning in every case, of zero amount where the
    case has none, so that all cases share one compiled solution.
    """
    data = inputs()[case.pair]["modifications"][case.modification]
    relief = data.get("tip_relief", {"amount": 0.0, "coefficients": [0.0, 0.0, 0.0]})
    crowning = jg.ProfileCrowning(data.get("profile_crowning", {"amount": 0.0})["amount"])
    curve = jg.Polynomial(relief["coefficients"])
    pinion, wheel = (jg.TipRelief(relief["amount"], length, curve) + crowning for length in relief_lengths(case))
    return strong(pinion), strong(wheel)


def relief_lengths(case: Case) -> tuple[float, float]:
    """Lengths of the tip reliefs of pinion and wheel [mm], zero where a case has none."""
    data = inputs()[case.pair]["modifications"][case.modification]
    length = data.get("tip_relief", {"length": 0.0})["length"]
    if length == "long":
        length = float(jg.long_relief_length(gear_pair(case.pair)))
    elif length == "pitch":
        path = path_of_contact(case.pair)
        return path.end, -path.start
    return length, length


def reference(case: Case) -> Curves:
    """Finite-element result of a case."""
    return _table(case.pair, case.plane)[case.torque, case.modification]


def as_the_reference(case: Case, curves: Curves) -> Curves:
    """Curves of a model of jaxgear at the positions of the reference.

    The reference holds the wheel at its phase and advances the pinion; jaxgear counts the mean position of both gears,
    which is half a transmission error further. The curves are interpolated, so they should be finer than the reference.
    """
    pairs, positions = curves.force.shape
    count = reference(case).transmission_error.size
    phase, wanted = np.arange(positions) / positions, np.arange(count) / count
    wheel = phase - 0.5e-3 * curves.transmission_error / path_of_contact(case.pair).base_pitch
    # along the path one pair takes the place of its predecessor, the last of the axis being the first
    offset = np.arange(pairs)[:, None] - pairs
    travelled, places = (wheel + offset).ravel(), (wanted + offset).ravel()

    def pair_curve(values):
        return np.interp(places, travelled, values[::-1].ravel()).reshape(pairs, count)[::-1]

    return Curves(
        np.interp(wanted, wheel, curves.transmission_error, period=1.0),
        np.interp(wanted, wheel, curves.unloaded_transmission_error, period=1.0),
        pair_curve(curves.force),
        pair_curve(curves.pressure),
    )


@functools.cache
def _table(pair: str, plane: str) -> dict[tuple[float, str], Curves]:
    with (REFERENCE / f"{pair}_{plane}.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    groups: dict[tuple[float, str], list] = {}
    for row in rows:
        groups.setdefault((float(row["torque_Nm"]), row["modification"]), []).append(row)

    def column(group, name):
        return np.array([float(row[name] or "nan") for row in group])

    def pairs(group, name):
        return np.stack([column(group, name.format(i)) for i in range(PAIR_COUNT)])

    return {
        key: Curves(
            column(group, "te_um"),
            column(group, "te_unloaded_um"),
            pairs(group, "force_{}_N"),
            pairs(group, "pressure_{}_MPa"),
        )
        for key, group in groups.items()
    }
