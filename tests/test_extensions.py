"""What extends the package from outside: a class, and where it shall have a name, one line more."""

import re

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import gear_pair
from jaxtyping import Array
from test_design_file import load, removed, text  # noqa: F401

import jaxgear as jg
from jaxgear.compliance import AbstractCompliance, ContactGeometry, Plane
from jaxgear.io import DesignFileError, describe
from jaxgear.microgeometry import AbstractCurve, AbstractModification
from jaxgear.numerics import AbstractSpring, number

ROLL_LENGTH = np.linspace(0.0, 60.0, 13)
SMALL = jg.Resolution(positions=16, pairs=2)


class BumpAtPitch(AbstractModification):
    """A user's own modification: a bump around a roll length.

    Attributes:
        height: of the bump.
        place: roll length of its top.
        curve: by which it fades.
        rounded: whether its top is.
    """

    height: jax.Array = number("um", low=0.0, high=50.0)
    place: jax.Array = number("mm", low=0.0)
    curve: "HalfCosine" = eqx.field(default_factory=lambda: HalfCosine(1.0))
    rounded: bool = eqx.field(static=True, default=True)
    varies_along_face = False

    def __call__(self, flank):
        distance = jnp.abs(flank.roll_length - self.place) / 3.0
        return self.height * (1.0 - self.curve(jnp.clip(distance, 0.0, 1.0)))


class HalfCosine(AbstractCurve):
    """A user's own curve."""

    power: jax.Array = number("", low=0.5, default=1.0)

    def __call__(self, d):
        return (0.5 - 0.5 * jnp.cos(jnp.pi * d)) ** self.power


def test_a_modification_and_a_curve_of_a_user_need_no_line_in_the_package(load):  # noqa: F811
    """Defined above, outside the package: their fields are the keys, with units, ranges and defaults."""
    table = '[[pinion.modification]]\ntype = "bump_at_pitch"\nheight = "height"\nplace = 9.0\n'
    variables = "[variables]\nheight = { low = 0.0, high = 20.0 }\n"
    file = load(text(pinion=table, tail=variables))
    assert file.units == {"height": "um"}
    pinion, _ = file.design({"height": 6.0})
    assert isinstance(pinion, BumpAtPitch)
    np.testing.assert_allclose(removed(pinion), removed(BumpAtPitch(6.0, 9.0)))
    assert removed(pinion).max() == pytest.approx(6.0, rel=1e-2)
    # the curve in another relief, and the ranges of both
    relief = '[[pinion.modification]]\ntype = "tip_relief"\namount = 5.0\nlength = 3.0\ncurve = {}\n'
    curved, _ = load(text(pinion=relief.format('{ type = "half_cosine", power = 2 }'))).design({})
    np.testing.assert_allclose(removed(curved), removed(jg.TipRelief(5.0, 3.0, HalfCosine(2.0))))
    assert describe(curved)[0]["curve"] == {"type": "half_cosine", "power": 2.0}
    for content, problem in (
        (text(pinion=table, tail=variables.replace("20.0", "60.0")), "variables.height.high: 60 um must be at least 0"),
        (text(pinion=table.replace('"height"\n', "-1\n")), "pinion.modification[0].height: -1 um must be at least 0"),
        (text(pinion=relief.format('{ type = "half_cosine", power = 0.1 }')), "[0].curve.power: 0.1 must be at least"),
    ):
        with pytest.raises(DesignFileError, match=re.escape(problem)):
            load(content)


class Spring(AbstractSpring):
    """h = c q"""

    c: Array

    def secant(self, load):  # noqa: F811
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
