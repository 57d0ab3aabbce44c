"""Scatter of the wear of designs over manufactured gears within the tolerances of the file."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any

import jax
import numpy as np

from ..conditions import conditions, ranked
from ..conditions.cases import Loads
from ..contact import Mesh
from ..io import DesignFile
from ..microgeometry import AbstractModification
from ..numerics import Quantile, UnitKey, program, real
from ..report import Figure, Record, Table, table_of
from ..tolerance import ManufacturedGears
from ..wear import WEAR_QUANTITIES, Wear
from ..wear.settings import MOST_LIVES, number_of
from . import manufactured
from .checkpoints import Checkpoints, NamedArrays

# of every manufactured pair of a design, by name of the quantity, shape (pairs,); NaN where it has failed
Samples = Mapping[str, np.ndarray]

_PPTE, _DEPTH = "mean_ppte_over_life", "wear_depth"
_LIMITED = {"life_to_depth": ("depth_limit", MOST_LIVES), "life_to_ppte": ("ppte_limit", 1.0)}
_LEVEL = 0.95
_SIDE_BY_SIDE = 32  # lives


def left_out(design: DesignFile) -> str:
    """Reason why no scatter is computed although the file has tolerances; "" if it is computed."""
    if "wear" not in design.tables or design.tables["wear"].line_load != "dynamic":
        return ""
    return manufactured.left_out(
        design,
        'wear of manufactured pairs is computed under the static line load only: wear.line_load = "static"',
    )


def manufactured_wear(
    mesh: Mesh,
    torque: Loads,
    designs: Mapping[str, tuple[AbstractModification, AbstractModification]],
    settings: Wear,
    manufactured: ManufacturedGears,
    *,
    keep: Callable[[Any, Callable[[], Samples]], Samples] | None = None,
) -> dict[str, Samples]:
    """Quantities of wear of manufactured pairs of several designs; all designs get the same samples.

    Args:
        mesh: prepared mesh.
        torque: torque on the pinion [N m]; ignored if the settings have loads.
        designs: modifications of pinion and wheel by name.
        settings: settings of the wear, under the static line load.
        manufactured: manufactured gears.
        keep: checkpoints of arrays by name, one per design; None keeps nothing.

    Returns:
        quantities of every pair by the name of the design and of the quantity, shape (samples,); NaN where it failed.

    Raises:
        ValueError: as `jaxgear.monte_carlo`.
    """
    cases = conditions(mesh, torque, manufactured).on(mesh)
    assert cases.removed is not None
    kept = Checkpoints().of(NamedArrays()) if keep is None else keep
    names, load, removed = tuple(scattered_names(settings)), cases.torque[0], cases.removed[0]

    def of(pinion: AbstractModification, wheel: AbstractModification) -> Samples:
        def make() -> Samples:
            found = _numbers(settings, names, mesh, load, pinion, wheel, removed)
            return {name: np.asarray(found[name]) for name in names}

        return kept((mesh, load, removed, pinion, wheel, settings, settings.blocks), make)

    return {name: of(*flanks) for name, flanks in designs.items()}


@program
def _numbers(settings: Wear, names: tuple[str, ...], mesh: Mesh, torque, pinion, wheel, removed):
    """Quantities of the wear histories of all pairs; compilation takes longer than the computation."""
    load = torque if settings.loads is None else None

    def of(deviation):
        history = settings.history(mesh, load, pinion=pinion, wheel=wheel, deviation=deviation)
        return {name: number_of(name, history, settings) for name in names}

    return jax.lax.map(of, removed, batch_size=_SIDE_BY_SIDE)


def scattered_names(settings: Wear) -> list[str]:
    """Names of the quantities whose scatter is computed."""
    return [
        _PPTE,
        _DEPTH,
        *(name for name, (limit, _) in _LIMITED.items() if getattr(settings, limit) is not None),
    ]


def tables(design: DesignFile, settings: Wear, scatters: Mapping[str, Samples]) -> Iterator[Table]:
    """One row per design; nothing without a table [tolerance]."""
    if scatters:
        records = list(_records(settings))
        yield table_of(records, scatters, f"{_pairs(design, scatters)}, the same for every design", "design")


def _records(settings: Wear) -> Iterator[Record[Samples]]:
    for name, heading in ((_PPTE, "mean PPTE\n[um]"), (_DEPTH, "depth\n[um]")):
        yield Record(name, "", partial(_mean, name=name), heading)
        yield Record(name, "", partial(_bound, name=name), "95 %\nbelow")
    limits = {"life_to_depth": "95 % last,\n{:g} um deep", "life_to_ppte": "95 % last,\nPPTE {:g} um"}
    for name in scattered_names(settings)[2:]:
        heading = limits[name].format(float(getattr(settings, _LIMITED[name][0])))
        shown = partial(_revolutions_text, settings, name)
        yield Record(name, "", partial(_lasts, name=name, share=_LEVEL), heading, shown)
    yield Record("failed", "", failed, "failed", "d")


def lines(design: DesignFile, scatters: Mapping[str, Samples]) -> Iterator[str]:
    """Lines on the best design over manufactured pairs; none without a table [tolerance]."""
    bounds = {name: _bound(samples, _PPTE) for name, samples in scatters.items()}
    found = {name: bound for name, bound in bounds.items() if np.isfinite(bound)}
    if found:
        best = min(found, key=lambda name: found[name])
        even = ", without deviations along the face, which one slice cannot show" * (design.resolution().slices == 1)
        best_of = f"95 % stay below {found[best]:.3f} um mean PPTE over the life with {best}"
        yield f"{_pairs(design, scatters)}{even}: {best_of}"


def failures(scatters: Mapping[str, Samples]) -> Iterator[str]:
    """Line for every design with manufactured pairs that have not converged."""
    for name, samples in scatters.items():
        if failed(samples):
            yield (
                f"NOT CONVERGED: {name}, {failed(samples)} of {len(samples[_PPTE])} manufactured pairs, which count as "
                "the worst: their contact did not converge, or their blocks are too long. Take more blocks."
            )


def summary(samples: Samples) -> dict[str, Any]:
    """Scatter of a design as plain data; q95 is the value that 95 % of the pairs do not exceed."""
    found: dict[str, Any] = {"pairs": len(samples[_PPTE]), "failed": failed(samples)}
    for name in samples:
        values, key = samples[name], UnitKey(name, WEAR_QUANTITIES[name].unit)
        if name in _LIMITED:  # they end at the simulated revolutions: a mean would depend on these
            found[key] = {"half_last": _lasts(samples, name, 0.5), "95_percent_last": _lasts(samples, name, _LEVEL)}
            continue
        found[key] = {"mean": _mean(samples, name), "std": float(np.std(values, ddof=1)), "q95": _bound(samples, name)}
    return {"manufactured": found}


def failed(samples: Samples) -> int:
    """Number of failed pairs."""
    return int(np.sum(~np.isfinite(samples[_PPTE])))


def figures(scatters: Mapping[str, Samples]) -> Iterator[Figure]:
    """Figure of the scatter of all designs; nothing without a table [tolerance]."""
    from .. import plot

    if scatters:
        caption = "Share of the manufactured pairs whose mean PPTE over the life stays below a value."
        drawn = plot.ppte_distribution({name: of[_PPTE] for name, of in scatters.items()}, of=_PPTE)
        yield Figure("life_ppte_distribution", caption, drawn)


def _mean(samples: Samples, name: str) -> float:
    return float(np.mean(samples[name]))


def _bound(samples: Samples, name: str) -> float:
    return float(ranked(Quantile(real(_LEVEL)), samples[name], WEAR_QUANTITIES[name].better))


def _lasts(samples: Samples, name: str, share: float) -> float:
    """Longest life that at least a share of the pairs reach; NaN if it depends on failed pairs.

    The quantile is not interpolated between neighbouring lives: many lives are zero or end at the simulated
    revolutions.
    """
    values = samples[name]
    lives = np.sort(np.where(np.isfinite(values), values, -np.inf))
    found = float(lives[int((1 - share) * len(lives) + 1e-9)])
    return found if np.isfinite(found) else np.nan


def _revolutions_text(settings: Wear, name: str, value: float) -> str:
    """Revolutions in words; a lower bound for lives beyond the simulated revolutions."""
    most = _LIMITED[name][1] * float(settings.revolutions)
    return f"> {most:.3g}" if value >= most else f"{value:.3g}"


def _pairs(design: DesignFile, scatters: Mapping[str, Samples]) -> str:
    return manufactured.pairs_in_words(design, len(next(iter(scatters.values()))[_PPTE]))
