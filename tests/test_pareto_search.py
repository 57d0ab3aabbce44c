"""Fronts of several objectives, on the pair whose front can be read off a grid of closed forms."""

import equinox as eqx
import numpy as np
import pytest
from known_optimum import BOX, DELTA0, Known, grid, ppte_of_parabolas

import jaxgear as jg

VOLUME = ("ppte", "removed_volume")


@pytest.fixture(scope="module")
def known():
    return Known()


@pytest.fixture(scope="module")
def searched(known):
    """PPTE against the material to grind off."""
    return known.pareto(known.parabolas, BOX, objective=VOLUME, method=jg.optimize.Pareto(points=12))


@pytest.fixture(scope="module")
def volume_per_amount(known):
    """[mm3/um] of the sum of both amounts: the gears are equal."""
    pinion, wheel = known.parabolas({"pinion": 0.5, "wheel": 0.5})
    return float(eqx.filter_jit(jg.metrics.removed_volume)(known.mesh, pinion=pinion, wheel=wheel))


def dominated(values):
    """Rows that another row beats."""
    worse = (values[:, None] >= values[None]).all(axis=-1) & (values[:, None] > values[None]).any(axis=-1)
    return worse.any(axis=1)


@pytest.mark.slow
def test_no_design_beats_another(searched):
    front = searched
    assert front.objectives == VOLUME
    assert front.units == ("um", "mm3")
    assert len(front.values) <= 12
    assert not dominated(front.values).any()
    # no two of them are one
    scaled = front.values / np.ptp(front.values, axis=0)
    apart = np.abs(scaled[:, None] - scaled[None]).max(axis=-1)[np.triu_indices(len(scaled), 1)]
    assert apart.min() > 0.01
    # what is gained in one objective is lost in the other
    assert np.all(np.diff(front.values[:, 0]) > 0)
    assert np.all(np.diff(front.values[:, 1]) < 0)


def test_parameters_reproduce_the_values(searched, volume_per_amount):
    front = searched
    pinion, wheel = front.parameters["pinion"], front.parameters["wheel"]
    assert len(pinion) == len(front.values)
    for amounts in (pinion, wheel):
        assert np.all((amounts >= 0.0) & (amounts <= 40.0))
    np.testing.assert_allclose(front.values[:, 0], ppte_of_parabolas(pinion, wheel), atol=1e-9)
    np.testing.assert_allclose(front.values[:, 1], volume_per_amount * (pinion + wheel), atol=1e-6)


def test_ends_are_the_optima_of_either_objective(searched):
    """The least PPTE, of which test_optimize tells the closed form; and nothing removed at all."""
    front = searched
    amount = 0.5 / (5 / 16 - 1 / 36)
    assert front.values[0, 0] == pytest.approx(DELTA0 * (0.5 + amount / 36 - amount / 4), rel=0.05)
    assert front.values[-1] == pytest.approx([0.5 * DELTA0, 0.0], abs=1e-3)


def test_front_is_the_true_one(searched, volume_per_amount):
    """At every volume, the least PPTE of all amounts whose volume is not larger."""
    pinion, wheel = grid()
    volume, values = (volume_per_amount * (pinion + wheel)).ravel(), ppte_of_parabolas(pinion, wheel).ravel()
    order = np.argsort(volume)
    volume, least = volume[order], np.minimum.accumulate(values[order])
    true = least[np.searchsorted(volume, searched.values[:, 1] + 1e-9, side="right") - 1]
    lost = searched.values[:, 0] / true - 1
    assert np.all(lost > -0.01)  # the grid is not finer
    assert np.median(lost) < 0.002
    # and it leaves no wide gap
    assert np.diff(searched.values[:, 0]).max() < 0.15 * np.ptp(searched.values[:, 0])


def test_compromise_is_a_design_of_the_front_next_to_the_ideal(searched):
    front = searched
    compromise = searched.compromise
    (index,) = np.flatnonzero(np.isclose(front.values[:, 0], compromise.ppte, atol=1e-9))
    assert searched.chosen == index
    for name, value in compromise.parameters.items():
        assert value == pytest.approx(front.parameters[name][index], rel=1e-12)
    low, high = front.values.min(axis=0), front.values.max(axis=0)
    distance = ((front.values - low) / (high - low)).max(axis=1)
    assert distance[index] < 1.05 * distance.min()
    assert compromise.objective == pytest.approx(distance[index], rel=0.05)
    assert compromise.objective_name == "distance from the ideal of ppte and removed_volume"
    # a contact analysis with two gradients counts as five; every design is linearized at the start of each round
    linearized, rest = divmod(compromise.evaluations, 5)
    assert rest == 0 and 3 * 12 <= linearized < 3 * 12 * 20


def test_every_design_of_the_front_has_first_order_evidence(searched, volume_per_amount):
    """What is left is what no direction improves in both objectives; beside the front there is such a direction."""
    front = searched
    assert front.optimality.shape == (len(front.values),)
    assert np.isfinite(front.optimality).all() and (front.optimality >= 0).all()
    # most designs were sought, each until no step was left
    assert np.median(front.optimality) < 0.05
    assert front.compromise.optimality == front.optimality[front.chosen]


def three_within(known, most, **options):
    """A front of three objectives, the pinion's relief at most so much larger than the wheel's [um]."""
    limit = jg.Constraint({"pinion": 1.0, "wheel": -1.0}, high=most)
    method = jg.optimize.Pareto(points=12, **options)
    return known.pareto(known.parabolas, BOX, objective=(*VOLUME, "max_relief"), constraints=[limit], method=method)


@pytest.mark.slow
def test_three_objectives_within_a_limit(known, volume_per_amount):
    result = front = three_within(known, -4.0)
    assert front.values.shape[1] == 3
    assert not dominated(front.values).any()
    assert np.all(np.diff(front.values[:, 0]) >= 0)
    pinion, wheel = front.parameters["pinion"], front.parameters["wheel"]
    assert np.all(pinion - wheel <= -4.0 * (1 - 1e-3))
    expected = ppte_of_parabolas(pinion, wheel), volume_per_amount * (pinion + wheel), np.maximum(pinion, wheel)
    np.testing.assert_allclose(front.values, np.stack(expected, axis=1), atol=1e-5)
    assert result.compromise.violation <= 1e-3


@pytest.mark.slow
def test_four_objectives(known):
    names = ("ppte", "removed_volume", "max_relief", "mesh_loss_factor")
    front = known.pareto(known.parabolas, BOX, objective=names, method=jg.optimize.Pareto(points=8, steps=5))
    assert front.objectives == names
    assert front.values.shape[1] == 4 and np.isfinite(front.values).all()
    assert not dominated(front.values).any()


def test_limits_that_no_design_keeps(known):
    with pytest.raises(RuntimeError, match="meets the constraints"):
        three_within(known, -41.0, steps=2)


@pytest.mark.slow
def test_a_front_without_a_solved_design_says_why(known):
    broken = eqx.tree_at(lambda m: m.structure, known.mesh, np.full(known.mesh.structure.shape, np.nan))
    method = jg.optimize.Pareto(points=4, steps=2)
    with pytest.raises(RuntimeError, match="designs tried: the iteration did not converge: raise newton_steps"):
        jg.optimize.pareto(
            jg.Problem(broken, known.torque, known.parabolas, BOX, objective=VOLUME), method, positions=None
        )


@pytest.mark.parametrize(("options", "words"), [({"points": 1}, "points = 1"), ({"steps": 0}, "steps = 0")])
def test_refuses_what_makes_no_front(options, words):
    with pytest.raises(ValueError, match=words):
        jg.optimize.Pareto(**options)
