"""Slices of a contact problem that feel each other, by few modes over the slices.

The deflection of spring p in slice s under all line loads is

    y[p, s] = sum_j C[p, j] ( rest q[j, s] + sum_{k, l, t} V[s, k] M[k, l] V[t, l] q[j, t] )
            + lever[p] sum_{k, l, t} R[s, k] H[k, l] R[t, l] sum_j lever[j] q[j, t]:

springs on bodies whose deflection at one place is felt at others, on a support that gives way under the force of all
springs of a slice.
"""

from functools import reduce
from operator import add
from typing import NamedTuple

import equinox as eqx
from jaxtyping import Array, Float

from .elimination import small_inverse
from .stored import stored

Rows = list[Float[Array, "slices positions"]]
Springs = Float[Array, "pairs pairs positions"]


class Held(NamedTuple):
    """What an elimination needs besides the coupling itself.

    Attributes:
        local: rest C.
        inverse: of C.
        share_inverse: of M.
    """

    local: Springs
    inverse: Springs
    share_inverse: Float[Array, "modes modes"]


class Coupling(eqx.Module):
    """How slices of equal weight feel each other.

    Attributes:
        modes: V, orthonormal, the constant first.
        share: M, symmetric and positive definite.
        rest: what all that is orthogonal to the modes has of C.
        support_modes: R, orthonormal, the constant first; None without a support.
        support: H, symmetric and positive semi-definite, the deflection under line loads; None without a support.
        held: for eliminations, see `with_inverses`; None before.
    """

    modes: Float[Array, "slices modes"]
    share: Float[Array, "modes modes"]
    rest: Float[Array, ""]
    support_modes: Float[Array, "slices bends"] | None = None
    support: Float[Array, "bends bends"] | None = None
    held: Held | None = None

    def deflection(self, compliance: Springs, lever: Float[Array, "pairs positions"], load: Rows) -> Rows:
        """y under line loads."""
        uniform = [stored(sum(c[None] * q for c, q in zip(row, load))) for row in compliance]
        spread = self.modes @ self.share
        modal = [stored(onto(self.modes, row)) for row in uniform]
        result = [stored(self.rest * row + along(spread, each)) for row, each in zip(uniform, modal)]
        bent = self.support_deflection(lever, load)
        return result if bent is None else [row + height[None] * bent for row, height in zip(result, lever)]

    def support_deflection(
        self, lever: Float[Array, "pairs positions"], load: Rows
    ) -> Float[Array, "slices positions"] | None:
        """By how much the support gives way under line loads, per unit of lever; None without a support."""
        if self.support is None or self.support_modes is None:
            return None
        force = sum(height[None] * q for height, q in zip(lever, load))
        return along(self.support_modes, along(self.support, onto(self.support_modes, force)))


def with_inverses(coupling: Coupling, compliance: Springs) -> Coupling:
    """The coupling ready for eliminations; C has to be positive definite."""
    share = small_inverse(coupling.share[..., None])[..., 0]
    held = Held(coupling.rest * compliance, small_inverse(compliance), share)
    return eqx.tree_at(lambda c: c.held, coupling, held, is_leaf=lambda leaf: leaf is None)


# Sums over few terms rather than products of matrices: compilers fuse them, and turn no array around for them.


def onto(
    modes: Float[Array, "slices modes"], rows: Float[Array, "... slices positions"]
) -> Float[Array, "modes ... positions"]:
    """V^T rows."""
    return reduce(add, [_outer(weight, rows[..., s, :]) for s, weight in enumerate(modes)])


def along(
    modes: Float[Array, "slices modes"], modal: Float[Array, "modes ... positions"]
) -> Float[Array, "slices ... positions"]:
    """V modal."""
    return reduce(add, [_outer(weight, value) for weight, value in zip(modes.T, modal)])


def _outer(weight: Float[Array, " modes"], row: Float[Array, "... positions"]) -> Float[Array, "modes ... positions"]:
    return weight.reshape(-1, *[1] * row.ndim) * row[None]
