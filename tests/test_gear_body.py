"""The gear body: elastic ring with coupled teeth, Sainsot's polynomial, half plane, hub wind-up."""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxgear as jg
from jaxgear.compliance import published, ring
from jaxgear.compliance.tooth import tooth_load
from jaxgear.geometry import outline

# theta_f, root over bore radius: L*, M*, P*, Q* of the published polynomial
SAINSOT = {
    (0.05, 2.0): (6.915, 1.054, 3.107, 0.548),
    (0.08, 4.0): (6.920, 1.560, 5.637, 0.315),
    (0.12, 7.0): (6.919, 2.895, 12.449, 0.142),
    (0.05, 1.4): (6.905, 0.999, 2.555, 0.622),
    (0.16, 3.0): (6.891, 1.454, 3.775, 0.369),
}
# the same quantities from the elastic ring, plane stress, uniform shear, hub torsion included
RING = {
    (0.05, 1.4): (5.644, 1.232, 2.186, 0.626),
    (0.05, 2.0): (5.711, 1.446, 3.092, 0.570),
    (0.05, 4.0): (5.751, 1.988, 5.978, 0.358),
    (0.08, 3.0): (5.741, 1.863, 4.102, 0.418),
    (0.12, 2.0): (5.628, 1.514, 2.534, 0.480),
    (0.12, 4.0): (5.856, 2.805, 5.408, 0.294),
    (0.12, 7.0): (6.259, 6.079, 12.394, 0.145),
    (0.16, 3.0): (5.777, 2.322, 3.650, 0.352),
}
# neighbouring teeth, response at +2 pi / z: L1, Q1 = -M1, P1 = R1, S1, U1 = -T1, V1; then self L, M, P, PQ
NEIGHBOURS = {
    (30, 0.10043, 4.3651): (-0.7441, -0.6870, 0.8661, 0.8654, 0.0117, 5.2961, 5.8453, 2.8330, 6.1886, 1.7355),
    (50, 0.06026, 2.8500): (-0.8739, -0.7074, 0.2422, 0.9846, -0.1088, 3.1836, 5.7320, 1.7024, 4.0757, 1.8663),
    (20, 0.15064, 2.9915): (-0.7738, -0.6142, 0.6522, 0.4850, 0.0771, 2.7834, 5.7704, 2.2623, 3.6778, 1.3199),
}
NU, M, V, N = 0.3, 0, 1, 2
arc_compliance = jax.jit(ring.arc_compliance, static_argnums=4)
relaxation = jax.jit(ring.relaxation)
polynomial = jax.jit(published.coefficients)
load_of = jax.jit(tooth_load)


def arc(half_angle, ratio, spacing, harmonics=4000, poisson=NU):
    """K between root arcs in the library's form, without the torsion of the ring."""
    numbers = jnp.asarray(half_angle), jnp.asarray(ratio), jnp.asarray(poisson), jnp.asarray(spacing)
    return np.asarray(arc_compliance(*numbers, harmonics))


def torsion(t, h):
    """What the rigid rotation of the root circle adds to K: (1 + nu) (h^2 - 1) / (2 pi) per unit torque, twice."""
    torque = np.array([-1.0, (t + np.sin(t) * np.cos(t)) / (2 * np.sin(t)), 0.0])
    return (1 + NU) * (h**2 - 1) / (2 * np.pi) * torque[:, None] * torque


@pytest.mark.parametrize("place", SAINSOT)
def test_sainsot_table(place):
    np.testing.assert_allclose(polynomial(*place), SAINSOT[place], atol=6e-4)


@pytest.mark.parametrize("place", RING)
def test_ring_table(place):
    t, h = place
    k, chord = arc(t, h, [0.0, 0.0])[0] + torsion(t, h), 2 * np.sin(t)
    values = k[M, M] * chord**2, -2 * k[M, V] * chord, k[V, V], k[N, N] / k[V, V]
    np.testing.assert_allclose(values, RING[place], atol=6e-4)


@pytest.mark.parametrize("place", NEIGHBOURS)
def test_neighbouring_teeth_table(place):
    z, t, h = place
    own, k = arc(t, h, [0.0, 2 * np.pi / z]) + torsion(t, h)
    s = 2 * np.sin(t)
    cross = k[M, M] * s**2, k[M, N] * s, -k[V, M] * s, k[N, N], -k[V, N], k[V, V]
    self_terms = own[M, M] * s**2, -2 * own[M, V] * s, own[V, V], own[N, N]
    np.testing.assert_allclose((*cross, *self_terms), NEIGHBOURS[place], atol=4e-4)
    # the other entries of the table: M1, R1, T1 follow from the sign pattern of the modes
    np.testing.assert_allclose(k[N, M] * s, -k[M, N] * s, rtol=1e-12)
    np.testing.assert_allclose(k[M, V], k[V, M], rtol=1e-12)
    np.testing.assert_allclose(k[N, V], -k[V, N], rtol=1e-12)


def test_reciprocity():
    """K(-phi) = K(phi)^T for any two teeth, and the self compliance is positive definite."""
    angles = np.array([0.1, 0.35, 1.2, 3.0])
    there, back = arc(0.09, 2.5, angles, 400), arc(0.09, 2.5, -angles, 400)
    np.testing.assert_allclose(back, there.transpose(0, 2, 1), atol=1e-13)
    assert np.linalg.eigvalsh(arc(0.09, 2.5, [0.0], 400)[0]).min() > 0


@pytest.mark.slow
def test_convergence_with_harmonics():
    """The error of the moment term falls with the square of the number of harmonics."""
    values = [arc(0.1, 3.0, [0.0], n)[0][M, M] for n in (100, 200, 400, 3200)]
    errors = np.abs(np.array(values[:3]) - values[3])
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.15)
    assert errors[2] < 1e-3 * values[3]


def test_relaxation_softens_no_mode_and_is_a_small_correction():
    """Complementary energy: the prescribed traction overstates the compliance, by 2 ... 12 % in each mode."""
    for t, h in RING:
        relative = np.diag(np.asarray(relaxation(jnp.asarray(t)))) / np.diag(arc(t, h, [0.0], 400)[0])
        assert (relative > 0).all() and relative.max() < 0.13


def gear(teeth, module, ratio, **changes):
    """A gear whose bore radius is the root radius over `ratio`."""
    root = module * (teeth - 2.5)
    return jg.Gear(teeth, module, face_width=10.0, bore_diameter=root / ratio, **changes)


@partial(jax.jit, static_argnums=1)
def between_neighbours(g, step):
    """Compliances of adjacent teeth one base pitch apart on one line of action, in the middle of double contact."""
    tooth, body = outline(g), jg.compliance.ElasticRing()
    contact = jg.path_of_contact(jg.GearPair(g, g))
    first = g.tip_roll_length - 0.5 * (contact.contact_ratio - 1) * g.base_pitch
    load = tooth_load(tooth, jnp.stack([first, first - g.base_pitch])[:, None])
    return body.compliance(load, step, "stress")[..., 0] + body.hub(tooth)


@pytest.mark.parametrize(
    ("teeth", "module", "ratio", "finite_element", "tolerance"),
    [
        (30, 2.0, 4.3651, 26.2, 0.02),
        (50, 3.0, 2.85, 14.7, 0.02),
        (20, 4.0, 2.9915, 14.3, 0.02),
        (43, 1.0, 1.4, 4.63, 0.05),
        (19, 3.0, 2.06, 7.57, 0.03),
        (48, 3.0, 3.41, 18.6, 0.02),
    ],
)
def test_cross_compliance_against_finite_elements(teeth, module, ratio, finite_element, tolerance):
    """Adjacent teeth one base pitch apart on one line of action, bore clamped, in 1e-3 um mm/N."""
    for step in (+1, -1):
        k = between_neighbours(gear(teeth, module, ratio), step)
        np.testing.assert_allclose(k, k.T, rtol=1e-12)
        assert 1e3 * float(k[0, 1]) == pytest.approx(finite_element, rel=tolerance)


def test_hub_windup_formula():
    g = gear(24, 2.0, 3.0)
    ring_radius = float(g.root_circle_radius)
    expected = 1.3 * (3.0**2 - 1) / (2 * np.pi * 206e3) * (float(g.base_radius) / ring_radius) ** 2
    assert float(jg.compliance.ElasticRing().hub(outline(g))) == pytest.approx(1e3 * expected, rel=1e-12)
    assert float(jg.compliance.ElasticRing(hub_windup=False).hub(outline(g))) == 0.0
    # torsion of a disc by elasticity: shear stress T / (2 pi r^2) integrated from bore to root circle
    r = np.linspace(ring_radius / 3, ring_radius, 20001)
    shear = 206e3 / 2.6
    rotation = np.trapezoid(1 / (2 * np.pi * r**3 * shear), r) * float(g.base_radius) ** 2
    assert 1e3 * rotation == pytest.approx(1e3 * expected, rel=1e-6)


@eqx.filter_jit
def _compliance(body, load, plane):
    return body.compliance(load, 1, plane)


def compliance(body, load, plane):
    """Between two neighbours, with one load on either."""
    return np.asarray(_compliance(body, load, plane))[..., 0]


def test_coupling_can_be_switched_off():
    load = load_of(outline(gear(30, 2.0, 4.0)), np.array([[12.0], [6.0]]))
    coupled, alone = (compliance(jg.compliance.ElasticRing(coupling=on), load, "stress") for on in (True, False))
    np.testing.assert_allclose(np.diag(alone), np.diag(coupled), rtol=1e-14)
    assert alone[0, 1] == 0.0 and coupled[0, 1] != 0.0


def test_sainsot_and_half_plane_formulas():
    """Both foundations written out by hand for one load."""
    g = gear(25, 3.0, 2.5)
    tooth = outline(g)
    load = load_of(tooth, np.array([[8.0], [11.0]]))
    a, radius, theta = np.asarray(load.angle), float(g.root_circle_radius), float(tooth.root_half_angle)
    u = (np.asarray(load.height) - radius) / (2 * radius * np.sin(theta))
    big_l, big_m, big_p, big_q = np.asarray(polynomial(theta, 2.5))
    expected = np.cos(a) ** 2 / 206e3 * (big_l * u**2 + big_m * u + big_p * (1 + big_q * np.tan(a) ** 2))
    for plane in ("stress", "strain"):
        own = compliance(jg.compliance.Sainsot(), load, plane)
        np.testing.assert_allclose(np.diag(own), 1e3 * expected[:, 0], rtol=1e-12)
        np.testing.assert_array_equal(own[0, 1], 0.0)

    shear = 1.534 * (1 + 0.4167 * np.tan(a) ** 2 / 1.3)
    stress = np.cos(a) ** 2 / 206e3 * (5.306 * u**2 + 1.4 * u + shear)
    strain = np.cos(a) ** 2 / 206e3 * 0.91 * (5.306 * u**2 + 2 * (1 - 0.3 - 0.18) / 0.91 * u + shear)
    for plane, expected in (("stress", stress), ("strain", strain)):
        own = compliance(jg.compliance.HalfPlane(), load, plane)
        np.testing.assert_allclose(np.diag(own), 1e3 * expected[:, 0], rtol=1e-12)
