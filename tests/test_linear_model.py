"""Sequential linear programming: slopes of the linearized problem, and the best step of the linear program."""

from dataclasses import replace
from types import SimpleNamespace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE, POWER_BOX, gear_pair, power_reliefs, solve_any

import jaxgear as jg
from jaxgear.numerics.reductions import Range
from jaxgear.optimize.goal import FEASIBLE
from jaxgear.optimize.linear_model import PENALTY, LinearModel
from jaxgear.optimize.linearization import Linearization, Pieces
from jaxgear.optimize.problem import Problem, Roughness
from jaxgear.tolerance import GearTolerance

SLOW = pytest.mark.slow
TORQUES = (50.0, 30.0)
POINT = np.array([0.31, 0.46, 0.72, 0.22])
STEP = 1e-5  # of the central differences, in the unit box
WAY = np.array([0.6, -0.5, 0.4, 0.7])  # along which the slopes are compared


@pytest.fixture(scope="module")
def mesh():
    return jg.prepare(gear_pair(), resolution=LINE)


def problem_of(mesh, loads=TORQUES, objective="ppte", constraints=(), **deviations):
    given = {"objective": objective, "constraints": constraints, **deviations}
    return Problem(mesh, jg.LoadSpectrum(loads), power_reliefs, POWER_BOX, **given)


@eqx.filter_jit
def linearize(problem, x):
    return problem.linearize(x)


def differences(function):
    """Central differences over the unit box along `WAY`."""
    return (function(POINT + STEP * WAY) - function(POINT - STEP * WAY)) / (2 * STEP)


def reliefs(x):
    box = POWER_BOX.values()
    return power_reliefs(dict(zip(POWER_BOX, [low + at * (high - low) for at, (low, high) in zip(x, box)])))


@SLOW
def test_slopes_of_the_transmission_error(mesh):
    """One gradient of the sum over the positions gives the slope at each of them, for torques and manufactured gears.

    Nonlinear compliance, coupled tooth pairs and corner contact are all in it.
    """
    tolerance = jg.Tolerance(pinion=GearTolerance(profile_slope=5.0, pitch=4.0))
    problem = problem_of(mesh, manufactured=jg.ManufacturedGears(tolerance, 2, 1))
    found = linearize(problem, jnp.asarray(POINT))
    assert bool(found.fine)
    (pieces,) = found.objectives
    np.testing.assert_array_equal(pieces.upper, pieces.lower)
    np.testing.assert_array_equal(pieces.slope, pieces.lower_slope)
    for case, (torque, sample) in enumerate((t, s) for t in range(2) for s in range(2)):
        deviation = problem.cases.removed[torque, sample]

        def curve(x, torque=torque, deviation=deviation):
            cycle = solve_any(mesh, TORQUES[torque], *reliefs(x), deviation)
            return np.asarray(cycle.transmission_error)

        np.testing.assert_allclose(pieces.upper[case], curve(POINT), atol=1e-8)
        expected = differences(curve)
        assert np.abs(expected).max() > 1.0  # [um over the full range]
        np.testing.assert_allclose(np.asarray(pieces.slope[case]) @ WAY, expected, atol=2e-4 * np.abs(expected).max())


@pytest.mark.slow
def test_every_extreme_has_its_pieces(mesh):
    """Objectives and limits of one's own, pressures and lines: every value with its slope, by the cheapest way.

    Two slopes of a pair's pressure take fewer gradients than four parameters; of a curve that is not known to be local
    every parameter has a direction.
    """
    ripple = jg.Quantity("ripple", lambda cycle: cycle.transmission_error, "um", reduction=Range())
    pressure = jg.quantities["max_flank_pressure"]
    elsewhere = replace(pressure, name="elsewhere", local=False)
    many = replace(pressure, name="many", of=lambda cycle: jnp.concatenate([cycle.contact_pressure] * 3))
    limits = [jg.Constraint(of, high=700.0) for of in (pressure, elsewhere, many)]
    linear = jg.Constraint({"pinion": 2.0, "length": -1.0}, low=3.0, high=5.0)
    limits += [jg.Constraint("ppte", high=0.5), linear]
    problem = problem_of(mesh, loads=TORQUES[:1], objective=ripple, constraints=limits)
    found = linearize(problem, jnp.asarray(POINT))
    own, named = found.objectives[0], found.limits[3]
    aimed_at = 0.5 * (1 - FEASIBLE)
    np.testing.assert_allclose((own.upper - aimed_at) / 0.5, named.upper, atol=1e-9)
    np.testing.assert_allclose(own.slope / 0.5, named.slope, atol=1e-6)

    # one gradient of the sum over the positions gives the slope of the transmission error at each of them: nonlinear
    # compliance, coupled tooth pairs and corner contact are all in it
    def curve(x):
        return np.asarray(cycle_at(x).transmission_error)

    def cycle_at(x):
        return jg.solve(mesh, TORQUES[0], **dict(zip(("pinion", "wheel"), reliefs(x))))

    assert bool(found.fine)
    np.testing.assert_array_equal(own.upper, own.lower)
    np.testing.assert_array_equal(own.slope, own.lower_slope)
    np.testing.assert_allclose(own.upper[0], curve(POINT), atol=1e-8)
    np.testing.assert_allclose(named.value, [np.ptp(curve(POINT)) / 0.5 - (1 - FEASIBLE)], rtol=1e-7)
    expected = differences(curve)
    assert np.abs(expected).max() > 1.0  # [um over the full range]
    np.testing.assert_allclose(np.asarray(own.slope[0]) @ WAY, expected, atol=2e-4 * np.abs(expected).max())

    def line(x):
        combined = 2.0 * 20.0 * x[0] - (1.0 + 4.7 * x[2])
        return np.array([combined / 5.0 - 1, 1 - combined / 3.0])

    passed, slopes = zip(*((limit.upper[0, 0], limit.slope[0, 0]) for limit in found.limits[4:]))
    np.testing.assert_allclose(passed, line(POINT), rtol=1e-9)
    np.testing.assert_allclose(np.stack(slopes) @ WAY, differences(line), atol=1e-4)

    local, other, thrice = found.limits[:3]

    def excess(x):
        return np.asarray(cycle_at(x).contact_pressure) / 700 - (1 - FEASIBLE)

    np.testing.assert_allclose(local.upper[0], excess(POINT).ravel(), atol=1e-9)
    np.testing.assert_allclose(local.slope, other.slope, atol=1e-8)
    np.testing.assert_allclose(thrice.slope[0], np.concatenate([np.asarray(local.slope[0])] * 3), atol=1e-8)
    expected = differences(excess).ravel()
    # a contact that begins or ends within the step of the differences has no slope
    close = np.isclose(np.asarray(local.slope[0]) @ WAY, expected, atol=2e-4 * np.abs(expected).max())
    assert close.mean() > 0.9


@SLOW
def test_a_score_is_the_value_of_the_linearization(mesh):
    problem = problem_of(mesh, loads=TORQUES[:1])
    value = eqx.filter_jit(lambda problem, x: problem.score(x))(problem, jnp.asarray(POINT)).value[0]
    (own,) = linearize(problem, jnp.asarray(POINT)).objectives
    np.testing.assert_allclose(own.value, [float(value)], rtol=1e-9)


def effort(cycle):
    return cycle.pinion.amount**2 * cycle.pinion.length


@SLOW
def test_slopes_of_another_objective_and_of_constraints(mesh):
    linear = jg.Constraint({"pinion": 2.0, "length": -1.0}, low=3.0, high=5.0)
    limits = (jg.Constraint("removed_volume", high=40.0), linear)
    problem = problem_of(mesh, loads=TORQUES[:1], objective=effort, constraints=limits)
    found = linearize(problem, jnp.asarray(POINT))
    assert bool(found.fine)

    def value(x):
        return np.array([(20.0 * x[0]) ** 2 * (1.0 + 4.7 * x[2])])

    # the objective is the single upper piece, above nothing
    (pieces,) = found.objectives
    np.testing.assert_allclose(pieces.upper[0], value(POINT), rtol=1e-12)
    assert pieces.lower is None
    np.testing.assert_allclose(np.asarray(pieces.slope[0]) @ WAY, differences(value), atol=1e-5)

    volume = eqx.filter_jit(jg.metrics.removed_volume)

    def excess(x):
        combined = 2.0 * 20.0 * x[0] - (1.0 + 4.7 * x[2])
        return np.array(
            [
                float(volume(mesh, **dict(zip(("pinion", "wheel"), reliefs(x))))) / 40.0 - (1 - FEASIBLE),
                combined / 5.0 - 1,
                1 - combined / 3.0,
            ]
        )

    limits = [(limit.upper[0, 0], limit.slope[0, 0]) for limit in found.limits]
    passed, slopes = zip(*limits)
    np.testing.assert_allclose(passed, excess(POINT), rtol=1e-9)
    np.testing.assert_allclose(np.stack(slopes) @ WAY, differences(excess), atol=1e-4)


def model(values, slope, x, *, measure=None, weights=None, excess=None, excess_slope=None, forms=None, weight=0.0):
    """Model of hand-made pieces, shapes (cases, pieces) and (cases, pieces, parameters)."""
    values, slope, x = np.asarray(values, float), np.asarray(slope, float), np.asarray(x, float)
    weights = np.full(len(values), 1 / len(values)) if weights is None else np.asarray(weights)
    rough = None if forms is None else Roughness(jnp.asarray(forms), jnp.asarray(weight))
    problem = SimpleNamespace(
        measure=measure or jg.Mean(), cases=SimpleNamespace(weights=jnp.asarray(weights)), roughness=rough
    )
    excess = np.zeros(0) if excess is None else np.asarray(excess, float)
    excess_slope = np.zeros((0, len(x))) if excess_slope is None else np.asarray(excess_slope, float)
    objective = Pieces(values, slope, values, slope)
    limits = tuple(Pieces(over[None, None], rise[None, None]) for over, rise in zip(excess, excess_slope))
    return LinearModel(problem, x, Linearization((objective,), limits, np.True_), penalty=PENALTY)


def test_chebyshev_polynomial():
    """t^3 + b t^2 + c t with the least variation on [0, 1] is the Chebyshev polynomial, which touches its extremes four
    times: b = -3/2, c = 9/16, variation 1/16."""
    t = np.linspace(0.0, 1.0, 17)
    x = np.array([0.2, 0.1])  # b = x1 - 2, c = x2
    curve = t**3 + (x[0] - 2) * t**2 + x[1] * t
    slope = np.stack([t**2, t], axis=-1)
    made = model([curve], [slope], x)
    assert made.value == pytest.approx(np.ptp(curve), rel=1e-14)
    found = made.best_step(1.0)
    np.testing.assert_allclose(x + found.step, [0.5, 9 / 16], atol=1e-9)
    assert found.decrease == pytest.approx(np.ptp(curve) - 1 / 16, abs=1e-9)
    level = curve + slope @ found.step
    touched = np.isclose(level, level.max(), atol=1e-9) | np.isclose(level, level.min(), atol=1e-9)
    np.testing.assert_allclose(t[touched], [0.0, 0.25, 0.75, 1.0])
    # there no step is left, although no slope is zero
    again = model([level], [slope], x + found.step).best_step(0.1)
    assert again.decrease == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(again.step, 0.0, atol=1e-9)


def random_problem(seed, cases=5, pieces=12, parameters=3, limits=4):
    rng = np.random.default_rng(seed)
    return {
        "values": rng.normal(size=(cases, pieces)),
        "slope": 3 * rng.normal(size=(cases, pieces, parameters)),
        "x": rng.uniform(0.0, 1.0, parameters),
        "weights": rng.dirichlet(np.ones(cases)),
        "excess": rng.normal(-0.4, 0.3, size=limits),
        "excess_slope": rng.normal(size=(limits, parameters)),
        "forms": rng.normal(size=(6, parameters)),
        "weight": 0.3,
    }


@eqx.filter_jit
def joined(measure, spans, weights):
    return jax.vmap(measure, (0, None))(spans, weights)


def merit(data, measure, steps):
    """What the model predicts after steps (steps, parameters), computed apart from it."""
    pieces = data["values"] + np.einsum("kip,sp->ski", data["slope"], steps)
    spans = np.ptp(pieces, axis=-1)
    if isinstance(measure, jg.Quantile):  # keeps the shares that the cases have at the point
        shares = np.asarray(eqx.filter_jit(measure.shares)(np.ptp(data["values"], axis=1), data["weights"]))
        objective = spans @ shares
    else:
        objective = np.asarray(joined(measure, spans, data["weights"]))
    violation = np.maximum(data["excess"] + steps @ data["excess_slope"].T, 0.0).max(axis=-1)
    rough = np.abs((data["x"] + steps) @ data["forms"].T).max(axis=-1)
    return objective + PENALTY * violation + data["weight"] * rough


@pytest.mark.parametrize(
    ("radius", "seed"),
    [
        pytest.param(radius, seed, marks=() if (radius, seed) in ((0.1, 0), (0.6, 1)) else SLOW)
        for radius in (0.1, 0.6)
        for seed in range(3)
    ],
)
@pytest.mark.parametrize(
    "measure", [jg.Mean(), jg.Worst(), jg.CVaR(0.7), jg.Quantile(0.7)], ids=["mean", "worst", "cvar", "quantile"]
)
def test_no_step_within_reach_is_better(measure, radius, seed):
    """The linear program against an evaluation of the same convex function at many steps."""
    data = random_problem(seed)
    made = model(**data, measure=measure)
    at_point = merit(data, measure, np.zeros((1, 3)))[0]
    assert made.merit == pytest.approx(at_point, rel=1e-12)
    found = made.best_step(radius)
    assert np.all(np.abs(found.step) <= radius + 1e-12)
    assert np.all((data["x"] + found.step >= 0) & (data["x"] + found.step <= 1))
    best = merit(data, measure, found.step[None])[0]
    assert found.decrease == pytest.approx(at_point - best, abs=1e-7)
    assert found.decrease >= 0.0
    rng = np.random.default_rng(seed + 10)
    low, high = np.maximum(-radius, -data["x"]), np.minimum(radius, 1 - data["x"])
    anywhere = rng.uniform(low, high, (20_000, 3))
    near = np.clip(found.step + 1e-3 * rng.normal(size=(20_000, 3)), low, high)
    assert merit(data, measure, np.concatenate([anywhere, near])).min() >= best - 1e-7


def test_bounds_and_radius_end_a_step():
    """A single falling piece against a constant one: as far as it may go."""
    pieces, slope = [[2.0, 0.0]], [[[-1.0], [0.0]]]
    assert model(pieces, slope, [0.2]).best_step(0.3).step == pytest.approx([0.3])
    assert model(pieces, slope, [0.9]).best_step(0.3).step == pytest.approx([0.1])
    assert model(pieces, slope, [1.0]).best_step(0.3).decrease == pytest.approx(0.0, abs=1e-12)


def test_a_constraint_ends_a_step_and_a_violation_comes_first():
    pieces, slope = [[2.0, 0.0]], [[[-1.0], [0.0]]]
    kept = model(pieces, slope, [0.2], excess=[-0.1], excess_slope=[[1.0]])
    assert kept.violation == 0.0
    assert kept.best_step(0.5).step == pytest.approx([0.1])
    # already passed by 0.1: back to the limit, although the objective rises
    passed = model(pieces, slope, [0.2], excess=[0.1], excess_slope=[[1.0]])
    assert passed.violation == pytest.approx(0.1)
    assert passed.merit == pytest.approx(2.0 + 0.1 * PENALTY)
    step = passed.best_step(0.5)
    assert step.step == pytest.approx([-0.1])
    assert step.decrease == pytest.approx(0.1 * PENALTY - 0.1)


@pytest.mark.parametrize("excess", [-1e-2, 0.0, 0.9 * FEASIBLE])
def test_a_limit_that_is_reached_leaves_no_decrease(excess):
    """A falling objective against a rising constraint; what passes the limit within the tolerance is no gain."""
    at_limit = model([[2.0, 0.0]], [[[-1.0], [0.0]]], [0.5], excess=[excess], excess_slope=[[10.0]])
    assert at_limit.optimality(1e-3) == pytest.approx(1.0 if excess == -1e-2 else 0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("measure", "weights", "step", "value"),
    [
        # the worst of 1 + d and 2 - d
        (jg.Worst(), [0.5, 0.5], 0.5, 1.5),
        (jg.Worst(), [0.9, 0.1], 0.5, 1.5),
        # the tail is one case alone, and both where they are equal
        (jg.CVaR(0.5), [0.5, 0.5], 0.5, 1.5),
        # 2/3 of the worse and 1/3 of the better: still the worse one pulls
        (jg.CVaR(0.25), [0.5, 0.5], 0.5, 1.5),
        # the second weighs so little that the mean of the tail is that of the first
        (jg.CVaR(0.1), [0.9, 0.1], -0.5, 1 / 9 * 2.5 + 8 / 9 * 0.5),
        (jg.Mean(), [0.9, 0.1], -0.5, 0.9 * 0.5 + 0.1 * 2.5),
        (jg.Mean(), [0.1, 0.9], 0.5, 1.5),
    ],
)
def test_measures_of_two_opposed_cases(measure, weights, step, value):
    pieces, slope = [[1.0, 0.0], [2.0, 0.0]], [[[1.0], [0.0]], [[-1.0], [0.0]]]
    made = model(pieces, slope, [0.5], measure=measure, weights=weights)
    found = made.best_step(0.5)
    assert found.step == pytest.approx([step], abs=1e-9)
    assert made.value - found.decrease == pytest.approx(value, rel=1e-9)


def test_a_penalty_on_roughness_stops_a_step():
    """The penalty grows by as much as the objective falls, or by more: nothing is gained."""
    pieces, slope = [[2.0, 0.0]], [[[-1.0], [0.0]]]
    for weight, step in ((0.9, 0.5), (1.1, -0.2)):
        made = model(pieces, slope, [0.2], forms=[[1.0]], weight=weight)
        assert made.value == pytest.approx(2.0 + 0.2 * weight)
        assert made.best_step(0.5).step == pytest.approx([step])


def test_a_failed_solution_has_no_value():
    made = model([[2.0, 0.0]], [[[-1.0], [0.0]]], [0.2])
    assert made.fine and np.isfinite(made.value)
    problem = SimpleNamespace(measure=jg.Mean(), cases=SimpleNamespace(weights=jnp.ones(1)), roughness=None)
    pieces, slope = np.zeros((1, 2)), np.zeros((1, 2, 1))
    failed = LinearModel(
        problem,
        np.array([0.2]),
        Linearization((Pieces(pieces, slope, pieces, slope),), (), np.False_),
    )
    assert not failed.fine
    assert np.isnan(failed.optimality(1e-3))
    assert failed.value == np.inf
