"""Hertzian contact laws against textbook numbers, their limits, and what the solver needs of them."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxgear as jg
from jaxgear.compliance.hertz import ContactGeometry, ContactSide, contact_geometry
from jaxgear.compliance.tooth import tooth_load
from jaxgear.geometry import outline

E, NU = 206e3, 0.3
LAWS = {
    "constant": jg.compliance.ConstantHertz(),
    "depth": jg.compliance.DepthReferenced(),
    "weber": jg.compliance.Weber(),
    "power": jg.compliance.NonlinearPower(),
    "johnson": jg.compliance.CenterDistance(),
    "kovalskii": jg.compliance.Kovalskii(),
    "palmgren": jg.compliance.Palmgren(),
}
# total approach of two steel flanks in plane strain at 266 N/mm, radii 10.26 mm, depths 1.67 mm, face width 20 mm
EXAMPLE = {"constant": 1.50, "weber": 4.61, "power": 4.32, "johnson": 7.93, "kovalskii": 8.25, "palmgren": 7.9}


def side(radius, depth, plane="strain", young=E):
    modulus, poisson = (young, NU) if plane == "stress" else (young / (1 - NU**2), NU / (1 - NU))
    return {
        "radius": radius, "depth": depth, "young": young, "modulus": modulus, "poisson": poisson,
        "strain_modulus": young / (1 - NU**2),
    }  # fmt: skip


PLACES = 61


@eqx.filter_jit
def _curve(law, q, sides, width):
    """Approach with its slope and curvature over the line load, by one program for each law."""
    field = lambda value: jnp.full((1, 1, 1), value)  # noqa: E731
    both = (ContactSide(**{name: field(value) for name, value in each.items()}) for each in sides)
    prepared = law.prepare(ContactGeometry(*both, field(width)))

    def deflection(load):
        return prepared.deflection(load[None, None])[0, 0]

    def slope(load):
        return jax.jvp(deflection, (load,), (jnp.ones_like(load),))[1]

    return deflection(q), *jax.jvp(slope, (q,), (jnp.ones_like(q),))


def curve(law, q, radii=(10.26, 10.26), depths=(1.67, 1.67), plane="strain", moduli=(E, E), width=20.0):
    """Approach [um], slope and curvature at up to `PLACES` line loads [N/mm]."""
    sides = [side(r, h, plane, young) for r, h, young in zip(radii, depths, moduli)]
    numbers = jax.tree.map(jnp.asarray, (np.resize(np.asarray(q, float), PLACES), sides, width))
    return [np.asarray(part)[: len(q)] for part in _curve(law, *numbers)]


def approach(law, q, *given, **options):
    """Approach [um] at line loads [N/mm]."""
    return curve(law, q, *given, **options)[0]


@pytest.mark.parametrize("name", EXAMPLE)
def test_published_example(name):
    tolerance = 0.06 if name == "palmgren" else 0.006
    assert float(approach(LAWS[name], [266.0])[0]) == pytest.approx(EXAMPLE[name], abs=tolerance)


def test_depth_law_is_the_integral_of_the_strain_below_the_contact():
    """Strain along the axis of a Hertzian pressure (plane strain; McEwen), integrated from the surface to the depth."""
    q, radius, depth = 400.0, 8.0, 1.5
    reduced_modulus = E / (2 * (1 - NU**2))
    a = np.sqrt(4 * q * (radius / 2) / (np.pi * reduced_modulus))
    p0 = 2 * q / (np.pi * a)
    z = a * np.sinh(np.linspace(0.0, np.arcsinh(depth / a), 20001))
    root = np.sqrt(1 + (z / a) ** 2)
    sigma_x = -p0 * ((1 + 2 * (z / a) ** 2) / root - 2 * z / a)
    sigma_z = -p0 / root
    strain = -(1 - NU**2) / E * (sigma_z - NU / (1 - NU) * sigma_x)
    total = 2 * np.trapezoid(strain, z) * 1e3
    law = approach(jg.compliance.DepthReferenced(), [q], (radius, radius), (depth, depth))
    assert float(law[0]) == pytest.approx(total, rel=1e-6)


def test_depth_law_turns_into_weber_for_deep_teeth():
    q = np.array([1.0, 50.0, 500.0])
    errors = []
    for depth in (1.67, 5.0, 15.0):
        exact, weber = (approach(LAWS[n], q, depths=(depth, depth)) for n in ("depth", "weber"))
        errors.append(np.abs(exact / weber - 1).max())
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 2e-5


@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize("name", LAWS)
def test_laws_increase_from_zero_with_finite_slope(name, plane):
    q = np.append(0.0, np.geomspace(1e-8, 5000.0, PLACES - 1))
    value, slope, curvature = curve(LAWS[name], q, plane=plane)
    assert value[0] == 0.0
    assert np.all(np.diff(value) > 0)
    assert np.all((slope > 0) & np.isfinite(slope) & np.isfinite(curvature))
    if name != "constant":
        assert np.all(np.diff(slope) <= 1e-12), "Hertzian contacts stiffen under load"


@pytest.mark.parametrize("name", LAWS)
def test_laws_are_symmetric_in_the_two_flanks(name):
    q = np.array([20.0, 300.0])
    one = approach(LAWS[name], q, (7.0, 20.0), (1.2, 1.9), moduli=(E, 0.5 * E))
    other = approach(LAWS[name], q, (20.0, 7.0), (1.9, 1.2), moduli=(0.5 * E, E))
    np.testing.assert_allclose(one, other, rtol=1e-13)


def test_logarithmic_laws_differ_by_their_constants_only():
    """Johnson - Weber = 2 q / (pi E') per body times (ln(2 R / h) - 1/2 + nu'/2), at any load."""
    q, modulus, poisson = 266.0, E / (1 - NU**2), NU / (1 - NU)
    difference = float((approach(LAWS["johnson"], [q]) - approach(LAWS["weber"], [q]))[0])
    bracket = np.log(2 * 10.26 / 1.67) - 0.5 + poisson / 2
    assert difference == pytest.approx(1e3 * 2 * 2 * q / (np.pi * modulus) * bracket, rel=1e-9)


def test_plane_of_the_compliance_model_reaches_the_contact_law():
    """Plane stress keeps E and nu; the constant law is plane strain in any case."""
    q = np.array([266.0])
    a = np.sqrt(4 * 266.0 * 5.13 / np.pi * 2 / E)
    by_hand = 1e3 * 2 * 2 * 266.0 / (np.pi * E) * (np.log(2 * 1.67 / a) - NU / 2)
    assert float(approach(LAWS["weber"], q, plane="stress")[0]) == pytest.approx(by_hand, rel=1e-7)
    stress, strain = (float(approach(LAWS["constant"], q, plane=p)[0]) for p in ("stress", "strain"))
    assert stress == strain == pytest.approx(1e3 * 4 * (1 - NU**2) * 266.0 / (np.pi * E), rel=1e-12)


def test_local_geometry_of_a_pair():
    """Radii, depths and moduli reach the law; width factor a^2 / q = 4 R / (pi E*)."""
    soft = jg.Material(elastic_modulus=100e3, poisson_ratio=0.35)
    pinion, wheel = jg.Gear(19, 3.0, face_width=10.0), jg.Gear(48, 3.0, face_width=10.0, material=soft)
    loads = [tooth_load(outline(g), jnp.asarray([[12.0], [9.0]])) for g in (pinion, wheel)]
    geometry = contact_geometry(*loads, "strain", jnp.asarray(10.0))
    np.testing.assert_allclose(geometry.wheel.modulus, 100e3 / (1 - 0.35**2), rtol=1e-14)
    np.testing.assert_allclose(geometry.wheel.poisson, 0.35 / 0.65, rtol=1e-14)
    np.testing.assert_allclose(geometry.pinion.depth[:, 0], loads[0].depth, rtol=1e-14)
    compliance = (1 - NU**2) / E + (1 - 0.35**2) / 100e3
    np.testing.assert_allclose(
        geometry.width_factor[:, 0, 0], 4 / np.pi * np.array([6.0, 4.5]) * compliance, rtol=1e-13
    )
