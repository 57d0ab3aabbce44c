"""Flanks without a given form, and the named curves that stand in for them."""

from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE, POWER_BOX, gear_pair, power_reliefs, ppte

import jaxgear as jg
from jaxgear.metrics import removed_at

TORQUE, POINTS, SMOOTHNESS = 50.0, 24, 1e-3


@pytest.fixture(scope="module")
def mesh():
    return jg.prepare(gear_pair(), resolution=LINE)


BEST = {"pinion": 6.247156663929497, "wheel": 6.566171863712191, "length": 5.7, "exponent": 1.2014517247056005}


def free(mesh, **options):
    posed = {name: options.pop(name) for name in ("measure", "constraints", "manufactured") if name in options}
    torque, positions = options.pop("torque", TORQUE), options.pop("positions", None)
    method = jg.optimize.FreeForm(**{"points": POINTS, "curvature": SMOOTHNESS} | options)
    return jg.minimize(jg.Problem(mesh, torque, **posed), method, positions=positions)


@pytest.fixture(scope="module")
def optimum(mesh):
    return free(mesh)


@pytest.fixture(scope="module")
def named(mesh, optimum):
    """The best relief of a power curve, as an optimum."""
    pinion, wheel = power_reliefs(BEST)
    found = {"parameters": BEST, "pinion": pinion, "wheel": wheel, "ppte": ppte(mesh, TORQUE, pinion, wheel)}
    return replace(optimum, **found)


@pytest.mark.slow
def test_the_best_named_curve_is_that_of_a_search(mesh, named):
    found = jg.minimize(jg.Problem(mesh, TORQUE, power_reliefs, POWER_BOX), positions=None)
    assert found.ppte == pytest.approx(named.ppte, rel=1e-3)
    assert found.parameters == pytest.approx(BEST, rel=0.01)


def tables(result):
    """Values of pinion and wheel [um], pitch point first."""
    return np.array(list(result.parameters.values())).reshape(2, POINTS)


def rolls(mesh, count):
    """Roll lengths of pinion and wheel from the pitch point to the tip [mm]."""
    contact, pair = mesh.path_of_contact, mesh.pair
    return (
        jnp.asarray(np.linspace(float(contact.pinion_pitch_roll_length), float(pair.pinion.tip_roll_length), count)),
        jnp.asarray(np.linspace(float(contact.wheel_pitch_roll_length), float(pair.wheel.tip_roll_length), count)),
    )


def curvature(mesh, result):
    """Largest second derivative of either table [um/mm^2]."""
    steps = np.array([float(roll[1] - roll[0]) for roll in rolls(mesh, POINTS)])
    return np.abs(np.diff(tables(result), 2, axis=1) / steps[:, None] ** 2).max()


@pytest.mark.slow
def test_beats_the_best_named_curve(mesh, named, optimum):
    assert optimum.method == "free_form"
    assert optimum.ppte < 0.7 * named.ppte
    # next to nothing is left of the variation
    assert optimum.ppte < 0.01 * ppte(mesh, TORQUE)
    assert ppte(mesh, TORQUE, optimum.pinion, optimum.wheel) == pytest.approx(optimum.ppte, abs=1e-9)


@pytest.mark.slow
def test_is_level_between_its_own_positions_too(named, optimum):
    """On a mesh four times as fine."""
    fine = jg.prepare(gear_pair(), resolution=replace(LINE, positions=64))
    left = ppte(fine, TORQUE, optimum.pinion, optimum.wheel)
    assert left < 0.7 * ppte(fine, TORQUE, named.pinion, named.wheel)
    assert left < 0.02 * ppte(fine, TORQUE)


@pytest.mark.slow
def test_removes_nothing_in_common(mesh, optimum):
    """What both flanks of a gear pair lose everywhere shifts the transmission error and is not ground off."""
    values = tables(optimum)
    np.testing.assert_array_equal(values.min(axis=1), 0.0)
    assert values.max() <= 20.0
    assert len(optimum.parameters) == 2 * POINTS
    assert "48 values" in str(optimum)
    np.testing.assert_allclose(optimum.pinion.amount, values[0], rtol=1e-12)
    # tips are relieved, pitch points are not
    assert np.all(values[:, -1] > 5.0)
    assert np.all(values[:, : POINTS // 4] < 1.0)

    def error(pinion):
        return np.asarray(jg.solve(mesh, TORQUE, pinion=pinion, wheel=optimum.wheel).transmission_error)

    thinner = jg.TabulatedProfile(optimum.pinion.position, optimum.pinion.amount + 3.0)
    beside = np.abs(error(thinner) - error(optimum.pinion) - 3.0)
    # where a contact is sought from a kink of a table, rounding decides on which side: 1e-5 um, see below
    assert np.median(beside) < 1e-12 and np.mean(beside < 1e-9) > 0.7 and beside.max() < 2e-5


def test_objective_is_the_variation_and_the_penalty(mesh, optimum):
    expected = optimum.ppte + SMOOTHNESS * curvature(mesh, optimum)
    # at a kink of a table rounding decides on which side a contact is sought, and the search rounds otherwise than the
    # single cycle: 1e-5 um
    assert optimum.objective == pytest.approx(expected, abs=2e-5)
    assert optimum.objective_name == "ppte with curvature penalty"
    assert f"PPTE {optimum.ppte:.4g} um" in " ".join(str(optimum).split())
    assert np.all(np.diff(optimum.history) <= 0)


def test_a_larger_penalty_makes_smoother_flanks(mesh, optimum):
    smooth = free(mesh, curvature=3.0)
    assert curvature(mesh, smooth) < 0.9 * curvature(mesh, optimum)
    assert smooth.ppte > optimum.ppte
    # each is the better one by its own measure
    assert smooth.objective < optimum.ppte + 3.0 * curvature(mesh, optimum)
    assert optimum.objective < smooth.ppte + SMOOTHNESS * curvature(mesh, smooth)


def test_largest_relief_is_kept(mesh, optimum):
    capped = free(mesh, max_relief=2.5)
    assert tables(capped).max() <= 2.5 + 1e-12
    assert tables(optimum).max() > 2.5
    assert optimum.ppte < capped.ppte < ppte(mesh, TORQUE)


def test_a_flank_to_start_from_does_not_get_worse(mesh, named):
    """One step from the best named curve, as the table samples it."""
    start = named.pinion, named.wheel
    sampled = [
        jg.TabulatedProfile(roll, removed_at(mesh.sides[index], flank, roll))
        for index, (flank, roll) in enumerate(zip(start, rolls(mesh, POINTS)))
    ]
    started = free(mesh, start=start, steps=1, curvature=0.0)
    assert started.ppte <= ppte(mesh, TORQUE, *sampled) + 1e-9
    # two searches, of one linearization each before and after the step
    assert started.evaluations <= 2 * 2 * 3


def distances(mesh, first, second):
    """Largest distance of two pairs of flanks from the pitch points to the tips [um]."""
    far = 0.0
    for index, roll in enumerate(rolls(mesh, 1001)):
        one, other = (removed_at(mesh.sides[index], flanks[index], roll) for flanks in (first, second))
        far = max(far, np.abs(np.asarray(one) - np.asarray(other)).max())
    return far


def test_projection_says_what_it_costs(mesh, optimum):
    made = jg.optimize.project(optimum, "power")
    assert made.curve == "power"
    assert made.ppte == pytest.approx(ppte(mesh, TORQUE, made.pinion, made.wheel), abs=1e-9)
    assert made.loss == pytest.approx(made.ppte - optimum.ppte, abs=1e-12)
    assert made.loss > 0
    expected = distances(mesh, (made.pinion, made.wheel), (optimum.pinion, optimum.wheel))
    assert made.misfit == pytest.approx(expected, rel=0.02)
    assert made.misfit < 0.2 * tables(optimum).max()


@pytest.mark.parametrize(
    "curves", [("quadratic", "linear"), pytest.param(("cubic", "quadratic", "linear"), marks=pytest.mark.slow)]
)
def test_a_curve_of_more_terms_fits_better(optimum, curves):
    """Every cubic can be a quadratic, and that a line."""
    misfits = [jg.optimize.project(optimum, curve).misfit for curve in curves]
    assert (np.diff(misfits) > 0).all()


def test_projection_of_a_named_curve_is_that_curve(mesh, named):
    made = jg.optimize.project(named, "power")
    assert made.misfit < 1e-3
    assert abs(made.loss) < 1e-3
    for relief, gear in ((made.pinion, "pinion"), (made.wheel, "wheel")):
        assert float(relief.amount) == pytest.approx(named.parameters[gear], rel=1e-3)
        assert float(relief.length) == pytest.approx(named.parameters["length"], rel=1e-3)
        assert float(relief.curve.exponent) == pytest.approx(named.parameters["exponent"], rel=1e-3)


@pytest.mark.parametrize(
    ("curve", "shape"),
    [
        ("linear", jg.Linear()),
        ("parabolic_linear", jg.ParabolicLinear(0.35)),
        ("quadratic", jg.Polynomial([0.0, 0.7, 0.3])),
    ],
)
def test_projection_recovers_other_curves(named, curve, shape):
    reliefs = jg.TipRelief(8.0, 3.1, shape), jg.TipRelief(5.0, 2.2, shape)
    made = jg.optimize.project(eqx.tree_at(lambda o: (o.pinion, o.wheel), named, reliefs), curve)
    assert made.misfit < 0.01
    for found, relief in zip((made.pinion, made.wheel), reliefs):
        assert float(found.length) == pytest.approx(float(relief.length), rel=0.01)
        # the amount at the tip, whatever the parameters of the curve
        assert float(found.amount * found.curve(jnp.ones(()))) == pytest.approx(float(relief.amount), rel=1e-3)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"points": 3}, "points = 3"),
        ({"steps": 0}, "steps = 0"),
        ({"max_relief": 0.0}, "max_relief"),
        ({"curvature": -1.0}, "curvature"),
        ({"constraints": [jg.Constraint({"pinion": 1.0}, high=5.0)]}, "of a constraint must be one of"),
    ],
)
def test_refuses_what_it_cannot_search(mesh, options, words):
    with pytest.raises(ValueError, match=words):
        free(mesh, **options)


def test_refuses_an_unknown_curve(optimum):
    with pytest.raises(ValueError, match='"parabola" is not known'):
        jg.optimize.project(optimum, "parabola")
