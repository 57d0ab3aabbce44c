"""Curves over the mesh cycle: transmission error, load sharing, stiffness, pressure."""

from collections.abc import Iterable, Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike

from ..contact import MeshCycle
from ..metrics import load_sharing as share
from ..metrics import secant_stiffness
from .figure import ABOVE_MARKS, GREY, captioned, legend_above, line_style, mark_path, report_axes, styled

PATH_LABEL = "path of contact from the pitch point [mm]"
PHASE_LABEL = "mesh phase [base pitches]"


def middle_path(cycle: MeshCycle) -> np.ndarray:
    """Path position of every pair in the middle of the face [mm], shape (pairs, positions)."""
    kinematics = cycle.kinematics
    path = np.asarray(kinematics.path)[:, 0]
    if not kinematics.helical:
        return path
    return path - float(kinematics.face_coordinate[0] * kinematics.pair.path_slope)


def _path_label(cycles: Iterable[MeshCycle]) -> str:
    """Axis label of path positions; positions at mid-face if any cycle is of helical gears."""
    return PATH_LABEL.replace(" [", ", mid-face [") if any(cycle.kinematics.helical for cycle in cycles) else PATH_LABEL


def pair_history(cycle: MeshCycle, values: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Path positions and values of one pair from first to last contact.

    All pairs are equal and follow each other at a distance of one base pitch: the pairs of a cycle, sorted by path
    position, are the history of one pair.

    Args:
        cycle: solved mesh cycle.
        values: shape (pairs, ..., positions).

    Returns:
        the path positions in the middle of the face [mm], shape (pairs * positions,), and the values there, shape (...,
        pairs * positions).
    """
    path = middle_path(cycle).ravel()
    stages = np.moveaxis(np.asarray(values), 0, -2)
    stages = stages.reshape(*stages.shape[:-2], -1)
    order = np.argsort(path, kind="stable")
    return path[order], stages[..., order]


def _path_limits(cycles: Iterable[MeshCycle]) -> tuple[float, float]:
    """Path range of the path of contact and all loaded contact of these cycles, with a margin [mm]."""
    low, high = [], []
    for cycle in cycles:
        contact = cycle.kinematics.path_of_contact
        loaded = middle_path(cycle)[np.asarray(cycle.pair_force) > 0]
        air = 0.1 * float(contact.base_pitch)
        low.append(min(float(contact.start), loaded.min(initial=np.inf)) - air)
        high.append(max(float(contact.end), loaded.max(initial=-np.inf)) + air)
    return min(low), max(high)


def two_pitches(phase: ArrayLike, curve: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Phase and curve over two base pitches from zero on, closed at the end.

    Args:
        phase: equally spaced over one base pitch, which may begin before zero, shape (positions,).
        curve: periodic values, shape (..., positions).
    """
    places, values = np.mod(np.asarray(phase), 1.0), np.asarray(curve)
    order = np.argsort(places, kind="stable")
    places, values = places[order], values[..., order]
    ends = [places, places + 1, places[:1] + 2]
    return np.concatenate(ends), np.concatenate([values, values, values[..., :1]], axis=-1)


@captioned("Loaded transmission error over two base pitches at the design torque, with its peak-to-peak value (PPTE).")
def transmission_error(cycles: Mapping[str, MeshCycle], ax: Axes | None = None) -> Axes:
    """Loaded transmission error [um] of several designs over two base pitches, with their PPTE in the legend.

    Args:
        cycles: solved cycles by the name of their design.
        ax: Axes to draw into; None for a new figure.
    """
    with report_axes(ax) as ax:
        for index, name, cycle in styled(cycles):
            ppte = np.ptp(np.asarray(cycle.transmission_error))
            curve = two_pitches(cycle.phase, cycle.transmission_error)
            ax.plot(*curve, label=f"{name} (PPTE {ppte:.2f} µm)", **line_style(index))
        ax.set(xlim=(0, 2), xlabel=PHASE_LABEL, ylabel="transmission error [µm]")
        legend_above(ax)
    return ax


@captioned("Share of the load that one tooth pair carries on its way along the path of contact.")
def load_sharing(cycles: Mapping[str, MeshCycle], ax: Axes | None = None) -> Axes:
    """Share of one pair in the total force over its whole path, corner contact before A and after E included.

    Args:
        cycles: solved cycles by the name of their design; the points A to E are those of the first.
        ax: Axes to draw into; None for a new figure.
    """
    with report_axes(ax) as ax:
        for index, name, cycle in styled(cycles):
            ax.plot(*pair_history(cycle, share(cycle)), label=name, **line_style(index))
        if cycles:
            mark_path(ax, next(iter(cycles.values())).kinematics.path_of_contact)
            ax.set_xlim(_path_limits(cycles.values()))
        ax.set(ylim=(0, 1.05), xlabel=_path_label(cycles.values()), ylabel="share of the pair in the load [-]")
        legend_above(ax, distance=ABOVE_MARKS)
    return ax


def mesh_stiffness(cycle: MeshCycle, ax: Axes | None = None) -> Axes:
    """Secant and tangent mesh stiffness [N/um] of one design over two base pitches.

    The secant is force over deflection, for static deflections; the tangent the local slope, for small vibrations.

    Args:
        cycle: solved cycle.
        ax: Axes to draw into; None for a new figure.
    """
    curves = {"tangent": cycle.tangent_stiffness, "secant": secant_stiffness(cycle)}
    with report_axes(ax) as ax:
        for index, (name, values) in enumerate(curves.items()):
            mean = float(np.mean(np.asarray(values)))
            ax.plot(*two_pitches(cycle.phase, values), label=f"{name} (mean {mean:.0f} N/µm)", **line_style(index))
        ax.set(xlim=(0, 2), xlabel=PHASE_LABEL, ylabel="mesh stiffness [N/µm]")
        ax.set_ylim(bottom=0)
        legend_above(ax)
    return ax


_DECADE = (1, 2, 5)  # ticks
_LINEAR = 1.5  # share of the linear part of the scale [decades of the logarithmic one]


@captioned("Largest pressure of one tooth pair along the path of contact, of flanks and tip corners (dots).")
def pressure(cycles: Mapping[str, MeshCycle], ax: Axes | None = None) -> Axes:
    """Hertzian pressure [MPa] of one pair over its path of contact, the largest of all slices.

    Lines on the path of contact are that of the flanks. Dots before A and after E are that of the tip corners, another
    kind of contact, whose pressure depends on the tip edge radius; the legend has its largest value, to 10 MPa. It may
    be many times that of the flanks: the scale is linear as far as these go, and logarithmic above. Of helical gears,
    whose slices come to the path of contact one after the other, either is drawn as long as any slice has it.

    Args:
        cycles: solved cycles by the name of their design; the points A to E are those of the first.
        ax: Axes to draw into; None for a new figure.
    """
    corners: dict[int, tuple[np.ndarray, np.ndarray]] = {}
    highest = 0.0
    with report_axes(ax) as ax:
        for index, name, cycle in styled(cycles):
            path, flank = pair_history(cycle, np.asarray(cycle.contact_pressure).max(axis=1))
            _, corner = pair_history(cycle, np.asarray(cycle.corner_pressure).max(axis=1))
            contact = cycle.kinematics.path_of_contact
            outside = (path < float(contact.start)) | (path > float(contact.end))
            if cycle.kinematics.helical:
                outside = flank == 0
            highest = max(highest, float(flank.max()))
            label = name
            if corner.max() > 0:
                corners[index] = path[corner > 0], corner[corner > 0]
                label = f"{name} (corners {round(corner.max(), -1):.0f} MPa)"
            ax.plot(path, np.where(outside, np.nan, flank), label=label, **line_style(index))
        for index, (path, corner) in corners.items():
            ax.plot(path, corner, color=line_style(index)["color"], linestyle="none", marker="o", markersize=3)
        if corners:
            end = _two_scales(ax, highest, max(corner.max() for _, corner in corners.values()))
            label = f"tip corner contact; scale logarithmic above {end:g} MPa"
            ax.plot([], [], color=GREY, linestyle="none", marker="o", markersize=3, label=label)
        if cycles:
            mark_path(ax, next(iter(cycles.values())).kinematics.path_of_contact)
            ax.set_xlim(_path_limits(cycles.values()))
        ax.set_ylim(bottom=0)
        ax.set(xlabel=_path_label(cycles.values()), ylabel="pressure [MPa]")
        legend_above(ax, distance=ABOVE_MARKS)
    return ax


def _two_scales(ax: Axes, flank: float, corner: float) -> float:
    """Make the scale linear up to the first tick above the flank pressure and logarithmic beyond; returns the tick."""
    linear = MaxNLocator(nbins=5).tick_values(0.0, max(flank, 1.0))
    end = float(linear[-1])
    ax.set_yscale("symlog", linthresh=end, linscale=_LINEAR)
    decade = 10.0 ** np.floor(np.log10(end))
    steps = np.outer(decade * 10.0 ** np.arange(4), _DECADE).ravel()
    above = steps[(steps > end) & (steps < 2.5 * corner)]  # the first one beyond it, too
    ax.set_yticks([*linear, *above], minor=False)
    ax.set_yticks([], minor=True)
    ax.yaxis.set_major_formatter("{x:g}")
    return end
