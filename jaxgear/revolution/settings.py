"""Settings of a revolution: deviations of the teeth, and number of base pitches."""

from math import lcm
from typing import Any

import equinox as eqx

from ..geometry import GearPair
from ..metrics import AbstractSettings
from ..numerics import concrete, whole
from .teeth import TeethDeviations

MOST_WINDOWS = 100_000
_OVER = "pinion", "wheel", "hunting"


def _pair(counts: Any) -> Any:
    return None if counts is None else tuple(int(count) for count in counts)


class Teeth(AbstractSettings):
    """Deviations of the teeth of both gears, and number of base pitches of the revolution.

    `quantity` returns the quantities of a revolution, `REVOLUTION_QUANTITIES`. Deviations of manufactured gears in
    searches and sweeps do not affect them: the deviations given here are used.

    Attributes:
        pinion, wheel: deviations of the teeth; None for equal teeth.
        over: "pinion" or "wheel" for one revolution of that gear, "hunting" for all pairings of teeth (lcm(z1, z2) base
            pitches), or a number of base pitches; None for a revolution of the only gear with deviations, or for the
            hunting period if both gears have deviations.
        counts: numbers of teeth of pinion and wheel; None for the numbers of deviations and gears. They are needed for
            a gear without deviations whose numbers are traced, as in sweeps and searches.

    Raises:
        ValueError: for another value of `over`.
        TypeError: for deviations of another type.
    """

    table = "teeth"

    pinion: TeethDeviations | None = None
    wheel: TeethDeviations | None = None
    over: str | int | None = eqx.field(static=True, default=None)
    counts: tuple[int, int] | None = eqx.field(static=True, default=None, converter=_pair)

    def check_together(self) -> None:
        for name, of in (("pinion", self.pinion), ("wheel", self.wheel)):
            if of is not None and not isinstance(of, TeethDeviations):
                raise TypeError(f"Teeth: {name} is a {type(of).__name__}, must be of TeethDeviations")
        if isinstance(self.over, int) and not isinstance(self.over, bool):
            whole("Teeth: over", self.over, high=MOST_WINDOWS)
        elif self.over is not None and self.over not in _OVER:
            raise ValueError(
                f'Teeth: over = {self.over!r} must be "pinion", "wheel", "hunting" or a number of base pitches'
            )
        if self.counts is not None and (len(self.counts) != 2 or min(self.counts) < 1):
            raise ValueError(f"Teeth: counts = {self.counts} must be two numbers of teeth, of pinion and wheel")

    @property
    def deviations(self) -> tuple[TeethDeviations | None, TeethDeviations | None]:
        """Deviations of the teeth of pinion and wheel; None for equal teeth."""
        return self.pinion, self.wheel

    def counts_of(self, pair: GearPair) -> tuple[int, int]:
        """Numbers of teeth of a pair.

        Raises:
            ValueError: if the numbers differ from those of the deviations, or a required number is traced.
        """
        found = []
        for place, (name, gear, of) in enumerate(zip(_OVER, pair.gears, self.deviations)):
            known = concrete(gear.teeth)
            said = [] if self.counts is None else [self.counts[place]]
            said += [] if of is None else [of.teeth]
            said += [] if known is None else [int(known)]
            if not said:
                raise ValueError(f"Teeth: the number of teeth of the {name} is being traced, give counts=(z1, z2)")
            if len(set(said)) > 1:
                raise ValueError(
                    f"Teeth: {name} has {said[0]} teeth by counts or deviations, {said[-1]} by its gear or deviations"
                )
            found.append(said[0])
        return found[0], found[1]

    def windows(self, counts: tuple[int, int]) -> int:
        """Number of base pitches, for numbers of teeth of pinion and wheel.

        Raises:
            ValueError: if the hunting period has too many base pitches.
        """
        over = self.over
        if over is None:
            only = [name for name, of in zip(_OVER, self.deviations) if of is not None]
            over = only[0] if len(only) == 1 else "hunting"
        if isinstance(over, int):
            return over
        found = {"pinion": counts[0], "wheel": counts[1], "hunting": lcm(*counts)}[over]
        if found > MOST_WINDOWS:
            raise ValueError(f"Teeth: over = {over!r} are {found} base pitches, must be at most {MOST_WINDOWS}")
        return found

    def repeats(self, counts: tuple[int, int]) -> bool:
        """True if all gears with deviations make whole revolutions."""
        return self.windows(counts) % lcm(*(count for count, of in zip(counts, self.deviations) if of is not None)) == 0
