"""Scatter of the transmission error over manufactured gears."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes

from ..conditions import ranked
from ..numerics import Quantile, real
from ..sweeps import Scatter
from .figure import GREY, legend_above, line_style, report_axes
from .history import PHASE_LABEL, two_pitches

_BANDS = ("#C6DBEF", "#6BAED6", "#3182BD")  # from the outside in; further bands repeat the last


def fan(scatter: Scatter, ax: Axes | None = None) -> Axes:
    """Bands between the lower and upper quantiles of the transmission error [um], with median and nominal design.

    Over two base pitches: all teeth deviate alike, so the quantiles repeat, although single curves do not.

    Args:
        scatter: result of `monte_carlo`; its quantiles are paired from the outside in.
        ax: Axes to draw into; None for a new figure.
    """
    levels = np.asarray(scatter.quantiles)
    x, curves = two_pitches(scatter.phase, scatter.transmission_error_quantiles)
    # failed samples make outer quantiles infinite: there is no such bound, and no band
    curves = np.where(np.isfinite(curves), curves, np.nan)
    with report_axes(ax) as ax:
        for index in range(len(levels) // 2):
            share = levels[-1 - index] - levels[index]
            colour = _BANDS[min(index, len(_BANDS) - 1)]
            ax.fill_between(
                x,
                curves[index],
                curves[-1 - index],
                color=colour,
                linewidth=0,
                label=f"{100 * share:.3g} % of the gears",
            )
        if len(levels) % 2:
            middle = len(levels) // 2
            name = "median" if np.isclose(levels[middle], 0.5) else f"{100 * levels[middle]:.3g} % quantile"
            ax.plot(x, curves[middle], color="#08306B", linewidth=1.4, label=name)
        ax.plot(*two_pitches(scatter.phase, scatter.nominal_transmission_error), label="nominal", **line_style(1))
        ax.set(xlim=(0, 2), xlabel=PHASE_LABEL, ylabel="transmission error [µm]")
        legend_above(ax)
    return ax


def ppte_histogram(scatter: Scatter, ax: Axes | None = None) -> Axes:
    """Distribution of PPTE [um] over the samples, with the nominal design, the mean and the 95 % quantile.

    Failed samples have no PPTE; the ordinate counts them in, and the label of the abscissa says how many there are.

    Args:
        scatter: result of `monte_carlo`.
        ax: Axes to draw into; None for a new figure.
    """
    ppte = np.asarray(scatter.ppte)
    fine = ppte[np.isfinite(ppte)]
    marks = {
        "nominal": scatter.nominal_ppte,
        "mean": scatter.mean,
        "95 % quantile": scatter.ppte_quantile95,
    }
    bins = int(np.clip(2 * np.cbrt(fine.size), 10, 80))
    with report_axes(ax) as ax:
        weights = np.full(fine.size, 100 / ppte.size)
        ax.hist(fine, bins=bins, weights=weights, color=_BANDS[1], edgecolor="white", linewidth=0.3)
        for index, (name, value) in enumerate(marks.items()):
            if np.isfinite(value):
                style = line_style((1, 0, 2)[index])
                ax.axvline(float(value), label=f"{name} {float(value):.2f} µm", **style)
        failed = f", {scatter.failed} of {ppte.size} failed" if scatter.failed else ""
        ax.set_xlim(left=0)
        ax.set(xlabel=f"peak-to-peak transmission error{failed} [µm]", ylabel="share of the gears [%]")
        legend_above(ax)
    return ax


def ppte_distribution(
    samples: Mapping[str, np.ndarray],
    ax: Axes | None = None,
    level: float = 0.95,
    *,
    of: str = "peak-to-peak transmission error",
) -> Axes:
    """Share of the manufactured gears whose PPTE stays below a value, of several designs.

    Args:
        samples: PPTE of every sample [um] by the name of the design; those that failed, NaN, stay below no value.
        ax: Axes to draw into; None for a new figure.
        level: share that a line marks; the legend has each design's quantile, as `Quantile` takes it.
        of: what the samples are, in words.
    """
    with report_axes(ax) as ax:
        for index, (name, values) in enumerate(samples.items()):
            values = np.asarray(values)
            ordered = np.sort(values[np.isfinite(values)])
            share = 100 * np.arange(1, ordered.size + 1) / values.size
            reached = float(ranked(Quantile(real(level)), values))
            below = f", {100 * level:g} % below {reached:.2f} µm" if np.isfinite(reached) else ""
            ax.plot(ordered, share, label=f"{name}{below}", **line_style(index))
        ax.axhline(100 * level, color=GREY, linewidth=0.8, zorder=0.5)
        ax.set_xlim(left=0)
        ax.set_ylim(0, 100)
        ax.set(xlabel=f"{of} [µm]", ylabel="share of the gears below [%]")
        legend_above(ax)
    return ax
