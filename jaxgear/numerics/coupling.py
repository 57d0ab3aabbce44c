"""Coupled slices of a contact problem, by few modes over the slices.

The deflection of spring p in slice s under all line loads is

    y[p, s] = sum_j C[p, j] ( rest q[j, s] + sum_{k, l, t} V[s, k] M[k, l] V[t, l] q[j, t] )
            + lever[p] sum_{k, l, t} R[s, k] H[k, l] R[t, l] sum_j lever[j] q[j, t]:

springs on bodies whose deflection at one place is felt at others, on a support that gives way under the force of all
springs of a slice. Where the two bodies that make up C spread loads in their own way each, a second sum of this form
follows, with the C of one of them and by how much its M and rest differ. Of slices of unequal weight, w times the line
load of slice t stands for q in the sums over t, w being the weight over the mean of all.
"""

from functools import reduce
from operator import add
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .elimination import small_inverse
from .stored import stored

Rows = list[Float[Array, "slices positions"]]
Springs = Float[Array, "pairs pairs positions"]
Blocks = Float[Array, "modes modes pairs pairs positions"]


class Held(NamedTuple):
    """What an elimination needs besides the coupling itself.

    Attributes:
        local: rest C.
        inverse: of C.
        share_inverse: of M.
        modal: inverse of M x C where a second body feels loads otherwise; None without one.
    """

    local: Springs
    inverse: Springs
    share_inverse: Float[Array, "modes modes"]
    modal: Blocks | None = None

    def column(self, mode: int) -> Float[Array, "rows pairs pairs positions"]:
        """Inverse of M x C in the columns of a mode, from the rows of this mode on."""
        if self.modal is not None:
            return self.modal[mode:, mode]
        return self.share_inverse[mode:, mode, None, None, None] * self.inverse[None]


class Other(eqx.Module):
    """By how much one of two bodies spreads loads otherwise than the other.

    Attributes:
        compliance: of that body.
        share, rest: differences of M and of the rest; what both bodies make together is positive definite.
    """

    compliance: Springs
    share: Float[Array, "modes modes"]
    rest: Float[Array, ""]


class Coupling(eqx.Module):
    """How slices are elastically coupled.

    Attributes:
        modes: V, orthonormal, the constant first; with the weights w of the slices, V^T w V = 1, where they differ.
        share: M, symmetric and positive definite.
        rest: what all that is orthogonal to the modes has of C.
        support_modes: R, orthonormal likewise, the constant first; None without a support.
        support: H, symmetric and positive semi-definite, the deflection under line loads; None without a support.
        other: of two bodies that spread loads in their own way each; None where both do alike.
        weight: w of the slices, over their mean; None where all are equal.
        held: for eliminations, see `with_inverses`; None before.
    """

    modes: Float[Array, "slices modes"]
    share: Float[Array, "modes modes"]
    rest: Float[Array, ""]
    support_modes: Float[Array, "slices bends"] | None = None
    support: Float[Array, "bends bends"] | None = None
    other: Other | None = None
    weight: Float[Array, " slices"] | None = None
    held: Held | None = None

    def deflection(self, compliance: Springs, lever: Float[Array, "pairs positions"], load: Rows) -> Rows:
        """y under line loads."""
        result = self._spread(compliance, self.share, self.rest, load)
        if self.other is not None:
            more = self._spread(self.other.compliance, self.other.share, self.other.rest, load)
            result = [row + added for row, added in zip(result, more)]
        bent = self.support_deflection(lever, load)
        return result if bent is None else [row + height[None] * bent for row, height in zip(result, lever)]

    def _spread(self, compliance: Springs, share: Float[Array, "modes modes"], rest, load: Rows) -> Rows:
        uniform = [stored(sum(c[None] * q for c, q in zip(row, load))) for row in compliance]
        spread = self.modes @ share
        modal = [stored(onto(self.modes, self.weighted(row))) for row in uniform]
        return [stored(rest * row + along(spread, each)) for row, each in zip(uniform, modal)]

    def weighted(self, row: Float[Array, "slices positions"]) -> Float[Array, "slices positions"]:
        """w times values of the slices."""
        return row if self.weight is None else self.weight[:, None] * row

    def support_deflection(
        self, lever: Float[Array, "pairs positions"], load: Rows
    ) -> Float[Array, "slices positions"] | None:
        """By how much the support gives way under line loads, per unit of lever; None without a support."""
        if self.support is None or self.support_modes is None:
            return None
        force = self.weighted(sum(height[None] * q for height, q in zip(lever, load)))
        return along(self.support_modes, along(self.support, onto(self.support_modes, force)))


def with_inverses(coupling: Coupling, compliance: Springs) -> Coupling:
    """The coupling ready for eliminations; C has to be positive definite."""
    share = small_inverse(coupling.share[..., None])[..., 0]
    held = Held(coupling.rest * compliance, small_inverse(compliance), share)
    if coupling.other is not None:
        other = coupling.other
        both = _blocks(coupling.share, compliance) + _blocks(other.share, other.compliance)
        held = held._replace(local=held.local + other.rest * other.compliance, modal=_block_inverse(both))
    return eqx.tree_at(lambda c: c.held, coupling, held, is_leaf=lambda leaf: leaf is None)


def _blocks(share: Float[Array, "modes modes"], compliance: Springs) -> Blocks:
    return share[:, :, None, None, None] * compliance[None, None]


def _block_inverse(matrix: Blocks) -> Blocks:
    """Of a symmetric, positive definite matrix at every position, swept block by block."""

    def sweep(k, matrix):
        inverse = small_inverse(matrix[k, k])
        row = jnp.einsum("ijn,mjkn->mikn", inverse, matrix[k])
        swept = matrix - jnp.einsum("lijn,mjkn->lmikn", matrix[:, k], row)
        column = jnp.einsum("lijn,jkn->likn", matrix[:, k], inverse)
        return swept.at[k].set(row).at[:, k].set(column).at[k, k].set(-inverse)

    return -jax.lax.fori_loop(0, len(matrix), sweep, matrix)


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
