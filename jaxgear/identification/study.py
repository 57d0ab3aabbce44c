"""Identification study: values of the variables of a design file from a measured transmission error."""

import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from operator import itemgetter
from pathlib import Path
from typing import Any, ClassVar, Self

import equinox as eqx
import numpy as np

from ..contact import Mesh, Resolution
from ..io import DesignFile, DesignFileError, write_design, write_flanks
from ..io.design_file import FileDesign
from ..io.errors import naming, problem, refused
from ..io.results import write_csv
from ..io.tolerance_table import quality_classes
from ..microgeometry import AbstractModification, EndRelief, LeadCrowning, LeadSlope
from ..numerics import UnitKey, check, real
from ..provided import provided
from ..report import Figure, Record, Table, numbers_of, table_of
from ..studies.checkpoints import Checkpoints
from ..studies.evaluation import coarse
from ..studies.study import AbstractStudy, AbstractStudyResult, Stages
from ..studies.summary import flanks_data
from ..tolerance import ToleranceClass
from .estimate import Identified, identify, period_of
from .measurement import Measurement, read_measurement

_OF_LIMIT = 3.0  # limit deviation over standard deviation: nearly all gears of a class keep its limits
_OF_RANGE = 4.0  # range of a variable over standard deviation
# refusals of data: how they begin, of which column they are, and what helps
_HELP = (
    ("offset", "te_um", ": --offset gives its standard deviation"),
    ("phase", "phase", ": give the column revolution, or phases that go on"),
    ("", "te_um", "; --noise gives it"),
)
_OVER_FACE = LeadCrowning, LeadSlope, EndRelief  # the helix tolerance is that of these, the profile's of all others
_RELATED = 0.7  # least correlation that is said
_NOISE = "95 % of\nnoise [um]"
_MOST_PANELS = 5
_SHOWN = 4.0  # base pitches of a whole revolution
_PANEL = 45.0  # height [mm]


class _Flanks(eqx.Module):
    """Design of the file as a function of all unknowns, of which it uses its variables."""

    design: FileDesign

    def __call__(self, parameters: Mapping[str, Any]) -> tuple[AbstractModification, AbstractModification]:
        return self.design({name: parameters[name] for name in self.design.names})


@dataclass(frozen=True)
class IdentificationStudy(AbstractStudy["IdentificationResult"]):
    """Find the values of variables from a measured transmission error, with their uncertainty.

    The file has the columns torque_Nm, te_um, and phase (base pitches) or angle_deg (of the pinion). An error that is
    an angle names its shaft and unit: te_wheel_arcsec, te_pinion_deg.

    Attributes:
        measured: file of the data.
        measurement: the data.
        prior: mean and standard deviation of every variable.
        torque_scale, offset: standard deviations of these unknowns; 0 where they are known.
        single_pitch: those of the single pitch deviations of pinion and wheel; None for equal teeth.
    """

    name: ClassVar = "identify"

    measured: Path
    measurement: Measurement
    prior: Mapping[str, tuple[float, float]]
    torque_scale: float
    offset: float
    single_pitch: tuple[float, float] | None

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
        pitch: bool = False,
    ) -> Self:
        """Identification of the variables of a design file from a measurement, see `AbstractStudy.of`.

        Args:
            design: the design file.
            measured: file of the measurement, see `read_measurement`.
            quick: True for a preview on few positions.
            noise: standard deviation of a reading [um]; None estimates it from repeated readings.
            torque_scale: standard deviation of the ratio of true to measured torque; 0 for an exact torque.
            offset: standard deviation of an offset added to every reading [um]; 0 for no offset.
            pitch: True if single pitch deviations of all teeth are unknowns, within f_pT of the class of their gear.
        """
        for name, given in (("torque-scale", torque_scale), ("offset", offset)):
            check(name, given, "um" if name == "offset" else "", low=0.0)
        if noise is not None:
            check("noise", noise, "um", low=0.0, open_low=True)
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
            prior, pitches = _prior(design), _single_pitch(design) if pitch else None
        data = read_measurement(measured, design.pair(), noise=noise)
        study = cls(design, quick, Path(measured), data, prior, torque_scale, offset, pitches)
        sizes = study._sizes()
        try:
            data.noise_on(sizes, period_of(data, design.pair(), pitches, offset or None))
        except ValueError as error:
            says = str(error)
            key, help_ = next((key, help_) for begin, key, help_ in _HELP if says.startswith(begin))
            raise DesignFileError(key, says.removeprefix(f"{key} ") + help_, study.measured) from None
        return study

    def _further(self) -> list[float]:
        """Torques of the file that were not measured [N m]."""
        return sorted({*self.design.torque_range, self.design.torque} - {*np.asarray(self.measurement.torque).tolist()})

    def _sizes(self) -> Resolution:
        size = self.design.resolution(max([float(np.max(np.asarray(self.measurement.torque))), *self._further()]))
        return coarse(size) if self.quick else size

    def omits(self) -> str:
        """Empty message: [tolerance] gives the priors."""
        return ""

    def work_out(self, checkpoints: Checkpoints, stages: Stages) -> "IdentificationResult":
        """Identify the variables; writes no checkpoints."""
        stages.begin("preparing the mesh")
        mesh = self.design.mesh(self._sizes())
        stages.begin("searching the variables")
        try:
            found = identify(
                mesh,
                self.measurement,
                _Flanks(self.design.design),
                self.prior,
                torque_scale=self.torque_scale or None,
                offset=self.offset or None,
                single_pitch=self.single_pitch,
                candidates=self._further(),
            )
        except ValueError as error:
            raise DesignFileError("variables", str(error), self.design.path) from None
        return IdentificationResult(self.design, self.measured, mesh, self.prior, found)


def _single_pitch(design: DesignFile) -> tuple[float, float]:
    """Standard deviations of the single pitch deviations of both gears: a third of f_pT of ISO 1328-1."""
    classes = quality_classes(design)
    if classes is None:
        raise DesignFileError("tolerance", "missing; --pitch takes the limit f_pT of the class of each gear")
    first, second = (float(of.single_pitch) / _OF_LIMIT for of in classes)
    return first, second


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


_FIT_CAPTION = "Measured transmission error with the standard deviation of its noise, and that of the flanks found."
_PITCH_CAPTION = "Single pitch deviations of both gears as identified, with their standard deviations."
_UNKNOWN: tuple[Record[tuple[Any, ...]], ...] = (
    Record("unit", "", itemgetter(0), "", "s"),
    Record("estimate", "", itemgetter(1), "", ".4g"),
    Record("standard_deviation", "", itemgetter(2), "standard\ndeviation", ".4g"),
    Record("prior_mean", "", itemgetter(3), "prior\nmean", ".4g"),
    Record("prior_standard_deviation", "", itemgetter(4), "prior\ndeviation", ".4g"),
)
# of the single pitch deviations of a gear and their standard deviations
_PITCH: tuple[Record[tuple[Any, Any]], ...] = (
    Record("largest", "", lambda of: np.abs(of[0]).max(), "largest single\npitch deviation", ".3g"),
    Record("total", "", lambda of: np.ptp(np.cumsum(of[0])), "total cumulative\npitch deviation", ".3g"),
    Record(
        "deviation",
        "",
        lambda of: np.sqrt(np.mean(np.square(of[1]))),
        "standard deviation\nof a single one",
        ".3g",
    ),
)


@dataclass(frozen=True)
class IdentificationResult(AbstractStudyResult):
    """Result of the identification of variables from a measured transmission error.

    Attributes:
        design: the design file.
        measured: file of the measurement.
        mesh: mesh of the model that was fitted.
        prior: prior mean and standard deviation of every variable.
        found: identified values with their uncertainty.
    """

    assumptions: ClassVar = ("Noise, priors and the error of the model are normally distributed.",)

    design: DesignFile
    measured: Path
    mesh: Mesh
    prior: Mapping[str, tuple[float, float]]
    found: Identified

    def _flanks(self) -> tuple[AbstractModification, AbstractModification]:
        """Both modifications; raises ValueError if the estimates are invalid, such as a negative relief."""
        return _Flanks(self.design.design)(self.found.parameters)

    def _rows(self) -> dict[str, tuple[str, float, float, float, float]]:
        found, units = self.found, {**self.design.units, "torque_scale": "", "offset": "um"}
        numbers = (np.asarray(each).tolist() for each in (found.estimate, found.deviation, *found.prior))
        return {name: (units[name], *values) for name, *values in zip(found.names[: found.own], *numbers)}

    def tables(self) -> Iterator[Table]:
        """One row per unknown, pitch deviations, and the mesh orders of the remainder of the fit."""
        title = f"{self.design.title}: identified from {self.measured.name}"
        yield table_of(_UNKNOWN, self._rows(), title, "unknown")
        if self.found.single_pitch:
            yield table_of(_PITCH, list(self.found.single_pitch.items()), "pitch deviations [um]", "gear")
        amplitudes = self.found.residual_orders
        columns = "torque\n[N m]", *(f"order {order}\n[um]" for order in range(1, amplitudes.shape[1] + 1)), _NOISE
        left = Table(columns, title="measured minus fitted: amplitudes of the mesh orders")
        for torque, *row in zip(self.found.torques, *amplitudes.T, self.found.noise_orders):
            left.add_row(f"{torque:g}", *(f"{value:.3f}" for value in row))
        yield left

    def verdict(self) -> Iterator[str]:
        """Lines on the fit, correlated and undetermined unknowns, and the further torque with the most information."""
        found = self.found
        yield (
            f"chi-square per degree of freedom {float(found.chi_square):.2f} by noise alone, "
            f"error of the model {float(found.model_error):.2g} um"
        )
        correlation = np.asarray(found.correlation)
        for first, second in zip(*np.triu_indices(found.own, 1)):
            if abs(correlation[first, second]) >= _RELATED:
                names = f"{found.names[first]} and {found.names[second]}"
                yield f"correlation of {names}: {correlation[first, second]:.2f}"
        yield from found.undetermined()
        if found.best_candidate is not None:
            yield f"further torque that would tell most of what is told least: {found.best_candidate:g} N m"

    def findings(self) -> list[str]:
        """Estimates outside the range of their variable."""
        return [
            f"{name}: {value:.4g} {unit} is outside its range of {low:g} to {high:g} {unit}".replace("  ", " ")
            for name, (unit, value, *_) in self._rows().items()
            for low, high in [self.design.bounds.get(name, (-np.inf, np.inf))]
            if not low <= value <= high
        ]

    def failures(self) -> Iterator[str]:
        """Lines if the search has not converged, or if its estimates are no valid modification."""
        if not bool(self.found.converged):
            yield "NOT CONVERGED: do not use the estimates. Narrow the ranges or raise resolution.pairs."
        try:
            self._flanks()
        except ValueError as error:
            yield f"NO DESIGN FILE: the estimates make no flank: {problem(error)}"

    def inputs(self) -> dict[str, Any]:
        """Torques of the readings [N m], as plain data."""
        return {UnitKey("torques", "N m"): self.found.torques}

    def summary(self) -> dict[str, Any]:
        """Unknowns, correlations, undetermined combinations and quality of the fit, as plain data."""
        found = self.found
        try:
            flanks = flanks_data(*self._flanks())
        except ValueError:
            flanks = {}
        return {
            "measured_file": self.measured.name,
            "unknowns": {name: numbers_of(_UNKNOWN, row) for name, row in self._rows().items()},
            "correlation": np.asarray(found.correlation)[: found.own, : found.own],
            "singular_values": np.asarray(found.singular_values),
            "cannot_tell": found.undetermined(),
            UnitKey("further_torque", "N m"): found.best_candidate,
            "chi_square": float(found.chi_square),
            UnitKey("model_error", "um"): float(found.model_error),
            **{
                UnitKey(f"{gear}_single_pitch", "um"): {"estimate": single, "standard_deviation": deviation}
                for gear, (single, deviation) in found.single_pitch.items()
            },
            UnitKey("residual_orders", "um"): found.residual_orders,
            UnitKey("noise_orders", "um"): found.noise_orders,
            "converged": bool(found.converged),
            **flanks,
        }

    def details(self) -> Iterator[str]:
        """Reasons why the pair cannot be written in a format."""
        if not list(self.failures()):
            with tempfile.TemporaryDirectory() as folder:
                yield from self._exchanged(Path(folder))

    def _exchanged(self, folder: Path) -> Iterator[str]:
        """Write a file of every provided format; yields the reasons why one is not written."""
        for name, entry in provided("formats").items():
            path, write = folder / f"identified.{name}", entry.load()
            try:
                write(path, materials=self.design.materials, **self._pair())
            except ValueError as error:
                yield f"{path.name} is not written: {str(error).removeprefix(f'{write.__name__}: ')}"

    def _pair(self) -> dict[str, Any]:
        """Pair with the estimates, for both writers."""
        design, (pinion, wheel) = self.design, self._flanks()
        case = {name: getattr(design, name) for name in ("torque", "speed", "quality_classes", "title")}
        return {"pair": design.pair(), "pinion": pinion, "wheel": wheel, **case}

    def _designs(self) -> dict[str, tuple[AbstractModification, AbstractModification]]:
        """Flanks of the prior means and of the estimates."""
        before = {name: real(mean) for name, (mean, _) in self.prior.items()}
        return {"prior": self.design.design(before), "identified": self._flanks()}

    def write(self, folder: Path) -> None:
        """Write the unknowns as CSV, and the identified pair as design file, flanks and files of other formats."""
        unknowns = ((name, *row) for name, row in self._rows().items())
        write_csv(folder / "identified.csv", ("name", *(record.key for record in _UNKNOWN)), unknowns)
        for gear, columns in self.found.single_pitch.items():
            teeth = ((tooth, *row) for tooth, row in enumerate(zip(*map(np.asarray, columns))))
            write_csv(folder / f"pitch_{gear}.csv", ("tooth", "single_pitch_um", "standard_deviation_um"), teeth, ".4f")
        if list(self.failures()):
            return
        write_design(folder / "identified.toml", **self._pair())
        write_flanks(folder / "flanks.csv", self.mesh, self._designs())
        list(self._exchanged(folder))

    def figures(self) -> Iterator[Figure]:
        """Measured and fitted transmission error, and the flanks of prior and estimates within their tolerances."""
        from .. import plot

        for figure in self._figures():
            plot.emphasize(figure.figure, "identified")
            yield figure

    def _figures(self) -> Iterator[Figure]:
        from .. import plot

        torques, panels = self.found.torques, partial(plot.panels, height=_PANEL, stacked=True)
        shown = torques[np.unique(np.linspace(0, len(torques) - 1, _MOST_PANELS).round().astype(int))]
        yield Figure("identified", _FIT_CAPTION, panels(self._fit, shown))
        if not list(self.failures()):
            of: dict[str, Any] = {"tolerance": quality_classes(self.design)}
            yield Figure.of(plot.k_chart, self.mesh, self._designs(), **of)
            if self.mesh.resolution.slices > 1:
                yield Figure.of(plot.lead_chart, self.mesh, self._designs(), **of)
        if self.found.single_pitch:
            yield Figure("pitch", _PITCH_CAPTION, panels(_teeth, self.found.single_pitch.items()))

    def _fit(self, panel: Any, torque: float) -> None:
        """Measured and fitted transmission error over the phase at a torque."""
        from .. import plot

        found = self.found
        whole = (np.asarray(each) for each in (found.phase, found.measured, found.fitted, found.noise))
        at = np.asarray(found.torque) == torque
        at &= np.asarray(found.phase) < np.min(np.asarray(found.phase)) + _SHOWN
        phase, measured, fitted, noise = (each[at] for each in whole)
        order = np.argsort(phase)
        style = {**plot.figure.line_style(0), "linestyle": "none"}
        panel.errorbar(phase[order], measured[order], noise[order], marker="o", markersize=3, label="measured", **style)
        panel.plot(phase[order], fitted[order], label="fitted", **{**plot.figure.line_style(1), "linestyle": "-"})
        panel.set(xlabel="phase [base pitches]", ylabel=f"TE at {torque:g} N m [µm]")
        if panel.get_subplotspec().is_first_row():
            plot.figure.legend_above(panel)


def _teeth(panel: Any, pitches: tuple[str, tuple[Any, Any]]) -> None:
    """Single pitch deviations of a gear with their standard deviations."""
    from .. import plot

    gear, (single, deviation) = pitches
    tooth = np.arange(len(single))
    panel.bar(tooth, np.asarray(single), color="0.8")
    style = {**plot.figure.line_style(0), "linestyle": "none"}
    panel.errorbar(tooth, np.asarray(single), np.asarray(deviation), markersize=3, marker="o", **style)
    panel.set(xlabel="tooth", ylabel=f"{gear}: single pitch\ndeviation [µm]")
