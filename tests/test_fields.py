"""Number fields: units and ranges declared once, checked when an object is made, printed with their unit."""

from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxgear as jg
from jaxgear.numerics import Checked, Number, count, fields, fields_of, number


class Inner(Checked):
    """A part."""


class Probe(Checked):
    """One field of every kind."""

    amount: jax.Array = number("um")
    length: jax.Array = number("mm", low=0.0, default=1.0)
    teeth: jax.Array = number("", low=5.0, whole=True, default=20)
    limit: jax.Array | None = number("um", high=9.0, open_high=True, optional=True, default=None)
    values: jax.Array = number("", shape=("points",), fewest=2, default=(0.0, 1.0))
    steps: int = count(low=1, high=100, default=3)
    rate: float = number("", low=0.0, open_low=True, static=True, default=0.5)
    side: Literal["left", "right", "both"] = eqx.field(static=True, default="both")
    switch: bool = eqx.field(static=True, default=True)
    inner: Inner = eqx.field(default_factory=Inner)


def test_units_and_ranges_stand_in_the_fields():
    known = fields_of(Probe)
    assert list(known) == ["amount", "length", "teeth", "limit", "values", "steps", "rate"]
    assert known["length"] == Number("mm", low=0.0)
    assert known["steps"].low == 1 and known["steps"].high == 100 and known["steps"].whole


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"amount": np.nan}, "Probe: amount = nan um must be finite"),
        ({"length": -1.0}, "Probe: length = -1 mm must be at least 0 mm"),
        ({"teeth": 17.5}, "Probe: teeth = 17.5 must be a whole number"),
        ({"limit": 9.0}, "Probe: limit = 9 um must be less than 9 um"),
        ({"values": [1.0]}, "Probe: values has shape (1,), must be a list of at least 2 numbers"),
        ({"values": [1.0, np.inf]}, "Probe: values = inf must be finite"),
        ({"steps": 0}, "Probe: steps = 0 must be a whole number of at least 1"),
        ({"steps": 1.0}, "Probe: steps = 1.0 must be a whole number of at least 1"),
        ({"steps": 101}, "Probe: steps = 101 must be at most 100"),
        ({"rate": 0.0}, "Probe: rate = 0 must be greater than 0"),
        ({"side": "top"}, 'Probe: side = \'top\' must be "left", "right" or "both"'),
        ({"switch": "no"}, "Probe: switch = 'no' must be True or False"),
        ({"amount": True}, "Probe: amount = True must be a number"),
        ({"amount": 50 + 1j}, "Probe: amount = (50+1j) must be a real number"),
        ({"amount": "2.5"}, "Probe: amount = '2.5' must be a number"),
        ({"amount": None}, "Probe: amount = None must be a number"),
        ({"values": [[1.0], [1.0, 2.0]]}, "Probe: values = ((1), (1, 2)) must be a number"),
        ({"amount": [1.0, 2.0]}, "Probe: amount has shape (2,), must be a single number; make many with jax.vmap"),
    ],
)
def test_what_is_refused(given, message):
    with pytest.raises(ValueError) as error:
        Probe(**{"amount": 1.0, **given})
    assert str(error.value) == message


def test_what_is_hardly_meant_is_asked_about_once(monkeypatch, caplog):
    """Lengths in mm for amounts in um, moduli in GPa: they can be computed, so that they are no error."""
    monkeypatch.setattr(fields, "_warned", set())
    for amount in (0.0, 0.1, -20.0):
        jg.TipRelief(amount, 5.0)
    assert caplog.messages == []
    for _ in range(2):
        jg.TipRelief(0.02, 5.0), jg.Material(206.0)
    assert caplog.messages == [
        "TipRelief: amount = 0.02 um is less than 0.1 um (less than flanks can be measured to: is it in mm?)",
        "Material: elastic_modulus = 206 MPa is less than 500 MPa (plastics 1000 to 10000, steel 206000 MPa: is it in "
        "GPa or Pa?)",
    ]
    with pytest.raises(ValueError, match="TipRelief: length = 5000 mm must be at least 0 mm and at most 1000 mm"):
        jg.TipRelief(20.0, 5000.0)


def test_a_class_where_an_object_is_meant_is_refused():
    with pytest.raises(TypeError, match=r"Probe: inner is .*Inner.*, must be of type Inner: write Inner\(\.\.\.\)"):
        Probe(1.0, inner=Inner)


def test_shapes_are_checked_while_traced_and_ranges_are_not():
    made = jax.jit(lambda x: Probe(x, length=x).length)(-2.0)
    assert float(made) == -2.0
    with pytest.raises(ValueError, match=r"amount has shape \(3,\), must be a single number"):
        jax.jit(lambda x: Probe(x).amount)(jnp.ones(3))


def test_many_objects_are_made_by_vmap():
    many = jax.vmap(Probe)(jnp.arange(32.0))
    assert many.amount.shape == (32,) and many.steps == 3
    assert "amount=[32 numbers from 0 to 31] um" in str(many)
    np.testing.assert_array_equal(jax.vmap(lambda probe: probe.amount * 2)(many), 2 * np.arange(32.0))


def test_sizes_are_python_numbers_also_when_given_as_numpys():
    probe = Probe(1.0, steps=np.int64(4), rate=np.float64(0.25))
    assert type(probe.steps) is int and type(probe.rate) is float
    assert jax.tree.structure(probe) == jax.tree.structure(Probe(1.0, steps=4, rate=0.25))


def test_objects_print_their_numbers_with_units():
    assert str(Probe(6.9, 3.4, values=[0.0, 0.5, 1.0])) == (
        "Probe(amount=6.9 um, length=3.4 mm, teeth=20, limit=None, values=[0, 0.5, 1], steps=3, rate=0.5, "
        "side='both', switch=True, inner=Inner())"
    )
    traced = []
    jax.jit(lambda x: traced.append(str(Probe(x))) or x)(1.0)
    assert traced[0].startswith("Probe(amount=f64[], length=")
