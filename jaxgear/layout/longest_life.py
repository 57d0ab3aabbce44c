"""Step 1 of a layout for a duty cycle: the flank line with which the pair lives longest.

The shafts bend differently under every load, so that no flank line levels all of them; the one sought is that of the
smallest damage sum.
"""

import math

import jax
import jax.numpy as jnp
import numpy as np
import scipy.optimize
from jaxtyping import Array, Float

from ..conditions import LoadSpectrum
from ..numerics import concrete, kernel, maximum
from ..shafts import AbstractSupport
from .flank_line import FlankLine, level_load
from .life import Damage, Endurance, Loaded, damage, damage_of, face_loads, summed, under_loads
from .stations import STATIONS, Stations

# Exponents of the mean that stands for the largest line load: from one that most of the face has a say in to one that
# is 2 % below the largest. The search ends on the largest line load itself.
_SHARPNESS = (16.0, 64.0, 256.0)
_FIRST_STEP = 0.5  # um, of the last search
_PRECISION = 1e-4  # um
_NONE = 1e-300  # damage whose logarithm still exists


def longest_life(
    support: AbstractSupport,
    load: LoadSpectrum,
    endurance: Endurance | tuple[Endurance, Endurance],
    *,
    negative_crowning: bool = False,
    stations: int = STATIONS,
) -> FlankLine:
    """The flank line of the smallest damage sum under a duty cycle, of both gears and of pitting and bending.

    The largest line load of every load has a kink where it goes from one end of the face to the other. So the search
    follows the gradient of the damage of a high mean of the line load (L-BFGS-B), from the flank line that levels the
    load which does most damage, and ends with a simplex on the damage itself. While the whole face carries, the damage
    is convex in both amounts.

    Args:
        support: shafts at the mesh; couplings are scaled to every torque.
        load, endurance, stations: as for `damage`.
        negative_crowning: whether the crowning may be negative.

    Returns:
        the flank line over the common face, of numbers: what it is made of has no derivatives, the damage with it has.

    Raises:
        ValueError: as `damage` does, for torques that are all zero, numbers that are being traced, and a torque whose
            load over the face is not found.
    """
    if any(concrete(leaf) is None for leaf in jax.tree.leaves((support, load, endurance))):
        raise ValueError("longest_life: searches with numbers, not inside of a traced function; `damage` can be traced")
    both = endurance if isinstance(endurance, tuple) else (endurance, endurance)
    if not float(jnp.max(jnp.where(load.weights > 0, load.torques, 0.0))) > 0:
        raise ValueError("longest_life: torques are all zero; every flank line has an infinite life")
    faces = under_loads(support, load, stations=stations)
    unmodified = damage(support, load, both, stations=stations)
    missed = np.asarray(load.torques)[~np.asarray(unmodified.converged)]
    if len(missed):
        raise ValueError(
            f"longest_life: the load over the face at {float(missed[0]):g} N m is not found: do loads leave a shaft "
            "afloat in its clearances?"
        )
    worst = int(np.argmax(np.sum(unmodified.pitting, axis=0)))
    start = level_load(support, load.torques[worst], negative_crowning=negative_crowning, stations=stations)
    point = np.array([float(start.slope), float(start.crowning)])
    bounds = [(None, None), (None if negative_crowning else 0.0, None)]
    for sharpness in _SHARPNESS:

        def soft(at, sharpness=sharpness):
            value, slope = _soft_damage(faces, load, both, jnp.asarray(at), jnp.asarray(sharpness))
            return float(value), np.asarray(slope)

        point = scipy.optimize.minimize(soft, point, jac=True, method="L-BFGS-B", bounds=bounds).x

    pair = support.pair

    def true(at):
        found = damage_of(faces, load, both, FlankLine(), FlankLine(*at).on(pair, "wheel"))
        return math.log(max(float(found.largest), _NONE))

    corners = np.stack([point, point + [_FIRST_STEP, 0.0], point + [0.0, _FIRST_STEP]])
    options = {"initial_simplex": corners, "xatol": _PRECISION, "fatol": 1e-9}
    found = scipy.optimize.minimize(true, point, method="Nelder-Mead", bounds=bounds, options=options)
    return FlankLine(*found.x)


@kernel
def _soft_damage(faces: Stations, load: LoadSpectrum, endurance, at: Float[Array, "2"], sharpness):
    """Logarithm of the damage by a mean of the line load that is close to the largest, and its gradient."""
    pair = jax.tree.map(lambda leaf: leaf[0], faces.pair)

    def of(at) -> Float[Array, ""]:
        found = face_loads(faces, FlankLine(), FlankLine(at[0], at[1]).on(pair, "wheel"))
        mean = jnp.mean(found.line_load, axis=-1)
        loaded = mean > 0
        share = found.line_load / jnp.where(loaded, mean, 1.0)[:, None]
        # powers relative to the largest do not overflow
        top = jax.lax.stop_gradient(jnp.max(share, axis=-1))
        factor = top * jnp.mean((share / jnp.where(loaded, top, 1.0)[:, None]) ** sharpness, axis=-1) ** (1 / sharpness)
        factor = jnp.where(loaded, factor, 1.0)
        made: Damage = summed(pair, Loaded(factor * mean, factor, found.converged), load, endurance)
        return jnp.log(jnp.maximum(maximum(made.total), _NONE))

    return jax.value_and_grad(of)(at)
