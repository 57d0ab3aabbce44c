"""Revolution study: transmission error and orders over whole revolutions, with deviations of single teeth."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np

from ..contact.status import reason
from ..io import DesignFile, Search, teeth_of
from ..io.results import write_csv
from ..microgeometry import AbstractModification
from ..numerics import UnitKey, changed
from ..report import Figure, Record, Table, numbers_of, table_of
from ..revolution import Revolution, Teeth, named_orders, solve_revolution, tooth_shares
from ..revolution.quantities import OF_REVOLUTION, number_of
from ..revolution.solve import GEARS
from ..vocabulary import quantity_of
from .checkpoints import Checkpoints
from .comparison import compared, search_of
from .study import AbstractStudy, AbstractStudyResult, Stages
from .summary import flanks_data

_PANEL = 62.0  # height [mm]


@dataclass(frozen=True)
class RevolutionStudy(AbstractStudy["RevolutionResult"]):
    """Run the pair over whole revolutions, every tooth with the deviations of the table `teeth`.

    The command compares the unmodified pair, the rule-based tip relief of ISO 6336-1, and the modification of the
    design file or the optimum of its variables.

    Attributes:
        teeth: deviations of the teeth.
        search: search for the optimum of the file; None if its modifications are numbers.
    """

    name: ClassVar = "revolution"

    teeth: Teeth
    search: Search | None

    @classmethod
    def of(cls, design: DesignFile, *, quick: bool = False) -> Self:
        """Revolution study of a design file, see `AbstractStudy.of`."""
        return cls(design, quick, teeth_of(design), search_of(design, quick=quick))

    def omits(self) -> str:
        """Message that [tolerance] is ignored, as the teeth have the deviations of [teeth]; "" without [tolerance]."""
        stands = "tolerance" in self.design.tables
        return "[tolerance] is not part of this analysis, the teeth have the deviations of [teeth]" * stands

    def work_out(self, checkpoints: Checkpoints, stages: Stages) -> "RevolutionResult":
        """Compute the revolutions of all designs at the torque of the file."""
        design, found = self.design, {}
        mesh, designs = compared(design, design.torque, self.search, checkpoints, stages, quick=self.quick)
        mesh = changed(mesh, automatic=design.takes_more_pairs)
        for name, (pinion, wheel) in designs.items():
            stages.begin(f"revolution of the {name} design")
            found[name] = solve_revolution(mesh, design.torque, self.teeth, pinion=pinion, wheel=wheel)
        return RevolutionResult(design, self.teeth, designs, found)


def _number(name: str, revolution: Revolution) -> float | None:
    try:
        return float(number_of(name, revolution))
    except ValueError:  # orders of a gear that makes no whole revolution
        return None


_HEADINGS = {
    "total_composite_error": "total\ncomposite\n[um]",
    "tooth_to_tooth_error": "tooth to\ntooth\n[um]",
    "mesh_order": "mesh\norder\n[um]",
    "pinion_shaft_order": "pinion\nonce per\nturn [um]",
    "wheel_shaft_order": "wheel\nonce per\nturn [um]",
    "pinion_side_bands": "pinion\nside bands\n[um]",
    "wheel_side_bands": "wheel\nside bands\n[um]",
    "max_revolution_pressure": "pressure\n[MPa]",
}
_RECORDS: list[Record[Revolution]] = [
    Record(of.name, of.unit, partial(_number, of.name), _HEADINGS.get(of.name), ".0f" if of.unit == "MPa" else ".3f")
    for of in map(quantity_of, (*_HEADINGS, *(name for name in OF_REVOLUTION if name not in _HEADINGS)))
]


@dataclass(frozen=True)
class RevolutionResult(AbstractStudyResult):
    """Revolutions of all designs.

    Attributes:
        design: the design file.
        teeth: deviations of the teeth.
        designs: modifications (pinion, wheel) by the name of the design.
        revolutions: revolutions by the name of the design.
    """

    assumptions: ClassVar = (
        "Every pair of teeth has the deviations of its two teeth; each base pitch is a static contact analysis. "
        "Run-out moves flanks, not the center distance.",
    )

    design: DesignFile
    teeth: Teeth
    designs: Mapping[str, tuple[AbstractModification, AbstractModification]]
    revolutions: Mapping[str, Revolution]

    def tables(self) -> Iterator[Table]:
        """Table of the results of all designs, one row each."""
        windows = next(iter(self.revolutions.values())).windows
        title = f"{self.design.title}: transmission error over {windows} base pitches, {self.design.torque:g} N m"
        yield table_of(_RECORDS, self.revolutions, title, "design")

    def verdict(self) -> Iterator[str]:
        """Lines on the most loaded teeth of every design."""
        for name, revolution in self.revolutions.items():
            said = []
            for gear, of in zip(GEARS, self.teeth.deviations):
                shares = np.asarray(tooth_shares(revolution, gear))
                if of is not None and np.isfinite(shares).any():
                    said.append(f"{gear} tooth {int(np.nanargmax(shares))} ({100 * np.nanmax(shares):.0f} %)")
            if said:
                yield f"{name}: most loaded, of the mean tooth's load: {', '.join(said)}"

    def failures(self) -> Iterator[str]:
        """Line for every design whose contact has not converged at some position."""
        for name, revolution in self.revolutions.items():
            lost = ~np.asarray(revolution.converged)
            if lost.any():
                cause = reason(np.asarray(revolution.status))
                yield (
                    f"NOT CONVERGED: {name}, {cause} at {lost.sum()} of {lost.size} places; do not use its numbers. "
                    "Raise resolution.newton_steps or resolution.pairs."
                )

    def inputs(self) -> dict[str, Any]:
        """Torque on the pinion [N m], as plain data."""
        return {UnitKey("torque", "N m"): self.design.torque}

    def summary(self) -> dict[str, Any]:
        """Numbers of all designs, and load shares of their teeth, as plain data."""
        designs = {
            name: {
                **numbers_of(_RECORDS, revolution),
                **{f"{gear}_tooth_shares": np.asarray(tooth_shares(revolution, gear)) for gear in GEARS},
                **flanks_data(*self.designs[name]),
            }
            for name, revolution in self.revolutions.items()
        }
        return {"base_pitches": next(iter(self.revolutions.values())).windows, "designs": designs}

    def write(self, folder: Path) -> None:
        """Write the transmission error of all designs to `revolution.csv`, and the named orders to `orders.csv`."""
        first = next(iter(self.revolutions.values()))
        curves = (np.asarray(found.transmission_error) for found in self.revolutions.values())
        header = "phase", *(f"{name}_um" for name in self.revolutions)
        write_csv(folder / "revolution.csv", header, zip(np.asarray(first.phase), *curves))
        orders = (
            (name, line.name, line.order, float(line.pinion_order), float(line.amplitude))
            for name, found in self.revolutions.items()
            for line in named_orders(found, self.teeth)
        )
        write_csv(folder / "orders.csv", ("design", "name", "order", "pinion_order", "amplitude_um"), orders)

    def figures(self) -> Iterator[Figure]:
        """Transmission error over a revolution, and the orders of every design."""
        from .. import plot

        def draw(panel: Any, name: str) -> None:
            plot.order_spectrum(self.revolutions[name], self.teeth, panel, title=name)

        yield Figure.of(plot.revolution, self.revolutions)
        size = {"width": 1.4 * plot.figure.WIDTH, "height": _PANEL}
        caption = "Amplitudes of the transmission error over the order of the pinion, with what they come from."
        yield Figure("orders", caption, plot.panels(draw, self.revolutions, **size, stacked=True))
