"""Numbers of worn flanks in the vocabulary of quantities: objectives, limits, columns of sweeps.

A name alone does not say for how many revolutions, and with which coefficient of wear: `Wear.quantity` gives the
quantity, and a design file has the table [wear].
"""

from collections.abc import Callable, Mapping
from typing import Any, Literal, NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..conditions import deviation_of, solved
from ..contact import MeshCycle
from ..metrics import Quantity, quantities
from ..metrics.settings import WithoutSettings, WithSettings
from ..numerics import maximum, once
from .history import WearHistory
from .over_life import life_to, life_to_depth, mean_over_life, over_life, pressure_error, wear_depth


class _Kind(NamedTuple):
    """A quantity of worn flanks before its settings are known.

    Attributes:
        of: computes it from a life and its settings.
        unit: "" for a pure number.
        meaning: in a few words.
        better: as of `Quantity`.
        needs: field of the settings that must be given.
    """

    of: Callable[[WearHistory, Any], Any]
    unit: str
    meaning: str
    better: Literal["smaller", "larger"] = "smaller"
    needs: str | None = None


# A limit that is never reached is no failure, which not finite values of a quantity are. Nothing is known of the
# transmission error beyond the life that was looked at; the depth goes on, but so far nobody extrapolates.
LIVES_AHEAD = 1000.0
# Blocks are too long, and flanks overshoot from one to the next, where the error is estimated at more than this share
# of the depth, or a block wears off more than so many deflections of the new teeth under their load (see `wear`). The
# estimate alone misses some: on a 20/30 pair, 2 blocks against 128, it says 5 % for 9 %, and 21 % for 56 % where a
# block wears 140 um.
_LARGEST_ERROR, _MOST_IN_DEFLECTIONS = 0.1, 2.0
_ERROR = "wear_depth_error"


def _at_most(longest, life):
    return jnp.where(life > longest, longest, life)


def _pressure_error(life: WearHistory):
    """By how much the largest pressure of a life may be larger [MPa]; that at tip corners depends on no grid."""
    largest = over_life(life, "max_contact_pressure")
    may_be = jnp.maximum(largest, over_life(life, "max_flank_pressure") + pressure_error(life))
    return maximum(may_be) - maximum(largest)


WEAR_QUANTITIES: Mapping[str, _Kind] = {
    "worn_ppte": _Kind(lambda life, _: over_life(life, "ppte")[-1], "um", "peak-to-peak transmission error when worn"),
    "mean_ppte_over_life": _Kind(
        lambda life, _: mean_over_life(life, "ppte"), "um", "peak-to-peak transmission error, mean over the life"
    ),
    "max_ppte_over_life": _Kind(
        lambda life, _: maximum(over_life(life, "ppte")), "um", "peak-to-peak transmission error, worst of the life"
    ),
    "max_pressure_over_life": _Kind(
        lambda life, _: maximum(over_life(life, "max_contact_pressure")), "MPa", "largest pressure of the life"
    ),
    "max_pressure_over_life_error": _Kind(
        lambda life, _: _pressure_error(life),
        "MPa",
        "error of the largest pressure of the life by grid and width of the contacts, as estimated",
    ),
    "worn_dynamic_factor": _Kind(
        lambda life, _: over_life(life, "dynamic_factor")[-1],
        "",
        "largest mesh force over the static one when worn, at the speed of the pinion",
        needs="dynamics",
    ),
    "max_dynamic_factor_over_life": _Kind(
        lambda life, _: maximum(over_life(life, "dynamic_factor")),
        "",
        "largest mesh force over the static one, worst of the life, at the speed of the pinion",
        needs="dynamics",
    ),
    "wear_depth": _Kind(lambda life, _: wear_depth(life)[-1], "um", "largest wear depth of both gears"),
    "pinion_wear_depth": _Kind(lambda life, _: wear_depth(life, "pinion")[-1], "um", "largest wear depth, pinion"),
    "wheel_wear_depth": _Kind(lambda life, _: wear_depth(life, "wheel")[-1], "um", "largest wear depth, wheel"),
    _ERROR: _Kind(
        lambda life, _: life.error[-1], "um", "error of the wear depth by the length of the blocks, as estimated"
    ),
    "life_to_depth": _Kind(
        lambda life, settings: _at_most(LIVES_AHEAD * settings.revolutions, life_to_depth(life, settings.depth_limit)),
        "revolutions",
        "life to the limit of the wear depth, at most a thousand of those looked at",
        "larger",
        "depth_limit",
    ),
    "life_to_ppte": _Kind(
        lambda life, settings: _at_most(settings.revolutions, life_to(life, "ppte", settings.ppte_limit)),
        "revolutions",
        "life to the limit of peak-to-peak transmission error, at most the life looked at",
        "larger",
        "ppte_limit",
    ),
}


def _number(given: WithSettings, cycle: MeshCycle):
    settings = given.settings
    # all quantities of the same settings come from one life
    life = once(cycle, (given.make, given.fields), lambda: _life(given.name, settings, cycle))
    return number_of(given.name, life, settings)


def number_of(name: str, life: WearHistory, settings: Any) -> Float[Array, ""]:
    """A quantity of a life that was worn by `Wear` settings; NaN as `Wear.quantity` says."""
    usable = jnp.all(solved(life.cycles)) & (name == _ERROR or blocks_are_short(life))
    return jnp.where(usable, WEAR_QUANTITIES[name].of(life, settings), jnp.nan)


def blocks_are_short(life: WearHistory) -> Bool[Array, ""]:
    """Whether the blocks are short enough for the depth to mean something."""
    worn = jnp.sum(life.depth, axis=2)
    deflection = life.cycles.transmission_error[0] - life.cycles.unloaded_transmission_error[0]
    overshoots = maximum(jnp.abs(worn[1:] - worn[:-1])) > _MOST_IN_DEFLECTIONS * maximum(deflection)
    return ~overshoots & (life.error[-1] <= _LARGEST_ERROR * wear_depth(life)[-1])


def _life(name: str, settings: Any, cycle: MeshCycle) -> WearHistory:
    mesh = cycle.mesh_for(name)
    flanks = {"pinion": cycle.pinion, "wheel": cycle.wheel}
    load = cycle.operating_point if settings.loads is None else None
    return settings.life(mesh, load, **flanks, deviation=deviation_of(cycle, mesh))


def _quantity(name: str, kind: _Kind) -> Quantity:
    stands = WithoutSettings(name, "jaxgear.wear.Wear", "wear", needs=kind.needs, given=_number)
    return Quantity(name, stands, kind.unit, kind.meaning, better=kind.better)


quantities.add(*(_quantity(name, kind) for name, kind in WEAR_QUANTITIES.items()), package=__package__)
