"""Search for the best modification: known optima, constraints, several loads and gears, honest reports, refusals."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy
from catalogue import LINE, gear_pair, ppte
from known_optimum import BOX as TALL
from known_optimum import DELTA0, Known, depth, grid, ppte_of, ppte_of_parabolas

import jaxgear as jg
from jaxgear.conditions import conditions
from jaxgear.numerics import decoded, halton, next_generation
from jaxgear.tolerance import GearTolerance

TORQUE = 50.0
BOX = {"pinion": (0.0, 20.0), "wheel": (0.0, 20.0), "length": (1.0, 5.7)}


def design(x):
    return jg.TipRelief(x["pinion"], x["length"]), jg.TipRelief(x["wheel"], x["length"])


@pytest.fixture(scope="module")
def mesh():
    return jg.prepare(gear_pair(), resolution=LINE)


@pytest.fixture(scope="module")
def optimum(mesh):
    return jg.minimize(jg.Problem(mesh, TORQUE, design, BOX), jg.optimize.SLP(starts=4), positions=None)


@pytest.fixture(scope="module")
def known():
    return Known()


@pytest.fixture(scope="module")
def searched(known):
    """The best design without constraints, and what the search told on its way."""
    looks = []
    return known.minimize(known.parabolas, TALL, callback=lambda *args: looks.append(args)), looks


@pytest.fixture(scope="module")
def best(searched):
    return searched[0]


@pytest.mark.slow
def test_cuts_the_variation_to_an_eighth(mesh, optimum):
    assert optimum.ppte < 0.125 * ppte(mesh, TORQUE)


@pytest.mark.slow
def test_beats_the_sizing_rule_and_every_point_of_a_grid(mesh, optimum):
    result = optimum
    rule = jg.iso_relief(mesh.pair, TORQUE)
    assert result.ppte < ppte(mesh, TORQUE, rule, rule)
    axes = np.meshgrid(*(np.linspace(low, high, 4) for low, high in BOX.values()))
    for values in zip(*(axis.ravel() for axis in axes)):
        assert result.ppte < ppte(mesh, TORQUE, *design(dict(zip(BOX, values))))


def check_of_parameters(mesh, torque, result, box):
    """Flanks, cycle and numbers of a result are those of its parameters."""
    assert ppte(mesh, torque, result.pinion, result.wheel) == pytest.approx(result.ppte, abs=1e-9)
    assert np.ptp(result.cycle.transmission_error) == pytest.approx(result.ppte, abs=1e-9)
    assert result.objective == pytest.approx(result.ppte, abs=1e-9)
    assert float(result.pinion.amount) == pytest.approx(result.parameters["pinion"])
    assert float(result.wheel.amount) == pytest.approx(result.parameters["wheel"])
    assert result.method == "slp" and result.objective_name == "ppte"
    assert result.violation == 0.0 and result.constraints == {}
    for name, (low, high) in box.items():
        assert low <= result.parameters[name] <= high
        at = {low: "lower", high: "upper"}.get(result.parameters[name])
        assert result.active_bounds.get(name) == at


@pytest.mark.slow
def test_result_belongs_to_its_parameters(known, best):
    check_of_parameters(known.mesh, known.torque, best, TALL)


@pytest.mark.slow
def test_result_of_teeth_belongs_to_its_parameters(mesh, optimum):
    check_of_parameters(mesh, TORQUE, optimum, BOX)
    assert float(optimum.wheel.length) == pytest.approx(optimum.parameters["length"])


@pytest.mark.slow
def test_progress_only_improves(searched):
    result, looks = searched
    assert looks[-1][0] == looks[-1][1] == 2 * 40  # two rounds
    assert np.all(np.diff(result.history) <= 0)
    assert np.all(np.diff(result.history_evaluations) >= 0)
    assert [value for *_, value in looks] == list(result.history)
    assert result.history[-1] == result.objective
    assert result.history_evaluations[-1] == result.evaluations


def test_a_bound_in_the_way_is_named(known):
    result = known.minimize(known.parabolas, {"pinion": (0.0, 2.0), "wheel": (0.0, 2.0)})
    assert result.active_bounds["pinion"] == "upper"
    assert result.active_bounds["wheel"] == "upper"
    assert result.parameters["pinion"] == pytest.approx(2.0)
    # no step is left within the bounds
    assert result.optimality < 1e-2 * result.ppte


def test_a_search_without_a_finite_design_fails(known):
    broken = eqx.tree_at(lambda m: m.structure, known.mesh, np.full(known.mesh.structure.shape, np.nan))
    said = "16 of 16 designs tried: the iteration did not converge: raise newton_steps of the resolution"
    with pytest.raises(RuntimeError, match=f"no design .* has a converged contact solution; {said}"):
        jg.minimize(jg.Problem(broken, known.torque, known.parabolas, TALL), jg.optimize.SLP(starts=8), positions=None)


def test_reaches_the_closed_form(known, best):
    """The optimum lies where the peak beside single contact moves on to the next position: 1 + e / 36 = 1/2 + 5 e / 16
    with the amount e of both gears relative to DELTA0, and PPTE 1/2 + e / 36 - e / 4."""
    amount = 0.5 / (5 / 16 - 1 / 36)
    assert best.parameters["pinion"] == pytest.approx(DELTA0 * amount, rel=1e-6)
    assert best.parameters["wheel"] == pytest.approx(DELTA0 * amount, rel=1e-6)
    assert best.ppte == pytest.approx(DELTA0 * (0.5 + amount / 36 - amount / 4), rel=1e-6)
    assert best.ppte <= ppte_of_parabolas(*grid()).min()
    # at a kink the plain gradient is far from zero, the linear program knows that no step is left
    assert best.optimality < 1e-6
    assert best.evaluations < 250


METHODS = [
    jg.optimize.Adam(starts=4, steps=200),
    pytest.param(jg.optimize.LBFGS(starts=2, steps=90), marks=pytest.mark.slow),
    pytest.param(jg.optimize.CMAES(population=32, generations=15), marks=pytest.mark.slow),
    pytest.param(jg.optimize.DifferentialEvolution(population=32, generations=25), marks=pytest.mark.slow),
    pytest.param(jg.optimize.Genetic(population=32, generations=30), marks=pytest.mark.slow),
]


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.name)
def test_every_method_finds_the_same_optimum(known, best, method):
    result = known.minimize(known.parabolas, TALL, method=method)
    assert result.method == method.name
    assert best.ppte <= result.ppte < 1.01 * best.ppte
    assert ppte_of_parabolas(*result.parameters.values()) == pytest.approx(result.ppte, abs=1e-9)
    assert result.evaluations > best.evaluations
    assert np.all(np.diff(result.history) <= 0)
    if hasattr(method, "population"):
        # one linearization, worth three, says how much is left
        assert result.evaluations == method.population * method.generations + 3
        assert len(result.history) == method.generations


def test_chance_is_seeded(known):
    first, again, other = (
        known.minimize(known.parabolas, TALL, method=jg.optimize.Genetic(population=32, generations=2, seed=seed))
        for seed in (0, 0, 1)
    )
    assert first.parameters == again.parameters
    assert first.parameters != other.parameters


def test_strings_of_bits_are_numbers_and_the_fitter_ones_multiply():
    """Selection alone: a string has children in proportion to its fitness; the last generation is of bits on."""
    strings = jnp.asarray(np.random.default_rng(0).integers(0, 2, (400, 6)), bool)
    assert np.allclose(decoded(strings[:5], 3), np.asarray(strings[:5]).reshape(5, 2, 3) @ [4, 2, 1] / 7)
    counted = next_generation(jax.random.key(1), strings, jnp.where(strings[:, 0], 3.0, 1.0), 0.0, 0.0)
    before, after = (float(jnp.mean(part[:, 0])) for part in (strings, counted))
    assert after == pytest.approx(3 * before / (1 + 2 * before), abs=0.07)
    for seed in range(30):
        fitness = jnp.sum(strings, axis=1).astype(float) ** 4
        strings = next_generation(jax.random.key(seed), strings, fitness, 0.5, 0.05)
    assert jnp.mean(strings) > 0.9


def test_a_table_of_variants_is_searched_whole(known):
    result = known.minimize(known.parabolas, TALL, method=jg.optimize.Factorial({"pinion": 4, "wheel": 8}))
    pinion, wheel = np.meshgrid(np.linspace(0.0, 40.0, 4), np.linspace(0.0, 40.0, 8))
    values = ppte_of_parabolas(pinion, wheel)
    assert result.evaluations == 32 + 3  # as many as a population: one program
    assert result.ppte == pytest.approx(values.min(), abs=1e-9)
    index = values.argmin()
    assert result.parameters == pytest.approx({"pinion": pinion.flat[index], "wheel": wheel.flat[index]})
    # no optimum, and it says so: a hundredth of the range would already help
    assert result.optimality > 0.5
    step = 0.01 * 40.0 * np.array([-1.0, 0.0, 1.0])
    near = ppte_of_parabolas(*np.meshgrid(pinion.flat[index] + step, wheel.flat[index] + step))
    assert near.min() < result.ppte - 0.005


class Limited:
    """Searches within limits, all by one program; the volume of a relief is proportional to its amount."""

    def __init__(self, known, best):
        volume = float(eqx.filter_jit(jg.metrics.removed_volume)(known.mesh, pinion=best.pinion, wheel=best.wheel))
        self.per_amount = volume / (best.parameters["pinion"] + best.parameters["wheel"])
        self.known, self.traced = known, 0

    def parabolas(self, x):
        self.traced += 1
        return self.known.parabolas(x)

    def minimize(self, most, **box):
        """The best design of at most `most` um of both amounts together."""
        limits = [
            jg.Constraint("max_relief", high=11.5),
            jg.Constraint({"pinion": 1.0, "wheel": -1.0}, high=-3.0),
            jg.Constraint("removed_volume", high=most * self.per_amount),
            jg.Constraint("max_relief", low=1.0),
        ]
        return self.known.minimize(self.parabolas, TALL | box, constraints=limits)


@pytest.fixture(scope="module")
def limited(known, best):
    return Limited(known, best)


@pytest.fixture(scope="module")
def held(limited):
    """The best design within all limits."""
    return limited.minimize(19.4)


def test_constraints_are_kept(limited, held, best):
    """Optima within the limits are read off a grid."""
    most = 19.4
    pinion, wheel = grid()
    kept = (np.maximum(pinion, wheel) <= 11.5) & (pinion - wheel <= -3.0) & (pinion + wheel <= most)

    result = held
    assert result.violation <= 1e-3
    assert result.objective == pytest.approx(ppte_of_parabolas(pinion, wheel)[kept].min(), rel=3e-3)
    assert result.objective > 1.5 * best.objective
    assert result.constraints["1 pinion + -1 wheel"].value == pytest.approx(-3.0, rel=2e-3)
    assert result.constraints["removed_volume"].value == pytest.approx(most * limited.per_amount, rel=2e-3)
    assert result.parameters["pinion"] + result.parameters["wheel"] == pytest.approx(most, rel=2e-3)
    # within the limits nothing is left
    assert result.optimality < 1e-2

    # a narrower box, in which the third limit is in the way
    result = limited.minimize(most, pinion=(0.0, 5.0))
    assert result.violation <= 1e-3
    assert result.objective == pytest.approx(ppte_of_parabolas(pinion, wheel)[kept & (pinion <= 5.0)].min(), rel=3e-3)
    assert result.constraints["max_relief"].value == pytest.approx(11.5, rel=2e-3)
    assert result.active_bounds == {"pinion": "upper"}

    # a box in which they cannot be kept: the least violation wins, and is reported
    result = limited.minimize(most, wheel=(23.0, 40.0))
    assert result.parameters["wheel"] == pytest.approx(23.0)
    assert result.violation == pytest.approx(1.0, rel=1e-6)
    assert not result.feasible and not result.constraints["max_relief"].kept
    assert "23 um, NOT MET: at most 11.5" in str(result)


def test_limits_of_one_quantity_are_told_apart(held):
    assert list(held.constraints) == ["max_relief", "1 pinion + -1 wheel", "removed_volume", "max_relief (2)"]


def test_another_limit_traces_nothing_anew(limited, held):
    before = limited.traced
    assert limited.minimize(19.3).objective > held.objective
    # once to see that all parameters are used, and once for the modifications of the optimum: outside of any program
    assert limited.traced - before == 2


def missing(cycle):
    """Large numbers up to an amount of 25 um of the pinion, beyond it none."""
    amount = cycle.pinion.amount
    return jnp.where(amount > 25.0, jnp.inf, 1e4 * (30.0 - amount))


def least_missing(known, most):
    limit = jg.Constraint({"pinion": 1.0}, high=most)
    return known.minimize(known.parabolas, TALL, objective=missing, constraints=[limit])


def test_a_limit_holds_against_an_objective_of_large_numbers(known):
    """Its multiplier is 5e4 per relative violation: a penalty of fixed size would give way."""
    result = least_missing(known, 5.0)
    assert result.parameters["pinion"] == pytest.approx(5.0, rel=2e-3)
    assert result.violation <= 1e-3


def test_designs_without_a_finite_value_are_avoided(known):
    assert 24.9 < least_missing(known, 39.0).parameters["pinion"] <= 25.0


def test_a_dip_of_a_relief_has_its_closed_form(known):
    """From the largest depth, b1^2 / (4 |b2|), down to that of the tip, b1 + b2; none of a monotone relief."""
    reversal = eqx.filter_jit(jg.metrics.relief_reversal)
    for b2, dip in ((-1.5, DELTA0 * (2.5**2 / 6.0 - 1.0)), (-1.25, 0.0)):
        relief, _ = known.quadratics({"b1": 2.5, "b2": b2})
        found = float(reversal(known.mesh, pinion=relief, wheel=relief))
        assert found == pytest.approx(dip, rel=1e-3, abs=1e-9)


@pytest.mark.slow
def test_a_relief_that_must_not_dip(known):
    """h = b1 s + b2 s^2 with b1 >= 2.5 levels best when it falls again towards the tip; monotone is b2 >= -b1 / 2."""
    reversal = eqx.filter_jit(jg.metrics.relief_reversal)
    box = {"b1": (2.5, 3.5), "b2": (-3.0, 1.0)}
    b1, b2 = np.meshgrid(np.linspace(2.5, 3.5, 201), np.linspace(-3.0, 1.0, 801))
    relief = DELTA0 * (b1[..., None] * depth() + b2[..., None] * depth() ** 2)
    values, monotone = ppte_of(relief, relief), b2 >= -b1 / 2
    assert values.min() < 0.9 * values[monotone].min()
    limit = jg.Constraint("relief_reversal", high=0.0)
    result = known.minimize(known.quadratics, box, constraints=[limit])
    assert result.objective == pytest.approx(values[monotone].min(), rel=1e-2)
    assert result.violation <= 1e-3
    assert float(reversal(known.mesh, pinion=result.pinion, wheel=result.wheel)) <= 1e-3


def test_worst_of_two_torques_is_equal_at_both(known):
    """Long relief: the best amount belongs to the middle of the range, and PPTE is (T_hi - T_lo) / (4 k r_b)."""
    loads = jg.LoadSpectrum([0.5 * known.torque, 1.5 * known.torque])
    result = known.minimize(known.lines, {"amount": (0.0, 40.0)}, torque=loads, measure=jg.Worst())
    assert result.objective_name == "worst ppte"
    assert result.parameters["amount"] == pytest.approx(DELTA0, rel=1e-4)
    assert result.objective == pytest.approx(0.25 * DELTA0, rel=1e-4)
    ends = [ppte(known.mesh, torque, result.pinion, result.wheel) for torque in loads.torques]
    assert ends[0] == pytest.approx(ends[1], rel=1e-3)
    assert ends[0] == pytest.approx(result.objective, rel=1e-3)
    # every step is judged under both loads, with its gradient
    assert result.evaluations % (2 * 3) == 0


@pytest.mark.slow
def test_manufactured_gears(known, best):
    """Every design meets the same gears: a repetition gives the same numbers, and the nominal optimum can be beaten."""
    tolerance = jg.Tolerance(pinion=GearTolerance(profile_slope=6.0, pitch=4.0), wheel=GearTolerance(profile_slope=6.0))
    measure = jg.CVaR(0.75)
    made = jg.ManufacturedGears(tolerance, samples=8, seed=3)

    def search():
        return known.minimize(known.parabolas, TALL, measure=measure, manufactured=made)

    result, again = search(), search()
    assert result.parameters == again.parameters and result.objective == again.objective
    assert result.objective_name == "75 % CVaR of ppte"

    removed = conditions(known.mesh, known.torque, made).on(known.mesh).removed[0]
    assert removed.shape[0] == 8

    def tail(found):
        """Mean of the two worst of eight."""
        values = [ppte(known.mesh, known.torque, found.pinion, found.wheel, deviation) for deviation in removed]
        return np.sort(values)[-2:].mean()

    assert tail(result) == pytest.approx(result.objective, rel=1e-9)
    assert result.objective < tail(best) - 0.01
    assert best.ppte < result.ppte < result.objective


@pytest.mark.parametrize(
    ("bounds", "options", "words"),
    [
        ({}, {}, "which is not a variable"),
        ({"pinion": (2.0, 1.0)}, {}, "upper bound of pinion"),
        ({"pinion": (float("nan"), 1.0)}, {}, "lower bound of pinion"),
        (BOX, {"method": "newton"}, '"newton" is not known'),
        (BOX, {"objective": "noise"}, '"noise" is not known'),
        (BOX, {"objective": ("ppte", "removed_volume")}, "jaxgear.optimize.pareto"),
        (BOX, {"constraints": [jg.Constraint({"lenght": 1.0}, high=5.0)]}, '"lenght" of a constraint'),
        (BOX, {"objective": jg.Quantity("te", lambda cycle: cycle.transmission_error)}, r"te: gives an array of shape"),
        (BOX, {"objective": "pptee"}, 'did you mean "ppte"'),
        (BOX, {"torque": -1.0}, "torque"),
        (BOX, {"method": jg.optimize.Factorial(1000)}, "1000000000 designs"),
    ],
)
def test_refuses_what_it_cannot_search(known, bounds, options, words):
    with pytest.raises(ValueError, match=words):
        known.minimize(design, bounds, **options)


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (jg.TipRelief(1.0, 2.0), "design: gives one TipRelief, must give two modifications"),
        ((jg.TipRelief(1.0, 2.0),), "design: gives 1 values"),
        ((jg.TipRelief(1.0, 2.0), 3.0), "design: the wheel is of type float, must be a modification or None"),
    ],
)
def test_refuses_a_design_that_makes_no_two_modifications(known, made, words):
    with pytest.raises(ValueError, match=words):
        jg.minimize(jg.Problem(known.mesh, TORQUE, lambda x: made, BOX))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: jg.Constraint("noise", high=1.0), '"noise" is not known'),
        (lambda: jg.Constraint({}, high=1.0), "at least one free parameter"),
        (lambda: jg.Constraint("max_relief"), "low or high"),
        (lambda: jg.Constraint("max_relief", low=2.0, high=1.0), "high"),
        (lambda: jg.optimize.SLP(rtol=0.0), "rtol"),
        (lambda: jg.optimize.SLP(starts=0), "starts = 0"),
        (lambda: jg.optimize.SLP(steps=0), "steps = 0"),
        (lambda: jg.optimize.Adam(steps=1), "steps = 1"),
        (lambda: jg.optimize.Genetic(population=3), "population = 3"),
        (lambda: jg.optimize.Genetic(crossover=1.5), "crossover"),
        (lambda: jg.optimize.CMAES(spread=0.0), "spread"),
        (lambda: jg.optimize.Factorial(0), "levels = 0"),
    ],
)
def test_refuses_meaningless_options(make, words):
    with pytest.raises(ValueError, match=words):
        make()


@pytest.mark.parametrize("seed", [None, 3])
def test_start_points_are_those_of_scipy(seed):
    for dimensions, count in ((1, 1), (9, 200)):
        known = scipy.stats.qmc.Halton(dimensions, scramble=seed is not None, seed=seed).random(count)
        np.testing.assert_array_equal(halton(dimensions, count, seed), known)
