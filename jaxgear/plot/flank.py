"""Figures of the flanks: material removed, load and pressure."""

from collections.abc import Callable, Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.ticker import MaxNLocator

from ..contact import Mesh, MeshCycle, Side
from ..metrics import flank_surface, removed_at
from ..microgeometry import AbstractModification, NoModification
from ..tolerance import ToleranceClass, helix_trace, profile_trace
from .figure import (
    ABOVE,
    GREY,
    HEIGHT,
    PALE,
    Panels,
    captioned,
    colour_bar,
    legend_above,
    legend_over_panels,
    line_style,
    mark_path,
    marker_style,
    report_axes,
    styled,
)
from .mesh_cycle import PATH_LABEL, middle_path, pair_history

WIDTH = 150.0  # of the two panels together [mm]
_BAND = "ISO 1328 tolerance about "  # the name of the design

Design = tuple[AbstractModification | None, AbstractModification | None]
Tolerances = tuple[ToleranceClass | None, ToleranceClass | None]


# abscissa and material removed [um] of a flank, of one shape
Trace = Callable[[Side, AbstractModification], tuple[np.ndarray, np.ndarray]]
# of a band of the tolerance about a flank: abscissa, lower and upper limit of the material removed [um]
Edges = tuple[np.ndarray, np.ndarray, np.ndarray]
Band = Callable[[Side, AbstractModification, ToleranceClass], Edges]  # about a flank of a class
# labels the abscissa of the panel of one gear, "pinion" or "wheel"
Frame = Callable[[Axes, Side, str], None]


def _flank_panels(
    mesh: Mesh,
    designs: Mapping[str, Design],
    ax: Panels | None,
    trace: Trace,
    frame: Frame,
    *,
    above: float = ABOVE,
    tolerance: Tolerances | None = None,
    about: str | None = None,
    band: Band | None = None,
) -> np.ndarray:
    """Draw flanks of pinion and wheel into two Axes: material removed points down, the nominal involute is zero.

    Args:
        mesh: prepared mesh.
        designs: (pinion, wheel) modifications by the name of the design; None for the nominal involute.
        ax: two Axes, for pinion and wheel; None for a new figure.
        trace: one line.
        frame: labels of one panel.
        above: distance of a legend from a panel of a given figure [pt].
        tolerance: classes of pinion and wheel, for a band about a design.
        about: the name of this design; None for the first.
        band: function that makes the band of one panel.
    """
    own = ax is None
    with report_axes(ax, columns=2, width=WIDTH, height=HEIGHT) as panels:
        for index, (panel, title, side) in enumerate(zip(panels, ("pinion", "wheel"), mesh.sides)):
            for style, name, design in styled(designs):
                abscissa, removed = trace(side, design[index] or NoModification())
                panel.plot(abscissa, removed, label=name, **line_style(style))
                panel.set_xlim(abscissa[0], abscissa[-1])
            quality = tolerance[index] if tolerance else None
            if band is not None and quality is not None:
                name = next(iter(designs)) if about is None else about
                middle = designs[name][index] or NoModification()
                place, low, high = band(side, middle, quality)
                panel.fill_between(place, low, high, color=PALE, zorder=0.4, linewidth=0, label=f"{_BAND}{name}")
            frame(panel, side, title)
        panels[0].set_ylabel("material removed [µm]")
        _downwards(panels)
        if own:
            legend_over_panels(panels[0].figure, panels[0])
        else:
            legend_above(panels[0], distance=above)
    return np.asarray(panels)


def _downwards(panels: np.ndarray) -> None:
    """One common ordinate that points down and has the nominal involute in sight."""
    lines = [line.get_ydata() for panel in panels for line in panel.lines]
    bands = [path.vertices[:, 1] for panel in panels for band in panel.collections for path in band.get_paths()]
    values = np.concatenate([[0.0], *lines, *bands])
    low, high = values.min(), max(values.max(), values.min() + 1.0)
    air = 0.06 * (high - low)
    for panel in panels:
        panel.set_ylim(high + air, low - air)


_LEVELS = 9


def topography(mesh: Mesh, design: Design, ax: Panels | None = None) -> np.ndarray:
    """Material removed [um] from pinion and wheel over roll angle [deg] and face coordinate [mm], as contours.

    Args:
        mesh: prepared mesh.
        design: (pinion, wheel) modifications; None for the nominal involute.
        ax: two Axes, for pinion and wheel; None for a new figure.

    Returns:
        the two Axes.
    """
    flanks = zip(mesh.sides, design)
    surfaces = [jax.tree.map(np.asarray, flank_surface(side, flank or NoModification())) for side, flank in flanks]
    low = min(surface.removed.min() for surface in surfaces)
    high = max(surface.removed.max() for surface in surfaces)
    levels = np.linspace(low, high if high > low else low + 1.0, _LEVELS)
    with report_axes(ax, columns=2, width=WIDTH, height=HEIGHT) as panels:
        for panel, title, surface in zip(panels, ("pinion", "wheel"), surfaces):
            panel.grid(False)
            places = surface.roll_angle, surface.face_coordinate, surface.removed
            filled = panel.contourf(*places, levels=levels, cmap="cividis_r")
            panel.contour(*places, levels=levels[1:], colors="black", linewidths=0.3)
            panel.set_xlabel(f"roll angle of the {title} [deg]")
        panels[0].set_ylabel("face coordinate [mm]")
        colour_bar(filled, panels, "material removed [µm]", pad=0.02, format="%.3g")
    return np.asarray(panels)


_POINTS = 201  # across the face


@captioned(
    "Modification across the face, at the pitch point. A shaded band is the total helix tolerance of the quality "
    "class about the design that the legend names."
)
def lead_chart(
    mesh: Mesh,
    designs: Mapping[str, Design],
    ax: Panels | None = None,
    *,
    tolerance: Tolerances | None = None,
    about: str | None = None,
) -> np.ndarray:
    """Material removed from pinion and wheel [um] across their own face widths [mm], at the pitch point.

    Material removed goes down, as in the K-chart, which shows the profile in the middle of the face.

    Args:
        mesh: prepared mesh.
        designs: (pinion, wheel) modifications by the name of the design; None for the nominal involute.
        ax: two Axes, for pinion and wheel; None for a new figure.
        tolerance: classes of pinion and wheel; shades the total helix tolerance about a design, over the evaluation
            range.
        about: the name of this design; None for the first.

    Returns:
        the two Axes.
    """
    return _flank_panels(mesh, designs, ax, _line, _over_face, tolerance=tolerance, about=about, band=_lead_band)


def _lead_band(side: Side, design: AbstractModification, quality: ToleranceClass) -> Edges:
    trace = helix_trace(side, design, quality)
    return _edges(trace.face_coordinate, trace.lower, trace.upper)


def _edges(abscissa: Array, lower: Array, upper: Array) -> Edges:
    """Band of material removed for drawing, over the evaluation range."""
    inside = np.isfinite(upper)
    return np.asarray(abscissa)[inside], -np.asarray(upper)[inside], -np.asarray(lower)[inside]


def _line(side: Side, modification: AbstractModification) -> tuple[np.ndarray, np.ndarray]:
    """Flank line through the pitch point: face coordinates [mm] and material removed [um]."""
    face = jnp.linspace(-0.5, 0.5, _POINTS) * side.face_width
    removed = removed_at(side, modification, jnp.reshape(side.pitch_roll_length, (1,)), face)
    return np.asarray(face), np.asarray(removed)[:, 0]


def _over_face(panel: Axes, side: Side, title: str) -> None:
    panel.set_xlabel(f"face coordinate of the {title} [mm]")


_ABOVE_DIAMETERS = 34.0  # [pt]; clears numbers and label of the upper axis


@captioned(
    "Profile modification of both gears over the roll angle, material removed downwards (K-chart). A shaded band "
    "is the total profile tolerance of the quality class about the design that the legend names."
)
def k_chart(
    mesh: Mesh,
    designs: Mapping[str, Design],
    ax: Panels | None = None,
    *,
    tolerance: Tolerances | None = None,
    about: str | None = None,
) -> np.ndarray:
    """Material removed from pinion and wheel [um] over the roll angle [deg], in the middle of the face.

    The chart extends from the start of the active profile to the tip. The nominal involute is the zero line; material
    removed points down as in reports of gear measuring machines. The upper axis is the diameter [mm].

    Args:
        mesh: prepared mesh.
        designs: (pinion, wheel) modifications by the name of the design; None for the nominal involute.
        ax: two Axes, for pinion and wheel; None for a new figure.
        tolerance: classes of pinion and wheel; shades the total profile tolerance about a design, over the evaluation
            range.
        about: the name of this design; None for the first.

    Returns:
        the two Axes.
    """
    return _flank_panels(
        mesh,
        designs,
        ax,
        _profile,
        _over_roll_angle,
        above=_ABOVE_DIAMETERS,
        tolerance=tolerance,
        about=about,
        band=_profile_band,
    )


def _profile_band(side: Side, design: AbstractModification, quality: ToleranceClass) -> Edges:
    trace = profile_trace(side, design, quality)
    return _edges(trace.roll_angle, trace.lower, trace.upper)


def _profile(side: Side, modification: AbstractModification) -> tuple[np.ndarray, np.ndarray]:
    """The active profile in the middle of the face."""
    surface = flank_surface(side, modification)
    return np.asarray(surface.roll_angle), np.asarray(surface.removed)[len(surface.removed) // 2]


def _over_roll_angle(panel: Axes, side: Side, title: str) -> None:
    panel.set_xlabel(f"roll angle of the {title} [deg]")
    surface = jax.tree.map(np.asarray, flank_surface(side, NoModification()))
    base = float(surface.diameter[-1] / np.hypot(1, np.deg2rad(surface.roll_angle[-1])))

    def to_diameter(angle: np.ndarray) -> np.ndarray:
        return base * np.hypot(1, np.deg2rad(angle))

    def to_angle(diameter: np.ndarray) -> np.ndarray:
        return np.rad2deg(np.sqrt(np.maximum((np.asarray(diameter) / base) ** 2 - 1, 0)))

    upper: Any = panel.secondary_xaxis("top", functions=(to_diameter, to_angle))
    upper.set_xlabel("diameter [mm]", fontsize=panel.xaxis.label.get_fontsize())
    upper.xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    upper.tick_params(labelsize=panel.xaxis.label.get_fontsize(), width=0.6, length=3)


_FACE_LABEL, _PRESSURE_LABEL, _LOAD_LABEL = "face coordinate [mm]", "flank pressure [MPa]", "line load [N/mm]"


@captioned("Pressure over path of contact and face width.")
def pressure_map(cycle: MeshCycle, ax: Axes | None = None) -> Axes:
    """Hertzian pressure [MPa] of one pair over its path of contact and the face width; white where the flanks part.

    Of helical gears a pair touches along inclined lines: those at the position of the largest line load are drawn.

    Args:
        cycle: solved cycle, of several slices to show more than one row.
        ax: Axes to draw into; None for a new figure.
    """
    contact = cycle.kinematics.path_of_contact
    air = 0.05 * float(contact.base_pitch)
    limits = float(contact.start) - air, float(contact.end) + air
    return _over_plane(cycle, cycle.contact_pressure, _PRESSURE_LABEL, limits, ax)


@captioned(
    "Load per length over the plane of action, tip edges before A and after E included, with the contact lines at "
    "its largest value."
)
def plane_of_action(cycle: MeshCycle, ax: Axes | None = None) -> Axes:
    """Line load [N/mm] of one pair all over the plane of action: along the line of action and over the face.

    Tip edges that go on carrying before A and after E are in it; white where nothing touches. Of helical gears a pair
    touches along inclined lines: those at the position of the largest line load are drawn.

    Args:
        cycle: solved cycle, of several slices to show more than one row.
        ax: Axes to draw into; None for a new figure.
    """
    path, _, load = placed(cycle, cycle.line_load)
    corners = np.stack([path[:-1, :-1], path[1:, :-1], path[:-1, 1:], path[1:, 1:]])[:, np.isfinite(load)]
    contact = cycle.kinematics.path_of_contact
    air = 0.05 * float(contact.base_pitch)
    limits = corners.min(initial=float(contact.start)) - air, corners.max(initial=float(contact.end)) + air
    return _over_plane(cycle, cycle.line_load, _LOAD_LABEL, limits, ax)


def _over_plane(cycle: MeshCycle, values: Array, label: str, limits: tuple[float, float], ax: Axes | None) -> Axes:
    """Map of the values of one pair over its path and the face, with the contact lines of helical gears."""
    path, face, shown = placed(cycle, values)
    with report_axes(ax) as ax:
        colour_bar(_draw(ax, path, face, shown, None), ax, label, pad=0.02)
        for line in _contact_lines(cycle):
            ax.plot(line, face, color="black", linewidth=0.7)
        mark_path(ax, cycle.kinematics.path_of_contact, zorder=3)
        ax.set(xlim=limits, ylim=(face[0], face[-1]), xlabel=PATH_LABEL, ylabel=_FACE_LABEL)
    return ax


@captioned("Contact pattern: largest pressure of every place of the flank over a whole mesh.")
def contact_pattern(cycle: MeshCycle, ax: Panels | None = None) -> np.ndarray:
    """Contact pattern: Hertzian pressure [MPa] over the roll angle and the face width of pinion and wheel.

    Each over the active profile, from its start on the left to the tip on the right; white where the flanks part. Of
    helical gears the contact lines at the position of the largest line load are drawn.

    Args:
        cycle: solved cycle, of several slices to show more than one row.
        ax: two Axes, for pinion and wheel; None for a new figure.

    Returns:
        the two Axes.
    """
    path, face, flank = placed(cycle, cycle.contact_pressure)
    most = float(np.nanmax(flank, initial=0.0))
    with report_axes(ax, columns=2, width=WIDTH) as panels:
        for panel, title, side, sign in zip(panels, ("pinion", "wheel"), cycle.sides, (1.0, -1.0)):
            pitch, base = float(side.pitch_roll_length), float(side.base_radius)
            image = _draw(panel, np.rad2deg((pitch + sign * path) / base), face, flank, most)
            for line in _contact_lines(cycle):
                panel.plot(np.rad2deg((pitch + sign * line) / base), face, color="black", linewidth=0.7)
            ends = (float(length) for length in (side.start_roll_length, side.tip_roll_length))
            panel.set_xlim(*np.rad2deg(np.array([*ends]) / base))
            panel.set(ylim=(face[0], face[-1]), xlabel=f"roll angle of the {title} [deg]")
        panels[0].set_ylabel(_FACE_LABEL)
        colour_bar(image, panels[1], _PRESSURE_LABEL, pad=0.02)
    return np.asarray(panels)


def placed(cycle: MeshCycle, values: Array) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Edges of path positions at the ends of the slices and of the slices [mm], shapes (slices + 1, edges) and (slices
    + 1,), and the values of shape (pairs, slices, positions) between them; NaN where the flanks part.
    """
    path, shown = pair_history(cycle, values)
    step, face = path[1] - path[0], _ends(cycle)
    middle = np.append(path, path[-1] + step) - 0.5 * step
    ahead = face * float(cycle.kinematics.pair.path_slope)
    return middle + ahead[:, None], face, np.where(shown > 0, shown, np.nan)


def _ends(cycle: MeshCycle) -> np.ndarray:
    """Where slices end over the face [mm]."""
    return cycle.kinematics.resolution.slice_edges * float(cycle.kinematics.pair.face_width)


def _contact_lines(cycle: MeshCycle) -> list[np.ndarray]:
    """Path positions [mm] of all pairs of helical gears where slices end, at the position of the largest line load."""
    if not cycle.kinematics.helical:
        return []
    middle = middle_path(cycle)[:, _heaviest(cycle)]
    contact = cycle.kinematics.path_of_contact
    lines = middle[:, None] + _ends(cycle) * float(cycle.kinematics.pair.path_slope)
    on_path = (lines >= float(contact.start)) & (lines <= float(contact.end))
    return [np.where(inside, line, np.nan) for line, inside in zip(lines, on_path) if inside.any()]


def _draw(ax: Axes, along: np.ndarray, face: np.ndarray, flank: np.ndarray, most: float | None) -> ScalarMappable:
    ax.grid(False)
    across = np.broadcast_to(face[:, None], along.shape)
    # cividis: even in lightness, so that it reads the same in grey and for every kind of colour vision
    return ax.pcolormesh(along, across, flank, cmap="cividis_r", vmin=0, vmax=most)


@captioned("Load per length over the face.")
def line_load(cycle: MeshCycle, ax: Axes | None = None, *, position: int | None = None) -> Axes:
    """Line load [N/mm] of every loaded pair over the face at one mesh position, the mean over the face beside it.

    For helical gears, whose pairs cover only a part of the face, the sum of all pairs is drawn too; the mean refers to
    this sum.

    Args:
        cycle: solved cycle of several slices.
        ax: Axes to draw into; None for a new figure.
        position: number of the mesh position; None for that with the largest line load.
    """
    where = _heaviest(cycle) if position is None else position
    load = np.asarray(cycle.line_load)[:, :, where]
    face, width = (np.asarray(of) for of in (cycle.kinematics.face_coordinate, cycle.kinematics.slice_width))
    with report_axes(ax) as ax:
        loaded = [int(pair) for pair in np.flatnonzero(load.max(axis=1) > 0)]
        loads = [(f"pair {_place(cycle, pair, where)}", load[pair]) for pair in loaded]
        if cycle.kinematics.helical:
            loads.append(("all pairs", load.sum(axis=0)))
        for index, (name, curve) in enumerate(loads):
            style, mean = marker_style(index), np.average(curve, weights=width)
            if not cycle.kinematics.helical:
                name = f"{name}, K = {curve.max() / mean:.2f}"
            ax.plot(face, curve, label=name, **style)
            if not cycle.kinematics.helical or index == len(loaded):
                ax.axhline(mean, color=style["color"], linewidth=0.6, zorder=0.6)
        ax.set(ylim=(0, None), ylabel=_LOAD_LABEL)
        _finish(ax, cycle, where)
    return ax


@captioned("Gap over the face before the load closes it.")
def face_gap(cycle: MeshCycle, mesh: Mesh, ax: Axes | None = None, *, position: int | None = None) -> Axes:
    """Gap [um] between the flanks of the pair with the largest force over the face at one mesh position, unloaded and
    under load.

    The unloaded gap is due to modifications, misalignment and other meshes on the shafts, measured from the first point
    of contact; for helical gears it is drawn where the pair is on the path of contact. With elastic supports a further
    curve adds the deflection of shafts, bearings and housing under the load of this mesh. The loaded gap is the
    remaining gap outside the contact.

    Args:
        cycle: solved cycle of several slices.
        mesh: prepared mesh that it was solved on.
        ax: Axes to draw into; None for a new figure.
        position: number of the mesh position; None for that with the largest line load.
    """
    where = _heaviest(cycle) if position is None else position
    pair = int(np.asarray(cycle.pair_force)[:, where].argmax())
    unloaded, opening = (np.asarray(of)[pair, :, where] for of in (mesh.held(cycle.gap), cycle.opening))
    if cycle.kinematics.helical:
        beyond = np.asarray(cycle.kinematics.outside)[pair, :, where] > 0
        unloaded, opening = np.where(beyond, np.nan, unloaded), np.where(beyond, np.nan, opening)
    face = np.asarray(cycle.kinematics.face_coordinate)
    curves = {"unloaded": unloaded}
    if mesh.support is not None:
        lever = mesh.lever
        force = np.asarray(cycle.line_load * lever * mesh.slice_width[:, None])[:, :, where].sum(axis=0)
        bent = np.asarray(mesh.support.influence(mesh.face_coordinate)) @ force
        if bent.any():
            curves["on bent shafts"] = unloaded + np.asarray(lever)[pair, :, where] * bent
    curves = {name: curve - np.nanmin(curve) for name, curve in curves.items()}
    curves["under load"] = np.maximum(opening, 0.0)
    with report_axes(ax) as ax:
        for index, (name, curve) in enumerate(curves.items()):
            ax.plot(face, curve, label=name, **marker_style(index))
        ax.set(ylim=(0, None), ylabel="gap [µm]")
        _finish(ax, cycle, where)
    return ax


def _heaviest(cycle: MeshCycle) -> int:
    """Position with the largest line load."""
    return int(np.asarray(cycle.line_load).max(axis=(0, 1)).argmax())


def _place(cycle: MeshCycle, pair: int, position: int) -> str:
    where = " at mid-face" if cycle.kinematics.helical else ""
    return f"{float(middle_path(cycle)[pair, position]):+.2f} mm from the pitch point{where}"


def _finish(ax: Axes, cycle: MeshCycle, position: int) -> None:
    half = 0.5 * float(cycle.kinematics.pair.face_width)
    ax.set(xlim=(-half, half), xlabel=_FACE_LABEL)
    ax.axvline(0.0, color=GREY, linewidth=0.4, zorder=0.5)
    legend_above(ax)
