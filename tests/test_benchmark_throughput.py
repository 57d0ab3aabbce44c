"""The baselines of the throughput benchmark solve the same physics as jaxgear."""

from dataclasses import replace

import numpy as np
import pytest

import jaxgear as jg
from benchmarks import throughput
from benchmarks.baselines import problem as case
from benchmarks.baselines.c_kernel import CKernel, find_compiler
from benchmarks.baselines.law import deflection
from benchmarks.baselines.numpy_kernel import NumpyKernel
from benchmarks.baselines.scipy_kernel import ScipyKernel
from benchmarks.contenders import Contender, Process
from benchmarks.rates import machine, print_rates

POSITIONS = 16
RANDOM = case.random_variants(7, seed=3)
# nothing removed, the most on one gear, the most on both, short and steep, then random ones
VARIANTS = np.concatenate(
    [
        [[0.0, 1.0, 0.0, 1.0], [0.0, 5.0, 20.0, 5.0], [20.0, 5.0, 0.0, 1.0]],
        [[20.0, 5.0, 20.0, 5.0], [20.0, 1.0, 20.0, 1.0]],
        RANDOM,
    ]
)
needs_compiler = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")


@pytest.fixture(scope="module")
def mesh():
    return case.prepare(POSITIONS)


@pytest.fixture(scope="module")
def problem(mesh):
    return case.plain(mesh)


@pytest.fixture(scope="module")
def expected(mesh):
    """PPTE of `VARIANTS` by the public functions."""

    def ppte(variant):
        pinion, wheel = (jg.TipRelief(*relief, jg.Parabolic()) for relief in (variant[:2], variant[2:]))
        cycle = jg.solve(mesh, case.TORQUE, pinion=pinion, wheel=wheel)
        return float(jg.peak_to_peak(cycle.transmission_error))

    return [ppte(variant) for variant in VARIANTS]


@pytest.mark.slow
def test_numpy_solves_the_same_physics(problem, expected):
    found = NumpyKernel(problem, batch=5).ppte(VARIANTS)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)


def test_scipy_solves_the_same_physics(problem, expected):
    np.testing.assert_allclose(ScipyKernel(problem).ppte(VARIANTS), expected, rtol=0, atol=1e-9)


@pytest.mark.slow
@needs_compiler
def test_c_solves_the_same_physics(problem, expected):
    found = CKernel(problem).ppte(VARIANTS)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(CKernel(problem, threads=2).ppte(VARIANTS), found)


@needs_compiler
def test_gradient_of_c_is_that_of_its_ppte(problem):
    kernel, step = CKernel(problem), 1e-4
    central = [(kernel.ppte(RANDOM + step * e) - kernel.ppte(RANDOM - step * e)) / (2 * step) for e in np.eye(4)]
    np.testing.assert_allclose(kernel.gradient(RANDOM), np.transpose(central), rtol=0, atol=1e-5)


def test_law_has_the_slope_of_its_deflection(problem):
    load = np.geomspace(0.01, 100.0, 9)[:, None, None]
    higher, lower = (deflection(problem.law, load * factor)[0] for factor in (1 + 1e-5, 1 - 1e-5))
    slope = deflection(problem.law, load)[1]
    np.testing.assert_allclose((higher - lower) / (2e-5 * load), slope, rtol=1e-6)


@pytest.mark.slow
def test_what_a_baseline_cannot_do_is_refused(mesh, problem):
    sliced = replace(problem, slice_width=np.full(3, 6.0), crowning=np.zeros(3))
    with pytest.raises(ValueError, match="one slice"):
        ScipyKernel(sliced)
    many = case.plain(jg.prepare(mesh.pair, resolution=jg.Resolution(positions=POSITIONS, pairs=4)))
    with pytest.raises(ValueError, match="more than two pairs"):
        NumpyKernel(replace(many, corner_gap=np.zeros_like(many.corner_gap)))


@pytest.mark.slow
def test_contenders_take_turns_and_agree(capsys):
    chosen = [
        Contender("jaxgear", 64, slices=3, threads=2, batch=8),
        Contender("jaxgear", 64, slices=3, threads=2, batch=8, coupled=True),
        Contender("NumPy", 16, slices=3, batch=16),
    ]
    if find_compiler():
        chosen.append(Contender("C", 100, slices=3, threads=2, gradient=True))
    rows, versions = throughput.compare(chosen, positions=POSITIONS, checked=10, repetitions=2, seconds=0.01)
    assert all(row.difference < 1e-9 and len(row.rates) == 2 and row.rate > 0 and row.memory > 10 for row in rows)
    assert {"JAX", "NumPy"} <= set(versions)
    print_rates(rows, machine(2), has_compiler=False)
    printed = capsys.readouterr().out
    assert "No C compiler" in printed and all(row.contender.kind in printed for row in rows)
    assert "coupled" in printed
    assert rows[1].agrees
    rows[1].difference = float("nan")
    assert not rows[1].agrees


def test_a_contender_that_fails_says_why():
    with pytest.raises(RuntimeError, match="SciPy"):
        Process(Contender("SciPy", 1), POSITIONS, None)


def test_batches_of_nothing_are_refused():
    with pytest.raises(SystemExit):
        throughput.main(["--batch", "0"])
