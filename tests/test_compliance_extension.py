"""A contact law written outside the package meets the corners as every other."""

import jax
import jax.numpy as jnp
import numpy as np
from catalogue import gear_pair

import jaxgear as jg
from jaxgear.compliance.edge import EdgeLaw, edge
from jaxgear.compliance.hertz import contact_geometry
from jaxgear.compliance.laws import AbstractPlainLaw, LinearLaw, LogarithmicLaw, PowerLaw
from jaxgear.compliance.tooth import tooth_load
from jaxgear.geometry import outline


class Tabulated(AbstractPlainLaw):
    """A law of somebody else, of the same numbers as the logarithmic one."""

    law: LogarithmicLaw

    def secant(self, load):
        return self.law.secant(load)


def test_a_corner_softens_any_law_alike():
    """The edge asks a law for its cut contact and not for its class: another class of equal numbers gives the same."""
    pair = gear_pair()

    @jax.jit
    def prepared(pair):
        pinion = tooth_load(outline(pair.pinion), (pair.pinion.tip_roll_length - np.array([0.0, 0.02, 0.1, 2.0]))[None])
        wheel = tooth_load(outline(pair.wheel), jnp.full((1, 4), 12.0))
        geometry = contact_geometry(pinion, wheel, "strain", pair.face_width)
        corner = edge(pinion, wheel, jnp.zeros((1, 4)), geometry)
        return geometry, corner, jg.compliance.DepthReferenced().prepare(geometry)

    geometry, corner, flank = prepared(pair)

    def softened(law):
        return EdgeLaw(law, geometry.width_factor, 4e3 / jnp.pi * geometry.compliance, corner)

    @jax.jit
    def evaluated(law):
        (value, slope), secant = jax.jvp(law.deflection, (load,), (jnp.ones_like(load),)), law.secant(load)
        return value, slope, secant, law.slope(load, secant)

    load = jnp.full((1, 1, 4), 250.0)
    one, other = (evaluated(softened(law)) for law in (flank, Tabulated(flank)))
    np.testing.assert_allclose(other[2], one[2], rtol=1e-12)
    np.testing.assert_allclose(other[3], one[3], rtol=1e-9)
    assert (one[2] / evaluated(flank)[2])[0, 0, 0] > 1.2, "the corner cuts the first contact off"
    exponent = jnp.full_like(geometry.width_factor, 0.9)
    for law in (LinearLaw(geometry.width_factor), PowerLaw(geometry.width_factor, exponent)):
        value, slope, _, own = evaluated(softened(law))
        assert (np.asarray(value) > 0).all()
        np.testing.assert_allclose(own, slope, rtol=1e-10)
