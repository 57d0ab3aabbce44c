"""Result of a speed study: tables, text, figures and files."""

import dataclasses
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ..contact import Mesh
from ..contact.status import reason
from ..dynamics import DOWN, KICKED, UP, Branch, Dynamics, Oscillator, RunUp, SpeedResponse, inertia_of, motion
from ..dynamics.response import FORCE_REFERENCE
from ..io import DesignFile
from ..io.results import write_csv
from ..microgeometry import AbstractModification
from ..numerics import UnitKey
from ..report import Figure, Record, Table, numbers_of, table_of
from .evaluation import grid_lines
from .study import AbstractStudyResult
from .summary import fields_data, flanks_data, model

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
_RUN_UP = "dynamic_factor", "dte_min", "dte_max"  # columns of a run-up
_OVER_SPEED = {
    "dynamic_factor": "Dynamic factor over the mesh frequency, speed going up and down.",
    "dte_rms": "Root mean square of the dynamic transmission error about its mean over the mesh frequency.",
}
_RUN_UP_CAPTION = "Largest mesh force over the static one while the speed rises at constant acceleration."
_CLOSER = {
    "waterfall": "Campbell diagram: amplitudes of the mesh force by order over the mesh frequency.",
    "order_tracks": "Level of the orders of the mesh force over the mesh frequency, rms values re 1 µN (ISO 1683).",
    "bifurcation": "Dynamic transmission error once per mesh cycle over the mesh frequency (bifurcation diagram).",
    "phase_portrait": "Dynamic transmission error and its rate at the speed of the largest dynamic factor; marked once "
    "per mesh cycle. The abscissae differ from panel to panel.",
}
_FAR = 20.0  # ratio of speed range and natural frequency, or its reciprocal, beyond which no mesh order resonates
_RUNS = {UP: "rising", DOWN: "falling", KICKED: "falling, kicked"}
_PANEL, _HEIGHT, _WIDE = 92.0, 94.0, 130.0  # [mm]

_Run = tuple[str, float, str, SpeedResponse]  # design, torque [N m], name of the run, response


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

    def rows(self) -> Iterator[_Run]:
        """Design, torque [N m], name of the run and response of all runs."""
        for name, of_torques in self.responses.items():
            for torque, runs in of_torques.items():
                for run, response in runs.items():
                    yield name, torque, run, response

    @property
    def torque(self) -> float:
        """Torque of the study nearest to the design torque [N m]."""
        return next_to_design(self.design, self.torques)

    def _records(self) -> tuple[Record[_Run], ...]:
        """Numbers of a run, in the order of the table."""

        def top(field: str, place: int) -> Callable[[_Run], float]:
            return lambda run: peak(run[-1], field)[place]

        return (
            Record("torque", "N m", lambda run: run[1], "", "g"),
            Record(
                "natural_frequency",
                "Hz",
                lambda run: self.natural_frequencies[run[0]][run[1]],
                "f_n [Hz]",
                ".0f",
            ),
            Record("speed", "", lambda run: run[2], "", "s"),
            Record("max_dynamic_factor", "", top("dynamic_factor", 0), "K_v"),
            Record("at_dynamic_factor", "Hz", top("dynamic_factor", 1), "at [Hz]", ".0f"),
            Record("max_dte_rms", "um", top("dte_rms", 0), "DTE rms [um]", ".2f"),
            Record("at_dte_rms", "Hz", top("dte_rms", 1), "at [Hz]", ".0f"),
            Record(
                "max_no_contact_share",
                "",
                top("contact_loss_share", 0),
                "contact loss [%]",
                lambda share: f"{100 * share:.1f}",
            ),
            Record("max_coast_contact_share", "", top("back_side_contact", 0)),
            Record("speeds_without_period", "", lambda run: int(np.sum(np.asarray(run[-1].period) == 0))),
        )

    def tables(self) -> Iterator[Table]:
        """Table of the peak values of every run."""
        rows = [(run[0], run) for run in self.rows()]
        table = table_of(self._records(), rows, f"{self.design.title}: largest values over the speed", "design")
        table.ends = tuple(place for place in range(len(rows) - 1) if rows[place][0] != rows[place + 1][0])
        yield table

    def verdict(self) -> Iterator[str]:
        """Lines on the largest dynamic factor of every design over all runs and torques."""
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
        """Line on designs with the largest dynamic factor at the highest speed, below the natural frequency."""
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
        """Line for speeds that are all far from resonance: a mass is likely to be wrong."""
        natural = self.natural_frequencies["unmodified"][self.torque]
        low, high = (float(self.settings.mesh_frequencies[place]) / natural for place in (0, -1))
        if low > _FAR or high < 1 / _FAR:
            yield (
                f"WARNING: all speeds lie at {low:.3g} to {high:.3g} times the natural frequency of {natural:.4g} "
                "Hz; see dynamics.pinion_inertia [kg m2], wheel_inertia and the speeds"
            )

    def _bodies(self) -> Iterator[str]:
        """Line on gears without a bore diameter, whose defaults for compliance and inertia differ."""
        settings, pair = self.settings, self.design.pair()
        given = ("pinion", pair.pinion, settings.pinion_inertia), ("wheel", pair.wheel, settings.wheel_inertia)
        for name, gear, inertia in given:
            if gear.bore_diameter is None and inertia is None and not gear.is_internal:
                yield (
                    f"{name}: no bore_diameter, the inertia is of a solid disc, {float(inertia_of(gear)):.3g} kg m2, "
                    f"and the compliance that of a bore of {2 * float(gear.bore_radius):.3g} mm; give bore_diameter or "
                    f"dynamics.{name}_inertia"
                )

    def failures(self) -> Iterator[str]:
        """Line for every design whose contact has not converged at some DTE."""
        for name, of_torques in self.oscillators.items():
            bad = [f"{torque:g}" for torque, of in of_torques.items() if not bool(of.converged)]
            if bad:
                why = reason([of.status for of in of_torques.values()])
                yield (
                    f"MESH FORCE NOT CONVERGED: {name} at {', '.join(bad)} N m, {why}; do not use its numbers. "
                    "Raise resolution.newton_steps, or resolution.pairs where the deflection is large."
                )

    def inputs(self) -> dict[str, Any]:
        """Torques [N m], speeds [Hz], settings, equivalent mass [kg] and model, as plain data."""
        given = fields_data(self.settings)
        frequencies = np.asarray(given.pop("mesh_frequencies"))
        return {
            UnitKey("torques", "N m"): self.torques,
            UnitKey("mesh_frequencies", "Hz"): [float(frequencies[0]), float(frequencies[-1])],
            "speeds": len(frequencies),
            "settings": given,
            UnitKey("equivalent_mass", "kg"): np.asarray(self.oscillators["unmodified"][self.torque].mass),
            "model": model(self.mesh),
        }

    def summary(self) -> dict[str, Any]:
        """Numbers of all runs by design, and their change on a finer grid, as plain data."""
        records = self._records()
        designs: dict[str, Any] = {name: {"runs": [], **flanks_data(*flanks)} for name, flanks in self.designs.items()}
        for run in self.rows():
            designs[run[0]]["runs"].append(numbers_of(records, run))
        for name, change in self.grid_change.items():
            designs[name]["change_at_twice_the_positions_and_steps"] = change
        for name, of_torques in self.run_ups.items():
            keys = UnitKey("torque", "N m"), UnitKey("max_dynamic_factor"), UnitKey("at_dynamic_factor", "Hz")
            peaks = ((torque, *peak(of, "dynamic_factor")) for torque, of in of_torques.items())
            designs[name]["run_ups"] = [dict(zip(keys, each)) for each in peaks]
        return {
            **({} if self.run_up is None else {UnitKey("run_up", "s"): self.run_up}),
            UnitKey("force_level_reference", "N"): FORCE_REFERENCE,
            "steps": [min(self.steps), max(self.steps)],
            "designs": designs,
            "branches_of_unmodified": [_branch(branch) for branch in self.branches],
        }

    def write(self, folder: Path) -> None:
        """Write every speed of every run to `responses.csv`, and every sample of every run-up to `run_up.csv`."""
        orders = next(self.rows())[-1].orders
        of_orders = [f"force_order_{order:g}_{unit}" for unit in ("N", "dB_re_1uN") for order in orders]
        begin = "design", "torque_Nm", "speed", "mesh_frequency_Hz", "pinion_speed_rpm"
        write_csv(folder / "responses.csv", [*begin, *_COLUMNS.values(), *of_orders], self._speeds())
        if self.run_ups:
            header = "time_s", "mesh_frequency_Hz", "pinion_speed_rpm", *(_COLUMNS[name] for name in _RUN_UP)
            write_csv(folder / "run_up.csv", ["design", "torque_Nm", *header], self._samples())

    def _speeds(self) -> Iterator[tuple[Any, ...]]:
        """Rows of `responses.csv`."""
        for name, torque, run, response in self.rows():
            columns = [np.asarray(getattr(response, field)) for field in _COLUMNS]
            columns += [*np.asarray(response.force_harmonics).T, *np.asarray(response.force_levels).T]
            frequency = np.asarray(response.mesh_frequency)
            for row in zip(frequency, frequency * self._per_hertz, *columns):
                yield name, f"{torque:g}", run, *row

    def _samples(self) -> Iterator[tuple[Any, ...]]:
        """Rows of `run_up.csv`."""
        for name, of_torques in self.run_ups.items():
            for torque, of in of_torques.items():
                frequency = np.asarray(of.mesh_frequency)
                others = (np.asarray(getattr(of, field)) for field in _RUN_UP)
                for row in zip(np.asarray(of.time), frequency, self._per_hertz * frequency, *others):
                    yield name, f"{torque:g}", *row

    @property
    def _per_hertz(self) -> float:
        """Speed of the pinion over the mesh frequency [rpm/Hz]."""
        return 60 / float(self.mesh.pair.pinion.teeth)

    def figures(self) -> Iterator[Figure]:
        """Figures of the responses of all designs, and details of the first and the last design."""
        from .. import plot

        for field, caption in _OVER_SPEED.items():

            def respond(panel: Any, torque: float, field: Any = field) -> None:
                runs = {name: _called(of[torque]) for name, of in self.responses.items()}
                plot.speed_response(runs, field, panel, title=f"{torque:g} N m")

            yield Figure(field, caption, self._panels(respond, self.torques))
        if self.run_ups:

            def rise(panel: Any, torque: float) -> None:
                risen = {name: {"rising": of[torque]} for name, of in self.run_ups.items()}
                plot.speed_response(risen, ax=panel, title=f"{torque:g} N m, rising in {self.run_up:g} s")

            yield Figure("run_up", _RUN_UP_CAPTION, self._panels(rise, self.torques))
        shown = dict.fromkeys((next(iter(self.designs)), list(self.designs)[-1]))
        for kind, caption in _CLOSER.items():
            yield Figure(kind, caption, self._panels(partial(self._draw, kind), shown))
        if self.branches:
            swept = list(self.responses["unmodified"][self.torque].values())
            title = f"unmodified, {self.torque:g} N m"
            with plot.figure.report_axes(None, width=_WIDE, height=_HEIGHT) as axis:
                figure = Figure.of(plot.branches, self.branches, ax=axis, responses=swept, title=title)
                self._scale(axis)
            yield figure

    def _panels(self, draw: Callable[[Any, Any], None], each: Iterable[Any]) -> Any:
        """Panels side by side."""
        from .. import plot

        def scaled(panel: Any, shown: Any) -> None:
            draw(panel, shown)
            self._scale(panel)

        return plot.panels(scaled, each, width=_PANEL, height=_HEIGHT)

    def _scale(self, panel: Any) -> None:
        """Speeds beside mesh frequencies."""
        from .. import plot

        if panel.get_xlabel() == plot.dynamics.FREQUENCY_LABEL:
            plot.speed_scale(panel, float(self.mesh.pair.pinion.teeth))

    def _draw(self, kind: str, panel: Any, name: str) -> None:
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
        plot.phase_portrait(moved.dte, moved.dte_rate, moved.force, panel, section=once, title=title)


def next_to_design(design: DesignFile, torques: Sequence[float]) -> float:
    """Torque of a study nearest to the design torque [N m]."""
    return min(torques, key=lambda torque: abs(torque - design.torque))


def peak(response: SpeedResponse | RunUp, field: str) -> tuple[float, float]:
    """Largest value of a field and its mesh frequency [Hz]; NaN where nothing is finite."""
    values = np.asarray(getattr(response, field))
    if not np.isfinite(values).any():
        return float("nan"), float("nan")
    place = int(np.nanargmax(values))
    return float(values[place]), float(response.mesh_frequency[place])


def _branch(branch: Branch) -> dict[str, Any]:
    frequency = UnitKey("mesh_frequency", "Hz")
    bifurcations = [
        {"kind": one.kind, frequency: float(one.parameter), "dynamic_factor": float(one.orbit.dynamic_factor)}
        for one in branch.bifurcations
    ]
    return {"period_mesh_cycles": branch.orbits.periods, "ended": branch.ended, "bifurcations": bifurcations}


def _called(runs: Mapping[str, SpeedResponse]) -> dict[str, SpeedResponse]:
    """Runs by their names in figures."""
    return {_RUNS.get(name, name): response for name, response in runs.items()}
