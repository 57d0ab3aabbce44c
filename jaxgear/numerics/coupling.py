"""Coupled slices of a contact problem, by few modes over the slices, and the elimination of their unknowns.

The deflection of spring p in slice s under all line loads is

    y[p, s] = sum_j C[p, j] ( rest q[j, s] + sum_{k, l, t} V[s, k] M[k, l] V[t, l] q[j, t] )
            + lever[p] sum_{k, l, t} R[s, k] H[k, l] R[t, l] sum_j lever[j] q[j, t]:

springs on bodies whose deflection at one place is felt at others, on a support that deflects under the force of all
springs of a slice. Where the two bodies that make up C spread loads in their own way each, a second sum of this form
follows, with the C of one of them and by how much its M and rest differ. Of slices of unequal weight, w times the line
load of slice t stands for q in the sums over t, w being the weight over the mean of all.

Every slice is eliminated on its own, as if nothing but the rest of the compliance held it: A = rest C + slope. With the
deflections p of the modes as unknowns, and b those of the support with the common approach in the first one, the active
springs obey

    A q = known + X b - V p,     (C^-1 x M^-1) p = V^T q,     b = sqrt(n) approach e_1 - H z,     z = X^T q,

X being the levers times the support's modes. Where slices differ in weight, w q is solved for in place of q, by
w A^-1 in place of A^-1, w being the weight over the mean of all. So p follows from the symmetric, positive definite
matrix C^-1 x M^-1 + V^T A^-1 V, a few unknowns at every position, and what is left are the equations of the support.
What several loops read ends with a division, for compilers to store it.
"""

from functools import reduce
from operator import add
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .alternation import Alternation
from .dense import solve_dense
from .elimination import Curve, Factors, Load, Rows, Slopes, inverse_of, over_slices, small_inverse
from .safe import stored, unit

Springs = Float[Array, "springs springs *own positions"]
Blocks = Float[Array, "modes modes springs springs positions"]
Levers = Float[Array, "pairs *each positions"]


class Held(NamedTuple):
    """Inverses and products of a coupling that its eliminations share.

    Attributes:
        local: rest C, summed over both bodies, of the springs that can touch; with an axis of slices where they are
            scaled.
        inverse: inverse of C.
        share_inverse: inverse of M.
        modal: inverse of the sum of M x C over both bodies, where there is an `other`; None without one.
    """

    local: Float[Array, "pairs pairs *own positions"]
    inverse: Springs
    share_inverse: Float[Array, "modes modes"]
    modal: Blocks | None = None

    @property
    def local_slices(self) -> Float[Array, "pairs pairs #slices positions"]:
        """`local` with an axis of slices."""
        return self.local if self.local.ndim == 4 else self.local[:, :, None]

    def column(self, mode: int) -> Float[Array, "rows springs springs positions"]:
        """Inverse of M x C in the columns of a mode, from the rows of this mode on."""
        if self.modal is not None:
            return self.modal[mode:, mode]
        return self.share_inverse[mode:, mode, None, None, None] * self.inverse[None]


class Other(eqx.Module):
    """Difference between the load spreading of one of two bodies and that of the other.

    Attributes:
        compliance: C of the body that differs.
        share, rest: its M and rest, minus those of `SliceCoupling`; the sum over both bodies is positive definite.
    """

    compliance: Springs
    share: Float[Array, "modes modes"]
    rest: Float[Array, ""]


class SliceCoupling(eqx.Module):
    """How slices are elastically coupled.

    Attributes:
        modes: V, orthonormal, the constant first; with the weights w of the slices, V^T w V = 1, where they differ.
        share: M, symmetric and positive definite.
        rest: share of C that acts on loads orthogonal to the modes, slice by slice.
        support_modes: R, orthonormal likewise, the constant first; None without a support.
        support: H, symmetric and positive semi-definite, the deflection under line loads; None without a support.
        crosswise: whether H only joins the even deflection with one other shape, zero but off its diagonal.
        other: of two bodies that spread loads in their own way each; None where both do alike.
        weight: w of the slices, over their mean; None where all are equal.
        scale: D, of loads and deflections of every spring, where a body is stiffer at one place than at another: D C D
            stands for C; None where it is not. Of the springs that can touch alone, where there are others.
        alternation: which springs can touch, where only some can: loads, deflections, levers and scales then are those
            of these two; None where all can.
        held: for eliminations, see `with_inverses`; None before.
    """

    modes: Float[Array, "slices modes"]
    share: Float[Array, "modes modes"]
    rest: Float[Array, ""]
    support_modes: Float[Array, "slices bends"] | None = None
    support: Float[Array, "bends bends"] | None = None
    crosswise: bool = eqx.field(static=True, default=False)
    other: Other | None = None
    weight: Float[Array, " slices"] | None = None
    scale: Float[Array, "pairs slices positions"] | None = None
    alternation: Alternation | None = None
    held: Held | None = None

    def deflection(self, compliance: Springs, lever: Levers, load: Rows) -> Rows:
        """y under line loads."""
        scaled = self.springs(self.scaled(load))
        result = self._spread(compliance, self.share, self.rest, scaled)
        if self.other is not None:
            more = self._spread(self.other.compliance, self.other.share, self.other.rest, scaled)
            result = [row + added for row, added in zip(result, more)]
        result = self.scaled(self.touching(result))
        bent = self.support_deflection(lever, load)
        return result if bent is None else [row + height * bent for row, height in zip(result, over_slices(lever))]

    def scaled(self, rows: Rows) -> Rows:
        """Rows of the springs times their scale."""
        return rows if self.scale is None else [d * row for d, row in zip(self.scale, rows)]

    def springs(self, rows: Rows) -> Rows:
        """Rows of all springs from rows of those that can touch."""
        return rows if self.alternation is None else self.alternation.springs(rows)

    def touching(self, springs: Rows) -> Rows:
        """Rows of the springs that can touch from rows of all springs."""
        return springs if self.alternation is None else list(self.alternation.rows(jnp.stack(springs)))

    def own(self, compliance: Springs) -> Float[Array, "pairs #slices positions"]:
        """Compliance of every spring on its own."""
        own = over_slices(jnp.stack([compliance[i, i] for i in range(len(compliance))]))
        own = own if self.alternation is None else self.alternation.rows(own)
        return own if self.scale is None else own * self.scale**2

    def _spread(self, compliance: Springs, share: Float[Array, "modes modes"], rest, load: Rows) -> Rows:
        uniform = [stored(sum(c[None] * q for c, q in zip(row, load))) for row in compliance]
        spread = self.modes @ share
        modal = [stored(onto(self.modes, self.weighted(row))) for row in uniform]
        return [stored(rest * row + along(spread, each)) for row, each in zip(uniform, modal)]

    def weighted(self, row: Float[Array, "slices positions"]) -> Float[Array, "slices positions"]:
        """w times values of the slices."""
        return row if self.weight is None else self.weight[:, None] * row

    def support_deflection(self, lever: Levers, load: Rows) -> Float[Array, "slices positions"] | None:
        """Deflection of the support under line loads, per unit of lever; None without a support."""
        if self.support is None or self.support_modes is None:
            return None
        force = self.weighted(sum(height * q for height, q in zip(over_slices(lever), load)))
        return along(self.support_modes, along(self.support, onto(self.support_modes, force)))


def with_inverses(coupling: SliceCoupling, compliance: Springs) -> SliceCoupling:
    """The coupling ready for eliminations; C has to be positive definite."""
    share = small_inverse(coupling.share[..., None])[..., 0]
    held = Held(coupling.rest * compliance, small_inverse(compliance), share)
    if coupling.other is not None:
        other = coupling.other
        both = _blocks(coupling.share, compliance) + _blocks(other.share, other.compliance)
        held = held._replace(local=held.local + other.rest * other.compliance, modal=_block_inverse(both))
    if coupling.alternation is not None:
        held = held._replace(local=coupling.alternation.matrix(held.local))
    if coupling.scale is not None:
        of_slices = coupling.scale[:, None] * coupling.scale[None]
        held = held._replace(local=held.local_slices * of_slices)
    return eqx.tree_at(lambda c: c.held, coupling, held, is_leaf=lambda leaf: leaf is None)


def _blocks(share: Float[Array, "modes modes"], compliance: Springs) -> Blocks:
    return share[:, :, None, None, None] * compliance[None, None]


def _block_inverse(matrix: Blocks) -> Blocks:
    """Inverse of a symmetric, positive definite block matrix at every position, swept block by block."""

    def sweep(k, matrix):
        inverse = small_inverse(matrix[k, k])
        row = jnp.einsum("ijn,mjkn->mikn", inverse, matrix[k])
        swept = matrix - jnp.einsum("lijn,mjkn->lmikn", matrix[:, k], row)
        column = jnp.einsum("lijn,jkn->likn", matrix[:, k], inverse)
        return swept.at[k].set(row).at[:, k].set(column).at[k, k].set(-inverse)

    return -jax.lax.fori_loop(0, len(matrix), sweep, matrix)


# Sums over few terms, one by one, rather than products of matrices and reductions of an axis: compilers fuse them into
# one loop over the positions, and turn no array around for them.


# Slices in one turn of a loop, so that programs do not grow with further ones: 33 slices compile as quickly as 11 (in
# 0.64 of the time), and run for 1.4 times as long as without a loop.
_AT_ONCE = 11


def summed(rows: Float[Array, "..."], axis: int = 0) -> Float[Array, "..."]:
    """The sum over a short axis."""
    axis %= rows.ndim
    each = [jax.lax.slice_in_dim(rows, i, i + 1, axis=axis) for i in range(rows.shape[axis])]
    return jnp.squeeze(reduce(add, each), axis)


def onto(
    modes: Float[Array, "slices modes"], rows: Float[Array, "... slices positions"]
) -> Float[Array, "modes ... positions"]:
    """V^T rows."""
    turns, left = divmod(len(modes), _AT_ONCE)
    if turns == 1:
        turns, left = 0, len(modes)

    def unrolled(first: Array | int, count: int) -> Array:
        some, of = (jax.lax.dynamic_slice_in_dim(x, first, count, axis) for x, axis in ((modes, 0), (rows, -2)))
        return summed(some.T.reshape(-1, *[1] * (of.ndim - 2), count, 1) * of[None], -2)

    parts = [unrolled(turns * _AT_ONCE, left)] if left else []
    if turns:
        nothing = jnp.zeros((modes.shape[1], *rows.shape[:-2], rows.shape[-1]), rows.dtype)
        parts.append(jax.lax.fori_loop(0, turns, lambda i, sums: sums + unrolled(i * _AT_ONCE, _AT_ONCE), nothing))
    return reduce(add, parts)


def along(
    modes: Float[Array, "slices modes"], modal: Float[Array, "modes ... positions"]
) -> Float[Array, "slices ... positions"]:
    """V modal."""
    return summed(modes.reshape(*modes.shape, *[1] * (modal.ndim - 1)) * modal[None], 1)


Bends = Float[Array, "bends positions"]
Inverse = list[list[Float[Array, "slices positions"]]]  # of every slice on its own, by springs
Sides = Float[Array, "sides springs positions"]  # right sides of the modal system, of one mode


class _Block(NamedTuple):
    """The columns of one mode in the block elimination of the modal system, L D L^T; from this mode on.

    Attributes:
        scaled: L D.
        lower: L, below the diagonal.
        inverse: of D.
    """

    scaled: Float[Array, "modes springs springs positions"]
    lower: Float[Array, "below springs springs positions"]
    inverse: Float[Array, "springs springs positions"]


class CoupledFactors(NamedTuple):
    """The active system, eliminated.

    Attributes:
        coupling: of the slices.
        lever: of the springs.
        inverse: of the matrices A, zero where springs are apart, by springs; with the weights of the slices.
        blocks: of the modal system.
        bent: L^-1 V^T A^-1 X by mode, and D^-1 times it.
        force: z under unit b, symmetric.
        yielding: b under unit H z, and under unit approach in its first column; see `_yielding`.
        per_slope: load per opening of every spring, about.
    """

    coupling: SliceCoupling
    lever: Levers
    inverse: Inverse
    blocks: list[_Block]
    bent: tuple[list[Sides], list[Sides]]
    force: Float[Array, "bends bends positions"]
    yielding: Float[Array, "bends bends positions"]
    per_slope: Slopes


class Response(NamedTuple):
    """Line loads, common approach, and what presses the slices besides what is known: X b - V p."""

    load: Rows
    approach: Curve
    pressed: Rows


def couple(coupling: SliceCoupling, lever: Levers, own: Factors) -> CoupledFactors:
    """Eliminates what couples the slices.

    Args:
        coupling: with its inverses.
        lever: what a spring closes per unit of common approach.
        own: elimination of every slice with the local compliance and the slopes of the springs.
    """
    inverse = inverse_of(own)
    if coupling.weight is not None:
        inverse = [[coupling.weighted(x) for x in row] for row in inverse]
    modal = _products(coupling, _scaled_both(coupling, inverse))
    blocks = _eliminated(coupling, modal)
    right, force = _of_support(coupling, lever, inverse, modal)
    bent = _ahead(blocks, right)
    force = force - _joined(bent[0], bent[1])
    yielding = _yielding(coupling.support, force)
    return CoupledFactors(coupling, lever, inverse, blocks, bent, force, yielding, own.per_slope)


def _scaled_both(coupling: SliceCoupling, inverse: Inverse) -> Inverse:
    """D inverse D, with the scales of the springs."""
    if coupling.scale is None:
        return inverse
    return [[d * x * other for x, other in zip(row, coupling.scale)] for d, row in zip(coupling.scale, inverse)]


def _products(coupling: SliceCoupling, rows: Inverse) -> list[Float[Array, "_ springs springs positions"]]:
    """V^T rows V: of every mode with itself and those after it, by mode."""
    modes, alternation = coupling.modes, coupling.alternation
    springs = range(len(rows) if alternation is None else len(alternation.chosen))
    half = [(i, j) for i in springs for j in range(i + 1)]
    if alternation is None:
        stack = jnp.stack([rows[i][j] for i, j in half])
    else:
        stack = jnp.stack([jnp.where(alternation.together(i, j), rows[i % 2][j % 2], 0.0) for i, j in half])
    place = np.array([[half.index((max(i, j), min(i, j))) for j in springs] for i in springs])
    return [onto(mode[:, None] * modes[:, k:], stack)[:, place] for k, mode in enumerate(modes.T)]


def _eliminated(coupling: SliceCoupling, modal: list[Float[Array, "_ springs springs positions"]]) -> list[_Block]:
    held = coupling.held
    blocks: list[_Block] = []
    assert held is not None  # set by `with_inverses` before every elimination
    for mode in range(len(modal)):
        scaled = modal[mode] + held.column(mode)
        for before, block in enumerate(blocks):
            ahead = mode - before
            scaled = scaled - _times(block.lower[ahead - 1 :], jnp.swapaxes(block.scaled[ahead], 0, 1))
        scaled = scaled / unit(scaled)
        inverse = small_inverse(scaled[0])
        lower = _times(scaled[1:], inverse)
        blocks.append(_Block(scaled, lower / unit(lower), inverse))
    return blocks


def _times(first: Float[Array, "... rows pairs positions"], second: Float[Array, "pairs pairs positions"]):
    """Products of small matrices at every position."""
    wide = second.reshape(*[1] * (first.ndim - 2), *second.shape)
    return summed(first[..., None, :] * wide, -3)


def _of_support(
    coupling: SliceCoupling, lever: Levers, inverse, modal
) -> tuple[list[Sides], Float[Array, "bends bends positions"]]:
    """V^T A^-1 X by mode, and X^T A^-1 X."""
    shapes = coupling.support_modes
    if shapes is None and coupling.scale is None and coupling.alternation is None:
        # what the common approach presses is the first mode
        even = reduce(add, [modal[0][:, :, i] * height[None, None] for i, height in enumerate(lever)])
        return list(even[:, None]), reduce(add, list(even[0] * lever))[None, None]
    heights = over_slices(lever)
    shapes = _constant(coupling) if shapes is None else shapes
    pressed = [sum(x * height for x, height in zip(row, heights)) for row in inverse]
    modal_pressed = jnp.stack(coupling.springs(coupling.scaled(pressed)))
    right = [onto(mode[:, None] * shapes, modal_pressed) for mode in coupling.modes.T]
    force = sum(row * height for row, height in zip(pressed, heights))
    return right, jnp.stack([onto(shape[:, None] * shapes, force) for shape in shapes.T])


def _ahead(blocks: list[_Block], right: list[Sides]) -> tuple[list[Sides], list[Sides]]:
    """L^-1 right, and D^-1 times it."""
    whole: list[Sides] = []
    divided: list[Sides] = []
    for mode, value in enumerate(right):
        for before, block in enumerate(blocks[:mode]):
            value = value - _times(divided[before][:, None], jnp.swapaxes(block.scaled[mode - before], 0, 1))[:, 0]
        # right sides may be tangents: what makes a compiler store them must not depend on them
        kept = unit(blocks[mode].inverse[0])[None]
        whole.append(value / kept)
        divided.append(_times(whole[-1][:, None], blocks[mode].inverse)[:, 0] / kept)
    return whole, divided


def _joined(
    first: list[Sides], second: list[Float[Array, "others springs positions"]]
) -> Float[Array, "sides others positions"]:
    """Sum over modes and springs."""
    return reduce(add, [summed(a[:, None] * b[None], 2) for a, b in zip(first, second)])


def _back(
    blocks: list[_Block], divided: list[Float[Array, "springs positions"]]
) -> list[Float[Array, "springs positions"]]:
    """Solution of the modal system by mode, from D^-1 L^-1 of its right side."""
    found: dict[int, Float[Array, "springs positions"]] = {}
    for mode in reversed(range(len(blocks))):
        value = divided[mode]
        for later in range(mode + 1, len(blocks)):
            value = value - summed(blocks[mode].lower[later - mode - 1] * found[later][:, None])
        found[mode] = value / unit(blocks[mode].inverse[0])
    return [found[mode] for mode in range(len(blocks))]


def respond(
    weight: Float[Array, " slices"],
    factors: CoupledFactors,
    known: Rows,
    *,
    load: Load | None = None,
    approach: Curve | None = None,
) -> Response:
    """Solves for a load or for an approach; see the top."""
    coupling = factors.coupling
    inside = [sum(x * row for x, row in zip(rows, known)) for rows in factors.inverse]  # A^-1 known
    kept = unit(factors.inverse[0][0])
    within = [row / kept for row in inside]
    stacked = jnp.stack(coupling.springs(coupling.scaled(within)))
    # mode by mode: compilers take a sum for all modes in every loop that reads one of them
    _, divided = _ahead(factors.blocks, [onto(mode[:, None], stacked) for mode in coupling.modes.T])
    heights = over_slices(factors.lever)
    force = sum(height * row for height, row in zip(heights, within))
    shapes = _constant(coupling) if coupling.support_modes is None else coupling.support_modes
    carried = onto(shapes, force) - _joined(factors.bent[0], divided)[:, 0]
    mean = weight[0] if coupling.weight is None else weight[0] / coupling.weight[0]
    bends, approach = _bends(factors, carried, None if load is None else load / mean, approach)
    eliminated = [a[0] + summed(b * bends[:, None]) for a, b in zip(divided, factors.bent[1])]
    deflected = along(coupling.modes, jnp.stack(_back(factors.blocks, eliminated)))
    even = along(shapes, bends)
    yielded = coupling.scaled(coupling.touching([deflected[:, i] for i in range(deflected.shape[1])]))
    pressed = [height * even - back for height, back in zip(heights, yielded)]
    pressed = [row / kept for row in pressed]
    loads = [row + sum(x * value for x, value in zip(rows, pressed)) for row, rows in zip(within, factors.inverse)]
    if coupling.weight is not None:
        loads = [row / coupling.weight[:, None] for row in loads]
    return Response(loads, approach, pressed)


def _constant(coupling: SliceCoupling) -> Float[Array, "slices 1"]:
    """The even deflection of all slices, orthonormal: the support modes of slices without a support."""
    count = len(coupling.modes)
    return jnp.full((count, 1), count**-0.5, coupling.modes.dtype)


def stiffness(weight: Float[Array, " slices"], factors: CoupledFactors) -> Curve:
    """Load per unit of approach."""
    return jnp.sum(weight) * summed(factors.force[0] * factors.yielding[:, 0])


def _bends(factors: CoupledFactors, carried: Bends, total, approach: Curve | None) -> tuple[Bends, Curve]:
    """b and the approach, for that or for a total of the line loads; `carried` is z at b = 0."""
    root = factors.coupling.modes.shape[0] ** 0.5
    still, rise = _still(factors, carried), factors.yielding[:, 0]
    if approach is None:
        missing = total / root - carried[0] - summed(factors.force[0] * still)
        approach = missing / (root * summed(factors.force[0] * rise))
    return still + root * approach[None] * rise, approach


def _still(factors: CoupledFactors, carried: Bends) -> Bends:
    """b without approach: (1 + H force) b = -H carried."""
    support = factors.coupling.support
    if support is None:
        return jnp.zeros_like(carried)
    bent = jnp.tensordot(support, carried, 1)
    return -summed(factors.yielding * bent[None], 1)


def _yielding(support: Float[Array, "bends bends"] | None, force: Float[Array, "bends bends positions"]):
    """Inverse of 1 + H force, which is not symmetric, at every position."""
    if support is None:
        return jnp.ones_like(force)
    matrix = jnp.eye(len(support), dtype=force.dtype)[..., None] + jnp.tensordot(support, force, 1)
    return jax.vmap(solve_dense, (-1, None), -1)(matrix, jnp.eye(len(support), dtype=force.dtype))
