"""Gears cut by a pinion-type cutter: root circle, fillet, critical section, and what no cutter can cut."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy
from design_texts import loaded, text

import jaxgear as jg
from jaxgear.compliance.finite_element.compliance_table import shape_of
from jaxgear.compliance.finite_element.shape import Shape, Tooth
from jaxgear.geometry import drawn_gear, outline
from jaxgear.geometry.cutter import full_rounding, rolling
from jaxgear.io import DesignFileError
from jaxgear.metrics.stress import critical_section
from jaxgear.rexs import write_rexs


def gear(teeth=25, shift=0.2, **changes):
    return jg.Gear(teeth, 3.0, 20.0, shift, face_width=10.0, **{"cutter_teeth": 30, **changes})


def inv(angle):
    return np.tan(angle) - angle


def working_angle(made):
    """alpha_w0 by a root search of SciPy."""
    alpha, z, z0 = np.deg2rad(20.0), float(made.teeth), float(made.cutter_teeth)
    x0 = float(made.cutter_profile_shift)
    wanted = inv(alpha) + 2 * (float(made.generating_profile_shift) + x0) / (z + z0) * np.tan(alpha)
    return scipy.optimize.brentq(lambda angle: inv(angle) - wanted, 0.05, 1.2, xtol=1e-15)


SHAPES = [
    dict(teeth=25, shift=0.2, cutter_teeth=30, cutter_profile_shift=0.1, tooth_thickness_allowance=-80.0),
    dict(teeth=10, shift=0.0, cutter_teeth=24, cutter_profile_shift=-0.2, root_radius=0.25),  # undercut
    dict(teeth=60, shift=-0.1, cutter_teeth=20, cutter_profile_shift=0.0, addendum=0.8),  # full radius
]


@pytest.mark.parametrize("shape", SHAPES)
def test_root_circle_by_hand(shape):
    made = gear(**shape)
    z, z0, x0 = (float(each) for each in (made.teeth, made.cutter_teeth, made.cutter_profile_shift))
    distance = 1.5 * (z + z0) * np.cos(np.deg2rad(20.0)) / np.cos(working_angle(made))
    tip_diameter = 3.0 * (z0 + 2 * x0 + 2 * 1.25)
    assert float(2 * made.root_circle_radius) == pytest.approx(2 * distance - tip_diameter, rel=1e-14)
    assert float(made.cutter.center_distance) == pytest.approx(distance, rel=1e-14)
    assert float(jnp.hypot(*outline(made).curves.trochoid(jnp.asarray(jnp.pi / 2)))) == pytest.approx(
        float(made.root_circle_radius), rel=1e-14
    )


def test_a_rack_is_a_cutter_with_many_teeth():
    """Fillet, diameters and root section within 1e-5 of the rack's closed forms, with and without undercut.

    The eight steps of the standard give the chord of twelve teeth to 1e-5.
    """
    for teeth in (25, 12):
        rack, many = gear(teeth, 0.0, cutter_teeth=None), gear(teeth, 0.0, cutter_teeth=1e6, cutter_profile_shift=0.1)
        first, second = outline(rack), outline(many)
        g = jnp.linspace(float(first.junction), jnp.pi / 2, 9)
        points = (np.stack(each.curves.over(g.shape).trochoid(g)) for each in (first, second))
        np.testing.assert_allclose(*points, rtol=1e-5)
        for one, other in (
            (rack.root_circle_radius, many.root_circle_radius),
            *((jg.geometry.diameter(each.gear, each.form_roll_length) for each in (first, second)),),
            *zip(jax.tree.leaves(critical_section(rack)), jax.tree.leaves(critical_section(many))),
        ):
            assert float(one) == pytest.approx(float(other), rel=1e-5 if teeth == 25 else 2e-5)
        assert float(first.undercut) == float(second.undercut) == (teeth == 12)


@pytest.mark.parametrize(
    ("teeth", "cutter_teeth", "module", "angle", "height", "radius", "root", "form"),
    [
        (64, 25, 3.0, 20.0, 1.25, 0.25, 199.5, 197.9505),
        (48, 24, 2.0, 25.0, 1.05, 0.2, 100.2, 99.5919),
        (91, 30, 2.0, 20.0, 1.6, 0.0502, 188.4, 187.4021),  # full radius of the cutter
    ],
)
def test_internal_gears_are_those_of_negative_teeth(teeth, cutter_teeth, module, angle, height, radius, root, form):
    """Root and form diameters of rings, found from their outlines."""
    cutter = rolling(
        -teeth, cutter_teeth, module=module, pressure_angle=angle, generating_shift=0.0, cutter_shift=0.0,
        height=height, radius=radius,
    )  # fmt: skip
    assert -2 * cutter.root_circle_radius == pytest.approx(root, rel=1e-12)
    assert 2 * np.hypot(cutter.gear_base_radius, cutter.form_roll_length) == pytest.approx(form, abs=1e-4)
    assert full_rounding(30, 20.0, 0.0, 1.6) == pytest.approx(0.0502, abs=5e-5)


def cutter_tooth(made):
    """Half angle of the cutter's tooth over the radius, by its involute and a circle that touches it and the tip."""
    z0, x0 = float(made.cutter_teeth), float(made.cutter_profile_shift)
    alpha, base = np.deg2rad(20.0), 1.5 * z0 * np.cos(np.deg2rad(20.0))
    tip, rho = 3.0 * (0.5 * z0 + x0 + 1.25), 3.0 * float(made.root_radius)

    def flank(radius):
        return (0.5 * np.pi + 2 * x0 * np.tan(alpha)) / z0 + inv(alpha) - inv(np.arccos(base / radius))

    radii = np.linspace(base, tip, 40_001)
    x, y = radii * np.sin(flank(radii)), radii * np.cos(flank(radii))

    def apart(angle):
        return np.hypot(x - (tip - rho) * np.sin(angle), y - (tip - rho) * np.cos(angle))

    angle = scipy.optimize.brentq(lambda angle: apart(angle).min() - rho, -1e-3, flank(tip - rho), xtol=1e-13)
    touched = radii[apart(angle).argmin()]

    def half_angle(radius):
        center = tip - rho
        arc = angle + np.arccos(np.clip((radius**2 + center**2 - rho**2) / (2 * radius * center), -1, 1))
        inside = np.where(radius < touched, flank(np.maximum(radius, base)), arc)
        return np.where(radius > tip, -np.inf, inside)

    return half_angle


@pytest.mark.parametrize("shape", SHAPES)
def test_the_cutter_touches_fillet_and_flank_and_removes_neither(shape):
    """The whole tooth of the cutter, rolled through the space: every point of the outline is touched from outside."""
    made = gear(**shape)
    tooth, half_angle, ratio = outline(made), cutter_tooth(made), float(made.teeth / made.cutter_teeth)
    distance = float(made.base_radius + made.cutter.base_radius) / np.cos(working_angle(made))
    turn = np.linspace(-0.8, 0.8, 40_001)
    at = np.pi / float(made.teeth) + turn  # of the cutter's axis, from the middle of the gear's tooth

    def gap(points):
        x, y = (np.asarray(each)[:, None] for each in points)
        beside, above = x - distance * np.sin(at), y - distance * np.cos(at)
        seen = np.arctan2(beside, above) - (at + np.pi + turn * ratio)
        seen = (seen + np.pi) % (2 * np.pi) - np.pi
        radius = np.hypot(beside, above)
        return (radius * (np.abs(seen) - half_angle(radius))).min(axis=1)

    g = jnp.linspace(tooth.junction, jnp.pi / 2 - 0.03, 9)
    rho = jnp.linspace(tooth.form_roll_length + 1e-3, made.tip_roll_length, 5)
    np.testing.assert_allclose(gap(tooth.curves.over(g.shape).trochoid(g)), 0.0, atol=2e-5)
    np.testing.assert_allclose(gap(tooth.curves.over(rho.shape).involute(rho)), 0.0, atol=2e-5)
    np.testing.assert_allclose(
        tooth.curves.trochoid(tooth.junction), tooth.curves.involute(tooth.form_roll_length), rtol=1e-10
    )
    assert float(tooth.undercut) == (shape["teeth"] == 10)


@pytest.mark.parametrize("shape", SHAPES)
def test_critical_section_is_where_the_fillet_is_inclined_by_30_degrees(shape):
    """By differences along the fillet: chord, depth and radius of curvature."""
    made = gear(**shape)
    section = critical_section(made)
    g = jnp.linspace(0.5, 1.5, 100_001)
    x, y = (np.asarray(each) for each in outline(made).curves.over(g.shape).trochoid(g))
    there = int(np.abs(x - 0.5 * float(section.chord)).argmin())
    near = slice(there - 300, there + 301)
    t = np.linspace(-1.0, 1.0, 601)
    (_, x1, x2), (_, y1, y2) = (np.polynomial.polynomial.polyfit(t, each[near], 5)[:3] for each in (x, y))
    assert abs(np.rad2deg(np.arctan(x1 / y1))) == pytest.approx(30.0, abs=2e-3)
    assert float(section.depth) == pytest.approx(y[there], abs=1e-4)
    radius = np.hypot(x1, y1) ** 3 / abs(2 * x1 * y2 - 2 * y1 * x2)
    assert float(section.fillet_radius) == pytest.approx(radius, rel=1e-4)


def test_derivatives_against_differences():
    """Along one direction of module, profile shift, shift, addendum and tip radius, with and without undercut."""

    def numbers(x, teeth):
        made = jg.Gear(
            teeth, x[0], 20.0, x[1], face_width=10.0, cutter_teeth=24.0,
            cutter_profile_shift=x[2], dedendum=x[3], root_radius=x[4],
        )  # fmt: skip
        tooth, section = outline(made), critical_section(made)
        return jnp.stack([tooth.form_roll_length, tooth.root_half_angle, tooth.junction_height,
                          made.root_circle_radius, section.chord, section.fillet_radius])  # fmt: skip

    x, along, h = jnp.asarray([3.0, 0.1, -0.1, 1.25, 0.25]), jnp.asarray([0.7, 1.0, -0.6, 0.5, -0.8]), 1e-6
    with_slope = jax.jit(lambda x, teeth: jax.jvp(lambda x: numbers(x, teeth), (x,), (along,)))
    for teeth in (30.0, 10.0):
        (above, _), (below, _), (_, slope) = (with_slope(x + step * along, teeth) for step in (h, -h, 0.0))
        np.testing.assert_allclose(slope, (above - below) / (2 * h), rtol=1e-6, atol=1e-8)


def test_a_tip_without_room_is_rounded_as_a_whole():
    made = gear(60, -0.1, cutter_teeth=20, addendum=0.8)
    assert float(made.root_radius) < 0.38 and "(full radius of the cutter)" in str(made)
    assert float(made.cutter.tip_half_width) == pytest.approx(0.0, abs=1e-12)
    assert float(outline(made).root_half_angle) == pytest.approx(np.pi / 60, rel=1e-12)
    traced = jax.jit(lambda x: gear(60, -0.1, cutter_teeth=20, addendum=0.8, cutter_profile_shift=x).root_radius)
    assert float(traced(0.0)) == pytest.approx(float(made.root_radius), rel=1e-12)
    assert float(gear(cutter_teeth=60).root_radius) == 0.38


def test_cutter_room_tells_traced_gears():
    """Negative where a concrete gear is refused: too large a radius, a pointed cutter, one that does not reach."""

    def made(teeth, shift, radius):
        return gear(60, 0.0, cutter_teeth=teeth, cutter_profile_shift=shift, root_radius=radius)

    jax.jit(lambda width: jg.Gear(25, 3.0, face_width=width, cutter_teeth=30).face_width)(10.0)
    room = jax.jit(lambda *numbers: made(*numbers).cutter_room)
    assert float(room(30.0, 0.0, 0.3)) > 0
    for teeth, shift, radius in ((30.0, 0.0, 0.5), (30.0, 1.5, 0.1), (12.0, 0.0, 0.1)):
        assert float(room(teeth, shift, radius)) < 0
        with pytest.raises(ValueError, match=r"root_radius = 0.5|pointed|generates the flank"):
            made(teeth, shift, radius)
    wheel = jg.Gear(40, 3.0, face_width=10.0)
    held = jax.eval_shape(lambda radius: jg.margins(jg.GearPair(gear(root_radius=radius), wheel)).held, 0.25)
    assert "pinion_cutter_room" in held and "wheel_cutter_room" not in held


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        (
            {"cutter_teeth": None, "cutter_profile_shift": 0.1},
            "Gear: cutter_teeth: missing, cutter_profile_shift needs",
        ),
        ({"cutter_teeth": 20.5}, "Gear: cutter_teeth = 20.5 must be a whole number"),
        ({"cutter_teeth": 4}, "Gear: cutter_teeth = 4 must be at least 5"),
        ({"protuberance": 0.02}, "Gear: protuberance: must be left out beside cutter_teeth"),
        ({"cutter_profile_shift": 1.5}, "profile_shift = 1.5 x module .* makes the teeth of the cutter pointed"),
        ({"cutter_profile_shift": -1.5, "dedendum": 0.5}, "puts the tip of the cutter inside its base circle"),
        ({"root_radius": 0.5}, "Gear: root_radius = 0.5 x module must be at least 0 x module and at most 0.39"),
        ({"teeth": 60, "cutter_teeth": 12}, "cutter_teeth = 12 generates the flank up to diameter 18.* at least 18"),
    ],
)
def test_what_no_cutter_cuts_is_refused(changes, expected):
    with pytest.raises(ValueError, match=expected) as error:
        gear(**changes)
    assert "\n" not in str(error.value)


def test_drawings_give_root_and_form_diameter():
    """In place of the cutter's addendum and radius."""
    made = gear(cutter_profile_shift=0.1, dedendum=1.3, root_radius=0.2)
    form = jg.geometry.diameter(made, outline(made).form_roll_length)
    given = dict(teeth=25, module=3.0, profile_shift=0.2, face_width=10.0, cutter_teeth=30, cutter_profile_shift=0.1)
    drawn = drawn_gear(**given, root_diameter=2 * made.root_circle_radius, root_form_diameter=form)
    assert float(drawn.dedendum) == pytest.approx(1.3, rel=1e-12)
    assert float(drawn.root_radius) == pytest.approx(0.2, rel=1e-9)
    deep = drawn_gear(**given, root_diameter=2 * made.root_circle_radius)
    assert float(deep.cutter.tip_half_width) == pytest.approx(0.0, abs=1e-12)


def test_finite_elements_know_the_cutter():
    made = gear(cutter_profile_shift=0.1, root_radius=0.25, tooth_thickness_allowance=-80.0)
    shape, tooth = Shape(*map(float, shape_of(made, "stress"))), outline(made)
    numbers = Tooth(shape)
    g = jnp.linspace(float(tooth.junction), jnp.pi / 2, 7)
    np.testing.assert_allclose(3 * numbers.trochoid(np.asarray(g)), tooth.curves.over(g.shape).trochoid(g), rtol=1e-12)
    for found, wanted in (
        (3 * numbers.root, made.root_circle_radius),
        (3 * numbers.form_roll_length, tooth.form_roll_length),
        (numbers.junction, tooth.junction),
    ):
        assert found == pytest.approx(float(wanted), rel=1e-12)
    rack = Shape(*map(float, shape_of(gear(cutter_teeth=None, root_radius=0.25), "stress")))
    assert len(rack.numbers) == 9 and len(shape.numbers) == 11
    assert shape.cutter_teeth == 30 and shape.cutter_profile_shift == pytest.approx(0.1)


def test_design_files_have_a_cutter(tmp_path):
    """With its shift as a variable."""
    cutter = "root_radius = 0.25\ncutter_teeth = 40\ncutter_profile_shift = 'sharpened'"
    design = loaded(tmp_path, text(pinion=cutter, tail="[variables]\nsharpened = { low = -0.1, high = 0.3 }"))
    pinion = design.pair().pinion
    assert float(pinion.cutter_teeth) == 40 and float(pinion.cutter_profile_shift) == pytest.approx(0.1)
    with pytest.raises(DesignFileError, match="pinion.cutter_teeth: missing, cutter_profile_shift needs it"):
        loaded(tmp_path, text(pinion="cutter_profile_shift = 0.1"))
    with pytest.raises(DesignFileError, match='did you mean "cutter_teeth"'):
        loaded(tmp_path, text(pinion="z_0 = 30"))


def test_exchange_files_refuse_a_cutter(tmp_path):
    pair = jg.GearPair(gear(root_radius=0.25), jg.Gear(40, 3.0, face_width=10.0))
    with pytest.raises(ValueError, match="write_rexs: pinion cutter_teeth = 30 must be left out"):
        write_rexs(tmp_path / "pair.xml", pair)
