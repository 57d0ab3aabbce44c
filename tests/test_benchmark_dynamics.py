"""The benchmark of the dynamics: its closed form, its baselines and its judgement."""

import equinox as eqx
import numpy as np
import pytest

from benchmarks.baselines.c_kernel import find_compiler
from benchmarks.baselines.c_sweep import CSweep
from benchmarks.baselines.scipy_sweep import ScipySweep
from benchmarks.baselines.vibration import vibration_of
from benchmarks.dynamics import convergence, exact
from benchmarks.dynamics.__main__ import main
from benchmarks.dynamics.cost import Entry
from benchmarks.dynamics.exact_flow import exact_orbit
from benchmarks.dynamics.known import MORE_DAMPED, RATIO, RECTANGULAR
from benchmarks.dynamics.pair import imagined
from benchmarks.dynamics.timing import best_of
from jaxgear.dynamics import speed_sweep

SPEEDS = np.array([1500.0, 2600.0, 3000.0])  # Hz
STEPS = 128


@pytest.fixture(scope="module")
def moving():
    return eqx.filter_jit(imagined)(positions=32)


@pytest.fixture(scope="module")
def swept(moving):
    return speed_sweep(moving, SPEEDS, direction="down", steps=STEPS, tolerance=1e-12, most_cycles=3000)


@pytest.mark.parametrize("known", [*RECTANGULAR, *MORE_DAMPED], ids=lambda known: f"{known.name} {known.zeta}")
def test_the_closed_form_has_the_printed_orbits(known):
    start = known.near or (known.x0, known.v0)
    orbit = exact_orbit(known.omega, start, zeta=known.zeta, ratio=RATIO, periods=known.periods)
    for name in ("x0", "v0", "rms", "factor"):
        wanted = getattr(known, name)
        assert wanted is None or abs(getattr(orbit, name) - wanted) < 1e-6
    assert known.least is None or (len(orbit.places) > 0) == (known.least < 0)


def test_where_there_is_no_orbit_the_closed_form_says_so():
    with pytest.raises(RuntimeError, match="exact_orbit"):
        exact_orbit(0.9, (np.nan, 1.0), zeta=0.05, ratio=RATIO)


def test_a_number_off_by_more_than_its_last_digit_is_reported():
    known = RECTANGULAR[0]
    right = exact.printed(known)
    columns = exact.columns(6)

    def reported(values, **more):
        return exact.beyond([exact.Compared(known, "sweep", values, "not met", **more)], columns)

    assert reported(right) == [] and reported(right | {"rms": known.rms + 9e-7}) == []
    (line,) = reported(right | {"rms": known.rms + 2e-6})
    assert "rms off by 2.0 digits" in line
    assert len(reported(right | {"factor": np.nan})) == 1
    assert reported({}) != [] and reported({}, needed=False) == []


def test_the_order_is_the_slope_of_the_errors_above_rounding():
    steps = (32, 64, 128, 256)
    errors = 3.0 / np.array(steps, float) ** 4
    assert convergence.order_of(steps, errors) == pytest.approx(4.0)
    assert convergence.order_of((*steps, 512), [*errors, 1e-13]) == pytest.approx(4.0)
    assert np.isnan(convergence.order_of(steps, np.zeros(4)))
    slow = convergence.Convergence("", steps, 1 / np.array(steps) ** 2, errors, errors, 4.0)
    assert not slow.converges


def test_scipy_has_the_force_of_the_map(moving):
    solver = ScipySweep(vibration_of(moving), "DOP853", 1e-9)
    random, force = np.random.default_rng(0), eqx.filter_jit(moving.mesh_force)
    # drive flanks, clearance, coast flanks, and beyond the table on both sides
    for phase, q in zip(random.uniform(0, 2, 60), random.uniform(-230, 100, 60)):
        expected = float(force(phase, q))
        assert solver.force(phase, q) == pytest.approx(expected, rel=1e-12, abs=1e-9)


@pytest.mark.slow
@pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
def test_c_has_the_steady_states_of_the_sweep(moving, swept):
    kernel = CSweep(vibration_of(moving), STEPS)
    rest = [float(eqx.filter_jit(moving.mesh_force.static_te)(np.zeros(()), np.asarray(moving.load)[0])), 0.0]
    numbers = kernel.sweep(SPEEDS[::-1], [STEPS] * 3, rest, tolerance=1e-12, most_cycles=3000)[::-1]
    assert (numbers[:, 2] > 0).all() and float(swept.dte_min.min()) < -1
    np.testing.assert_allclose(numbers[:, 0], swept.dynamic_factor, rtol=1e-8)
    np.testing.assert_allclose(numbers[:, 1], swept.dte_rms, rtol=1e-8)
    # a steady state stays one
    state = [float(part[1, 0]) for part in swept.state]
    np.testing.assert_allclose(kernel.settle(SPEEDS[1], state, 2 * int(swept.period[1])), state, rtol=1e-7)


@pytest.mark.slow
def test_scipy_has_the_steady_states_of_the_sweep(moving, swept):
    solver = ScipySweep(vibration_of(moving), "DOP853", 1e-6)
    before = [float(part[1, 0]) for part in swept.state]
    factor, rms, cycles = solver.speed(SPEEDS[0], before, tolerance=1e-4, most_cycles=200)
    assert cycles > 0
    # its samples are not the steps of the sweep
    assert factor == pytest.approx(float(swept.dynamic_factor[0]), rel=1e-3)
    assert rms == pytest.approx(float(swept.dte_rms[0]), rel=1e-3)


def test_another_orbit_is_no_error_of_this_one():
    entry = Entry("", "", lambda: None, 3, np.array([1.0, 2.002, 3.0]), np.array([1.0, 2.0, 4.0]))
    assert entry.error == (pytest.approx(0.1), 1)


def test_contenders_take_turns():
    order = []
    times = best_of({name: lambda name=name: order.append(name) for name in "ab"}, 2)
    assert "".join(order) == "ababab" and all(one.wall >= 0 for one in times.values())


@pytest.mark.parametrize(
    "arguments",
    [["nonsense"], ["--full", "--quick"], ["map", "--quick"], ["--quick", "--designs", "4"], ["--designs", "0"]],
)
def test_what_cannot_be_asked_for_is_refused(arguments):
    with pytest.raises(SystemExit):
        main(arguments)
