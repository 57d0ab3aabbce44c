"""Operating point of a mesh: torque, speed and friction."""

import jax
import numpy as np
from jaxtyping import Array, Float

from ..numerics import Checked, Given, check, concrete, number, real

Scalar = Float[Array, ""]


class OperatingPoint(Checked):
    """Load and speed of a mesh; many are made with `jax.vmap`.

    Attributes:
        torque: torque on the pinion [N m].
        speed: speed of the pinion [rpm]; None where no result depends on it.
        friction: mean coefficient of friction; None for the default of each analysis.

    Raises:
        ValueError: for a negative or non-finite number, or an array of numbers.
    """

    torque: Scalar = number("N m", low=0.0)
    speed: Scalar | None = number("rpm", low=0.0, optional=True, default=None)
    friction: Scalar | None = number("", low=0.0, optional=True, default=None)


Torque = Given | OperatingPoint  # a torque on the pinion [N m] alone, or with what belongs to it


def operating_point_of(torque: Torque, dtype: np.dtype) -> OperatingPoint:
    """An operating point in the precision of a mesh, of a torque [N m] or of an operating point.

    Raises:
        ValueError: for a negative or non-finite torque, or an array of torques.
    """
    if not isinstance(torque, OperatingPoint):
        torque = real(torque, "torque")
        if torque.ndim:
            raise ValueError(f"torque has shape {torque.shape}, must be a single number; solve for many with jax.vmap")
        known = concrete(torque)
        if known is not None and known < 0:
            raise ValueError(
                f"torque = {known:g} N m must be at least 0 N m; for the coast flanks prepare the pair's "
                "`coast` and give the amount of the torque"
            )
        check("torque", torque, "N m", low=0.0)
        torque = OperatingPoint(torque)
    return jax.tree.map(lambda part: part.astype(dtype), torque)
