"""Ring gears with a given fillet: an arc that touches flank and root circle, and the fillet of a cutter beside it."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import FOUR_PAIRS

import jaxgear as jg
from jaxgear.compliance.tooth import Beam, tooth_load
from jaxgear.geometry import margins, outline, path_of_contact
from jaxgear.io import DesignFileError, load_design
from jaxgear.metrics.stress import critical_section, root_factors
from jaxgear.numerics import changed
from jaxgear.rexs import write_rexs

BOTH = {"module": 3.0, "face_width": 20.0}
PLANET = jg.Gear(19, bore_diameter=24.0, **BOTH)


def ring(**given):
    return jg.RingGear(64, rim_diameter=250.0, **BOTH | given)


CUT = ring(cutter_teeth=25, root_radius=0.25)


@pytest.mark.parametrize(("radius", "angle"), [(0.4, 0.0), (1.2, 0.0), (1.0, 15.0)])
def test_the_arc_touches_flank_and_root_circle(radius, angle):
    """Points and tangents agree at the form circle, the root circle is touched, and all points lie on one circle."""
    made = ring(fillet_radius=radius, helix_angle=angle)
    drawn = outline(made)
    g = jnp.linspace(drawn.junction, jnp.pi / 2, 9)
    x, y = drawn.curves.trochoid(g)
    ends = drawn.curves.trochoid(drawn.junction), drawn.curves.involute(drawn.form_roll_length)
    np.testing.assert_allclose(*ends, atol=1e-9)
    one, other = (
        jax.jacfwd(lambda t, curve=curve: jnp.stack(curve(t)))(at)
        for curve, at in (
            (drawn.curves.trochoid, drawn.junction),
            (drawn.curves.involute, drawn.form_roll_length),
        )
    )
    across = one[0] * other[1] - one[1] * other[0]
    assert abs(float(across / jnp.linalg.norm(one) / jnp.linalg.norm(other))) < 1e-12
    assert float(jnp.hypot(x, y)[-1]) == pytest.approx(-float(made.root_circle_radius), abs=1e-9)
    center = -float(made.root_circle_radius) - radius, float(drawn.root_half_angle)
    apart = np.hypot(x + center[0] * np.sin(center[1]), y + center[0] * np.cos(center[1]))
    np.testing.assert_allclose(apart, radius, atol=1e-9)
    if not angle:
        assert float(critical_section(made).fillet_radius) == pytest.approx(radius)


def test_an_arc_as_wide_as_the_fillet_of_a_cutter_is_nearly_that_fillet():
    """The arc with the radius of the critical section: root chord, tooth and form factor within 2 %."""
    arc = ring(fillet_radius=float(critical_section(CUT).fillet_radius))
    drawn, of_cutter = outline(arc), outline(CUT)
    assert float(drawn.root_chord) == pytest.approx(float(of_cutter.root_chord), rel=0.003)
    path = path_of_contact(jg.GearPair(PLANET, CUT))
    rolls = path.wheel_roll_length(jnp.stack([path.start, jnp.zeros(()), 0.5 * path.end]))
    bent = [Beam().compliance(tooth_load(each, rolls), "strain") for each in (drawn, of_cutter)]
    np.testing.assert_allclose(*bent, rtol=0.015)
    np.testing.assert_allclose(*(root_factors(each, rolls[0]).form for each in (arc, CUT)), rtol=0.02)
    assert margins(jg.GearPair(PLANET, arc)).ring_clearances.cutter is None


def test_a_cutter_with_nearly_as_many_teeth_leaves_the_arc_of_its_tip():
    """It hardly rolls: what is left of the difference falls with z - z_0."""
    arc = outline(ring(fillet_radius=0.75))
    left = []
    for teeth in (56, 60, 62):
        cut = outline(ring(cutter_teeth=teeth, root_radius=0.25))
        left.append(
            [float(abs(getattr(cut, name) - getattr(arc, name))) for name in ("form_roll_length", "root_chord")]
        )
    np.testing.assert_allclose(np.divide(left[1:], left[:-1]), 0.5, atol=0.05)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"fillet_radius": 1.0, "cutter_teeth": 25}, "cutter_teeth: must be left out beside fillet_radius"),
        ({"fillet_radius": 1.0, "root_radius": 0.3}, "root_radius: must be left out beside fillet_radius"),
        ({"fillet_radius": 2.0}, "fillet_radius = 2 mm must be at most 1.3"),
        ({"fillet_radius": 0.0}, "fillet_radius = 0 mm must be greater than 0"),
    ],
)
def test_what_no_arc_can_be_is_refused(given, said):
    with pytest.raises(ValueError, match=said):
        ring(**given)


def test_the_largest_arc_leaves_no_root_land():
    with pytest.raises(ValueError) as refused:
        ring(fillet_radius=5.0)
    most = float(str(refused.value).split("at most ")[1].split(" mm")[0])
    assert float(ring(fillet_radius=most).cutter_room) == pytest.approx(0.0, abs=1e-4)
    # the margin tells traced gears
    room = jax.jit(lambda radius: ring(fillet_radius=radius).cutter_room)
    assert float(room(most + 0.1)) < -0.05 and np.isfinite(room(20.0))


def test_files(tmp_path):
    path = tmp_path / "pair.toml"
    text = "\n".join(
        f"[{name}]\nteeth = {teeth}\nmodule = 3.0\nface_width = 20.0" for name, teeth in (("pinion", 19), ("ring", 64))
    )
    path.write_text(f"{text}\nfillet_radius = 1.0\n[load]\ntorque = 200.0\n")
    pair = load_design(path).pair()
    assert float(pair.wheel.fillet_radius) == 1.0 and pair.wheel.cutter_teeth is None
    with pytest.raises(ValueError, match="wheel fillet_radius: must be left out"):
        write_rexs(tmp_path / "pair.rexs", pair)
    path.write_text(path.read_text().replace("fillet_radius = 1.0", "fillet_radius = 1.0\ncutter_teeth = 25"))
    with pytest.raises(DesignFileError, match="ring.cutter_teeth: must be left out beside fillet_radius"):
        load_design(path)


@pytest.mark.slow
@pytest.mark.parametrize("mode", [jax.grad, jax.jacfwd])
def test_contact(mode):
    """Transmission error within 0.1 % of that with the cutter's fillet; its derivative by the radius."""

    def mean(radius):
        pair = jg.GearPair(PLANET, changed(ring(fillet_radius=1.0), fillet_radius=radius))
        return jnp.mean(
            jg.solve(jg.prepare(pair, resolution=replace(FOUR_PAIRS, positions=8)), 200.0).transmission_error
        )

    mesh = jg.prepare(jg.GearPair(PLANET, CUT), resolution=replace(FOUR_PAIRS, positions=8))
    known = jnp.mean(jg.solve(mesh, 200.0).transmission_error)
    assert float(mean(jnp.asarray(0.98))) == pytest.approx(float(known), rel=1e-3)
    at, step = jnp.asarray(1.0), 1e-4
    central = (mean(at + step) - mean(at - step)) / (2 * step)
    assert float(mode(mean)(at)) == pytest.approx(float(central), rel=1e-5)
