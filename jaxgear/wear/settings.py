"""Settings of wear: revolutions, wear coefficients, limits; and the quantities of wear.

A quantity of wear needs revolutions and wear coefficients besides its name: `Wear.quantity` supplies them in Python,
the table [wear] in a design file.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any, cast

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..conditions import LoadSpectrum, solved
from ..contact import Mesh
from ..contact.operating_point import Torque
from ..dynamics import Dynamics
from ..metrics import AbstractSettings, Analysis, Quantity, Vocabulary
from ..microgeometry import AbstractModification
from ..numerics import Callback, Given, Numbers, count, maximum, number
from .case import LARGEST_COEFFICIENT
from .history import BLOCKS, Keep, WearHistory, check_blocks, wear
from .over_life import life_to, life_to_depth, mean_over_life, over_life, pressure_error, wear_depth
from .vibration import LineLoad, check_line_load

Scalar = Float[Array, ""]


class Wear(AbstractSettings):
    """Settings of wear: revolutions, wear coefficients, limits, and the load that wears the flanks.

    `quantity` returns the quantities of worn flanks, `WEAR_QUANTITIES`. With `loads` the loads of that spectrum wear
    one flank together, independent of the load of the mesh cycle. Without `loads`, every load of a spectrum and every
    manufactured pair has its own wear history; a measure then joins the values of all cases. Use `Worst()` under a
    spectrum: it is the value of a pair that runs at one of the loads, while a mean mixes different flanks.

    A quantity is NaN where a contact has not converged, and where the blocks are so long that flanks overshoot: the
    error of the depth, estimated by `wear_depth_error`, exceeds a tenth of the depth, or a block wears off more than
    twice the deflection of the new teeth. Long blocks do not make `wear_depth_error` itself NaN. The integrator uses
    the number of steps of the dynamics, or 256.

    Attributes:
        revolutions: total revolutions of the pinion.
        coefficient: wear coefficient of the pinion, and of the wheel if `wheel_coefficient` is None: from 1e-18 for
            good films to 5e-16 for mild wear in mixed lubrication.
        wheel_coefficient: wear coefficient of the wheel; None for the wear coefficient of the pinion.
        blocks: even number of blocks of equal length, each a contact analysis and a step of wear.
        largest_increment: limit of the wear depth per block of a `history`, used instead of `blocks` and exceeded by a
            tenth at most; None for blocks of equal length. Quantities always use `blocks`.
        points: number of grid points along each flank; None for one and a half times the positions, from 33 to 97.
        depth_limit: wear depth at which the life ends, for `life_to_depth`.
        ppte_limit: peak-to-peak transmission error at which the life ends, for `life_to_ppte`.
        line_load: line load that wears the flanks: "static", or "dynamic" for the line load of the steady motion at the
            speed of the load; None for "dynamic" with dynamics, "static" without.
        dynamics: masses and damping of the vibration, whose speeds are not used; None for no vibration.
        loads: load spectrum that wears one flank, its weights shares of the revolutions; None for the load of the
            cycle.
    """

    table = "wear"
    revolutions: Scalar = number("revolutions", low=0.0, open_low=True)
    coefficient: Scalar = number("m2/N", low=0.0, high=LARGEST_COEFFICIENT)
    wheel_coefficient: Scalar | None = number("m2/N", low=0.0, high=LARGEST_COEFFICIENT, optional=True, default=None)
    blocks: int = count(low=2, high=100_000, default=BLOCKS)
    largest_increment: Scalar | None = number("um", low=0.0, open_low=True, optional=True, default=None)
    points: int | None = count(low=3, high=10_000, optional=True, default=None)
    depth_limit: Scalar | None = number("um", low=0.0, open_low=True, optional=True, default=None)
    ppte_limit: Scalar | None = number("um", low=0.0, open_low=True, optional=True, default=None)

    line_load: LineLoad | None = None
    dynamics: Dynamics | None = None
    loads: LoadSpectrum | None = None

    def check_together(self) -> None:
        check_blocks(self.blocks)
        check_line_load(self.line_load, self.dynamics)

    @property
    def coefficients(self) -> Float[Array, " gears"]:
        """Wear coefficients of pinion and wheel [m2/N], shape (gears,)."""
        wheel = self.coefficient if self.wheel_coefficient is None else self.wheel_coefficient
        return jnp.stack([self.coefficient, wheel])

    def history(
        self,
        mesh: Mesh,
        torque: Torque | None = None,
        *,
        pinion: AbstractModification | None = None,
        wheel: AbstractModification | None = None,
        deviation: Numbers | None = None,
        keep: Keep | None = None,
        callback: Callback | None = None,
    ) -> WearHistory:
        """Wear history of a design by these settings; see `wear` for arguments and errors.

        Args:
            mesh: prepared mesh.
            torque: torque on the pinion [N m], or an `OperatingPoint`; None if the settings have loads.
            pinion, wheel: modifications of the new flanks.
            deviation: material removed by manufacturing deviations [um], in addition to the modifications.
            keep, callback: as for `wear`.

        Raises:
            ValueError: if both a torque and loads are given, or neither.
        """
        if (torque is None) == (self.loads is None):
            raise ValueError("Wear: give a torque where there are no loads, and none where there are")
        loads = self.loads if torque is None else torque
        assert loads is not None
        options: dict[str, Any] = {"coefficient": self.coefficients, "blocks": self.blocks, "points": self.points}
        options |= {"dynamics": self.dynamics, "line_load": self.line_load}
        options |= {"largest_increment": self.largest_increment, "keep": keep, "callback": callback}
        flanks: dict[str, Any] = {"pinion": pinion, "wheel": wheel, "deviation": deviation}
        return wear(mesh, loads, self.revolutions, **flanks, **options)


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


def _pressure_error(history: WearHistory) -> Float[Array, ""]:
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
    return number_of(name, analysis.once(wear, "life", lambda: _history(analysis, wear)), wear)


def _history(analysis: Analysis, wear: Wear) -> WearHistory:
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
