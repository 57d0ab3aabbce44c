"""Response curves and thresholds of resonances by the method of multiple scales."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Complex, Float

from ..numerics import Checked, Given, Numbers, check, program, real, real_roots, result, safe_divide, safe_sqrt, whole
from .model import DimensionlessModel
from .multiple_scales import LoadedMean, as_complex, effective_forcing, frequency_shift, turned

Scalar = Float[Array, ""]
Curve = Float[Array, " frequencies"]
Solutions = Float[Array, "*many"]

# There are no more solutions under a resonant forcing alone; with a parametric excitation there are up to five.
_FORCED = 3


class Resonance(Checked):
    """Amplitudes of the resonant vibration over the mesh frequency.

    Attributes:
        frequency: Omega, shape (frequencies,).
        amplitude: A, smallest first, NaN where there are fewer solutions; shape (solutions, frequencies). Up to five at
            `primary_resonance` and `super_harmonic_resonance`.
        stable: True for stable solutions, False for NaN, shape (solutions, frequencies).
    """

    frequency: Curve = result()
    amplitude: Float[Array, "solutions frequencies"] = result()
    stable: Bool[Array, "solutions frequencies"] = result()


class Backbone(Checked):
    """Response curve as mesh frequencies over the amplitude, through its folds.

    Attributes:
        amplitude: A, shape (amplitudes,).
        lower, upper: Omega on either side of the peak, shape (amplitudes,); NaN above the peak.
        lower_stable, upper_stable: shape (amplitudes,).
    """

    amplitude: Curve = result()
    lower: Curve = result()
    upper: Curve = result()
    lower_stable: Bool[Array, " frequencies"] = result()
    upper_stable: Bool[Array, " frequencies"] = result()


def primary_resonance(state: LoadedMean, frequency: Numbers) -> Resonance:
    """Primary resonance, Omega ~ omega_0: amplitudes A of the resonant vibration.

    The complex amplitude A solves (i zeta - s) A + h A* / (2 omega_0) = P_1 / (2 omega_0), with
    s = Omega - omega_0 - shift - kappa |A|^2 and h = 2 a_2 Lambda_2 + Q_2 / 2: the stiffness harmonic of twice the
    resonant order excites the same vibration parametrically and, depending on its phase, increases or decreases it.
    Without it A^2 [(Omega - omega_0 - kappa A^2)^2 + zeta^2] = (P_1 / (2 omega_0))^2. Below the `damping_threshold` of
    that order the vibration would also grow without forcing.

    Args:
        state: the expansion about the loaded mean.
        frequency: Omega, shape (frequencies,).
    """
    return _resonance(state, real(frequency), 1)


def super_harmonic_resonance(state: LoadedMean, frequency: Numbers, order: int = 2) -> Resonance:
    """Super-harmonic resonance, order Omega ~ omega_0: amplitudes A of the vibration at order Omega.

    The equation is that of `primary_resonance`, with `effective_forcing` and the detuning order Omega - omega_0. The
    forced response at the other orders adds to this vibration.

    Args:
        state: the expansion about the loaded mean.
        frequency: Omega, shape (frequencies,).
        order: 2 or 3.
    """
    return _resonance(state, real(frequency), whole("order", order, 2, 3))


def response_curve(state: LoadedMean, amplitude: Numbers, *, order: int = 1) -> Backbone:
    """Response curve of `primary_resonance` (order 1) or `super_harmonic_resonance` (2, 3) in closed form over A.

    Omega = (omega_0 + kappa A^2 + shift + s) / order with the smallest and the largest s of this amplitude, which are
    -+ sqrt((P / (2 omega_0 A))^2 - zeta^2) without parametric excitation. Forcing, parametric excitation and shift are
    evaluated at omega_0 / order; the curve neglects their change along it.

    Args:
        state: the expansion about the loaded mean.
        amplitude: A > 0, shape (amplitudes,).
        order: 1, 2 or 3.
    """
    check("amplitude", amplitude, "", low=0.0, open_low=True)
    order = whole("order", order, 1, 3)
    return _curve(state, jnp.atleast_1d(real(amplitude)), order)


def sub_harmonic_resonance(state: LoadedMean, frequency: Numbers, *, order: int = 1) -> Resonance:
    """Sub-harmonic resonance, order Omega ~ 2 omega_0: amplitudes A of A cos(order Omega t / 2 - gamma).

    The vibration needs no forcing at its own frequency:
    kappa A^2 = order Omega / 2 - omega_0 - shift -+ sqrt((|h| / (2 omega_0))^2 - zeta^2), h = 2 a_2 Lambda + Q / 2 of
    that order: the quadratic term and the stiffness harmonic have the same effect. The solution with the larger A is
    stable. A = 0 is a solution too, stable outside the threshold (`parametric_instability`), and comes first.

    Args:
        state: the expansion about the loaded mean.
        frequency: Omega, shape (frequencies,).
        order: harmonic that excites, 1 to 6.
    """
    order = whole("order", order, 1, len(state.orders))
    return _sub_harmonic(state, real(frequency), order)


def parametric_instability(state: LoadedMean, *, order: int = 1) -> tuple[Scalar, Scalar]:
    """Mesh frequencies Omega between which the forced response is unstable at order Omega ~ 2 omega_0; NaN if none.

    order Omega = 2 (omega_0 + shift -+ sqrt((|h| / (2 omega_0))^2 - zeta^2)), with h and shift at 2 omega_0 / order:
    |Omega - 2| < sqrt(B_1^2 / 4 - 4 zeta^2) for a dead zone and order 1.
    """
    order = whole("order", order, 1, len(state.orders))
    return _instability(state, order)


def damping_threshold(state: LoadedMean, *, order: int = 1) -> Scalar:
    """Damping ratio zeta = |h| / (2 omega_0) above which order Omega ~ 2 omega_0 has no parametric instability."""
    order = whole("order", order, 1, len(state.orders))
    return jnp.abs(_coupling(state, 2 * state.frequency / order, order)) / (2 * state.frequency)


def combination_forcing(
    state: LoadedMean, model: DimensionlessModel, frequency: Given, first: int, second: int, sign: int = 1
) -> Complex[Array, ""]:
    """Forcing by two excitations of a model at the combination frequency (n_1 + sign n_2) Omega.

    The orders n_1, n_2 of `model.orders` need not be whole numbers. The forcing is
    -(4 a_2 Lambda_1 Lambda_2 + Q_1 Lambda_2 + Q_2 Lambda_1), with conjugate factors of n_2 for the difference. If the
    combination frequency is near omega_0, `forced_amplitude` gives the amplitude.

    Args:
        state: the expansion about the loaded mean.
        model: model with the excitations: torque, displacement, and stiffness harmonics where an order is whole.
        frequency: Omega.
        first, second: places of n_1 and n_2 in `model.orders`.
        sign: 1 for the sum, -1 for the difference.
    """
    if sign not in (1, -1):
        raise ValueError(f"sign = {sign!r} must be 1 or -1")
    line, stiff = zip(*(_of_line(state, model, real(frequency), place) for place in (first, second)))
    if sign == -1:
        line, stiff = (line[0], line[1].conj()), (stiff[0], stiff[1].conj())
    return -(4 * as_complex(state.quadratic) * line[0] * line[1] + stiff[0] * line[1] + stiff[1] * line[0])


def forced_amplitude(state: LoadedMean, forcing: Given | complex, detuning: Given) -> Float[Array, " solutions"]:
    """Amplitudes A, smallest first and NaN where there are fewer than three, under a resonant forcing.

    A^2 [(detuning - kappa A^2)^2 + zeta^2] = (|forcing| / (2 omega_0))^2.

    Args:
        state: the expansion about the loaded mean.
        forcing: amplitude, complex or not.
        detuning: frequency of the forcing minus omega_0 (and its shift).
    """
    size = as_complex(jnp.abs(jnp.asarray(forcing)) / (2 * state.frequency))
    return _amplitudes(state, _Slow(size, jnp.zeros_like(size)), real(detuning))[:_FORCED]


class _Slow(NamedTuple):
    """Terms of the slow amplitude equation (i zeta - s) A + coupling A* = forcing, both over 2 omega_0."""

    forcing: Complex[Array, ""]
    coupling: Complex[Array, ""]

    def numerator(self, zeta: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """Coefficients of |A|^2 (s^2 + zeta^2 - |coupling|^2)^2 over s, from the constant one up."""
        size, turned_by = jnp.abs(self.forcing) ** 2, self.forcing**2 * self.coupling.conj()
        constant = size * (zeta**2 + jnp.abs(self.coupling) ** 2) - 2 * zeta * jnp.imag(turned_by)
        return constant, 2 * jnp.real(turned_by), size

    def margin(self, zeta: Scalar) -> Scalar:
        """Stability margin zeta^2 - |coupling|^2 of the vibration without forcing."""
        return zeta**2 - jnp.abs(self.coupling) ** 2

    def stable(self, state: LoadedMean, squared: Solutions, s: Solutions) -> Bool[Array, "*many"]:
        """True if small changes of a solution with |A|^2 at s decay; the trace of the slow motion is -2 zeta."""
        zeta, kappa = state.damping_ratio, state.kappa
        inverse = as_complex(safe_divide(1.0, s**2 + self.margin(zeta)))
        found = inverse * (-jax.lax.complex(s, zeta + 0 * s) * self.forcing - self.coupling * self.forcing.conj())
        growth = jnp.abs(self.coupling + as_complex(kappa + 0 * s) * found**2) ** 2
        return zeta**2 + (s - kappa * squared) ** 2 - growth > 0


def _slow(state: LoadedMean, frequency: Scalar, order: int) -> _Slow:
    over = as_complex(0.5 / state.frequency)
    forcing = effective_forcing(state, frequency, order)
    return _Slow(over * forcing, over * _coupling(state, frequency, 2 * order))


@program
def _resonance(state: LoadedMean, frequency: Curve, order: int) -> Resonance:
    def at(forced):
        detuning = order * forced - state.frequency - frequency_shift(state, forced, order)
        slow = _slow(state, forced, order)
        found = _amplitudes(state, slow, detuning)
        return found, slow.stable(state, found**2, detuning - state.kappa * found**2)

    amplitude, stable = jax.vmap(at, out_axes=1)(frequency)
    return Resonance(frequency, amplitude, stable)


@program
def _curve(state: LoadedMean, amplitude: Curve, order: int) -> Backbone:
    at = state.frequency / order
    slow, shift, zeta = _slow(state, at, order), frequency_shift(state, at, order), state.damping_ratio

    def of(a):
        constant, linear, square = slow.numerator(zeta)
        margin, squared, zero = slow.margin(zeta), a**2, jnp.zeros_like(a)
        terms = margin**2 - constant / squared, -linear / squared, 2 * margin - square / squared, zero, zero + 1
        roots = real_roots(jnp.stack(terms))
        s = jnp.stack([jnp.nanmin(roots), jnp.nanmax(roots)])
        return (state.frequency + state.kappa * squared + shift + s) / order, slow.stable(state, squared + 0 * s, s)

    (lower, upper), stable = jax.vmap(of, out_axes=1)(amplitude)
    return Backbone(amplitude, lower, upper, *stable)


@program
def _sub_harmonic(state: LoadedMean, frequency: Curve, order: int) -> Resonance:
    def at(forced):
        shift = frequency_shift(state, forced, _own(order), parametric=order)
        detuning = 0.5 * order * forced - state.frequency - shift
        drive = jnp.abs(_coupling(state, forced, order)) / (2 * state.frequency)
        inner = drive**2 - state.damping_ratio**2
        width = jnp.where(inner >= 0, safe_sqrt(jnp.maximum(inner, 0.0)), jnp.nan)
        squared = jnp.sort((detuning + jnp.stack([-width, width])) / state.kappa)
        found = jnp.where(squared > 0, safe_sqrt(jnp.where(squared > 0, squared, 1.0)), jnp.nan)
        rest_stable = ~(jnp.abs(detuning) < width)
        stable = jnp.stack([rest_stable, jnp.zeros_like(rest_stable), found[1] > 0])
        return jnp.concatenate([jnp.zeros(1, found.dtype), found]), stable

    amplitude, stable = jax.vmap(at, out_axes=1)(frequency)
    return Resonance(frequency, amplitude, stable)


@program
def _instability(state: LoadedMean, order: int) -> tuple[Scalar, Scalar]:
    at = 2 * state.frequency / order
    drive = jnp.abs(_coupling(state, at, order)) / (2 * state.frequency)
    inner = drive**2 - state.damping_ratio**2
    width = jnp.where(inner >= 0, safe_sqrt(jnp.maximum(inner, 0.0)), jnp.nan)
    middle = state.frequency + frequency_shift(state, at, _own(order), parametric=order)
    return 2 * (middle - width) / order, 2 * (middle + width) / order


def _own(order: int) -> int:
    """Order in forced resonance when `order` excites parametrically, half of it; 0 for an odd order."""
    return order // 2 if order % 2 == 0 else 0


def _coupling(state: LoadedMean, frequency: Scalar, order: int) -> Complex[Array, ""]:
    """h = 2 a_2 Lambda + Q / 2 of one order."""
    line = state.response(frequency)[order - 1]
    return 2 * as_complex(state.quadratic) * line + 0.5 * state.parametric[order - 1]


def _of_line(state: LoadedMean, model: DimensionlessModel, frequency: Scalar, place: int):
    """Half amplitude of the response to one excitation of a model, and the stiffness harmonic of the same order."""
    place = whole("place", place, 0, len(model.orders) - 1)
    order = model.orders[place]
    forced = order * frequency
    same = state.orders == order
    own = as_complex(model.torque[place]) * turned(model.torque_angles[place])
    moved = as_complex(forced**2 * model.displacement[place]) * turned(model.displacement_angles[place])
    forcing = jnp.where(same.any(), jnp.sum(jnp.where(same, state.forcing(frequency), 0.0)), own + moved)
    return 0.5 * forcing / state.receptance_inverse(forced), jnp.sum(jnp.where(same, state.parametric, 0.0))


def _amplitudes(state: LoadedMean, slow: _Slow, detuning: Scalar) -> Float[Array, " solutions"]:
    """All |A| at a detuning: roots of a polynomial of order five in u = |kappa| A^2, where s = +-(d - u)."""
    kappa, zeta = state.kappa, state.damping_ratio
    size = jnp.maximum(jnp.abs(kappa), 1e-12)  # without kappa the curve is the linear one
    sign = jnp.where(kappa < 0, -1.0, 1.0).astype(zeta.dtype)
    d = sign * detuning
    constant, linear, square = (size * part for part in slow.numerator(zeta))
    linear, inner = sign * linear, d**2 + slow.margin(zeta)
    # u (u^2 - 2 d u + inner)^2 = constant + linear (d - u) + square (d - u)^2
    terms = (
        -(constant + linear * d + square * d**2),
        inner**2 + linear + 2 * square * d,
        -4 * d * inner - square,
        2 * inner + 4 * d**2,
        -4 * d,
        jnp.ones_like(d),
    )
    u = real_roots(jnp.stack(terms))
    u = jnp.sort(jnp.where(u >= 0, u, jnp.nan))
    known = u >= 0
    return jnp.where(known, safe_sqrt(jnp.where(known, u, 1.0) / size), jnp.nan)
