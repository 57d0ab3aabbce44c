"""Internal pairs: geometry, interference, tip corners, the elastic ring held outside, and finite elements.

Reference values: geometry with positive numbers, by hand; interference by brute force on drawn outlines; plane finite
elements of planet and ring gear (R1: 19/64, module 3 mm, rim of three tooth heights; R4: 40/48, module 2 mm),
contact included, with bores and rims clamped.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import FOUR_PAIRS

import jaxgear as jg
from jaxgear.compliance import default_compliance, ring
from jaxgear.contact.kinematics import contacts
from jaxgear.geometry import allowance_of_balls, margins, measures, outline, over_balls, path_of_contact, span
from jaxgear.geometry.interference import Tips, radial_assembly_clearance, trochoid_clearance
from jaxgear.io import DesignFileError, load_design
from jaxgear.shafts import MountedGear

# planet, ring gear: what is not that of the defaults
R1 = {"teeth": 19, "bore_diameter": 24.0}, {"teeth": 64, "cutter_teeth": 25, "root_radius": 0.25, "rim_diameter": 236.4}
R4 = (
    {"teeth": 40, "addendum": 0.8, "dedendum": 1.05, "root_radius": 0.25, "bore_diameter": 50.0},
    {"teeth": 48, "addendum": 0.7, "dedendum": 1.05, "cutter_teeth": 24, "root_radius": 0.2, "rim_diameter": 120.0},
)
SHIFTED = {"teeth": 23, "profile_shift": 0.4}, {"teeth": 70, "profile_shift": -0.2, "addendum": 0.9, "cutter_teeth": 25}
HIGH = (
    {"teeth": 35, "addendum": 1.35, "dedendum": 1.6, "root_radius": 0.2},
    {"teeth": 91, "addendum": 1.1, "dedendum": 1.6, "cutter_teeth": 30, "root_radius": 0.0502},
)


OF_R4 = {"module": 2.0, "pressure_angle": 25.0, "face_width": 15.0}


def internal(planet, ring_gear, **both):
    both = {"module": 3.0, "face_width": 20.0, "tip_edge_radius": 1e-3} | both
    return jg.GearPair(jg.Gear(**both, **planet), jg.RingGear(**both, **ring_gear))


def r4():
    return internal(*R4, **OF_R4)


@pytest.mark.parametrize(
    ("given", "both", "known"),
    [
        (R1, {}, (67.5, 20.0, 1.8742, 9.7476, 16.5836, 1.66088, 187.2, 199.5, 197.9505)),
        (SHIFTED, {"module": 4.0}, (93.17154, 18.54968, 9.3032, 14.5049, 28.1795, 1.59853, 274.4, 291.6, None)),
        (
            R4,
            {"module": 2.0, "pressure_angle": 25.0},
            (8, 25, 13.3244, 16.9047, 20.4042, 1.24326, 93.2, 100.2, 99.5919),
        ),
        (HIGH, {"module": 2.0}, (56, 20, 4.7871, 11.9707, 18.4279, 2.31034, 177.6, 188.4, 187.4021)),
    ],
    ids=["19/64", "23/70", "40/48", "35/91"],
)
def test_geometry_with_negative_numbers_is_that_with_positive_ones(given, both, known):
    pair = internal(*given, **both)
    path = path_of_contact(pair)
    wheel = outline(pair.wheel)
    form = 2 * np.hypot(pair.wheel.base_radius, wheel.form_roll_length)
    found = [pair.working_center_distance, np.rad2deg(pair.working_pressure_angle)]
    found += [path.pinion_roll_length(place) for place in (path.start, 0.0, path.end)]
    found += [path.contact_ratio, -2 * pair.wheel.tip_radius, -2 * pair.wheel.root_circle_radius, form]
    for value, wanted in zip(found, known):
        if wanted is not None:
            digits = len(str(wanted).partition(".")[2])
            assert float(value) == pytest.approx(wanted, abs=0.51 * 10.0**-digits)
    x, y = wheel.curves.trochoid(wheel.junction)
    assert np.allclose([x, y], wheel.curves.involute(wheel.form_roll_length), atol=1e-9)  # the fillet meets the flank


@pytest.mark.parametrize(
    ("planet", "teeth", "angle", "heights", "trochoid", "assembly"),
    [
        (19, 64, 20.0, (1.0, 0.8), 0.01274, 0.0314),
        (30, 40, 20.0, (1.0, 0.8), 0.00578, None),
        (34, 41, 20.0, (1.0, 0.8), -0.00034, None),
        (36, 42, 20.0, (1.0, 0.8), -0.00340, None),
        (34, 41, 25.0, (0.8, 0.7), 0.0099, None),
        (34, 48, 20.0, (1.0, 0.8), None, -0.0002),
        (40, 48, 25.0, (0.8, 0.7), None, 0.0001),
    ],
)
def test_interference_of_the_tips(planet, teeth, angle, heights, trochoid, assembly):
    """Left minus right sides of the published conditions [rad]; 34/41 and 36/42 cut by brute force too."""
    cosine = np.cos(np.deg2rad(angle))
    base, ring_base = 0.5 * planet * cosine, 0.5 * teeth * cosine
    tips = Tips(*map(jnp.asarray, (base, 0.5 * planet + heights[0], ring_base, 0.5 * teeth - heights[1])))
    tangent = jnp.tan(jnp.deg2rad(angle))
    if trochoid is not None:
        found = trochoid_clearance(tips, jnp.asarray(0.5 * (teeth - planet)), tangent)
        assert float(found) == pytest.approx(trochoid, abs=6e-5)
    if assembly is not None:
        assert float(radial_assembly_clearance(tips, tangent)) == pytest.approx(assembly, abs=6e-5)


@pytest.mark.parametrize(
    ("make", "recess", "approach"),
    [
        (lambda: internal(*R1), (1.320, 5.279, 21.11, 84.24), (3.471, 13.45, 52.37, 208.2)),
        (r4, (0.089, 0.355, 1.408, 5.536), (0.091, 0.368, 1.493, 6.138)),
    ],
    ids=["19/64", "40/48"],
)
def test_gap_of_the_tip_corners(make, recess, approach):
    pair = make()
    path = path_of_contact(pair)
    x = jnp.array([0.05, 0.1, 0.2, 0.4]) * path.base_pitch
    assert np.allclose(contacts(pair, path, path.end + x).corner_gap, recess, rtol=3e-4, atol=6e-4)
    assert np.allclose(contacts(pair, path, path.start - x).corner_gap, approach, rtol=3e-4, atol=6e-4)


def test_elastic_ring_held_outside():
    """Plane stress, Poisson's ratio 0.3, outer circle 1.1 root radii: root arcs of 0.047 rad, at 0 and 0.1 rad."""
    torsion = 1.3 * (1 - 1.1**-2) / (2 * np.pi)  # of the ring, which the library counts once for all teeth
    matrix = ring.arc_compliance(
        jnp.asarray(0.047), jnp.asarray(1 / 1.1), jnp.asarray(0.3), jnp.array([0.0, 0.1]), 400, True
    )
    here, there = np.asarray(matrix) + torsion * np.where(np.outer([0, 1, 0], [0, 1, 0]), 1, 0)
    assert here[0, 0] == pytest.approx(572.82, abs=0.06) and here[1, 1] == pytest.approx(1.16753, abs=6e-5)
    assert here[2, 2] == pytest.approx(0.74951, abs=6e-6) and there[2, 2] == pytest.approx(0.07801, abs=6e-6)
    assert there[0, 0] == pytest.approx(-94.117, abs=0.06) and there[1, 1] == pytest.approx(0.36861, abs=6e-5)
    assert there[0, 2] == pytest.approx(-2.9161, abs=6e-5)


def test_ring_with_very_many_teeth_is_the_rack_of_an_external_wheel():
    """Towards z = infinity, rack teeth are neither inside nor outside; what is left falls with 1 / z."""
    planet = jg.Gear(19, 3.0, face_width=20.0)
    kept = {"module": 3.0, "face_width": 20.0, "addendum": 0.8}

    def curvature(teeth):
        rings = jg.RingGear(teeth, **kept), jg.Gear(teeth, **kept)
        paths = [path_of_contact(jg.GearPair(planet, wheel)) for wheel in rings]
        return [np.asarray([path.start, path.end, path.reduced_radius(0.0)]) for path in paths]

    near, far = (np.abs(np.subtract(*curvature(teeth))) for teeth in (500, 5_000))
    assert np.all(far < 0.11 * near + 1e-9) and np.all(near < 0.8)


def solved(pair, torque, mod):
    mesh = jg.prepare(pair, compliance=default_compliance("stress"), resolution=FOUR_PAIRS)
    return jg.solve(mesh, torque, pinion=mod[0], wheel=mod[1])


RELIEF, NO_RELIEF = (jg.TipRelief(amount, 4.0, jg.Linear()) for amount in (10.0, 0.0))


@pytest.mark.parametrize(
    ("mod", "mean", "ppte"),
    [
        ((NO_RELIEF, NO_RELIEF), 17.319, 8.2427),
        ((RELIEF, RELIEF), 20.1409, 6.03947),
        ((RELIEF, NO_RELIEF), 18.8379, 8.26373),
        ((NO_RELIEF, RELIEF), 18.6209, 7.96505),
    ],
    ids=["unmodified", "both", "planet", "ring"],
)
def test_finite_elements_of_19_64(mod, mean, ppte):
    """200 N m in plane stress; the model is within 0.3 % of mean TE and 0.1 um of PPTE."""
    curve = solved(internal(*R1), 200.0, mod).transmission_error
    assert float(jnp.mean(curve)) == pytest.approx(mean, rel=0.003)
    assert float(jnp.ptp(curve)) == pytest.approx(ppte, abs=0.1)


def test_few_teeth_of_difference_share_the_load_outside_the_path():
    """40/48 with a contact ratio of 1.24: at 300 N m PPTE falls below that of 100 N m, as more pairs touch."""
    pair = r4()
    low, high = (solved(pair, torque, (NO_RELIEF, NO_RELIEF)) for torque in (100.0, 300.0))
    for cycle, mean, ppte in ((low, 6.07917, 1.75325), (high, 15.5738, 0.859199)):
        assert float(jnp.mean(cycle.transmission_error)) == pytest.approx(mean, rel=0.016)
        assert float(jnp.ptp(cycle.transmission_error)) == pytest.approx(ppte, abs=0.15)
    assert float(jnp.mean(jnp.sum(high.line_load[:, 0] > 0, axis=0))) > 2


def tips(x):
    """Contact ratio and both gaps 0.1 base pitches beyond the path [um] of 19/64 with planets thicker by x modules."""
    planet, ring_gear = R1
    pair = internal(planet | {"profile_shift": x}, ring_gear | {"profile_shift": -x})
    path = path_of_contact(pair)
    places = jnp.stack([path.start, path.end]) + jnp.array([-0.1, 0.1], x.dtype) * path.base_pitch
    return jnp.append(contacts(pair, path, places).corner_gap, path.contact_ratio)


@pytest.mark.parametrize("double", [True, False], ids=["double", "single"])
def test_derivatives_of_the_geometry(double):
    """By the profile shift of planet and ring, in both modes, against central differences in double precision."""

    @jax.jit
    def both_modes(x):  # the reverse mode is the transposed forward one
        value, linear = jax.linearize(tips, x)
        (reverse,) = jax.vmap(jax.linear_transpose(linear, x))(jnp.eye(len(value), dtype=x.dtype))
        return linear(jnp.ones_like(x)), reverse

    with jax.enable_x64(double):
        forward, reverse = both_modes(jnp.asarray(0.1))
    step = 1e-4
    central = (np.asarray(tips(jnp.asarray(0.1 + step))) - np.asarray(tips(jnp.asarray(0.1 - step)))) / (2 * step)
    assert forward.dtype == (np.float64 if double else np.float32)
    assert np.abs(central).min() > 0.05
    for found in (forward, reverse):
        assert np.allclose(found, central, rtol=1e-6 if double else 2e-3)


IN_DOUBLE = 0.18703198, 0.00397245, -0.00395724  # um per unit of profile shift, rim diameter [mm] and relief [um]


@pytest.mark.slow
@pytest.mark.parametrize("mode", [jax.grad, jax.jacfwd])
@pytest.mark.parametrize("double", [True, False], ids=["double", "single"])
def test_derivatives(mode, double):
    """PPTE by profile shift, rim diameter and relief, and central differences."""
    planet, ring_gear = R1
    both = {"module": 3.0, "face_width": 20.0}

    def ppte(x):
        wheel = jg.RingGear(**both, **{**ring_gear, "rim_diameter": 236.4 + x[1]}, profile_shift=-x[0])
        pair = jg.GearPair(jg.Gear(**both, **planet, profile_shift=x[0]), wheel)
        mesh = jg.prepare(pair, resolution=jg.Resolution(positions=8, pairs=2))
        cycle = jg.solve(mesh, 200.0, pinion=jg.TipRelief(10.0 + x[2], 4.0))
        return jg.peak_to_peak(cycle.transmission_error)

    with jax.enable_x64(double):
        found = jax.jit(mode(ppte))(jnp.array([0.1, 1.0, 1.0]))
        assert found.dtype == (np.float64 if double else np.float32)
        assert np.allclose(found, IN_DOUBLE, rtol=1e-5 if double else 2e-3, atol=1e-8 if double else 1e-5)
    if double and mode is jax.jacfwd:
        x, step = jnp.array([0.1, 1.0, 1.0]), np.diag([1e-4, 1e-2, 1e-3])
        central = [(ppte(x + h) - ppte(x - h)) / (2 * np.max(h)) for h in step]
        assert np.allclose(central, IN_DOUBLE, rtol=1e-5, atol=1e-8)


# the tip of the planet meets the fillet at its deepest, on the line of centres, 25 um inside
DEEP = (
    {"teeth": 63, "profile_shift": -0.02967, "addendum": 1.07354, "dedendum": 0.82854, "root_radius": 0.152},
    {"teeth": 73, "profile_shift": -0.14067, "addendum": 0.54608, "dedendum": 1.28808, "cutter_teeth": 28},
)
PLANET, RING = jg.Gear(19, 3.0, face_width=20.0), jg.RingGear(64, 3.0, face_width=20.0)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda: internal(R1[0], R1[1] | {"addendum": 1.0}), "reaches the pinion's flank"),
        (lambda: internal({"teeth": 36}, {"teeth": 42}), "clash"),
        (
            lambda: internal(*DEEP, module=3.8264, pressure_angle=17.5),
            "reaches the wheel's flank at diameter 288.*at most",
        ),
        (lambda: jg.RingGear(64, 3.0, face_width=20.0, rim_diameter=190.0), "rim_diameter = 190 mm must be greater"),
        (lambda: jg.RingGear(64, 3.0, face_width=20.0, tip_diameter=178.0), "than 180.421 mm, the base diameter"),
        (lambda: jg.RingGear(64, 3.0, face_width=20.0, cutter_teeth=10), "RingGear: cutter_teeth = 10 generates"),
        (lambda: jg.RingGear(64, 3.0, face_width=20.0, root_radius=0.9), "RingGear: root_radius = 0.9"),
        (lambda: jg.GearPair(RING, PLANET), "pinion is a RingGear"),
        (lambda: jg.GearPair(PLANET, RING, 68.0), "must be at most 67.5"),
    ],
)
def test_what_cannot_run_is_refused(wrong, said):
    with pytest.raises(ValueError, match=said):
        wrong()


def test_backlash_shrinks_with_the_centre_distance():
    near, nominal = jg.GearPair(PLANET, RING, 67.4), jg.GearPair(PLANET, RING)
    assert float(near.backlash) == pytest.approx(2e3 * 0.1 * np.sin(np.deg2rad(20)), rel=0.01)
    assert float(nominal.backlash) == pytest.approx(0.0, abs=1e-6)
    thin = jg.GearPair(PLANET, jg.RingGear(64, 3.0, face_width=20.0, tooth_thickness_allowance=-50.0))
    assert float(thin.backlash) == pytest.approx(50.0 * np.cos(np.deg2rad(20)), rel=1e-3)
    assert bool(margins(thin).valid)


def test_measured_between_balls():
    """64 teeth, balls of 5.25 mm: inv(alpha_M) = psi - D_M / d_b, M_i = d_b / cos(alpha_M) - D_M."""
    between = over_balls(RING, 5.25)
    assert float(between) == pytest.approx(184.21444, abs=6e-6)
    assert float(allowance_of_balls(RING, 5.25, between)) == pytest.approx(0.0, abs=1e-6)
    with pytest.raises(ValueError, match="between balls"):
        span(RING, 5)
    assert np.isnan(measures(RING).span) and float(measures(RING, ball=5.25).over_balls) == float(between)


def test_shafts_carry_no_ring_gears():
    with pytest.raises(ValueError, match="external gears alone"):
        MountedGear("ring", RING, position=20.0)


FILE = """
[pinion]
teeth = 19
module = 3.0
face_width = 20.0

[ring]
teeth = 64
module = 3.0
face_width = 20.0
cutter_teeth = 25
rim_diameter = 236.4

[[ring.modification]]
type = "tip_relief"
amount = 10.0
length = 4.0

[load]
torque = 200.0
"""


def written(folder, text):
    path = folder / "pair.toml"
    path.write_text(text)
    return path


def test_design_file_with_a_ring_gear(tmp_path):
    design = load_design(written(tmp_path, FILE))
    wheel = design.pair().wheel
    assert isinstance(wheel, jg.RingGear) and float(wheel.rim_diameter) == 236.4 and float(wheel.cutter_teeth) == 25
    _, relief = design.design({})
    assert float(relief.amount) == 10.0


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("[ring]", "[wheel]\nteeth = 64\n\n[ring]"), "wheel.module: missing"),
        (("[ring]", "[wheel]\nteeth = 64\nmodule = 3.0\nface_width = 20.0\n\n[ring]"), "ring: has no effect beside"),
        (("rim_diameter = 236.4", "bore_diameter = 100.0"), "ring.bore_diameter: unknown key"),
        (("rim_diameter = 236.4", "rim_diameter = 150.0"), "ring.rim_diameter: 150 mm must be greater than 199.5 mm"),
    ],
)
def test_wrong_ring_gears_in_files(tmp_path, change, said):
    with pytest.raises(DesignFileError, match=said):
        load_design(written(tmp_path, FILE.replace(*change)))
