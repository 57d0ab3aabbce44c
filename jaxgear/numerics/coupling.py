"""Coupled slices of a contact problem, by few modes over the slices, and the elimination of their unknowns.

Beside what every slice deflects on its own (`ContactProblem.compliance`), the deflection of spring p in slice s under
all line loads is

    y[p, s] = D[p, s] sum_{b, j, k, l, t} V[s, k] M_b[k, l] C_b[p, j] V[t, l] D[j, t] w[t] q[j, t]
            + lever[p, s] sum_{k, l, t} R[s, k] H[k, l] R[t, l] w[t] sum_j lever[j, t] q[j, t]:

springs on bodies b whose deflection at one place is felt at others, on a support that deflects under the force of all
springs of a slice; w is the width of a slice. There may be more places p on the bodies than
springs in a slice: spring r then touches at one of the places r, r + springs, ..., and D is zero at the others.

Every slice is eliminated on its own, as if nothing but its own compliance held it: A = own compliance + slope. With the
deflections m of the modes as unknowns, and b those of the support with the common approach in the first one, the active
springs obey

    A q = known + X b - D V m,     K^-1 m = (D V)^T w q,     b = sqrt(n) approach e_1 - H z,     z = X^T w q,

K being the sum of M_b x C_b over the bodies and X the levers times the support's modes. So m follows from the
symmetric, positive definite matrix K^-1 + (D V)^T w A^-1 D V, a few unknowns at every position, and what is left are
the equations of the support. What several loops read ends with a division, for compilers to store it.
"""

from collections.abc import Sequence
from functools import reduce
from operator import add
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from .dense import solve_dense
from .safe import stored, unit

Rows = list[Float[Array, "slices positions"]]
Slopes = list[Float[Array, "#slices positions"]]  # one row where a slope is the same in every slice
Curve = Float[Array, " positions"]
Active = Sequence[Bool[Array, "slices positions"]]
Load = Float[Array, ""] | Curve  # a scalar where it is the same everywhere
Inverse = list[Rows]  # of a matrix of every slice, by springs


def inverse_of(
    compliance: Float[Array, "springs springs #slices positions"], active: Active, slope: Slopes
) -> tuple[Inverse, Slopes]:
    """Inverses of C + slope of the active springs, zero where springs are apart, and load per opening of all, about.

    Args:
        compliance: C.
        active: True for springs in contact, (slices, positions) each.
        slope: dh/dq of every spring, (slices, positions) or (1, positions) each.
    """
    mask = [flag.astype(compliance.dtype) for flag in active]
    lower = [
        [*(mask[i] * mask[j] * compliance[i, j] for j in range(i)), compliance[i, i] + slope[i]]
        for i in range(len(mask))
    ]
    return _bordered(lower, mask)


def _bordered(lower: list[list[Array]], mask: Sequence[Array | float]) -> tuple[list[list[Array]], list[Array]]:
    """Inverse of a symmetric, positive definite matrix, _bordered row by row, and the inverse pivots.

    Args:
        lower: its rows up to the diagonal.
        mask: mask of every row; what belongs to those of zero, which have to be zero beside the diagonal, is left out.
    """
    inverse: list[list[Array]] = []
    pivots: list[Array] = []
    for (*border, own), kept in zip(lower, mask):
        across = [sum(a * b for a, b in zip(row, border)) for row in inverse]
        pivots.append(1 / (own - sum(a * b for a, b in zip(across, border))))
        last = kept * pivots[-1]
        beside = [-a * last for a in across]
        inverse = [[*(a - x * b for a, x in zip(row, across)), b] for row, b in zip(inverse, beside)] + [
            [*beside, last]
        ]
    return inverse, pivots


def small_inverse(matrix: Float[Array, "rows rows positions"]) -> Float[Array, "rows rows positions"]:
    """Inverse of a symmetric, positive definite matrix at every position."""
    count = len(matrix)
    inverse, _ = _bordered([[matrix[i, j] for j in range(i + 1)] for i in range(count)], [1.0] * count)
    whole = jnp.stack([jnp.stack(row) for row in inverse])
    return whole / unit(whole)


Places = Float[Array, "places places positions"]
Blocks = Float[Array, "modes modes places places positions"]
Levers = Float[Array, "springs #slices positions"]
Weight = Float[Array, " slices"]


class Body(NamedTuple):
    """How a body spreads the loads of springs.

    Attributes:
        compliance: C, under a load that is the same in all slices.
        share: M, symmetric and positive definite; the share of C that acts on the modes beyond `rest`, per width.
        rest: share of C that acts on every slice alone.
    """

    compliance: Places
    share: Float[Array, "modes modes"]
    rest: Float[Array, ""]


class SliceCoupling(eqx.Module):
    """How slices are elastically coupled.

    Attributes:
        modes: V, the constant first; V^T w V is the mean of w over the slices.
        bodies: that the springs act on; K, the sum over all, is positive definite.
        scale: D, of loads and deflections at every place, where a body is stiffer at one than at another; zero where a
            spring touches elsewhere. None for one throughout.
        support_modes: R, orthonormal likewise, the constant first; None without a support.
        support: H, symmetric and positive semi-definite, the deflection under loads; None without a support.
        inverse: inverse of K, for eliminations, see `with_inverse`; None before.
    """

    modes: Float[Array, "slices modes"]
    bodies: tuple[Body, ...]
    scale: Float[Array, "places slices positions"] | None = None
    support_modes: Float[Array, "slices bends"] | None = None
    support: Float[Array, "bends bends"] | None = None
    inverse: Blocks | None = None

    def local(self, springs: int) -> Float[Array, "springs springs #slices positions"]:
        """Compliance of every uncoupled slice for a number of springs per slice."""
        local = reduce(add, [body.rest * body.compliance for body in self.bodies])[:, :, None]
        if self.scale is None:
            return local
        local = local * self.scale[:, None] * self.scale[None]
        rows = [[jnp.sum(local[i::springs, j::springs], (0, 1)) for j in range(springs)] for i in range(springs)]
        return jnp.stack([jnp.stack(row) for row in rows])

    def own(self, weight: Weight, springs: int) -> Float[Array, "springs #slices positions"]:
        """Deflection of every spring under an even load of its own, beyond that of the slices on their own."""
        even = reduce(add, [jnp.mean(weight) * body.share[0, 0] * body.compliance for body in self.bodies])
        own = [even[i, i][None] for i in range(len(even))]
        return jnp.stack(own if self.scale is None else self.springs(list(self.scale * jnp.stack(own)), springs))

    def places(self, rows: Rows) -> Rows:
        """Loads at all places from those of the springs."""
        return rows if self.scale is None else [d * rows[i % len(rows)] for i, d in enumerate(self.scale)]

    def springs(self, places: Rows, count: int) -> Rows:
        """Deflections of so many springs from those of all places."""
        if self.scale is None:
            return places
        rows = [d * row for d, row in zip(self.scale, places)]
        return [sum(rows[first + count :: count], rows[first]) for first in range(count)]

    def deflection(self, weight: Weight, lever: Levers, load: Rows) -> Rows:
        """Deflection y under line loads, without the compliance of the uncoupled slices."""
        modal = stored(onto(weight[:, None] * self.modes, jnp.stack(self.places(load))))
        pressed = [along(body.share, summed(body.compliance[None] * modal[:, None], 2)) for body in self.bodies]
        deflected = along(self.modes, stored(reduce(add, pressed)))
        result = self.springs([deflected[:, i] for i in range(deflected.shape[1])], len(load))
        bent = self.support_deflection(weight, lever, load)
        return result if bent is None else [row + height * bent for row, height in zip(result, lever)]

    def support_deflection(self, weight: Weight, lever: Levers, load: Rows) -> Float[Array, "slices positions"] | None:
        """Deflection of the support under line loads, per unit of lever; None without a support."""
        if self.support is None or self.support_modes is None:
            return None
        force = weight[:, None] * sum(height * q for height, q in zip(lever, load))
        return along(self.support_modes, along(self.support, onto(self.support_modes, force)))


def with_inverse(coupling: SliceCoupling) -> SliceCoupling:
    """The coupling ready for eliminations."""
    if len(coupling.bodies) == 1:
        (body,) = coupling.bodies
        inverse = _block(small_inverse(body.share[..., None])[..., 0], small_inverse(body.compliance))
    else:
        inverse = _block_inverse(reduce(add, [_block(body.share, body.compliance) for body in coupling.bodies]))
    return eqx.tree_at(lambda c: c.inverse, coupling, inverse, is_leaf=lambda leaf: leaf is None)


def _block(share: Float[Array, "modes modes"], compliance: Places) -> Blocks:
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
Sides = Float[Array, "sides places positions"]  # right sides of the modal system, of one mode


class _Block(NamedTuple):
    """The columns of one mode in the block elimination of the modal system, L D L^T; from this mode on.

    Attributes:
        scaled: L D.
        lower: L, below the diagonal.
        inverse: inverse of D.
    """

    scaled: Float[Array, "modes places places positions"]
    lower: Float[Array, "below places places positions"]
    inverse: Float[Array, "places places positions"]


class CoupledFactors(NamedTuple):
    """Elimination of the unknowns that couple the slices.

    Attributes:
        coupling, weight, lever: as of `couple`.
        blocks: blocks of the modal system.
        bent: L^-1 (D V)^T w A^-1 X by mode, and D^-1 times it.
        force: z under unit b, symmetric.
        yielding: b under unit H z, and under unit approach in its first column; see `_yielding`.
    """

    coupling: SliceCoupling
    weight: Weight
    lever: Levers
    blocks: list[_Block]
    bent: tuple[list[Sides], list[Sides]]
    force: Float[Array, "bends bends positions"]
    yielding: Float[Array, "bends bends positions"]


def couple(coupling: SliceCoupling, weight: Weight, lever: Levers, inverse: Inverse) -> CoupledFactors:
    """Eliminate the coupling of the slices.

    Args:
        coupling: coupling with its inverse.
        weight: w.
        lever: closing of a spring per unit of common approach.
        inverse: A^-1, zero where springs are apart, by springs.
    """
    modal = _products(coupling, weight, inverse)
    blocks = _eliminated(coupling, modal)
    right, force = _of_support(coupling, weight, lever, inverse, modal)
    bent = _ahead(blocks, right)
    force = force - _joined(bent[0], bent[1])
    return CoupledFactors(coupling, weight, lever, blocks, bent, force, _yielding(coupling.support, force))


def _products(
    coupling: SliceCoupling, weight: Weight, inverse: Inverse
) -> list[Float[Array, "_ places places positions"]]:
    """(D V)^T w A^-1 D V: of every mode with itself and those after it, by mode."""
    modes, scale, springs = coupling.modes, coupling.scale, len(inverse)
    places = range(springs if scale is None else len(scale))
    half = [(i, j) for i in places for j in range(i + 1)]
    rows = [inverse[i % springs][j % springs] for i, j in half]
    if scale is not None:
        # two places of one spring have no load at the same time
        rows = [
            scale[i] * row * scale[j] if i == j or (i - j) % springs else jnp.zeros_like(row)
            for (i, j), row in zip(half, rows)
        ]
    stack = jnp.stack(rows)
    place = np.array([[half.index((max(i, j), min(i, j))) for j in places] for i in places])
    loads = weight[:, None] * modes
    return [onto(loads[:, k, None] * modes[:, k:], stack)[:, place] for k in range(modes.shape[1])]


def _eliminated(coupling: SliceCoupling, modal: list[Float[Array, "_ places places positions"]]) -> list[_Block]:
    blocks: list[_Block] = []
    assert coupling.inverse is not None  # set by `with_inverse` before every elimination
    for mode in range(len(modal)):
        scaled = modal[mode] + coupling.inverse[mode:, mode]
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
    coupling: SliceCoupling, weight: Weight, lever: Levers, inverse: Inverse, modal
) -> tuple[list[Sides], Float[Array, "bends bends positions"]]:
    """(D V)^T w A^-1 X by mode, and X^T w A^-1 X."""
    if coupling.support_modes is None and coupling.scale is None and lever.shape[1] == 1:
        # what the common approach presses is the first mode
        even = reduce(add, [modal[0][:, :, i] * height[None] for i, height in enumerate(lever)])
        return list(even[:, None]), reduce(add, list(even[0] * lever[:, 0]))[None, None]
    shapes = _shapes(coupling)
    pressed = [sum(x * height for x, height in zip(row, lever)) for row in inverse]
    placed = jnp.stack(coupling.places(pressed))
    loads = weight[:, None] * shapes
    right = [onto(mode[:, None] * loads, placed) for mode in coupling.modes.T]
    force = sum(row * height for row, height in zip(pressed, lever))
    return right, jnp.stack([onto(load[:, None] * shapes, force) for load in loads.T])


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


def pressed_by(
    factors: CoupledFactors, within: Rows, *, load: Load | None = None, approach: Curve | None = None
) -> tuple[Rows, Curve]:
    """Deflections that the coupling adds to the known ones, X b - D V m, and the approach.

    Args:
        factors: factors from `couple`.
        within: A^-1 known.
        load: total over the slices, of w and the levers times the line loads; None for that of an `approach`.
        approach: the approach; None for that of a `load`.
    """
    coupling, weight, lever = factors.coupling, factors.weight, factors.lever
    placed = jnp.stack(coupling.places(within))
    loads = weight[:, None] * coupling.modes
    # mode by mode: compilers take a sum for all modes in every loop that reads one of them
    _, divided = _ahead(factors.blocks, [onto(mode[:, None], placed) for mode in loads.T])
    force = sum(height * row for height, row in zip(lever, within))
    shapes = _shapes(coupling)
    carried = onto(weight[:, None] * shapes, force) - _joined(factors.bent[0], divided)[:, 0]
    bends, approach = _bends(factors, carried, load, approach)
    eliminated = [a[0] + summed(b * bends[:, None]) for a, b in zip(divided, factors.bent[1])]
    deflected = along(coupling.modes, jnp.stack(_back(factors.blocks, eliminated)))
    even = along(shapes, bends)
    yielded = coupling.springs([deflected[:, i] for i in range(deflected.shape[1])], len(lever))
    return [height * even - back for height, back in zip(lever, yielded)], approach


def _shapes(coupling: SliceCoupling) -> Float[Array, "slices bends"]:
    """Support modes; the even deflection of all slices, orthonormal, of slices without a support."""
    if coupling.support_modes is not None:
        return coupling.support_modes
    count = len(coupling.modes)
    return jnp.full((count, 1), count**-0.5, coupling.modes.dtype)


def stiffness(factors: CoupledFactors) -> Curve:
    """Load per unit of approach."""
    return len(factors.coupling.modes) * summed(factors.force[0] * factors.yielding[:, 0])


def _bends(factors: CoupledFactors, carried: Bends, total, approach: Curve | None) -> tuple[Bends, Curve]:
    """b and the approach, for that or for a total of the line loads; `carried` is z at b = 0."""
    root = len(factors.coupling.modes) ** 0.5
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
