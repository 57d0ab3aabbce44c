"""A compliance and a contact law written outside the package run through prepare, solve and their derivatives."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import gear_pair
from jaxtyping import Array

import jaxgear as jg
from jaxgear.compliance import AbstractCompliance, ContactGeometry, Plane
from jaxgear.compliance.edge import EdgeLaw, edge
from jaxgear.compliance.hertz import contact_geometry
from jaxgear.compliance.laws import AbstractPlainLaw, LinearLaw, LogarithmicLaw, PowerLaw
from jaxgear.compliance.toothload import tooth_load
from jaxgear.geometry import outline
from jaxgear.numerics import AbstractSpring

ROLL_LENGTH = np.linspace(0.0, 60.0, 13)
SMALL = jg.Resolution(positions=16, pairs=2)


class Spring(AbstractSpring):
    """h = c q"""

    c: Array

    def secant(self, load):
        return self.c + 0 * load


class Table(AbstractCompliance):
    """Tooth compliances over the roll length, as from finite elements, a linear contact, no coupling, rigid hubs."""

    pinion: Array
    wheel: Array
    contact: Array
    plane: Plane = eqx.field(static=True, default="strain")

    def structure(self, pinion, wheel):
        teeth = jnp.interp(pinion.roll_length, ROLL_LENGTH, self.pinion)
        teeth = teeth + jnp.interp(wheel.roll_length, ROLL_LENGTH, self.wheel)
        return jnp.eye(teeth.shape[0])[:, :, None] * teeth[None]

    def hub(self, pinion, wheel):
        return jnp.zeros_like(self.contact)

    def law(self, geometry: ContactGeometry, pinion, wheel, outside):
        return Spring(jnp.broadcast_to(self.contact, geometry.face_width.shape))


def test_a_tabulated_compliance_needs_nothing_of_the_package():
    """At the pitch point one pair bears the load: TE = F / b (tooth + tooth + contact), with slopes by each."""
    pair = gear_pair()

    def mean_and_pitch(numbers):
        table = Table(numbers[0] + 2e-4 * ROLL_LENGTH**2, numbers[1] + 1e-4 * ROLL_LENGTH**2, numbers[2])
        cycle = jg.solve(jg.prepare(pair, compliance=table, resolution=SMALL), 50.0)
        return cycle.transmission_error[0], cycle

    numbers = jnp.asarray([0.04, 0.05, 0.02])
    (te, cycle), slope = eqx.filter_jit(eqx.filter_value_and_grad(mean_and_pitch, has_aux=True))(numbers)
    assert bool(jnp.all(cycle.converged))
    line_load = 50e3 / float(pair.pinion.base_radius) / float(pair.face_width)
    contact = jg.path_of_contact(pair)
    rho = [float(contact.pinion_pitch_roll_length), float(contact.wheel_pitch_roll_length)]
    tables = 0.04 + 2e-4 * ROLL_LENGTH**2, 0.05 + 1e-4 * ROLL_LENGTH**2
    teeth = sum(np.interp(r, ROLL_LENGTH, table) for r, table in zip(rho, tables))
    assert float(te) == pytest.approx(line_load * (teeth + 0.02), rel=1e-9)
    np.testing.assert_allclose(slope, line_load, rtol=1e-9)
    # elsewhere two pairs share it
    assert float(cycle.transmission_error.min()) < 0.8 * float(te)


class Tabulated(AbstractPlainLaw):
    """A law of somebody else, of the same numbers as the logarithmic one."""

    law: LogarithmicLaw

    def secant(self, load):
        return self.law.secant(load)


def test_a_corner_softens_any_law_alike():
    """The edge asks a law for its cut contact and not for its class: another class of equal numbers gives the same."""
    pair = gear_pair()
    tip = pair.pinion.tip_roll_length
    pinion = tooth_load(outline(pair.pinion), (tip - jnp.asarray([0.0, 0.02, 0.1, 2.0]))[None])
    wheel = tooth_load(outline(pair.wheel), jnp.full((1, 4), 12.0))
    geometry = contact_geometry(pinion, wheel, "strain", pair.face_width)
    corner = edge(pinion, wheel, jnp.zeros((1, 4)), geometry)
    flank = jg.compliance.DepthReferenced().prepare(geometry)

    def softened(law):
        return EdgeLaw(law, geometry.width_factor, 4e3 / jnp.pi * geometry.compliance, corner)

    load = jnp.full((1, 1, 4), 250.0)
    one, other = softened(flank), softened(Tabulated(flank))
    secant = one.secant(load)
    np.testing.assert_allclose(other.secant(load), secant, rtol=1e-12)
    np.testing.assert_allclose(other.slope(load, secant), one.slope(load, secant), rtol=1e-9)
    assert float((secant / flank.secant(load))[0, 0, 0]) > 1.2, "the corner cuts the first contact off"
    exponent = jnp.full_like(geometry.width_factor, 0.9)
    for law in (LinearLaw(geometry.width_factor), PowerLaw(geometry.width_factor, exponent)):
        value, slope = jax.jvp(softened(law).deflection, (load,), (jnp.ones_like(load),))
        assert bool(jnp.all(value > 0))
        np.testing.assert_allclose(softened(law).slope(load, value / load), slope, rtol=1e-10)
