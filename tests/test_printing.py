"""Every object that a user can print shows its numbers with their units, not the types of its arrays."""

import dataclasses
import inspect

import equinox as eqx
import jax
import jax.numpy as jnp
import pytest
from catalogue import gear_pair

import jaxgear as jg
from jaxgear.numerics import Checked

NAMESPACES = (
    jg,
    jg.compliance,
    jg.conditions,
    jg.contact,
    jg.geometry,
    jg.metrics,
    jg.microgeometry,
    jg.optimize,
    jg.sizing,
    jg.sweeps,
    jg.tolerance,
)
MODULES = {
    cls
    for namespace in NAMESPACES
    for cls in vars(namespace).values()
    if inspect.isclass(cls) and issubclass(cls, eqx.Module) and not inspect.isabstract(cls)
}


def leaves(cls):
    """Fields of a class that are neither static nor objects that print themselves."""
    for field in dataclasses.fields(cls):
        itself = inspect.isclass(field.type) and issubclass(field.type, eqx.Module)
        if not field.metadata.get("static") and not itself:
            yield field.name


@pytest.mark.parametrize(
    "cls",
    sorted(MODULES, key=lambda cls: cls.__name__),
    ids=lambda cls: cls.__name__,
)
def test_every_exported_class_prints_its_numbers(cls):
    own = cls.__str__ is not object.__str__ or cls.__repr__ is not eqx.Module.__repr__
    assert issubclass(cls, Checked) or own or not list(leaves(cls))


@pytest.mark.parametrize(
    ("make", "shown"),
    [
        (
            lambda: jg.iso_relief(gear_pair(), 50.0),
            "TipRelief(amount=7.64472 um, length=5.71792 mm, curve=Parabolic())",
        ),
        (lambda: jg.Gear(19, 3.0, face_width=20.0), "Gear(teeth=19, module=3 mm, pressure_angle=20 deg"),
        (lambda: jg.Material(), "Material(elastic_modulus=206000 MPa, poisson_ratio=0.3, density=7850 kg/m^3"),
        (lambda: jg.path_of_contact(gear_pair()), "PathOfContact(start=-7.73831 mm, inner_single=-2.02039 mm"),
        (lambda: jg.LoadSpectrum([50.0, 80.0]), "LoadSpectrum(torques=[50, 80] N m, weights=[0.5, 0.5], speeds=None"),
        (lambda: jg.harmonics(jnp.cos(jnp.linspace(0.0, 1.75 * jnp.pi, 8)), 1), "Harmonics(amplitude=[1], phase=["),
    ],
)
def test_numbers_have_their_units(make, shown):
    assert str(make()).startswith(shown)


def test_many_numbers_are_shown_by_their_range_and_traced_ones_by_their_type():
    table = jg.TabulatedProfile(jnp.linspace(5.0, 12.0, 100), jnp.linspace(0.0, 7.0, 100))
    assert "amount=[100 numbers from 0 to 7] um" in str(table)
    seen = []
    jax.jit(lambda x: seen.append(str(jg.LeadSlope(x))) or x)(1.0)
    assert seen == ["LeadSlope(amount=f64[])"]
