"""Data of the charts of the page: from the functions that draw the figures, with their labels and colours."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from .. import plot
from ..contact import Mesh, MeshCycle, Resolution, Side
from ..io.template import Free, Template
from ..metrics import Quantity
from ..microgeometry import NoModification, TipRelief
from ..plot.figure import GREY, line_style
from ..plot.flank import placed
from ..plot.mesh_cycle import pair_history, two_pitches
from ..sweeps import Scatter
from .movement import Curves

_COLOURS = 7  # of designs
_COLUMNS = 128  # at most, of the map of the line load
_POINTS = 1100  # at most, of a curve: two pitches of 512 positions
_DIGITS = 6  # behind the decimal point, of curves


def frames(mesh: Mesh, cycle: MeshCycle, torques: np.ndarray) -> dict[str, dict[str, Any]]:
    """Labels, and letters of the path of contact, of every chart, as the figures have them."""
    cycles = {"": cycle}
    orders, (pinion, wheel) = _axes(1)[0], _axes(2)
    plot.k_chart(mesh, {"": (NoModification(), NoModification())}, np.array([pinion, wheel]))
    wheel.set_ylabel(pinion.get_ylabel())
    drawn = {
        "transmission_error": plot.transmission_error(cycles, _axes(1)[0]),
        "load_sharing": plot.load_sharing(cycles, _axes(1)[0]),
        "pressure": plot.pressure(cycles, _axes(1)[0]),
        "orders": plot.transmission_error_orders(cycles, orders, count=1),
        "over_torque": plot.ppte_over_torque(torques, {}, _axes(1)[0]),
        "pinion": pinion,
        "wheel": wheel,
    }
    if mesh.resolution.slices > 1:
        drawn["plane_of_action"] = plot.plane_of_action(cycle, _axes(1)[0])
    return {name: _frame(ax) for name, ax in drawn.items()}


def _axes(columns: int) -> list[Axes]:
    return list(Figure().subplots(1, columns, squeeze=False).ravel())


def _frame(ax: Axes) -> dict[str, Any]:
    letters = [[text.get_text(), float(text.xy[0])] for text in ax.texts if hasattr(text, "xy")]
    return {"x": ax.get_xlabel(), "y": ax.get_ylabel(), "letters": letters}


def styles() -> dict[str, Any]:
    """Colours of the current, the unmodified and further designs."""
    return {
        "now": line_style(0)["color"],
        "unmodified": GREY,
        "others": [line_style(index)["color"] for index in range(1, _COLOURS + 1)],
    }


def quantity(of: Quantity) -> dict[str, Any]:
    """Name, heading, number of digits and direction of a quantity."""
    return {"name": of.name, "words": of.words, "unit": of.unit, "form": of.form, "better": of.better}


def grid(sizes: Resolution) -> str:
    """Grid in words."""
    return f"{sizes.positions} positions" + f", {sizes.slices} slices" * (sizes.slices > 1)


class Profile(NamedTuple):
    """Active profile of a gear in roll angles.

    Attributes:
        start: at the start of the active profile [deg].
        tip: at the tip [deg].
        per_length: per roll length [deg/mm].
    """

    start: float
    tip: float
    per_length: float


def profiles_of(sides: Iterable[Side]) -> tuple[Profile, ...]:
    """Active profiles of pinion and wheel."""
    found = []
    for side in sides:
        per_length = float(np.rad2deg(1.0 / float(side.base_radius)))
        found.append(
            Profile(float(side.start_roll_length) * per_length, float(side.tip_roll_length) * per_length, per_length)
        )
    return tuple(found)


def data(cycle: MeshCycle, curves: Curves, along: Sequence[Profile], removed: Sequence[np.ndarray]) -> dict[str, Any]:
    """Curves of the charts, by their names; of several hundred points every few.

    Args:
        cycle: solved cycle, on the host.
        curves: its curves, on the host.
        along: active profiles of pinion and wheel.
        removed: material removed from pinion and wheel, from the start of the active profile to the tip [um].
    """
    path, share = pair_history(cycle, curves.load_sharing)
    _, flank = pair_history(cycle, curves.flank_pressure)
    _, corner = pair_history(cycle, curves.corner_pressure)
    found: dict[str, Any] = {
        "transmission_error": _xy(*two_pitches(cycle.phase, curves.transmission_error)),
        "load_sharing": _xy(path, share),
        "pressure": _xy(path, np.where(flank > 0, flank, np.nan)),
        "corners": _xy(path, np.where(corner > 0, corner, np.nan)),
        "orders": _xy(np.arange(1, len(curves.orders) + 1), np.asarray(curves.orders)),
        **{
            name: _xy(np.linspace(of.start, of.tip, len(amount)), amount)
            for name, of, amount in zip(("pinion", "wheel"), along, removed)
        },
    }
    if curves.line_load is not None:
        edges, face, load = placed(cycle, curves.line_load)
        step = max(1, load.shape[-1] // _COLUMNS)
        found["plane_of_action"] = {
            "x": short(edges[0, ::step]),
            "ahead": short(edges[:, 0] - edges[0, 0]),
            "face": short(face),
            "load": [short(row) for row in load[:, ::step]],
        }
    return found


def _xy(x: np.ndarray, y: ArrayLike) -> dict[str, list[float | None]]:
    step = -(-len(x) // _POINTS)
    return {"x": short(x[::step]), "y": short(np.asarray(y)[::step])}


def short(values: ArrayLike) -> list[float | None]:
    """Numbers with few digits, for curves; None for NaN."""
    return exact(np.round(np.asarray(values, float), _DIGITS))


def exact(values: ArrayLike) -> list[float | None]:
    """Numbers with all digits; None for what is not finite."""
    numbers = np.asarray(values, float)
    if np.isfinite(numbers).all():
        return numbers.tolist()
    return [value if np.isfinite(value) else None for value in numbers.tolist()]


@dataclass(frozen=True)
class Relief:
    """Tip relief that can be dragged.

    Attributes:
        amount, length: names of its sliders; None for a number that is fixed.
        now: its length now [mm].
    """

    amount: str | None
    length: str | None
    now: float


def relief_of(flank: Sequence[Template], values: Mapping[str, float]) -> Relief | None:
    """Tip relief among the modifications of a flank with a number that is a slider; None without one."""
    for part in flank:
        if part.make is not TipRelief:
            continue
        amount, length = part.fields["amount"], part.fields["length"]
        now = float(values[length.name] if isinstance(length, Free) else length)
        if isinstance(amount, Free) or isinstance(length, Free):
            return Relief(_name(amount), _name(length), now)
    return None


def _name(number: object) -> str | None:
    return number.name if isinstance(number, Free) else None


def handles(along: Sequence[Profile], reliefs: Mapping[str, Relief]) -> dict[str, dict[str, Any]]:
    """Places of tip reliefs in the charts of the profiles, by gear: roll angles of tip and start, and deg per mm."""
    found = {}
    for gear, of in zip(("pinion", "wheel"), along):
        if gear in reliefs:
            start = of.tip - reliefs[gear].now * of.per_length
            found[gear] = asdict(reliefs[gear]) | {"tip": of.tip, "start": start, "per_length": -of.per_length}
    return found


def band(scatter: Scatter) -> dict[str, Any]:
    """Transmission error of manufactured gears over two base pitches: quantiles, and numbers of PPTE in words."""
    curves = np.asarray(scatter.transmission_error_quantiles)
    phase, _ = two_pitches(scatter.phase, curves[0])
    return {
        "x": short(phase),
        "curves": [short(two_pitches(scatter.phase, curve)[1]) for curve in curves],
        "ppte": {
            "nominal": float(scatter.nominal_ppte),
            "mean": float(scatter.mean),
            "quantile95": float(scatter.ppte_quantile95),
            "samples": int(scatter.ppte.shape[0]),
            "failed": scatter.failed,
        },
    }
