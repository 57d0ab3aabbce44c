"""Result of a wear study: tables, text, figures and files."""

import csv
import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ..contact.status import reason
from ..io import DesignFile, write_worn
from ..microgeometry import AbstractModification
from ..report import Table
from ..vocabulary import quantity_of
from ..wear import (
    Wear,
    WearHistory,
    life_to,
    life_to_depth,
    mean_over_life,
    over_life,
    pressure_error,
    wear_depth,
    worn_volume,
)
from ..wear.quantities import blocks_are_short, number_of
from . import manufactured, wear_scatter
from .study import AbstractStudyResult
from .summary_data import flanks_data

_QUANTITIES = (
    "ppte",
    "mean_te",
    "te_harmonic_1",
    "te_harmonic_2",
    "te_harmonic_3",
    "min_tangent_stiffness",
    "max_tangent_stiffness",
    "effective_contact_ratio",
    "max_flank_pressure",
    "max_corner_pressure",
)
# of the depth: an uncertainty by the blocks that is not told
_WORTH_A_WORD = 0.01
OVER_LIFE = "optimum over life"  # the design that is sought for the least mean PPTE over the life
_PANEL, _HEIGHT = 80.0, 84.0  # [mm]
_BEYOND = "*"  # marks lives that are longer than what was looked at
_OF_MOTION = " Or the flanks vibrate without an orbit, or until coast flanks touch: run jaxgear dynamics."


@dataclass(frozen=True)
class WearResult(AbstractStudyResult):
    """Wear histories of all designs.

    Attributes:
        design: the design file.
        settings: revolutions and wear coefficients.
        designs: their modifications (pinion, wheel) by name.
        lives: wear histories by name.
        scatters: numbers of the wear histories of manufactured pairs by name; empty where the file has no tolerances.
    """

    assumptions: ClassVar = (
        "Wear follows Archard: depth is the coefficient times pressure and sliding distance, at the torque of the file "
        "or the torques of [wear]. Wear histories, flanks and figures over the life are of gears without manufacturing "
        "deviations. Under several torques every number of the mesh is the mean by their shares of the revolutions.",
    )

    design: DesignFile
    settings: Wear
    designs: Mapping[str, tuple[AbstractModification, AbstractModification]]
    histories: Mapping[str, WearHistory]
    scatters: Mapping[str, wear_scatter.Samples]

    def _numbers(self, history: WearHistory) -> dict[str, float]:
        """Scalar results of a wear history, by name and unit."""
        ppte, settings = np.asarray(over_life(history, "ppte")), self.settings
        volume = np.asarray(worn_volume(history))[-1]
        found = {
            "pinion_wear_depth_um": wear_depth(history, "pinion")[-1],
            "wheel_wear_depth_um": wear_depth(history, "wheel")[-1],
            "new_ppte_um": ppte[0],
            "max_ppte_over_life_um": ppte.max(),
            "worn_ppte_um": ppte[-1],
            "mean_ppte_over_life_um": mean_over_life(history, "ppte"),
            "pinion_worn_volume_per_flank_mm3": volume[0].sum(),
            "wheel_worn_volume_per_flank_mm3": volume[1].sum(),
            "volume_by_tip_corners_share": volume[:, 1].sum() / max(volume.sum(), np.finfo(float).tiny),
            "wear_depth_error_um": history.error[-1],
            **{
                f"{name}_MPa": number_of(name, history, settings)
                for name in ("max_pressure_over_life", "max_pressure_over_life_error")
            },
            "worn_flank_pressure_MPa": over_life(history, "max_flank_pressure")[-1],
            "worn_flank_pressure_error_MPa": pressure_error(history)[-1],
        }
        if history.dynamic_factor is not None:
            factors = np.asarray(over_life(history, "dynamic_factor"))
            found["new_dynamic_factor"], found["worn_dynamic_factor"] = factors[0], factors[-1]
            found["max_dynamic_factor_over_life"] = factors.max()
        if settings.depth_limit is not None:
            found["life_to_depth_revolutions"] = life_to_depth(history, settings.depth_limit)
        if settings.ppte_limit is not None:
            found["life_to_ppte_revolutions"] = life_to(history, "ppte", settings.ppte_limit)
        return {name: float(value) for name, value in found.items()}

    def tables(self) -> list[Table]:
        """The lives of all designs, and their scatter over manufactured pairs where the file has tolerances."""
        return [self._table(), *wear_scatter.tables(self.design, self.settings, self.scatters)]

    def _table(self) -> Table:
        """One row per design."""
        settings = self.settings
        title = f"{self.design.title}: {float(settings.revolutions):.3g} revolutions at {self._loads()}"
        columns = {
            "pinion_wear_depth_um": "depth\npinion\n[um]",
            "wheel_wear_depth_um": "depth\nwheel\n[um]",
            "wear_depth_error_um": "its\nerror\n[um]",
            "new_ppte_um": "PPTE\nnew\n[um]",
            "max_ppte_over_life_um": "PPTE\nworst\n[um]",
            "worn_ppte_um": "PPTE\nworn\n[um]",
            "mean_ppte_over_life_um": "PPTE\nmean\n[um]",
        }
        if settings.dynamics is not None:
            columns |= {"new_dynamic_factor": "K_v new", "max_dynamic_factor_over_life": "K_v worst"}
        limits = {
            "life_to_depth_revolutions": (settings.depth_limit, "revolutions\nto {:g} um\ndepth"),
            "life_to_ppte_revolutions": (settings.ppte_limit, "revolutions\nto PPTE of\n{:g} um"),
        }
        columns |= {key: text.format(float(limit)) for key, (limit, text) in limits.items() if limit is not None}
        result = Table(("design", *columns.values()), title=title)
        ended = float(settings.revolutions)
        for name, history in self.histories.items():
            numbers = self._numbers(history)
            result.add_row(name, *(_cell(key, numbers[key], ended) for key in columns))
            if ended < numbers.get("life_to_depth_revolutions", 0.0) < np.inf:
                result.note = f"{_BEYOND} beyond wear.revolutions, extrapolated at the rate of the last block"
        return result

    def _loads(self) -> str:
        """Under what the flanks wear."""
        settings, text = self.settings, self._torques()
        if settings.dynamics is None:
            return text
        speeds: Any = self.design.speed if settings.loads is None else settings.loads.speeds
        shown = ", ".join(f"{speed:g}" for speed in dict.fromkeys(np.atleast_1d(np.asarray(speeds, float)).tolist()))
        return f"{text}, {settings.line_load} line load at {shown} rpm"

    def _torques(self) -> str:
        loads = self.settings.loads
        torques = [self.design.torque] if loads is None else loads.torques.tolist()
        text = ", ".join(f"{torque:g}" for torque in torques) + " N m"
        return text if loads is None else f"{text} ({self._shares()})"

    def _shares(self) -> str:
        """Which shares of the revolutions the torques have."""
        assert self.settings.loads is not None
        if self.design.tables["wear"].weights is None:
            return "each for the same share of the revolutions, the default without wear.weights"
        shares = self.settings.loads.weights.tolist()
        return "for " + ", ".join(f"{100 * share:.3g}" for share in shares) + " % of the revolutions"

    def verdict(self) -> Iterator[str]:
        """The best on the mean over the life, and how sure the depths are."""
        means = {name: float(mean_over_life(history, "ppte")) for name, history in self.histories.items()}
        found = {name: mean for name, mean in means.items() if np.isfinite(mean)}
        if found:
            best = min(found, key=lambda name: found[name])
            yield f"least mean PPTE over the life: {best}, {found[best]:.3f} um"
            if found.get(OVER_LIFE, 0.0) > found[best]:
                more = "give the method of [optimize] more steps"
                yield f"{OVER_LIFE}: its search ended above {best}, do not use it; {more}"
        yield from wear_scatter.lines(self.design, self.scatters)
        if OVER_LIFE in self.designs:
            yield f"{OVER_LIFE}: {self._sought()}"
        for name, history in self.histories.items():
            error, deepest = float(history.error[-1]), float(wear_depth(history)[-1])
            if np.isfinite(deepest) and not error <= _WORTH_A_WORD * deepest:  # NaN where it could not be told
                by = f"by {error:.3g} um" if np.isfinite(error) else "by an amount that is not estimated"
                yield f"{name}: the depth is uncertain {by}, take more blocks"

    def _sought(self) -> str:
        """Conditions of the search for the lowest mean PPTE over the wear history."""
        settings = self.settings
        text = f"sought at {self._torques()}, under the static line load, on gears without deviations"
        vibrates = settings.dynamics is not None and settings.line_load == "dynamic"
        return text + ", not under the dynamic one under which all designs wear here" * vibrates

    def failures(self) -> Iterator[str]:
        """A line for every design whose contact was not found at some time step, or whose blocks were too long."""
        for name, history in self.histories.items():
            found = np.asarray(history.cycles.converged)
            lost = ~found.reshape(len(found), -1).all(axis=1)
            if lost.any():
                first = float(history.revolutions[int(lost.argmax())])
                yield (
                    f"NOT CONVERGED: {name} from {first:.3g} revolutions on, {reason(history.cycles.status)}; do not "
                    "use its numbers. Take more blocks, or raise resolution.newton_steps or resolution.pairs."
                    + _OF_MOTION
                    * (history.dynamic_factor is not None)
                )
            elif not blocks_are_short(history):
                yield f"BLOCKS TOO LONG: {name}, flanks overshoot; do not use its numbers. Take more blocks."
        yield from wear_scatter.failures(self.scatters)

    def summary(self) -> dict[str, Any]:
        """The lives of all designs, with what wears them."""
        settings = self.settings
        designs = {
            name: {
                **self._numbers(history),
                "blocks": len(history.revolutions) - 1,
                **flanks_data(*self.designs[name]),
                **(wear_scatter.summary(self.scatters[name]) if name in self.scatters else {}),
            }
            for name, history in self.histories.items()
        }
        return {
            "torque_Nm": self.design.torque,
            "settings": _without_none(dataclasses.replace(settings, largest_increment=None)),
            **({} if settings.loads is None else {"shares_of_revolutions": self._shares()}),
            "largest_increment_um": settings.largest_increment,
            **(manufactured.tolerances(self.design) if self.scatters else {}),
            **({"optimum_over_life": self._sought()} if OVER_LIFE in self.designs else {}),
            "designs": designs,
        }

    def write(self, folder: Path) -> None:
        """Every time step and every flank of every design: `life.csv`, `worn_flanks.csv` and `worn_flanks.parquet`."""
        self._write_lives(folder / "life.csv")
        for name in ("worn_flanks.csv", "worn_flanks.parquet"):
            write_worn(folder / name, self.histories)

    def _write_lives(self, path: Path) -> None:
        """Every time step of every design as CSV."""
        vibrates = self.settings.dynamics is not None
        known = [quantity_of(name) for name in (*_QUANTITIES, *(["dynamic_factor"] if vibrates else []))]
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            depths = "pinion_wear_depth_um", "wheel_wear_depth_um", "wear_depth_error_um", "flank_pressure_error_MPa"
            writer.writerow(["design", "revolutions", *depths, *(quantity.key for quantity in known)])
            for name, history in self.histories.items():
                columns = [
                    history.revolutions,
                    wear_depth(history, "pinion"),
                    wear_depth(history, "wheel"),
                    history.error,
                ]
                columns += [pressure_error(history)]
                columns += [over_life(history, quantity) for quantity in known]
                for row in zip(*map(np.asarray, columns)):
                    writer.writerow([name, *(f"{value:.7g}" for value in row)])

    def figures(self) -> dict[str, Any]:
        """Flanks at several time steps, PPTE and depth over the life, and the scatter over manufactured pairs."""
        from .. import plot

        shown = list(self.histories)
        size: dict[str, Any] = {"columns": len(shown), "width": _PANEL * len(shown), "height": _HEIGHT}
        axes: dict[str, Any] = {}
        for gear in ("pinion", "wheel"):
            with plot.figure.report_axes(None, **size) as panels:
                for number, (panel, name) in enumerate(zip(np.ravel(panels), shown)):
                    plot.worn_flank(self.histories[name], gear, panel, title=name)
                    panel.set_ylabel(panel.get_ylabel() if number == 0 else "")
            axes[f"worn_{gear}"] = panels
        axes["ppte_over_life"] = plot.wear_history(self.histories, "ppte")
        axes["depth_over_life"] = plot.wear_history(self.histories, "wear_depth")
        if self.settings.dynamics is not None:
            axes["dynamic_factor_over_life"] = plot.wear_history(self.histories, "dynamic_factor")
        return axes | wear_scatter.figures(self.scatters)


def _cell(key: str, value: float, ended: float) -> str:
    """A number of a life of so many revolutions."""
    if not key.endswith("revolutions"):
        return f"{value:.3f}"
    if np.isposinf(value):  # the depth goes on, PPTE is not known any further
        return "never" if key == "life_to_depth_revolutions" else f"> {ended:.3g}"
    return f"{value:.3g}" + f" {_BEYOND}" * (value > ended)  # NaN where the flanks are not known


def _without_none(settings: Any) -> dict[str, Any]:
    """Fields of settings, and of settings within them."""
    given = {field.name: getattr(settings, field.name) for field in dataclasses.fields(settings)}
    return {
        name: _without_none(value) if dataclasses.is_dataclass(value) else value
        for name, value in given.items()
        if value is not None
    }
