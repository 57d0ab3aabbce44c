"""Order of convergence of the integrator over the steps per mesh cycle: state of an orbit, its K_v and its rms."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from rich.console import Console
from rich.table import Table

from jaxgear.dynamics import AbstractMeshForce, Oscillator, RectangularStiffness, speed_sweep, steps_for
from jaxgear.numerics import number

from .exact_flow import exact_orbit
from .known import RATIO, SHARE, ZETA, frequency, rectangular, stiffness
from .pair import QUICK_SPEEDS, SPEEDS, one_of

STEPS = 32, 64, 128, 256, 512, 1024
MOST_STEPS = 4096  # of the reference where nothing is known in closed form
_SMOOTH = 4.0  # order where no kink lies inside of a step
_FLOOR = 1e-11  # errors below are rounding and what the search for the steady state leaves
_SETTLED = 1e-13
_LACKING = 0.3  # by which a measured order may fall short of four; errors of kinks scatter with their place in a step
_PERCENT = 0.1  # largest change of K_v and rms of a gear pair with the chosen steps
_FINER = 8  # times as many steps, which those are compared with


class SmoothForce(AbstractMeshForce):
    """A force that has derivatives of every order: (1 + 0.3 cos(2 pi phase)) (q + q^3 / 10)."""

    variation: Float[Array, ""] = number("", default=0.3)
    cubic: Float[Array, ""] = number("", default=0.1)

    def at(self, phase):
        return 1 + self.variation * jnp.cos(2 * jnp.pi * phase)

    def force(self, place, dte):
        return place * (dte + self.cubic * dte**3)


class PlacedSteps(RectangularStiffness):
    """A rectangular stiffness whose steps are even between given mesh positions, as many between each two.

    Attributes:
        places: from 0 to 1 [base pitches], shape (places,).
    """

    places: Float[Array, " places"] = number("base pitches", shape=("places",))

    def nodes(self, steps: int) -> Float[Array, " nodes"]:
        count = len(self.places) - 1
        return jnp.interp(jnp.linspace(0.0, count, steps + 1), jnp.arange(count + 1.0), self.places)


@dataclass(frozen=True)
class Convergence:
    """Errors of one orbit over the steps per cycle.

    Attributes:
        name: of the case.
        steps: per cycle, increasing.
        state, factor, rms: errors of the state at mesh position 0, of K_v and of the rms, one for each.
        expected: order of the state's error that theory leads to.
    """

    name: str
    steps: tuple[int, ...]
    state: np.ndarray
    factor: np.ndarray
    rms: np.ndarray
    expected: float

    @property
    def order(self) -> float:
        return order_of(self.steps, self.state)

    @property
    def converges(self) -> bool:
        """Whether it does as theory says, where no kink or jump lies inside of a step."""
        return self.expected < _SMOOTH or self.order >= _SMOOTH - _LACKING


def order_of(steps: Sequence[int], errors) -> float:
    """Slope of the error over the step, both in logarithms, of the errors above rounding; nan for less than two."""
    errors = np.asarray(errors)
    above = errors > _FLOOR
    if above.sum() < 2:
        return np.nan
    return float(-np.polyfit(np.log(np.asarray(steps)[above]), np.log(errors[above]), 1)[0])


def orders(steps: Sequence[int] = STEPS) -> Iterator[Convergence]:
    """A smooth force, and the rectangular one with steps that end at none, one and all of its jumps and kinks."""
    smooth = rectangular(force=SmoothForce())
    reference = _numbers(smooth, 0.9, MOST_STEPS)
    yield _errors("smooth force", smooth, 0.9, reference, steps, _SMOOTH)
    kept = exact_orbit(1.2, (1.3, 0.9), zeta=ZETA, ratio=RATIO)
    lost = exact_orbit(1.0, (1.66, 1.46), zeta=ZETA, ratio=RATIO)
    even, jumps = np.linspace(0, 1, 5), np.array([0.0, SHARE / 2, SHARE, (1 + SHARE) / 2, 1.0])
    everything = np.sort([0.0, SHARE, *lost.places, 1.0])
    for name, omega, orbit, places, expected in (
        ("in contact, no node at the jumps", 1.2, kept, even, 1.0),
        ("in contact, nodes at the jumps", 1.2, kept, jumps, _SMOOTH),
        ("contact loss, no node at the jumps", 1.0, lost, even, 1.0),
        ("contact loss, nodes at the jumps", 1.0, lost, jumps, 2.0),
        ("contact loss, nodes at jumps and kinks", 1.0, lost, everything, _SMOOTH),
    ):
        oscillator = rectangular(force=PlacedSteps(*stiffness(), SHARE, places))
        exact = np.array([orbit.x0, orbit.v0, orbit.factor, orbit.rms])
        yield _errors(name, oscillator, omega, exact, steps, expected)


def _errors(name, oscillator, omega, reference, steps, expected) -> Convergence:
    found = np.abs([_numbers(oscillator, omega, count) - reference for count in steps])
    return Convergence(name, tuple(steps), found[:, :2].max(axis=1), found[:, 2], found[:, 3], expected)


def _numbers(oscillator: Oscillator, omega: float, steps: int) -> np.ndarray:
    """State, K_v and rms of the steady state; a second speed takes the most steps, so that all share one program."""
    found = speed_sweep(
        oscillator, frequency(omega * np.array([1.0, 1.5])), carry=False, steps=(steps, MOST_STEPS), tolerance=_SETTLED
    )
    return np.array([float(values[0]) for values in (*_state(found), found.dynamic_factor, found.dte_rms)])


def _state(found):
    return found.poincare_dte[:, 0], found.poincare_velocity[:, 0]


@dataclass(frozen=True)
class Independence:
    """Change of a gear pair's steady states with the steps per cycle.

    Attributes:
        steps: fewest and most, as they were chosen over the speeds.
        factor, rms: largest change of K_v and rms from `_FINER` times as many [%].
        speeds: how many, up and down.
        apart: of those, at which the two runs are on different orbits: beside a jump.
    """

    steps: tuple[int, int]
    factor: float
    rms: float
    speeds: int
    apart: int

    @property
    def holds(self) -> bool:
        return max(self.factor, self.rms) <= _PERCENT


def independence(oscillator: Oscillator, speeds=SPEEDS) -> Independence:
    """Of the steps that a sweep chooses, up and down."""
    chosen = steps_for(oscillator, speeds)
    changes = []
    for direction in ("up", "down"):
        few, many = (
            speed_sweep(oscillator, speeds, direction=direction, steps=[factor * count for count in chosen])
            for factor in (1, _FINER)
        )
        pairs = ((few.dynamic_factor, many.dynamic_factor), (few.dte_rms, many.dte_rms))
        changes.append([100 * np.abs(np.asarray(a) / np.asarray(b) - 1) for a, b in pairs])
    factor, rms = np.concatenate(changes, axis=1)
    # a jump is a jump of the rms by many times what an integrator could be off
    apart = rms > 100 * _PERCENT
    return Independence((min(chosen), max(chosen)), factor[~apart].max(), rms[~apart].max(), len(rms), int(apart.sum()))


def convergence_section(console: Console, *, quick: bool) -> list[str]:
    rows = list(orders())
    table = Table("case", title="Errors of the state at mesh position 0 over the steps per cycle")
    for title in (*(str(count) for count in STEPS), "order", "theory", "order of K_v", "order of rms"):
        table.add_column(title, justify="right")
    for row in rows:
        measured = order_of(row.steps, row.factor), order_of(row.steps, row.rms)
        table.add_row(
            row.name,
            *(f"{error:.1e}" for error in row.state),
            f"{row.order:.2f}",
            f"{row.expected:.0f}",
            *(f"{order:.2f}" for order in measured),
        )
    console.print(table)
    missed = [f"{row.name}: order {row.order:.2f} in place of {_SMOOTH:g}" for row in rows if not row.converges]
    found = independence(one_of(quick=quick), QUICK_SPEEDS if quick else SPEEDS)
    console.print(
        f"Force map of a pair, {found.speeds} steady states up and down, {found.steps[0]} to {found.steps[1]} "
        f"steps per cycle against {_FINER} times as many: K_v within {found.factor:.4f} %, rms within {found.rms:.4f} "
        f"%; {found.apart} beside a jump are on different orbits",
        highlight=False,
    )
    if not found.holds:
        missed.append(f"K_v changes by {found.factor:.3f} % with the steps per cycle, rms by {found.rms:.3f} %")
    return missed
