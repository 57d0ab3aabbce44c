"""Tolerances are those of the standard, deviations what their names say, and the scatter follows from the contact."""

import importlib
import os
import subprocess
import sys

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import FACE, LINE, gear_pair
from scipy.stats.mstats import hdquantiles

import jaxgear as jg
from jaxgear.sweeps.monte_carlo import _scatter
from jaxgear.tolerance.deviation import Waviness

TORQUE = 50.0
COUNT, MANY = 20, 20_000  # samples, the same numbers for all tests: every number is a program
RELIEF = {"pinion": jg.TipRelief(7.0, 4.0), "wheel": jg.TipRelief(6.0, 4.0)}


@pytest.fixture(scope="module")
def pair():
    return gear_pair()


@pytest.fixture(scope="module")
def mesh(pair):
    return jg.prepare(pair, resolution=LINE)


@pytest.fixture(scope="module")
def wide_mesh(pair):
    """Of gears of different face widths."""
    wider = eqx.tree_at(lambda pair: pair.pinion.face_width, pair, 1.1 * pair.wheel.face_width)
    return jg.prepare(wider, resolution=FACE)


@pytest.fixture(scope="module")
def tolerance(pair):
    return jg.Tolerance.from_class(pair, 5, misalignment=4.0)


def solve(mesh, deviation, torque=TORQUE):
    """Cycle of one deviation of the relieved design."""
    torque = jnp.asarray(torque)
    removed = jg.tolerance.deviated_material(mesh, torque, deviation, **RELIEF)
    return jg.contact.solve_removed(mesh, torque, removed)


def sample(tolerance, mesh, seed=0, number=0):
    """One deviation."""
    return one_of(jg.ManufacturedGears(tolerance, COUNT, seed).on(mesh), number)


def one_of(samples, number):
    return jax.tree.map(lambda leaf: jnp.asarray(np.asarray(leaf)[number]), samples)


def zero_deviation(mesh):
    return jax.tree.map(lambda leaf: jnp.asarray(np.zeros_like(leaf)), sample(jg.Tolerance(), mesh))


# Rows of the unrounded table for m = 3 mm, d = 150 mm, b = 20 mm, computed by hand from the formulas of the standard.
@pytest.mark.parametrize(
    ("quality", "expected"),
    {
        4: (3.78, 4.70, 6.04, 4.49, 14.95, 4.37, 4.86),
        5: (5.35, 6.65, 8.53, 6.35, 21.14, 6.18, 6.87),
        6: (7.57, 9.40, 12.07, 8.98, 29.89, 8.74, 9.72),
        7: (10.70, 13.30, 17.07, 12.70, 42.27, 12.36, 13.74),
    }.items(),
)
def test_iso_1328_table(quality, expected):
    limits = jg.tolerance.ToleranceClass(150.0, 3.0, 20.0, quality)
    names = ("profile_slope", "profile_form", "profile_total", "single_pitch", "total_pitch", "helix_slope")
    values = [float(getattr(limits, name)) for name in (*names, "helix_form")]
    np.testing.assert_allclose(values, expected, atol=0.0051)


def test_iso_1328_helix_total_and_two_classes_double():
    fine, coarse = (jg.tolerance.ToleranceClass(100.0, 2.0, 25.0, quality) for quality in (5, 7))
    # d = 100, b = 25: square roots are 10 and 5
    assert float(fine.helix_total) == pytest.approx(np.hypot(0.5 + 1.75 + 4, 0.7 + 2.25 + 4))
    assert float(fine.total_pitch) == pytest.approx(0.2 + 5.5 + 1.4 + 12)
    assert float(coarse.profile_total) == pytest.approx(2 * float(fine.profile_total))


def test_iso_1328_rounding():
    exact = [3.74, 3.76, 4.96, 5.2, 5.3, 9.7, 9.8, 10.4, 10.6, 29.89]
    np.testing.assert_allclose(
        jg.tolerance.iso_rounded(np.array(exact)), [3.7, 3.8, 5.0, 5.0, 5.5, 9.5, 10, 10, 11, 30]
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((4.0, 3.0, 20.0, 5), r"diameter = 4 mm must be at least 5 mm and at most 15000 mm"),
        ((150.0, 0.4, 20.0, 5), r"module = 0.4 mm must be at least 0.5 mm and at most 70 mm"),
        ((150.0, 3.0, 1300.0, 5), r"face_width = 1300 mm must be at least 4 mm and at most 1200 mm"),
        ((150.0, 3.0, 20.0, 12), r"quality_class = 12 must be at least 1 and at most 11"),
        ((150.0, 3.0, 20.0, 5.5), r"quality_class = 5.5 must be a whole number"),
    ],
)
def test_iso_1328_range(arguments, message):
    with pytest.raises(ValueError, match=f"^ToleranceClass: {message}$"):
        jg.tolerance.ToleranceClass(*arguments)


def test_from_class_takes_rounded_limits_of_each_gear(pair):
    tolerance = jg.Tolerance.from_class(pair, (4, 6), misalignment=3.0)
    # 19 teeth, m 3: d = 57 mm, class 4; 48 teeth: d = 144 mm, class 6
    assert float(tolerance.pinion.pitch) == 4.4  # 6.257 / sqrt(2)
    assert float(tolerance.wheel.pitch) == 9.0  # 6.344 * sqrt(2)
    assert float(tolerance.misalignment) == 3.0
    smooth = jax.grad(lambda width: jg.tolerance.GearTolerance.from_class(
        jg.Gear(19, 3.0, face_width=width), 5, rounded=False).helix_slope)  # fmt: skip
    assert float(smooth(25.0)) == pytest.approx(0.35 / (2 * 5))


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: jg.tolerance.GearTolerance(pitch=-1.0), "GearTolerance: pitch = -1 um must be at least 0 um"),
        (lambda: jg.Tolerance(misalignment=-2.0), "Tolerance: misalignment = -2 um must be at least 0 um"),
        (lambda: jg.tolerance.TruncatedNormal(0.0), "TruncatedNormal: sigmas = 0 must be greater than 0"),
    ],
)
def test_impossible_limits_are_refused(build, message):
    with pytest.raises(ValueError, match=f"^{message}$"):
        build()


def test_one_slice_refuses_lead_deviations(pair, mesh, tolerance):
    for call in (
        lambda tolerance: jg.ManufacturedGears(tolerance, COUNT).on(mesh),
        lambda tolerance: jg.monte_carlo(mesh, TORQUE, jg.ManufacturedGears(tolerance, COUNT)),
    ):
        with pytest.raises(ValueError, match="pinion helix_slope = 6 um must be None or 0 um on a mesh of 1 slice"):
            call(tolerance)
        with pytest.raises(ValueError, match="misalignment = 4 um must be None or 0 um on a mesh of 1 slice"):
            call(jg.Tolerance(misalignment=4.0))
    with pytest.raises(ValueError, match="traced limit"):
        jax.jit(lambda t: jg.ManufacturedGears(t, COUNT, 0).on(mesh))(tolerance)
    jg.ManufacturedGears(tolerance.without_lead(), COUNT, 0).on(mesh)
    jg.ManufacturedGears(jg.Tolerance(misalignment=0.0), COUNT, 0).on(mesh)


def of_every_kind(distribution):
    """Limits of all kinds of deviations."""
    gear = jg.tolerance.GearTolerance(profile_slope=4.0, profile_form=6.0, pitch=5.0, helix_slope=3.0)
    return jg.Tolerance(gear, gear, misalignment=2.0, distribution=distribution)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("distribution", "deviation"),
    # variance of a normal distribution cut off at a: 1 - 2 a phi(a) / (2 Phi(a) - 1)
    [
        (jg.tolerance.TruncatedNormal(), np.sqrt(1 - 6 * 0.00443185 / 0.9973002) / 3),
        (jg.tolerance.Uniform(), 1 / np.sqrt(3)),
    ],
    ids=["normal", "uniform"],
)
def test_deviations_are_distributed_within_their_limits(wide_mesh, distribution, deviation):
    samples = jg.ManufacturedGears(of_every_kind(distribution), MANY, 3).on(wide_mesh)
    samples = jax.tree.map(np.asarray, samples)
    for values, limit in (
        (samples.pinion.profile_slope, 4.0),
        (samples.wheel.helix_slope, 3.0),
        (samples.misalignment, 2.0),
        (samples.wheel.pitch, 2.5),
    ):
        assert np.abs(values).max() <= limit
        assert values.mean() == pytest.approx(0.0, abs=0.03 * limit)
        assert values.std() == pytest.approx(deviation * limit, rel=0.02)
    # neighbouring teeth: variances add up, and no difference exceeds the tolerance of the single pitch
    steps = np.diff(samples.pinion.pitch, axis=1)
    assert steps.std() == pytest.approx(np.sqrt(2) * deviation * 2.5, rel=0.02)
    assert np.abs(steps).max() <= 5.0
    both = np.corrcoef([samples.pinion.profile_slope, samples.wheel.profile_slope, samples.misalignment])
    np.testing.assert_allclose(both, np.eye(3), atol=0.03)


def test_waviness_keeps_mean_line_and_form_tolerance(wide_mesh):
    """Least-squares line through the deviation along the whole profile is zero; its height is the form deviation."""
    tolerance = of_every_kind(jg.tolerance.Uniform())
    waves = jg.ManufacturedGears(tolerance, MANY, 1).on(wide_mesh).pinion.waviness[:200]
    flank = wide_mesh.flanks()[0]
    x = jnp.linspace(0.0, 1.0, 4001)
    length = flank.start_roll_length + x * (flank.tip_roll_length - flank.start_roll_length)
    line = type(flank)(length, *(getattr(flank, name) for name in ("tip_roll_length", "start_roll_length")), *(
        jnp.zeros(()),) * 3)  # fmt: skip
    profiles = np.asarray(jax.vmap(lambda row: Waviness(row)(line))(waves))
    slope, mean = np.polyfit(np.asarray(x), profiles.T, 1)
    np.testing.assert_allclose(slope, 0.0, atol=0.01)
    np.testing.assert_allclose(mean, 0.0, atol=0.01)
    heights = np.ptp(profiles, axis=1)
    assert heights.max() <= 6.0 * 1.005 and heights.max() > 5.5 and heights.min() < 0.5


def test_deviated_material_is_the_sum_of_modifications(wide_mesh, tolerance):
    deviation = sample(tolerance, wide_mesh, seed=5)
    sides = {}
    for side, design in RELIEF.items():
        flank = getattr(deviation, side)
        lead = jg.LeadSlope(flank.helix_slope)
        sides[side] = design + jg.ProfileSlope(flank.profile_slope) + Waviness(flank.waviness) + lead
    pair = wide_mesh.pair  # the misalignment is over the common face, the slope of a flank over its own
    sides["pinion"] += jg.LeadSlope(deviation.misalignment * pair.pinion.face_width / pair.face_width)
    pitch = (deviation.pinion.pitch + deviation.wheel.pitch)[:, None, None]
    expected = (jg.contact.removed_material(wide_mesh, TORQUE, **sides) + pitch).amount
    np.testing.assert_allclose(
        jg.tolerance.deviated_material(wide_mesh, TORQUE, deviation, **RELIEF).amount, expected, atol=1e-12
    )


def test_zero_tolerance_is_the_nominal_design(mesh):
    zero, design = zero_deviation(mesh), jg.contact.removed_material(mesh, TORQUE, **RELIEF).amount
    # another compilation may round differently; within one, all samples are the same to the last bit
    np.testing.assert_allclose(jg.tolerance.deviated_material(mesh, TORQUE, zero, **RELIEF).amount, design, rtol=1e-13)
    nominal = np.asarray(solve(mesh, zero).transmission_error)
    none = jg.Tolerance().without_lead()  # as that of the other tests: one program
    scatter = jg.monte_carlo(mesh, TORQUE, jg.ManufacturedGears(none, COUNT), **RELIEF)
    np.testing.assert_allclose(scatter.nominal_transmission_error, nominal, rtol=1e-13)
    assert (np.asarray(scatter.transmission_error_quantiles) == scatter.nominal_transmission_error[None]).all()
    assert (np.asarray(scatter.ppte) == scatter.nominal_ppte).all()
    assert float(scatter.std) < 1e-14 and scatter.failed == 0


def test_a_displaced_tooth_shifts_the_transmission_error_where_it_carries_alone(mesh):
    zero, low_torque = zero_deviation(mesh), 5.0
    nominal = solve(mesh, zero, low_torque)
    reference = mesh.resolution.leading
    share = np.asarray(jg.load_sharing(nominal))[reference]
    alone = np.isclose(share, 1.0)
    assert 2 < alone.sum() < 16
    for amount in (0.7, -0.7):
        shifted = solve(mesh, with_pitch(zero, reference, amount), low_torque)
        difference = np.asarray(shifted.transmission_error) - np.asarray(nominal.transmission_error)
        still_alone = alone & np.isclose(np.asarray(jg.load_sharing(shifted))[reference], 1.0)
        np.testing.assert_allclose(difference[still_alone], amount, rtol=1e-9)
        # elsewhere the neighbour carries its part: a small displacement acts with about the share of the pair
        assert (np.sign(difference[share > 0.05]) == np.sign(amount)).all()


def test_all_teeth_displaced_shift_the_whole_curve(mesh):
    """On the path of contact nothing else changes; the corners, which open as the gears turn on, feel a little."""
    zero = zero_deviation(mesh)
    curves = [solve(mesh, one).transmission_error for one in (with_pitch(zero, slice(None), 2.0), zero)]
    difference = np.subtract(*map(np.asarray, curves))
    np.testing.assert_allclose(difference, 2.0, rtol=0.02)


def with_pitch(deviation, pairs, amount):
    pitch = np.array(deviation.pinion.pitch)
    pitch[pairs] = amount
    gear = eqx.tree_at(lambda pinion: pinion.pitch, deviation.pinion, jnp.asarray(pitch))
    return jg.tolerance.Deviation(gear, deviation.wheel, deviation.misalignment)


@pytest.mark.slow
def test_misalignment_of_either_sign_acts_alike(wide_mesh):
    """Both signs are mirror images of each other, and tilt load to one end of the face."""
    zero = zero_deviation(wide_mesh)

    def tilted(amount):
        return solve(wide_mesh, jg.tolerance.Deviation(zero.pinion, zero.wheel, jnp.asarray(amount)))

    plus, minus = tilted(6.0), tilted(-6.0)
    np.testing.assert_allclose(plus.transmission_error, minus.transmission_error, rtol=1e-10)
    line_load, mirrored = (np.asarray(cycle.line_load) for cycle in (plus, minus))
    np.testing.assert_allclose(line_load, mirrored[:, ::-1], atol=1e-8)
    assert line_load[:, 0].sum() > line_load[:, -1].sum()  # material is left there


def test_samples_depend_on_seed_and_number_only(mesh, tolerance):
    tolerance = tolerance.without_lead()
    few, many = (jg.ManufacturedGears(tolerance, samples, 7).on(mesh) for samples in (5, COUNT))
    jax.tree.map(lambda a, b: np.testing.assert_array_equal(a, b[:5]), few, jax.tree.map(np.asarray, many))
    compiled = jax.jit(lambda tolerance: jg.ManufacturedGears(tolerance, 5, 7).on(mesh))(tolerance)
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-12), few, compiled)
    other = jg.ManufacturedGears(tolerance, COUNT, 8).on(mesh)
    assert not np.any(np.asarray(many.pinion.pitch) == np.asarray(other.pinion.pitch))


def test_common_random_numbers_scale_with_the_limits(mesh, tolerance):
    """Twice the tolerance is twice the same deviation, three times of the wheel: designs and tolerances are compared
    on the same gears."""
    once = tolerance.without_lead()
    grown = (jax.tree.map(lambda limit, by=by: by * limit, gear) for gear, by in ((once.pinion, 2), (once.wheel, 3)))
    first, then = (jg.ManufacturedGears(t, COUNT, 2).on(mesh) for t in (once, jg.Tolerance(*grown)))
    for by, *gears in ((2, first.pinion, then.pinion), (3, first.wheel, then.wheel)):
        for a, b in zip(*map(jax.tree.leaves, gears), strict=True):
            np.testing.assert_allclose(by * np.asarray(a), b, rtol=1e-12)


def test_monte_carlo_holds_the_samples_of_its_seed(mesh, tolerance):
    tolerance = tolerance.without_lead()
    scatter = jg.monte_carlo(
        mesh, TORQUE, jg.ManufacturedGears(tolerance, COUNT, 11), quantiles=(0.5, 0.0, 1.0), **RELIEF
    )
    deviations = jg.ManufacturedGears(tolerance, COUNT, 11).on(mesh)
    curves = np.stack([solve(mesh, one_of(deviations, number)).transmission_error for number in range(COUNT)])
    np.testing.assert_allclose(scatter.ppte, np.ptp(curves, axis=1), rtol=1e-9)
    assert float(scatter.mean) == pytest.approx(np.ptp(curves, axis=1).mean())
    assert float(scatter.std) == pytest.approx(np.ptp(curves, axis=1).std(ddof=1))
    np.testing.assert_allclose(scatter.quantiles, [0.0, 0.5, 1.0])
    ends = [curves.min(axis=0), curves.max(axis=0)]
    np.testing.assert_allclose(scatter.transmission_error_quantiles[::2], ends, rtol=1e-9)
    again = jg.monte_carlo(mesh, TORQUE, jg.ManufacturedGears(tolerance, COUNT, 11), **RELIEF)
    np.testing.assert_array_equal(again.ppte, scatter.ppte)
    assert str(scatter).startswith("Scatter of 20 samples, 0 failed")


@pytest.mark.slow
def test_one_compilation_serves_every_number(mesh, tolerance, nothing_compiled, monkeypatch):
    module, traces = importlib.import_module("jaxgear.sweeps.monte_carlo"), []
    solve_number = module._solve_number
    monkeypatch.setattr(module, "_solve_number", lambda *task: traces.append(0) or solve_number(*task))
    gear = tolerance.without_lead().pinion
    for amount in (1.0, 2.0, 3.0):
        design = {"pinion": jg.TipRelief(amount, 3.0), "wheel": jg.TipRelief(5.0, 3.0)}
        limits = jg.Tolerance(gear, jg.tolerance.GearTolerance(amount, 2 * amount, 3 * amount))
        jg.monte_carlo(mesh, 40.0 + amount, jg.ManufacturedGears(limits, COUNT, int(amount)), **design)
    assert 0 < len(traces) <= 2  # a loop is traced for its shapes too


def test_failed_samples_count_against_the_design():
    """They rank beyond all others, and a quantile is infinite once they have a share in it."""
    count = 10_000
    curves = np.arange(count + 1.0)[:, None] * np.array([1.0, 0.0, 0.5, 0.2]) + 1.0
    converged = np.ones(count + 1, bool)
    converged[7] = False
    curves[9, 2] = np.nan  # said to have converged, all the same
    scatter = _scatter(jnp.arange(4) / 4, curves, converged, np.array([0.0, 1e-4, 0.5, 1.0]))
    assert scatter.failed == 2
    assert np.isnan(scatter.ppte[jnp.asarray([6, 8])]).all()
    assert np.isnan(scatter.mean) and np.isnan(scatter.std)
    # the k-th largest value is count - k, and two fail without being among the largest: all are one rank or two off
    ranks = np.sort(np.r_[np.delete(np.arange(1.0, count + 1), [6, 8]), 1e9, 1e9])
    assert float(scatter.ppte_quantile95) == pytest.approx(float(hdquantiles(ranks, [0.95])[0]), rel=1e-9)
    assert 9501.0 < float(scatter.ppte_quantile95) < 9504.0
    low, rare, median, high = np.asarray(scatter.transmission_error_quantiles)
    assert (low == -np.inf).all() and (high == np.inf).all() and np.isfinite(median).all()
    assert (rare == -np.inf).all()
    many = np.arange(count + 1) % 10 > 0
    assert float(_scatter(jnp.arange(4) / 4, np.nan_to_num(curves), many, np.array([0.5])).ppte_quantile95) == np.inf


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"manufactured": jg.ManufacturedGears(jg.Tolerance(), 1)}, "samples = 1 must be a whole number of at least 2"),
        ({"quantiles": (0.1, 1.2)}, "quantiles = 1.2 must be at least 0 and at most 1"),
        ({"torque": -5.0}, "torque = -5 N m must be at least 0 N m"),
    ],
)
def test_monte_carlo_refuses_impossible_arguments(mesh, change, message):
    arguments = {"torque": TORQUE, "manufactured": jg.ManufacturedGears(jg.Tolerance(), 4), **change}
    with pytest.raises(ValueError, match=f"^{message}$"):
        jg.monte_carlo(mesh, **arguments)


@pytest.mark.slow
def test_gradients_of_the_mean_scatter_agree_with_differences(mesh, tolerance):
    tolerance = tolerance.without_lead()

    def mean_energy(amount, pitch):
        """Mean square variation of the transmission error, which has no kinks, over common random numbers."""
        pinion = jg.tolerance.GearTolerance(tolerance.pinion.profile_slope, tolerance.pinion.profile_form, pitch)
        deviations = jg.ManufacturedGears(jg.Tolerance(pinion, tolerance.wheel), 6, 4).on(mesh)

        def one(deviation):
            removed = jg.tolerance.deviated_material(mesh, TORQUE, deviation, pinion=jg.TipRelief(amount, 4.0))
            return jnp.var(jg.contact.solve_removed(mesh, TORQUE, removed).transmission_error)

        return jnp.mean(jax.vmap(one)(deviations))

    value, step = jax.jit(jax.value_and_grad(mean_energy, (0, 1))), 1e-4
    amount, pitch = jnp.asarray(7.0), jnp.asarray(6.0)
    _, slopes = value(amount, pitch)
    by_amount = (value(amount + step, pitch)[0] - value(amount - step, pitch)[0]) / (2 * step)
    by_pitch = (value(amount, pitch + step)[0] - value(amount, pitch - step)[0]) / (2 * step)
    np.testing.assert_allclose(slopes, [by_amount, by_pitch], rtol=1e-5)
    assert abs(float(by_amount)) > 1e-3 and float(by_pitch) > 1e-3


@pytest.mark.slow
def test_two_devices_give_the_samples_of_one(mesh, tolerance):
    one = jg.monte_carlo(mesh, TORQUE, jg.ManufacturedGears(tolerance.without_lead(), COUNT, 1), **RELIEF)
    program = """
import jax
jax.config.update("jax_enable_x64", True)
jax.config.update("jax_num_cpu_devices", 2)
import jaxgear as jg
gears = [
    jg.Gear(z, 3.0, profile_shift=0.0, face_width=18.0, bore_diameter=bore, tip_diameter=3.0 * (z + 2), addendum=1.0)
    for z, bore in ((19, 24.0), (48, 70.0))
]
pair = jg.GearPair(*gears)
mesh = jg.prepare(pair, resolution=jg.Resolution(positions=16, pairs=2, slide_steps=0))
tolerance = jg.Tolerance.from_class(pair, 5).without_lead()
relief = {"pinion": jg.TipRelief(7.0, 4.0), "wheel": jg.TipRelief(6.0, 4.0)}
scatter = jg.monte_carlo(mesh, 50.0, jg.ManufacturedGears(tolerance, 20, 1), **relief)
print(len(jax.devices()), *(float(value) for value in scatter.ppte))
"""
    cache = {"JAX_COMPILATION_CACHE_DIR": str(jax.config.jax_compilation_cache_dir or "")}
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
        env={**os.environ, **cache, "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0"},
    )
    assert done.returncode == 0, done.stderr
    devices, *ppte = map(float, done.stdout.split())
    assert devices == 2
    np.testing.assert_allclose(ppte, one.ppte, rtol=1e-9)
