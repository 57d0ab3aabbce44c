"""Figures of planetary stages: places and phases of the planets, load shares, orders, orbit."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Wedge

from ..metrics import peak_to_peak
from ..plot.figure import GREY, PALE, captioned, legend_above, line_style, report_axes, styled
from ..plot.mesh_cycle import PHASE_LABEL, two_pitches
from .cycle import StageCycle
from .kinematics import phasing, planet_phases
from .response import StageResponse
from .stage import PlanetaryStage

_SIZE = 95.0  # of the drawing of a stage [mm]
_LEAST_SHARE = 0.05  # on either side of 1: what is less is nothing
_MOTIONS = {"rotation": "R", "translation": "T", "none": "\N{EN DASH}"}


@captioned("Working circles of the gears, and at every planet its mesh positions with sun and ring.")
def stage_drawing(stage: PlanetaryStage, ax: Axes | None = None) -> Axes:
    """Working pitch circles of sun, planets, ring [mm], with the mesh positions of every planet at phase zero.

    The filled part of a disc is the mesh position, of a base pitch from the top clockwise: the inner one of the mesh
    with the sun, the outer one with the ring.

    Args:
        stage: the stage, of concrete numbers.
        ax: Axes to draw into; None for a new figure.
    """
    gears = stage.gears
    distance = float(gears.working_center_distance)
    sun, ring = (
        float(distance * teeth / total)
        for teeth, total in (
            (gears.sun_teeth, gears.sun_teeth + gears.planet_teeth),
            (gears.ring_teeth, gears.ring_teeth - gears.planet_teeth),
        )
    )
    angles = np.asarray(stage.planet_angles)
    phases = [np.asarray(each) for each in planet_phases(stage)]
    disc = 0.16 * (distance - sun)
    with report_axes(ax, width=_SIZE, height=_SIZE) as ax:
        for radius in (sun, ring):
            ax.add_patch(Circle((0, 0), radius, fill=False, edgecolor="black", linewidth=1.2))
        ax.plot(0, 0, marker="+", color="black", markersize=7)
        for number, angle in enumerate(angles):
            out = np.asarray([np.cos(angle), np.sin(angle)])
            ax.add_patch(Circle(tuple(distance * out), distance - sun, fill=False, edgecolor="black", linewidth=1.2))
            ax.plot([0, distance * out[0]], [0, distance * out[1]], color=PALE, linewidth=0.8, zorder=0)
            ax.text(*(distance * out), str(number + 1), ha="center", va="center")
            for place, phase, style in zip((sun + 1.6 * disc, ring - 1.6 * disc), phases, (1, 2)):
                _share(ax, place * out, disc, float(phase[number]), line_style(style)["color"])
        margin = 1.06 * ring
        ax.set(xlim=(-margin, margin), ylim=(-margin, margin), xlabel="x [mm]", ylabel="y [mm]", aspect="equal")
        for name, style in (("phase with the sun", 1), ("phase with the ring", 2)):
            ax.plot([], [], linestyle="none", marker="o", color=line_style(style)["color"], label=name)
        legend_above(ax)
    return ax


def _share(ax: Axes, place: np.ndarray, radius: float, share: float, colour: str) -> None:
    """A disc of which a share is filled, from the top clockwise."""
    centre = (float(place[0]), float(place[1]))
    ax.add_patch(Circle(centre, radius, facecolor="white", edgecolor=colour, linewidth=1.0, zorder=3))
    ax.add_patch(Wedge(centre, radius, 90 - 360 * share, 90, facecolor=colour, edgecolor="none", zorder=3))


@captioned("Load share of every planet over two base pitches, over the mean of all planets.")
def load_shares(cycle: StageCycle, ax: Axes | None = None) -> Axes:
    """Load share of every planet over two base pitches, with its mean over the cycle in the legend.

    Args:
        cycle: solved cycle.
        ax: Axes to draw into; None for a new figure.
    """
    means = np.asarray(cycle.mean_load_share)
    with report_axes(ax) as ax:
        for number, share in enumerate(np.asarray(cycle.load_share)):
            label = f"planet {number + 1} ({means[number]:.3f})"
            ax.plot(*two_pitches(cycle.phase, share), label=label, **line_style(number))
        ax.axhline(1.0, color=GREY, linewidth=0.6, zorder=0.5)
        widest = max(_LEAST_SHARE, 1.1 * float(np.abs(np.asarray(cycle.load_share) - 1).max()))
        ax.set_ylim(1 - widest, 1 + widest)
        ax.set(xlim=(0, 2), xlabel=PHASE_LABEL, ylabel="load share of the planet [-]")
        legend_above(ax)
    return ax


@captioned("Transmission error of the stage over two base pitches about its mean, with its peak-to-peak value (PPTE).")
def transmission_error(cycles: Mapping[str, StageCycle], ax: Axes | None = None) -> Axes:
    """Transmission error of several stages over two base pitches, without its mean [um].

    Args:
        cycles: solved cycles by the name of their design.
        ax: Axes to draw into; None for a new figure.
    """
    with report_axes(ax) as ax:
        for index, name, cycle in styled(cycles):
            curve = np.asarray(cycle.transmission_error)
            label = f"{name} (PPTE {float(peak_to_peak(cycle.transmission_error)):.2f} µm)"
            ax.plot(*two_pitches(cycle.phase, curve - curve.mean()), label=label, **line_style(index))
        ax.set(xlim=(0, 2), xlabel=PHASE_LABEL, ylabel="transmission error less mean [µm]")
        legend_above(ax)
    return ax


@captioned(
    "Mesh orders of the transmission error; by the phases of equal planets they excite rotation (R) or translation (T)."
)
def orders(cycles: Mapping[str, StageCycle], ax: Axes | None = None, *, count: int = 6) -> Axes:
    """Amplitudes of the mesh orders of several stages [um].

    Below every order stands what it excites of equal planets by their phases (of the first stage): rotation (R) and so
    a transmission error, translation (T), or neither.

    Args:
        cycles: solved cycles by the name of their design.
        ax: Axes to draw into; None for a new figure.
        count: number of orders.
    """
    places, width = np.arange(1, count + 1), 0.8 / max(len(cycles), 1)
    with report_axes(ax) as ax:
        for number, (index, name, cycle) in enumerate(styled(cycles)):
            shift = (number - 0.5 * (len(cycles) - 1)) * width
            amplitude = np.asarray(cycle.orders(count).amplitude)
            ax.bar(places + shift, amplitude, width, color=line_style(index)["color"], label=name)
        kinds = phasing(next(iter(cycles.values())).stage, count).kinds if cycles else ()
        ax.set_xticks(places[: len(kinds)], [f"{order}\n{_MOTIONS[kind]}" for order, kind in zip(places, kinds)])
        ax.grid(visible=False, axis="x")
        ax.set(xlabel="mesh order, motion that it excites", ylabel="transmission error, amplitude [µm]")
        legend_above(ax)
    return ax


@captioned("Path of the centre of the sun over one base pitch.")
def orbit(cycles: Mapping[str, StageCycle], ax: Axes | None = None) -> Axes:
    """Path of the centre of the sun over one base pitch [um], about its mean place, which the legend gives.

    Args:
        cycles: solved cycles by the name of their design.
        ax: Axes to draw into; None for a new figure.
    """
    with report_axes(ax, width=_SIZE, height=_SIZE) as ax:
        for index, name, cycle in styled(cycles):
            path = np.asarray(cycle.sun_displacement)
            x, y = path.mean(axis=1)
            about = np.concatenate([path, path[:, :1]], axis=1) - [[x], [y]]
            ax.plot(*about, label=f"{name} (about {_rounded(x)}, {_rounded(y)} µm)", **line_style(index))
        ax.plot(0, 0, marker="+", color=GREY, markersize=7)
        ax.set(xlabel="x of the sun [µm]", ylabel="y of the sun [µm]")
        ax.set_aspect("equal", adjustable="datalim")
        legend_above(ax)
    return ax


@captioned("Largest force of a mesh over the mean of all, linear vibration; dotted where a mesh would lose contact.")
def dynamic_factors(responses: Mapping[str, StageResponse], ax: Axes | None = None) -> Axes:
    """Dynamic factor of a stage over the mesh frequency.

    Args:
        responses: vibration by the name of the design.
        ax: Axes to draw into; None for a new figure.
    """
    with report_axes(ax) as ax:
        for index, name, response in styled(responses):
            frequency, factor = (np.asarray(each) for each in (response.mesh_frequency, response.dynamic_factor))
            held = ~np.asarray(response.loses_contact)
            style = line_style(index)
            ax.plot(1e-3 * frequency, np.where(held, factor, np.nan), label=name, **style)
            ax.plot(1e-3 * frequency, factor, **{**style, "linestyle": ":", "linewidth": 0.8})
        ax.set(xlabel="mesh frequency [kHz]", ylabel="dynamic factor of the meshes [-]")
        ax.set_ylim(bottom=1.0)
        legend_above(ax)
    return ax


def _rounded(value: float) -> str:
    """A number with one digit, never -0.0."""
    return f"{round(value, 1) + 0.0:.1f}"
