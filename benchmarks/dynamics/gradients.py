"""Derivatives of K_v and of the rms of the DTE: against central differences, and what they cost."""

from collections.abc import Iterable, Iterator
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
from .pair import DAMPING_RATIO, LENGTH, TORQUE, mesh, oscillator
from .timing import best_of

_OMEGA = 0.9
_POINT = np.array([_OMEGA, ZETA, RATIO])
_EXACT_WITHIN = 1e-4
_NEAR = (2.03, 1.64)
_BY = 1e-5  # of the central differences of the closed form, which has no kinks over its parameters
_AROUND = (1e-5, 1e-7)  # widths of the steps in which contact is lost and made [base pitches]
_EVEN_STEPS = 1000
_SPEED = 3500.0  # mesh frequency of the pair [Hz]
_AMOUNT = 3.0  # of its reliefs [um]
_PARAMETERS = {"amount [um]": _AMOUNT, "length [mm]": LENGTH, "torque [N m]": TORQUE, "damping ratio": DAMPING_RATIO}
_PAIR_WITHIN = 1e-4
_RELATIVE = 2e-4  # step of the central differences
_STEPS, _SETTLE = 256, 150
_REPETITIONS = 5


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
        return jnp.stack([orbit.dte_rms, orbit.dynamic_factor])

    with jax.numpy_rank_promotion("allow"):
        found = np.asarray(jax.jacfwd(quantities)(jnp.asarray(_POINT)))
    for i, by in enumerate(("Omega", "zeta", "stiffness ratio")):
        away = _BY * np.eye(3)[i]
        difference = (exact(_POINT + away) - exact(_POINT - away)) / (2 * _BY)
        for j, of in enumerate(("rms", "K_v")):
            yield Slope(of, by, float(found[j, i]), float(difference[j]))


@jax.jit
def _made(of, point):
    amount, length, torque, damping = point
    return oscillator(of, amount, length, torque=torque, damping_ratio=damping)


def _quantities(moving, start):
    orbit = find_orbit(moving, _SPEED, start, steps=_STEPS)
    return jnp.stack([orbit.dynamic_factor, orbit.dte_rms])


def _settled(moving):
    return settle(moving, _SPEED, ([10.0], [0.0]), cycles=_SETTLE, steps=_STEPS)


def pair_slopes() -> Iterator[Slope]:
    """Of a gear pair through its contact analyses, against central differences of the whole."""
    of, point = mesh(), jnp.asarray(list(_PARAMETERS.values()))
    start = _settled(_made(of, point))

    def quantities(point):
        return _quantities(_made(of, point), start)

    value = jax.jit(quantities)
    slopes = np.asarray(jax.jit(jax.jacfwd(quantities))(point))
    for i, by in enumerate(_PARAMETERS):
        away = np.zeros(len(point))
        away[i] = _RELATIVE * float(point[i])
        difference = (np.asarray(value(point + away)) - np.asarray(value(point - away))) / (2 * away[i])
        for j, of in enumerate(("K_v", "rms [um]")):
            yield Slope(of, by, float(slopes[j, i]), float(difference[j]))


def orbit_cost() -> float:
    """Processor time of value and gradient of K_v over that of the value: by all numbers of the oscillator."""
    moving = oscillator(mesh(), _AMOUNT)
    start = _settled(moving)
    value = eqx.filter_jit(lambda moving: _quantities(moving, start)[0])
    both = eqx.filter_jit(eqx.filter_value_and_grad(lambda moving: _quantities(moving, start)[0]))
    return _ratio(lambda: value(moving), lambda: both(moving))


def design_cost() -> float:
    """The same by the numbers of a design, its force map included."""
    of, point = mesh(), jnp.asarray(list(_PARAMETERS.values()))
    start = _settled(_made(of, point))

    def factor(point):
        return _quantities(_made(of, point), start)[0]

    value, both = jax.jit(factor), jax.jit(jax.value_and_grad(factor))
    return _ratio(lambda: value(point), lambda: both(point))


def _ratio(value, both) -> float:
    times = best_of({"value": value, "both": both}, _REPETITIONS)
    return times["both"].processor / times["value"].processor


def gradient_section(console: Console, *, quick: bool) -> list[str]:
    """Quick: of the exact benchmark alone."""
    missed = _compared(
        console, f"Rectangular stiffness at Omega {_OMEGA:g}, against the closed form", exact_slopes(), _EXACT_WITHIN
    )
    if quick:
        return missed
    title = f"Gear pair at {_SPEED:g} Hz, through its contact analyses, against central differences"
    missed += _compared(console, title, pair_slopes(), _PAIR_WITHIN)
    console.print(
        f"Value and gradient over value, processor time: {orbit_cost():.1f} for an orbit by all numbers of its force "
        f"map; {design_cost():.1f} for a design by {len(_PARAMETERS)} numbers, its force map included",
        highlight=False,
    )
    return missed


def _compared(console: Console, title: str, rows: Iterable[Slope], within: float) -> list[str]:
    missed, table = [], Table("derivative of", "by", title=title)
    for heading in ("jaxgear", "difference", "relative error"):
        table.add_column(heading, justify="right")
    for row in rows:
        numbers = f"{row.derivative:.6g}", f"{row.difference:.6g}", f"{row.error:.1e}"
        table.add_row(row.of.replace("[", r"\["), row.by.replace("[", r"\["), *numbers)
        if not row.error <= within:
            missed.append(f"derivative of {row.of} by {row.by} is off by {row.error:.1e}, at most {within:g}")
    console.print(table)
    return missed
