"""Flanks of free form are better than any named curve, smooth as asked, and what replaces them says what it costs."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import gear_pair

import jaxgear as jg

TORQUE, POINTS = 50.0, 20


@pytest.fixture(scope="module")
def mesh():
    pair = gear_pair()
    return jg.prepare(pair, resolution=jg.Resolution(positions=32, pairs=jg.fewest_pairs(pair)))


@pytest.fixture(scope="module")
def free(mesh):
    return jg.free_form(mesh, TORQUE, points=POINTS)


@pytest.fixture(scope="module")
def named(mesh):
    def design(x):
        relief = jg.TipRelief(x["amount"], x["length"], jg.Power(x["exponent"]))
        return relief, relief

    bounds = {"amount": (0.0, 15.0), "length": (1.0, 6.0), "exponent": (1.0, 3.0)}
    return jg.minimize(design, bounds, mesh=mesh, torque=TORQUE, starts=4)


def tables(optimum):
    return np.asarray(list(optimum.parameters.values())).reshape(2, POINTS)


def test_beats_the_best_named_curve_between_the_positions_too(mesh, free, named):
    assert free.ppte < 0.1 * named.ppte
    fine = jg.prepare(mesh.pair, resolution=jg.Resolution(positions=128, pairs=mesh.resolution.pairs))
    solve = eqx.filter_jit(lambda pinion, wheel: jg.solve(fine, TORQUE, pinion=pinion, wheel=wheel))
    error = solve(free.pinion, free.wheel).transmission_error
    assert float(jg.peak_to_peak(error)) < 0.7 * named.ppte


def test_removes_nothing_that_no_transmission_error_shows(mesh, free):
    """What both ends of a contact lose alike only turns the gears."""
    assert tables(free).min(axis=1) == pytest.approx([0.0, 0.0], abs=1e-12)
    assert (tables(free) >= 0).all() and (tables(free) <= 20.0).all()
    again = jg.solve(mesh, TORQUE, pinion=free.pinion, wheel=free.wheel)
    assert float(jg.peak_to_peak(again.transmission_error)) == pytest.approx(free.ppte, abs=1e-9)


def test_a_penalty_on_the_curvature_smooths_the_flanks(mesh, free):
    stiff = jg.free_form(mesh, TORQUE, points=POINTS, curvature=1.0)
    bent = [np.abs(np.diff(tables(optimum), 2, axis=1)).max() for optimum in (free, stiff)]
    assert bent[1] < 0.8 * bent[0]
    assert free.ppte < stiff.ppte < 1.5


def test_a_projection_finds_the_curve_that_a_flank_has(named):
    """Both tips of the named optimum are power curves already: the fit gives them back and costs nothing."""
    fit = jg.project(named, "power")
    for relief in (fit.pinion, fit.wheel):
        assert float(relief.amount) == pytest.approx(named.parameters["amount"], rel=1e-4)
        assert float(relief.length) == pytest.approx(named.parameters["length"], rel=1e-4)
        assert float(relief.curve.exponent) == pytest.approx(named.parameters["exponent"], rel=1e-4)
    assert fit.loss == pytest.approx(0.0, abs=1e-4) and fit.misfit < 1e-3


def test_a_projection_says_what_it_costs(mesh, free):
    fits = {curve: jg.project(free, curve) for curve in ("linear", "quadratic", "cubic")}
    for fit in fits.values():
        again = jg.solve(mesh, TORQUE, pinion=fit.pinion, wheel=fit.wheel)
        assert fit.ppte == pytest.approx(float(jg.peak_to_peak(again.transmission_error)), abs=1e-9)
        assert fit.loss == pytest.approx(fit.ppte - free.ppte) and fit.loss > 0
    # every cubic can be a quadratic
    assert fits["cubic"].misfit < fits["quadratic"].misfit < fits["linear"].misfit


def test_a_refused_curve_or_size(mesh, free):
    with pytest.raises(ValueError, match='curve = "square" is not known'):
        jg.project(free, "square")
    for options, words in (
        ({"points": 2}, "points = 2"),
        ({"max_relief": 0.0}, "max_relief = 0 um"),
        ({"curvature": -1.0}, "curvature = -1"),
        ({"constraints": [jg.Constraint({"a": 1.0}, high=1.0)]}, "names parameters"),
    ):
        with pytest.raises(ValueError, match=words):
            jg.free_form(mesh, TORQUE, **options)


def test_a_front_trades_variation_for_material(mesh):
    def design(x):
        relief = jg.TipRelief(x["amount"], x["length"])
        return relief, relief

    bounds = {"amount": (0.0, 10.0), "length": (1.0, 6.0)}
    objectives = ("ppte", "removed_volume")
    method = jg.Pareto(points=8, steps=120)
    found = jg.minimize(design, bounds, mesh=mesh, torque=TORQUE, objective=objectives, method=method)
    front = found.front
    values, parameters = front.values, np.stack(list(front.parameters.values()), axis=1)
    assert front.objectives == objectives and front.units == ("um", "mm3") and len(values) >= 5
    assert (np.diff(values[:, 0]) > 0).all() and (np.diff(values[:, 1]) < 0).all()

    @jax.jit
    def numbers(amount, length):
        relief = jg.TipRelief(amount, length)
        cycle = jg.solve(mesh, TORQUE, pinion=relief, wheel=relief)
        return jnp.stack([jg.peak_to_peak(cycle.transmission_error), jg.removed_volume(mesh, relief, relief)])

    for row, point in zip(values, parameters):
        np.testing.assert_allclose(numbers(*point), row, rtol=1e-6)
    assert found.ppte in values[:, 0]
    assert np.isnan(found.gradient_norm)
