"""Result of a speed study: tables, text, figures and files."""

import csv
import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ..contact import Mesh
from ..contact.status import reason
from ..dynamics import DOWN, KICKED, UP, Branch, Dynamics, Oscillator, RunUp, SpeedResponse, inertia_of, motion
from ..dynamics.response import FORCE_REFERENCE
from ..io import DesignFile
from ..microgeometry import AbstractModification
from ..report import Table
from .evaluation import grid_lines
from .study import AbstractStudyResult
from .summary_data import flanks_data, model

_COLUMNS = {
    "dynamic_factor": "dynamic_factor",
    "dte_rms": "dte_rms_um",
    "dte_mean": "dte_mean_um",
    "dte_min": "dte_min_um",
    "dte_max": "dte_max_um",
    "contact_loss_share": "no_contact_share",
    "back_side_contact": "coast_contact_share",
    "period": "period_mesh_cycles",
    "converged": "settled",
}
_FAR = 20.0  # times the natural frequency, above which, or below its reciprocal, nothing of a mesh resonates
_RUNS = {UP: "rising", DOWN: "falling", KICKED: "falling, kicked"}
_PANEL, _HEIGHT, _WIDE = 92.0, 94.0, 130.0  # [mm]


@dataclass(frozen=True)
class DynamicsResult(AbstractStudyResult):
    """Result of a speed study of all designs.

    Attributes:
        design: the design file.
        settings: speeds and vibrating masses.
        torques: torques on the pinion [N m], ascending.
        run_up: duration of a run-up [s]; None for no run-up.
        mesh: mesh on which the designs are compared.
        designs: modifications (pinion, wheel) by design.
        oscillators: oscillators by design and torque [N m].
        natural_frequencies: natural frequencies of the DTE about the static one [Hz], by design and torque [N m].
        responses: speed responses by design, torque [N m] and name of the run.
        steps: steps of the integrator per mesh cycle, at every speed.
        branches: branches of periodic orbits of the unmodified design, at `torque`.
        run_ups: run-ups by design and torque [N m]; empty where none is asked for.
        grid_change: change of the numbers of every design at twice the positions of the mesh force and twice the steps,
            by name and unit; empty in a quick run.
    """

    assumptions: ClassVar = (
        "Both gears are rigid masses that vibrate on the force of this contact, with the damping and bearings given.",
    )

    design: DesignFile
    settings: Dynamics
    torques: tuple[float, ...]
    run_up: float | None
    mesh: Mesh
    designs: Mapping[str, tuple[AbstractModification, AbstractModification]]
    oscillators: Mapping[str, Mapping[float, Oscillator]]
    natural_frequencies: Mapping[str, Mapping[float, float]]
    responses: Mapping[str, Mapping[float, Mapping[str, SpeedResponse]]]
    steps: tuple[int, ...]
    branches: tuple[Branch, ...]
    run_ups: Mapping[str, Mapping[float, RunUp]]
    grid_change: Mapping[str, Mapping[str, float]] = dataclasses.field(default_factory=dict)

    def rows(self) -> Iterator[tuple[str, float, str, SpeedResponse]]:
        """Design, torque, run and response of all runs."""
        for name, of_torques in self.responses.items():
            for torque, runs in of_torques.items():
                for run, response in runs.items():
                    yield name, torque, run, response

    @property
    def torque(self) -> float:
        """The torque next to the design torque [N m]."""
        return next_to_design(self.design, self.torques)

    def tables(self) -> Iterator[Table]:
        """The peaks of every run."""
        peaks = "K_v", "at [Hz]", "DTE rms [um]", "at [Hz]", "contact loss [%]"
        header = "design", "torque [N m]", "f_n [Hz]", "speed", *peaks
        result = Table(header, title=f"{self.design.title}: largest values over the speed")
        before = None
        for name, torque, run, response in self.rows():
            if before not in (None, name):
                result.add_section()
            (factor, at_factor), (rms, at_rms) = peak(response, "dynamic_factor"), peak(response, "dte_rms")
            apart = 100 * peak(response, "contact_loss_share")[0]
            numbers = f"{factor:.3f}", f"{at_factor:.0f}", f"{rms:.2f}", f"{at_rms:.0f}", f"{apart:.1f}"
            natural = self.natural_frequencies[name][torque]
            result.add_row(name, f"{torque:g}", f"{natural:.0f}", run, *numbers)
            before = name
        yield result

    def verdict(self) -> Iterator[str]:
        """The worst of every design over all runs and torques."""
        worst = {
            name: max(peak(response, "dynamic_factor")[0] for runs in of_torques.values() for response in runs.values())
            for name, of_torques in self.responses.items()
        }
        first = next(iter(worst.values()))
        others = [f"{name} {value:.3f} ({100 * (value / first - 1):+.0f} %)" for name, value in list(worst.items())[1:]]
        yield f"worst dynamic factor over all torques and speeds: unmodified {first:.3f}, {', '.join(others)}"
        if self.run_ups:
            highest = {
                name: max(peak(of, "dynamic_factor") for of in of_torques.values())
                for name, of_torques in self.run_ups.items()
            }
            said = ", ".join(f"{name} {factor:.3f} at {at:.0f} Hz" for name, (factor, at) in highest.items())
            yield f"largest dynamic factor of a run-up in {self.run_up:g} s: {said}"
        if self.grid_change:
            steps = " to ".join(f"{count}" for count in dict.fromkeys((min(self.steps), max(self.steps))))
            grid = f"{self.settings.positions} positions of the mesh force and {steps} steps per mesh cycle"
            yield from grid_lines(grid, self.grid_change)
        yield from self._still_rising()
        yield from self._far_from_resonance()
        yield from self._bodies()
        aperiodic = sum(int(np.sum(np.asarray(response.period) == 0)) for *_, response in self.rows())
        total = sum(len(response.mesh_frequency) for *_, response in self.rows())
        if aperiodic:
            yield f"no periodic motion was found at {aperiodic} of {total} speeds: their numbers are of a recorded time"

    def _still_rising(self) -> Iterator[str]:
        """A line for designs whose largest dynamic factor is that of the highest speed, below the natural frequency."""
        highest = float(self.settings.mesh_frequencies[-1])
        rising = {
            name: None
            for name, torque, _, response in self.rows()
            if peak(response, "dynamic_factor")[1] == highest < self.natural_frequencies[name][torque]
        }
        if rising:
            yield (
                f"largest dynamic factor at the highest speed, {highest:.0f} Hz: {', '.join(rising)}; it may rise "
                "further beyond it, up to the natural frequency f_n"
            )

    def _far_from_resonance(self) -> Iterator[str]:
        """A line where every speed is far above or below what can resonate: then a mass is likely to be wrong."""
        natural = self.natural_frequencies["unmodified"][self.torque]
        low, high = (float(self.settings.mesh_frequencies[place]) / natural for place in (0, -1))
        if low > _FAR or high < 1 / _FAR:
            yield (
                f"WARNING: all speeds lie at {low:.3g} to {high:.3g} times the natural frequency of {natural:.4g} "
                "Hz; see dynamics.pinion_inertia [kg m2], wheel_inertia and the speeds"
            )

    def _bodies(self) -> Iterator[str]:
        """A line for gears whose bore is left open, which is another for the compliance than for the inertia."""
        settings, pair = self.settings, self.design.pair()
        given = ("pinion", pair.pinion, settings.pinion_inertia), ("wheel", pair.wheel, settings.wheel_inertia)
        for name, gear, inertia in given:
            if gear.bore_diameter is None and inertia is None:
                yield (
                    f"{name}: no bore_diameter, the inertia is of a solid disc, {float(inertia_of(gear)):.3g} kg m2, "
                    f"and the compliance that of a bore of {2 * float(gear.bore_radius):.3g} mm; give bore_diameter or "
                    f"dynamics.{name}_inertia"
                )

    def failures(self) -> Iterator[str]:
        """A line for every design whose contact was not found at some DTE."""
        for name, of_torques in self.oscillators.items():
            bad = [f"{torque:g}" for torque, of in of_torques.items() if not bool(of.converged)]
            if bad:
                why = reason([of.status for of in of_torques.values()])
                yield (
                    f"MESH FORCE NOT CONVERGED: {name} at {', '.join(bad)} N m, {why}; do not use its numbers. "
                    "Raise resolution.newton_steps, or resolution.pairs where the deflection is large."
                )

    def summary(self) -> dict[str, Any]:
        """The runs of all designs, with what vibrates."""
        settings = self.settings
        given = {field.name: getattr(settings, field.name) for field in dataclasses.fields(settings)}
        frequencies = np.asarray(given.pop("mesh_frequencies"))
        designs: dict[str, Any] = {}
        for name, (pinion, wheel) in self.designs.items():
            runs = [
                {
                    "torque_Nm": torque,
                    "speed": run,
                    "natural_frequency_Hz": self.natural_frequencies[name][torque],
                    **_peaks(response),
                }
                for other, torque, run, response in self.rows()
                if other == name
            ]
            designs[name] = {"runs": runs, **flanks_data(pinion, wheel)}
            if name in self.grid_change:
                designs[name]["change_at_twice_the_positions_and_steps"] = self.grid_change[name]
            if self.run_ups:
                of_torques = {torque: peak(of, "dynamic_factor") for torque, of in self.run_ups[name].items()}
                designs[name]["run_ups"] = [
                    {"torque_Nm": torque, "max_dynamic_factor": factor, "at_dynamic_factor_Hz": at}
                    for torque, (factor, at) in of_torques.items()
                ]
        return {
            "torques_Nm": self.torques,
            "mesh_frequencies_Hz": [float(frequencies[0]), float(frequencies[-1])],
            "speeds": len(frequencies),
            **({} if self.run_up is None else {"run_up_s": self.run_up}),
            "force_level_reference_N": FORCE_REFERENCE,
            "settings": {name: value for name, value in given.items() if value is not None},
            "equivalent_mass_kg": np.asarray(self.oscillators["unmodified"][self.torque].mass),
            "steps": [min(self.steps), max(self.steps)],
            "designs": designs,
            "branches_of_unmodified": [_branch(branch) for branch in self.branches],
            "model": model(self.mesh),
        }

    def write(self, folder: Path) -> None:
        """Every speed of every run as `responses.csv`, and every sample of every run-up as `run_up.csv`."""
        self._write_responses(folder / "responses.csv")
        if self.run_ups:
            self._write_run_ups(folder / "run_up.csv")

    def _write_run_ups(self, path: Path) -> None:
        """Every sample of every run-up."""
        per_hertz = 60 / float(self.mesh.pair.pinion.teeth)
        fields = {"time": "time_s", "mesh_frequency": "mesh_frequency_Hz"}
        others = {name: _COLUMNS[name] for name in ("dynamic_factor", "dte_min", "dte_max")}
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(["design", "torque_Nm", *fields.values(), "pinion_speed_rpm", *others.values()])
            for name, of_torques in self.run_ups.items():
                for torque, of in of_torques.items():
                    at = [np.asarray(getattr(of, field)) for field in fields]
                    columns = [*at, per_hertz * at[1], *(np.asarray(getattr(of, field)) for field in others)]
                    for values in zip(*columns):
                        writer.writerow([name, f"{torque:g}", *(f"{value:.7g}" for value in values)])

    def _write_responses(self, path: Path) -> None:
        """Every speed of every run."""
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            begin = "design", "torque_Nm", "speed", "mesh_frequency_Hz", "pinion_speed_rpm"
            orders = next(self.rows())[-1].orders
            of_orders = [f"force_order_{order:g}_{unit}" for unit in ("N", "dB_re_1uN") for order in orders]
            writer.writerow([*begin, *_COLUMNS.values(), *of_orders])
            per_hertz = 60 / float(self.mesh.pair.pinion.teeth)
            for name, torque, run, response in self.rows():
                columns = [np.asarray(getattr(response, field)) for field in _COLUMNS]
                columns += [*np.asarray(response.force_harmonics).T, *np.asarray(response.force_levels).T]
                for frequency, *values in zip(np.asarray(response.mesh_frequency), *columns):
                    numbers = [int(value) if value.dtype.kind in "ib" else f"{value:.7g}" for value in values]
                    speed = f"{frequency:.7g}", f"{frequency * per_hertz:.7g}"
                    writer.writerow([name, f"{torque:g}", run, *speed, *numbers])

    def figures(self) -> dict[str, Any]:
        """Responses of all designs, and the first and the last design more closely."""
        from .. import plot

        torques = self.torques
        size: dict[str, Any] = {"columns": len(torques), "width": _PANEL * len(torques), "height": _HEIGHT}
        axes: dict[str, Any] = {}
        for field in ("dynamic_factor", "dte_rms"):
            with plot.figure.report_axes(None, **size) as panels:
                for number, (panel, torque) in enumerate(zip(np.ravel(panels), torques)):
                    runs = {name: _called(of[torque]) for name, of in self.responses.items()}
                    plot.speed_response(runs, field, panel, title=f"{torque:g} N m")
                    self._finish(panel, number)
            axes[field] = panels
        if self.run_ups:
            with plot.figure.report_axes(None, **size) as panels:
                for number, (panel, torque) in enumerate(zip(np.ravel(panels), torques)):
                    risen = {name: {"rising": of[torque]} for name, of in self.run_ups.items()}
                    plot.speed_response(risen, ax=panel, title=f"{torque:g} N m, rising in {self.run_up:g} s")
                    self._finish(panel, number)
            axes["run_up"] = panels
        shown = list(dict.fromkeys((next(iter(self.designs)), list(self.designs)[-1])))
        size = {"columns": len(shown), "width": _PANEL * len(shown), "height": _HEIGHT}
        for kind in ("waterfall", "order_tracks", "bifurcation", "phase_portrait"):
            with plot.figure.report_axes(None, **size) as panels:
                for number, (panel, name) in enumerate(zip(np.ravel(panels), shown)):
                    self._draw(kind, panel, name)
                    self._finish(panel, number)
            axes[kind] = panels
        if self.branches:
            swept = list(self.responses["unmodified"][self.torque].values())
            title = f"unmodified, {self.torque:g} N m"
            with plot.figure.report_axes(None, width=_WIDE, height=_HEIGHT) as axis:
                axes["branches"] = plot.branches(self.branches, ax=axis, responses=swept, title=title)
                self._finish(axis, 0)
        return axes

    def _finish(self, panel, number: int) -> None:
        """One name of the ordinate for all panels, and speeds beside mesh frequencies."""
        from .. import plot

        panel.set_ylabel(panel.get_ylabel() if number == 0 else "")
        if panel.get_xlabel() == plot.dynamics.FREQUENCY_LABEL:
            plot.speed_scale(panel, float(self.mesh.pair.pinion.teeth))

    def _draw(self, kind: str, panel, name: str) -> None:
        from .. import plot

        runs = self.responses[name][self.torque]
        last = list(runs.values())[-1]
        title = f"{name}, {self.torque:g} N m"
        if kind == "waterfall":
            # one scale of colours for all panels; the means are not drawn
            every = [list(of[self.torque].values())[-1] for of in self.responses.values()]
            most = max(float(np.nanmax(np.asarray(of.force_harmonics)[:, np.asarray(of.orders) > 0])) for of in every)
            plot.waterfall(last, "force", panel, title=f"{title}, {list(_called(runs))[-1]}", most=most)
        elif kind == "order_tracks":
            plot.order_tracks(last, panel, title=f"{title}, {list(_called(runs))[-1]}")
        elif kind == "bifurcation":
            called = list(_called(runs).items())
            plot.bifurcation(dict([called[0], called[-1]]), panel, title=title)
        else:
            worst = max(runs.values(), key=lambda response: peak(response, "dynamic_factor")[0])
            self._portrait(panel, self.oscillators[name][self.torque], worst, name)

    def _portrait(self, panel, oscillator: Oscillator, response: SpeedResponse, name: str) -> None:
        """The motion at the worst speed."""
        from .. import plot

        place = int(np.nanargmax(np.asarray(response.dynamic_factor)))
        count = int(response.period[place]) or response.poincare_dte.shape[-1]
        frequency = float(response.mesh_frequency[place])
        start = tuple(part[place] for part in response.state)
        moved = motion(oscillator, frequency, start, periods=count, steps=self.steps[place])
        once = response.poincare_dte[place, :count], response.poincare_velocity[place, :count]
        title = f"{name}, {self.torque:g} N m, {frequency:.0f} Hz"
        plot.phase_portrait(moved.dte, moved.dte_rate, moved.force, panel, once=once, title=title)


def next_to_design(design: DesignFile, torques: Sequence[float]) -> float:
    """The torque of a study next to the design torque [N m]."""
    return min(torques, key=lambda torque: abs(torque - design.torque))


def peak(response: SpeedResponse | RunUp, field: str) -> tuple[float, float]:
    """Largest value of a field and its mesh frequency [Hz]; NaN where nothing is finite."""
    values = np.asarray(getattr(response, field))
    if not np.isfinite(values).any():
        return float("nan"), float("nan")
    place = int(np.nanargmax(values))
    return float(values[place]), float(response.mesh_frequency[place])


def _branch(branch: Branch) -> dict[str, Any]:
    bifurcations = [
        {"kind": one.kind, "mesh_frequency_Hz": float(one.parameter), "dynamic_factor": float(one.orbit.dynamic_factor)}
        for one in branch.bifurcations
    ]
    return {"period_mesh_cycles": branch.orbits.periods, "ended": branch.ended, "bifurcations": bifurcations}


def _peaks(response: SpeedResponse) -> dict[str, float]:
    found: dict[str, float] = {}
    for name, column in (("dynamic_factor", "dynamic_factor"), ("dte_rms", "dte_rms_um")):
        found[f"max_{column}"], found[f"at_{name}_Hz"] = peak(response, name)
    found["max_no_contact_share"] = peak(response, "contact_loss_share")[0]
    found["max_coast_contact_share"] = peak(response, "back_side_contact")[0]
    found["speeds_without_period"] = int(np.sum(np.asarray(response.period) == 0))
    return found


def _called(runs: Mapping[str, SpeedResponse]) -> dict[str, SpeedResponse]:
    """Runs by what figures say of them."""
    return {_RUNS.get(name, name): response for name, response in runs.items()}
