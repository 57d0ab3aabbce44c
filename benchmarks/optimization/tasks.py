"""The published design problems that all methods solve."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import jaxgear as jg

Modifications = tuple[jg.TipRelief, jg.TipRelief]
Bounds = Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class Task:
    """A gear pair and what may be changed about its flanks.

    Attributes:
        name: in tables and figures.
        pair: gear pair.
        torque: on the pinion [N m].
        slices: over the face width.
        design: makes the modifications of both gears from the variables.
        bounds: of the variables.
        relief: makes the tip reliefs from which the transmission-error iteration of type 2 starts.
        relief_bounds: of its variables.
        max_relief: most that the transmission-error iteration may remove [um].
    """

    name: str
    pair: jg.GearPair
    torque: float
    slices: int
    design: Callable[[Mapping], Modifications]
    bounds: Bounds
    relief: Callable[[Mapping], Modifications]
    relief_bounds: Bounds
    max_relief: float

    def mesh(self, positions: int) -> jg.Mesh:
        """Prepared mesh with as few tooth pairs as the load needs."""
        return jg.prepare(self.pair, resolution=jg.Resolution(positions, self.slices, pairs=jg.fewest_pairs(self.pair)))

    @property
    def tolerance(self) -> jg.Tolerance:
        """Limits of ISO 1328-1:2013 class 5, those of the lead where slices can show it."""
        limits = jg.Tolerance.from_class(self.pair, 5)
        return limits if self.slices > 1 else limits.without_lead()


def tasks() -> tuple[Task, Task]:
    """The 50/50 pair of the transmission-error iteration and the 19/48 pair of the genetic-algorithm study.

    Geometry and load are those of `examples/spur_50_50.toml` and `examples/spur_19_48.toml`; the variables of the 19/48
    pair and their bounds are the study's own.
    """
    gear = jg.Gear(50, 3.0, face_width=20.0, tip_diameter=154.5709, bore_diameter=50.0)
    pinion = jg.Gear(19, 3.0, face_width=20.0, bore_diameter=24.0)
    wheel = jg.Gear(48, 3.0, face_width=18.0, bore_diameter=70.0)
    node = (0.05, 1.0)
    box = {"amount": (0.0, 7.0), "length": (1.0, 4.5), "node": node}
    return (
        Task("50/50", jg.GearPair(gear, gear, center_distance=150.0), 200.0, 1, _relief, box, _relief, box, 7.0),
        Task(
            name="19/48",
            pair=jg.GearPair(pinion, wheel),
            torque=50.0,
            slices=5,
            design=_crowned,
            bounds={"amount": (0.0, 8.0), "length": (0.0, 6.0), "crowning": (0.0, 8.0)},
            relief=_relief,
            relief_bounds={"amount": (0.0, 8.0), "length": (0.0, 6.0), "node": node},
            max_relief=8.0,
        ),
    )


def _relief(x):
    relief = jg.TipRelief(x["amount"], x["length"], jg.ParabolicLinear(x["node"]))
    return relief, relief


def _crowned(x):
    modification = jg.TipRelief(x["amount"], x["length"]) + jg.LeadCrowning(x["crowning"])
    return modification, modification
