"""Common parts of all figures: report size, line styles, marks and files."""

import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from io import BytesIO
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import ScaledTranslation

from ..geometry import PathOfContact
from ..io import writing
from ..numerics.durable import write_durably

_INCH = 25.4  # mm
_POINTS_PER_INCH = 72
WIDTH, HEIGHT = 120.0, 75.0  # of a figure in a report [mm]
FONT = 9.0  # [pt]
_DPI = 200
_MARGIN = 0.03  # of a picture about its contents [in]

# Okabe and Ito's colours, which stay apart for every kind of colour vision, with a grey for the yellow that pales on
# paper; each comes with its own dashes for a black-and-white print.
_COLOURS = ("#000000", "#D55E00", "#0072B2", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#8C8C8C")
_DASHES = (
    "-",
    (0, (6, 1.5)),
    (0, (1.5, 1)),
    (0, (7, 1.5, 1.5, 1.5)),
    (0, (3, 1.5)),
    (0, (9, 2, 2, 2, 2, 2)),
    (0, (1, 2)),
    (0, (12, 2)),
)
_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<")
GREY = "#595959"
PALE = "#D9D9D9"
_BOLD, _BEFORE_LINES = 2.6, 2.5  # width [pt] and zorder of the line that a figure is about
_LEGEND_LINE = 12.0  # [pt]
_SURELY = 0.9  # share of the width of a figure's only Axes; a legend up to this width fits in one row in any layout
ABOVE = 4.0  # [pt]; between the Axes and a legend over them
ABOVE_MARKS = 16.0  # [pt]; clears a line of text that stands on the Axes

_STYLE = {
    "font.size": FONT,
    "axes.labelsize": FONT,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "axes.axisbelow": True,
    "legend.fontsize": FONT - 1,
    "mathtext.default": "regular",
}


Panels = Sequence[Axes] | np.ndarray
_Drawn = TypeVar("_Drawn")
_NUMBERS: ContextVar[Mapping[str, int]] = ContextVar("numbers of designs", default=MappingProxyType({}))
# style numbers of designs, best first, that stand apart from the black of the first design and from a blue cloud
APART = (1, 3, 4, 5, 2, 6, 7)


def captioned(caption: str) -> Callable[[_Drawn], _Drawn]:
    """Decorator that sets the caption of a plot function for reports, as its attribute `caption`."""

    def mark(draw: _Drawn) -> _Drawn:
        setattr(draw, "caption", caption)  # noqa: B010 - a function has no such attribute for type checkers
        return draw

    return mark


@contextmanager
def same_styles(numbers: Mapping[str, int]) -> Iterator[None]:
    """Context in which a design has the same colour and line style in every figure.

    Args:
        numbers: index of the style, as for `line_style`, by the name of the design. Designs without an index get the
            style of their position in the figure.
    """
    before = _NUMBERS.set(MappingProxyType(dict(numbers)))
    try:
        yield
    finally:
        _NUMBERS.reset(before)


def style_number(name: str, place: int) -> int:
    """Index of the style of a design: from `same_styles`, or else its position in the figure."""
    return _NUMBERS.get().get(name, place)


def styled(designs: Mapping[str, _Drawn]) -> Iterator[tuple[int, str, _Drawn]]:
    """Index of the style, name and drawn object of every design."""
    for place, (name, drawn) in enumerate(designs.items()):
        yield style_number(name, place), name, drawn


def line_style(index: int) -> dict[str, Any]:
    """Colour, dashes and line width of a style, by its index."""
    return {"color": _COLOURS[index % len(_COLOURS)], "linestyle": _DASHES[index % len(_DASHES)], "linewidth": 1.4}


def marker_style(index: int) -> dict[str, Any]:
    """Colour, dashes, line width and marker of a style, by its index."""
    return {**line_style(index), "marker": _MARKERS[index % len(_MARKERS)], "markersize": 3.5}


def point_style(index: int) -> dict[str, Any]:
    """Colour and marker of the points with this number, without a line; sixteen differ, the second eight hollow."""
    colour = _COLOURS[index % len(_COLOURS)]
    hollow = index // len(_COLOURS) % 2 == 1
    return {
        "color": colour,
        "marker": _MARKERS[index % len(_MARKERS)],
        "linestyle": "",
        "markersize": 5.5 if hollow else 6.5,
        "markerfacecolor": "white" if hollow else colour,
        "markeredgecolor": colour if hollow else "white",
        "markeredgewidth": 1.2 if hollow else 0.5,
    }


_LINE = 34  # letters along an axis of report height, about which a long label is broken


def wrapped(text: str, room: int = _LINE) -> str:
    """Label broken into lines of at most `room` letters between words, with the unit in the last line."""
    bound = text.replace(" [", "\N{NO-BREAK SPACE}[")
    return textwrap.fill(bound, max(room, 1), break_long_words=False, break_on_hyphens=False)


@contextmanager
def report_axes(
    ax: Axes | Panels | None, *, columns: int = 1, rows: int = 1, width: float = WIDTH, height: float = HEIGHT
) -> Iterator[Axes]:
    """Context with the given Axes, or with new Axes in report style.

    Args:
        ax: Axes, an array of them for several panels, or None.
        columns: number of panels side by side with a common ordinate; several panels give an array of Axes.
        rows: number of panels on top of each other with a common abscissa; several panels give an array of Axes.
        width, height: size of a new figure [mm].
    """
    if ax is not None:
        yield ax
        return
    with report_figure(width, height) as figure:
        panels = figure.subplots(rows, columns, sharex="col", sharey="row", squeeze=False).ravel()
        for panel in panels:
            # ticks are made when the figure is drawn, long after the style has gone: they need their own sizes
            panel.tick_params(labelsize=FONT, width=0.6, length=3)
            panel.grid(True, color=PALE, linewidth=0.5)
        yield panels if len(panels) > 1 else panels[0]


def panels(
    draw: Callable[[Axes, _Drawn], object],
    each: Iterable[_Drawn],
    *,
    width: float = WIDTH,
    height: float = HEIGHT,
    stacked: bool = False,
) -> Axes | np.ndarray:
    """New figure of several panels with a common ordinate, or with a common abscissa if they are stacked.

    Args:
        draw: function that draws an item into the Axes of a panel; inner panels lose the label of the common axis.
        each: items, one per panel.
        width, height: size of a panel [mm].
        stacked: True for panels on top of each other, False for panels side by side.
    """
    shown = list(each)
    count, kind = len(shown), "rows" if stacked else "columns"
    size = {"width": width, "height": height * count} if stacked else {"width": width * count, "height": height}
    with report_axes(None, **{kind: count}, **size) as made:  # type: ignore[arg-type]
        for panel, drawn in zip(np.ravel(made), shown):
            draw(panel, drawn)
        for panel in np.ravel(made)[:-1] if stacked else np.ravel(made)[1:]:
            panel.set(**{"xlabel" if stacked else "ylabel": ""})
    return made


@contextmanager
def report_figure(width: float, height: float) -> Iterator[Figure]:
    """A new, empty figure [mm] in report style; the style is off again after the `with` block."""
    with matplotlib.rc_context(_STYLE):
        yield plt.figure(figsize=(width / _INCH, height / _INCH), layout="constrained")


def emphasize(figure: Figure, name: str) -> None:
    """Emphasize the lines of one design in a figure: wider, and in front of all others.

    Args:
        figure: figure with one line per design.
        name: name of the design; labels may continue in brackets. A figure without the design is not changed.
    """
    legends = [*figure.legends, *(ax.get_legend() for ax in figure.axes if ax.get_legend() is not None)]
    marks = [mark for legend in legends for mark in zip(legend.get_texts(), legend.legend_handles)]
    lines = [line for ax in figure.axes for line in ax.lines if _is_of(str(line.get_label()), name)]
    lines += [mark for text, mark in marks if _is_of(text.get_text(), name) and isinstance(mark, Line2D)]
    for line in lines:
        line.set(linewidth=_BOLD, zorder=_BEFORE_LINES)


def _is_of(label: str, name: str) -> bool:
    return label == name or label.startswith(f"{name} (")


def legend_above(ax: Axes, *, distance: float = ABOVE) -> int:
    """Legend over the Axes, where it covers no data, in as many columns as fit.

    Args:
        ax: Axes with labelled artists.
        distance: between Axes and legend [pt]; `ABOVE_MARKS` where letters stand in between.

    Returns:
        its number of lines.
    """
    handles, labels = ax.get_legend_handles_labels()
    if not handles:
        return 0
    lift = ScaledTranslation(0, distance / _POINTS_PER_INCH, _root(ax).dpi_scale_trans)

    def width_of(columns: int) -> float:
        legend = ax.legend(
            handles,
            labels,
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            bbox_transform=ax.transAxes + lift,
            ncols=columns,
            borderaxespad=0.0,
            borderpad=0.1,
            frameon=False,
            handlelength=2.6,
            columnspacing=1.5,
        )
        return _in_points(ax, legend.get_window_extent().width)

    columns = len(labels)
    if len(_root(ax).axes) == 1 and width_of(columns) <= _SURELY * _in_points(ax, ax.get_window_extent().width):
        return 1  # wherever the Axes will be laid out, which takes as long to find out as to draw them
    if (legend := ax.get_legend()) is not None:
        legend.remove()  # which takes its room from the Axes
    room = laid_out_size(ax)[0]
    while width_of(columns) > room and columns > 1:
        columns -= 1
    return -(-len(labels) // columns)


def legend_over_panels(figure: Figure, panel: Axes) -> int:
    """Legend of one panel over all panels of a new figure, in as many columns as fit.

    Returns:
        its number of lines.
    """
    handles, labels = panel.get_legend_handles_labels()
    for columns in range(len(labels), 0, -1):
        legend = figure.legend(
            handles, labels, loc="outside upper center", ncols=columns, handlelength=2.6, frameon=False
        )
        _lay_out(figure)
        if legend.get_window_extent().width <= figure.bbox.width or columns == 1:
            return -(-len(labels) // columns)
        legend.remove()
    return 0


def grow(ax: Axes, lines: int) -> None:
    """Increase the height of a new figure by the lines of a legend, so that the Axes keep their size."""
    figure = _root(ax)
    figure.set_figheight(figure.get_figheight() + lines * _LEGEND_LINE / _POINTS_PER_INCH)


def laid_out_size(ax: Axes) -> tuple[float, float]:
    """Width and height that the Axes have when the figure is drawn [pt]."""
    _lay_out(_root(ax))
    box = ax.get_window_extent()
    return _in_points(ax, box.width), _in_points(ax, box.height)


def _lay_out(figure: Figure) -> None:
    """Compute the places of all artists without drawing the figure."""
    engine = figure.get_layout_engine()
    if engine is None:  # a figure of the user's
        figure.draw_without_rendering()
    else:
        engine.execute(figure)


def _in_points(ax: Axes, pixels: float) -> float:
    return pixels * _POINTS_PER_INCH / _root(ax).dpi


def _root(ax: Axes) -> Figure:
    """Figure of the Axes, also if the Axes are in a subfigure."""
    canvas: Any = ax.figure.canvas
    return canvas.figure


def colour_bar(image: ScalarMappable, ax: Axes | Panels, label: str, **options: float | str) -> None:
    """Add a colour bar next to Axes, with the font size of the Axes.

    Args:
        image: coloured artist.
        ax: Axes, or panels side by side.
        label: label of the colour bar.
        options: options of the colour bar of matplotlib, such as its distance `pad`.
    """
    panels = np.atleast_1d(ax)
    bar = panels[0].figure.colorbar(image, ax=list(panels), **options)
    bar.set_label(label)
    bar.ax.tick_params(labelsize=panels[0].xaxis.label.get_fontsize())


def mark_path(ax: Axes, contact: PathOfContact, *, zorder: float = 0.5) -> None:
    """Thin lines at the points A to E of the path of contact, with their letters above the Axes."""
    outer = {"A": contact.start, "B": contact.inner_single, "D": contact.outer_single, "E": contact.end}
    marks = sorted([(0.0, "C"), *((float(position), letter) for letter, position in outer.items())])
    close = 0.03 * (marks[-1][0] - marks[0][0])
    previous, letters = marks[0]
    for position, letter in marks[1:]:
        if position - previous < close:
            letters += letter
            continue
        text_above(ax, previous, letters)
        previous, letters = position, letter
    text_above(ax, previous, letters)
    for position, _ in marks:
        ax.axvline(position, color=GREY, linewidth=0.6, zorder=zorder)


def text_above(ax: Axes, x: float, text: str) -> None:
    """Grey text on the upper edge of the Axes, centred at x."""
    ax.annotate(
        text,
        (x, 1.0),
        xycoords=ax.get_xaxis_transform(),
        xytext=(0, 1),
        textcoords="offset points",
        ha="center",
        va="bottom",
        color=GREY,
    )


def save(fig: Figure, path: str | Path) -> Path:
    """Write a figure as PNG at 200 dpi, cut to its contents, and close it.

    Args:
        fig: the figure, `ax.figure` of the Axes that a plot function returned.
        path: file to write; missing folders are made.

    Returns:
        the path.

    Raises:
        ValueError: when the file cannot be written; no torn picture is left behind.
    """
    path = Path(path)
    picture = BytesIO()
    fig.set_dpi(_DPI)
    _lay_out(fig)
    fig.set_layout_engine("none")  # everything has its place: it would be looked for again, twice
    contents = fig.get_tightbbox().padded(_MARGIN)
    fig.savefig(picture, format="png", dpi=_DPI, bbox_inches=contents, facecolor="white")
    plt.close(fig)
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_durably(path, lambda file: file.write(picture.getvalue()))
    return path
