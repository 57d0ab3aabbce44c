"""Quantities of a worn mesh: values at every time step of a wear history, their mean, and the life to a limit."""

from collections.abc import Callable
from typing import Literal

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..conditions import joined, solved
from ..contact import MeshCycle
from ..dynamics import DYNAMIC_QUANTITIES, Dynamics
from ..metrics import MESH_QUANTITIES, Quantity, Vocabulary
from ..numerics import AbstractMeasure, Given, Mean, check, maximum, quick_jit, real
from .history import WearHistory

Scalar = Float[Array, ""]
Steps = Float[Array, " steps"]
Worn = Literal["pinion", "wheel", "both"]
Measured = str | Quantity | Callable[[MeshCycle], Float[Array, "..."]]

_quantity_of = Vocabulary((*MESH_QUANTITIES.values(), *DYNAMIC_QUANTITIES.values())).quantity_of


def over_life(history: WearHistory, of: Measured, measure: AbstractMeasure | None = None) -> Steps:
    """Quantity of the mesh at every time step, shape (steps,); NaN from the first contact that has not converged.

    Args:
        history: wear history of one pair of flanks.
        of: name of a quantity of `jaxgear.metrics`, a `Quantity` (a custom one, too), or a function of a mesh cycle;
            "dynamic_factor" is the dynamic factor of the wear history.
        measure: measure over the torques of a load spectrum; None for their mean.

    Raises:
        ValueError: for an unknown name, and for the dynamic factor of a wear history without dynamics.
    """
    _single(history)
    quantity = _quantity_of(of)
    if quantity.name == "dynamic_factor" and quantity.takes is Dynamics:
        if history.dynamic_factor is None:
            raise ValueError('"dynamic_factor" needs a wear history with dynamics: wear(..., dynamics=Dynamics(...))')
        values = history.dynamic_factor
    else:
        values = jnp.where(solved(history.cycles), quantity(history.cycles), jnp.nan)
    return _of_all_loads(history, values, quantity.better, measure)


def _of_all_loads(history: WearHistory, values, better, measure: AbstractMeasure | None) -> Steps:
    """Apply the measure over the torques of a spectrum to values of shape (steps, torques); returns shape (steps,)."""
    if history.weights is None:
        return values
    many = jnp.stack([joined(measure or Mean(), row, history.weights, better) for row in values])
    # measures count a failed case among many as infinite; all torques wear the same flanks here, so the value is NaN
    return jnp.where(jnp.any(jnp.isnan(values), axis=-1), jnp.nan, many)


def pressure_error(history: WearHistory, measure: AbstractMeasure | None = None) -> Steps:
    """Estimated error of the largest flank pressure at every time step [MPa], shape (steps,).

    The estimate is the change of the pressure with the worn flanks on every other grid point, and with the contact
    width by the load of each contact. The arguments are those of `over_life`.
    """
    _single(history)
    return _of_all_loads(history, history.pressure_error, "smaller", measure)


def mean_over_life(history: WearHistory, of: Measured, measure: AbstractMeasure | None = None) -> Scalar:
    """Mean of a quantity over the revolutions of a wear history, in its unit; arguments as for `over_life`."""
    values, done = over_life(history, of, measure), history.revolutions
    return 0.5 * jnp.sum((values[1:] + values[:-1]) * jnp.diff(done)) / (done[-1] - done[0])


def wear_depth(history: WearHistory, gear: Worn = "both") -> Steps:
    """Largest wear depth of the flank of a gear, or of both, at every time step [um], shape (steps,).

    The depth is NaN at time steps that have not converged.

    Raises:
        ValueError: for another gear than "pinion", "wheel" or "both".
    """
    _single(history)
    depths = {
        "pinion": [history.pinion_depth],
        "wheel": [history.wheel_depth],
        "both": [history.pinion_depth, history.wheel_depth],
    }
    if gear not in depths:
        raise ValueError(f'gear = {gear!r} must be "pinion", "wheel" or "both"')
    return jnp.where(history.converged, maximum(jnp.stack(depths[gear]), axis=(0, 2, 3)), jnp.nan)


def worn_volume(history: WearHistory) -> Float[Array, "steps gears parts"]:
    """Volume worn off one flank of every tooth of pinion and wheel, on the flank and at tip corners [mm3].

    The part "tip corners" of a gear adds the wear of its own tip edge and of its flank at the tip corners of the mate.
    The volume is NaN at time steps that have not converged.
    """
    _single(history)
    volume = 1e-3 * jnp.einsum("lgpsk,gk,s->lgp", history.depth, history.arc, history.slice_width)
    return jnp.where(history.converged[:, None, None], volume, jnp.nan)


def life_to_depth(history: WearHistory, limit: Given, gear: Worn = "both") -> Scalar:
    """Revolutions of the pinion until the largest wear depth reaches a limit [um], shape ().

    The depth is linear between two time steps and is extrapolated from the last block beyond the last one. The life is
    infinite without wear.

    Raises:
        ValueError: for a limit that is not greater than 0, and for a gear that `wear_depth` does not accept.
    """
    limit = real(limit).astype(history.revolutions.dtype)
    check("limit", limit, "um", low=0.0, open_low=True)
    return _reached(history.revolutions, wear_depth(history, gear), limit, goes_on=True)


def life_to(history: WearHistory, of: Measured, limit: Given, measure: AbstractMeasure | None = None) -> Scalar:
    """Revolutions of the pinion until a quantity first violates a limit, shape (); infinite if it never does.

    The quantity is linear between two time steps. The life is zero if the new flanks violate the limit, and NaN if the
    contact has not converged before the limit is reached.

    Args:
        history, of, measure: as for `over_life`.
        limit: limit in the unit of the quantity; a lower limit for quantities whose larger values are better.
    """
    quantity = _quantity_of(of)
    limit = real(limit).astype(history.revolutions.dtype)
    check("limit", limit, quantity.unit)
    values = over_life(history, quantity, measure)
    return _reached(history.revolutions, quantity.sign * values, quantity.sign * limit, goes_on=False)


def _single(history: WearHistory) -> None:
    """Raise for batched histories: the batch axis would be mistaken for the axis of the time steps."""
    if history.revolutions.ndim != 1:
        raise ValueError("history is of a batch of designs, must be of one: put jax.vmap around this function as well")


@quick_jit
def _reached(done: Steps, values: Steps, limit: Scalar, *, goes_on: bool) -> Scalar:
    """Revolutions at which values first reach a limit, 0 at the start; infinite or extrapolated if they never do."""
    # written so that NaN counts as reached and is returned
    beyond = ~(values < limit)
    last = len(done) - 2
    found = jnp.any(beyond)
    after = jnp.where(found, jnp.argmax(beyond), last + 1)
    left = jnp.clip(after - 1, 0, last)
    low, high = values[left], values[left + 1]
    rises = (high > low) | jnp.isnan(high)
    share = (limit - low) / jnp.where(rises, high - low, 1.0)
    at = done[left] + share * (done[left + 1] - done[left])
    at = jnp.where(found | (goes_on & rises), at, jnp.inf)
    return jnp.where(beyond[0], jnp.where(jnp.isnan(values[0]), jnp.nan, jnp.zeros_like(at)), at)
