"""Figures of a mesh at speed: responses over the frequency, spectra and orders, bifurcations and phase portraits."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from jaxtyping import Array, Float
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike

from ..contact import MeshCycle
from ..dynamics import Branch, RunUp, SpeedResponse
from ..metrics import harmonics
from ..numerics import program
from .figure import GREY, captioned, colour_bar, legend_above, line_style, marker_style, report_axes, styled

FREQUENCY_LABEL = "mesh frequency [Hz]"
_APPROACH_LABEL = "dynamic transmission error [µm]"
_RESPONSES = {
    "dynamic_factor": "dynamic factor $K_v$ [-]",
    "dte_rms": "rms of the dynamic\ntransmission error [µm]",
}
_RUNS = ("-", (0, (4, 1.5)), (0, (1, 1)))  # lines of the runs of a design, in their order
RunUps = Mapping[str, RunUp]
Runs = Mapping[str, SpeedResponse] | Sequence[SpeedResponse]  # by what a legend calls them, or by their directions
_MARKS = 12  # on a curve
_PAD, _LINE = 6.0, 13.0  # [pt] of a title over the Axes, and of a line of a legend between both
_DECADES, _DEEPEST = 3.0, 60.0  # of amplitudes that a spectrum shows, and of levels [dB]
_SCALE = 34.0  # [pt] of a second scale below the first one
# drive flanks, clearance, coast flanks: in lightness too
_STATES = {"drive flanks": "#0072B2", "apart": "#E69F00", "coast flanks": "#000000"}
_BIFURCATIONS = {"fold": ("o", "#D55E00"), "flip": ("D", "#009E73"), "Neimark-Sacker": ("s", "#CC79A7")}


def speed_response(
    responses: Mapping[str, Runs | RunUps],
    of: Literal["dynamic_factor", "dte_rms"] = "dynamic_factor",
    ax: Axes | None = None,
    *,
    title: str = "",
) -> Axes:
    """Dynamic factor or rms of the DTE of several designs over the mesh frequency, for rising and falling speed.

    Args:
        responses: runs by the name of the design: speed responses by their text in the legend ("falling, kicked"), or a
            sequence of them, labelled by their directions. Run-ups, which have no rms, may be added or drawn alone.
        of: quantity: the dynamic factor or the rms of the DTE about its mean.
        ax: Axes to draw into; None for a new figure.
        title: title above the Axes and the legend.
    """
    seen: dict[str, Any] = {}
    with report_axes(ax) as ax:
        for index, name, several in styled(responses):
            style = marker_style(index)
            for number, (run, response) in enumerate(_named(several)):
                frequency = np.asarray(response.mesh_frequency)
                every = max(len(frequency) // _MARKS, 1)
                line = seen.setdefault(run, _RUNS[len(seen) % len(_RUNS)])
                dashes = {"linestyle": line, "markevery": (index, every)}
                label = {"label": name} if number == 0 else {}
                ax.plot(frequency, np.asarray(getattr(response, of)), **{**style, **dashes, **label})
        for run, line in seen.items() if len(seen) > 1 else ():
            ax.plot([], [], color=GREY, linestyle=line, label=f"speed {run}")
        _begin_at(ax, 1.0 if of == "dynamic_factor" else 0.0)
        ax.set(xlabel=FREQUENCY_LABEL, ylabel=_RESPONSES[of])
        _entitle(ax, title, legend_above(ax))
    return ax


_MOVES = {"up": "rising", "down": "falling"}


def _named(runs: Runs | RunUps) -> list[tuple[str, Any]]:
    if isinstance(runs, Mapping):
        return list(runs.items())
    return [(_MOVES[response.direction], response) for response in runs]


def _begin_at(ax: Axes, bottom: float) -> None:
    """Lower end of the ordinate; the upper one leaves room for the curves of all Axes that share it."""
    shared = ax.get_shared_y_axes().get_siblings(ax)
    highest = [np.max(line.get_ydata()) for each in shared for line in each.lines if len(line.get_ydata())]
    ax.set_ylim(bottom, bottom + 1.05 * (max(highest, default=bottom + 1.0) - bottom))


def waterfall(
    response: SpeedResponse,
    of: Literal["force", "velocity"] = "force",
    ax: Axes | None = None,
    *,
    title: str = "",
    most: float | None = None,
) -> Axes:
    """Campbell diagram: amplitudes of the spectrum along the multiples of the mesh frequency, over the mesh frequency.

    Args:
        response: speed response of one run.
        of: spectrum of the mesh force or of the velocity of the DTE.
        ax: Axes to draw into; None for a new figure.
        title: title above the Axes and the legend.
        most: amplitude at the upper end of the colours [N or mm/s], for Axes that are to be compared; None for the
            largest of this response.
    """
    unit, scale = ("N", 1.0) if of == "force" else ("mm/s", 1e-3)
    frequency, orders = np.asarray(response.mesh_frequency), np.asarray(response.orders)
    amplitude = scale * np.asarray(getattr(response, f"{of}_harmonics"))
    varying = orders > 0
    orders, amplitude = orders[varying], amplitude[:, varying]
    most = max(float(np.nanmax(amplitude)) if most is None else most, np.finfo(float).tiny)
    norm = LogNorm(most * 10**-_DECADES, most, clip=True)
    with report_axes(ax) as ax:
        for order, along in zip(orders, amplitude.T):
            points = np.stack([frequency, order * frequency], axis=1)
            level = np.sqrt(along[1:] * along[:-1])
            part = np.clip(norm(np.maximum(level, norm.vmin)), 0, 1)
            lines = LineCollection(
                np.stack([points[:-1], points[1:]], axis=1), cmap="cividis_r", norm=norm, linewidths=0.4 + 4.5 * part
            )
            lines.set_array(level)
            ax.add_collection(lines)
        ax.set_xlim(float(frequency.min()), float(frequency.max()))
        ax.set_ylim(0, float(orders.max() * frequency.max()))
        _name_orders(ax, orders, float(frequency.max()))
        what = "mesh force" if of == "force" else "velocity of the DTE"
        colour_bar(lines, ax, f"amplitude of the {what} [{unit}]", pad=0.09)
        ax.set(xlabel=FREQUENCY_LABEL, ylabel="frequency [Hz]")
        _entitle(ax, title, 0)
    return ax


def _name_orders(ax: Axes, orders: np.ndarray, highest: float) -> None:
    for order in orders:
        place = {"xytext": (3, 0), "textcoords": "offset points", "va": "center", "color": GREY}
        if order == round(order):
            ax.annotate(f"{order:g}", (highest, order * highest), annotation_clip=False, **place)


def order_tracks(
    response: SpeedResponse,
    ax: Axes | None = None,
    *,
    orders: Sequence[float] = (1.0, 2.0, 3.0, 4.0, 0.5),
    title: str = "",
) -> Axes:
    """Levels of orders of the mesh force over the mesh frequency: rms values re 1 uN (ISO 1683), the upper 60 dB.

    Args:
        response: speed response of one run.
        orders: multiples of the mesh frequency; orders without amplitudes in the response are left out.
        ax: Axes to draw into; None for a new figure.
        title: title above the Axes and the legend.
    """
    frequency, known = np.asarray(response.mesh_frequency), list(response.orders)
    levels = np.asarray(response.force_levels)
    with report_axes(ax) as ax:
        for index, order in enumerate(orders):
            along = levels[:, known.index(order)] if order in known else np.full(len(frequency), -np.inf)
            if np.isfinite(along).any():
                ax.plot(frequency, along, label=f"order {order:g}", **line_style(index))
        shared = ax.get_shared_y_axes().get_siblings(ax)
        drawn = np.concatenate([np.asarray(line.get_ydata(), float) for each in shared for line in each.lines])
        highest = float(np.max(drawn[np.isfinite(drawn)]))
        ax.set_ylim(highest - _DEEPEST, highest + 0.05 * _DEEPEST)
        ax.set(xlabel=FREQUENCY_LABEL, ylabel="level of the mesh force [dB re 1 µN]")
        _entitle(ax, title, legend_above(ax))
    return ax


def speed_scale(ax: Axes, teeth: float) -> None:
    """Add a second scale below the Axes for the speed of the pinion [rpm].

    Args:
        ax: Axes over the mesh frequency [Hz].
        teeth: number of teeth of the pinion.
    """
    per_hertz = 60 / teeth
    scale = ax.secondary_xaxis("bottom", functions=(lambda at: at * per_hertz, lambda speed: speed / per_hertz))
    scale.spines["bottom"].set_position(("outward", _SCALE))
    scale.tick_params(labelsize=ax.xaxis.label.get_fontsize(), width=0.6, length=3)
    scale.set_xlabel("pinion speed [rpm]")


def bifurcation(responses: Runs, ax: Axes | None = None, *, title: str = "") -> Axes:
    """Bifurcation diagram: the DTE once per mesh cycle over the mesh frequency.

    An orbit of one mesh cycle shows as one point, one of two as two, an aperiodic one as a cloud.

    Args:
        responses: responses of one or several runs, by what the legend says of each; in a sequence each has its
            direction.
        ax: Axes to draw into; None for a new figure.
        title: title above the Axes and the legend.
    """
    with report_axes(ax) as ax:
        for index, (run, response) in enumerate(_named(responses)):
            points = np.asarray(response.poincare_dte)
            frequency = np.broadcast_to(np.asarray(response.mesh_frequency)[:, None], points.shape)
            style = {"color": line_style(1 + index)["color"], "marker": "^v"[index % 2]}
            label = f"speed {run}"
            ax.plot(frequency.ravel(), points.ravel(), linestyle="", markersize=3.0, mew=0, label=label, **style)
        ax.set(xlabel=FREQUENCY_LABEL, ylabel="dynamic transmission error\nat mesh position 0 [µm]")
        _entitle(ax, title, legend_above(ax))
    return ax


@captioned("Stable and unstable periodic motions of the unmodified design.")
def branches(
    found: Sequence[Branch],
    of: Literal["dynamic_factor", "dte_rms"] = "dynamic_factor",
    ax: Axes | None = None,
    *,
    responses: Sequence[SpeedResponse] = (),
    title: str = "",
) -> Axes:
    """Response curve of branches of orbits over the mesh frequency: stable and unstable parts, and bifurcations.

    Args:
        found: branches of one oscillator.
        of: quantity: the dynamic factor or the rms of the DTE about its mean.
        ax: Axes to draw into; None for a new figure.
        responses: runs through the speeds, whose steady states are marked.
        title: title above the Axes and the legend.
    """
    names: dict[str, None] = {}

    def once(name: str) -> dict[str, str]:
        first = name not in names
        names[name] = None
        return {"label": name} if first else {}

    with report_axes(ax) as ax:
        for response in responses:
            values = np.asarray(getattr(response, of))
            dots = {"linestyle": "", "marker": "o", "markersize": 2.5, "mew": 0, "color": GREY, "alpha": 0.6}
            ax.plot(np.asarray(response.mesh_frequency), values, **dots, **once("steady states of the runs"))
        for branch in found:
            at, values, stable = _curve(branch, of)
            parts = {
                "stable": (stable[1:] & stable[:-1], "-"),
                "unstable": (~(stable[1:] & stable[:-1]), (0, (3, 1.5))),
            }
            for name, (there, dashes) in parts.items():
                if there.any():
                    ends = np.append(there, False) | np.insert(there, 0, False)
                    apart = np.where(ends, values, np.nan)
                    ax.plot(at, apart, color=_STATES["drive flanks"], linestyle=dashes, linewidth=1.4, **once(name))
            for one in branch.bifurcations:
                marker, color = _BIFURCATIONS[one.kind]
                place = float(one.parameter), float(getattr(one.orbit, of))
                ax.plot(*place, marker, color=color, markersize=5, zorder=3, **once(one.kind))
        _begin_at(ax, 1.0 if of == "dynamic_factor" else 0.0)
        ax.set(xlabel=FREQUENCY_LABEL, ylabel=_RESPONSES[of])
        _entitle(ax, title, legend_above(ax))
    return ax


def _curve(branch: Branch, of: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mesh frequencies, values and stability along a branch, with its bifurcations, which belong to both sides."""
    places = np.asarray(branch.before, int)
    between = [float(one.parameter) for one in branch.bifurcations]
    reached = [float(getattr(one.orbit, of)) for one in branch.bifurcations]
    at = np.insert(np.asarray(branch.mesh_frequency, float), places, between)
    values = np.insert(np.asarray(getattr(branch.orbits, of), float), places, reached)
    return at, values, np.insert(np.asarray(branch.stable), places, np.ones(len(places), bool))


def phase_portrait(
    dte: ArrayLike,
    velocity: ArrayLike,
    force: ArrayLike,
    ax: Axes | None = None,
    *,
    section: tuple[ArrayLike, ArrayLike] | None = None,
    title: str = "",
) -> Axes:
    """Phase portrait: an orbit in the plane of DTE and velocity, coloured by drive contact, no contact, coast contact.

    Args:
        dte: DTE of the flanks at equal steps of one period [um], shape (steps,).
        velocity: velocity of the DTE [um/s], shape (steps,).
        force: mesh force [N], shape (steps,): positive on the drive flanks, negative on the coast flanks.
        section: DTE [um] and velocity [um/s] once per mesh cycle, each of shape (points,); None for no marks.
        ax: Axes to draw into; None for a new figure.
        title: title above the Axes and the legend.
    """
    x, y, f = np.asarray(dte), 1e-3 * np.asarray(velocity), np.asarray(force)
    closed = np.stack([np.append(x, x[0]), np.append(y, y[0])], axis=1)
    segments = np.stack([closed[:-1], closed[1:]], axis=1)
    states = dict(zip(_STATES, (f > 0, f == 0, f < 0)))
    with report_axes(ax) as ax:
        for name, there in states.items():
            if there.any():
                ax.add_collection(LineCollection(segments[there], colors=_STATES[name], linewidths=1.4, label=name))
        if section is not None:
            ax.plot(
                np.asarray(section[0]),
                1e-3 * np.asarray(section[1]),
                "o",
                color="#D55E00",
                markersize=4,
                label="once a cycle",
            )
        ax.autoscale_view()
        ax.set(xlabel=_APPROACH_LABEL, ylabel="its rate [mm/s]")
        _entitle(ax, title, legend_above(ax))
    return ax


def _entitle(ax: Axes, title: str, lines: int) -> None:
    """Add a title above a legend with a number of lines."""
    if title:
        ax.set_title(title, loc="left", pad=_PAD + _LINE * lines, fontsize=ax.xaxis.label.get_fontsize())


_GROUP = 0.8  # of the distance between two orders, which the bars of all designs share


@captioned("Amplitudes of the transmission error at the orders of the mesh frequency.")
def transmission_error_orders(cycles: Mapping[str, MeshCycle], ax: Axes | None = None, *, count: int = 8) -> Axes:
    """Amplitudes of the mesh harmonics of the transmission error [um] as bars, design beside design.

    Args:
        cycles: solved cycles by the name of their design.
        ax: Axes to draw into; None for a new figure.
        count: number of harmonics, less than half the positions.

    Raises:
        ValueError: for more harmonics than the positions resolve.
    """
    width = _GROUP / max(len(cycles), 1)
    orders = np.arange(1, count + 1)
    with report_axes(ax) as ax:
        for index, name, cycle in styled(cycles):
            amplitude = np.asarray(_amplitudes(cycle.transmission_error, count))
            place = orders + (index - (len(cycles) - 1) / 2) * width
            ax.bar(
                place, amplitude, width, label=name, color=line_style(index)["color"], edgecolor="white", linewidth=0.3
            )
        ax.grid(False, axis="x")
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
        ax.set(xlim=(0.4, count + 0.6), xlabel="mesh order [-]", ylabel="amplitude of the\ntransmission error [µm]")
        legend_above(ax)
    return ax


@program
def _amplitudes(error: Float[Array, " positions"], count: int) -> Float[Array, " orders"]:
    return harmonics(error, count).amplitude
