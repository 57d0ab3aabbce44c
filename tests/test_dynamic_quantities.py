"""Dynamic quantities in the one vocabulary: they find the mesh, agree with the sweep, and have exact slopes."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE, gear_pair

import jaxgear as jg
from jaxgear.contact.status import Status
from jaxgear.dynamics import DYNAMIC_QUANTITIES, KICKED, Dynamics
from jaxgear.dynamics.runs import Run, design_runs
from jaxgear.metrics import Analysis
from jaxgear.optimize import Problem

TORQUE = 200.0
PLAY = -60.0  # um, so that flanks part before the coast flanks touch
# the "varying stiffness" compiles in a tenth of the time of the map, and vibrates as much
SETTINGS = Dynamics(
    mesh_frequencies=[1900.0, 2500.0, 3100.0],
    damping_ratio=0.05,
    pinion_inertia=7.8e-3,
    wheel_inertia=7.8e-3,
    model="varying stiffness",
    positions=16,  # those of the mesh, so that it is not prepared again
    kick=1.0,
    steps=64,
)
HEIGHT = 2.4  # um


@pytest.fixture(scope="module")
def mesh():
    sizes = {"face_width": 20.0, "tips": (154.5709, 154.5709), "bores": (40.0, 40.0)}
    return jg.prepare(gear_pair((50, 50), **sizes, tooth_thickness_allowance=PLAY), resolution=LINE)


def design(parameters):
    relief = jg.TipRelief(parameters["height"], 3.2)
    return relief, relief


def numbers(mesh, height):
    """Dynamic factor and rms of all runs and speeds."""
    relief = jg.TipRelief(height, 3.2)
    found = SETTINGS.numbers(SETTINGS.oscillator(mesh, TORQUE, pinion=relief, wheel=relief))
    return jnp.stack([found.dynamic_factor, found.dte_rms]), found.exact


@pytest.fixture(scope="module")
def sloped(mesh):
    """Numbers, their derivatives by the height of the relief, and which are those of an orbit."""

    @eqx.filter_jit
    def of(mesh, height):
        one = jnp.ones_like(height)
        return jax.jvp(lambda height: numbers(mesh, height), (height,), (one,))

    def plain(height):
        (values, exact), (slopes, _) = of(mesh, jnp.asarray(height))
        return np.asarray(values), np.asarray(slopes), np.asarray(exact)

    return plain


@pytest.mark.slow
def test_slopes_are_those_of_central_differences(sloped):
    """At every speed of every run."""
    step = 1e-3
    (_, slopes, exact), (above, *_), (below, *_) = (sloped(HEIGHT + side) for side in (0.0, step, -step))
    assert exact.all()
    assert slopes == pytest.approx((above - below) / (2 * step), rel=1e-4, abs=1e-6)
    assert np.abs(slopes).max() > 1e-2


def oscillator_of(mesh, height):
    relief = jg.TipRelief(height, 3.2)
    return SETTINGS.oscillator(mesh, TORQUE, pinion=relief, wheel=relief)


numbers_of = Dynamics.numbers  # which a test below replaces


@eqx.filter_jit
def along(oscillator, way):
    """Numbers of what vibrates, and the slopes of two of them along a change of its own numbers."""
    moving, rest = eqx.partition(oscillator, eqx.is_inexact_array)

    def of(moving):
        found = numbers_of(SETTINGS, eqx.combine(moving, rest))
        return jnp.stack([found.dynamic_factor, found.dte_rms]), found

    return jax.jvp(of, (moving,), (way,), has_aux=True)


STEP = 1e-3


@pytest.fixture(scope="module")
def nearby(mesh):
    """What vibrates with a little more relief and with a little less, and how it changes with the relief."""
    several = [oscillator_of(mesh, HEIGHT + side) for side in (STEP, -STEP)]
    above, below = (eqx.filter(each, eqx.is_inexact_array) for each in several)
    way = jax.tree.map(lambda a, b: jnp.asarray((np.asarray(a) - np.asarray(b)) / (2 * STEP)), above, below)
    return several, way


def test_slopes_along_a_change_of_what_vibrates_are_those_of_differences(mesh, nearby):
    """Of the mesh force by the relief, at every speed of every run."""
    several, way = nearby
    _, slopes, found = along(oscillator_of(mesh, HEIGHT), way)
    above, below = (np.asarray(along(each, way)[0]) for each in several)
    assert np.asarray(found.exact).all()
    assert np.asarray(slopes) == pytest.approx((above - below) / (2 * STEP), rel=1e-4, abs=1e-6)
    assert np.abs(slopes).max() > 1e-2


def test_a_quantity_is_the_number_of_the_sweep(mesh, nearby, monkeypatch):
    """The whole chain, cycle, mesh, force and oscillator, against the steps done by hand."""
    monkeypatch.setattr(Dynamics, "numbers", lambda _, oscillator: along(oscillator, nearby[1])[2])
    relief = jg.TipRelief(HEIGHT, 3.2)
    cycle = Analysis(jg.solve(mesh, TORQUE, pinion=relief, wheel=relief), mesh)
    values = [float(SETTINGS.quantity(f"worst_{name}")(cycle)) for name in ("dynamic_factor", "dte_rms")]
    runs = SETTINGS.runs(oscillator_of(mesh, HEIGHT))
    assert list(runs) == ["up", "down"]
    swept = [max(getattr(run, name).max() for run in runs.values()) for name in ("dynamic_factor", "dte_rms")]
    np.testing.assert_allclose(values, swept, rtol=2e-3)
    assert values[0] > 1.1


@pytest.mark.slow
def test_an_objective_is_the_number_of_the_sweep(mesh):
    """The whole chain, cycle, mesh, force and oscillator, against the steps done by hand; and its slope."""
    objectives = [SETTINGS.quantity("worst_dynamic_factor"), SETTINGS.quantity("worst_dte_rms")]
    problem = Problem(mesh, TORQUE, design, {"height": (0.0, 8.0)}, objective=objectives)

    @eqx.filter_jit
    def scored(problem, x):
        return jax.jvp(lambda x: problem.score(x).value, (x,), (jnp.ones_like(x),))

    step = 1e-3 / 8
    (values, slopes), (above, _), (below, _) = (
        scored(problem, jnp.asarray([HEIGHT / 8 + side])) for side in (0.0, step, -step)
    )
    runs = SETTINGS.runs(oscillator_of(mesh, HEIGHT))
    assert list(runs) == ["up", "down"]
    swept = [max(getattr(run, name).max() for run in runs.values()) for name in ("dynamic_factor", "dte_rms")]
    np.testing.assert_allclose(values, swept, rtol=2e-3)
    assert values[0] > 1.1
    np.testing.assert_allclose(slopes, np.subtract(above, below) / (2 * step), rtol=1e-4)
    assert np.abs(slopes).min() > 8e-2


@pytest.mark.slow
@pytest.mark.parametrize("of_contacts", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_many_designs_are_each_as_alone(mesh, of_contacts):
    """Batches of two, the last one filled up; the contacts of one design count as not found."""
    heights, found = jnp.asarray([0.0, HEIGHT, 5.0]), jnp.asarray([True, True, False])
    middle = oscillator_of(mesh, HEIGHT)

    def of(height):
        if of_contacts:
            return oscillator_of(mesh, height)
        return eqx.tree_at(lambda of: of.mesh_damping, middle, middle.mesh_damping * (1 + 0.1 * height))

    def make(design):
        height, found = design
        oscillator = of(height)
        lost = jnp.where(found, oscillator.mesh_force.status, jnp.int8(Status.MORE_PAIRS_NEEDED))
        return eqx.tree_at(lambda of: of.mesh_force.status, oscillator, lost)

    def keep(runs):
        return runs, jnp.max(runs["down"].dynamic_factor)

    runs, worst = SETTINGS.runs_of(make, (heights, found), keep=keep, batch=2)
    assert set(runs) == {"up", "down"} and runs["down"].direction == "down"
    runs, worst = jax.tree.map(np.asarray, (runs, worst))
    assert worst[:2] == pytest.approx(runs["down"].dynamic_factor[:2].max(axis=1)) and np.isnan(worst[2])
    assert np.isnan(runs["up"].dte_rms[2]).all() and (runs["up"].status[2] == Status.MORE_PAIRS_NEEDED).all()
    for i in range(2):
        alone = SETTINGS.runs(of(heights[i]))
        one = jax.tree.map(lambda part: part[i], runs)  # noqa: B023 - at once
        assert jax.tree.all(jax.tree.map(lambda a, b: np.allclose(a, b, rtol=1e-9, atol=1e-6), one, alone))


def test_designs_have_one_leading_axis():
    for designs in (1.0, (jnp.ones(2), jnp.ones(3)), jnp.ones(0)):
        with pytest.raises(ValueError, match="^designs must be arrays with one leading axis"):
            SETTINGS.runs_of(lambda design: design, designs)
    with pytest.raises(ValueError, match="^steps must be given"):
        design_runs(lambda design: design, jnp.ones(2), [1000.0], {"up": Run()})


@pytest.mark.slow
def test_a_linearization_has_the_slopes_of_every_speed(mesh, sloped):
    objectives = [SETTINGS.quantity("worst_dynamic_factor"), SETTINGS.quantity("worst_dte_rms")]
    problem = Problem(mesh, TORQUE, design, {"height": (0.0, 8.0)}, objective=objectives)
    found = eqx.filter_jit(lambda problem, x: problem.linearize(x))(problem, jnp.asarray([HEIGHT / 8]))
    assert bool(found.fine)
    values, slopes, _ = sloped(HEIGHT)
    for pieces, value, slope in zip(found.objectives, values, slopes):
        assert np.asarray(pieces.upper[0]) == pytest.approx(value.ravel(), rel=1e-8)
        assert np.asarray(pieces.slope[0, :, 0]) == pytest.approx(8 * slope.ravel(), rel=1e-6, abs=1e-8)


def test_quantities_of_the_same_settings_share_a_sweep(mesh, monkeypatch):
    """As objectives and limits of one problem; those at the speed of the operating point have their own."""
    traced = []
    made = Dynamics.numbers
    monkeypatch.setattr(Dynamics, "numbers", lambda *args: traced.append(args) or made(*args))
    objectives = [SETTINGS.quantity("worst_dynamic_factor"), SETTINGS.quantity("worst_contact_loss_share")]
    limit = jg.Constraint(SETTINGS.quantity("worst_dte_rms"), high=5.0)
    bounds = {"height": (0.0, 8.0)}
    problem = Problem(mesh, TORQUE, design, bounds, objective=objectives, constraints=[limit])
    for times in (1, 2):  # a second trace has nothing of the first one
        eqx.filter_eval_shape(problem.score, jnp.asarray([0.3]))
        assert len(traced) == times
    cycle = dataclasses.replace(jg.solve(mesh, TORQUE), operating_point=jg.OperatingPoint(TORQUE, speed=3000.0))
    analysis = Analysis(cycle, mesh)
    names = "dynamic_factor", "dte_rms", "worst_dte_rms"
    jax.eval_shape(lambda: [SETTINGS.quantity(name)(analysis) for name in names])
    assert len(traced) == 4


def test_equal_settings_make_equal_quantities():
    again = dataclasses.replace(SETTINGS, damping_ratio=0.05)
    one, same = SETTINGS.quantity("worst_dynamic_factor"), again.quantity("worst_dynamic_factor")
    assert one == same
    assert one != dataclasses.replace(SETTINGS, damping_ratio=0.06).quantity("worst_dynamic_factor")


def test_names_are_known_and_refused_without_settings(mesh):
    cycle = jg.solve(mesh, TORQUE)
    for name in DYNAMIC_QUANTITIES:
        assert jg.quantities[name].name == name
    with pytest.raises(ValueError, match=r"^worst_dynamic_factor: needs settings, give .*\[dynamics\]$"):
        jg.quantities["worst_dynamic_factor"](Analysis(cycle, mesh))
    with pytest.raises(ValueError, match='"loudness" is not known, must be one of dynamic_factor'):
        SETTINGS.quantity("loudness")


def test_a_cycle_without_its_mesh_is_refused(mesh):
    cycle = jg.solve(mesh, TORQUE)
    with pytest.raises(ValueError, match="^worst_dte_rms: needs the prepared mesh"):
        SETTINGS.quantity("worst_dte_rms")(cycle)
    with pytest.raises(ValueError, match="^dynamic_factor: needs a speed"):
        SETTINGS.quantity("dynamic_factor")(Analysis(cycle, mesh))
    many = jax.tree.map(lambda leaf: np.stack([leaf, leaf]) if eqx.is_array(leaf) else leaf, cycle)
    with pytest.raises(ValueError, match="batch axes"):
        Analysis(many, mesh)


@pytest.mark.parametrize(
    "given, message",
    [
        ({"damping_ratio": 0.1, "damping": 1e-3}, "damping_ratio and damping are both given"),
        ({"pinion_bearing": [100.0, 100.0]}, "must both be given"),
        ({"pinion_bearing_damping": [1e-3, 1e-3]}, "has no effect without"),
        ({"pinion_bearing": [1.0], "wheel_bearing": [1.0, 2.0]}, "has 1 numbers, must be two"),
        ({"pinion_bearing": [1.0, 2.0, 3.0], "wheel_bearing": [1.0, 2.0]}, "wheel_bearing has 2 numbers, must be 3 as"),
        ({"mesh_frequencies": [2000.0, 1000.0]}, "must increase"),
        ({"kick": 0.5}, "kick = 0.5 must be at least 1"),
        ({"kick": 3.0, "kicks": [3.0]}, "kick and kicks are both given"),
        ({"model": "springs"}, "model = 'springs' must be \"map\""),
    ],
)
def test_bad_settings_are_one_line(given, message):
    with pytest.raises(ValueError, match=message) as caught:
        Dynamics(**{"mesh_frequencies": [1000.0, 2000.0], **given})
    assert "\n" not in str(caught.value)


def test_no_kick_saves_a_run():
    assert SETTINGS.run_names == ("up", "down")
    assert dataclasses.replace(SETTINGS, kick=3.0).run_names == ("up", "down", "down, kicked")


@pytest.mark.slow
def test_kicks_without_a_size_find_two_cycles_of_a_relieved_pair(mesh):
    """Which kicks of 2.5 meet, and one of 3.1 does not."""
    settings = dataclasses.replace(SETTINGS, mesh_frequencies=[5000.0, 5200.0], damping_ratio=0.03, kick=None)
    moving = settings.oscillator(mesh, TORQUE, pinion=jg.TipRelief(HEIGHT, 3.2), wheel=jg.TipRelief(HEIGHT, 3.2))
    one_size = dataclasses.replace(settings, kicks=[3.1, 3.1, 3.1]).run(moving, KICKED)
    assert (np.asarray(one_size.period) == 1).all() and float(one_size.dynamic_factor.max()) < 1.3
    found = settings.run(moving, KICKED)
    assert (np.asarray(found.period) == 2).all() and float(found.dynamic_factor.min()) > 2.5
