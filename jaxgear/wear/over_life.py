"""Effect of wear on a mesh: quantities at every time step of a wear history, their mean, and the life to a limit."""

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
    """A quantity of the mesh at every time step, shape (steps,); NaN from a contact on that has not converged.

    Args:
        history: wear history of one pair of flanks.
        of: name of a quantity of `jaxgear.metrics`, a `Quantity`, as one that you have added, or a function of a cycle;
            "dynamic_factor" is that of the dynamics of the life.
        measure: how the torques of a load spectrum are joined; None for their mean.

    Raises:
        ValueError: for an unknown name, and for the dynamic factor of a life without dynamics.
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
    """Values (steps, torques) joined over the torques of a spectrum."""
    if history.weights is None:
        return values
    many = jnp.stack([joined(measure or Mean(), row, history.weights, better) for row in values])
    # a failed case of many is joined as an infinite one: of one pair of flanks nothing is known
    return jnp.where(jnp.any(jnp.isnan(values), axis=-1), jnp.nan, many)


def pressure_error(history: WearHistory, measure: AbstractMeasure | None = None) -> Steps:
    """Estimated error of the largest flank pressure at every time step [MPa], shape (steps,).

    It is the change of the pressure with the worn flanks on every other grid point, and with the contact width of each
    load. Arguments as for `over_life`.
    """
    _single(history)
    return _of_all_loads(history, history.pressure_error, "smaller", measure)


def mean_over_life(history: WearHistory, of: Measured, measure: AbstractMeasure | None = None) -> Scalar:
    """Mean of a quantity over the revolutions of a life; arguments as for `over_life`."""
    values, done = over_life(history, of, measure), history.revolutions
    return 0.5 * jnp.sum((values[1:] + values[:-1]) * jnp.diff(done)) / (done[-1] - done[0])


def wear_depth(history: WearHistory, gear: Worn = "both") -> Steps:
    """Largest wear depth of the flank of a gear, or of both, at every time step [um], shape (steps,).

    NaN after a life whose contact was not found.

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

    Where a gear wears at tip corners, its tip edge and its flank at the mate's tip corners count alike.
    NaN after a life whose contact was not found.
    """
    _single(history)
    volume = 1e-3 * jnp.einsum("lgpsk,gk,s->lgp", history.depth, history.arc, history.slice_width)
    return jnp.where(history.converged[:, None, None], volume, jnp.nan)


def life_to_depth(history: WearHistory, limit: Given, gear: Worn = "both") -> Scalar:
    """Revolutions of the pinion until the deepest wear reaches a limit [um].

    Between two time steps the depth is linear; beyond the last one it is extrapolated from the last block. Infinite
    where nothing wears.

    Raises:
        ValueError: for a limit that is not greater than 0, and as `wear_depth`.
    """
    limit = real(limit).astype(history.revolutions.dtype)
    check("limit", limit, "um", low=0.0, open_low=True)
    return _reached(history.revolutions, wear_depth(history, gear), limit, goes_on=True)


def life_to(history: WearHistory, of: Measured, limit: Given, measure: AbstractMeasure | None = None) -> Scalar:
    """Revolutions of the pinion until a quantity first passes a limit on its bad side; infinite where it never does.

    Between two time steps the quantity is linear. Zero where the new flanks exceed the limit; NaN where the contact has
    not converged before.

    Args:
        history, of, measure: as for `over_life`.
        limit: in the unit of the quantity.
    """
    quantity = _quantity_of(of)
    limit = real(limit).astype(history.revolutions.dtype)
    check("limit", limit, quantity.unit)
    values = over_life(history, quantity, measure)
    return _reached(history.revolutions, quantity.sign * values, quantity.sign * limit, goes_on=False)


def _single(history: WearHistory) -> None:
    """Refuses histories of many designs: their axis would be taken for that of the time steps of one."""
    if history.revolutions.ndim != 1:
        raise ValueError("history is of a batch of designs, must be of one: put jax.vmap around this function as well")


@quick_jit
def _reached(done: Steps, values: Steps, limit: Scalar, *, goes_on: bool) -> Scalar:
    """Revolutions at which values first reach a limit, 0 at the start; infinite or extrapolated if they never do."""
    # written so that NaN counts as reached, and is what comes out
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
