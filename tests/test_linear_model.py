"""The linearized problem: its slopes are those of the contact analysis, its best step is that of the exact extremes."""

from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxgear as jg
from jaxgear.optimize.cases import cases
from jaxgear.optimize.linear_model import Model
from jaxgear.optimize.problem import Linearization, Roughness, make_problem


def problem_of(measure, weights, roughness=None):
    """What a model asks of a problem."""
    return SimpleNamespace(measure=measure, cases=SimpleNamespace(weights=np.asarray(weights)), roughness=roughness)


def linear(upper, slope, excess=(), excess_slope=None):
    """A linearization of a peak-to-peak value; leading axis cases."""
    upper, slope = np.atleast_2d(upper).astype(float), np.asarray(slope, float)
    count = slope.shape[-1]
    slopes = np.zeros((0, count)) if excess_slope is None else np.asarray(excess_slope, float)
    return Linearization(upper, upper, slope, slope, np.asarray(excess, float), slopes, np.asarray(True))


def test_the_best_line_through_a_parabola_equioscillates():
    """Chebyshev: the straight line with the least range of t^2 - c t over [0, 1] is c = 1, with the range 1/4."""
    t = np.linspace(0.0, 1.0, 101)
    start = 0.5
    model = Model(problem_of(jg.Mean(), [1.0]), np.array([start]), linear(t**2 - 2 * start * t, -2 * t[None, :, None]))
    step = model.best_step(1.0)
    # the parameter is half the slope of the line; 1/2 is best already
    assert step.step == pytest.approx([0.0], abs=1e-9) and step.decrease == pytest.approx(0.0, abs=1e-9)
    start = 0.1
    model = Model(problem_of(jg.Mean(), [1.0]), np.array([start]), linear(t**2 - 2 * start * t, -2 * t[None, :, None]))
    step = model.best_step(1.0)
    assert start + step.step[0] == pytest.approx(0.5, abs=1e-9)
    assert step.decrease == pytest.approx(model.value - 0.25, abs=1e-9)
    assert start + model.best_step(0.2).step[0] == pytest.approx(0.3, abs=1e-9)


def two_cases():
    """Case 0 has the range |x - 0.2|, case 1 has 3 |x - 0.8|; linearized at x = 0.5."""
    upper = np.array([[0.0, 0.3], [0.0, 0.9]])
    slope = np.array([[[0.0], [1.0]], [[0.0], [-3.0]]])
    return linear(upper, slope)


@pytest.mark.parametrize(
    "measure, weights, best, value",
    [
        (jg.Mean(), [0.5, 0.5], 0.8, 0.3),  # the steeper case wins
        (jg.Mean(), [0.9, 0.1], 0.2, 0.18),  # unless it is rare
        (jg.Worst(), [0.9, 0.1], 0.65, 0.45),  # both equal
        (jg.CVaR(0.5), [0.5, 0.5], 0.65, 0.45),  # the worse half
        (jg.CVaR(0.0), [0.5, 0.5], 0.8, 0.3),  # all of it: the mean
    ],
)
def test_measures_over_cases(measure, weights, best, value):
    model = Model(problem_of(measure, weights), np.array([0.5]), two_cases())
    step = model.best_step(0.5)
    assert 0.5 + step.step[0] == pytest.approx(best, abs=1e-8)
    assert model.value - step.decrease == pytest.approx(value, abs=1e-8)


def test_bounds_and_constraints_stop_the_step():
    upper, slope = np.array([[0.0, 1.0]]), np.array([[[0.0, 0.0], [-1.0, -1.0]]])
    free = Model(problem_of(jg.Mean(), [1.0]), np.array([0.9, 0.2]), linear(upper, slope)).best_step(0.3)
    assert free.step == pytest.approx([0.1, 0.3]) and free.decrease == pytest.approx(0.4)
    # first parameter at most 0.95: (x - 0.95) / 0.95
    limited = linear(upper, slope, excess=[-0.05 / 0.95], excess_slope=[[1 / 0.95, 0.0]])
    step = Model(problem_of(jg.Mean(), [1.0]), np.array([0.9, 0.2]), limited).best_step(0.3)
    assert step.step == pytest.approx([0.05, 0.3], abs=1e-7)
    # from outside, the step goes back inside first
    outside = linear(upper, slope, excess=[0.05], excess_slope=[[1.0, 0.0]])
    model = Model(problem_of(jg.Mean(), [1.0]), np.array([0.9, 0.2]), outside)
    step = model.best_step(0.3)
    assert model.violation == pytest.approx(0.05)
    assert step.step == pytest.approx([-0.05, 0.3], abs=1e-7)
    assert step.decrease == pytest.approx(0.25 + 100 * 0.05, rel=1e-6)


def test_roughness_is_weighed_against_the_objective():
    """One parameter lowers the objective by 1, and a penalty on its size costs its weight."""
    upper, slope = np.array([[0.0, 1.0]]), np.array([[[0.0], [-1.0]]])
    for weight, end in ((0.5, 1.0), (1.5, 0.0)):
        rough = Roughness(jnp.asarray([[1.0]]), jnp.asarray(weight))
        model = Model(problem_of(jg.Mean(), [1.0], rough), np.array([0.2]), linear(upper, slope))
        step = model.best_step(1.0)
        assert model.value == pytest.approx(1.0 + 0.2 * weight)
        assert 0.2 + step.step[0] == pytest.approx(end)
        assert step.decrease == pytest.approx((1 - weight) * (end - 0.2))


def test_a_failed_contact_solution_is_no_candidate():
    failed = two_cases()._replace(fine=np.asarray(False))
    model = Model(problem_of(jg.Mean(), [0.5, 0.5]), np.array([0.5]), failed)
    assert not model.fine and model.value == np.inf


def test_slopes_at_all_positions_come_from_one_gradient():
    """The transmission error at a position depends on the material removed there alone."""
    gears = [jg.Gear(teeth, 3.0, face_width=18.0, bore_diameter=bore) for teeth, bore in ((19, 24.0), (48, 70.0))]
    pair = jg.GearPair(*gears)
    mesh = jg.prepare(pair, resolution=jg.Resolution(positions=24, pairs=jg.fewest_pairs(pair)))

    def design(x):
        return jg.TipRelief(x["amount"], x["length"], jg.Power(x["exponent"])), jg.TipRelief(x["amount"], 4.0)

    bounds = {"amount": (0.0, 12.0), "length": (1.0, 6.0), "exponent": (1.0, 3.0)}
    load = jg.LoadSpectrum([40.0, 60.0])
    problem = make_problem(design, bounds, mesh, cases(mesh, load), ("ppte",), jg.Mean(), ())
    x = jnp.asarray([0.5, 0.7, 0.4])

    @jax.jit
    def curves(x):
        pinion, wheel = problem.modifications(x)
        solve = lambda torque: jg.solve(mesh, torque, pinion=pinion, wheel=wheel).transmission_error  # noqa: E731
        return jax.vmap(solve)(load.torques)

    found = jax.jit(lambda x: problem.linearize(x))(x)
    np.testing.assert_allclose(found.upper, curves(x), rtol=1e-12)
    step = 1e-5
    for index in range(3):
        offset = step * jnp.eye(3)[index]
        difference = (curves(x + offset) - curves(x - offset)) / (2 * step)
        np.testing.assert_allclose(found.slope[:, :, index], difference, rtol=1e-5, atol=1e-6)
    assert bool(found.fine)
