"""Defaults give way to numbers that are given, and numbers to the rounding of their digits."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxgear as jg
from jaxgear.compliance.plane import plane_poisson
from jaxgear.compliance.ring import arc_compliance


def test_the_root_radius_gives_way_to_the_pressure_angle_and_says_so():
    """A rack of 25 degrees has room for a radius of 0.318 modules: pi/4 - 1.25 tan(25) times cos / (1 - sin)."""
    gear = jg.Gear(24, 2.0, 25.0, face_width=20.0)
    assert float(gear.root_radius) == pytest.approx(0.317883, abs=1e-6)
    assert "root_radius=0.317883 x module (full radius of the rack)" in str(gear)
    assert float(jg.Gear(24, 2.0, face_width=20.0).root_radius) == 0.38
    traced = jax.jit(lambda angle: jg.Gear(24, 2.0, angle, face_width=20.0).root_radius)
    np.testing.assert_allclose([traced(25.0), traced(20.0)], [float(gear.root_radius), 0.38], rtol=1e-12)
    with pytest.raises(ValueError, match="root_radius = 0.38 x module must be .* at most 0.317983"):
        jg.Gear(24, 2.0, 25.0, face_width=20.0, root_radius=0.38)


def test_incompressible_materials():
    """Rubber-like polymers, nu = 0.5: nothing in plane strain divides by 1 - 2 nu."""
    incompressible, nearly = (jg.Material(2000.0, nu) for nu in (0.5, 0.5 - 1e-7))
    rings = [
        arc_compliance(jnp.asarray(0.1), jnp.asarray(2.0), plane_poisson(each, "strain"), jnp.asarray([0.0, 0.3]), 40)
        for each in (incompressible, nearly)
    ]
    np.testing.assert_allclose(*rings, rtol=1e-5, atol=1e-5)
    assert np.all(np.isfinite(rings[0]))


def test_a_rounded_centre_distance_is_taken_without_backlash(caplog):
    """A published pair that misses 0.26 um; four digits of the profile shifts are worth 0.35 um. 20 um are refused."""

    def pair(shifts=(0.1809, 0.0891), distance=91.5):
        pinion, wheel = (
            jg.Gear(z, 3.5, profile_shift=x, helix_angle=b, face_width=20.0)
            for z, x, b in zip((20, 30), shifts, (15.0, -15.0))
        )
        return jg.GearPair(pinion, wheel, distance)

    made = pair()
    assert 91.5001 < float(made.center_distance) < 91.5003
    assert abs(float(made.backlash)) < 1e-6 and bool(jg.margins(made).valid)
    assert "center_distance = 91.5 mm" in caplog.text
    with pytest.raises(ValueError, match="must be at least 91.5"):
        pair(distance=91.48)
