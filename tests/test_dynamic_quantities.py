"""Dynamic quantities in the one vocabulary: they find the mesh, agree with the sweep, and have exact slopes."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxgear as jg
from jaxgear.dynamics import DYNAMIC_QUANTITIES, Dynamics
from jaxgear.optimize.problem import make_problem

TORQUE = 200.0
PLAY = -60.0  # um, so that flanks part before the coast flanks touch
# the "varying stiffness" compiles in a tenth of the time of the map, and vibrates as much
SETTINGS = Dynamics(
    mesh_frequencies=[1900.0, 2500.0, 3100.0],
    damping_ratio=0.05,
    pinion_inertia=7.8e-3,
    wheel_inertia=7.8e-3,
    model="varying stiffness",
    positions=32,
    steps=64,
)


@pytest.fixture(scope="module")
def mesh():
    gear = jg.Gear(
        teeth=50, module=3.0, face_width=20.0, tip_diameter=154.5709, bore_diameter=40.0, tooth_thickness_allowance=PLAY
    )
    return jg.prepare(jg.GearPair(gear, gear), resolution=jg.Resolution(positions=16, pairs=4))


def design(parameters):
    relief = jg.TipRelief(parameters["height"], 3.2)
    return relief, relief


@pytest.fixture(scope="module")
def problem(mesh):
    """Both quantities that have derivatives, of a relief of free height."""
    objectives = [SETTINGS.quantity("worst_dynamic_factor"), SETTINGS.quantity("worst_approach_rms")]
    return make_problem(design, {"height": (0.0, 8.0)}, mesh=mesh, torque=TORQUE, objective=objectives)


@pytest.fixture(scope="module")
def linearization(problem):
    return eqx.filter_jit(lambda problem, x: problem.linearize(x))(problem, jnp.asarray([0.3]))


def test_an_objective_is_the_number_of_the_sweep(problem, mesh, linearization):
    """The whole chain, cycle, mesh, force and oscillator, against the steps done by hand."""
    relief = jg.TipRelief(2.4, 3.2)
    oscillator = SETTINGS.oscillator(mesh, TORQUE, pinion=relief, wheel=relief)
    runs = SETTINGS.runs(oscillator)
    assert list(runs) == ["up", "down", "down, kicked"]
    for pieces, field in zip(linearization.objectives, ("dynamic_factor", "approach_rms")):
        swept = np.concatenate([np.asarray(getattr(run, field)) for run in runs.values()])
        assert np.asarray(pieces.upper[0]) == pytest.approx(swept, rel=2e-3)
    assert bool(linearization.fine)
    assert float(linearization.objectives[0].value[0]) > 1.1


def test_slopes_are_those_of_central_differences(problem, linearization):
    step = 1e-3
    score = eqx.filter_jit(lambda problem, x: problem.score(x).value)
    above, below = (score(problem, jnp.asarray([0.3 + side])) for side in (step, -step))
    slopes = np.asarray(above - below) / (2 * step)
    for pieces, slope in zip(linearization.objectives, slopes):
        worst = int(np.argmax(pieces.upper[0]))
        assert float(pieces.slope[0, worst, 0]) == pytest.approx(slope, rel=1e-4)
        assert abs(slope) > 1e-2


def test_equal_settings_make_equal_quantities():
    again = dataclasses.replace(SETTINGS, damping_ratio=0.05)
    one, same = SETTINGS.quantity("worst_dynamic_factor"), again.quantity("worst_dynamic_factor")
    assert one == same and hash(one) == hash(same)
    assert one != dataclasses.replace(SETTINGS, damping_ratio=0.06).quantity("worst_dynamic_factor")


def test_names_are_known_and_refused_without_settings(mesh):
    cycle = jg.solve(mesh, TORQUE)
    for name in DYNAMIC_QUANTITIES:
        assert jg.quantities[name].name == name
    with pytest.raises(ValueError, match=r"^worst_dynamic_factor: needs settings, give .*\[dynamics\]$"):
        jg.quantities["worst_dynamic_factor"](cycle.on(mesh))
    with pytest.raises(ValueError, match='"loudness" is not known, must be one of dynamic_factor'):
        SETTINGS.quantity("loudness")


def test_a_cycle_without_its_mesh_is_refused(mesh):
    cycle = jg.solve(mesh, TORQUE)
    assert cycle.mesh is None
    with pytest.raises(ValueError, match="^worst_approach_rms: needs the prepared mesh"):
        SETTINGS.quantity("worst_approach_rms")(cycle)
    with pytest.raises(ValueError, match="^dynamic_factor: needs a speed"):
        SETTINGS.quantity("dynamic_factor")(cycle.on(mesh))
    many = jax.vmap(lambda torque: jg.solve(mesh, torque))(jnp.asarray([100.0, 200.0]))
    with pytest.raises(ValueError, match="batch axes"):
        many.on(mesh)


@pytest.mark.parametrize(
    "given, message",
    [
        ({"damping_ratio": 0.1, "damping": 1e-3}, "damping_ratio and damping are both given"),
        ({"pinion_bearing": [100.0, 100.0]}, "must both be given"),
        ({"pinion_bearing_damping": [1e-3, 1e-3]}, "has no effect without"),
        ({"pinion_bearing": [1.0, 2.0, 3.0], "wheel_bearing": [1.0, 2.0]}, "has 3 numbers, must be two"),
        ({"mesh_frequencies": [2000.0, 1000.0]}, "must increase"),
        ({"kick": 0.5}, "kick = 0.5 must be at least 1"),
        ({"model": "springs"}, "model = 'springs' must be \"map\""),
    ],
)
def test_bad_settings_are_one_line(given, message):
    with pytest.raises(ValueError, match=message) as caught:
        Dynamics(**{"mesh_frequencies": [1000.0, 2000.0], **given})
    assert "\n" not in str(caught.value)


def test_no_kick_saves_a_run():
    assert dataclasses.replace(SETTINGS, kick=1.0).run_names == ("up", "down")
