"""Resonances in closed form beside the integrated motion: errors fall with the excitation."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxgear.dimensionless import (
    CycleRelief,
    PolynomialClearance,
    combination_forcing,
    damping_threshold,
    dimensionless_model,
    effective_forcing,
    forced_amplitude,
    frequency_shift,
    loaded_mean,
    parametric_instability,
    primary_resonance,
    rectangular_harmonics,
    response_curve,
    settled_vibration,
    sub_harmonic_resonance,
    super_harmonic_resonance,
    with_relief,
)
from jaxgear.dynamics import DeadZone

NATURAL = 0.9909887537  # omega_0 at F_m = 0.5
SETTLING = 600  # cycles, as many as the slowest vibration needs: one program for all


def model(damping_ratio, *, stiffness=(0.0, 0.0, 0.0), load=0.5, clearance=None, **given):
    """One tree for all, so that they share what is compiled."""
    return dimensionless_model(
        load=load,
        damping_ratio=damping_ratio,
        stiffness_harmonics=stiffness,
        stiffness_angles=[0.3, 0.5, 0.2],
        clearance=PolynomialClearance.published() if clearance is None else clearance,
        **given,
    )


shift_of = eqx.filter_jit(frequency_shift)
acting = eqx.filter_jit(effective_forcing)
combined = eqx.filter_jit(combination_forcing)
amplitudes = eqx.filter_jit(forced_amplitude)


@eqx.filter_jit
def linear(state, frequency):
    """Forcing and forced response at a mesh frequency, and the inverse receptance at it and at twice it."""
    inverse = [state.receptance_inverse(order * frequency) for order in (1, 2)]
    return state.forcing(frequency), state.response(frequency), *inverse


@pytest.mark.parametrize(
    "load, mean, frequency, quadratic, cubic, kappa",
    [
        (0.25, 1.243077, 0.874430, 0.459461, -0.139764, -0.191494),
        (0.50, 1.526750, 0.990989, 0.291968, -0.245160, -0.129268),
        (1.00, 1.997995, 1.039420, -0.079470, -0.224489, -0.083334),
    ],
)
def test_expansion_about_the_loaded_mean(load, mean, frequency, quadratic, cubic, kappa):
    found = loaded_mean(model(0.03, load=load))
    wanted = (mean, frequency, quadratic, cubic, kappa)
    numbers = (found.mean, found.frequency, found.quadratic, found.cubic, found.kappa)
    assert np.allclose(numbers, wanted, atol=6e-7, rtol=0)


@pytest.mark.slow
@pytest.mark.parametrize(
    "torque, frequency, scales, integrated",
    [(0.01, 0.98733, 0.168182, 0.168757), (0.01, 0.94144, 0.088422, 0.091449), (0.02, 0.97636, 0.336364, 0.340964)],
)
def test_primary_resonance_and_its_numerical_counterpart(torque, frequency, scales, integrated):
    given = model(0.03, torque=torque)
    found = primary_resonance(loaded_mean(given), [frequency])
    assert np.isclose(found.amplitude[0, 0], scales, atol=1.5e-6) and found.stable[0, 0]
    assert np.isnan(found.amplitude[1:]).all() and not found.stable[1:].any()
    settled = settled_vibration(given, frequency, settling=SETTLING, steps=64)
    assert settled.converged
    assert np.isclose(abs(settled.harmonic(1)), integrated, atol=3e-6)


def test_mean_falls_at_the_primary_resonance():
    settled = settled_vibration(model(0.03, torque=0.02), 0.97636, settling=SETTLING, steps=64)
    assert np.isclose(settled.dte_mean, 1.50908, atol=5e-6)


def test_stiffness_harmonics_force_directly_and_in_the_slope():
    """P_n = -B_n F_m, Q_n = B_n omega_0^2, R_n = B_n a_2, all with the angle of B_n."""
    found = loaded_mean(model(0.03, stiffness=(0.1, 0.05, 0.02), displacement=0.03, displacement_order=2.0))
    stiff = np.array([0.1, 0.05, 0.02]) * np.exp(1j * np.array([0.3, 0.5, 0.2]))
    assert np.allclose(found.force[:3], -0.5 * stiff) and np.allclose(found.force[3:], 0)
    assert np.allclose(found.parametric[:3], stiff * float(found.frequency) ** 2)
    assert np.allclose(found.parametric_quadratic[:3], stiff * float(found.quadratic))
    # a displacement's force grows with the square of its frequency
    assert np.isclose(linear(found, jnp.array(0.4))[0][1], -0.5 * stiff[1] + 0.03 * 0.8**2)


def test_relief_takes_its_part_of_the_forcing():
    """+f'(x_m) C_n to first order, and the mean of C in x_m."""
    relief = CycleRelief(1e-4, 0.37, 1.37, begin=-0.185)
    plain = model(0.03)
    without, found = loaded_mean(plain), loaded_mean(with_relief(plain, relief))
    phase = np.arange(1024) / 1024
    taken = np.asarray(jax.jit(jax.vmap(relief))(phase))
    assert np.isclose(found.mean - without.mean, taken.mean(), rtol=1e-3)
    first = 2 * np.mean(taken * np.exp(-2j * np.pi * phase))
    assert np.isclose(found.force[0], float(without.frequency) ** 2 * first, rtol=0.02)


def test_curve_through_its_folds():
    """Every point of the backbone solves the equation at its frequency; the middle branch is unstable."""
    given = model(0.01, torque=0.012)
    state = loaded_mean(given)
    peak = 0.012 / (2 * float(state.frequency) * 0.01)
    curve = jax.tree.map(np.asarray, response_curve(state, np.append(np.linspace(0.1, 0.999, 40), 1.01) * peak))
    assert np.isnan(curve.lower[-1]) and not curve.lower_stable[-1]  # beyond the peak
    curve = jax.tree.map(lambda part: part[:-1], curve)
    for frequency, stable in ((curve.lower, curve.lower_stable), (curve.upper, curve.upper_stable)):
        found = jax.tree.map(np.asarray, primary_resonance(state, frequency))
        nearest = np.nanargmin(np.abs(found.amplitude - curve.amplitude[None]), axis=0)
        assert np.allclose(np.take_along_axis(found.amplitude, nearest[None], 0)[0], curve.amplitude)
        assert (np.take_along_axis(found.stable, nearest[None], 0)[0] == stable).all()
    assert not curve.lower_stable.all() and curve.upper_stable[-1]
    # softening: at a frequency below omega_0 there are three, of which the middle one is unstable
    three = primary_resonance(state, [0.955])
    assert np.isfinite(three.amplitude[:3]).all() and np.isnan(three.amplitude[3:]).all()
    assert (np.asarray(three.stable[:, 0]) == [True, False, True, False, False]).all()


def helped(size, angle, detuning):
    """Torque at Omega and the stiffness harmonic at 2 Omega; A falls with the square root of `size`."""
    given = dimensionless_model(
        load=0.5,
        damping_ratio=0.04 * size,
        stiffness_harmonics=[0.0, 0.1 * size, 0.0],
        stiffness_angles=[0.0, angle, 0.0],
        torque=0.006 * size**1.5,
        torque_angle=0.3,
        clearance=PolynomialClearance.published(),
    )
    frequency = NATURAL + detuning * size
    found = primary_resonance(loaded_mean(given), [frequency])
    settled = settled_vibration(given, frequency, settling=SETTLING, steps=64)
    assert settled.converged and found.stable[0, 0]
    return float(found.amplitude[0, 0]) / float(abs(settled.harmonic(1))), float(found.amplitude[0, 0])


def test_stiffness_harmonic_of_twice_the_order_helps_or_hinders_by_its_phase():
    """At two thirds of its threshold it changes the amplitude by up to a factor of three; errors fall with size."""
    amplitudes = []
    for angle, detuning in ((0.0, -0.02), (2.0, -0.02), (4.0, 0.02)):
        (large, amplitude), (small, _) = (helped(size, angle, detuning) for size in (1.0, 0.5))
        assert abs(large - 1) < 0.05 and abs(small - 1) < 0.6 * abs(large - 1)
        amplitudes.append(amplitude)
    assert amplitudes[1] > 3 * amplitudes[0]


def super_harmonic(order, size, detuning):
    """Everything that excites scales with `size`, B_n and damping too: A then does, or its square at order 3."""
    stiffness = np.array([0.10, 0.05 * size, 0.03 * size**2]) * size
    given = model(0.04 * size, stiffness=stiffness, torque=0.06 * size, torque_angle=0.4)
    frequency = (NATURAL + detuning * size) / order
    closed = super_harmonic_resonance(loaded_mean(given), [frequency], order).amplitude[0, 0]
    settled = settled_vibration(given, frequency, settling=SETTLING, steps=64)
    assert settled.converged
    return float(closed), float(abs(settled.harmonic(order)))


@pytest.mark.parametrize("order, most, detuning", [(2, 0.02, -0.02), (2, 0.02, 0.03), (3, 0.025, 0.03)])
def test_super_harmonic_resonance_is_asymptotic(order, most, detuning):
    errors = []
    for size in (0.5, 0.25):
        closed, integrated = super_harmonic(order, size, detuning)
        errors.append(abs(closed / integrated - 1))
    assert errors[0] < most and errors[1] < 0.8 * errors[0]


def test_super_harmonic_forcing_has_every_part():
    """Without the quadratic term, the stiffness harmonic or the direct part the amplitude would be far off."""
    given = model(0.02, stiffness=(0.05, 0.0125, 0.0), torque=0.2, torque_angle=0.4)
    state = loaded_mean(given)
    half = state.frequency / 2
    forcing, (line, *_), *_ = map(np.asarray, linear(state, half))
    whole = complex(acting(state, half, 2))
    parts = forcing[1], -2 * float(state.quadratic) * line**2, -np.asarray(state.parametric)[0] * line
    assert np.isclose(whole, sum(parts))
    assert all(abs(part) > 0.05 * abs(whole) for part in parts)
    with pytest.raises(ValueError, match="order = 4 must be 1, 2 or 3"):
        effective_forcing(state, half, 4)


def sub_harmonic(size, share):
    given = model(0.02 * size, stiffness=np.array([0.08, 0, 0]) * size, torque=0.2 * size, torque_angle=3.4)
    state = loaded_mean(given)
    low, high = parametric_instability(state)
    frequency = float(low + share * (high - low))
    found = sub_harmonic_resonance(state, [frequency])
    settled = settled_vibration(given, frequency, start=[1.6, 0.1], settling=SETTLING, steps=64)
    assert settled.converged
    return found, float(abs(settled.harmonic(0.5)))


@pytest.mark.parametrize("share", [0.25, 0.75])
def test_sub_harmonic_resonance_is_asymptotic(share):
    errors = []
    for size in (1.0, 0.5):
        found, integrated = sub_harmonic(size, share)
        assert not found.stable[0, 0] and found.stable[2, 0]  # within the threshold rest is unstable
        errors.append(abs(float(found.amplitude[2, 0]) / integrated - 1))
    assert errors[0] < 0.05 and errors[1] < 0.7 * errors[0]


def test_sub_harmonic_is_there_within_the_threshold_only():
    given = model(0.01, stiffness=(0.04, 0.0, 0.0), torque=0.1, torque_angle=3.4)
    low, high = map(float, parametric_instability(loaded_mean(given)))
    width = high - low
    for frequency, there in ((low + 0.1 * width, True), (high - 0.1 * width, True), (high + 0.15 * width, False)):
        settled = settled_vibration(given, frequency, start=[1.53, 0.01], settling=SETTLING, steps=64)
        assert (abs(settled.harmonic(0.5)) > 0.01) == there, frequency


def test_instability_of_the_dead_zone_is_that_of_mathieu():
    """|Omega - 2| < sqrt(B_1^2 / 4 - 4 zeta^2), but for a shift of second order."""
    for zeta, low, high in ((0.05, 1.861, 2.139), (0.08, 1.938, 2.062)):
        stiffness = np.append(rectangular_harmonics(1.75, 0.37, 1), [0.0, 0.0])
        state = loaded_mean(model(zeta, stiffness=stiffness, clearance=DeadZone()))
        found = np.array(parametric_instability(state))
        shift = 2 * float(shift_of(state, jnp.array(2.0), parametric=1))
        assert np.allclose(found - shift, [low, high], atol=5e-4)
        assert abs(shift) < 0.343**2 / 16
    assert np.isclose(damping_threshold(state), 0.343 / 4, atol=1e-4)
    none = loaded_mean(model(0.09, stiffness=stiffness, clearance=DeadZone()))
    assert np.isnan(parametric_instability(none)).all()


def test_stiffness_harmonic_of_order_two_is_unstable_at_omega_zero():
    state = loaded_mean(model(0.01, stiffness=(0.0, 0.1, 0.0), clearance=DeadZone()))
    low, high = parametric_instability(state, order=2)
    assert low < 1.0 < high
    assert np.isclose(high - low, np.sqrt(0.1**2 / 4 - 4 * 0.01**2), rtol=1e-3)
    with pytest.raises(ValueError, match="order = 7 must be at most 6"):
        parametric_instability(state, order=7)


@pytest.mark.slow
@pytest.mark.parametrize("sign, orders", [(1, (13.0, 7.0)), (-1, (33.0, 13.0))])
def test_combination_resonance_is_asymptotic(sign, orders):
    """Two excitations at 13 and 7 or 33 and 13 twentieths of the resonance that neither of them meets."""
    errors = []
    for size in (0.5, 0.25):
        frequency = (NATURAL + 0.02 * size) / 20
        given = model(
            0.04 * size,
            torque=0.06 * size,
            torque_angle=0.4,
            torque_order=orders[0],
            displacement=0.3 * size,
            displacement_angle=1.0,
            displacement_order=orders[1],
        )
        state = loaded_mean(given)
        forcing = combined(state, given, jnp.array(frequency), 0, 1, sign)
        closed = amplitudes(state, forcing, 20 * frequency - state.frequency)[0]
        settled = settled_vibration(given, frequency, settling=24, periods=1, steps=1024)
        errors.append(abs(float(closed / abs(settled.harmonic(20))) - 1))
    assert errors[0] < 0.1 and errors[1] < 0.6 * errors[0]


def test_combinations_of_mesh_harmonics_are_the_super_harmonics():
    """Orders 1 and 2 make order 3, together with what the cubic term and B_n R_n add there."""
    given = model(0.03, torque=0.03, displacement=0.02, displacement_order=2.0)
    state = loaded_mean(given)
    third = state.frequency / 3
    _, (one, two, *_), _, inverse = map(np.asarray, linear(state, third))
    made = combined(state, given, third, 0, 1)
    assert np.isclose(made, -4 * float(state.quadratic) * one * two)
    # what is left at order 3 is from order 1 alone, of third order in it
    alone = complex(acting(state, third, 3)) - complex(made)
    a2, a3 = float(state.quadratic), float(state.cubic)
    assert np.isclose(alone, -2 * a3 * one**3 - 4 * a2 * one * (-a2 * one**2 / inverse))
