"""Elastic lines, bearings and torsion of shafts against closed forms, equilibrium and reciprocity."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from gearboxes import PINION, STIFF, WHEEL, E, G, inertia, shear_area, two_stages

import jaxgear as jg
from jaxgear.shafts import (
    Bearing,
    Coupling,
    Gearbox,
    GearMesh,
    MatrixBearing,
    MountedGear,
    Section,
    Shaft,
    ShaftLoad,
    bearing_reactions,
    elastic_line,
    integral_diameter,
    support,
)
from jaxgear.shafts.stepped_beam import shear_coefficient

NO_LOAD = ShaftLoad(0.0)
NO_TORQUE = Coupling(0.0, 0.0), Coupling(0.0)
PIECES = 4


def alone(sections, bearings, loads=(NO_LOAD,), couplings=NO_TORQUE, gears=()):
    """One shaft; pieces, bearings and couplings that change nothing make its program that of the other ones."""
    last, share = sections[-1], PIECES - len(sections) + 1
    pieces = [Section(last.length / share, last.diameter, last.bore)] * share
    if len(bearings) < 2:
        bearings = [*bearings, Bearing("B", 0.0, 0.0)]
    return Gearbox([Shaft("s", [*sections[:-1], *pieces], bearings, gears, couplings, loads)], [])


def line_of(gearbox, at):
    """At up to three places."""
    return elastic_line(gearbox, "s", jnp.asarray(np.resize(np.asarray(at, float), 3)))


def displacement(gearbox, at):
    """At up to three places."""
    return np.asarray(line_of(gearbox, at).displacement)[: len(at)]


def test_cantilever_with_force_and_moment_has_its_closed_form():
    length, force, moment = 200.0, 500.0, 30.0
    wall = Bearing("A", 0.0, STIFF, STIFF, 1e4 * STIFF)
    load = ShaftLoad(length, (force, 0.0, 1e3), (0.0, moment))
    found = displacement(alone([Section(length, 40, 20)], [wall], [load]), [length])[0]
    bending, m = E * inertia(40, 20), 1e3 * moment
    x = force * (length**3 / (3 * bending) + length / (G * shear_area(40, 20))) + m * length**2 / (2 * bending)
    ry = force * length**2 / (2 * bending) + m * length / bending
    z = 1e3 * length / (E * np.pi / 4 * (40**2 - 20**2))
    np.testing.assert_allclose(found[[0, 4]], 1e3 * np.array([x, ry]), rtol=1e-8)
    np.testing.assert_allclose(found[2], 1e3 * z, rtol=1e-6)
    np.testing.assert_array_equal(found[[1, 3]], 0.0)


def test_both_planes_bend_alike():
    wall = Bearing("A", 0.0, STIFF, 0.0, 1e4 * STIFF)
    one = alone([Section(150, 30)], [wall], [ShaftLoad(150, (100.0, 0, 0), (0.0, 5.0))])
    other = alone([Section(150, 30)], [wall], [ShaftLoad(150, (0.0, 100.0, 0), (-5.0, 0.0))])
    x, y = displacement(one, [90.0])[0], displacement(other, [90.0])[0]
    np.testing.assert_allclose(y[[1, 3]], [x[0], -x[4]], rtol=1e-12)


def test_beam_on_two_supports_has_its_closed_form():
    length, a, force = 300.0, 120.0, 1000.0
    b = length - a
    ends = [Bearing("A", 0.0, STIFF), Bearing("B", length, STIFF)]
    box = alone([Section(length, 35)], ends, [ShaftLoad(a, (0.0, force, 0.0))])
    bending = 3 * E * inertia(35) * length
    under = force * a**2 * b**2 / bending + force * a * b / (length * G * shear_area(35))
    np.testing.assert_allclose(displacement(box, [a])[0, 1], 1e3 * under, rtol=1e-8)
    reactions = bearing_reactions(box)
    np.testing.assert_allclose(reactions.force[:, 1], [force * b / length, force * a / length], rtol=1e-10)


def test_stepped_cantilever_adds_the_pieces_up():
    """Tip deflection of two sections: that of the root piece under force and moment, its slope, that of the tip."""
    l1, l2, d1, d2, force = 80.0, 120.0, 50.0, 30.0, 300.0
    wall = Bearing("A", 0.0, STIFF, 0.0, 1e4 * STIFF)
    box = alone([Section(l1, d1), Section(l2, d2)], [wall], [ShaftLoad(l1 + l2, (force, 0, 0))])
    b1, b2, m = E * inertia(d1), E * inertia(d2), force * l2
    step = force * l1**3 / (3 * b1) + m * l1**2 / (2 * b1) + force * l1 / (G * shear_area(d1))
    slope = force * l1**2 / (2 * b1) + m * l1 / b1
    tip = step + slope * l2 + force * l2**3 / (3 * b2) + force * l2 / (G * shear_area(d2))
    np.testing.assert_allclose(displacement(box, [l1, l1 + l2])[:, 0], 1e3 * np.array([step, tip]), rtol=1e-8)


def test_torsion_of_a_stepped_shaft_between_two_couplings():
    ends = [Bearing("A", 0.0, STIFF), Bearing("B", 200.0, STIFF)]
    box = alone([Section(80, 50), Section(120, 30, 10)], ends, couplings=[Coupling(20.0, 40.0), Coupling(170.0)])
    twist = np.concatenate([line_of(box, at).twist for at in ([0.0, 20.0, 80.0], [170.0, 200.0])])[:5]
    first, second = 60 / (2 * inertia(50)), 90 / (2 * inertia(30, 10))
    # what leaves on the right turns back what is right of the coupling that drives
    expected = -40e6 / G * np.array([0.0, 0.0, first, first + second, first + second])
    np.testing.assert_allclose(twist, expected, rtol=1e-8, atol=1e-12)


def test_shear_coefficient_is_cowpers():
    np.testing.assert_allclose(shear_coefficient(jnp.asarray(0.0), jnp.asarray(0.3)), 6 * 1.3 / (7 + 6 * 0.3))
    np.testing.assert_allclose(
        shear_coefficient(jnp.asarray(1.0), jnp.asarray(0.3)), 2 * 1.3 / (4 + 3 * 0.3)
    )  # thin tube


@pytest.fixture(scope="module")
def reducer():
    """Torque comes in from both sides of its pinion."""
    return two_stages(further=[Coupling(150.0, -15.0)])


# points over the face and their shares of it: everywhere as many, so that there is one program
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(4)
WEIGHTS = WEIGHTS / 2
Y = jnp.asarray(9.0 * POINTS)


def test_torque_grows_with_the_ratio(reducer):
    np.testing.assert_allclose(reducer.pinion_torques(), [45.0, 45.0 * 48 / 19], rtol=1e-12)
    assert reducer.path.turning == (1, -1, 1)


def test_bearing_forces_balance_mesh_forces_and_loads(reducer):
    reactions = bearing_reactions(reducer)
    force, at = np.asarray(reactions.force), {"A": 10, "B": 140, "C": 10, "D": 140, "E": 10, "F": 140}
    base = np.array([float(PINION.base_radius), float(WHEEL.base_radius)])
    first, second = 45e3 / base[0], 45e3 * 48 / 19 / base[0]
    alpha = np.deg2rad(20.0)
    turned = np.deg2rad(100.0)
    normal = [np.array([np.sin(alpha), np.cos(alpha)])]
    # the middle shaft turns clockwise: forwards is (sin, -cos) of the angle
    forwards = np.array([np.sin(turned), -np.cos(turned)])
    normal.append(np.cos(alpha) * forwards + np.sin(alpha) * np.array([np.cos(turned), np.sin(turned)]))
    loads = {
        "in": [(50, -first * normal[0])],
        "middle": [(50, first * normal[0]), (100, -second * normal[1])],
        "out": [(100, second * normal[1]), (180, np.array([0.0, -400.0]))],
    }
    for index, (name, carried) in enumerate(loads.items()):
        own = slice(2 * index, 2 * index + 2)
        places = np.array([at[bearing] for bearing in reactions.names[own]])
        np.testing.assert_allclose(force[own, :2].sum(0), sum(f for _, f in carried), rtol=1e-9, err_msg=name)
        # moments about x and y: y z and x z
        moments = np.array([sum(z * f[0] for z, f in carried), sum(z * f[1] for z, f in carried)])
        held = places @ force[own, :2] + np.array([force[own, 4].sum(), -force[own, 3].sum()])
        np.testing.assert_allclose(held, moments, rtol=1e-9, err_msg=name)


@pytest.mark.parametrize("mesh", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_influence_is_symmetric_and_definite(reducer, mesh):
    matrix = np.asarray(support(reducer, mesh).influence(Y))
    np.testing.assert_allclose(matrix, matrix.T, rtol=1e-12)
    assert np.linalg.eigvalsh(matrix)[0] > 0


def face(gearbox, mesh=0):
    return np.asarray(support(gearbox, mesh).influence(Y)), np.asarray(support(gearbox, mesh).gap(Y))


def single(angle=0.0, exit_at=0.0, direction="counterclockwise", wheel_at=60.0, back=0.0, stiffer=160_000, **load):
    """One stage on rigid bearings; the pinion's torque comes in at a place, some of it leaves behind the other end, the
    wheel shaft gives way to nothing.
    """
    into = Shaft(
        "in",
        [Section(120, 30)],
        [Bearing("A", 0, STIFF), Bearing("B", 120, STIFF)],
        [MountedGear("p", PINION, 60)],
        [Coupling(exit_at, 60.0), Coupling(120.0, -back)],
        [ShaftLoad(30.0, **{"force": (0.0, 0.0, 0.0), **load})],
    )
    out = Shaft(
        "out",
        [Section(120, 30)],
        [Bearing("C", 0, STIFF), Bearing("D", 120, STIFF)],
        [MountedGear("w", WHEEL, wheel_at)],
        [Coupling(120.0)],
        material=jg.Material(elastic_modulus=stiffer * E),
    )
    return Gearbox([into, out], [GearMesh("p", "w", angle)], direction=direction)


@pytest.mark.slow
def test_influence_is_that_of_a_simple_beam_and_a_bar_in_torsion():
    """Deflection under the force in the middle, and r_b^2 times the twist from the end where the torque comes in."""
    s = 60.0 + np.asarray(Y)
    length, modulus, radius = 120.0, E * inertia(30), float(PINION.base_radius)
    a, b = np.minimum(s[:, None], s), length - np.maximum(s[:, None], s)
    bending = a * b * (length**2 - a**2 - b**2) / (6 * modulus * length)
    shear = a * b / length / (G * shear_area(30))
    twist = radius**2 * (a - (60.0 - 9.0)) / (G * 2 * inertia(30))
    found, gap = face(single())
    # the wheel shaft is 160000 times as stiff in bending, and in torsion on a radius 2.5 times as large
    np.testing.assert_allclose(found, 1e3 * (bending + shear + twist), rtol=3e-3)
    np.testing.assert_allclose(gap, 0.0, atol=1e-12)
    mirrored, _ = face(single(exit_at=120.0))
    np.testing.assert_allclose(mirrored[::-1, ::-1], found, rtol=1e-3)


@pytest.mark.parametrize("turned", [{"angle": 70.0}, pytest.param({"direction": "clockwise"}, marks=pytest.mark.slow)])
def test_influence_knows_no_direction_of_the_mesh_on_round_bearings(turned):
    np.testing.assert_allclose(support(single(**turned)).influence(Y), support(single()).influence(Y), rtol=1e-9)


def test_an_external_load_counts_along_the_line_of_action():
    """Pushing the pinion against the mesh closes the gap, across it nothing happens."""
    alpha = np.deg2rad(20.0)
    normal = np.array([np.sin(alpha), np.cos(alpha), 0.0])
    along = np.asarray(support(single(force=tuple(500.0 * normal))).gap(Y))
    across = support(single(force=(500.0 * normal[1], -500.0 * normal[0], 0.0))).gap(Y)
    assert (along < -1.0).all()
    np.testing.assert_allclose(across, 0.0, atol=1e-9)
    backwards = np.array([np.sin(alpha), -np.cos(alpha), 0.0])
    turned = support(single(direction="clockwise", force=tuple(500.0 * backwards))).gap(Y)
    np.testing.assert_allclose(turned, along, rtol=1e-9)


def test_force_of_one_mesh_is_in_the_gap_of_the_other_by_reciprocity(reducer):
    """The even force of the second mesh opens the first one as the first one's would open the second, per force."""
    # the load from outside and the torque that passes through the first face are no forces of the meshes
    others = reducer.shafts[2].loads[0].force, reducer.shafts[0].couplings[1].torque
    bare = eqx.tree_at(
        lambda g: (g.shafts[2].loads[0].force, g.shafts[0].couplings[1].torque),
        reducer,
        [0.0 * part for part in others],
    )
    forces = 1e3 * np.asarray(bare.pinion_torques()) / float(PINION.base_radius)
    first, second = (WEIGHTS @ np.asarray(support(bare, mesh).gap(Y)) for mesh in (0, 1))
    # between the faces the middle shaft twists by what both meshes share of it: none of either's own face
    np.testing.assert_allclose(first / forces[1], second / forces[0], rtol=1e-9)


def check_of_elastic_lines(box, names, middle):
    """Under even loads: how far both flanks move along the line of action, up to a rotation of the whole gears.

    The torque of the pinion comes from both its sides, that of the wheel leaves behind its right end.
    """
    radii = float(PINION.base_radius), float(WHEEL.base_radius)
    found, gap = face(box)
    found = found @ (WEIGHTS * 45e3 / radii[0]) + gap
    alpha = np.deg2rad(20.0)
    normal = np.array([np.sin(alpha), np.cos(alpha), 0.0, 0.0, 0.0])
    lines = [elastic_line(box, name, middle + Y) for name in names]
    moved = [np.asarray(line.displacement) @ normal + r * np.asarray(line.twist) for line, r in zip(lines, radii)]
    opening = moved[1] - moved[0]
    np.testing.assert_allclose(found - found.mean(), opening - opening.mean(), atol=1e-9)
    assert np.ptp(found) > 0.3


@pytest.mark.slow
def test_influence_and_gap_are_what_the_elastic_lines_show():
    check_of_elastic_lines(single(back=15.0, stiffer=1, force=(300.0, 200.0, 0.0)), ("in", "out"), 60.0)


@pytest.mark.slow
def test_influence_and_gap_of_two_stages_are_what_the_elastic_lines_show(reducer):
    check_of_elastic_lines(reducer, ("in", "middle"), 50.0)


@pytest.fixture(scope="module")
def idling():
    idler = Shaft(
        "idler", [Section(100, 30)], [Bearing("A", 0, 1e3), Bearing("B", 100, 1e3)], [MountedGear("i", PINION, 50)]
    )
    ends = [
        Shaft(name, [Section(100, 40)], [Bearing(a, 0, 1e3), Bearing(b, 100, 1e3)], [MountedGear(name, WHEEL, 50)], [c])
        for name, a, b, c in (("first", "C", "D", Coupling(0.0, 90.0)), ("last", "E", "F", Coupling(100.0)))
    ]
    return Gearbox([ends[0], idler, ends[1]], [GearMesh("first", "i"), GearMesh("i", "last")])


def test_an_idler_turns_with_the_torque_of_its_first_mesh(idling):
    np.testing.assert_allclose(idling.pinion_torques(), [90.0, 90.0 * 19 / 48], rtol=1e-12)


@pytest.mark.slow
def test_an_idler_twists_between_its_two_meshes(idling):
    """Torque that enters and leaves on the same face leaves no torque outside it."""
    twist = np.asarray(elastic_line(idling, "idler", jnp.array([41.0, 59.0, 100.0])).twist)
    np.testing.assert_allclose(twist, 0.0, atol=1e-12)


@pytest.mark.slow
def test_forces_of_both_meshes_push_an_idler_along_the_tangent(idling):
    """On opposite sides the tangential forces add up, the radial ones cancel."""
    force = np.asarray(bearing_reactions(idling).force)[2:4].sum(0)
    np.testing.assert_allclose(force[0], 0.0, atol=1e-9)
    tangential = 90e3 / float(WHEEL.base_radius) * np.cos(np.deg2rad(20.0))
    np.testing.assert_allclose(abs(force[1]), 2 * tangential, rtol=1e-9)


def test_a_body_stiffens_the_shaft_under_its_face_only():
    assert float(integral_diameter(PINION)) == pytest.approx(57.0 - 3.75)

    def bent(sections, gear):
        held = [Bearing("A", 0, 500.0), Bearing("B", 150, 300.0)]
        box = alone(sections, held, [ShaftLoad(55.0, (100.0, 0.0, 0.0))], gears=[gear])
        return displacement(box, [30.0, 55.0, 100.0])[:, 0]

    def bare(diameter):
        """A body that is no thicker than the shaft, but for rounding: the program of the others."""
        return MountedGear("p", PINION, 50, np.nextafter(diameter, np.inf))

    sections, body = [Section(70, 30), Section(80, 25)], float(integral_diameter(PINION))
    stiff = bent(sections, MountedGear("p", PINION, 50, body))
    by_hand = [Section(41, 30), Section(18, body), Section(11, 30), Section(80, 25)]
    np.testing.assert_allclose(bent(by_hand, bare(body)), stiff, rtol=1e-12)
    assert (bent(sections, bare(30.0)) > stiff).all()
    # a shaft that is thicker than the body already on one side of a step
    thick = [Section(45, 60), Section(105, 30)]
    by_hand = [Section(45, 60), Section(14, body), Section(91, 30)]
    stepped = bent(thick, MountedGear("p", PINION, 50, body)), bent(by_hand, bare(body))
    np.testing.assert_allclose(*stepped, rtol=1e-12)


def shaft(**changes):
    given = {
        "sections": [Section(100, 30)],
        "bearings": [Bearing("A", 0, 1e3), Bearing("B", 100, 1e3)],
        "gears": [MountedGear("p", PINION, 50)],
        "couplings": [Coupling(0.0, 10.0)],
    }
    return Shaft("in", **{**given, **changes})


@pytest.mark.parametrize(
    "make, fault",
    [
        (lambda: shaft(sections=[]), 'Shaft "in": sections must not be empty'),
        (lambda: shaft(bearings=[]), 'Shaft "in": bearings must not be empty'),
        (lambda: shaft(bearings=[Bearing("A", 0, 1e3)]), 'Shaft "in": bearings "A" do not hold it: it needs two'),
        (lambda: shaft(bearings=[Bearing("A", 5, 9.0), Bearing("B", 5, 9.0)]), "do not hold it"),
        (lambda: shaft(bearings=[Bearing("A", 0, 1e3), Bearing("B", 100, 0.0)]), "do not hold it"),
        (
            lambda: shaft(bearings=[Bearing("A", -3, 1e3), Bearing("B", 90, 1e3)]),
            '"A" at -3 mm must lie within',
        ),
        (lambda: shaft(gears=[MountedGear("p", PINION, 95)]), 'gear "p" at 86 to 104 mm must lie within 0 and 100 mm'),
        (lambda: shaft(couplings=[Coupling(120.0)]), "coupling 0 at 120 mm must lie within 0 and 100 mm"),
        (lambda: shaft(loads=[ShaftLoad(20.0, (0, 0, 5.0))]), "an axial load needs a bearing of axial stiffness"),
        (
            lambda: shaft(gears=[MountedGear("p", PINION, 50, 700.0)]),
            'Shaft "in": body_diameter of gear "p" = 700 mm must be less than 63 mm, the tip diameter',
        ),
        (
            lambda: shaft(gears=[MountedGear("p", PINION, 50, 7.0)]),
            'body_diameter of gear "p" = 7 mm has no effect on a shaft of 30 mm: it must be more, or left out',
        ),
        (
            lambda: shaft(sections=[Section(100, 450)]),
            'its diameter under gear "p" is 450 mm, must be less than 63 mm, the tip diameter',
        ),
        (
            lambda: shaft(gears=[MountedGear("p", PINION, 30), MountedGear("q", WHEEL, 47)]),
            'gears "p" at 21 to 39 mm and "q" at 38 to 56 mm must not overlap',
        ),
        (lambda: Section(10.0, 20.0, 25.0), "Section: bore = 25 mm must be less than 20 mm"),
        (lambda: ShaftLoad(20.0, (1.0, 2.0)), r"ShaftLoad: force has shape \(2,\), must be a list of 3 numbers"),
        (lambda: MatrixBearing("A", 0.0, np.eye(4)), r'MatrixBearing "A": stiffness has shape \(4, 4\)'),
        (lambda: MatrixBearing("A", 0.0, np.triu(np.ones((5, 5)))), "stiffness must be symmetric, but"),
        (lambda: MatrixBearing("A", 0.0, -np.eye(5)), "must be positive semidefinite"),
        (lambda: support(two_stages(), 2), "mesh = 2 must be at most 1"),
        (lambda: support(alone([Section(9, 9)], [Bearing("A", 0, 1.0, 0.0, 1.0)])), "gearbox has no mesh"),
        (lambda: elastic_line(two_stages(), "crank", [1.0]), 'shaft "crank" is not known'),
        (lambda: elastic_line(two_stages(), "in", 1e4), "position = 10000 mm must be at least 0 mm"),
        (lambda: Gearbox([], []), "Gearbox: shafts must not be empty"),
    ],
)
def test_refusals(make, fault):
    with pytest.raises(ValueError, match=fault) as caught:
        make()
    assert "\n" not in str(caught.value)


def pair_of(meshes, first=None, second=None, **changes):
    other = {
        "sections": [Section(100, 30)],
        "bearings": [Bearing("C", 0, 1e3), Bearing("D", 100, 1e3)],
        "gears": [MountedGear("w", WHEEL, 50)],
        "couplings": [Coupling(100.0)],
    }
    return Gearbox([shaft(**(first or {})), Shaft("out", **{**other, **(second or {})})], meshes, **changes)


@pytest.mark.parametrize(
    "make, fault",
    [
        (lambda: pair_of([GearMesh("p", "x")]), 'gear "x" is not known, must be one of p, w'),
        (lambda: pair_of([]), 'no mesh joins shaft "in" to "out"'),
        (lambda: pair_of([GearMesh("p", "w"), GearMesh("w", "p")]), "closes a loop"),
        (lambda: pair_of([GearMesh("w", "p")]), 'the torque of gear "w" is .* the pinion of a mesh drives its wheel'),
        (
            lambda: pair_of([GearMesh("p", "w")], {"couplings": [Coupling(0.0)]}),
            "2 couplings have no torque, must be 1",
        ),
        (lambda: pair_of([GearMesh("p", "w")], None, {"couplings": []}), "0 couplings have no torque, must be 1"),
        (lambda: pair_of([GearMesh("p", "w", 0.0, 90.0)]), "center_distance|contact"),
        (
            lambda: pair_of([GearMesh("p", "w")], None, {"bearings": [Bearing("A", 0, 1e3), Bearing("B", 100, 1e3)]}),
            'bearing "A" is given twice',
        ),
    ],
)
def test_gearboxes_that_cannot_be(make, fault):
    with pytest.raises(ValueError, match=fault) as caught:
        make()
    assert "\n" not in str(caught.value)
