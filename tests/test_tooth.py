"""The tooth as a beam of its true outline, and single-tooth compliances against finite elements."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxgear as jg
from jaxgear.compliance.tooth import tooth_load
from jaxgear.geometry import outline
from jaxgear.geometry.outline import involute_point, trochoid

E, NU = 206e3, 0.3

# Finite elements of the whole gear, bore clamped, displacement of the crossing of load line and centreline along the
# load line: teeth, module, root over bore radius, contact radii [mm], compliance [1e-3 um mm/N] in plane stress and
# strain, and how close the model comes.
FINITE_ELEMENTS = [
    (17, 1.0, 1.4, (8.0023, 8.5), (17.43, 24.04), (16.26, 22.27), 0.135),
    (43, 1.0, 1.4, (21.5, 22.4434), (22.57, 59.11), (20.87, 54.12), 0.05),
    (30, 2.0, 4.3651, (29.2, 30.0, 31.5), (38.65, 45.53, 71.07), (37.31, 43.58, 66.82), 0.04),
    (50, 3.0, 2.85, (74.0, 75.0, 77.0), (26.62, 32.51, 53.80), (25.22, 30.57, 49.95), 0.04),
]


@pytest.fixture(scope="module")
def tooth():
    return outline(jg.Gear(19, 3.0, face_width=10.0))


@jax.jit
def loads(tooth):
    """Nine contacts from just above the fillet to the tip."""
    return tooth_load(tooth, jnp.linspace(tooth.form_roll_length + 0.2, tooth.gear.tip_roll_length, 9))


@eqx.filter_jit
def compliance_of(load, plane, beam=jg.compliance.Beam()):
    return beam.compliance(load, plane)


@jax.jit
def polygon(tooth):
    """Points of the outline from the root circle to the tip."""
    g = jnp.linspace(jnp.pi / 2, tooth.junction, 20001)
    rho = jnp.linspace(tooth.form_roll_length, tooth.gear.tip_roll_length, 20001)
    return [jnp.concatenate(parts) for parts in zip(trochoid(tooth.gear, g), involute_point(tooth.gear, rho[1:]))]


def integrate(load, modulus, shear):
    """The energy integrals by the trapezoidal rule over a fine polygon of the outline, root circle to crossing."""
    points = [np.asarray(part) for part in polygon(load.outline)]
    return [integral(*points, *at, modulus, shear) for at in zip(np.asarray(load.height), np.asarray(load.angle))]


def integral(x, y, height, a, modulus, shear):
    inside = y < height
    x, y = np.append(x[inside], np.interp(height, y, x)), np.append(y[inside], height)
    bending = np.trapezoid(((height - y) * np.cos(a)) ** 2 / (modulus * 2 / 3 * x**3), y)
    area = np.trapezoid(1 / (2 * x), y)
    return 1e3 * (bending + 1.2 * np.cos(a) ** 2 / shear * area + np.sin(a) ** 2 / modulus * area)


@pytest.mark.parametrize("plane", ["stress", "strain"])
def test_beam_integrals_against_a_fine_polygon(tooth, plane):
    modulus = E if plane == "stress" else E / (1 - NU**2)
    load = loads(tooth)
    np.testing.assert_allclose(compliance_of(load, plane), integrate(load, modulus, E / (2 * (1 + NU))), rtol=2e-6)


def test_beam_of_an_undercut_tooth():
    load = loads(outline(jg.Gear(11, 3.0, face_width=10.0)))
    np.testing.assert_allclose(compliance_of(load, "stress"), integrate(load, E, E / (2 * (1 + NU))), rtol=1e-5)


def test_crossing_below_the_fillet_junction():
    """Contact so low that the load line crosses the centreline inside the fillet: the integral ends there."""
    tooth = outline(jg.Gear(60, 2.0, face_width=10.0))
    load = jax.jit(tooth_load)(tooth, np.full(9, tooth.form_roll_length))
    crossing, junction = float(load.height[0]), float(tooth.junction_height)
    assert crossing < junction
    np.testing.assert_allclose(compliance_of(load, "stress"), integrate(load, E, E / (2 * (1 + NU))), rtol=1e-5)


def test_quadrature_has_converged(tooth):
    load = loads(tooth)
    fine = compliance_of(load, "stress", jg.compliance.Beam(nodes=40))
    np.testing.assert_allclose(compliance_of(load, "stress"), fine, rtol=1e-7)


def test_load_line(tooth):
    """Tangent to the base circle, normal to the involute, and through the centreline at height and depth."""
    load = loads(tooth)
    load = jax.tree.map(np.asarray, load)
    x, y = map(np.asarray, jax.jit(involute_point)(tooth.gear, load.roll_length))
    a = load.angle
    along = np.stack([-np.cos(a), -np.sin(a)])  # from the flank into the tooth
    np.testing.assert_allclose(x + load.depth * along[0], 0.0, atol=1e-13)
    np.testing.assert_allclose(y + load.depth * along[1], load.height, atol=1e-10)
    np.testing.assert_allclose(np.abs(x * along[1] - y * along[0]), tooth.gear.base_radius, rtol=1e-13)
    # the contact stands a roll length away from the tangent point on the base circle
    np.testing.assert_allclose(x**2 + y**2, load.roll_length**2 + tooth.gear.base_radius**2, rtol=1e-13)


def test_scaling():
    """Per unit width compliance does not depend on the module, is inverse to the modulus, and grows towards the tip."""

    @jax.jit
    def compliance(module, modulus=E):
        material = jg.Material(elastic_modulus=modulus)
        tooth = outline(jg.Gear(19, module, face_width=10.0, material=material))
        low, high = tooth.form_roll_length, tooth.gear.tip_roll_length
        return jg.compliance.Beam().compliance(
            tooth_load(tooth, low + jnp.asarray([0.2, 0.6, 1.0]) * (high - low)), "strain"
        )

    reference = compliance(3.0)
    np.testing.assert_allclose(compliance(7.0), reference, rtol=1e-9)
    np.testing.assert_allclose(compliance(3.0, 0.5 * E), 2 * reference, rtol=1e-12)
    assert (np.diff(reference) > 0).all()


@jax.jit
def single_tooth(gear, radii):
    """Compliance of beam, ring and hub in plane stress and strain at radii of contact [mm]."""
    tooth, body = outline(gear), jg.compliance.ElasticRing()
    load = tooth_load(tooth, jg.geometry.roll_length(gear, 2 * radii)[None])
    planes = "stress", "strain"
    own = [jg.compliance.Beam().compliance(load, p)[0] + body.compliance(load, 1, p)[0, 0] for p in planes]
    return jnp.stack(own) + body.hub(tooth)


@pytest.mark.parametrize(("teeth", "module", "ratio", "radii", "stress", "strain", "tolerance"), FINITE_ELEMENTS)
def test_single_tooth_compliance_against_finite_elements(teeth, module, ratio, radii, stress, strain, tolerance):
    """Beam, ring and hub together. Softest agreement on the thinnest ring with the fewest teeth, close to its root."""
    gear = jg.Gear(teeth, module, face_width=10.0, bore_diameter=module * (teeth - 2.5) / ratio)
    found = np.asarray(single_tooth(gear, jnp.asarray((*radii, radii[-1])[:3])))
    for total, reference in zip(found, (stress, strain)):
        np.testing.assert_allclose(1e3 * total[: len(radii)], reference, rtol=tolerance)
