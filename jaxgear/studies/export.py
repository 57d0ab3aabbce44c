"""Export study: tables of a design for programs of rotor and multibody dynamics."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np

from ..contact.status import reason
from ..dynamics.mesh_tables import FILES, MeshTables, mesh_tables
from ..io import DesignFile, Search
from ..numerics import UnitKey, changed
from ..report import Table
from .checkpoints import Checkpoints
from .comparison import Modifications, compared, search_of
from .evaluation import torques_of
from .study import AbstractStudy, AbstractStudyResult, Stages
from .summary import flanks_data

_QUICK_POSITIONS = 64  # of the force map


@dataclass(frozen=True)
class ExportStudy(AbstractStudy["ExportResult"]):
    """Write mesh stiffness, transmission error and mesh force as files for rotor and multibody programs.

    The exported design is the modification of the design file, the optimum of its variables, or the unmodified pair.
    The files hold stiffness and transmission error over phase and torque, orders of the transmission error, and force
    over phase and dynamic transmission error, as CSV and together as mesh.npz. Units, signs and axes are described in
    the files.

    Attributes:
        search: search for the optimum of the file; None if its modifications are numbers.
    """

    name: ClassVar = "export"

    search: Search | None

    @classmethod
    def of(cls, design: DesignFile, *, quick: bool = False) -> Self:
        """Export of a design file, see `AbstractStudy.of`."""
        return cls(design, quick, search_of(design, quick=quick))

    def work_out(self, checkpoints: Checkpoints, stages: Stages) -> "ExportResult":
        """Compute the tables over the torques of the file."""
        design = self.design
        mesh, designs = compared(
            design, max(torques_of(design, quick=True)), self.search, checkpoints, stages, quick=self.quick
        )
        mesh = changed(mesh, automatic=design.takes_more_pairs)
        name = next(name for name in ("optimum", "modified", "unmodified") if name in designs)
        pinion, wheel = designs[name]
        stages.begin(f"tables of the {name} design")
        sizes = {"positions": _QUICK_POSITIONS} if self.quick else {}
        torques = torques_of(design, quick=self.quick)
        tables = mesh_tables(mesh, design.torque, torques, pinion=pinion, wheel=wheel, **sizes)
        return ExportResult(design, name, designs[name], tables)


@dataclass(frozen=True)
class ExportResult(AbstractStudyResult):
    """Exported tables of one design.

    Attributes:
        design: design file.
        name: name of the design.
        flanks: modifications (pinion, wheel) of the design.
        mesh: tables of the design.
    """

    assumptions: ClassVar = ("The mesh force is quasi-static and made for the torque of the design file.",)

    design: DesignFile
    name: str
    flanks: Modifications
    mesh: MeshTables

    def tables(self) -> Iterator[Table]:
        """Table of values at the torque of the file and at both ends of its range."""
        header = "torque\n[N m]", "mean TE\n[um]", "PPTE\n[um]", "mesh order\n[um]", "mean stiffness\n[N/um]"
        result, mesh = Table(header, title=f"{self.design.title}: {self.name} design"), self.mesh
        for torque in sorted({mesh.torques[0], mesh.torque, mesh.torques[-1]}):
            at = int(np.searchsorted(mesh.torques, torque))
            error = mesh.transmission_error[at]
            numbers = error.mean(), np.ptp(error), mesh.amplitude[at, 0]
            result.add_row(f"{torque:g}", *(f"{each:.3f}" for each in numbers), f"{mesh.stiffness[at].mean():.1f}")
        yield result

    def failures(self) -> Iterator[str]:
        """Line for a contact that has not converged at some position."""
        if not self.mesh.converged:
            cause = reason(self.mesh.status)
            help_ = "Raise resolution.newton_steps or resolution.pairs."
            yield f"NOT CONVERGED: {self.name}, {cause}; the tables are not written. {help_}"

    def inputs(self) -> dict[str, Any]:
        """Torques [N m] and equivalent mass [kg], as plain data."""
        return {
            UnitKey("torque", "N m"): self.mesh.torque,
            UnitKey("torques", "N m"): self.mesh.torques,
            UnitKey("equivalent_mass", "kg"): self.mesh.equivalent_mass,
        }

    def summary(self) -> dict[str, Any]:
        """Mesh frequency [Hz], base radii [mm], inertias [kg m2], file names and modifications, as plain data."""
        mesh, speed = self.mesh, self.design.speed
        data = {} if speed is None else {UnitKey("mesh_frequency", "Hz"): float(mesh.teeth[0] * speed / 60)}
        return data | {
            "design": self.name,
            UnitKey("base_radius", "mm"): mesh.base_radius,
            UnitKey("inertia", "kg m2"): mesh.inertia,
            "files": list(FILES) if mesh.converged else [],
            **flanks_data(*self.flanks),
        }

    def write(self, folder: Path) -> None:
        """Write the tables as files, unless a contact has not converged."""
        if self.mesh.converged:
            self.mesh.write(folder)
