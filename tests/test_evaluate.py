"""Quantities of a design as `optimize.evaluate` gives them: those of `solve`, with derivatives that cost little."""

from dataclasses import replace
from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE, SLIDING, gear_pair
from helical_pairs import SIZES, pair_of

import jaxgear as jg
from jaxgear.metrics import Max, Min, Range
from jaxgear.optimize import evaluate

# all that are made of extremes, of a cycle alone
EXTREMES = [
    of for of in jg.quantities.values() if of.local and isinstance(of.reduction, Max | Min | Range) and of.takes is None
]
DESIGN = jnp.asarray([9.0, 3.1, 6.0, 60.0])  # amount and length of the pinion's relief, amount of the wheel's, torque


@cache
def mesh(resolution=LINE):
    return jg.prepare(gear_pair(), resolution=resolution)


def flanks(x):
    return {"pinion": jg.TipRelief(x[0], x[1], jg.Parabolic()), "wheel": jg.TipRelief(x[2], 2.7)}


def ppte(x, mesh):
    return evaluate(mesh, x[-1], "ppte", **flanks(x))


def several(x, mesh, quantities):
    return jnp.stack(evaluate(mesh, x[-1], quantities, **flanks(x)))


def of_solve(x, mesh, quantities):
    cycle = jg.solve(mesh, x[-1], **flanks(x))
    return jnp.stack([of(cycle) for of in quantities])


with_slope = jax.jit(jax.value_and_grad(ppte))


def test_number_and_slope_are_those_of_solve():
    number, slope = with_slope(DESIGN, mesh())
    assert float(number) == pytest.approx(float(of_solve(DESIGN, mesh(), [jg.quantities["ppte"]])[0]), rel=1e-12)
    for place, step in enumerate((1e-4, 1e-4, 1e-4, 1e-3)):
        ends = [float(ppte(DESIGN.at[place].add(way), mesh())) for way in (step, -step)]
        assert float(slope[place]) == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=1e-6)
    assert (jnp.abs(slope) > 1e-4).all()


def test_a_contact_that_is_not_solved_is_no_number():
    assert np.isnan(with_slope(DESIGN.at[-1].set(2e4), mesh())[0])


@pytest.mark.slow
@pytest.mark.parametrize("quantities", [EXTREMES, [jg.quantities["mean_te"], jg.quantities["ppte"]]], ids=len)
def test_all_quantities_have_the_derivatives_of_solve(quantities):
    """Those made of extremes, and those that need every position."""
    here = mesh(SLIDING)
    slopes = jax.jit(jax.jacrev(several), static_argnums=2)(DESIGN, here, tuple(quantities))
    expected = jax.jit(jax.jacfwd(of_solve), static_argnums=2)(DESIGN, here, tuple(quantities))
    largest = np.abs(expected).max(axis=1, keepdims=True)
    np.testing.assert_allclose(slopes / largest, expected / largest, atol=1e-8)


@pytest.mark.slow
def test_second_derivatives_are_those_of_solve():
    def second(numbers):
        number = lambda x, mesh: numbers(x, mesh, (jg.quantities["ppte"],))[0]  # noqa: E731
        return jax.jit(jax.hessian(number))(DESIGN, mesh())

    np.testing.assert_allclose(second(several), second(of_solve), rtol=1e-6, atol=1e-9)


def test_a_gradient_takes_little_more_than_the_value():
    """By operations of what is lowered, with steps of loops counted once."""
    fine = jax.eval_shape(lambda: jg.prepare(gear_pair(), resolution=replace(LINE, positions=64)))

    def operations(function):
        return jax.jit(function).lower(DESIGN, fine).cost_analysis()["flops"]

    assert operations(jax.value_and_grad(ppte)) < 1.3 * operations(ppte)


def test_one_quantity_is_a_number_and_what_cannot_be_is_refused():
    number = evaluate(mesh(), 60.0, "ppte", **flanks(DESIGN))
    assert number.shape == () and float(number) == pytest.approx(float(with_slope(DESIGN, mesh())[0]), rel=1e-12)
    with pytest.raises(ValueError, match=r'^"pptee" is not known, did you mean "ppte"\?$'):
        evaluate(mesh(), 60.0, "pptee")
    with pytest.raises(ValueError, match="^quantities is empty, give at least one$"):
        evaluate(mesh(), 60.0, [])
    with pytest.raises(TypeError, match="^mesh is a float, must be a Mesh"):
        evaluate(60.0, mesh(), "ppte")


@pytest.mark.slow
def test_derivatives_by_helical_gears():
    """By the helix angle, the face width and a relief with crowning, through the mesh."""

    def on(evaluate):
        def number(x):
            mesh = jg.prepare(pair_of(x[0], width=x[1]), resolution=SIZES)
            relief = jg.TipRelief(x[2], 3.1, jg.Parabolic())
            return evaluate(mesh, 150.0, "max_line_load", pinion=relief, wheel=relief + jg.LeadCrowning(x[2]))

        return number

    def plain(name, mesh, torque, **flanks):
        return jg.quantities[name](jg.solve(mesh, torque, **flanks))

    slopes = [jax.jit(jax.grad(on(way)))(jnp.asarray([15.0, 18.0, 9.0])) for way in (evaluate, plain)]
    np.testing.assert_allclose(*slopes, rtol=1e-8, atol=1e-10)
