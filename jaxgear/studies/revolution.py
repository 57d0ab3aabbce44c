"""The study of a revolution: from a design file to the transmission error and the orders of teeth that differ."""

import csv
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np

from ..contact.status import reason
from ..io import DesignFile, Search, teeth_of
from ..microgeometry import AbstractModification
from ..numerics import changed
from ..report import Table
from ..revolution import Revolution, Teeth, named_orders, solve_revolution, tooth_shares
from ..revolution.quantities import OF_REVOLUTION, number_of
from ..revolution.solve import GEARS
from ..vocabulary import quantity_of
from .checkpoints import Checkpoints
from .comparison import compared, search_of
from .progress import Stages
from .study import AbstractStudy, AbstractStudyResult
from .summary_data import flanks_data

_PANEL = 62.0  # height [mm]


@dataclass(frozen=True)
class RevolutionStudy(AbstractStudy["RevolutionResult"]):
    """Run the pair over whole revolutions, every tooth with the deviations of the table `teeth`.

    Compares the unmodified pair, the rule-based tip relief of ISO 6336-1, and the modification of the design file or
    the optimum of its variables.

    Attributes:
        teeth: deviations of the teeth.
        search: for the optimum of the file; None where its modifications are numbers.
    """

    name: ClassVar = "revolution"

    teeth: Teeth
    search: Search | None

    @classmethod
    def of(cls, design: DesignFile, *, quick: bool = False) -> Self:
        """Revolution study of a design file, see `AbstractStudy.of`."""
        return cls(design, quick, teeth_of(design), search_of(design, quick=quick))

    def omits(self) -> str:
        """The limits of [tolerance]: the teeth have deviations of their own."""
        stands = "tolerance" in self.design.tables
        return "[tolerance] is not part of this analysis, the teeth have the deviations of [teeth]" * stands

    def work_out(self, checkpoints: Checkpoints, stages: Stages) -> "RevolutionResult":
        """The revolutions of all designs at the torque of the file."""
        design, found = self.design, {}
        mesh, designs = compared(design, design.torque, self.search, checkpoints, stages, quick=self.quick)
        mesh = changed(mesh, automatic=design.takes_more_pairs)
        for name, (pinion, wheel) in designs.items():
            stages.begin(f"revolution of the {name} design")
            found[name] = solve_revolution(mesh, design.torque, self.teeth, pinion=pinion, wheel=wheel)
        return RevolutionResult(design, self.teeth, designs, found)


@dataclass(frozen=True)
class RevolutionResult(AbstractStudyResult):
    """Revolutions of all designs.

    Attributes:
        design: the design file.
        teeth: deviations of the teeth.
        designs: their modifications (pinion, wheel) by name.
        revolutions: by name.
    """

    assumptions: ClassVar = (
        "Every pair of teeth has the deviations of its two teeth; each base pitch is a static contact analysis. "
        "Run-out moves flanks, not the center distance.",
    )

    design: DesignFile
    teeth: Teeth
    designs: Mapping[str, tuple[AbstractModification, AbstractModification]]
    revolutions: Mapping[str, Revolution]

    def _numbers(self, revolution: Revolution) -> dict[str, float]:
        """Quantities of a revolution by their keys, as far as its windows have them."""
        found = {}
        for name in OF_REVOLUTION:
            try:
                found[quantity_of(name).key] = float(number_of(name, revolution))
            except ValueError:  # orders of a gear that makes no whole revolution
                continue
        return found

    def tables(self) -> list[Table]:
        """One row per design."""
        columns = {
            "total_composite_error_um": "total\ncomposite\n[um]",
            "tooth_to_tooth_error_um": "tooth to\ntooth\n[um]",
            "mesh_order_um": "mesh\norder\n[um]",
            "pinion_shaft_order_um": "pinion\nonce per\nturn [um]",
            "wheel_shaft_order_um": "wheel\nonce per\nturn [um]",
            "pinion_side_bands_um": "pinion\nside bands\n[um]",
            "wheel_side_bands_um": "wheel\nside bands\n[um]",
            "max_revolution_pressure_MPa": "pressure\n[MPa]",
        }
        numbers = {name: self._numbers(found) for name, found in self.revolutions.items()}
        columns = {key: text for key, text in columns.items() if all(key in each for each in numbers.values())}
        windows = next(iter(self.revolutions.values())).windows
        title = f"{self.design.title}: transmission error over {windows} base pitches, {self.design.torque:g} N m"
        result = Table(("design", *columns.values()), title=title)
        for name, each in numbers.items():
            cells = (f"{each[key]:.0f}" if key.endswith("MPa") else f"{each[key]:.3f}" for key in columns)
            result.add_row(name, *cells)
        return [result]

    def verdict(self) -> Iterator[str]:
        """The most loaded teeth of every design."""
        for name, revolution in self.revolutions.items():
            said = []
            for gear, of in zip(GEARS, self.teeth.deviations):
                shares = np.asarray(tooth_shares(revolution, gear))
                if of is not None and np.isfinite(shares).any():
                    said.append(f"{gear} tooth {int(np.nanargmax(shares))} ({100 * np.nanmax(shares):.0f} %)")
            if said:
                yield f"{name}: most loaded, of the mean tooth's load: {', '.join(said)}"

    def failures(self) -> Iterator[str]:
        """A line for every design whose contact was not found somewhere."""
        for name, revolution in self.revolutions.items():
            lost = ~np.asarray(revolution.converged)
            if lost.any():
                cause = reason(np.asarray(revolution.status))
                yield (
                    f"NOT CONVERGED: {name}, {cause} at {lost.sum()} of {lost.size} places; do not use its numbers. "
                    "Raise resolution.newton_steps or resolution.pairs."
                )

    def summary(self) -> dict[str, Any]:
        """Numbers and named orders of all designs."""
        designs = {
            name: {
                **self._numbers(revolution),
                **{f"{gear}_tooth_shares": np.asarray(tooth_shares(revolution, gear)) for gear in GEARS},
                **flanks_data(*self.designs[name]),
            }
            for name, revolution in self.revolutions.items()
        }
        first = next(iter(self.revolutions.values()))
        return {"torque_Nm": self.design.torque, "base_pitches": first.windows, "designs": designs}

    def write(self, folder: Path) -> None:
        """Transmission error at every place, `revolution.csv`, and the named orders, `orders.csv`, of all designs."""
        with (folder / "revolution.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(["phase", *(f"{name}_um" for name in self.revolutions)])
            first = next(iter(self.revolutions.values()))
            curves = [np.asarray(found.transmission_error) for found in self.revolutions.values()]
            writer.writerows([f"{value:.7g}" for value in row] for row in zip(np.asarray(first.phase), *curves))
        with (folder / "orders.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(["design", "name", "order", "pinion_order", "amplitude_um"])
            for name, found in self.revolutions.items():
                for line in named_orders(found, self.teeth):
                    order = f"{line.pinion_order:.7g}"
                    writer.writerow([name, line.name, line.order, order, f"{line.amplitude:.7g}"])

    def figures(self) -> dict[str, Any]:
        """Transmission error over a revolution, and the orders of every design."""
        from .. import plot

        count, last = len(self.revolutions), list(self.revolutions.values())[-1]
        size: dict[str, Any] = {"rows": count, "width": 1.4 * plot.figure.WIDTH, "height": _PANEL * count}
        with plot.figure.report_axes(None, **size) as panels:
            for panel, (name, found) in zip(np.ravel(panels), self.revolutions.items()):
                plot.order_spectrum(found, self.teeth, panel, title=name)
                panel.set_xlabel(panel.get_xlabel() if found is last else "")
        return {"revolution": plot.revolution(self.revolutions), "orders": panels}
