"""What is worn off a flank, as the contact analyses of a life look it up."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..geometry import GearPair
from ..geometry.involute import half_tooth_angle
from ..microgeometry import AbstractModification, Flank
from ..numerics import result


class WornFlank(AbstractModification):
    """Material worn off at the points of an even grid, on the lines of the slices of a mesh; linear between points.

    Constant beyond the ends, it is what `TabulatedProfile` and `TabulatedFlank` are at the slices of the mesh. They
    search for the place of every contact, which takes far longer than the contact itself; here the place is a division.

    Attributes:
        roll_length: of the grid points, shape (points,).
        amount: material removed, shape (slices, points).
    """

    roll_length: Float[Array, " points"] = result("mm")
    amount: Float[Array, "slices points"] = result("um")

    @property
    def varies_along_face(self) -> bool:
        return len(self.amount) > 1

    def __call__(self, flank: Flank):
        cells = self.amount.shape[-1] - 1
        first, last = self.roll_length[0], self.roll_length[-1]
        place = jnp.clip((flank.roll_length - first) * (cells / (last - first)), 0.0, cells)
        left = jnp.minimum(jax.lax.stop_gradient(place).astype(jnp.int32), cells - 1)
        line = jnp.arange(len(self.amount), dtype=jnp.int32)[None, :, None]
        low, high = self.amount[line, left], self.amount[line, left + 1]
        return low + (place - left.astype(place.dtype)) * (high - low)


def every_other(depth: Float[Array, "*shape points"]) -> Float[Array, "*shape points"]:
    """Depth that is known at every other point of an even grid only, linear between those; the last one is kept."""
    between = 0.5 * (depth[..., :-2:2] + depth[..., 2::2])
    return depth.at[..., 1:-1:2].set(between)


def worn_through(
    pair: GearPair, roll_length: Float[Array, "gears points"], depth: Float[Array, "gears parts slices points"]
) -> Bool[Array, ""]:
    """Whether nothing is left of a tooth of either gear somewhere up its flank.

    Material taken off all over an involute turns it about the gear by depth over base radius; there is none left where
    that is the angle of the tooth.
    """
    left = [
        2e3 * half_tooth_angle(gear, lengths) * gear.base_radius - jnp.max(jnp.sum(worn, axis=0), axis=0)
        for gear, lengths, worn in zip((pair.pinion, pair.wheel), roll_length, depth)
    ]
    return jnp.any(jnp.stack(left) <= 0)
