"""Objectives in words, and axes on which they are read."""

import re
import textwrap

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from ..metrics import quantities
from ..optimize.result import PENALIZED

ANALYSES_LABEL = "contact analyses spent [-]"
_IDEAL = "distance from the ideal"
_MEASURED = re.compile(rf"(?P<measure>(?!{_IDEAL}).+ )?(?P<of>\w+)")
_NARROW = 5.0  # largest over smallest value below which a logarithmic axis has too few round numbers of its own
_LINE = 34  # letters along an axis of report height


def objective_label(name: str, unit: str | None = None) -> str:
    """Label of an objective: "95 % CVaR of peak-to-peak transmission error [µm]" for "95 % CVaR of ppte".

    Args:
        name: of a quantity, after a measure or alone; other names stay as they are.
        unit: of other names, "" if it is unknown.
    """
    if name.startswith(_IDEAL):
        return f"{_IDEAL} [-]"
    bare = name.removesuffix(PENALIZED)
    match = _MEASURED.fullmatch(bare)
    if match and match["of"] in quantities:
        quantity, rest = quantities[match["of"]], name[len(bare) :]
        return f"{match['measure'] or ''}{quantity.meaning}{rest} [{unit_text(quantity.unit) or '-'}]"
    words = name.replace("_", " ")
    return f"{words} [{unit_text(unit)}]" if unit else words


def unit_text(unit: str) -> str:
    """A unit in print."""
    return unit.replace("um", "µm").replace("mm3", "mm³")


def wrapped(text: str) -> str:
    """A long label on several lines of at most about the height of a figure, its unit with the last word."""
    bound = text.replace(" [", "\N{NO-BREAK SPACE}[")
    return textwrap.fill(bound, _LINE, break_long_words=False, break_on_hyphens=False)


def logarithmic(ax: Axes, which: str, values) -> None:
    """A logarithmic axis, "x" or "y", with round numbers written out."""
    values = np.asarray(values, float)
    low, high = values.min(), values.max()
    axis = {"x": ax.xaxis, "y": ax.yaxis}[which]
    ax.set(**{f"{which}scale": "log"})
    if high < _NARROW * low:
        axis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    else:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 100 * low else (1.0,)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: _number(value)))
    axis.set_minor_formatter(NullFormatter())


def _number(value: float) -> str:
    return f"{value:,.0f}".replace(",", "\N{THIN SPACE}") if value >= 1000 else f"{value:g}"
