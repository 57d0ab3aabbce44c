"""Results of a wear history as quantities: objectives, limits, columns of sweeps.

A quantity of wear needs revolutions and wear coefficients besides its name: `Wear.quantity` supplies them in Python,
the table [wear] in a design file.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any, cast

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..conditions import solved
from ..metrics import Analysis, Quantity, Vocabulary
from ..numerics import Given, maximum
from .history import WearHistory
from .over_life import life_to, life_to_depth, mean_over_life, over_life, pressure_error, wear_depth
from .settings import Wear

# Longest life to a wear depth that is reported, in analyzed lives: a limit that is never reached is no failure, but a
# value that is not finite counts as one. The transmission error is not extrapolated beyond the analyzed life.
MOST_LIVES = 1000.0
# Blocks are too long, and flanks overshoot from one to the next, where the error is estimated at more than this share
# of the depth, or a block wears off more than so many deflections of the new teeth under their load (see `wear`). The
# estimate alone misses some: on a 20/30 pair, 2 blocks against 128, it says 5 % for 9 %, and 21 % for 56 % where a
# block wears 140 um.
_LARGEST_ERROR, _MOST_IN_DEFLECTIONS = 0.1, 2.0
_ERROR = "wear_depth_error"


def _at_most(longest, history):
    return jnp.where(history > longest, longest, history)


def _pressure_error(history: WearHistory):
    """Estimated error of the largest pressure over a wear history [MPa]; tip corners have no grid error."""
    largest = over_life(history, "max_contact_pressure")
    may_be = jnp.maximum(largest, over_life(history, "max_flank_pressure") + pressure_error(history))
    return maximum(may_be) - maximum(largest)


# of a wear history and the settings that it was worn by, by the name of the quantity
OF_HISTORY: Mapping[str, Callable[[WearHistory, Wear], Float[Array, ""]]] = {
    "worn_ppte": lambda history, _: over_life(history, "ppte")[-1],
    "mean_ppte_over_life": lambda history, _: mean_over_life(history, "ppte"),
    "max_ppte_over_life": lambda history, _: maximum(over_life(history, "ppte")),
    "max_pressure_over_life": lambda history, _: maximum(over_life(history, "max_contact_pressure")),
    "max_pressure_over_life_error": lambda history, _: _pressure_error(history),
    "worn_dynamic_factor": lambda history, _: over_life(history, "dynamic_factor")[-1],
    "max_dynamic_factor_over_life": lambda history, _: maximum(over_life(history, "dynamic_factor")),
    "wear_depth": lambda history, _: wear_depth(history)[-1],
    "pinion_wear_depth": lambda history, _: wear_depth(history, "pinion")[-1],
    "wheel_wear_depth": lambda history, _: wear_depth(history, "wheel")[-1],
    _ERROR: lambda history, _: history.error[-1],
    "life_to_depth": lambda history, wear: _at_most(
        MOST_LIVES * wear.revolutions, life_to_depth(history, cast(Given, wear.depth_limit))
    ),
    "life_to_ppte": lambda history, wear: _at_most(
        wear.revolutions, life_to(history, "ppte", cast(Given, wear.ppte_limit))
    ),
}


def number_of(name: str, history: WearHistory, settings: Wear) -> Float[Array, ""]:
    """Value of a quantity of a wear history computed with `Wear` settings, shape (); NaN by the rules of `Wear`."""
    usable = jnp.all(solved(history.cycles)) & (name == _ERROR or blocks_are_short(history))
    return jnp.where(usable, OF_HISTORY[name](history, settings), jnp.nan)


def _number(name: str, analysis: Analysis, wear: Wear) -> Float[Array, ""]:
    # all quantities of the same settings come from one life
    return number_of(name, analysis.once(wear, "life", lambda: _life(analysis, wear)), wear)


def _life(analysis: Analysis, wear: Wear) -> WearHistory:
    load = analysis.operating_point if wear.loads is None else None
    wear = replace(wear, largest_increment=None)
    return wear.history(analysis.prepared_mesh, load, **analysis.flanks, deviation=analysis.deviation)


def blocks_are_short(history: WearHistory) -> Bool[Array, ""]:
    """True if the blocks are short enough: no overshoot, and an estimated error within a tenth of the wear depth."""
    worn = jnp.sum(history.depth, axis=2)
    deflection = history.cycles.transmission_error[0] - history.cycles.unloaded_transmission_error[0]
    overshoots = maximum(jnp.abs(worn[1:] - worn[:-1])) > _MOST_IN_DEFLECTIONS * maximum(deflection)
    return ~overshoots & (history.error[-1] <= _LARGEST_ERROR * wear_depth(history)[-1])


def _quantity(name: str, unit: str, meaning: str, **options: Any) -> Quantity:
    return Quantity(name, partial(_number, name), unit, meaning, takes=Wear, **options)


WEAR_QUANTITIES = Vocabulary(
    (
        _quantity("worn_ppte", "um", "peak-to-peak transmission error when worn"),
        _quantity("mean_ppte_over_life", "um", "peak-to-peak transmission error, mean over the life"),
        _quantity("max_ppte_over_life", "um", "peak-to-peak transmission error, worst of the life"),
        _quantity("max_pressure_over_life", "MPa", "largest pressure of the life"),
        _quantity(
            "max_pressure_over_life_error",
            "MPa",
            "error of the largest pressure of the life by grid and width of the contacts, as estimated",
        ),
        _quantity(
            "worn_dynamic_factor",
            "",
            "largest mesh force over the static one when worn, at the speed of the pinion",
            needs="dynamics",
        ),
        _quantity(
            "max_dynamic_factor_over_life",
            "",
            "largest mesh force over the static one, worst of the life, at the speed of the pinion",
            needs="dynamics",
        ),
        _quantity("wear_depth", "um", "largest wear depth of both gears"),
        _quantity("pinion_wear_depth", "um", "largest wear depth, pinion"),
        _quantity("wheel_wear_depth", "um", "largest wear depth, wheel"),
        _quantity(_ERROR, "um", "error of the wear depth by the length of the blocks, as estimated"),
        _quantity(
            "life_to_depth",
            "revolutions",
            "life to the limit of the wear depth, at most 1000 times the revolutions of the wear history",
            better="larger",
            needs="depth_limit",
        ),
        _quantity(
            "life_to_ppte",
            "revolutions",
            "life to the limit of peak-to-peak transmission error, at most the revolutions of the wear history",
            better="larger",
            needs="ppte_limit",
        ),
    )
)
