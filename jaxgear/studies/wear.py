"""Wear study: worn flanks of a design file over the revolutions."""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np

from ..contact import Mesh, OperatingPoint
from ..contact.status import reason
from ..io import DesignFile, Search, write_worn
from ..io.errors import naming
from ..io.results import write_csv
from ..metrics import Quantity
from ..microgeometry import AbstractModification
from ..numerics import UnitKey, optional_real, real
from ..report import Figure, Record, Table, numbers_of, table_of
from ..tolerance import ManufacturedGears
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
from ..wear.settings import blocks_are_short, number_of
from . import manufactured, wear_scatter
from .checkpoints import Checkpoints, CheckpointsOfKind, Marches, NamedArrays
from .comparison import Modifications, compared, first_mesh, search_of, sought
from .study import AbstractStudy, AbstractStudyResult, Stages
from .summary import fields_data, flanks_data

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
OVER_LIFE = "optimum over life"  # name of the design with the lowest mean PPTE over the wear history
_PANEL, _HEIGHT = 80.0, 84.0  # [mm]
_BEYOND = "*"  # marks lives beyond the simulated revolutions
_OF_MOTION = " Or the flanks vibrate without an orbit, or until coast flanks touch: run jaxgear dynamics."


class _HistoryNumbers(NamedTuple):
    """A wear history with numbers that several records need.

    Attributes:
        history: the wear history.
        ppte: PPTE at the time steps [um], shape (steps,).
        volume: worn volume per flank at the end [mm3], shape (gears, parts).
        factors: dynamic factor at the time steps, shape (steps,); empty without dynamics.
    """

    history: WearHistory
    ppte: np.ndarray
    volume: np.ndarray
    factors: np.ndarray


@dataclass(frozen=True)
class WearResult(AbstractStudyResult):
    """Wear histories of all designs.

    Attributes:
        design: the design file.
        settings: revolutions and wear coefficients.
        designs: modifications (pinion, wheel) by the name of the design.
        histories: wear histories by the name of the design.
        scatters: quantities of the wear histories of manufactured pairs by the name of the design; empty if the file
            has no tolerances.
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

    def _history_numbers(self) -> dict[str, _HistoryNumbers]:
        return {
            name: _HistoryNumbers(
                history,
                np.asarray(over_life(history, "ppte")),
                np.asarray(worn_volume(history))[-1],
                np.asarray([] if history.dynamic_factor is None else over_life(history, "dynamic_factor")),
            )
            for name, history in self.histories.items()
        }

    def _records(self) -> Iterator[Record[_HistoryNumbers]]:
        """Scalar results of a wear history, in the order of the table."""
        settings = self.settings
        ended, depth, ppte = float(settings.revolutions), settings.depth_limit, settings.ppte_limit
        tiny = np.finfo(float).tiny
        yield Record("pinion_wear_depth", "um", lambda of: wear_depth(of.history, "pinion")[-1], "depth\npinion\n[um]")
        yield Record("wheel_wear_depth", "um", lambda of: wear_depth(of.history, "wheel")[-1], "depth\nwheel\n[um]")
        yield Record("wear_depth_error", "um", lambda of: of.history.error[-1], "its\nerror\n[um]")
        yield Record("new_ppte", "um", lambda of: of.ppte[0], "PPTE\nnew\n[um]")
        yield Record("max_ppte_over_life", "um", lambda of: of.ppte.max(), "PPTE\nworst\n[um]")
        yield Record("worn_ppte", "um", lambda of: of.ppte[-1], "PPTE\nworn\n[um]")
        yield Record("mean_ppte_over_life", "um", lambda of: mean_over_life(of.history, "ppte"), "PPTE\nmean\n[um]")
        yield Record("pinion_worn_volume_per_flank", "mm3", lambda of: of.volume[0].sum())
        yield Record("wheel_worn_volume_per_flank", "mm3", lambda of: of.volume[1].sum())
        yield Record("volume_by_tip_corners_share", "", lambda of: of.volume[:, 1].sum() / max(of.volume.sum(), tiny))
        for name in ("max_pressure_over_life", "max_pressure_over_life_error"):
            yield Record(name, "MPa", partial(_pressure, name, settings))
        yield Record("worn_flank_pressure", "MPa", lambda of: over_life(of.history, "max_flank_pressure")[-1])
        yield Record("worn_flank_pressure_error", "MPa", lambda of: pressure_error(of.history)[-1])
        if settings.dynamics is not None:
            yield Record("new_dynamic_factor", "", lambda of: of.factors[0], "K_v new")
            yield Record("worn_dynamic_factor", "", lambda of: of.factors[-1])
            yield Record("max_dynamic_factor_over_life", "", lambda of: of.factors.max(), "K_v worst")
        if depth is not None:  # which goes on behind the last block
            heading = f"revolutions\nto {float(depth):g} um\ndepth"
            shown = partial(_revolutions_text, ended=ended, beyond="never")
            yield Record("life_to_depth", "revolutions", lambda of: life_to_depth(of.history, depth), heading, shown)
        if ppte is not None:  # which is not known behind it
            heading = f"revolutions\nto PPTE of\n{float(ppte):g} um"
            shown = partial(_revolutions_text, ended=ended, beyond=f"> {ended:.3g}")
            yield Record("life_to_ppte", "revolutions", lambda of: life_to(of.history, "ppte", ppte), heading, shown)

    def tables(self) -> Iterator[Table]:
        """Tables of the wear histories of all designs, and of their scatter if the file has tolerances."""
        settings, lives = self.settings, self._history_numbers()
        title = f"{self.design.title}: {float(settings.revolutions):.3g} revolutions at {self._loads()}"
        table = table_of(list(self._records()), lives, title, "design")
        if any(_BEYOND in cell for row in table.rows for cell in row[1:]):
            table.note = f"{_BEYOND} beyond wear.revolutions, extrapolated at the rate of the last block"
        yield table
        yield from wear_scatter.tables(self.design, settings, self.scatters)

    def _loads(self) -> str:
        """Loads that wear the flanks, in words."""
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
        """Meaning of the weights of the torques, in words."""
        assert self.settings.loads is not None
        if self.design.tables["wear"].weights is None:
            return "each for the same share of the revolutions, the default without wear.weights"
        shares = self.settings.loads.weights.tolist()
        return "for " + ", ".join(f"{100 * share:.3g}" for share in shares) + " % of the revolutions"

    def verdict(self) -> Iterator[str]:
        """Lines on the design with the best mean over the wear history, and on the error of the depths."""
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
        """Line for every design whose contact has not converged at some time step, or whose blocks are too long."""
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

    def inputs(self) -> dict[str, Any]:
        """Load, settings and tolerances, as plain data."""
        settings = self.settings
        return {
            UnitKey("torque", "N m"): self.design.torque,
            "settings": fields_data(replace(settings, largest_increment=None)),
            **({} if settings.loads is None else {"shares_of_revolutions": self._shares()}),
            UnitKey("largest_increment", "um"): settings.largest_increment,
            **(manufactured.tolerances(self.design) if self.scatters else {}),
        }

    def summary(self) -> dict[str, Any]:
        """Numbers of the wear histories of all designs, as plain data."""
        records = list(self._records())
        designs = {
            name: {
                **numbers_of(records, life),
                "blocks": len(life.history.revolutions) - 1,
                **flanks_data(*self.designs[name]),
                **(wear_scatter.summary(self.scatters[name]) if name in self.scatters else {}),
            }
            for name, life in self._history_numbers().items()
        }
        return {**({"optimum_over_life": self._sought()} if OVER_LIFE in self.designs else {}), "designs": designs}

    def write(self, folder: Path) -> None:
        """Write all time steps to `life.csv`, and all worn flanks to `worn_flanks.csv` and `worn_flanks.parquet`."""
        vibrates = self.settings.dynamics is not None
        known = [quantity_of(name) for name in (*_QUANTITIES, *(["dynamic_factor"] if vibrates else []))]
        depths = "pinion_wear_depth_um", "wheel_wear_depth_um", "wear_depth_error_um", "flank_pressure_error_MPa"
        header = "design", "revolutions", *depths, *(quantity.key for quantity in known)
        write_csv(folder / "life.csv", header, self._time_steps(known))
        for name in ("worn_flanks.csv", "worn_flanks.parquet"):
            write_worn(folder / name, self.histories)

    def _time_steps(self, known: Sequence[Quantity]) -> Iterator[tuple[Any, ...]]:
        """Rows of `life.csv`."""
        for name, history in self.histories.items():
            depths = wear_depth(history, "pinion"), wear_depth(history, "wheel"), history.error, pressure_error(history)
            columns = history.revolutions, *depths, *(over_life(history, quantity) for quantity in known)
            yield from ((name, *row) for row in zip(*(np.asarray(column, float) for column in columns)))

    def figures(self) -> Iterator[Figure]:
        """Figures of flanks at several time steps, of PPTE and depth over the revolutions, and of the scatter."""
        from .. import plot

        for gear in ("pinion", "wheel"):

            def draw(panel: Any, name: str, gear: Any = gear) -> None:
                plot.worn_flank(self.histories[name], gear, panel, title=name)

            drawn = plot.panels(draw, self.histories, width=_PANEL, height=_HEIGHT)
            yield Figure(f"worn_{gear}", f"Flank of the {gear} at several time steps.", drawn)
        yield Figure("ppte_over_life", "PPTE over the life.", plot.wear_history(self.histories, "ppte"))
        depths = plot.wear_history(self.histories, "wear_depth")
        yield Figure("depth_over_life", "Depth of wear over the life.", depths)
        if self.settings.dynamics is not None:
            caption = "Largest mesh force of the steady motion over the static one, over the life."
            factors = plot.wear_history(self.histories, "dynamic_factor")
            yield Figure("dynamic_factor_over_life", caption, factors)
        yield from wear_scatter.figures(self.scatters)


def _pressure(name: str, settings: Wear, life: _HistoryNumbers) -> Any:
    return number_of(name, life.history, settings)


def _revolutions_text(value: float, ended: float, beyond: str) -> str:
    """Revolutions of a life, which was computed to `ended`; NaN where the flanks are not known."""
    return beyond if np.isposinf(value) else f"{value:.3g}" + f" {_BEYOND}" * (value > ended)


_QUICK_BLOCKS = 4
_MOST_BLOCKS = 1000  # most blocks of a wear history of manufactured gears


@dataclass(frozen=True)
class WearStudy(AbstractStudy[WearResult]):
    """Wear the flanks of the pair over the revolutions of the table `wear`.

    The command compares the unmodified pair, the rule-based tip relief of ISO 6336-1, and the modification of the
    design file or the optimum of its variables. An interrupted command resumes from its stored results when it is
    repeated.

    Attributes:
        settings: revolutions and wear coefficients.
        search: search for the optimum of the file; None if its modifications are numbers.
        over_life: search for the lowest mean PPTE over the wear history, under the static load; None for no search.
        tolerance: manufactured gears that are worn; None for none.
    """

    name: ClassVar = "wear"
    coarse: ClassVar = "coarse positions and few blocks"

    settings: Wear
    search: Search | None
    over_life: Search | None
    gears: ManufacturedGears | None

    @classmethod
    def of(cls, design: DesignFile, *, quick: bool = False) -> Self:
        """Wear study of a design file, see `AbstractStudy.of`."""
        with naming(design.path):
            settings = design.needed("wear", "it says for how long the pair runs and how it wears").settings(design)
            gears = None if wear_scatter.left_out(design) else manufactured.gears_of(design, quick=quick)
        if quick:
            settings = dataclasses.replace(settings, blocks=_QUICK_BLOCKS, largest_increment=None)
        search = search_of(design, quick=quick)
        # every step of the search computes a wear history: under the static load, far faster than with dynamics
        static = dataclasses.replace(settings, line_load=None, dynamics=None)
        over_life = None if search is None else search.over_life(static)
        return cls(design, quick, settings, search, over_life, gears)

    def omits(self) -> str:
        """Message on manufactured gears, which are ignored under the dynamic line load; "" for none."""
        return wear_scatter.left_out(self.design)

    def work_out(self, checkpoints: Checkpoints, stages: Stages) -> WearResult:
        """Compute the wear histories of all designs, and of manufactured pairs if the file has tolerances."""
        design, quick = self.design, self.quick
        highest = max(design.torque, design.torque_range[1])
        mesh, designs = compared(design, highest, self.search, checkpoints, stages, quick=quick)
        if self.over_life is not None:
            stages.begin("searching the optimum over the life")
            start = first_mesh(design, highest, quick=quick)
            _, designs[OVER_LIFE] = sought(design, OVER_LIFE, self.over_life, start, checkpoints, stages, quick=quick)
        kept = checkpoints.of(Marches())
        histories = {name: self._history(mesh, name, flanks, kept, stages) for name, flanks in designs.items()}
        scatters: Mapping[str, wear_scatter.Samples] = {}
        if self.gears is not None:
            stages.begin("wear of manufactured gears of all designs")
            # of one length, as quantities take them, and as many as the nominal gears have taken
            blocks = min(max(len(history.revolutions) - 1 for history in histories.values()), _MOST_BLOCKS)
            settings = dataclasses.replace(self.settings, blocks=blocks, largest_increment=None)
            scatters = wear_scatter.manufactured_wear(
                mesh, design.torque, designs, settings, self.gears, keep=checkpoints.of(NamedArrays())
            )
        return WearResult(design, self.settings, designs, histories, scatters)

    def _history(
        self, mesh: Mesh, name: str, flanks: Modifications, kept: CheckpointsOfKind[Any], stages: Stages
    ) -> WearHistory:
        """Wear history of one design at the torque of the file."""
        stages.begin(f"wear of the {name} design")
        design, (pinion, wheel) = self.design, flanks

        def progress(done: int, total: int, best: float | None) -> None:
            stages.count(done, total, f"{done:.3g} of {total:.3g} revolutions")

        load = None
        if self.settings.loads is None:
            load = OperatingPoint(real(design.torque), optional_real(design.speed), optional_real(design.friction))
        return self.settings.history(mesh, load, pinion=pinion, wheel=wheel, keep=kept, callback=progress)
