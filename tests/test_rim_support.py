"""Ring gears on arcs, bolts and elastic foundations.

Reference values: plane finite elements of 19/64 teeth, module 3 mm, rims of three (R1) and one (R2) tooth height, on
six rigid arcs of 6 degrees; the planet between two of them or at one. Mean and peak-to-peak value over the positions
of the ring gear psi in [0, 1), from the contact of the reference pair at the pitch point on.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxgear as jg
from jaxgear.compliance import default_compliance, rim, ring
from jaxgear.contact.mesh import prepare_from
from jaxgear.dynamics import mesh_force
from jaxgear.geometry import ElasticFoundation, SupportArcs
from jaxgear.io import DesignFileError, load_design
from jaxgear.numerics import changed

BOTH = {"module": 3.0, "face_width": 20.0, "tip_edge_radius": 1e-3}
PLANET = jg.Gear(19, bore_diameter=24.0, **BOTH)
R1, R2 = 236.4, 211.8  # outer diameters of the rim
BETWEEN, AT = SupportArcs(6, 6.0, first=30.0), SupportArcs(6, 6.0)
RELIEF, NO_RELIEF = (jg.TipRelief(amount, 4.0, jg.Linear()) for amount in (10.0, 0.0))
PITCH = 360.0 / 64


def on(support, rim_diameter=R2):
    wheel = jg.RingGear(64, cutter_teeth=25, root_radius=0.25, rim_diameter=rim_diameter, support=support, **BOTH)
    return jg.GearPair(PLANET, wheel)


def prepared(support, rim_diameter=R2):
    return jg.prepare(on(support, rim_diameter), compliance=default_compliance("stress"))


@pytest.mark.parametrize(
    ("support", "diameter", "relief", "mean", "ppte"),
    [
        (BETWEEN, R1, NO_RELIEF, 25.1644, 9.85538),
        (AT, R2, NO_RELIEF, 20.5320, 8.91520),
        (BETWEEN, R2, RELIEF, 56.4452, 7.63166),
    ],
    ids=["thick rim", "at an arc", "between arcs, relieved"],
)
def test_finite_elements(support, diameter, relief, mean, ppte):
    """200 N m in plane stress; held all round, mean TE is 17.3 and 16.2 um."""
    mesh = prepared(support, diameter)
    curve = np.asarray(jg.solve(mesh, 200.0, pinion=relief, wheel=relief).transmission_error)
    # positions are the mean of both gears; those of the ring gear are half a transmission error behind
    ring_phase = np.asarray(mesh.phase) - 0.5e-3 * curve / float(mesh.path_of_contact.base_pitch)
    curve = np.interp(np.arange(len(curve)) / len(curve), ring_phase, curve)
    assert np.mean(curve) == pytest.approx(mean, rel=0.013)
    assert np.ptp(curve) == pytest.approx(ppte, rel=0.015)


def test_turning_the_supports_by_a_pitch_is_moving_the_planet_by_a_pitch():
    at_first = prepared(BETWEEN)
    # a base pitch later: pairs one place ahead
    moved = prepare_from(np.ones(()), on(BETWEEN), default_compliance("stress"), at_first.resolution, None, True)
    turned = prepared(SupportArcs(6, 6.0, first=30.0 - PITCH))
    assert np.allclose(moved.structure[1:, 1:], turned.structure[:-1, :-1], rtol=1e-9)
    assert not np.allclose(moved.structure[1:, 1:], at_first.structure[:-1, :-1], rtol=1e-2)
    assert np.allclose(moved.structure, jnp.swapaxes(moved.structure, 0, 1), rtol=1e-9)  # reciprocity


def test_reciprocity_of_the_ring_held_all_round():
    given = jnp.asarray(0.047), jnp.asarray(1 / 1.1), jnp.asarray(0.3), jnp.array([0.1, -0.1])
    forth, back = ring.arc_compliance(*given, 100, True)
    assert np.allclose(forth, back.T, atol=1e-12)


# of a small model: the moment of a unit force about the middle, in inner radii, and its load modes
HALF_ANGLE, RATIO, ARM, ANGLE = 0.047, 0.8, -0.03, 0.3
MODES = np.array([ARM * np.cos(ANGLE), -np.cos(ANGLE), np.sin(ANGLE)])
MOMENT = (ARM + np.cos(HALF_ANGLE)) * np.cos(ANGLE)


def small(support, segments, harmonics):
    return changed(support, segments=segments, harmonics=harmonics)


BOLTS = small(SupportArcs(3, 12.0), 3, 60)


@jax.jit
def compliance(support, softness, ratio):
    """Of one tooth, in units of plane modulus and inner radius, beyond that of a ring held all round."""
    place = jnp.asarray([-0.05], ratio.dtype)
    given = jnp.asarray(HALF_ANGLE, ratio.dtype), ratio, jnp.asarray(0.3, ratio.dtype), place, support, softness
    mode = jnp.asarray(MODES, ratio.dtype)
    return mode @ rim.support_compliance(*given)[0, 0] @ mode


def of(support, softness):
    return float(compliance(support, jnp.asarray(softness), jnp.asarray(RATIO)))


def test_arcs_that_cover_the_rim_hold_it_all_round():
    known = ring.arc_compliance(*map(jnp.asarray, (HALF_ANGLE, RATIO, 0.3, [0.0])), 100, True)[0]
    held = MODES @ np.asarray(known) @ MODES
    assert abs(of(small(SupportArcs(12, 30.0), 6, 100), 0.0)) < 0.005 * held
    assert abs(of(ElasticFoundation(1.0), 1e-6)) < 1e-5 * held


@pytest.mark.parametrize(
    ("support", "stiffness"), [(ElasticFoundation(1.0), 2 * np.pi / RATIO), (BOLTS, 3.0)], ids=["foundation", "bolts"]
)
def test_a_soft_support_lets_the_ring_move_as_a_rigid_body(support, stiffness):
    """1 / k of a shift along the force, and of a turn 1 / k times the squared moment, with the sum k of all springs."""
    rigid = (1 + (MOMENT * RATIO) ** 2) / stiffness
    assert of(support, 1e6) == pytest.approx(1e6 * rigid, rel=1e-3)


# value, derivatives by width and place [deg], softness and ratio of the radii
IN_DOUBLE = 34.67402911381, -0.86017225475, 1.48548367782, 8.0837290453, 792.69943690396


@pytest.mark.parametrize("double", [True, False], ids=["double", "single"])
def test_derivatives(double):
    def at(x):
        return compliance(changed(BOLTS, width=x[0], first=x[1]), x[2], x[3])

    with jax.enable_x64(double):
        x = jnp.asarray([12.0, 50.0, 0.1, 0.9])
        value, slope = jax.value_and_grad(at)(x)
        assert slope.dtype == (np.float64 if double else np.float32)
        assert np.allclose([value, *slope], IN_DOUBLE, rtol=1e-6 if double else 1e-3)
        if double:
            steps = np.diag([1e-3, 1e-3, 1e-4, 1e-5])
            central = [(at(x + h) - at(x - h)) / (2 * np.max(h)) for h in steps]
            assert np.allclose(slope, central, rtol=1e-5)


def test_mirror_image():
    assert float(on(BETWEEN).coast.wheel.support.first) == -30.0


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda: SupportArcs(6, 61.0), "width = 61 deg must be at most 60 deg"),
        (lambda: SupportArcs(2, 6.0, radial=False), "arcs = 2 must be at least 3"),
        (lambda: mesh_force(prepared(BETWEEN), 200.0), "support: on arcs every mesh cycle differs"),
        (lambda: jg.prepare(on(AT), compliance=jg.legacy_compliance()), "support must be None with the body Sainsot"),
    ],
)
def test_refused(wrong, said):
    with pytest.raises(ValueError, match=said):
        wrong()


FILE = """
[pinion]
teeth = 19
module = 3.0
face_width = 20.0

[ring]
teeth = 64
module = 3.0
face_width = 20.0
support = { type = "support_arcs", arcs = 6, width = 6.0, first = 30.0, stiffness = 500.0 }

[load]
torque = 200.0
"""


def test_design_file(tmp_path):
    path = tmp_path / "pair.toml"
    path.write_text(FILE)
    support = load_design(path).pair().wheel.support
    assert support.arcs == 6 and float(support.stiffness) == 500.0
    path.write_text(FILE.replace("width = 6.0", "width = 70.0"))
    with pytest.raises(DesignFileError, match="ring.support"):
        load_design(path)
