"""Helical gears on shafts: axial forces and their moments by the statics of free bodies, and the contact on them."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from contact_problems import influence
from gearboxes import STIFF, E, G, gearbox, inertia, shear_area
from helical_pairs import SIZES, TORQUE, pair_of

import jaxgear as jg
from jaxgear.contact.status import Status
from jaxgear.layout import at_stations, level_load
from jaxgear.shafts import (
    Bearing,
    Coupling,
    Gearbox,
    GearMesh,
    MountedGear,
    Section,
    Shaft,
    ShaftLoad,
    annex_e,
    bearing_reactions,
    support,
)
from jaxgear.shafts.gearbox import axes_of

BETA, MOMENT = 15.0, 60.0
SHAFTS = replace(SIZES, face_modes=SIZES.slices)  # bends over the face in as many polynomials as there are slices
Y = jnp.linspace(-8.0, 8.0, 4)


def two_stages(first, second, direction="counterclockwise", angle=100.0):
    """Three shafts, all gears helical, pinions of these angles; the second mesh turned against the first one."""
    (p1, w1), (p2, w2) = pair_of(first).gears, pair_of(second).gears

    def shaft(name, names, gears, couplings, loads=()):
        bearings = [Bearing(names[0], 10, 500.0, 80.0), Bearing(names[1], 140, 300.0, tilting=2e4)]
        return Shaft(name, [Section(150, 36)], bearings, gears, couplings, loads)

    push = ShaftLoad(120.0, (30.0, -400.0, 70.0), (2.0, -3.0))
    shafts = [
        shaft("in", "AB", [MountedGear("p1", p1, 50)], [Coupling(0.0, MOMENT)]),
        shaft("middle", "CD", [MountedGear("w1", w1, 50), MountedGear("p2", p2, 100)], []),
        shaft("out", "EF", [MountedGear("w2", w2, 90)], [Coupling(150.0)], [push]),
    ]
    return Gearbox(shafts, [GearMesh("p1", "w1", 20.0), GearMesh("p2", "w2", angle)], None, direction)


@pytest.mark.parametrize(
    "first, second, direction",
    [(15.0, 10.0, "counterclockwise"), pytest.param(15.0, -10.0, "clockwise", marks=pytest.mark.slow)],
)
def test_the_gearbox_is_in_equilibrium(first, second, direction):
    """Bearings, couplings and the load from outside, in all six directions, about the left end of the first shaft."""
    box = two_stages(first, second, direction)
    found = np.asarray(bearing_reactions(box).force)
    axes = np.repeat(axes_of(box), 2, axis=0) + [[0, 0, at] for at in (10, 140) * 3]
    arms, forces = axes, found[:, :3]
    ratio = float(box.pair(0).gear_ratio * box.pair(1).gear_ratio)
    sense = 1 if direction == "counterclockwise" else -1
    # torques as they are given are positive where they drive; the last shaft turns as the first one does
    torque = sense * 1e3 * MOMENT * (1 - ratio)
    load = box.shafts[2].loads[0]
    at, force = axes_of(box)[2] + [0, 0, 120], np.asarray(load.force)
    np.testing.assert_allclose(forces.sum(axis=0), force, atol=1e-6)
    moment = np.cross(arms, forces).sum(axis=0)
    moment[:2] += found[:, 3:].sum(axis=0)
    np.testing.assert_allclose(moment, np.cross(at, force) + [2e3, -3e3, torque], rtol=1e-9, atol=1e-3)


@pytest.mark.parametrize("beta, direction, sign", [(15, "counterclockwise", 1), (15, "clockwise", -1)])
def test_the_thumb_of_its_hand_shows_where_a_driving_pinion_is_pushed(beta, direction, sign):
    """Fingers in the direction of rotation; F_ax = 2 T sin(beta) / (m z)."""
    for hand in (1, -1):
        axial = np.asarray(bearing_reactions(two_stages(hand * beta, 10.0, direction)).force)[:2, 2].sum()
        np.testing.assert_allclose(axial, hand * sign * 2e3 * MOMENT * np.sin(np.deg2rad(beta)) / (3.0 * 19), rtol=1e-9)


def test_gears_of_one_hand_on_an_intermediate_shaft_relieve_its_bearings():
    """The wheel is driven there and the pinion drives; forces are alike where sin(beta) is as the numbers of teeth."""
    other = float(np.rad2deg(np.arcsin(np.sin(np.deg2rad(BETA)) * 19 / 48)))
    relieved, loaded = (
        np.asarray(bearing_reactions(two_stages(BETA, angle)).force)[2:4, 2].sum() for angle in (-other, other)
    )
    force = 2e3 * MOMENT * np.sin(np.deg2rad(BETA)) / (3.0 * 19)
    np.testing.assert_allclose([relieved, loaded], [0.0, -2 * force], atol=1e-6)


def test_the_axial_force_bends_the_shaft_by_its_moment():
    """A beam on two supports under force and moment, by the influence of a force and its derivatives (reciprocity)."""
    pair, length, middle = pair_of(BETA), 120.0, 60.0
    stiff = jg.Material(elastic_modulus=1e9 * E)

    def shaft(name, names, gear, coupling, material):
        held = [Bearing(names[0], 0, STIFF, STIFF), Bearing(names[1], length, STIFF)]
        return Shaft(name, [Section(length, 30)], held, [MountedGear(name, gear, middle)], [coupling], (), material)

    shafts = [
        shaft("p", "AB", pair.pinion, Coupling(0.0, MOMENT), jg.STEEL),
        shaft("w", "CD", pair.wheel, Coupling(length), stiff),
    ]
    found = np.asarray(support(Gearbox(shafts, [GearMesh("p", "w")])).influence(Y))

    def force(s, t):
        # on either side of the force; where both meet the derivatives below do so too
        a, b = jnp.where(s <= t, s, t), length - jnp.where(s <= t, t, s)
        return a * b * (length**2 - a**2 - b**2) / (6 * E * inertia(30) * length)

    def over(function):
        return np.asarray(jax.vmap(lambda s: jax.vmap(lambda t: function(s, t))(middle + Y))(middle + Y))

    alpha, slope = pair.working_pressure_angle, float(pair.path_slope)
    arm = slope * float(pair.pinion.base_radius / jnp.cos(alpha))
    moment = over(jax.grad(force, 1))
    both = over(jax.grad(jax.grad(force, 1), 0)) + 1 / (length * G * shear_area(30))
    bent = over(force) + float(jnp.sin(alpha)) * arm * (moment + moment.T) + arm**2 * both
    a, b = over(jnp.minimum), length - over(jnp.maximum)
    shear, stretch = a * b / (length * G * shear_area(30)), slope**2 * a / (E * np.pi / 4 * 30**2)
    twist = float(pair.pinion.base_radius) ** 2 * (a - middle + 10.0) / (G * 2 * inertia(30))
    np.testing.assert_allclose(found, 1e3 * (bent + shear + stretch + twist), rtol=1e-6)
    assert np.abs(found - 1e3 * (over(force) + shear + stretch + twist)).max() > 0.02 * found.max()


@pytest.mark.slow
def test_mirrored_gearboxes_turn_their_influence_round():
    """About a plane across the shafts face coordinates change sign, about one along them the sense of rotation."""
    right, left = pair_of(BETA, 18.0), pair_of(-BETA, 18.0)
    found = support(gearbox(pair=right))
    influence = np.asarray(found.influence(Y))
    other = support(gearbox(pair=left, mirrored=True)).influence(Y)
    np.testing.assert_allclose(other[::-1, ::-1], influence, rtol=1e-9)
    turned = support(gearbox(pair=left, direction="clockwise"))
    np.testing.assert_allclose(turned.influence(Y), influence, rtol=1e-9)
    assert float(turned.pair.pinion.helix_angle) == BETA
    assert np.abs(support(gearbox(pair=left)).influence(Y) - influence).max() > 0.01 * influence.max()


@pytest.mark.slow
def test_flank_lines_level_helical_gears_on_shafts():
    """Of a mirrored gearbox the slope changes sign; the hand alone changes what the moments tilt."""

    def levelled(beta, mirrored):
        box = gearbox(pair=pair_of(beta, 18.0), mirrored=mirrored, torque=TORQUE)
        face = at_stations(support(box), stations=21)
        line = level_load(face)
        load = [annex_e(face, face.torque, wheel=each, stations=21) for each in (None, line.modification)]
        factors = [float(one.face_load_factor) for one in load]
        assert factors[1] < 1.02 < factors[0]
        return np.array([line.slope, line.crowning])

    right, mirrored, left = levelled(BETA, False), levelled(-BETA, True), levelled(-BETA, False)
    np.testing.assert_allclose(mirrored, right * [-1, 1], rtol=1e-6)
    assert np.abs(left - right).max() > 1.0


def supported(pair, slope=4.0, **given):
    mesh = jg.prepare(pair, resolution=SHAFTS, support=support(gearbox(pair=pair, torque=TORQUE, **given)))
    cycle = jg.solve(mesh, TORQUE, pinion=jg.LeadSlope(slope))
    assert bool(cycle.converged.all())
    return mesh, cycle


@pytest.fixture(scope="module")
def on_shafts():
    return supported(pair_of(BETA, 18.0))


@pytest.mark.slow
def test_contact_on_shafts_meets_the_conditions(on_shafts):
    mesh, cycle = on_shafts
    assert mesh.support is not None and mesh.support_gap is not None
    load, lever = np.asarray(cycle.line_load), np.asarray(mesh.lever)
    deflected = np.einsum("psjtn,jtn->psn", influence(mesh.coupling, mesh.slice_width), load)
    bent = np.asarray(mesh.support.influence(mesh.face_coordinate))
    alone = jg.prepare(mesh.pair, resolution=mesh.resolution).coupling  # bodies lean as on rigid shafts
    bent = bent + np.asarray(alone.support_modes @ alone.support @ alone.support_modes.T)
    deflected += lever * float(mesh.slice_width[0]) * np.einsum("st,jtn,jtn->sn", bent, lever, load)
    approach = np.asarray(cycle.transmission_error) - float(mesh.hub * cycle.force / mesh.pair.face_width)
    law = np.asarray(mesh.law.deflection(jnp.asarray(load)))
    left = deflected + law + np.asarray(cycle.gap) - lever * approach
    assert left.min() > -1e-8 and np.abs(left[load > 0]).max() < 1e-8
    np.testing.assert_allclose(cycle.pair_force.sum(axis=0), cycle.force, rtol=1e-10)


@pytest.mark.slow
def test_a_mirrored_gearbox_mirrors_the_contact(on_shafts):
    _, other = supported(pair_of(-BETA, 18.0), -4.0, mirrored=True)
    np.testing.assert_allclose(other.transmission_error, on_shafts[1].transmission_error, rtol=1e-9)
    np.testing.assert_allclose(other.line_load[:, ::-1], on_shafts[1].line_load, atol=1e-6)


@pytest.mark.slow
def test_a_small_angle_goes_to_spur_gears_on_shafts():
    _, spur = supported(pair_of(None, 18.0))
    _, small = supported(pair_of(1e-6, 18.0))
    np.testing.assert_allclose(small.transmission_error, spur.transmission_error, atol=1e-6)
    np.testing.assert_allclose(small.line_load, spur.line_load, atol=1e-3)


def test_a_shaft_that_nothing_holds_along_its_axis_is_refused():
    pair = pair_of(BETA)
    ends = [Bearing("A", 0, 500.0), Bearing("B", 120, 500.0)]
    with pytest.raises(ValueError, match='the axial force of gear "p" needs a bearing of axial stiffness') as refused:
        Shaft("in", [Section(120, 30)], ends, [MountedGear("p", pair.pinion, 60)])
    assert len(str(refused.value).splitlines()) == 1

    def status(beta):
        box = gearbox(pair=pair_of(beta, 18.0))
        shafts = [replace(each, bearings=[replace(one, axial=0.0) for one in each.bearings]) for each in box.shafts]
        return replace(box, shafts=shafts).status

    assert jax.jit(status)(BETA) == Status.SUPPORT_NOT_POSSIBLE
