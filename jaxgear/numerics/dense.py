"""Dense linear equations of few unknowns, without LAPACK.

In batches, JAX's calls of LAPACK share their work among the threads of one pool and wait for it there: as many of them
at once as the pool has threads wait for each other for ever, and a design of several parts makes as many. What users
put under `jax.vmap` is therefore solved here, by exchange steps (Gauss and Jordan's method, in place).
Their error is that of Gaussian elimination (Peters and Wilkinson, On the stability of Gauss-Jordan elimination with
pivoting, Commun. ACM 18 (1975) 20-24, doi 10.1145/360569.360653). Where a matrix may be singular, rotations make its
columns orthogonal (Hestenes, J. Soc. Indust. Appl. Math. 6 (1958) 51-90, doi 10.1137/0106005).

LAPACK is left with the eigenvalues and singular values of motions in `dynamics` and of a measurement in `optimize`: of
one matrix of a program, or of several that are found one after the other.
"""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

Matrix = Float[Array, "n n"]
Right = Float[Array, "n *columns"]
Slab = Float[Array, "n columns"]

_SMALL = 8  # unknowns up to which one slab takes all
_SWEEPS = 30  # of rotations over all pairs of columns: six to ten are enough as a rule


def solve_dense(matrix: Matrix, right: Right) -> Right:
    """x of matrix x = right, by partial pivoting; infinite or NaN where the matrix is singular.

    Differentiable any number of times.

    Args:
        matrix: matrix of full rank, with rows of comparable size.
        right: one right side, or columns of several.
    """
    fixed = jax.lax.stop_gradient(matrix)
    inverse = _inverse(fixed)

    def by(exact, near, given):
        # what one step of refinement leaves is the residual of an elimination, which that of an inverse need not be
        first = near @ given
        return first + near @ (given - exact @ first)

    return jax.lax.custom_linear_solve(
        lambda x: matrix @ x,
        right,
        solve=lambda _, given: by(fixed, inverse, given),
        transpose_solve=lambda _, given: by(fixed.T, inverse.T, given),
    )


def _inverse(matrix: Matrix) -> Matrix:
    """Exchanges the unknowns for the right sides, as many at once as touch the matrix about as often as their slab."""
    size = len(matrix)
    width = size if size <= _SMALL else round(size**0.5)
    count = -(-size // width)
    filled = count * width - size  # by equations of their own
    table = jnp.pad(matrix, (0, filled)) + jnp.diag((jnp.arange(size + filled) >= size).astype(matrix.dtype))

    def exchange(block, state):
        table, chosen = state
        at = block * width
        slab, chosen = _exchanged(jax.lax.dynamic_slice_in_dim(table, at, width, axis=1), chosen, at)
        picks = jax.lax.dynamic_slice_in_dim(chosen, at, width)
        gone = jnp.any(jnp.arange(len(table))[:, None] == picks[None], axis=1, keepdims=True)
        table = jnp.where(gone, 0.0, table) - slab @ table[picks]
        return jax.lax.dynamic_update_slice_in_dim(table, slab, at, axis=1), chosen

    none = jnp.full(len(table), -1, jnp.arange(1).dtype)
    table, chosen = jax.lax.fori_loop(0, count, exchange, (table, none))
    # the row of unknown k is chosen[k], and its column is now that of right side chosen[k]
    return table[chosen][:, jnp.argsort(chosen)][:size, :size]


def _exchanged(slab: Slab, chosen: Int[Array, " n"], at) -> tuple[Slab, Int[Array, " n"]]:
    """The columns of some unknowns, the first of them `at`, after each has taken the place of a right side.

    Each takes that of the equation, of those left, in which it is largest; `chosen` tells by unknown which.
    """
    rows, columns = jnp.arange(len(slab)), jnp.arange(slab.shape[1])

    def exchange(k, state):
        slab, chosen = state
        left = jnp.all(chosen[None] != rows[:, None], axis=1)
        pick = jnp.argmax(jnp.where(left, jnp.abs(slab[:, k]), -1))
        row, pivot = slab[pick][None], slab[pick, k]
        share = slab[:, k, None] / pivot
        own = columns[None] == k
        changed = jnp.where(own, share, slab - share * row)
        slab = jnp.where(rows[:, None] == pick, jnp.where(own, 1.0, -row) / pivot, changed)
        return slab, jnp.where(rows == at + k, pick, chosen)

    return jax.lax.fori_loop(0, slab.shape[1], exchange, (slab, chosen))


def pivots(matrix: Matrix) -> Float[Array, " n"]:
    """Pivots of a symmetric matrix, eliminated without exchanges; their product is its determinant where all are
    positive. Not differentiable.
    """
    rows = jnp.arange(len(matrix))

    def eliminate(k, state):
        left, found = state
        pivot = left[k, k]
        share = jnp.where(rows > k, left[:, k], 0.0) / jnp.where(pivot > 0, pivot, 1.0)
        return left - share[:, None] * left[k][None], found.at[k].set(pivot)

    start = jax.lax.stop_gradient(matrix), jnp.zeros(len(matrix), matrix.dtype)
    return jax.lax.fori_loop(0, len(matrix), eliminate, start)[1]


def positive_definite(matrix: Matrix) -> Bool[Array, ""]:
    """True if all eigenvalues of a symmetric matrix are positive, by its pivots (Sylvester).

    They are above x where matrix - x I is positive definite. False where a number is NaN.
    """
    return jnp.all(pivots(matrix) > 0)


@partial(jax.custom_jvp, nondiff_argnums=(1,))
def pseudo_inverse(matrix: Matrix, least: float) -> Matrix:
    """Moore and Penrose's inverse of a matrix.

    Args:
        matrix: matrix of any rank; its derivatives hold where that does not change.
        least: singular value that counts, over the largest one.
    """
    largest = jnp.max(jnp.abs(matrix))
    scale = jnp.where(largest > 0, largest, 1)  # squares of single precision end at 1e19
    columns, turned = _orthogonal(matrix / scale)
    square = jnp.sum(columns**2, axis=0, keepdims=True)
    lost = square <= least**2 * jnp.max(square)
    return turned @ jnp.where(lost, 0, columns / jnp.where(lost, 1, square)).T / scale


@pseudo_inverse.defjvp
def _pseudo_inverse_jvp(least, primals, tangents):
    """Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413-432, doi 10.1137/0710036, equation (4.12)."""
    (matrix,), (change,) = primals, tangents
    found = pseudo_inverse(matrix, least)
    unit = jnp.eye(len(matrix), dtype=matrix.dtype)
    missed, free = unit - matrix @ found, unit - found @ matrix
    across = found @ found.T @ change.T @ missed + free @ change.T @ found.T @ found
    return found, across - found @ change @ found


def _orthogonal(matrix: Matrix) -> tuple[Slab, Slab]:
    """Orthogonal columns of matrix @ V, and the orthogonal V."""
    size = len(matrix)
    pairs = (size + 1) // 2
    both = jnp.concatenate([matrix, jnp.eye(size, dtype=matrix.dtype)])
    both = jnp.pad(both, ((0, 0), (0, 2 * pairs - size)))
    # the first stays and the others go round a table with two sides: every two face each other once (Brent and Luk,
    # SIAM J. Sci. Stat. Comput. 6 (1985) 69-84, doi 10.1137/0906007)
    table, places = np.r_[1:pairs, 2 * pairs - 1 : pairs - 1 : -1], np.arange(2 * pairs)
    places[table] = np.roll(table, 1)
    enough = size * jnp.finfo(matrix.dtype).eps

    def turn(_, state):
        both, worst = state
        first, second = both[:, :pairs], both[:, pairs:]
        own, other = (jnp.sum(side[:size] ** 2, axis=0) for side in (first, second))
        product = jnp.sum(first[:size] * second[:size], axis=0)
        turns = jnp.abs(product) > enough * jnp.sqrt(own * other)
        ratio = (other - own) / jnp.where(turns, 2 * product, 1.0)
        tangent = jnp.where(turns, jnp.where(ratio < 0, -1.0, 1.0) / (jnp.abs(ratio) + jnp.sqrt(1 + ratio**2)), 0.0)
        cosine = (1 / jnp.sqrt(1 + tangent**2))[None]
        sine = cosine * tangent[None]
        both = jnp.concatenate([cosine * first - sine * second, sine * first + cosine * second], axis=1)
        return both[:, places], worst | jnp.any(turns)

    def sweep(state):
        both, _, count = state
        both, more = jax.lax.fori_loop(0, 2 * pairs - 1, turn, (both, jnp.zeros((), bool)))
        return both, more, count + 1

    both, *_ = jax.lax.while_loop(
        lambda state: state[1] & (state[2] < _SWEEPS), sweep, (both, jnp.ones((), bool), jnp.zeros((), int))
    )
    return both[:size, :size], both[size:, :size]
