"""Flank lines: what they level has closed forms, crowning keeps the load off the edges, lives add up, refusals."""

import importlib
from dataclasses import replace
from types import SimpleNamespace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE
from gearboxes import PINION, WHEEL, gearbox, two_stages

import jaxgear as jg
from jaxgear.contact.kinematics import kinematics
from jaxgear.contact.status import Status
from jaxgear.layout import (
    CASES,
    FlankLine,
    FlankLineTolerance,
    at_stations,
    at_torque,
    damage,
    face_load_over_torques,
    flank_line_tolerance,
    gear_lives,
    helix_slope_limits,
    iso_end_relief_width,
    layout_findings,
    layout_flank_lines,
    least_off_the_edges,
    level_load,
    lives_in_cases,
    longest_life,
    tolerance_cases,
    vary_profiles,
    without_housing,
)
from jaxgear.layout.figures import face_load_factors, tolerance_line_load
from jaxgear.layout.life import damage_of, under_loads
from jaxgear.metrics import removed_at
from jaxgear.metrics.safety import Strength
from jaxgear.metrics.stress import root_factors
from jaxgear.shafts import (
    Housing,
    Misalignment,
    MountedGear,
    RigidSupport,
    annex_e,
    axis_tolerance,
    mesh_stiffness,
    support,
)
from jaxgear.shafts.gearbox import axes_of, tip_clearances
from jaxgear.shafts.mesh_support import even_coordinates
from jaxgear.tolerance import ToleranceClass

PAIR = jg.GearPair(PINION, WHEEL)
WIDTH = 18.0
STATIONS = 21
TORQUE = 150.0
BOX = two_stages()
SUPPORT = support(BOX, 1)
OWN_TORQUE = 60.0 * 48 / 19  # of the couplings; told all the same, so that one program serves every torque
STRENGTH = Strength(
    1500.0, bending=900.0, pitting_exponent=13.2, pitting_cycles=5e7, bending_exponent=8.7, bending_cycles=3e6
)
DUTY = jg.LoadSpectrum.from_hours([60.0, 120.0, 180.0], [3000.0, 500.0, 20.0], [1000.0, 800.0, 500.0])


def rigid(misalignment=0.0):
    return RigidSupport(PAIR, Misalignment(direct=misalignment))


@pytest.fixture(scope="module")
def face():
    return at_stations(SUPPORT, OWN_TORQUE, stations=STATIONS)


def rigid_face(misalignment=0.0):
    """Rigid axes under the torque: one program for them and for bent shafts."""
    return at_stations(rigid(misalignment), TORQUE, stations=STATIONS)


def flat(misalignment=0.0):
    """The same as a table, under every torque."""
    return rigid_face(misalignment).table


@pytest.fixture(scope="module")
def bent(face):
    """The shafts as a table: they bend in proportion to the torque, other meshes and loads open what they do."""
    return face.table


def load_on(face, line=None):
    """Load over the face with a flank line of the wheel."""
    return annex_e(face, torque=face.torque, wheel=(line or FlankLine()).modification, stations=STATIONS)


@pytest.mark.slow
def test_flank_line_of_skewed_rigid_axes_is_their_opposite():
    line = level_load(rigid_face(20.0))
    np.testing.assert_allclose([line.slope, line.crowning], [-20.0, 0.0], atol=1e-9)


def test_flank_line_levels_bent_shafts(face):
    """What is left has neither a slope nor a parabola: both are uncorrelated with the line load."""
    line = level_load(face)
    before, load = load_on(face).face_load_factor, load_on(face, line)
    assert float(before) > 1.2 and float(load.face_load_factor) < 1.001
    # the least squares of the load are where its rest is normal to what both amounts can do to it
    step = 1e-3
    rest = np.asarray(load.line_load) - np.mean(load.line_load)
    for other in (FlankLine(line.slope + step, line.crowning), FlankLine(line.slope, line.crowning + step)):
        moved = np.asarray(load_on(face, other).line_load)
        change = moved - np.asarray(load.line_load)
        assert abs(rest @ change) < 1e-6 * np.linalg.norm(rest) * np.linalg.norm(change) + 1e-9 * np.linalg.norm(change)


def bulged():
    """Barrelled gaps as a crowned pinion makes them."""
    return eqx.tree_at(
        lambda face: face.table.opening,
        at_stations(rigid(8.0), TORQUE, stations=STATIONS),
        replace_fn=lambda gap: gap + 6.0 * np.linspace(-1, 1, STATIONS) ** 2,
    )


@pytest.mark.slow
def test_the_best_crowning_of_barrelled_gaps_is_hollow():
    """The crowning of the wheel is the negative of the pinion's."""
    assert float(level_load(bulged(), negative_crowning=True, stations=STATIONS).crowning) < -5.9


def test_a_flank_line_that_would_be_hollow_has_no_crowning():
    line = level_load(bulged(), stations=STATIONS)
    assert float(line.crowning) == 0.0
    np.testing.assert_allclose(line.slope, -8.0, rtol=1e-6)


def test_couplings_are_scaled_to_a_torque():
    other = at_torque(SUPPORT, 80.0)
    np.testing.assert_allclose(other.torque, 80.0, rtol=1e-12)
    np.testing.assert_allclose(other.gearbox.pinion_torques()[0], 80.0 * 19 / 48, rtol=1e-12)


TOLERANCE = FlankLineTolerance(12.0, 7.0)


@jax.jit
def amounts_of(diameter):
    """Slope, crowning and further crowning over the diameter of the middle shaft, and their derivatives."""

    def amounts(diameter):
        box = eqx.tree_at(lambda box: box.shafts[1].sections[0].diameter, BOX, diameter)
        face = at_stations(support(box, 1), stations=11)
        line = level_load(face, stations=11)
        further = least_off_the_edges(face, TOLERANCE, line=FlankLine(7.0, 2.0), stations=11)
        return jnp.stack([line.slope, line.crowning, further])

    return jax.jvp(amounts, (diameter,), (jnp.ones_like(diameter),))


@pytest.mark.slow
def test_flank_lines_are_differentiable_in_the_shafts():
    at, step = jnp.asarray(36.0), 1e-3
    slopes = (amounts_of(at + step)[0] - amounts_of(at - step)[0]) / (2 * step)
    assert (jnp.abs(slopes) > 1e-4).all()
    np.testing.assert_allclose(amounts_of(at)[1], slopes, rtol=1e-4)


def test_tolerances_are_those_of_the_standards():
    """Maxima add up, statistical limits are the root of their squares; equation 2 of the study."""
    classes = [ToleranceClass.of(gear, grade) for gear, grade in ((PINION, 6), (WHEEL, 7))]
    slopes = [float(one.helix_slope) for one in classes]
    total = max(float(one.helix_total) for one in classes)
    angle = np.deg2rad(20.0)
    axes = 0.5 * total * np.array([np.cos(angle), 2 * np.sin(angle)])  # both grow with L / b, and act over b / L
    most = flank_line_tolerance(PAIR, (6, 7), "class", kind="maximum")
    usual = flank_line_tolerance(PAIR, (6, 7), "class")
    np.testing.assert_allclose([most.helix_slope, most.misalignment], [sum(slopes), axes.sum()], rtol=1e-12)
    np.testing.assert_allclose(
        [usual.helix_slope, usual.misalignment], [np.hypot(*slopes), np.hypot(*axes)], rtol=1e-12
    )
    assert float(flank_line_tolerance(PAIR, 6).misalignment) == 0.0
    np.testing.assert_allclose(helix_slope_limits(PAIR, (6, 7)), slopes, rtol=1e-12)


def test_limits_of_a_drawing_count_over_their_bearing_span():
    """Equation 2 of the study, scaled from the span to the face: of twice the span half of them is left."""
    angle = np.deg2rad(20.0)
    for span in (90.0, 180.0):
        axes = Misalignment(skew=20.0, inclination=30.0, bearing_span=span, direct=2.0)
        parts = np.array([2.0, 20.0 * np.cos(angle) * WIDTH / span, 30.0 * np.sin(angle) * WIDTH / span])
        most, usual = (flank_line_tolerance(PAIR, 6, axes, kind=kind) for kind in ("maximum", "statistical"))
        np.testing.assert_allclose(most.misalignment, parts.sum(), rtol=1e-12)
        np.testing.assert_allclose(usual.misalignment, np.sqrt((parts**2).sum()), rtol=1e-12)
    direct = flank_line_tolerance(PAIR, 6, Misalignment(direct=7.0))
    np.testing.assert_allclose(direct.misalignment, 7.0)
    # those of the standard by the same way, over any span
    limit = max(float(ToleranceClass.of(gear, 6).helix_total) for gear in (PINION, WHEEL))
    given = flank_line_tolerance(PAIR, 6, axis_tolerance(limit, WIDTH, 77.0), kind="maximum")
    by_class = flank_line_tolerance(PAIR, 6, "class", kind="maximum")
    np.testing.assert_allclose(given.misalignment, by_class.misalignment, rtol=1e-12)


@pytest.mark.parametrize("own", [24.0, 60.0])
def test_limits_of_a_wider_gear_count_over_its_own_face(own):
    """The rule grinds f_HbetaT over the gear's face, and a wide gear lets axes deviate as its slope over its width."""
    wide = eqx.tree_at(lambda gear: gear.face_width, PINION, jnp.asarray(own))
    pair = jg.GearPair(wide, WHEEL)
    limits = ToleranceClass.of(wide, 6), ToleranceClass.of(WHEEL, 6)
    further = helix_slope_limits(pair, 6)
    for each, name, limit in zip(further, ("pinion", "wheel"), limits):
        ground = FlankLine(0.0, each).on(pair, name)
        np.testing.assert_allclose(ground.crowning, limit.helix_slope, rtol=1e-12)
    found = flank_line_tolerance(pair, 6, "class", kind="maximum")
    slopes = np.array([limit.helix_slope for limit in limits])
    np.testing.assert_allclose(found.helix_slope, slopes[0] * WIDTH / own + slopes[1], rtol=1e-12)
    # f_Sigma_beta / L = 0.5 F_beta / b of the gear whose helix deviates more per width, here the narrow one
    angle, total = np.deg2rad(20.0), float(limits[1].helix_total)
    assert total / WIDTH > float(limits[0].helix_total) / own
    np.testing.assert_allclose(found.misalignment, 0.5 * total * (np.cos(angle) + 2 * np.sin(angle)), rtol=1e-12)


@pytest.mark.parametrize("given", [None, pytest.param(16.0, marks=pytest.mark.slow)])
def test_cases_of_a_level_rigid_pair_are_straight_lines(given):
    """K = 1 + c f / 2 w at the end, less half a station; opposite deviations are mirror images."""
    stiffness = given or float(mesh_stiffness(PAIR, 1e3 * TORQUE / float(PINION.pitch_radius) / WIDTH))
    found = tolerance_cases(rigid_face(), FlankLineTolerance(4.0, 2.0), stiffness=given)
    mean = 1e3 * TORQUE / float(PINION.base_radius) / WIDTH
    ends = 0.5 * np.array([0.0, 6.0, 2.0, 2.0, 6.0]) * (1 - 1 / STATIONS)
    np.testing.assert_allclose(found.face_load_factor, 1 + stiffness * ends / mean, rtol=1e-12)
    np.testing.assert_array_equal(found.edge_contact, [False, True, True, True, True])
    np.testing.assert_allclose(found.load.line_load[1], found.load.line_load[4][::-1], rtol=1e-12)
    assert len(CASES) == 5 and np.all(found.loaded_share == 1.0)


def test_least_crowning_brings_the_peak_just_inside():
    """Of a rigid pair with gap C (2y/b)^2 + f y/b the load is highest at y = -f b / 8 C: the end needs C = f / 4."""
    slope = 10.0
    tolerance = FlankLineTolerance(slope)
    face = rigid_face()
    found = least_off_the_edges(face, tolerance)
    # both stations at the end carry alike: the peak is between them
    peak = 0.5 - 1.0 / STATIONS
    np.testing.assert_allclose(found, slope / (8 * peak), rtol=1e-4)
    for factor, touches in ((0.9, True), (1.02, False)):
        cases = tolerance_cases(face, tolerance, wheel=FlankLine(0.0, factor * found))
        assert bool(cases.edge_contact.any()) == touches
    stricter = least_off_the_edges(face, tolerance, share=0.8)
    cases = tolerance_cases(face, tolerance, wheel=FlankLine(0.0, stricter))
    load = np.asarray(cases.load.line_load[1])
    np.testing.assert_allclose(max(load[0], load[-1]), 0.8 * load.max(), rtol=1e-4)
    assert float(least_off_the_edges(face, FlankLineTolerance(0.0))) == 0.0


WIDE = jg.GearPair(eqx.tree_at(lambda gear: gear.face_width, PINION, jnp.asarray(30.0)), WHEEL, axial_offset=2.0)


def test_the_least_end_relief_is_as_steep_as_the_deviation():
    """The load of a rigid pair falls from where the relief begins on: C / L = f / b, and K_Hbeta is that there."""
    slope, width = 10.0, 3.0
    found = layout_flank_lines(rigid_face(), FlankLineTolerance(slope), end_relief=width, stations=STATIONS)
    np.testing.assert_allclose(found.needed, slope * width / WIDTH, rtol=1e-9)
    np.testing.assert_allclose(found.further, 0.5 * found.needed)
    assert not found.touches_edges and "step 2, further end relief over 3.00 mm: pinion 0.83 um" in str(found)
    load = np.asarray(found.after["tolerance"].load.line_load[1])
    # all stations of the ramp carry alike
    place = np.flatnonzero(load > load.max() * (1 - 1e-9))
    assert set(place) in ({0, 1, 2, 3}, {17, 18, 19, 20}) and found.after["tolerance"].edge_excess.max() < 1e-9
    for line in (found.pinion, found.wheel):
        assert [end.side for end in line.ends] == ["negative", "positive"] and float(line.crowning) == 0.0
        np.testing.assert_allclose([end.length for end in line.ends], width)


def test_end_reliefs_run_on_over_the_overhangs():
    """On either gear they remove the same of the common face, whose relief is linear."""
    line, y = FlankLine(3.0).further(8.0, 2.5), even_coordinates(WIDTH, STATIONS)
    ramp = 3.0 * y / WIDTH + 8.0 * np.clip(1 - (0.5 * WIDTH - np.abs(y)) / 2.5, 0.0, None)
    for gear, own in (("pinion", WIDE.pinion), ("wheel", WIDE.wheel)):
        ground, middle = line.on(WIDE, gear), WIDE.face_middles[gear == "wheel"]
        depth = ground.slope * (y + middle) / own.face_width
        for end, sign in zip(ground.ends, (-1, 1)):
            from_end = 0.5 * own.face_width - sign * (y + middle)
            depth += end.amount * np.clip(1 - from_end / end.length, 0.0, None)
        # up to what a slope takes off all of the common face
        np.testing.assert_allclose(depth - np.mean(depth), ramp - np.mean(ramp), atol=1e-9)
    shares = helix_slope_limits(WIDE, 6, end_relief=True) / helix_slope_limits(WIDE, 6)
    np.testing.assert_allclose(shares, [30.0 / WIDTH, 1.0], rtol=1e-12)
    np.testing.assert_allclose(iso_end_relief_width(WIDE), 0.1 * WIDTH)


@pytest.mark.slow
@pytest.mark.parametrize("transform", [jax.jacfwd, jax.jacrev])
@pytest.mark.parametrize("width", [2.5, 3.0])
def test_the_least_end_relief_has_derivatives(transform, width):
    def least(slope, width):
        return least_off_the_edges(rigid_face(), FlankLineTolerance(slope), end_relief=width)

    by_slope, by_width = transform(least, argnums=(0, 1))(jnp.asarray(12.0), jnp.asarray(width))
    np.testing.assert_allclose([by_slope, by_width], [width / WIDTH, 12.0 / WIDTH], rtol=1e-6)


@pytest.mark.slow
def test_lives_in_cases_keep_the_end_reliefs():
    line = FlankLine(2.0).further(6.0, 3.0)
    given = flat(), DUTY, STRENGTH
    level, *_ = lives_in_cases(*given, FlankLineTolerance(0.0), wheel=line, stations=STATIONS)
    np.testing.assert_allclose(level, damage(*given, wheel=line, stations=STATIONS).life, rtol=1e-9)
    assert float(level) < float(damage(*given, wheel=FlankLine(2.0), stations=STATIONS).life)


@pytest.fixture(scope="module")
def layout():
    several = {kind: flank_line_tolerance(SUPPORT.pair, 6, "class", kind=kind) for kind in ("statistical", "maximum")}
    options = {"torque": OWN_TORQUE, "gear": "pinion", "stations": STATIONS}
    return layout_flank_lines(SUPPORT, several, further=helix_slope_limits(SUPPORT.pair, 6), **options)


def test_two_steps_keep_the_load_off_the_edges(layout):
    before, after = layout.factors
    assert float(before) > 1.2 and float(after) < 1.001
    assert np.all(layout.before["maximum"].edge_contact[1:]) and not layout.touches_edges
    np.testing.assert_allclose(layout.further, helix_slope_limits(SUPPORT.pair, 6))  # the rule suffices
    assert float(layout.needed) < float(layout.further.sum())
    assert float(layout.after["maximum"].face_load_factor.max()) < float(
        layout.before["maximum"].face_load_factor.max()
    )
    assert float(layout.after["statistical"].face_load_factor[0]) > 1.1  # what it costs without deviations
    np.testing.assert_allclose(layout.pinion.slope, layout.line.slope)
    np.testing.assert_allclose(layout.wheel.crowning, layout.further[1])
    # unmodified flanks in the same cases, of which the first has no deviation
    for of in layout.unmodified.values():
        assert float(of.face_load_factor[0]) == pytest.approx(float(before), rel=1e-9)
    edges = sum(int(of.edge_contact.sum()) for of in layout.unmodified.values())
    assert str(layout).count("*") == edges + 8 + 1  # four cases of both kinds before step 2, and what the mark means


def test_a_load_that_is_not_found_is_not_level(face):
    """Of traced shafts that cannot be: no flank line, no crowning, and an edge that nobody keeps the load off."""
    face = eqx.tree_at(lambda face: face.of_support, face, jnp.int8(Status.SUPPORT_NOT_POSSIBLE))
    tolerance = flank_line_tolerance(SUPPORT.pair, 6, "class")
    line = level_load(face)
    assert np.isnan([line.slope, line.crowning, least_off_the_edges(face, tolerance)]).all()
    cases = tolerance_cases(face, tolerance)
    assert cases.edge_contact.all() and np.isnan(cases.loaded_share).all() and np.isnan(cases.face_load_factor).all()
    with pytest.raises(ValueError, match="^the load over the face did not converge: "):
        layout_flank_lines(face, tolerance, stations=STATIONS)


def softened(radial):
    """The first bearings of the middle and the last shaft with another radial stiffness."""
    return support(
        eqx.tree_at(lambda box: [box.shafts[k].bearings[0].radial for k in (1, 2)], BOX, [np.asarray(radial)] * 2), 1
    )


@pytest.mark.slow
def test_usual_shafts_have_no_finding_and_slips_of_a_unit_do(layout):
    (thick,) = layout_findings(layout, SUPPORT)  # a bore of 40 mm on a shaft of 45 mm
    assert (thick.key, thick.where, thick.value) == ("shaft diameter over bore", 'gear "w2"', 45.0 / 40.0)
    soft = softened(0.1)
    options = {"torque": OWN_TORQUE, "gear": "pinion", "stations": STATIONS}
    found = layout_flank_lines(soft, FlankLineTolerance(8.0), further=helix_slope_limits(SUPPORT.pair, 6), **options)
    told = {
        (finding.key, finding.where): finding for finding in layout_findings(found, soft) if finding.key != thick.key
    }
    bearings = {("radial stiffness", f'bearing "{name}"') for name in "CE"}
    moved = {("radial displacement in modules", f'bearing "{name}"') for name in "CE"}
    flank = {("K_Hbeta", "without modification"), ("slope and crowning in modules", "pinion")}
    # bearings that give way to every deviation leave nothing for the further crowning to save
    idle = {("K_Hbeta of the worst case", "after step 2, tolerance deviations")}
    assert set(told) == bearings | moved | flank | idle
    # nearly all of the load is on one of the stations
    few = told["K_Hbeta", "without modification"]
    assert few.value > 0.5 * STATIONS and few.usual.high == STATIONS / 4
    stiff = layout_findings(layout, softened(5e5))
    assert {finding.key for finding in stiff} == {"radial stiffness", thick.key}
    assert str(stiff[0]).startswith('bearing "C", radial stiffness 500000 N/um is more than 20000 N/um (')


def test_crowning_that_costs_more_than_bending_is_a_finding():
    """Of rigid axes, on which unmodified flanks carry evenly; the contact says the same, or worse."""
    tolerance, lines = FlankLineTolerance(4.0, 2.0), (12.0, 12.0)
    found = layout_flank_lines(rigid(), tolerance, torque=TORQUE, further=lines, stations=STATIONS)
    (level, *_), (crowned, *_) = (of["tolerance"].face_load_factor for of in (found.unmodified, found.after))
    assert float(level) == pytest.approx(1.0) and float(crowned) > 1.2 and float(found.needed) < 0.5 * sum(lines)
    contact = {"unmodified": [1.176, 1.5], "step 1": [1.0, 1.45], "step 2": [1.856, 1.9]}
    told = {(each.key, each.where): each for each in layout_findings(found, rigid(), contact={"tolerance": contact})}
    name, worst = "K_Hbeta without deviations", "K_Hbeta of the worst case"
    of_contact = worst, "after step 2, tolerance deviations, contact analysis"
    of_annex_e = worst, "after step 2, tolerance deviations"
    assert set(told) == {(name, "after step 2"), (name, "after step 2, contact analysis"), of_annex_e, of_contact}
    assert told[of_contact].usual.high == 1.45
    assert str(told[name, "after step 2, contact analysis"]).startswith(
        "after step 2, contact analysis, K_Hbeta without deviations 1.856 is more than 1.411 (more than 1.2 times that"
    )
    least = layout_flank_lines(rigid(), tolerance, torque=TORQUE, stations=STATIONS)
    assert not layout_findings(least, rigid(), contact={"tolerance": contact | {"step 2": [1.3, 1.4]}})


def test_slips_that_the_load_does_not_show_are_findings(layout, monkeypatch):
    """Clearance and axes in mm, a bearing under the teeth, gears that mesh with nothing and hit each other."""
    box = gearbox()
    into, out = box.shafts
    bearings = replace(into.bearings[0], clearance=0.01), into.bearings[1]
    into = replace(into, bearings=bearings, gears=(*into.gears, MountedGear("large", WHEEL, 100.0)))
    bearings = out.bearings[0], replace(out.bearings[1], position=50.0)
    out = replace(out, bearings=bearings, gears=(*out.gears, MountedGear("small", PINION, 100.0)))
    meshes = (replace(box.meshes[0], misalignment=Misalignment(direct=0.02)),)
    box = replace(box, shafts=(into, out), meshes=meshes)
    # none of these is a matter of how far the bearings move
    still = SimpleNamespace(names=box.bearing_names, shaft=np.zeros((4, 5)))
    asked = importlib.import_module("jaxgear.layout.findings")
    monkeypatch.setattr(asked, "bearing_reactions", lambda gearbox: still)
    cases = replace(layout.before["maximum"], slope=1e-3 * layout.before["maximum"].slope)
    told = {
        (each.key, each.where) for each in layout_findings(replace(layout, before={"maximum": cases}), support(box, 0))
    }
    assert told == {
        ("clearance", 'bearing "A"'),
        ("distance from the face", 'bearing "D"'),
        ("number of meshes", 'gear "large"'),
        ("number of meshes", 'gear "small"'),
        ("shaft diameter over bore", 'gear "small"'),
        ("tip clearance", 'gear "large" and gear "small"'),
        ("misalignment over the face", '"pinion" and "wheel"'),
        ("misalignment over the face", "maximum deviations"),
    }
    # of step 3, in mm on one gear and far too deep on the other
    amounts = {"pinion_amount": np.array([0.0, 0.02]), "wheel_amount": np.array([0.0, 900.0])}
    tried = SimpleNamespace(table=SimpleNamespace(column=amounts.get))
    told = {(each.key, each.where) for each in layout_findings(layout, rigid(), profiles=tried)}
    deep = ("depth of the modification in modules", "wheel")
    assert told == {("depth of the modification", "pinion"), deep}


def test_gears_need_room_beside_what_they_do_not_mesh_with():
    """The output wheel folds back over the input shaft: it passes the pinion there, but neither a gear beside it nor a
    shaft as thick as the room."""
    folded = replace(BOX, meshes=(BOX.meshes[0], replace(BOX.meshes[1], angle=130.0)))
    alpha, distance = np.deg2rad(130.0), 0.5 * 3.0 * 67
    bent = distance * np.array([1 + np.cos(alpha), np.sin(alpha), 0.0])
    np.testing.assert_allclose(axes_of(folded), [np.zeros(3), [distance, 0, 0], bent], atol=1e-12)
    rooms = tip_clearances(folded)
    assert not [name for name in rooms if name.count("gear") == 2]  # 32 mm lie between the faces
    apart, tip = np.hypot(*bent[:2]), 0.5 * 3.0 * 50
    np.testing.assert_allclose(rooms['shaft "in" and gear "w2"'], apart - tip - 12.5, rtol=1e-12)
    assert min(rooms.values()) < 0 and [name for name, room in rooms.items() if room < 0] == [
        'shaft "in" and gear "w2"'
    ]
    into, middle, out = folded.shafts
    moved = replace(into, gears=(*into.gears, MountedGear("idle", PINION, 100.0)))
    rooms = tip_clearances(replace(folded, shafts=(moved, middle, out)))
    np.testing.assert_allclose(rooms['gear "idle" and gear "p2"'], distance - 3.0 * (19 + 2), rtol=1e-12)
    np.testing.assert_allclose(rooms['gear "idle" and gear "w2"'], apart - tip - 0.5 * 3.0 * 21, rtol=1e-12)
    # seen from the other end the shafts lie as they do
    back = replace(folded, shafts=folded.shafts[::-1], direction="clockwise")
    np.testing.assert_allclose(axes_of(back)[::-1] - axes_of(back)[-1], axes_of(folded), atol=1e-12)


def test_crowning_grows_where_the_rule_does_not_suffice(face):
    tolerance = FlankLineTolerance(30.0)
    given = layout_flank_lines(face, tolerance, further=(1.0, 2.0), stations=STATIONS)
    assert float(given.needed) > 3.0 and not given.touches_edges
    np.testing.assert_allclose(given.further, given.needed * np.array([1.0, 2.0]) / 3.0)
    least = layout_flank_lines(face, tolerance, stations=STATIONS)
    np.testing.assert_allclose(least.further, 0.5 * given.needed)


def test_flank_lines_are_varied_together_with_the_profiles(monkeypatch):
    """All combinations, and the one chosen has the further slope and crowning on the wheel beside the tip relief."""
    tried = {}

    def table(mesh, torque, design, plan, *, results, **others):
        rows = np.asarray(plan.values)
        tried.update({row: design(dict(zip(plan.names, row))) for row in map(tuple, rows)})
        found = dict.fromkeys(results, np.ones(len(rows))) | dict(zip(plan.names, rows.T))
        found["ppte"] = np.abs(rows - np.array([10.0, 5.0, -4.0, 3.0, 2.0])).sum(axis=1)
        # teeth meet too early without tip relief on the pinion
        found["effective_contact_ratio"] = np.where(
            rows[:, 0] > 0, 1.0, float(jg.path_of_contact(PAIR).contact_ratio) + 0.2
        )
        return SimpleNamespace(
            column=found.get, values=lambda *names: {jg.quantities[name]: found[name] for name in names}
        )

    monkeypatch.setattr(importlib.import_module("jaxgear.layout.profiles"), "sweep", table)
    mesh, lines = SimpleNamespace(pair=PAIR), (jg.LeadCrowning(1.0), jg.LeadSlope(2.0))
    further = {"slopes": [0.0, -4.0], "crownings": [0.0, 3.0], "length": [1.0, 2.0]}
    found = vary_profiles(mesh, TORQUE, lines, [0.0, 10.0], [5.0], **further)
    assert len(tried) == 1 + 2 * 2 * 2 * 2 and found.amounts == (10.0, 5.0) and found.further == (-4.0, 3.0)
    assert found.length == 2.0 and float(tried[10.0, 5.0, -4.0, 3.0, 2.0][0].terms[-1].length) == 2.0
    side = kinematics(PAIR, jnp.zeros(()), LINE, "strain").sides[1]
    ends = jnp.array([-0.5, 0.5]) * WIDTH  # at the pitch point, where a tip relief removes nothing
    for wheel in (tried[10.0, 5.0, -4.0, 3.0, 2.0][1], lines[1] + found.profiles[1]):
        removed = removed_at(side, wheel, jnp.reshape(side.pitch_roll_length, (1,)), ends)
        np.testing.assert_allclose(removed[:, 0], [-1.0 + 2.0 + 3.0, 1.0 - 2.0 + 3.0], atol=1e-9)
    radar = found.radar_table()
    (shock,) = (values for of, values in radar.items() if of.name == "contact_shock" and of.better == "smaller")
    np.testing.assert_allclose(shock, [0.2] * 9 + [0.0] * 8, atol=1e-12)
    assert "effective_contact_ratio" not in [of.name for of in radar] and len(radar) == 4
    assert found.radar_variants()[1][1] == "pinion 10, wheel 5 µm, 2 mm, slope -4 µm, crowning +3 µm"


def duty(torques, hours, speed):
    """Three loads, as `DUTY` has them: one program serves them all. Those without hours do nothing."""
    return jg.LoadSpectrum.from_hours(torques, hours, [speed] * 3)


def test_damage_of_one_load_is_that_of_its_woehler_line():
    """By hand: Hertz at the pitch point with Z_eps of ISO 6336-2 and Z_B, its root stress of the pinion."""
    torque, hours, speed = 100.0, 50.0, 600.0
    found = damage(flat(), duty([torque, 1.0, 0.0], [hours, 0.0, 0.0], speed), STRENGTH, stations=STATIONS)
    line_load = 1e3 * torque / float(PINION.base_radius) / WIDTH
    radii = np.array([float(gear.pitch_radius) for gear in (PINION, WHEEL)]) * np.sin(np.deg2rad(20))
    path = jg.path_of_contact(PAIR)
    square = line_load * 206e3 / (1 - 0.09) / 2 / np.pi / (radii.prod() / radii.sum())
    worse = float(path.reduced_radius(0.0) / path.reduced_radius(path.inner_single)), 1.0
    assert worse[0] > 1.0  # Z_B; the outer point of single contact is not worse than the pitch point
    hertz = np.sqrt(square * (4 - float(path.contact_ratio)) / 3 * np.array(worse))
    stress, root_stress, pitting, bending = (
        np.asarray(part)[..., 0] for part in (found.contact_stress, found.root_stress, found.pitting, found.bending)
    )
    np.testing.assert_allclose(stress, hertz, rtol=1e-9)
    cycles = 60 * hours * speed * np.array([1.0, 19 / 48])
    np.testing.assert_allclose(pitting, cycles / (5e7 * (1500.0 / hertz) ** 13.2), rtol=1e-9)
    factors = root_factors(PINION, path.pinion_roll_length(path.outer_single))
    root = line_load * np.cos(np.deg2rad(20)) / 3.0 * float(factors.form * factors.correction)
    np.testing.assert_allclose(root_stress[0], root, rtol=1e-9)
    np.testing.assert_allclose(bending[0], cycles[0] / (3e6 * (900.0 / root) ** 8.7), rtol=1e-9)
    np.testing.assert_allclose(found.life, hours / found.largest)


def test_damage_adds_up_and_grows_by_the_exponent():
    """Miner: loads add up. Half the exponent on the load, as stress goes with its root; uneven loads shorten life."""
    first, second, both = ([10.0, 0.0, 0.0], [0.0, 20.0, 0.0], [10.0, 20.0, 0.0])
    torques = [100.0, 200.0, 0.0]
    parts = [damage(flat(), duty(torques, hours, 500.0), STRENGTH, stations=STATIONS) for hours in (first, second)]
    both = damage(flat(), duty(torques, both, 500.0), STRENGTH, stations=STATIONS)
    np.testing.assert_allclose(both.total, parts[0].total + parts[1].total, rtol=1e-9)
    pitting = [np.asarray(part.pitting).sum(axis=1) for part in parts]
    np.testing.assert_allclose(pitting[1] / pitting[0], 2 * 2**6.6, rtol=1e-9)
    skewed = damage(flat(6.0), duty(torques, second, 500.0), STRENGTH, stations=STATIONS)
    factor = np.asarray(skewed.face_load_factor)[1]
    assert factor > 1.05
    np.testing.assert_allclose(np.asarray(skewed.pitting).sum(axis=1) / pitting[1], factor**6.6, rtol=1e-9)
    # of either gear, and by a factor that stands for every load
    assert float(jnp.min(skewed.gear_lives)) == float(skewed.life)
    lives = gear_lives(PAIR, duty(torques, second, 500.0), STRENGTH, [factor, np.nan])
    np.testing.assert_allclose(lives, [skewed.gear_lives, [np.nan, np.nan]], rtol=1e-9)


IDLE = [0.0, 120.0, 1.0], [5.0, 10.0, 0.0], 500.0


def test_idle_loads_do_no_damage(bent):
    found = damage(bent, duty(*IDLE), STRENGTH, stations=STATIONS)
    np.testing.assert_allclose(np.asarray(found.pitting)[:, [0, 2]], 0.0, atol=1e-100)
    np.testing.assert_allclose(np.asarray(found.contact_stress)[:, 0], 0.0, atol=1e-4)
    assert np.all(np.asarray(found.pitting)[:, 1] > 0) and 0 < float(found.life) < np.inf


@pytest.mark.slow
def test_life_is_differentiable_beside_idle_loads():
    load = duty(*IDLE)

    @jax.jit
    def life(slope, faces):
        def of(slope):
            return damage_of(faces, load, STRENGTH, FlankLine(), FlankLine(slope, 3.0)).life

        return jax.jvp(of, (slope,), (jnp.ones_like(slope),))

    faces, at, step = under_loads(SUPPORT, load.torques, STATIONS), 3.0, 1e-4
    slope = (life(at + step, faces)[0] - life(at - step, faces)[0]) / (2 * step)
    np.testing.assert_allclose(life(at, faces)[1], slope, rtol=1e-6)


@pytest.mark.slow
def test_longest_life_beats_its_neighbours_and_every_single_layout(bent):
    line = longest_life(bent, DUTY, STRENGTH, stations=STATIONS)
    faces = under_loads(bent, DUTY.torques, STATIONS)

    def worst(other):
        found = damage_of(faces, DUTY, STRENGTH, FlankLine(), other)
        return max(np.asarray(each).sum(axis=-1).max() for each in (found.pitting, found.bending))

    least = worst(line)
    for angle in np.linspace(0, 2 * np.pi, 12, endpoint=False):
        for reach in (0.05, 1.0):
            other = FlankLine(line.slope + reach * np.cos(angle), line.crowning + reach * np.sin(angle))
            assert worst(other) > least * (1 - 1e-7)
    for torque in DUTY.torques:
        assert worst(level_load(bent, torque, stations=STATIONS)) > least
    # of one load it is the level one
    single = duty([TORQUE, 1.0, 0.0], [10.0, 0.0, 0.0], 100.0)
    alone = longest_life(flat(9.0), single, STRENGTH, stations=STATIONS)
    np.testing.assert_allclose([alone.slope, alone.crowning], [-9.0, 0.0], atol=1e-2)


@pytest.mark.slow
def test_layout_for_a_duty_cycle_tells_relative_lives(bent):
    """At the largest torque that it is run at."""
    load = jg.LoadSpectrum.from_hours([60.0, 180.0, 600.0], [3000.0, 20.0, 0.0], [1000.0, 500.0, 500.0])
    options = {"duty_cycle": load, "strength": STRENGTH, "stations": STATIONS}
    found = layout_flank_lines(bent, FlankLineTolerance(8.0), **options)
    assert float(found.torque) == 180.0
    before, level, after = found.relative_life
    assert float(level) == 1.0 and float(before) < 0.9 and float(after) < 1.0
    # further crowning costs life where nothing deviates, and saves it in the worst case
    np.testing.assert_allclose(found.lives["tolerance"][:, 0], [one.life for one in found.damage], rtol=1e-9)
    unmodified, uncrowned, crowned = found.worst_relative_life("tolerance")
    assert float(unmodified) < float(uncrowned) < float(crowned) < float(after)
    # a life that is over before the hours are, and speeds of another unit
    worst = found.damage[-1]
    assert 0 < float(worst.largest) < 1
    fast = replace(load, speeds=1e3 * load.speeds)
    spent = replace(found, damage=(*found.damage[:2], replace(worst, pitting=worst.pitting * 1.5 / worst.largest)))
    usual = {each.key for each in layout_findings(found, bent, duty_cycle=load)}
    for layout, cycle, name in ((found, fast, "pitch line velocity"), (spent, load, "damage by the duty cycle")):
        (finding,) = [each for each in layout_findings(layout, bent, duty_cycle=cycle) if each.key not in usual]
        assert finding.key == name
    assert finding.value == pytest.approx(1.5) and finding.where == "after step 2"


def test_lives_in_cases_are_those_of_misaligned_axes():
    """A deviation of the slope is a misalignment of the axes; of a rigid pair both signs cost the same."""
    tolerance = FlankLineTolerance(4.0, 2.0)
    found = lives_in_cases(flat(), DUTY, STRENGTH, tolerance, stations=STATIONS)
    each = [damage(flat(slope), DUTY, STRENGTH, stations=STATIONS).life for slope in (0.0, 6.0, 2.0, -2.0, -6.0)]
    np.testing.assert_allclose(found, each, rtol=1e-9)
    np.testing.assert_allclose(found[1:3], found[4:2:-1], rtol=1e-9)
    assert float(found[1]) < float(found[2]) < float(found[0])


@pytest.mark.parametrize("shafts", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_face_load_over_torques_is_that_of_each_torque(bent, shafts):
    """A flank line levels one torque."""
    held = SUPPORT if shafts else bent
    torques = np.array([60.0, 120.0, 240.0])
    bare = face_load_over_torques(held, torques, stations=STATIONS)
    each = [load_on(at_stations(held, torque, stations=STATIONS)).face_load_factor for torque in torques]
    np.testing.assert_allclose(bare, each, rtol=1e-9)
    line = level_load(held, torques[1], stations=STATIONS)
    low, level, high = face_load_over_torques(held, torques, wheel=line, stations=STATIONS)
    assert float(level) < 1.001 < 1.05 < min(float(low), float(high))


@pytest.mark.slow
def test_housing_can_be_left_out(face):
    nodes = tuple(f"{name}.{way}" for name in BOX.bearing_names for way in ("x", "y"))
    soft = Housing(nodes, np.diag(np.linspace(1e-4, 3e-3, len(nodes))), "compliance")
    housed = support(two_stages(housing=soft), 1)
    given, own = {"torque": OWN_TORQUE, "stations": STATIONS}, level_load(face).slope
    np.testing.assert_allclose(level_load(without_housing(housed), **given).slope, own)
    assert abs(float(level_load(housed, **given).slope - own)) > 0.5


def test_hours_are_weights_with_a_duration():
    np.testing.assert_allclose(DUTY.weights, np.array([3000.0, 500.0, 20.0]) / 3520.0)
    np.testing.assert_allclose(DUTY.hours, [3000.0, 500.0, 20.0])
    assert jg.LoadSpectrum([1.0, 2.0]).hours is None


@pytest.mark.parametrize(
    "make, fault",
    [
        (lambda: level_load(rigid()), "torque must be given: no coupling has one"),
        (lambda: level_load(SUPPORT, -1.0), "torque = -1 N m must be at least 0 N m"),
        (
            lambda: level_load(at_stations(rigid(), 9.0, stations=STATIONS), 10.0),
            "torque must be that under which",
        ),
        (
            lambda: level_load(at_stations(rigid(), 9.0, stations=STATIONS), stations=7),
            "stations = 7 must be 21, which",
        ),
        (
            lambda: at_torque(support(two_stages_idle(), 0), 5.0),
            "the couplings transmit no torque to the mesh",
        ),
        (lambda: FlankLineTolerance(-1.0), "FlankLineTolerance: helix_slope = -1 um must be at least 0 um"),
        (lambda: flank_line_tolerance(PAIR, 6, kind="usual"), "kind = 'usual' must be"),
        (lambda: flank_line_tolerance(PAIR, 6, 80.0), "axes = 80.0 must be a Misalignment"),
        (
            lambda: flank_line_tolerance(PAIR, 6, Misalignment(skew=3.0, bearing_span=10.0)),
            "bearing_span = 10 mm must be at least the face width, 18 mm",
        ),
        (
            lambda: flank_line_tolerance(PAIR, 6, Misalignment(direct=-3.0)),
            "direct = -3 um must be at least 0 um",
        ),
        (lambda: flank_line_tolerance(PAIR, (5, 6, 7)), "quality_class has 3 entries"),
        (
            lambda: flank_line_tolerance(PAIR, 14),
            "ToleranceClass: quality_class = 14 must be at least 1 and at most 11",
        ),
        (
            lambda: of_two_stations().edge_contact,
            "2 stations",
        ),
        (lambda: layout_flank_lines(SUPPORT, {}), "tolerances must not be empty"),
        (lambda: layout_flank_lines(SUPPORT, TOLERANCE, gear="both"), "gear = 'both' must be"),
        (
            lambda: layout_flank_lines(SUPPORT, TOLERANCE, duty_cycle=DUTY),
            "duty_cycle has no effect without strength",
        ),
        (lambda: layout_flank_lines(SUPPORT, TOLERANCE, further=-1.0), "further = -1 um must be"),
        (
            lambda: least_off_the_edges(rigid_face(), TOLERANCE, end_relief=0.4),
            "end_relief = 0.4 mm must be greater than 0.428571 mm and at most 9 mm",
        ),
        (
            lambda: least_off_the_edges(SUPPORT, TOLERANCE, share=0.0),
            "share = 0 must be greater than 0 and at most 1",
        ),
        (
            lambda: damage(flat(), jg.LoadSpectrum([1.0, 2.0, 3.0], duration=3.0), STRENGTH, stations=STATIONS),
            "a load spectrum with a duration needs speeds",
        ),
        (
            lambda: longest_life(SUPPORT, jg.LoadSpectrum([0.0]), STRENGTH),
            "torques are all zero; every flank line has an infinite life",
        ),
        (
            lambda: longest_life(SUPPORT, jg.LoadSpectrum.from_hours([0.0, 9.0], [1.0, 0.0], 500.0), STRENGTH),
            "torques are all zero; every flank line has an infinite life",
        ),
        (
            lambda: jg.LoadSpectrum.from_hours([1.0, 2.0], [0.0, 0.0]),
            "LoadSpectrum: sum of the hours = 0 h must be greater than 0 h",
        ),
        (lambda: jg.LoadSpectrum.from_hours([1.0], [-1.0]), "LoadSpectrum: hours = -1 h must be at least 0 h"),
        (lambda: damage(flat(), DUTY, Strength(1500.0), stations=STATIONS), "needs Strength.pitting_exponent"),
    ],
)
def test_refusals(make, fault):
    with pytest.raises(ValueError) as caught:
        make()
    assert str(caught.value).startswith(fault) and "\n" not in str(caught.value)


def of_two_stations():
    found = tolerance_cases(rigid(), TOLERANCE, torque=9.0, stations=STATIONS)
    return eqx.tree_at(lambda cases: cases.load.line_load, found, found.load.line_load[:, :2])


def two_stages_idle():
    """The reducer without torque."""
    return eqx.tree_at(lambda box: box.shafts[0].couplings[0].torque, BOX, jnp.zeros(()))


def test_pictures_mark_the_edges(layout, clean_figures):
    """One curve per case, a cross where an end is touched; negative_crowning marks of the same cases."""

    cases = layout.before["maximum"]
    panel = tolerance_line_load(cases)
    curves = [line for line in panel.get_lines() if len(line.get_xdata()) == STATIONS]
    crosses = [line for line in panel.get_lines() if len(line.get_xdata()) == 1]
    assert len(curves) == len(CASES) and len(crosses) == int(cases.edge_contact.sum()) == 4
    tops = sorted(float(cross.get_ydata()[0]) for cross in crosses)
    np.testing.assert_allclose(tops, np.sort(np.asarray(cases.load.line_load).max(axis=1))[1:])
    assert "[mm]" in panel.get_xlabel() and "[N/mm]" in panel.get_ylabel()
    panel = face_load_factors({"step 1": cases, "step 2": layout.after["maximum"]})
    negative_crowning = [line for line in panel.get_lines() if line.get_markerfacecolor() == "white"]
    assert [len(line.get_xdata()) for line in negative_crowning] == [4, 0]
