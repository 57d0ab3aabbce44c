"""Springs of which at most one even and one odd one touch at the same time: two rows hold the values of all."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Shaped

Flags = Bool[Array, "slices positions"]


class Alternation(eqx.Module):
    """Which of the springs can touch, in every slice at every position: one of the even and one of the odd ones.

    Attributes:
        chosen: True where a spring can touch.
    """

    chosen: Bool[Array, "springs slices positions"]

    def rows(self, springs: Float[Array, "springs #slices positions"]) -> Float[Array, "2 slices positions"]:
        """Values of the springs that can touch (rows: even, odd), selected from the values of all springs."""
        both = [self._chosen(list(springs[first::2]), first) for first in (0, 1)]
        return jnp.stack([jnp.broadcast_to(row, self.chosen.shape[1:]) for row in both])

    def springs(self, rows: list[Shaped[Array, "slices positions"]]) -> list[Shaped[Array, "slices positions"]]:
        """Values of all springs from the two rows of those that can touch; zero where a spring cannot touch."""
        none = jnp.zeros_like(rows[0])
        return [
            rows[i % 2] if self.alone(i) else jnp.where(flag, rows[i % 2], none) for i, flag in enumerate(self.chosen)
        ]

    def matrix(self, whole: Float[Array, "springs springs positions"]) -> Float[Array, "2 2 slices positions"]:
        """The rows and columns of the springs that can touch, of a symmetric matrix."""
        wide = whole[:, :, None]
        own = self.rows(jnp.stack([wide[i, i] for i in range(len(wide))]))
        across = self._chosen([self._chosen(list(row[1::2]), 1) for row in wide[::2]], 0)
        across = jnp.broadcast_to(across, own[0].shape)
        return jnp.stack([jnp.stack([own[0], across]), jnp.stack([across, own[1]])])

    def alone(self, spring: int) -> bool:
        """Whether a spring has no other one to alternate with."""
        return len(self.chosen[spring % 2 :: 2]) == 1

    def together(self, one: int, other: int) -> Flags | bool:
        """Where two springs can both touch."""
        if one != other and (one - other) % 2 == 0:
            return False
        flags = [self.chosen[i] for i in {one, other} if not self.alone(i)]
        return flags[0] & flags[-1] if flags else True

    def _chosen(self, rows: list[Float[Array, "..."]], first: int) -> Float[Array, "..."]:
        found = rows[0]
        for row, flag in zip(rows[1:], self.chosen[first + 2 :: 2]):
            found = jnp.where(flag, row, found)
        return found


def nearest(distance: Float[Array, "springs slices positions"]) -> Alternation:
    """The nearest one of the even and of the odd springs."""
    first = [jnp.argmin(distance[start::2], axis=0) for start in (0, 1)]
    return Alternation(jnp.stack([first[i % 2] == i // 2 for i in range(len(distance))]))
