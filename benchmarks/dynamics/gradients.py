"""Derivatives of K_v and of the rms of the approach: against central differences, and what they cost."""

from collections.abc import Iterator
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from rich.console import Console
from rich.table import Table

from jaxgear.dynamics import find_orbit, settle

from .exact_flow import exact_orbit
from .known import RATIO, SHARE, ZETA, frequency, rectangular
from .pair import DAMPING_RATIO, LENGTH, POSITIONS, QUICK_POSITIONS, TORQUE, oscillator
from .timing import best_of

_OMEGA = 0.9
_POINT = np.array([_OMEGA, ZETA, RATIO])
_EXACT_WITHIN = 1e-3  # of the exact benchmark
_NEAR = (2.03, 1.64)
_BY = 1e-5  # of the central differences of the closed form, which has no kinks over its parameters
_AROUND = (1e-5, 1e-7)  # widths of the steps in which contact is lost and made [base pitches]
_EVEN_STEPS = 1000
_SPEED = 3500.0  # mesh frequency of the pair [Hz]
_AMOUNT = 3.0  # of its reliefs [um]
_PARAMETERS = {"amount [um]": _AMOUNT, "length [mm]": LENGTH, "torque [N m]": TORQUE, "damping ratio": DAMPING_RATIO}
_PAIR_WITHIN = 1e-4  # of a pair, relative to the largest of what is compared by the same step
_RELATIVE = 2e-4  # step of the central differences
_STEPS, _SETTLE = 256, 150


@dataclass(frozen=True)
class Slope:
    """A derivative in two ways.

    Attributes:
        of, by: which.
        derivative, difference: of the library, and by central differences.
    """

    of: str
    by: str
    derivative: float
    difference: float

    @property
    def error(self) -> float:
        """Relative to the derivative."""
        return abs(self.derivative / self.difference - 1)


def exact_slopes() -> Iterator[Slope]:
    """Of the exact benchmark, against central differences of its closed form; short steps lie where contact is lost and
    made, since a kink inside of a step costs the derivative all but its first order.
    """

    def exact(point):
        orbit = exact_orbit(point[0], _NEAR, zeta=point[1], ratio=point[2])
        return np.array([orbit.rms, orbit.factor])

    places = exact_orbit(_OMEGA, _NEAR, zeta=ZETA, ratio=RATIO).places
    short = [places + sign * width for width in _AROUND for sign in (-1, 1)]
    even = np.linspace(0.0, 1.0, _EVEN_STEPS + 1)
    nodes = jnp.asarray(np.unique(np.concatenate([even, [SHARE], *short])))

    @jax.jit
    def quantities(point):
        omega, zeta, ratio = point
        orbit = find_orbit(rectangular(zeta, ratio), frequency(omega), ([_NEAR[0]], [_NEAR[1]]), steps=nodes)
        return jnp.stack([orbit.approach_rms, orbit.dynamic_factor])

    with jax.numpy_rank_promotion("allow"):
        found = np.asarray(jax.jacfwd(quantities)(jnp.asarray(_POINT)))
    for i, by in enumerate(("Omega", "zeta", "stiffness ratio")):
        away = _BY * np.eye(3)[i]
        difference = (exact(_POINT + away) - exact(_POINT - away)) / (2 * _BY)
        for j, of in enumerate(("rms", "K_v")):
            yield Slope(of, by, float(found[j, i]), float(difference[j]))


def _of_pair(positions: int):
    """A pair, the numbers that it is made of, and K_v and rms [um] by those and a settled state."""

    def made(point):
        amount, length, torque, damping = point
        return oscillator(amount, length, torque=torque, damping_ratio=damping, positions=positions)

    def quantities(point, start):
        orbit = find_orbit(made(point), _SPEED, start, steps=_STEPS)
        return jnp.stack([orbit.dynamic_factor, orbit.approach_rms])

    point = jnp.asarray(list(_PARAMETERS.values()))
    return eqx.filter_jit(made)(point), point, quantities


def pair_slopes(*, quick: bool) -> Iterator[Slope]:
    """Of a gear pair through its contact analyses, against central differences of the whole."""
    moving, point, quantities = _of_pair(QUICK_POSITIONS if quick else POSITIONS)
    start = settle(moving, _SPEED, ([10.0], [0.0]), cycles=_SETTLE, steps=_STEPS)
    value = jax.jit(quantities)
    slopes = np.asarray(jax.jit(jax.jacfwd(quantities))(point, start))
    for i, by in enumerate(_PARAMETERS):
        away = np.zeros(len(point))
        away[i] = _RELATIVE * float(point[i])
        difference = (np.asarray(value(point + away, start)) - np.asarray(value(point - away, start))) / (2 * away[i])
        for j, of in enumerate(("K_v", "rms [um]")):
            yield Slope(of, by, float(slopes[j, i]), float(difference[j]))


def costs(*, quick: bool) -> dict[str, float]:
    """Processor time of value and gradient over that of the value: of an orbit by all numbers of its oscillator, and of
    a design through its contact analyses.
    """
    moving, point, quantities = _of_pair(QUICK_POSITIONS if quick else POSITIONS)
    start = settle(moving, _SPEED, ([10.0], [0.0]), cycles=_SETTLE, steps=_STEPS)

    def factor(moving):
        return find_orbit(moving, _SPEED, start, steps=_STEPS).dynamic_factor

    def of_design(point):
        return quantities(point, start)[0]

    orbit, with_orbit = eqx.filter_jit(factor), eqx.filter_jit(eqx.filter_value_and_grad(factor))
    design, with_design = jax.jit(of_design), jax.jit(jax.value_and_grad(of_design))
    calls = {
        "orbit": lambda: orbit(moving),
        "orbit with gradient": lambda: with_orbit(moving),
        "design": lambda: design(point),
        "design with gradient": lambda: with_design(point),
    }
    times = best_of(calls, 2 if quick else 5)
    return {name: times[f"{name} with gradient"].processor / times[name].processor for name in ("orbit", "design")}


def gradient_section(console: Console, *, quick: bool) -> list[str]:
    missed = []
    for title, rows, within in (
        (f"Rectangular stiffness at Omega {_OMEGA}, against the closed form", list(exact_slopes()), _EXACT_WITHIN),
        (f"Gear pair at {_SPEED:g} Hz, against central differences", list(pair_slopes(quick=quick)), _PAIR_WITHIN),
    ):
        table = Table("derivative of", "by", title=title)
        for heading in ("jaxgear", "difference", "relative error"):
            table.add_column(heading, justify="right")
        for row in rows:
            numbers = f"{row.derivative:.6g}", f"{row.difference:.6g}", f"{row.error:.1e}"
            table.add_row(row.of.replace("[", r"\["), row.by.replace("[", r"\["), *numbers)
            if not row.error <= within:
                missed.append(f"derivative of {row.of} by {row.by} is off by {row.error:.1e}, at most {within:g}")
        console.print(table)
    found = costs(quick=quick)
    console.print(
        f"Value and gradient over value, processor time: {found['orbit']:.1f} for an orbit by all numbers of its map, "
        f"{found['design']:.1f} for a design by {len(_PARAMETERS)} of its numbers, map included",
        highlight=False,
    )
    return missed
