"""Pictures of a study of the vibration over the speed."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..dynamics import DOWN, KICKED, UP, Oscillator, SpeedResponse, motion
from . import report
from .dynamics_report import DynamicsStudy, peak

_RUNS = {UP: "rising", DOWN: "falling", KICKED: "falling, kicked"}
_PANEL, _HEIGHT, _WIDE = 92.0, 94.0, 130.0  # [mm]


def write_figures(folder: Path, study: DynamicsStudy) -> list[Path]:
    """Writes all figures: responses of all designs, and the first and the last design more closely; gives the files."""
    import matplotlib

    matplotlib.use("Agg")  # the command line never shows a window
    from .. import plot

    torques = study.request.torques
    size: dict[str, Any] = {"columns": len(torques), "width": _PANEL * len(torques), "height": _HEIGHT}
    axes: dict[str, Any] = {}
    for field in ("dynamic_factor", "dte_rms"):
        with plot.figure.report_axes(None, **size) as panels:
            for number, (panel, torque) in enumerate(zip(np.ravel(panels), torques)):
                runs = {name: _called(of[torque]) for name, of in study.responses.items()}
                plot.speed_response(runs, field, panel, title=f"{torque:g} N m")
                _finish(panel, study, number)
        axes[field] = panels
    if study.run_ups:
        with plot.figure.report_axes(None, **size) as panels:
            for number, (panel, torque) in enumerate(zip(np.ravel(panels), torques)):
                risen = {name: {"rising": of[torque]} for name, of in study.run_ups.items()}
                plot.speed_response(risen, ax=panel, title=f"{torque:g} N m, rising in {study.request.run_up:g} s")
                _finish(panel, study, number)
        axes["run_up"] = panels
    shown = list(dict.fromkeys((next(iter(study.designs)), list(study.designs)[-1])))
    size = {"columns": len(shown), "width": _PANEL * len(shown), "height": _HEIGHT}
    for kind in ("waterfall", "order_tracks", "bifurcation", "phase_portrait"):
        with plot.figure.report_axes(None, **size) as panels:
            for number, (panel, name) in enumerate(zip(np.ravel(panels), shown)):
                _draw(kind, panel, study, name)
                _finish(panel, study, number)
        axes[kind] = panels
    if study.branches:
        swept = list(study.responses["unmodified"][study.torque].values())
        title = f"unmodified, {study.torque:g} N m"
        with plot.figure.report_axes(None, width=_WIDE, height=_HEIGHT) as axis:
            axes["branches"] = plot.branches(study.branches, ax=axis, responses=swept, title=title)
            _finish(axis, study, 0)
    return report.save_figures(folder, axes)


def _finish(panel, study: DynamicsStudy, number: int) -> None:
    """One name of the ordinate for all panels, and speeds beside mesh frequencies."""
    from .. import plot

    panel.set_ylabel(panel.get_ylabel() if number == 0 else "")
    if panel.get_xlabel() == plot.dynamics.FREQUENCY_LABEL:
        plot.speed_scale(panel, float(study.mesh.pair.pinion.teeth))


def _called(runs: Mapping[str, SpeedResponse]) -> dict[str, SpeedResponse]:
    """Runs by what figures say of them."""
    return {_RUNS.get(name, name): response for name, response in runs.items()}


def _draw(kind: str, panel, study: DynamicsStudy, name: str) -> None:
    from .. import plot

    runs = study.responses[name][study.torque]
    last = list(runs.values())[-1]
    title = f"{name}, {study.torque:g} N m"
    if kind == "waterfall":
        # one scale of colours for all panels; the means are not drawn
        every = [list(of[study.torque].values())[-1] for of in study.responses.values()]
        most = max(float(np.nanmax(np.asarray(of.force_harmonics)[:, np.asarray(of.orders) > 0])) for of in every)
        plot.waterfall(last, "force", panel, title=f"{title}, {list(_called(runs))[-1]}", most=most)
    elif kind == "order_tracks":
        plot.order_tracks(last, panel, title=f"{title}, {list(_called(runs))[-1]}")
    elif kind == "bifurcation":
        called = list(_called(runs).items())
        plot.bifurcation(dict([called[0], called[-1]]), panel, title=title)
    else:
        worst = max(runs.values(), key=lambda response: peak(response, "dynamic_factor")[0])
        _portrait(panel, study, study.oscillators[name][study.torque], worst, name)


def _portrait(panel, study: DynamicsStudy, oscillator: Oscillator, response: SpeedResponse, name: str) -> None:
    """The motion at the worst speed."""
    from .. import plot

    place = int(np.nanargmax(np.asarray(response.dynamic_factor)))
    count = int(response.period[place]) or response.poincare_dte.shape[-1]
    frequency = float(response.mesh_frequency[place])
    start = tuple(part[place] for part in response.state)
    moved = motion(oscillator, frequency, start, periods=count, steps=study.steps[place])
    once = response.poincare_dte[place, :count], response.poincare_velocity[place, :count]
    title = f"{name}, {study.torque:g} N m, {frequency:.0f} Hz"
    plot.phase_portrait(moved.dte, moved.dte_rate, moved.force, panel, once=once, title=title)
