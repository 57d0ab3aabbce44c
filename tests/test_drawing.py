"""What a drawing says: tooth thickness by its measures, backlash, chamfered tips, materials and classes by name."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE, gear_pair

import jaxgear as jg
from jaxgear.compliance.assembly import with_edge
from jaxgear.compliance.edge import _wedge_excess
from jaxgear.compliance.hertz import contact_geometry
from jaxgear.compliance.tooth import tooth_load
from jaxgear.geometry import drawn_gear, outline, over_balls, pair_with_backlash, span
from jaxgear.geometry.involute import half_tooth_angle
from jaxgear.io import DesignFileError, load_design
from jaxgear.io.tolerance_table import quality_classes

PINION = {"teeth": 19, "module": 3.0, "face_width": 20.0, "profile_shift": 0.1}
COSINE = np.cos(np.deg2rad(20.0))


def gear(**changes):
    return jg.Gear(**{**PINION, **changes})


def measures(upper, tolerance):
    """What the same tooth measures in every way: (lower, upper) of the allowance, over teeth and over balls."""
    limits = [gear(tooth_thickness_allowance=upper - each) for each in (tolerance, 0.0)]
    return {
        "tooth_thickness_allowance": [upper - tolerance, upper],
        "span": [float(span(each, 3)) for each in limits],
        "over_balls": [float(over_balls(each, 5.5)) for each in limits],
    }


EXTRA = {"span": {"teeth_spanned": 3}, "over_balls": {"ball_diameter": 5.5}, "tooth_thickness_allowance": {}}


@pytest.mark.parametrize("way", EXTRA)
def test_every_measure_of_a_tooth_makes_the_same_gear(way):
    found = drawn_gear(**PINION, **{way: measures(-60.0, 40.0)[way]}, **EXTRA[way])
    assert float(found.tooth_thickness_allowance) == pytest.approx(-60.0, abs=1e-6)
    assert float(found.tooth_thickness_tolerance) == pytest.approx(40.0, abs=1e-6)
    middle = gear(tooth_thickness_allowance=-80.0)  # the tooth is that in the middle of the limits
    assert float(found.thickness_angle) == pytest.approx(float(middle.thickness_angle), rel=1e-9)
    assert float(span(found, 3)) == pytest.approx(np.mean(measures(-60.0, 40.0)["span"]), abs=1e-9)


def test_a_measure_alone_has_no_tolerance_and_may_be_rounded():
    found = drawn_gear(**PINION, span=measures(-60.0, 0.0)["span"][0], teeth_spanned=3)
    assert float(found.tooth_thickness_tolerance) == 0.0
    nominal = float(span(gear(), 3))
    assert float(drawn_gear(**PINION, span=nominal + 5e-4, teeth_spanned=3).tooth_thickness_allowance) == 0.0


@pytest.mark.parametrize("by", ["both", "pinion", "wheel", "center_distance"])
def test_a_pair_has_the_backlash_that_it_is_made_for(by):
    pinion, wheel = (
        gear(tooth_thickness_allowance=-30.0, tooth_thickness_tolerance=20.0),
        jg.Gear(48, 3.0, face_width=18.0),
    )
    pair = pair_with_backlash(pinion, wheel, 150.0, axial_offset=1.5, by=by)
    assert float(pair.axial_offset) == 1.5
    assert float(pair.backlash) == pytest.approx(150.0, abs=1e-8)
    np.testing.assert_allclose(pair.backlash_limits, 150.0 + 10.0 * COSINE * np.array([-1.0, 1.0]), atol=1e-8)
    changed = {
        name: float(now.tooth_thickness_allowance - before.tooth_thickness_allowance)
        for name, now, before in (("pinion", pair.pinion, pinion), ("wheel", pair.wheel, wheel))
    }
    whole = -(150.0 / COSINE - 40.0)  # of the mean allowances, -40 um and 0
    wanted = {"both": (whole / 2, whole / 2), "pinion": (whole, 0.0), "wheel": (0.0, whole), "center_distance": (0, 0)}
    np.testing.assert_allclose(list(changed.values()), wanted[by], atol=1e-9)


def test_backlash_on_a_centre_distance_has_its_derivatives():
    """Thinner by as much as the backlash grows, and by 2 tan(alpha_w)-fold what the axes come closer."""

    def allowance(backlash, distance):
        pinion, wheel = gear(profile_shift=0.0), jg.Gear(48, 3.0, face_width=18.0)
        pair = pair_with_backlash(pinion, wheel, backlash, center_distance=distance, by="wheel")
        return pair.wheel.tooth_thickness_allowance

    slopes = jax.jit(jax.grad(allowance, argnums=(0, 1)))(200.0, 100.6)
    sine = np.sqrt(1 - (100.5 * COSINE / 100.6) ** 2)
    np.testing.assert_allclose(slopes, [-1 / COSINE, 2e3 * sine / COSINE], rtol=1e-9)


def test_a_chamfer_ends_the_flank_and_leaves_the_tip():
    plain, cut = gear(), gear(tip_form_diameter=62.9)
    assert float(cut.tip_roll_length) == pytest.approx(np.sqrt(31.45**2 - float(cut.base_radius) ** 2), rel=1e-12)
    assert float(cut.tip_land) == float(plain.tip_land) and float(cut.tip_chamfer) == pytest.approx(0.35, rel=1e-12)
    wheel = jg.Gear(48, 3.0, face_width=18.0)
    pairs = [jg.GearPair(each, wheel) for each in (plain, cut)]
    paths = [jg.path_of_contact(pair) for pair in pairs]
    lost = (plain.tip_roll_length - cut.tip_roll_length) / plain.base_pitch
    assert float(paths[0].contact_ratio - paths[1].contact_ratio) == pytest.approx(float(lost), rel=1e-12)
    assert float(paths[0].start) == float(paths[1].start)
    clearances = [float(jg.margins(pair).pinion_tip_clearance) for pair in pairs]
    # as deep into the space; up to rounding, since a form circle makes another program
    assert clearances[0] == pytest.approx(clearances[1], abs=1e-12)


def test_chamfers_that_meet_leave_no_tip():
    """Lines of 45 degrees from both ends of the form circle's chord meet as high above it as half of it is long."""
    for form, fits in ((60.0, True), (58.0, False)):
        flank = gear(tip_form_diameter=63.5)
        rho = jnp.sqrt(0.25 * form**2 - flank.base_radius**2)
        half = float(half_tooth_angle(flank, rho))
        top = 0.5 * form * (np.cos(half) + np.sin(half))
        assert (top > float(flank.tip_radius)) == fits
        if fits:
            assert float(gear(tip_form_diameter=form).tip_form_radius) == 0.5 * form
        else:
            with pytest.raises(ValueError, match="tip_form_diameter = 58 mm leaves no tip land"):
                gear(tip_form_diameter=form)


def test_a_traced_tip_form_circle_outside_the_tip_is_flagged():
    wheel = jg.Gear(48, 3.0, face_width=18.0)
    held = jax.jit(lambda form: jg.margins(jg.GearPair(gear(tip_form_diameter=form), wheel)).held)
    assert bool(held(63.5)["tip_overrun"]) and not bool(held(63.7)["tip_overrun"])


def corner_law(tip, form):
    """Contacts near a pinion's tip with the wedge of its corner, where the flank ends at one place; and their load."""
    pair = gear_pair(tips=(tip, None))
    return _corner_law(pair, replace(pair.pinion, tip_form_diameter=None if form is None else jnp.asarray(form)))


@eqx.filter_jit
def _corner_law(pair, pinion_gear):
    end = pinion_gear.tip_roll_length
    pinion = tooth_load(outline(pinion_gear), (end - jnp.asarray([0.0, 0.02, 0.1, 2.0]))[None])
    wheel = tooth_load(outline(pair.wheel), jnp.full((1, 4), 12.0))
    geometry = contact_geometry(pinion, wheel, "strain", pair.face_width)
    law = with_edge(jg.compliance.DepthReferenced().prepare(geometry), geometry, pinion, wheel, jnp.zeros((1, 4)))
    return law, pinion


LOAD = jnp.full((1, 1, 4), 250.0)


@eqx.filter_jit
def _secant(law):
    return law.secant(LOAD)


def secant(law):
    return np.asarray(_secant(law))


@pytest.mark.slow
def test_the_corner_of_a_chamfer_is_stiffer_than_that_of_a_cut_tip():
    cut, _ = corner_law(62.4, None)
    chamfered, load = corner_law(63.0, 62.4)
    without = eqx.tree_at(lambda law: law.edge.wedge, cut, jnp.zeros_like(cut.edge.wedge))
    tip, chamfer, bare = (secant(law)[0, 0] for law in (cut, chamfered, without))
    assert (chamfer <= tip).all() and (chamfer >= bare).all()
    assert chamfer[0] < 0.97 * tip[0], "right at the corner there is more material behind it"
    # far from the corner nothing of it is left, chamfered or not
    np.testing.assert_allclose(chamfer[3], tip[3], rtol=1e-3)
    # 45 degrees more than between flank and top land: nearly a half plane
    assert 0 <= float(_wedge_excess(load, np.pi / 4)) < 0.1 * float(_wedge_excess(load, 0.0))


def test_no_chamfer_is_the_limit_of_a_small_one():
    plain, _ = corner_law(63.0, None)
    limit, _ = corner_law(63.0, 63.0)
    np.testing.assert_allclose(secant(limit), secant(plain), rtol=1e-13)
    small, _ = corner_law(63.0, 63.0 - 1e-4)
    np.testing.assert_allclose(secant(small), secant(plain), rtol=2e-3)


def test_the_slope_of_a_chamfered_corner_is_that_of_its_deflection():
    @eqx.filter_jit
    def slopes(law):
        value, slope = jax.jvp(law.deflection, (LOAD,), (jnp.ones_like(LOAD),))
        return law.slope(LOAD, value / LOAD), slope

    law, _ = corner_law(63.0, 62.4)
    found, wanted = slopes(law)
    np.testing.assert_allclose(found, wanted, rtol=1e-10)


@pytest.mark.slow
def test_a_chamfered_pair_runs_as_one_of_tips_cut_there():
    """The path is that of tips cut at the form circle; only the corner is stiffer, which is little of the mesh."""

    @jax.jit
    def cycle(tips, form):
        pair = gear_pair(tips=tips)
        if form is not None:
            gears = [replace(each, tip_form_diameter=end) for each, end in zip((pair.pinion, pair.wheel), form)]
            pair = jg.GearPair(*gears)
        found = jg.solve(jg.prepare(pair, resolution=LINE), 50.0)
        return jnp.mean(found.transmission_error), jg.peak_to_peak(found.transmission_error), found.converged.all()

    ends = jnp.asarray([62.5, 149.4])
    (mean, ppte, fine), (cut_mean, cut_ppte, _) = cycle(jnp.asarray([63.0, 150.0]), ends), cycle(ends, None)
    assert bool(fine)
    assert 0.98 * cut_mean < mean < cut_mean
    assert float(ppte) == pytest.approx(float(cut_ppte), rel=0.05)


HEAD = """
[pinion]
teeth = 19
module = 3.0
face_width = 20.0
profile_shift = 0.1
{pinion}
[wheel]
teeth = 48
module = 3.0
face_width = 18.0
{wheel}
[load]
torque = 50.0
"""


@pytest.fixture
def load(tmp_path):
    """Loads a design file of these lines in the tables of the gears and behind them."""

    def write_and_load(pinion="", wheel="", tail=""):
        path = tmp_path / "gear.toml"
        path.write_text(HEAD.format(pinion=pinion, wheel=wheel) + tail)
        return load_design(path)

    return write_and_load


@pytest.mark.parametrize("way", EXTRA)
def test_every_measure_can_stand_in_a_design_file(load, way):
    extra = "".join(f"{name} = {value}\n" for name, value in EXTRA[way].items())
    found = load(f"{way} = {measures(-60.0, 40.0)[way]}\n{extra}").pair().pinion
    assert float(found.tooth_thickness_allowance) == pytest.approx(-60.0, abs=1e-6)
    assert float(found.tooth_thickness_tolerance) == pytest.approx(40.0, abs=1e-6)


def test_measures_and_backlash_may_be_variables(load):
    variables = (
        "[variables]\nw = { low = 23.05, high = 23.08, unit = 'mm' }\nj = { low = 200.0, high = 300.0, unit = 'um' }\n"
    )
    design = load('span = ["w", 23.09]\nteeth_spanned = 3', tail='[pair]\nbacklash = "j"\n' + variables)

    def numbers(w, j):
        pair = design.pair({"w": w, "j": j})
        return pair.pinion.tooth_thickness_tolerance, (pair.backlash, pair.wheel.tooth_thickness_tolerance)

    (tolerance, (backlash, wheel)), slope = jax.jit(jax.value_and_grad(numbers, has_aux=True))(23.06, 240.0)
    assert float(tolerance) == pytest.approx(30.0 / COSINE, abs=1e-6)
    assert float(backlash) == pytest.approx(240.0, abs=1e-8) and float(wheel) == 0.0
    assert float(slope) == pytest.approx(-1e3 / COSINE, rel=1e-9)


def test_traced_limits_the_wrong_way_round_make_no_gear():
    """A sweep over one limit may pass the other, where concrete numbers are refused."""

    @jax.jit
    def valid(lower):
        gear = drawn_gear(**PINION, span=[lower, 23.09], teeth_spanned=3)
        return jg.margins(jg.GearPair(gear, jg.Gear(48, 3.0, face_width=18.0))).valid

    assert bool(valid(23.06)) and not bool(valid(23.10))


def test_backlash_is_made_by_what_the_file_leaves_open(load):
    thin = "tooth_thickness_allowance = -30.0"
    tables = {
        "both": load(tail="[pair]\nbacklash = 120.0\naxial_offset = 1.5"),
        "wheel": load(thin, tail="[pair]\nbacklash = 120.0"),
        "distance": load(thin, thin, "[pair]\nbacklash = 120.0"),
        "given distance": load(thin, tail="[pair]\nbacklash = 120.0\ncenter_distance = 100.85"),
    }
    pairs = {name: design.pair() for name, design in tables.items()}
    for name, pair in pairs.items():
        assert float(pair.backlash) == pytest.approx(120.0, abs=1e-7), name
    assert float(pairs["both"].pinion.tooth_thickness_allowance) == pytest.approx(-60.0 / COSINE, abs=1e-9)
    assert float(pairs["wheel"].pinion.tooth_thickness_allowance) == -30.0
    assert float(pairs["distance"].wheel.tooth_thickness_allowance) == -30.0
    assert float(pairs["distance"].center_distance) > float(pairs["both"].working_center_distance)


def test_materials_have_names(load):
    tail = "[materials.bronze]\nelastic_modulus = 110000.0\ndensity = 8800.0\n"
    pair = load('material = "STEEL"', 'material = "bronze"', tail).pair()
    assert float(pair.pinion.material.elastic_modulus) == float(jg.STEEL.elastic_modulus)
    assert (float(pair.wheel.material.elastic_modulus), float(pair.wheel.material.density)) == (110000.0, 8800.0)


def test_classes_of_the_gears_are_those_of_tolerance_and_charts(load):
    classes = "quality_class = {}"
    bands = quality_classes(load(classes.format(6), classes.format(7)))
    assert [int(band.quality_class) for band in bands] == [6, 7]
    variables = "[variables]\nx = { low = 0.0, high = 5.0 }\n[sweep]\nsamples = 4\n[tolerance]\n"
    relief = '\n[[wheel.modification]]\ntype = "profile_crowning"\namount = "x"\n'
    design = load(classes.format(6), classes.format(7) + relief, variables)
    assert design.tables["tolerance"].quality_class == [6, 7]


def test_diameters_of_a_drawing_make_the_rack(load):
    """Root and root form diameter of the thinned tooth, also of a helical gear, and a chamfer of the module."""
    for options in ({}, {"helix_angle": 20.0}):
        tip = 2 * gear(**options).tip_radius - 0.6
        wanted = gear(dedendum=1.2, root_radius=0.3, tooth_thickness_allowance=-90.0, tip_form_diameter=tip, **options)
        form = jg.geometry.diameter(wanted, outline(wanted).form_roll_length)
        given = {"root_diameter": 2 * wanted.root_circle_radius, "root_form_diameter": form, "tip_chamfer": 0.1}
        found = drawn_gear(**PINION, **given, tooth_thickness_allowance=-90.0, **options)
        for name in ("dedendum", "root_radius", "tip_form_diameter"):
            assert float(getattr(found, name)) == pytest.approx(float(getattr(wanted, name)), rel=1e-9), name
    roll, slope = jax.value_and_grad(lambda d: outline(drawn_gear(**PINION, root_form_diameter=d)).form_roll_length)(
        54.0
    )
    assert float(slope * roll) == pytest.approx(54.0 / 4, rel=1e-9)

    full = drawn_gear(**PINION, root_diameter=50.4, full_root_radius=True)
    assert float(2 * full.root_circle_radius) == pytest.approx(50.4, rel=1e-12)
    land = np.pi / 4 - float(full.dedendum) * np.tan(np.deg2rad(20.0))
    assert float(full.root_radius) * (1 - np.sin(np.deg2rad(20.0))) / COSINE == pytest.approx(land, rel=1e-9)
    assert float(load("full_root_radius = true").pair().pinion.root_radius) == pytest.approx(0.47191, abs=1e-5)

    drawn = load("root_diameter = 50.0\ntip_chamfer = 0.1\ntooth_thickness_allowance = -60.0").pair().pinion
    assert float(2 * drawn.root_circle_radius) == pytest.approx(50.0, rel=1e-12)
    assert float(drawn.tip_chamfer) == pytest.approx(0.3, rel=1e-12)


SPAN = "span = 23.0\nteeth_spanned = 3"
REFUSED = {
    "two measures": (SPAN + "\nover_balls = 64.0\nball_diameter = 5.5", "", "pinion.over_balls: cannot be given with"),
    "measure and allowance": (
        SPAN + "\ntooth_thickness_allowance = -60.0",
        "",
        "pinion.tooth_thickness_allowance: cannot be given with span: give one",
    ),
    "two roundings": (
        "full_root_radius = true\nroot_form_diameter = 54.0",
        "",
        "pinion.full_root_radius: cannot be given with root_form_diameter",
    ),
    "two roots": ("root_diameter = 50.0\ndedendum = 1.3", "", "pinion.root_diameter: cannot be given with dedendum"),
    "no rack so deep": (
        "root_diameter = 40.0",
        "",
        "pinion.root_diameter: dedendum = 2.93333 x module must be at least",
    ),
    "a rounding too large": ("root_form_diameter = 57.0", "", "pinion.root_form_diameter: root_radius = "),
    "a root that backlash would move": (
        "root_diameter = 50.0",
        "[pair]\nbacklash = 100.0",
        "pair.backlash: would thin the pinion, whose root_diameter is that of the thin tooth",
    ),
    "no teeth": ("span = 23.0", "", "pinion.teeth_spanned: missing, span needs it"),
    "no span": ("teeth_spanned = 3", "", "pinion.teeth_spanned: has no effect without span"),
    "no span, with a tolerance": (
        "teeth_spanned = 3\ntooth_thickness_tolerance = 20.0",
        "",
        "pinion.teeth_spanned: has no effect without span",
    ),
    "no span, with allowance and tolerance": (
        "teeth_spanned = 3\ntooth_thickness_allowance = -50.0\ntooth_thickness_tolerance = 20.0",
        "",
        "pinion.teeth_spanned: has no effect without span",
    ),
    "no balls, with a tolerance": (
        "ball_diameter = 5.5\ntooth_thickness_tolerance = 20.0",
        "",
        "pinion.ball_diameter: has no effect without over_balls",
    ),
    "no ball": ("over_balls = 65.0", "", "pinion.ball_diameter: missing, over_balls needs it"),
    "too long": ("span = 23.5\nteeth_spanned = 3", "", "pinion.span: 23.5 mm must be at most 23.144"),
    "over a tooth less": (
        "span = 22.9\nteeth_spanned = 2",
        "",
        "pinion.teeth_spanned: 2 does not go with span = 22.9 mm: the rack makes 14.2881 mm over 2",
    ),
    "over a tooth more": (
        "span = 22.9\nteeth_spanned = 4",
        "",
        "pinion.teeth_spanned: 4 does not go with span = 22.9 mm: the rack makes 32.0009 mm over 4",
    ),
    "of another gear": (
        "span = 35.0\nteeth_spanned = 3",
        "",
        "pinion.teeth_spanned: 3 does not go with span = 35 mm: the rack",
    ),
    "missed by the anvils": (
        "span = 70.0\nteeth_spanned = 9",
        "",
        "pinion.teeth_spanned: 9 does not go with span = 70 mm: the rack",
    ),
    "reversed limits": (
        "span = [23.0, 22.9]\nteeth_spanned = 3",
        "",
        "pinion.span: upper limit 22.9 mm must be at least the lower one, 23 mm",
    ),
    "three limits": ("span = [22.8, 22.9, 23.0]\nteeth_spanned = 3", "", "pinion.span: must be a list of length 2"),
    "limits and tolerance": (
        "tooth_thickness_allowance = [-90.0, -60.0]\ntooth_thickness_tolerance = 20.0",
        "",
        "pinion.tooth_thickness_tolerance: has no effect, give lower and upper limit of tooth_thickness_allowance",
    ),
    "thicker": (
        "tooth_thickness_allowance = [-20.0, 10.0]",
        "",
        "pinion.tooth_thickness_allowance[1]: 10 um must be at",
    ),
    "too little backlash": (
        "tooth_thickness_allowance = -90.0",
        "[pair]\nbacklash = 20.0",
        "pair.backlash: 20 um must be at least 84.5723 um, which centre distance and tooth thicknesses leave",
    ),
    "backlash twice": (
        SPAN,
        "[wheel_says]\n[pair]\nbacklash = 200.0\ncenter_distance = 101.0",
        "pair.backlash: has no effect, centre distance and tooth thickness of both gears are given",
    ),
    "unknown material": ('material = "STEAL"', "", 'pinion.material: "STEAL" is not known, did you mean "STEEL"?'),
    "material of nothing": (
        "",
        "[materials.cast]\nyoung = 1.0",
        'materials.cast.young: unknown key, did you mean "elastic_modulus"',
    ),
    "another steel": ("", "[materials.STEEL]\ndensity = 7800.0", "materials.STEEL: is a material of the library"),
    "class of one gear": ("quality_class = 6", "", "wheel.quality_class: missing, the other gear has one"),
    "no such class": ("quality_class = 14", "", "pinion.quality_class: 14 must be at least 1 and at most 11"),
    "form circle outside": ("tip_form_diameter = 65.0", "", "pinion.tip_form_diameter: 65 mm must be at most 63.6 mm"),
    "form circle of meeting chamfers": (
        "tip_form_diameter = 59.0",
        "",
        "pinion.tip_form_diameter: 59 mm leaves no tip land: chamfers of 45 degrees would be 2.3 mm high",
    ),
    "form circle inside": ("tip_form_diameter = 50.0", "", "pinion.tip_form_diameter: 50 mm must be greater than 53."),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_a_drawing_cannot_say_is_refused_in_one_line(load, case):
    pinion, tail, expected = REFUSED[case]
    wheel = "tooth_thickness_allowance = -30.0" if tail.startswith("[wheel_says]") else ""
    with pytest.raises(DesignFileError) as caught:
        load(pinion, wheel, tail.removeprefix("[wheel_says]"))
    message = str(caught.value)
    assert "\n" not in message and message.partition("gear.toml: ")[2].startswith(expected), message


def test_classes_stand_in_one_place(load):
    tail = (
        "[variables]\nx = { low = 0.0, high = 5.0 }\n[sweep]\nsamples = 4\n[tolerance]\nquality_class = 5\n"
        '[[pinion.modification]]\ntype = "profile_crowning"\namount = "x"\n'
    )
    with pytest.raises(DesignFileError, match="tolerance.quality_class: has no effect, the gears have classes of"):
        load("quality_class = 5", "quality_class = 5", tail)
    with pytest.raises(DesignFileError, match="tolerance.quality_class: missing, this key is required where the gears"):
        load("", "", tail.replace("quality_class = 5\n", ""))
