"""How the slices of a face are elastically coupled: the deflection at one place under a load at another.

A load at one place of the face bends the tooth beside it too. With the compliance C of a section under a load that is
uniform over the face, slices of line load q[t] deflect by the sum of C F[s, t] q[t]. The parts of F = T + E are

    T   the decaying kernel with mirror images at the free ends, the solution of w - l^2 w'' = C q, w' = 0 at the ends,
    E   the free ends, softer than the mirror images make them: two vectors that decay from the ends.

The lengths scale with the root chord S of the teeth. Every row of F sums to one: a uniform load deflects the face as it
does a single slice. Decaying kernels with images are those of Petersen's and the FVA's influence numbers and of the
moment images of Jaramillo, and of Wellauer and Seireg; the three constants here are chosen by contacts of
three-dimensional finite elements with free ends (spur gears, 19/48 teeth, face widths of 6 and 20 modules). With them
the ratio of peak to mean line load of sloped and crowned flanks is within 5 % (slopes over 20 modules: 7 %), that of
end reliefs within 17 %; slices that are not coupled miss it by up to 40 %. Helical gears have softer ends.

A gear that is wider than its mate has its free ends, and with them the images, farther out: what overhangs the load
helps to carry it. The rows of F then sum to less than one.

Slices of unequal width w are put together from parts of equal width: a line load on a slice is one on all of its parts,
and its deflection is the mean of theirs. F of the slices is then not symmetric, but w^1/2 F w^-1/2 is, between loads
and deflections times w^1/2: B^T F B of the parts, B being `slice_basis`.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..numerics import Given, real
from ..numerics.dense import solve_dense
from ..numerics.fits import orthonormal

Scalar = Float[Array, ""]
Kernel = Float[Array, "slices slices"]

# over the root chord: how far a load is felt, and how far from its end a face is softer
_DECAY = 0.78
_END_DECAY = 0.30
_END_SOFTNESS = 0.10  # share of the uniform compliance
# At the ends of helical gears one tooth has an acute corner, its mate an obtuse one: together they are softer than
# square ones, 2.2 times at 15 degrees (by the finite elements that `plate` names), more with the square of the tangent.
_ACUTE = 1.2 / np.tan(np.deg2rad(15.0)) ** 2

# with modes that decay from the ends: the rest is this share of the mean of all others. Some modes deflect less than
# that mean; this keeps the share of the modes positive definite on faces of up to 130 modules with 64 slices
_KEPT = 0.7
_FEWEST_WAVES = 3  # beside modes that decay from the ends, the constant included


def face_kernel(
    face_width: Given,
    root_chord: Given,
    slices: int,
    overhang: tuple[Given, Given] | None = None,
    helix_angle: Given | None = None,
) -> Kernel:
    """F: deflection of a slice under the line load of another, over that of a load uniform over the whole gear.

    Symmetric, positive definite. Its rows sum to one where nothing overhangs, else to less. Its eigenvalues are at most
    one on faces of up to 18 root chords, some 50 modules; on wider ones a load at the softer ends makes up to 1.01.

    Args:
        face_width: over which the load is spread [mm].
        root_chord: S of the teeth, mean of both gears [mm].
        slices: of equal width over the load.
        overhang: of the gear beyond the negative and the positive end of the load [mm]; None for none.
        helix_angle: [deg]; None for spur gears.
    """
    face_width, root_chord = real(face_width), real(root_chord)
    softness = (
        _END_SOFTNESS
        if helix_angle is None
        else _END_SOFTNESS * (1 + _ACUTE * jnp.tan(jnp.deg2rad(real(helix_angle))) ** 2)
    )
    dtype = jnp.result_type(face_width)
    waves, cosines = jnp.arange(slices, dtype=dtype), jnp.asarray(face_waves(slices), dtype)
    falling = 1 / (1 + (jnp.pi * waves * _DECAY * root_chord / face_width) ** 2)
    mirrored = (cosines * falling[None]) @ cosines.T
    decay, step = _END_DECAY * root_chord, face_width / slices
    ends = _near_ends(waves, step, decay)
    if overhang is None:
        ends = ends - jnp.mean(ends, axis=0, keepdims=True)
    else:
        beyond = real(overhang[0]), real(overhang[1])
        width, far = face_width + beyond[0] + beyond[1], _DECAY * root_chord
        there = _images(_near_ends(waves, step, far, beyond), width, far)
        mirrored = mirrored + step * (there - _images(_near_ends(waves, step, far), face_width, far))
        ends = _near_ends(waves, step, decay, beyond) + jnp.expm1(-width / decay) * decay / width
    return mirrored + 2 * softness * step / decay * ends @ ends.T


def _near_ends(
    waves: Float[Array, " slices"], step: Scalar, decay: Scalar, overhang: tuple[Given, Given] = (0.0, 0.0)
) -> Float[Array, "slices 2"]:
    """exp(-distance / decay) from the positive and the negative end of a gear, its mean over every slice."""
    share = -jnp.expm1(-step / decay) * decay / step
    ends = waves[::-1] * step + overhang[1], waves * step + overhang[0]
    return jnp.stack([jnp.exp(-end / decay) * share for end in ends], axis=1)


def _images(ends: Float[Array, "slices 2"], width: Scalar, decay: Scalar) -> Kernel:
    """Part that mirror images at both ends add to the kernel exp(-|y - y'| / l) / 2 l of an infinite face [1/mm].

    The kernel cosh((y< + b/2) / l) cosh((b/2 - y>) / l) / (l sinh(b / l)) less that one, in terms of the distances from
    the ends, which stay finite on wide faces.
    """
    even, odd = ends[:, 0] + ends[:, 1], ends[:, 0] - ends[:, 1]
    small = jnp.exp(-width / decay)
    both = even[:, None] * even[None] / -jnp.expm1(-width / decay) + odd[:, None] * odd[None] / (1 + small)
    return both / (4 * decay)


def face_waves(slices: int) -> np.ndarray:
    """Cosines over the face at the middles of the slices, the constant first, as orthonormal columns."""
    middle, waves = (np.arange(slices) + 0.5) / slices, np.arange(slices)
    return np.sqrt((2.0 - (waves == 0)) / slices) * np.cos(np.pi * waves * middle[:, None])


def slice_basis(parts: tuple[int, ...]) -> Float[np.ndarray, "parts slices"]:
    """Even loads of slices over the parts of equal width that they are put together from, as orthonormal columns.

    Args:
        parts: number of them that make up each slice.
    """
    return np.repeat(np.diag(np.asarray(parts) ** -0.5), parts, axis=0)


def _uneven_waves(parts: tuple[int, ...]) -> np.ndarray:
    """`face_waves` of slices of unequal width, as `few_modes` takes their kernel: the longest waves of the parts."""
    over_slices = slice_basis(parts).T @ face_waves(sum(parts))[:, : len(parts)]
    waves, upper = np.linalg.qr(over_slices)
    return waves * np.where(np.diagonal(upper) < 0, -1.0, 1.0)


def face_ends(face_width: Given, root_chord: Given, slices: int) -> Float[Array, "slices ends"]:
    """Shapes that decay from both ends of the load as a kernel does: the rows of every F sum to a constant and these.

    Args:
        face_width: over which the load is spread [mm].
        root_chord: S of the teeth, mean of both gears [mm].
        slices: of equal width over the load.
    """
    face_width, root_chord = real(face_width), real(root_chord)
    places = jnp.arange(slices, dtype=jnp.result_type(face_width))
    ends = [_near_ends(places, face_width / slices, decay * root_chord) for decay in (_DECAY, _END_DECAY)]
    return jnp.concatenate(ends, axis=1)


def few_modes(
    kernel: Float[Array, "*gears slices slices"],
    count: int,
    ends: Float[Array, "slices ends"] | None = None,
    parts: tuple[int, ...] | None = None,
) -> tuple[Float[Array, "slices modes"], Float[Array, "*gears modes modes"], Float[Array, "*gears"]]:
    """A kernel by few modes and one number for all others: F = rest 1 + modes share modes^T.

    The modes are the longest waves over the face, once multiplied with F: close to the eigenvectors of the largest
    eigenvalues, but smooth in F where eigenvalues meet. The constant comes first, on it F is exact where rows sum to
    one, and so is all of it with as many modes as slices. The rest is the mean of what the others have. Several kernels
    share the modes of their mean.

    Loads beside an overhang fall or rise within less than a root chord of the end, which few waves cannot follow. With
    `ends` these four shapes take the place of the two shortest waves, and F is exact on the constant for any overhang.

    Args:
        kernel: F, symmetric, positive definite; a leading axis for several.
        count: number of modes, with `ends` of two less; more than slices are as many as slices.
        ends: `face_ends`, where a gear may overhang the load.
        parts: of slices of unequal width, whose kernel and ends are those of `slice_basis`, and whose constant is the
            root of the widths; None for equal ones.

    Returns:
        modes, orthonormal; share, positive definite; rest.
    """
    slices, gears = kernel.shape[-1], kernel.shape[:-2]
    waves = jnp.asarray(face_waves(slices) if parts is None else _uneven_waves(parts), kernel.dtype)
    longest = count if ends is None else max(count - 2, _FEWEST_WAVES)
    count = longest if ends is None else longest + ends.shape[1]
    if count >= slices:
        return waves, waves.T @ kernel @ waves, jnp.zeros(gears, kernel.dtype)
    felt = jnp.mean(kernel.reshape(-1, slices, slices), axis=0) @ waves[:, 1:longest]
    if ends is None:
        # orthogonal to the constant, as they are where rows sum to one
        others = orthonormal(felt - waves[:, :1] @ (waves[:, :1].T @ felt))[0]
        modes = jnp.concatenate([waves[:, :1], others], axis=1)
    else:  # nearly dependent on narrow faces: what rounding leaves of the constant would be amplified
        modes = orthonormal(jnp.concatenate([waves[:, :1], ends.astype(kernel.dtype), felt], axis=1))[0]
    projected = modes.T @ kernel @ modes
    rest = (jnp.trace(kernel, axis1=-2, axis2=-1) - jnp.trace(projected, axis1=-2, axis2=-1)) / (slices - count)
    if ends is not None:
        rest = _KEPT * rest
    if ends is not None and parts is not None:  # wide slices beside narrow ones deflect far less than their mean
        rest = jnp.minimum(rest, jnp.vectorize(_lowest, signature="(n,n)->()")(projected))
    shape = (1,) * len(gears) + (count, count)
    return modes, projected - rest[..., None, None] * jnp.eye(count, dtype=kernel.dtype).reshape(shape), rest


def _lowest(matrix: Float[Array, "n n"]) -> Scalar:
    """Nearly the lowest eigenvalue l of a symmetric positive definite matrix, and never above it: sum(l^-8)^(-1/8)."""
    inverse = solve_dense(matrix, jnp.eye(len(matrix), dtype=matrix.dtype))
    fourth = (inverse @ inverse) @ (inverse @ inverse)
    return jnp.sum(fourth * fourth) ** (-1 / 8)
