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
from jaxtyping import Array, Float

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
_VARIABLES = (*AMOUNTS, *LINE)
_UNITS = dict.fromkeys(_VARIABLES, "um")


@dataclass(frozen=True)
class ProfileLayout:
    """Profile modifications that were tried.

    Attributes:
        kind: of the modification.
        table: a row per variant; the first has neither a profile modification nor a further slope or crowning, the
            others are all combinations, later ones running fastest: pinion, wheel, slope, crowning.
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
        """Of the variant that was chosen, on pinion and wheel [um]."""
        first, second = (float(self.table.column(name)[self.best]) for name in AMOUNTS)
        return first, second

    @property
    def further(self) -> tuple[float, float]:
        """Slope and crowning on top of the flank lines, of the variant that was chosen, over the common face [um]."""
        slope, crowning = (float(self.table.column(name)[self.best]) for name in LINE)
        return slope, crowning

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
        """Of a result from no profile modification to the variant that was chosen, relative [%]."""
        values = self.table.column(name)
        return 100.0 * float(values[self.best] / values[0] - 1.0)

    def radar_variants(self, count: int = 5) -> tuple[list[int], list[str]]:
        """Rows and names for `plot.radar`: no profile modification, then the best ones without contact shock."""
        ppte = np.where(self.without_shock, self.table.column("ppte"), np.inf)
        ranked = [int(row) for row in np.argsort(ppte, kind="stable") if row and np.isfinite(ppte[row])]
        rows = list(dict.fromkeys([self.best, *ranked]))[:count]
        first, second, *lines = (self.table.column(name) for name in _VARIABLES)
        names = []
        for row in rows:
            further = [f"{name} {line[row]:+g} µm" for name, line in zip(LINE, lines) if np.ptp(line)]
            names.append(", ".join([f"pinion {first[row]:g}, wheel {second[row]:g} µm", *further]))
        return [0, *rows], ["no profile modification", *names]


def vary_profiles(
    mesh: Mesh,
    torque: Loads,
    flank_lines: tuple[AbstractModification, AbstractModification],
    pinion_amounts: Sequence[float],
    wheel_amounts: Sequence[float],
    *,
    kind: Kind = "tip_relief",
    length: Given | None = None,
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
            what is left of the flank lines where they have levelled the load, the further crowning.
        torque: on the pinion [N m].
        flank_lines: modifications of pinion and wheel, in every variant.
        pinion_amounts, wheel_amounts: of the modification [um], crossed with each other.
        kind: "tip_relief", for spur gears a long one, or "profile_crowning".
        length: of the tip relief [mm]; None for the long one.
        curve: of the tip relief; None for its default.
        slopes, crownings: on top of the flank lines, over the common face and of either sign [um], crossed with the
            amounts.
        results: further results, beside transmission error, contact ratio, loss, pressure and the face load factors of
            the contact.
        output: folder of the table; None keeps it in memory.
        callback: of the progress, as `sweep` takes it.

    Raises:
        ValueError: for another kind, a length or curve of a profile crowning, amounts that are negative or none, and
            where every variant failed.
    """
    if kind not in ("tip_relief", "profile_crowning"):
        raise ValueError(f'vary_profiles: kind = {kind!r} must be "tip_relief" or "profile_crowning"')
    for name, value in (("length", length), ("curve", curve)):
        if kind == "profile_crowning" and value is not None:
            raise ValueError(f"vary_profiles: {name} has no effect on a profile crowning")
    crossed = {
        "pinion_amounts": pinion_amounts,
        "wheel_amounts": wheel_amounts,
        "slopes": slopes,
        "crownings": crownings,
    }
    for name, amounts in crossed.items():
        check("vary_profiles", name, np.asarray(amounts, float), "um", low=0.0 if name.endswith("amounts") else None)
        if not len(amounts):
            raise ValueError(f"vary_profiles: {name} must not be empty")
    length = real(long_relief_length(mesh.pair) if length is None else length)
    design = _Crossed(flank_lines, _Profile(kind, length, curve), mesh.pair)
    rows = [(0.0,) * len(_VARIABLES), *itertools.product(*crossed.values())]
    own = _results(mesh.pair)
    wanted = (*own, *(one for one in results if one not in own))
    plan = VariantList(_VARIABLES, rows)
    given: dict[str, Any] = {"mesh": mesh, "torque": torque, "results": wanted, "units": _UNITS}
    table = sweep(design, plan, output=output, callback=callback, title="profile modifications", **given)
    theoretical = float(path_of_contact(mesh.pair).contact_ratio + mesh.pair.overlap_ratio)
    if mesh.pair.is_spur:
        shock = table.column("effective_contact_ratio") - theoretical
    else:
        shock = table.column(*_HELICAL) / float(mesh.pair.base_pitch)
    best = _best(table.column("ppte"), shock)
    first, second, slope, crowning = rows[best]
    on_pinion, on_wheel = (design.profile(real(amount)) for amount in (first, second))
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
    """What the loaded tooth contact says of flank lines without profile modifications, NaN where it fails.

    `RESULTS`, and of helical pairs the length of contact of tip corners.

    Args:
        mesh, torque: as for `vary_profiles`, whose compiled program serves here.
        flank_lines: modifications of pinion and wheel.
        deviations: of the helix slope over the common face, shape (deviations,) [um]; `FlankLineTolerance.slopes` are
            those of the five cases.
        kind: of the profile modifications that are varied elsewhere, which are zero here.
    """
    design = _Crossed(flank_lines, _Profile(kind, real(long_relief_length(mesh.pair)), None), mesh.pair)
    plan = VariantList(_VARIABLES, [(0.0, 0.0, float(slope), 0.0) for slope in deviations])
    table = sweep(design, plan, mesh=mesh, torque=torque, results=_results(mesh.pair), units=_UNITS)
    return {name: table.column(name) for name in table.results}


class _Profile(eqx.Module):
    """A profile modification of an amount."""

    kind: Kind = eqx.field(static=True)
    length: Float[Array, ""]
    curve: AbstractCurve | None

    def __call__(self, amount) -> AbstractModification:
        if self.kind == "profile_crowning":
            return ProfileCrowning(amount)
        return TipRelief(amount, self.length) if self.curve is None else TipRelief(amount, self.length, self.curve)


class _Crossed(eqx.Module):
    """The design of the sweep; a module, so that one compiled program serves all layouts of a size."""

    flank_lines: tuple[AbstractModification, AbstractModification]
    profile: _Profile
    pair: GearPair

    def __call__(self, variant):
        pinion, wheel = (line + self.profile(variant[name]) for line, name in zip(self.flank_lines, AMOUNTS))
        further = FlankLine(*(variant[name] for name in LINE)).on(self.pair, "wheel")
        return pinion, wheel + further.modification


def _best(ppte: Float[np.ndarray, " variants"], shock: Float[np.ndarray, " variants"]) -> int:
    """The least transmission error without contact shock; with the least shock where all have some."""
    if not np.isfinite(ppte).any():
        raise ValueError("vary_profiles: the contact of every variant failed")
    free = shock <= _SHOCK
    return int(np.nanargmin(np.where(free, ppte, np.nan) if free.any() else shock))
