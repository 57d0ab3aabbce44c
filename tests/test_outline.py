"""The generated tooth outline: trochoid, its junction with the involute, undercut."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxgear as jg
from jaxgear.geometry import outline
from jaxgear.geometry.involute import half_tooth_angle
from jaxgear.geometry.outline import involute_point, trochoid

ROOT_HALF_ANGLES = {17: 0.177, 20: 0.15064, 30: 0.10043, 48: 0.063, 50: 0.06026}


def gear(teeth, module=1.0, shift=0.0, **rack):
    return jg.Gear(teeth, module, 20.0, shift, face_width=10.0, **rack)


@pytest.mark.parametrize("teeth", [19, 20, 30, 43, 48])
def test_fillet_meets_the_involute_tangentially(teeth):
    tooth = outline(gear(teeth))
    assert float(tooth.undercut) == 0.0
    g = jnp.deg2rad(20.0)
    x, y = trochoid(tooth.gear, g)
    assert float(jnp.arctan2(x, y)) == pytest.approx(
        float(half_tooth_angle(tooth.gear, tooth.form_roll_length)), abs=1e-12
    )
    np.testing.assert_allclose((x, y), involute_point(tooth.gear, tooth.form_roll_length), rtol=1e-12)
    np.testing.assert_allclose(float(tooth.junction_height), y, rtol=1e-14)

    _, fillet = jax.jvp(lambda g: trochoid(tooth.gear, g), (g,), (-jnp.ones_like(g),))
    rho = tooth.form_roll_length
    _, flank = jax.jvp(lambda r: involute_point(tooth.gear, r), (rho,), (jnp.ones_like(rho),))
    assert float(jnp.arctan2(*fillet)) == pytest.approx(float(jnp.arctan2(*flank)), abs=1e-9)


@pytest.mark.parametrize(("teeth", "angle"), ROOT_HALF_ANGLES.items())
def test_fillet_starts_on_the_root_circle(teeth, angle):
    tooth = outline(gear(teeth, 2.0))
    x, y = trochoid(tooth.gear, jnp.asarray(jnp.pi / 2))
    radius = float(tooth.gear.root_circle_radius)
    assert float(jnp.hypot(x, y)) == pytest.approx(radius, rel=1e-14)
    assert float(tooth.root_half_angle) == pytest.approx(angle, abs=6e-4 if angle in (0.177, 0.063) else 6e-6)
    assert float(tooth.root_height) == pytest.approx(float(y), rel=1e-14)
    # the root circle is the envelope of the tool tip: the fillet leaves it tangentially
    _, direction = jax.jvp(lambda g: trochoid(tooth.gear, g), (jnp.asarray(jnp.pi / 2),), (jnp.ones(()),))
    assert float(x * direction[0] + y * direction[1]) == pytest.approx(0.0, abs=1e-10)


def test_form_diameter_of_iso_21771():
    tooth = outline(gear(30, 2.0))
    assert float(jg.geometry.diameter(tooth.gear, tooth.form_roll_length)) == pytest.approx(57.068, abs=5e-4)
    alpha = np.deg2rad(20.0)
    depth = 1.25 - 0.38 * (1 - np.sin(alpha))
    printed = np.hypot(60 * np.sin(alpha) - 2 * depth * 2.0 / np.sin(alpha), 60 * np.cos(alpha))
    assert float(jg.geometry.diameter(tooth.gear, tooth.form_roll_length)) == pytest.approx(printed, rel=1e-13)


def undercut_limit(teeth, dedendum=1.25, radius=0.38):
    """Least profile shift without undercut."""
    sine = np.sin(np.deg2rad(20.0))
    return dedendum - radius * (1 - sine) - teeth * sine**2 / 2


@pytest.mark.parametrize("teeth", [8, 12, 16])
def test_undercut_begins_at_the_limiting_profile_shift(teeth):
    limit = undercut_limit(teeth)
    assert float(outline(gear(teeth, shift=limit + 1e-6)).undercut) == 0.0
    assert float(outline(gear(teeth, shift=limit - 1e-6)).undercut) == 1.0
    assert float(outline(gear(teeth, shift=limit)).form_roll_length) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(("teeth", "shift"), [(12, 0.0), (10, 0.0), (8, 0.2), (14, -0.1)])
def test_undercut_junction_lies_on_both_curves(teeth, shift):
    tooth = outline(gear(teeth, 3.0, shift))
    assert float(tooth.undercut) == 1.0
    on_fillet = trochoid(tooth.gear, tooth.junction)
    on_flank = involute_point(tooth.gear, tooth.form_roll_length)
    np.testing.assert_allclose(on_fillet, on_flank, atol=1e-9)
    assert float(tooth.form_roll_length) > 0.1, "the cut lies above the base circle"
    # the first crossing from above: everywhere higher the fillet lies outside the tooth
    above = trochoid(tooth.gear, jnp.linspace(jnp.deg2rad(20.0), float(tooth.junction) - 1e-3, 30))
    radius = jnp.hypot(*above)
    valid = radius > tooth.gear.base_radius
    rho = jnp.sqrt(jnp.maximum(radius**2 - tooth.gear.base_radius**2, 0.0))
    excess = jnp.arctan2(*above) - half_tooth_angle(tooth.gear, rho)
    assert bool(jnp.all(jnp.where(valid, excess, 1.0) > 0))


def test_more_undercut_with_fewer_teeth():
    heights = [float(jg.geometry.diameter(t.gear, t.form_roll_length)) / float(t.gear.base_radius) for t in
               (outline(gear(z)) for z in (15, 12, 9))]  # fmt: skip
    assert heights[0] < heights[1] < heights[2]


@pytest.mark.parametrize(("teeth", "shift"), [(30, 0.2), (12, -0.05)])
def test_derivatives_of_the_outline_by_module_and_shift(teeth, shift):
    """Also through the root of the undercut junction; all lengths scale with the module."""

    def numbers(x):
        tooth = outline(jg.Gear(float(teeth), x[0], 20.0, x[1], face_width=10.0))
        return jnp.stack([tooth.form_roll_length, tooth.root_half_angle, tooth.junction, tooth.junction_height])

    x, h = jnp.asarray([2.0, shift]), 1e-6
    around = x[None] + h * jnp.asarray([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    value, jacobian, steps = jax.jit(lambda x, a: (numbers(x), jax.jacfwd(numbers)(x), jax.vmap(numbers)(a)))(x, around)
    np.testing.assert_allclose(jacobian.T, (steps[:2] - steps[2:]) / (2 * h), rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(jacobian[:, 0] * 2.0, value * jnp.asarray([1.0, 0.0, 0.0, 1.0]), atol=1e-9)


HELICAL = {
    # form diameters that listings print for the generating profile shift
    82.843: dict(teeth=25, module=3.0, profile_shift=0.2611, helix_angle=30.0, dedendum=1.25, root_radius=0.38),
    132.673: dict(teeth=40, module=3.0, profile_shift=-0.1527, helix_angle=-30.0, dedendum=1.25, root_radius=0.38),
    126.527: dict(teeth=25, module=5.0, profile_shift=0.2184, helix_angle=20.0, dedendum=1.25, root_radius=0.30),
    328.991: dict(teeth=24, module=14.0, profile_shift=0.48, helix_angle=10.0, dedendum=1.25, root_radius=0.38),
}


@pytest.mark.parametrize("printed", HELICAL)
def test_the_tip_circle_of_the_rack_is_that_of_the_normal_section(printed):
    """Form diameters as printed; the transverse section of the rack's tip touches the whole fillet from outside."""
    helical = jg.Gear(face_width=30.0, **HELICAL[printed])
    tooth = outline(helical)
    # the shift is printed with four digits
    rounded = 0.5e-4 * 2 * float(helical.module) / np.sin(float(helical.transverse_pressure_angle))
    assert float(jg.geometry.diameter(helical, tooth.form_roll_length)) == pytest.approx(printed, abs=5e-4 + rounded)
    np.testing.assert_allclose(
        trochoid(helical, tooth.junction), involute_point(helical, tooth.form_roll_length), rtol=1e-12
    )

    r, m, cosine = (float(each) for each in (helical.pitch_radius, helical.module, helical.helix_cosine))
    alpha, height, rho = np.deg2rad(20.0), HELICAL[printed]["dedendum"] * m, HELICAL[printed]["root_radius"] * m
    centre = (
        np.pi * m / 4 + height * np.tan(alpha) + rho * (1 - np.sin(alpha)) / np.cos(alpha)
    )  # off the tooth's middle
    depth = height - float(helical.profile_shift) * m - rho
    x, y = (np.asarray(each)[:, None] for each in trochoid(helical, jnp.linspace(tooth.junction, jnp.pi / 2, 9)))
    turn = np.linspace(-0.1, 0.4, 20_001)
    along = x * np.cos(turn) - y * np.sin(turn) - (centre / cosine - r * turn)
    above = x * np.sin(turn) + y * np.cos(turn) - (r - depth)
    np.testing.assert_allclose((np.hypot(along * cosine, above) / rho).min(axis=1), 1.0, atol=1e-6)


@pytest.mark.parametrize(
    ("teeth", "helix", "protuberance", "stock"),
    [(25, 20.0, 0.06, 100.0), (14, None, 0.03, 0.0)],
)
def test_a_protuberance_clears_the_root_for_grinding(teeth, helix, protuberance, stock):
    """The tool, rolled along, touches the whole fillet from outside and leaves the stock on the flank above it."""
    m, alpha, rack, shift = 3.0, np.deg2rad(20.0), (1.4, 0.3), 0.1
    ground = jg.Gear(
        teeth, m, 20.0, shift, face_width=20.0, helix_angle=helix, dedendum=rack[0], root_radius=rack[1],
        protuberance=protuberance, grinding_allowance=stock,
    )  # fmt: skip
    tooth, cosine, r = outline(ground), float(ground.helix_cosine), float(ground.pitch_radius)
    fed = shift * m + 1e-3 * stock / np.sin(alpha)
    lean, rho, pr = alpha / 2, rack[1] * m, protuberance * m
    across = (
        np.pi * m / 4 - rack[0] * m * np.tan(alpha) + pr / np.cos(alpha) - rho * (1 - np.sin(alpha)) / np.cos(alpha)
    )
    depth = rack[0] * m - fed - rho

    def half_width(y):
        """Of the tool in the normal section, at a depth below the pitch line; it ends at its tip."""
        end = depth + rho * np.sin(lean)
        straight = across + rho * np.cos(lean) + (end - y) * np.tan(lean)
        arc = across + np.sqrt(np.maximum(rho**2 - (y - depth) ** 2, 0.0))
        tool = np.where(y < end, np.maximum(np.pi * m / 4 - (y + fed) * np.tan(alpha), straight), arc)
        return np.where(y > depth + rho + 1e-9, -np.inf, tool)

    def gap(points):
        """Least distance to the tool along its pitch line in any position."""
        x, y = (np.asarray(each)[:, None] for each in points)
        turn = np.linspace(-0.6, 0.6, 24_001)
        beside = (np.pi * m / (2 * cosine) - r * turn - (x * np.cos(turn) - y * np.sin(turn))) * cosine
        return (beside - half_width(r - (x * np.sin(turn) + y * np.cos(turn)))).min(axis=1)

    fillet = jnp.linspace(tooth.junction, jnp.pi / 2 - 0.05, 9)
    np.testing.assert_allclose(gap(trochoid(ground, fillet)), 0.0, atol=2e-4)
    assert float(jnp.hypot(*trochoid(ground, jnp.asarray(jnp.pi / 2)))) == pytest.approx(
        r + fed - rack[0] * m, rel=1e-12
    )
    form = tooth.form_roll_length
    np.testing.assert_allclose(trochoid(ground, tooth.junction), involute_point(ground, form), rtol=1e-7)
    left = gap(involute_point(ground, jnp.linspace(form + 1e-3, ground.tip_roll_length - 1e-3, 9)))
    assert (left > -2e-4).all()
    np.testing.assert_allclose(left[-3:], 1e-3 * stock / np.cos(alpha), atol=2e-4)
    plain = outline(jg.Gear(teeth, m, 20.0, shift, face_width=20.0, helix_angle=helix, dedendum=1.4, root_radius=0.3))
    assert form > plain.form_roll_length


@pytest.mark.slow
def test_derivatives_by_protuberance_and_grinding_allowance():
    def numbers(x):
        gear = jg.Gear(25.0, 3.0, 20.0, 0.1, face_width=20.0, protuberance=x[0], grinding_allowance=1e3 * x[1])
        tooth = outline(gear)
        return jnp.stack([tooth.form_roll_length, tooth.root_half_angle, tooth.junction_height])

    x, h = jnp.asarray([0.06, 0.1]), 1e-6
    slopes, steps = jax.jit(
        lambda x: (jax.jacfwd(numbers)(x), [(numbers(x + h * e) - numbers(x - h * e)) / (2 * h) for e in jnp.eye(2)])
    )(x)
    np.testing.assert_allclose(slopes.T, steps, rtol=1e-5, atol=1e-9)
    equal = jax.jit(jax.grad(lambda pr: numbers(jnp.stack([pr, 0.18]))[0]))(0.06)
    assert np.isfinite(equal)
