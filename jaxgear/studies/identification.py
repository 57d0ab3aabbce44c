"""The study of a measured transmission error: which values of the variables of a design file gave it."""

import csv
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Self

import equinox as eqx
import numpy as np

from ..io import DesignFile, DesignFileError, read_measurement, write_design
from ..io.design_file import FileDesign
from ..io.errors import naming, problem, refused
from ..io.tolerance_table import quality_classes
from ..microgeometry import AbstractModification, EndRelief, LeadCrowning, LeadSlope
from ..numerics import check
from ..optimize import Identified, Measurement, identify
from ..report import Table
from ..tolerance import ToleranceClass
from .checkpoints import Checkpoints
from .evaluation import coarse
from .progress import Stages
from .study import AbstractStudy, AbstractStudyResult
from .summary_data import flanks_data

_OF_LIMIT = 3.0  # limit deviation over standard deviation: nearly all gears of a class keep its limits
_OF_RANGE = 4.0  # range of a variable over standard deviation
_OVER_FACE = LeadCrowning, LeadSlope, EndRelief  # the helix tolerance is that of these, the profile's of all others
_RELATED = 0.7  # least correlation that is said
_MOST_PANELS = 5
_PANEL = 45.0  # height [mm]


class _Flanks(eqx.Module):
    """The design of the file from its variables, whatever else is unknown."""

    design: FileDesign

    def __call__(self, parameters: Mapping[str, Any]) -> tuple[AbstractModification, AbstractModification]:
        return self.design({name: parameters[name] for name in self.design.names})


@dataclass(frozen=True)
class DesignIdentification(AbstractStudy["IdentificationResult"]):
    """Find the values of the variables of a design file that gave a measured transmission error.

    Attributes:
        measured: file of the data.
        measurement: the data.
        prior: mean and standard deviation of every variable.
        torque_scale, offset: standard deviations of these unknowns; 0 where they are known.
    """

    name: ClassVar = "identify"

    measured: Path
    measurement: Measurement
    prior: Mapping[str, tuple[float, float]]
    torque_scale: float
    offset: float

    @classmethod
    def of(
        cls,
        design: DesignFile,
        *,
        measured: str | Path = "",
        quick: bool = False,
        noise: float | None = None,
        torque_scale: float = 0.01,
        offset: float = 0.0,
    ) -> Self:
        """As `AbstractStudy.of`.

        Args:
            design: the design file.
            measured: file of the data, see `io.read_measurement`.
            quick: a preview on few positions.
            noise: standard deviation of a reading [um]; None for that of repeats.
            torque_scale: standard deviation of true over measured torque; 0 for a right one.
            offset: standard deviation of what is added to every reading [um]; 0 for nothing.
        """
        for name, given in (("torque-scale", torque_scale), ("offset", offset)):
            check("identify", name, given, "um" if name == "offset" else "", low=0.0)
        if noise is not None:
            check("identify", "noise", noise, "um", low=0.0, open_low=True)
        if not design.bounds:
            raise DesignFileError("variables", "missing; identify looks for the values of variables", design.path)
        for free in design.open_case:
            says = f'"{free.name}" must be a number here, identify varies modifications alone'
            raise DesignFileError(free.key, says, design.path)
        for name in ("torque_scale", "offset"):
            if name in design.bounds:
                raise DesignFileError(
                    f"variables.{name}", "is an unknown of identify, choose another name", design.path
                )
        with naming(design.path):
            prior = _prior(design)
        data = read_measurement(measured, design.pair(), noise=noise)
        return cls(design, quick, Path(measured), data, prior, torque_scale, offset)

    def omits(self) -> str:
        """Nothing: [tolerance] gives priors."""
        return ""

    def work_out(self, checkpoints: Checkpoints, stages: Stages) -> "IdentificationResult":
        """The identified variables; keeps no checkpoints."""
        design = self.design
        further = sorted({*design.torque_range, design.torque} - {*np.asarray(self.measurement.torque).tolist()})
        stages.begin("preparing the mesh")
        size = design.resolution(max([float(np.max(np.asarray(self.measurement.torque))), *further]))
        mesh = design.mesh(coarse(size) if self.quick else size)
        stages.begin("searching the variables")
        try:
            found = identify(
                _Flanks(design.design),
                self.prior,
                self.measurement,
                mesh=mesh,
                torque_scale=self.torque_scale or None,
                offset=self.offset or None,
                candidates=further,
            )
        except ValueError as error:
            says = str(error).removeprefix("identify: ")
            if says.startswith(("noise", "repeated")):
                raise DesignFileError("te_um", f"{says}; --noise gives it", self.measured) from None
            raise DesignFileError("variables", says, design.path) from None
        return IdentificationResult(design, self.measured, found)


def _prior(design: DesignFile) -> dict[str, tuple[float, float]]:
    """Mean and standard deviation of every variable.

    The mean is its value, without one the middle of its range. The standard deviation is a quarter of the range; with
    the table [tolerance], that of an amount in um is a third of F_alphaT, over the face F_betaT, of ISO 1328-1.
    """
    limits: dict[str, float] = {}
    if "tolerance" in design.tables:
        quality_classes(design)  # which names the gear that no class is made for
        tolerated = design.tables["tolerance"].quality_class
        numbers = tolerated if isinstance(tolerated, list | tuple) else (tolerated, tolerated)
        for gear, number, parts in zip(design.pair().gears, numbers, (design.design.pinion, design.design.wheel)):
            of = refused("tolerance", ToleranceClass.of, gear, number)
            for part in parts:
                limit = float(of.helix_total if part.make in _OVER_FACE else of.profile_total)
                amounts = [free.name for free in part.free() if free.number.unit == "um"]
                limits |= {name: max(limit, limits.get(name, 0.0)) for name in amounts}
    prior = {}
    for name, (low, high) in design.bounds.items():
        spread = limits[name] / _OF_LIMIT if name in limits else (high - low) / _OF_RANGE
        prior[name] = design.values.get(name, 0.5 * (low + high)), spread
    return prior


@dataclass(frozen=True)
class IdentificationResult(AbstractStudyResult):
    """What a measured transmission error says of the variables.

    Attributes:
        design: the design file.
        measured: file of the data.
        found: what they say.
    """

    assumptions: ClassVar = ("Noise, priors and the error of the model are normally distributed.",)

    design: DesignFile
    measured: Path
    found: Identified

    def _flanks(self) -> tuple[AbstractModification, AbstractModification]:
        """Both modifications; raises ValueError where the estimates make none, such as a negative relief."""
        return _Flanks(self.design.design)(self.found.parameters)

    def _rows(self) -> Iterator[tuple[str, str, float, float, float, float]]:
        found, units = self.found, {**self.design.units, "torque_scale": "", "offset": "um"}
        numbers = (np.asarray(each).tolist() for each in (found.estimate, found.deviation, *found.prior))
        for name, *values in zip(found.names, *numbers):
            yield name, units[name], *values

    def tables(self) -> list[Table]:
        """One row per unknown."""
        header = "unknown", "unit", "estimate", "standard\ndeviation", "prior\nmean", "prior\ndeviation"
        result = Table(header, title=f"{self.design.title}: identified from {self.measured.name}")
        for name, unit, *values in self._rows():
            result.add_row(name, unit, *(f"{value:.4g}" for value in values))
        return [result]

    def verdict(self) -> Iterator[str]:
        """Quality of the fit, related unknowns, what the data cannot tell, and the torque that would tell most."""
        found = self.found
        yield (
            f"chi-square per degree of freedom {float(found.chi_square):.2f} by noise alone, "
            f"error of the model {float(found.model_error):.2g} um"
        )
        correlation = np.asarray(found.correlation)
        for first, second in zip(*np.triu_indices(len(found.names), 1)):
            if abs(correlation[first, second]) >= _RELATED:
                names = f"{found.names[first]} and {found.names[second]}"
                yield f"correlation of {names}: {correlation[first, second]:.2f}"
        yield from found.not_told()
        if found.best_candidate is not None:
            yield f"further torque that would tell most of what is told least: {found.best_candidate:g} N m"

    def findings(self) -> list[str]:
        """Estimates outside the range of their variable."""
        return [
            f"{name}: {value:.4g} {unit} is outside its range of {low:g} to {high:g} {unit}".replace("  ", " ")
            for name, unit, value, *_ in self._rows()
            for low, high in [self.design.bounds.get(name, (-np.inf, np.inf))]
            if not low <= value <= high
        ]

    def failures(self) -> Iterator[str]:
        """A line where the search did not end, or its estimates make no flank."""
        if not bool(self.found.converged):
            yield "NOT CONVERGED: do not use the estimates. Narrow the ranges or raise resolution.newton_steps."
        try:
            self._flanks()
        except ValueError as error:
            yield f"NO DESIGN FILE: the estimates make no flank: {problem(error)}"

    def summary(self) -> dict[str, Any]:
        """Unknowns, correlations, what the data cannot tell, and the fit."""
        found = self.found
        keys = "unit", "estimate", "standard_deviation", "prior_mean", "prior_standard_deviation"
        try:
            flanks = flanks_data(*self._flanks())
        except ValueError:
            flanks = {}
        return {
            "measured_file": self.measured.name,
            "torques_Nm": np.unique(np.asarray(found.torque)),
            "unknowns": {name: dict(zip(keys, row)) for name, *row in self._rows()},
            "correlation": np.asarray(found.correlation),
            "singular_values": np.asarray(found.singular_values),
            "cannot_tell": found.not_told(),
            "further_torque_Nm": found.best_candidate,
            "chi_square": float(found.chi_square),
            "model_error_um": float(found.model_error),
            "converged": bool(found.converged),
            **flanks,
        }

    def write(self, folder: Path) -> None:
        """The unknowns, `identified.csv`, and the pair with the estimates, `identified.toml`."""
        with (folder / "identified.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            names = "name", "unit", "estimate", "standard_deviation", "prior_mean", "prior_standard_deviation"
            writer.writerow(names)
            writer.writerows([name, unit, *(f"{value:.7g}" for value in row)] for name, unit, *row in self._rows())
        if list(self.failures()):
            return
        design, (pinion, wheel) = self.design, self._flanks()
        given: dict[str, Any] = {"speed": design.speed, "quality_classes": design.quality_classes}
        path = folder / "identified.toml"
        write_design(path, design.pair(), torque=design.torque, pinion=pinion, wheel=wheel, title=design.title, **given)

    def figures(self) -> dict[str, Any]:
        """Measured and fitted transmission error over the phase, a panel per torque."""
        from .. import plot

        found = self.found
        torques = np.unique(np.asarray(found.torque))
        shown = torques[np.unique(np.linspace(0, len(torques) - 1, _MOST_PANELS).round().astype(int))]
        size: dict[str, Any] = {"rows": len(shown), "height": _PANEL * len(shown)}
        with plot.figure.report_axes(None, **size) as panels:
            for number, (panel, torque) in enumerate(zip(np.ravel(panels), shown)):
                at = np.flatnonzero(np.asarray(found.torque) == torque)
                at = at[np.argsort(np.asarray(found.phase)[at])]
                phase, measured, fitted, noise = (
                    np.asarray(each)[at] for each in (found.phase, found.measured, found.fitted, found.noise)
                )
                style = {**plot.figure.line_style(0), "linestyle": "none"}
                panel.errorbar(phase, measured, noise, marker="o", markersize=3, label="measured", **style)
                panel.plot(phase, fitted, label="fitted", **{**plot.figure.line_style(1), "linestyle": "-"})
                panel.set(ylabel=f"TE at {torque:g} N m [µm]")
                if number == 0:
                    plot.figure.legend_above(panel)
            panel.set_xlabel("phase [base pitches]")
        return {"identified": panels}
