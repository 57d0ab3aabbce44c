"""The gear body as an elastic ring, held at the bore and loaded on the root arcs of its teeth.

Each tooth passes three load modes to its root arc, as stresses on the chord: linear bending (M), uniform shear (V) and
uniform compression (N). Their Fourier series on the root circle meet the ring's compliance per harmonic (Michell's
plane solution); the work-conjugate displacements of any arc then give a 3 x 3 matrix K between any two teeth. K is
exactly reciprocal, K(-phi) = K(phi)^T, and holds for self compliance (phi = 0) and neighbouring teeth alike.

Lengths are relative to the root radius, stresses to the plane modulus. The rigid torsion of the ring between bore and
root circle is left out here: it is the same for every tooth and is accounted for once, as hub wind-up.

References:
    J. H. Michell, Proc. London Math. Soc. 31 (1899) 100-124; harmonic-wise ring solution and load modes after
    P. Sainsot, P. Velex, O. Duverger, J. Mech. Des. 126 (2004) 748-752, doi 10.1115/1.1758252.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..numerics import solve_dense

Scalar = Float[Array, ""]

MODES = ("moment", "shear", "normal")
_HIGHEST_SHIFT = 3  # of a harmonic by the products of sines and cosines in the load modes


def arc_compliance(
    half_angle: Scalar,
    thickness_ratio: Scalar,
    poisson: Scalar,
    spacing: Float[Array, " k"],
    harmonics: int,
    internal: bool = False,
) -> Float[Array, "k 3 3"]:
    """K between two root arcs, without the ring's rigid torsion.

    Args:
        half_angle: half angle of the root arc, theta_f [rad].
        thickness_ratio: root radius over the radius of the fixed circle, h: bore, or outer circle of an internal ring.
        poisson: Poisson's ratio of the plane problem.
        spacing: angles of the responding arc minus the loaded one [rad], shape (k,).
        harmonics: terms of the Fourier series; the error falls with (harmonics * half_angle)^-2.
        internal: whether the ring carries its teeth inside and is fixed outside, h < 1.

    Returns:
        K times the plane modulus, dimensionless, shape (k, 3, 3), rows responding and columns loaded modes
        (moment, shear, normal).
    """
    ring = _ring_compliance(thickness_ratio, poisson, harmonics, internal)
    uniform = _uniform_compliance(thickness_ratio, poisson)
    if internal:  # the outward normal of the loaded circle points to the axis: stresses are minus the tractions
        ring, uniform = -ring, -uniform
    modes = arc_modes(half_angle, harmonics)
    order = jnp.arange(1, harmonics + 1, dtype=modes.dtype)
    pairs = jnp.einsum("ani,nij,bnj->abn", modes[:, 1:], ring, modes[:, 1:])
    angle = order[None] * spacing[:, None]
    even = jnp.einsum("abn,kn->kab", pairs, jnp.cos(angle))
    odd = jnp.einsum("abn,kn->kab", pairs, jnp.sin(angle))
    # moment and shear have odd radial and even tangential stress, normal the reverse: same kinds meet in
    # cos, others in sin
    same = np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    cross = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, -1.0], [1.0, 1.0, 0.0]])
    matrix = jnp.pi * (even * jnp.asarray(same, even.dtype)[None] + odd * jnp.asarray(cross, odd.dtype)[None])
    breathing = 2 * jnp.pi * modes[2, 0, 0] ** 2 * uniform
    return matrix + breathing * jnp.asarray(np.diag([0.0, 0.0, 1.0]), breathing.dtype)[None]


def relaxation(half_angle: Scalar) -> Float[Array, "3 3"]:
    """Reduction of the self compliance, as the true root traction differs from that of the load modes.

    By the principle of least complementary energy a prescribed traction overstates the compliance. Towards a rigid
    tooth the traction turns into that of a bonded punch, p ~ (1 - y^2)^(-1/2), whose energy on the half plane is lower
    by 2 / pi in L = K_MM S^2 and by (2 / pi) (3/2 - 2 ln 2) in K_VV and K_NN (plane modulus 1). The tooth root is about
    as compliant as the body it sits on, so half of the redistribution, and half of the gain, is realised (Ritz's method
    with the punch traction as second term and equal compliances on both sides).

    Returns:
        the reduction of K at zero spacing, times the plane modulus, shape (3, 3).
    """
    chord = 2 * jnp.sin(half_angle)
    bending = 2 / np.pi / chord**2
    direct = jnp.full_like(bending, 2 / np.pi * (1.5 - 2 * np.log(2)))
    return 0.5 * jnp.diag(jnp.stack([bending, direct, direct]))


def _uniform_compliance(thickness_ratio: Scalar, poisson: Scalar) -> Scalar:
    """Radial displacement of the root circle per uniform radial stress (harmonic 0)."""
    inner = thickness_ratio**-2
    return (1 - poisson**2) * (1 - inner) / ((1 + poisson) + (1 - poisson) * inner)


def arc_modes(half_angle: Scalar, harmonics: int) -> Float[Array, "3 n 2"]:
    """Fourier coefficients of the three load modes for unit resultants, n = 0 ... harmonics.

    The traction per arc length is the chord stress times cos(theta), turned into polar components. The second component
    is the sine coefficient of the shear stress, for M and V minus its cosine coefficient, so that one ring compliance
    serves all modes.
    """
    t = half_angle
    order = np.arange(-_HIGHEST_SHIFT, harmonics + _HIGHEST_SHIFT + 1, dtype=float)
    frequency, zero = jnp.asarray(order, t.dtype), order == 0
    integrals = jnp.where(zero, 2 * t, 2 * jnp.sin(frequency * t) / jnp.where(zero, 1.0, frequency))

    def cosine(shift: int) -> Array:  # int cos((n + shift) theta) over the arc, for each n
        return integrals[_HIGHEST_SHIFT + shift :][: harmonics + 1]

    def even(*terms: tuple[float, int]) -> Array | int:  # cosine series of sum of amplitude * cos(shift theta)
        return sum(a * 0.5 * (cosine(s) + cosine(-s)) for a, s in terms)

    def odd(*terms: tuple[float, int]) -> Array | int:  # sine series of sum of amplitude * sin(shift theta)
        return sum(a * 0.5 * (cosine(-s) - cosine(s)) for a, s in terms)

    sine = jnp.sin(t)
    # resultants over the chord y = sin(theta): int (y / y_f) y dy, int dy, int dy
    moment_resultant, force_resultant = 2 * sine**2 / 3, 2 * sine
    # cos^2 sin = (sin + sin 3) / 4, sin^2 cos = (cos - cos 3) / 4, cos sin = sin 2 / 2, cos^2 = (1 + cos 2) / 2
    moment = (odd((0.25, 1), (0.25, 3)) / sine, even((0.25, 1), (-0.25, 3)) / sine)
    shear = (odd((0.5, 2)), -even((0.5, 0), (0.5, 2)))
    normal = (even((0.5, 0), (0.5, 2)), -odd((0.5, 2)))
    rows = [
        jnp.stack(moment, axis=-1) / moment_resultant,
        jnp.stack(shear, axis=-1) / force_resultant,
        jnp.stack(normal, axis=-1) / force_resultant,
    ]
    scale = np.where(np.arange(harmonics + 1) == 0, 1 / (2 * np.pi), 1 / np.pi)
    return jnp.stack(rows) * jnp.asarray(scale, t.dtype)[None, :, None]


def _ring_compliance(thickness_ratio: Scalar, poisson: Scalar, harmonics: int, internal: bool) -> Float[Array, "n 2 2"]:
    """Displacements (u_r, u_theta) of the root circle per stresses (sigma_r, tau) of harmonic n = 1 ... harmonics."""
    terms = michell_terms(thickness_ratio, poisson, harmonics, internal)
    return jnp.concatenate([_condense(root, fixed, poisson) for root, fixed in terms])


def _condense(root: "Circle", fixed: "Circle", poisson: Array) -> Array:
    """Eliminates the four term amplitudes: u = 0 on the fixed circle, unit stresses on the root circle."""
    system = jnp.concatenate([fixed.displacement, root.stress], axis=-2)
    unit = jnp.zeros((*system.shape[:-1], 2), system.dtype).at[..., 2, 0].set(1.0).at[..., 3, 1].set(1.0)
    amplitude = jax.vmap(solve_dense)(system, unit)
    return (1 + poisson) * (root.displacement @ amplitude)  # 1 / (2 mu) = (1 + nu) / E


class Circle(NamedTuple):
    """Displacements (u_r, u_theta), times 2 mu, and stresses (sigma_r, tau) on a circle under unit amplitudes."""

    displacement: Float[Array, "n 2 4"]
    stress: Float[Array, "n 2 4"]


def michell_terms(
    thickness_ratio: Scalar, poisson: Scalar, harmonics: int, internal: bool
) -> list[tuple[Circle, Circle]]:
    """Michell's four terms of harmonic 1 and, if there are more, of all others, on root and fixed circle."""
    first = _first_harmonic(thickness_ratio, poisson)
    if harmonics == 1:
        return [first]
    return [first, _higher_harmonics(thickness_ratio, poisson, harmonics, internal)]


def _higher_harmonics(thickness_ratio: Array, poisson: Array, harmonics: int, internal: bool) -> tuple[Circle, Circle]:
    """Terms that decay from the fixed circle to the root circle are scaled to their value at the fixed one, so that no
    power overflows. In an internal ring those are the terms that grow with the radius.
    """
    n = jnp.arange(2, harmonics + 1, dtype=thickness_ratio.dtype)
    kappa = (3 - poisson) / (1 + poisson)
    radius = 1 / thickness_ratio
    # of every term from one circle to the other, where it decays
    fade = radius**-n if internal else radius**n
    one = jnp.ones_like(n)
    displacement = jnp.stack(
        [
            jnp.stack([kappa - n - 1, kappa + n - 1, -n, n], -1),
            jnp.stack([kappa + n + 1, -(kappa - n + 1), n, n], -1),
        ],
        -2,
    )
    stress = jnp.stack(
        [
            jnp.stack([-(n + 1) * (n - 2), -(n + 2) * (n - 1), -n * (n - 1), -n * (n + 1)], -1),
            jnp.stack([n * (n + 1), -n * (n - 1), n * (n - 1), -n * (n + 1)], -1),
        ],
        -2,
    )
    growing, decaying = (fade, one) if internal else (one, fade)
    root = jnp.stack([growing, decaying, growing, decaying], -1)[:, None]
    fixed = jnp.stack([decaying * radius, growing * radius, decaying / radius, growing / radius], -1)[:, None]
    return Circle(displacement * root, stress * root), Circle(displacement * fixed, stress * fixed / radius)


def _first_harmonic(thickness_ratio: Array, poisson: Array) -> tuple[Circle, Circle]:
    kappa = (3 - poisson) / (1 + poisson)

    def circle(r: Array) -> Circle:
        one, log = jnp.ones_like(r), jnp.log(r)
        displacement = jnp.stack(
            [
                jnp.stack([(kappa - 2) * r**2, r**-2, one, -1 + 2 * kappa * log]),
                jnp.stack([(kappa + 2) * r**2, r**-2, -one, -1 - 2 * kappa * log]),
            ]
        )
        zero = jnp.zeros_like(r)
        stress = jnp.stack(
            [
                jnp.stack([2 * r, -2 * r**-3, zero, (kappa + 3) / r]),
                jnp.stack([2 * r, -2 * r**-3, zero, -(kappa - 1) / r]),
            ]
        )
        return Circle(displacement[None], stress[None])

    return circle(jnp.ones_like(thickness_ratio)), circle(1 / thickness_ratio)
