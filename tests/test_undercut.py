"""Undercut pinions: the path of contact begins at their form circle; a tip that hits material is refused."""

import jax.numpy as jnp
import numpy as np
import pytest

import jaxgear as jg
from jaxgear.contact.kinematics import contacts
from jaxgear.geometry import outline
from jaxgear.numerics import program


def gears(teeth=12, mate=40, angle=20.0, **rack):
    pinion = jg.Gear(teeth, 2.0, angle, face_width=10.0, **rack)
    return pinion, jg.Gear(mate, 2.0, angle, face_width=10.0)


def test_path_of_contact_begins_at_the_form_circle():
    """12/40 with a root radius of 0.3: contact ratio 1.254 of a rack-cut pinion, 1.64 if its involute went on."""
    pair = jg.GearPair(*gears(root_radius=0.3))
    path, margins = jg.path_of_contact(pair), jg.margins(pair)
    assert float(path.contact_ratio) == pytest.approx(1.254, abs=5e-4)
    form = float(outline(pair.pinion).form_roll_length)
    assert float(path.pinion_roll_length(path.start)) == pytest.approx(form, rel=1e-12)
    assert (
        float(margins.pinion_form_clearance) == pytest.approx(-float(path.start_shortened)) and path.start_shortened > 1
    )
    assert bool(margins.valid) and float(margins.pinion_fillet_clearance) > 0
    assert float(path.end_shortened) == 0 and float(path.wheel_roll_length(path.start)) < pair.wheel.tip_roll_length


def test_a_tip_that_hits_the_fillet_is_refused():
    """The same gears cut by a rack that is no deeper than the mate's addendum: 84 um into the material."""
    with pytest.raises(ValueError, match="wheel tip_diameter reaches the pinion's flank"):
        jg.GearPair(*gears(root_radius=0.3, dedendum=1.0))


def test_less_than_one_pair_in_contact_is_refused_but_of_helical_gears_in_total():
    with pytest.raises(ValueError, match="contact ratio = 0.897"):
        jg.GearPair(*gears(teeth=8, root_radius=0.3))
    helical = [jg.Gear(z, 2.0, face_width=30.0, helix_angle=b) for z, b in ((8, 15.0), (9, -15.0))]
    path = jg.path_of_contact(jg.GearPair(*helical))
    assert 0.5 < float(path.contact_ratio) < 1
    assert path.inner_single == path.start and path.outer_single == path.end


@program
def points_before_the_start(pair, x):
    contact = jg.path_of_contact(pair)
    return contacts(pair, contact, contact.start - x)


def test_the_edge_of_the_undercut_touches_the_mate_before_the_path_begins():
    """Gap by turning the wheel against all points of the generated tooth, its fillet included."""
    pair = jg.GearPair(*gears(root_radius=0.3))
    x = np.asarray([0.05, 0.3, 0.8])
    found, path, drawn = points_before_the_start(pair, x), jg.path_of_contact(pair), outline(pair.pinion)
    (r1, c1), (r2, c2) = (
        (float(path.pinion_base_radius), float(path.pinion_pitch_roll_length)),
        (float(path.wheel_base_radius), float(path.wheel_pitch_roll_length)),
    )
    working, distance = np.arctan(c1 / r1), float(pair.working_center_distance)
    rolls = np.linspace(float(drawn.form_roll_length), float(pair.pinion.tip_roll_length), 4001)
    fillet = np.asarray(drawn.curves.over((1000,)).trochoid(jnp.linspace(drawn.junction, np.pi / 2, 1000)))
    # polar coordinates of the flank, from the line of centres towards the side of recess with the contact at roll 0
    radius = np.r_[np.hypot(r1, rolls), np.hypot(*fillet)]
    turned = np.r_[-(rolls / r1 - np.arctan(rolls / r1)), np.arctan2(*fillet) - float(drawn.curves.base_half_angle)]
    gaps = []
    for s in float(path.start) - x:
        angle = (c1 + s) / r1 - working + turned
        along, across = distance - radius * np.cos(angle), radius * np.sin(angle)
        reached = np.hypot(along, across)
        on_flank = (reached > r2) & (reached < float(pair.wheel.tip_radius))
        rho = np.sqrt(reached[on_flank] ** 2 - r2**2)
        flank = (c2 - s) / r2 - working - (rho / r2 - np.arctan(rho / r2))
        gaps.append(1e3 * r2 * np.min(-flank - np.arctan2(across, along)[on_flank]))
    np.testing.assert_allclose(found.corner_gap, gaps, atol=2e-3)
    np.testing.assert_allclose(found.pinion_roll_length, float(drawn.form_roll_length), rtol=1e-12)
    assert np.all(np.diff(found.wheel_roll_length) > 0) and np.all(np.asarray(found.beyond_tip) == 0)


@pytest.mark.slow
def test_an_undercut_pinion_under_load_touches_beyond_the_form_circle_with_its_edge():
    """Contact goes on before the start, as it does with tip corners; nothing jumps there and the load is carried."""
    mesh = jg.prepare(jg.GearPair(*gears(root_radius=0.3)), resolution=jg.Resolution(positions=32))
    cycle = jg.solve(mesh, 5.0)
    assert bool(cycle.converged.all()) and np.all(np.isfinite(cycle.transmission_error))
    np.testing.assert_allclose(jnp.sum(cycle.pair_force, axis=0), cycle.force, rtol=1e-9)
    before = np.asarray(mesh.path)[:, 0] < float(mesh.path_of_contact.start)
    assert np.asarray(cycle.pair_force)[before].max() > 0.05 * float(cycle.force)
    edge = np.asarray(cycle.corner_pressure)[:, 0][before]
    assert edge.max() > 0 and np.all(np.asarray(cycle.contact_pressure)[:, 0][before] == 0)
