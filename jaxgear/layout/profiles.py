"""Step 3 of a layout: profile modifications in all combinations, with the flank lines of the first two steps kept.

References:
    U. Kissling's three-step layout of modifications: cross-variation of the modifications of both gears; the
    best has the least peak-to-peak transmission error without contact shock, that is with an effective contact ratio
    not above the theoretical one.
"""

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import equinox as eqx
import numpy as np
from jaxtyping import Float

from ..conditions.cases import Loads
from ..contact import Mesh
from ..geometry import GearPair, path_of_contact
from ..metrics import Quantity
from ..microgeometry import AbstractCurve, AbstractModification, ProfileCrowning, TipRelief
from ..numerics import Callback, Given, check, real
from ..sizing import long_relief_length
from ..sweeps import SweepTable, VariantList, sweep
from ..sweeps.columns import described
from .flank_line import FlankLine

Kind = Literal["tip_relief", "profile_crowning"]

RESULTS = (
    "ppte",
    "effective_contact_ratio",
    "mesh_loss_factor",
    "max_flank_pressure",
    "face_load_factor",
    "root_face_load_factor",
    "edge_load_factor",
)
# Of helical pairs, whose slices meet at phases of their own: pairs that are loaded anywhere on the face tell no shock.
_HELICAL = ("corner_contact_length",)
# By so much the effective contact ratio may be above the theoretical one: positions resolve ends of contact to less.
_SHOCK = 0.01
AMOUNTS = "pinion_amount", "wheel_amount"
LINE = "slope", "crowning"  # on top of the flank lines, over the common face
_LENGTH = "length"  # of tip reliefs, on both gears
_UNITS = {**dict.fromkeys((*AMOUNTS, *LINE), "um"), _LENGTH: "mm"}


@dataclass(frozen=True)
class ProfileLayout:
    """Profile modifications that were tried.

    Attributes:
        kind: of the modification.
        table: a row per variant; the first has neither a profile modification nor a further slope or crowning, the
            others are all combinations, later ones running fastest: pinion, wheel, slope, crowning, length.
        best: number of the variant that was chosen.
        contact_ratio: theoretical one, with the overlap of helical pairs.
        shock: of every variant, contact beyond the theoretical path of contact in base pitches: effective less
            theoretical contact ratio, of helical pairs of the slice with the most.
        profiles: modifications of pinion and wheel of the variant that was chosen, without the flank lines; that of the
            wheel has the further slope and crowning where they were varied.
    """

    kind: Kind
    table: SweepTable
    best: int
    contact_ratio: float
    shock: Float[np.ndarray, " variants"]
    profiles: tuple[AbstractModification, AbstractModification]

    @property
    def amounts(self) -> tuple[float, float]:
        """Amounts of the chosen variant on pinion and wheel [um]."""
        first, second = (float(self.table.column(name)[self.best]) for name in AMOUNTS)
        return first, second

    @property
    def further(self) -> tuple[float, float]:
        """Slope and crowning on top of the flank lines, of the variant that was chosen, over the common face [um]."""
        slope, crowning = (float(self.table.column(name)[self.best]) for name in LINE)
        return slope, crowning

    @property
    def length(self) -> float | None:
        """Length of the tip relief of the chosen variant [mm]; None for profile crownings."""
        return float(self.table.column(_LENGTH)[self.best]) if self.kind == "tip_relief" else None

    @property
    def without_shock(self) -> np.ndarray:
        """Whether the teeth of every variant meet on the theoretical path of contact only."""
        return self.shock <= _SHOCK

    def radar_table(self) -> dict[Any, np.ndarray]:
        """Results for `plot.radar`, by what they are; contact shock in place of the effective contact ratio.

        The study reads the shock off that ratio: what it has beyond the theoretical one is too much, not good.
        """
        shock = described("contact_shock", "base pitches", meaning="contact beyond the path of contact", form=".3f")
        values = self.table.values
        return {
            **values("ppte"),
            shock: np.maximum(self.shock, 0.0),
            **values("mesh_loss_factor", "max_flank_pressure"),
        }

    def change(self, name: str) -> float:
        """Relative change of a result from no profile modification to the chosen variant [%]."""
        values = self.table.column(name)
        return 100.0 * float(values[self.best] / values[0] - 1.0)

    def radar_variants(self, count: int = 5) -> tuple[list[int], list[str]]:
        """Rows and names for `plot.radar`: no profile modification, then the best ones without contact shock."""
        ppte = np.where(self.without_shock, self.table.column("ppte"), np.inf)
        ranked = [int(row) for row in np.argsort(ppte, kind="stable") if row and np.isfinite(ppte[row])]
        rows = list(dict.fromkeys([self.best, *ranked]))[:count]
        first, second, *lines = (self.table.column(name) for name in (*AMOUNTS, *LINE))
        length = self.table.column(_LENGTH) if self.kind == "tip_relief" else np.zeros(1)
        names = []
        for row in rows:
            further = [f"{name} {line[row]:+g} µm" for name, line in zip(LINE, lines) if np.ptp(line)]
            long = [f"{length[row]:.3g} mm"] * bool(np.ptp(length))
            names.append(", ".join([f"pinion {first[row]:g}, wheel {second[row]:g} µm", *long, *further]))
        return [0, *rows], ["no profile modification", *names]


def vary_profiles(
    mesh: Mesh,
    torque: Loads,
    flank_lines: tuple[AbstractModification, AbstractModification],
    pinion_amounts: Sequence[float],
    wheel_amounts: Sequence[float],
    *,
    kind: Kind = "tip_relief",
    length: float | Sequence[float] | None = None,
    curve: AbstractCurve | None = None,
    slopes: Sequence[float] = (0.0,),
    crownings: Sequence[float] = (0.0,),
    results: Sequence[str | Quantity] = (),
    output: str | Path | None = None,
    callback: Callback | None = None,
) -> ProfileLayout:
    """Cross-variation of the profile modifications of both gears, and of the flank line with them.

    Args:
        mesh: prepared mesh with slices: over shafts, the flank lines are those of the first two steps; without them,
            what is left of the flank lines where they have levelled the load, that of step 2.
        torque: on the pinion [N m].
        flank_lines: modifications of pinion and wheel, in every variant.
        pinion_amounts, wheel_amounts: of the modification [um], crossed with each other.
        kind: "tip_relief", for spur gears a long one, or "profile_crowning".
        length: of the tip reliefs of both gears [mm], several crossed with the amounts; None for the long one.
        curve: of the tip relief; None for its default.
        slopes, crownings: on top of the flank lines, over the common face and of either sign [um], crossed with the
            amounts.
        results: further results, beside transmission error, contact ratio, loss, pressure and the face load factors of
            the contact.
        output: folder of the table; None keeps it in memory.
        callback: of the progress, as `sweep` takes it.

    Raises:
        ValueError: for another kind, a length or curve of a profile crowning, amounts that are negative or none,
            lengths that are not positive or none, and where every variant failed.
    """
    if kind not in ("tip_relief", "profile_crowning"):
        raise ValueError(f'kind = {kind!r} must be "tip_relief" or "profile_crowning"')
    for name, value in (("length", length), ("curve", curve)):
        if kind == "profile_crowning" and value is not None:
            raise ValueError(f"{name} has no effect on a profile crowning")
    crossed = {
        "pinion_amounts": pinion_amounts,
        "wheel_amounts": wheel_amounts,
        "slopes": slopes,
        "crownings": crownings,
    }
    for name, amounts in crossed.items():
        check(name, np.asarray(amounts, float), "um", low=0.0 if name.endswith("amounts") else None)
        if not len(amounts):
            raise ValueError(f"{name} must not be empty")
    lengths = _lengths(mesh.pair, kind, length)
    design = _Crossed(flank_lines, kind, curve, mesh.pair)
    rows = [(*(0.0,) * len(crossed), *lengths[:1]), *itertools.product(*crossed.values(), *[lengths] * bool(lengths))]
    own = _results(mesh.pair)
    wanted = (*own, *(one for one in results if one not in own))
    plan, units = _plan(rows)
    options: dict[str, Any] = {"results": wanted, "units": units, "output": output, "callback": callback}
    table = sweep(mesh, torque, design, plan, title="profile modifications", **options)
    theoretical = float(path_of_contact(mesh.pair).contact_ratio + mesh.pair.overlap_ratio)
    if mesh.pair.is_spur:
        shock = table.column("effective_contact_ratio") - theoretical
    else:
        shock = table.column(*_HELICAL) / float(mesh.pair.base_pitch)
    best = _best(table.column("ppte"), shock)
    first, second, slope, crowning, *long = rows[best]
    on_pinion, on_wheel = (design.profile(real(amount), *map(real, long)) for amount in (first, second))
    if slope or crowning:
        on_wheel = FlankLine(real(slope), real(crowning)).on(mesh.pair, "wheel").modification + on_wheel
    return ProfileLayout(kind, table, best, theoretical, shock, (on_pinion, on_wheel))


def _results(pair: GearPair) -> tuple[str, ...]:
    return RESULTS if pair.is_spur else (*RESULTS, *_HELICAL)


def flank_line_contact(
    mesh: Mesh,
    torque: Loads,
    flank_lines: tuple[AbstractModification, AbstractModification],
    *,
    deviations: Iterable[Given] = (0.0,),
    kind: Kind = "tip_relief",
) -> dict[str, Float[np.ndarray, " deviations"]]:
    """Contact analysis results of flank lines without profile modifications; NaN where it fails.

    `RESULTS`, and of helical pairs the length of contact of tip corners.

    Args:
        mesh, torque: as for `vary_profiles`, whose compiled program serves here.
        flank_lines: modifications of pinion and wheel.
        deviations: of the helix slope over the common face, shape (deviations,) [um]; `FlankLineTolerance.slopes` are
            those of the five cases.
        kind: of the profile modifications that are varied elsewhere, which are zero here.
    """
    lengths = _lengths(mesh.pair, kind, None)
    plan, units = _plan([(0.0, 0.0, float(slope), 0.0, *lengths) for slope in deviations])
    design = _Crossed(flank_lines, kind, None, mesh.pair)
    table = sweep(mesh, torque, design, plan, results=_results(mesh.pair), units=units)
    return {name: table.column(name) for name in table.results}


def _lengths(pair: GearPair, kind: Kind, given: float | Sequence[float] | None) -> tuple[float, ...]:
    """Lengths of the tip reliefs to try [mm]; empty for profile crownings."""
    if kind == "profile_crowning":
        return ()
    lengths = np.atleast_1d(np.asarray(long_relief_length(pair) if given is None else given, float))
    check("length", lengths, "mm", low=0.0, open_low=True)
    if not len(lengths):
        raise ValueError("length must not be empty")
    return tuple(map(float, lengths))


def _plan(rows: Sequence[Sequence[float]]) -> tuple[VariantList, dict[str, str]]:
    """Variants of as many numbers as a row has, and their units."""
    units = dict(itertools.islice(_UNITS.items(), len(rows[0])))
    return VariantList(tuple(units), rows), units


class _Crossed(eqx.Module):
    """The design of the sweep; a module, so that one compiled program serves all layouts of a size."""

    flank_lines: tuple[AbstractModification, AbstractModification]
    kind: Kind = eqx.field(static=True)
    curve: AbstractCurve | None
    pair: GearPair

    def profile(self, amount, length=None) -> AbstractModification:
        if self.kind == "profile_crowning":
            return ProfileCrowning(amount)
        return TipRelief(amount, length) if self.curve is None else TipRelief(amount, length, self.curve)

    def __call__(self, variant):
        long = [variant[_LENGTH]] if self.kind == "tip_relief" else []
        pinion, wheel = (line + self.profile(variant[name], *long) for line, name in zip(self.flank_lines, AMOUNTS))
        further = FlankLine(*(variant[name] for name in LINE)).on(self.pair, "wheel")
        return pinion, wheel + further.modification


def _best(ppte: Float[np.ndarray, " variants"], shock: Float[np.ndarray, " variants"]) -> int:
    """The least transmission error without contact shock; with the least shock where all have some."""
    if not np.isfinite(ppte).any():
        raise ValueError("the contact of every variant failed")
    free = shock <= _SHOCK
    return int(np.nanargmin(np.where(free, ppte, np.nan) if free.any() else shock))
