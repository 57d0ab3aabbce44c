"""Response curves and thresholds of the resonances that the method of multiple scales finds."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float

from ...numerics import Checked, check, program, real, result, safe_sqrt, whole
from .model import DimensionlessModel
from .multiple_scales import LoadedMean, as_complex, effective_forcing, frequency_shift, turned

Scalar = Float[Array, ""]
Curve = Float[Array, " frequencies"]

_POLISH = 3  # Newton steps on the roots of a cubic


class Resonance(Checked):
    """Amplitudes of the resonant vibration over the mesh frequency.

    Attributes:
        frequency: Omega, shape (frequencies,).
        amplitude: A, smallest first, NaN where there are fewer solutions; shape (solutions, frequencies).
        stable: likewise; False for NaN.
    """

    frequency: Curve = result()
    amplitude: Float[Array, "solutions frequencies"] = result()
    stable: Bool[Array, "solutions frequencies"] = result()


class Backbone(Checked):
    """A response curve over its amplitude, through its folds.

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


def primary_resonance(state: LoadedMean, frequency) -> Resonance:
    """Omega ~ omega_0: A^2 [(Omega - omega_0 - kappa A^2)^2 + zeta^2] = (P_1 / (2 omega_0))^2.

    The stiffness harmonic of twice the resonant order, here Q_2, excites the same vibration parametrically, which this
    curve leaves out: it holds where `damping_threshold` of that order is well below zeta, and the integrated motion
    (`settled_vibration`) is the reference elsewhere. Likewise for `super_harmonic_resonance`.

    Args:
        state: the expansion about the loaded mean.
        frequency: Omega, shape (frequencies,).
    """
    return _resonance(state, real(frequency), 1)


def super_harmonic_resonance(state: LoadedMean, frequency, order: int = 2) -> Resonance:
    """order Omega ~ omega_0: the same curve under `effective_forcing`, at the detuning order Omega - omega_0.

    A is the amplitude of the vibration at order Omega, beside the forced response at the other orders.

    Args:
        state: the expansion about the loaded mean.
        frequency: Omega, shape (frequencies,).
        order: 2 or 3.
    """
    return _resonance(state, real(frequency), whole("super_harmonic_resonance", "order", order, 2, 3))


def response_curve(state: LoadedMean, amplitude, *, order: int = 1) -> Backbone:
    """The curve of `primary_resonance` (order 1) or `super_harmonic_resonance` (2, 3) in closed form over A.

    Omega = (omega_0 + kappa A^2 + shift -+ sqrt((P / (2 omega_0 A))^2 - zeta^2)) / order. Forcing and shift are those
    at omega_0 / order, so that the curve differs from the exact one in what these change along it.

    Args:
        state: the expansion about the loaded mean.
        amplitude: A > 0, shape (amplitudes,).
        order: 1, 2 or 3.
    """
    check("response_curve", "amplitude", amplitude, "", low=0.0, open_low=True)
    a, omega, zeta = real(amplitude), state.frequency, state.damping_ratio
    at = omega / order
    drive = jnp.abs(effective_forcing(state, at, order)) / (2 * omega)
    shift = frequency_shift(state, at, order)
    inner = (drive / a) ** 2 - zeta**2
    there = inner >= 0
    width = jnp.where(there, safe_sqrt(jnp.where(there, inner, 1.0)), jnp.nan)
    middle = omega + shift + state.kappa * a**2

    def stable(detuned):
        return (detuned * (detuned - 2 * state.kappa * a**2) + zeta**2 > 0) & there

    return Backbone(a, (middle - width) / order, (middle + width) / order, stable(-width), stable(width))


def sub_harmonic_resonance(state: LoadedMean, frequency, *, order: int = 1) -> Resonance:
    """order Omega ~ 2 omega_0: A cos(order Omega t / 2 - gamma), which needs no forcing at its own frequency.

    kappa A^2 = order Omega / 2 - omega_0 - shift -+ sqrt((|h| / (2 omega_0))^2 - zeta^2), h = 2 a_2 Lambda + Q / 2 of
    that order: the quadratic term and the stiffness harmonic act alike. Of the two the solution with the larger A is
    stable; A = 0 is a solution too, stable outside the threshold (`parametric_instability`), and comes first.

    Args:
        state: the expansion about the loaded mean.
        frequency: Omega, shape (frequencies,).
        order: harmonic that excites, 1 to 6.
    """
    order = whole("sub_harmonic_resonance", "order", order, 1, len(state.orders))
    return _sub_harmonic(state, real(frequency), order)


def parametric_instability(state: LoadedMean, *, order: int = 1) -> tuple[Scalar, Scalar]:
    """Mesh frequencies Omega between which the forced response is unstable at order Omega ~ 2 omega_0; NaN if none.

    order Omega = 2 (omega_0 + shift -+ sqrt((|h| / (2 omega_0))^2 - zeta^2)), with h and shift at 2 omega_0 / order:
    |Omega - 2| < sqrt(B_1^2 / 4 - 4 zeta^2) for a dead zone and order 1.
    """
    order = whole("parametric_instability", "order", order, 1, len(state.orders))
    return _instability(state, order)


def damping_threshold(state: LoadedMean, *, order: int = 1) -> Scalar:
    """Damping ratio zeta from which on nothing is unstable at order Omega ~ 2 omega_0: |h| / (2 omega_0)."""
    order = whole("damping_threshold", "order", order, 1, len(state.orders))
    return jnp.abs(_coupling(state, 2 * state.frequency / order, order)) / (2 * state.frequency)


def combination_forcing(
    state: LoadedMean, model: DimensionlessModel, frequency, first: int, second: int, sign: int = 1
) -> Complex[Array, ""]:
    """What two excitations of a model make at the frequency (n_1 + sign n_2) Omega.

    Of the parts n_1, n_2 among `model.orders`, which need not be whole: -(4 a_2 Lambda_1 Lambda_2 + Q_1 Lambda_2 + Q_2
    Lambda_1), with the conjugate of what belongs to n_2 for the difference. Where that frequency is near omega_0 the
    amplitude follows from `forced_amplitude`.

    Args:
        state: the expansion about the loaded mean.
        model: whose torque and displacement excite, and whose stiffness harmonics where an order is a whole number.
        frequency: Omega.
        first, second: places of n_1 and n_2 in `model.orders`.
        sign: 1 for the sum, -1 for the difference.
    """
    if sign not in (1, -1):
        raise ValueError(f"combination_forcing: sign = {sign!r} must be 1 or -1")
    line, stiff = zip(*(_of_line(state, model, real(frequency), place) for place in (first, second)))
    if sign == -1:
        line, stiff = (line[0], line[1].conj()), (stiff[0], stiff[1].conj())
    return -(4 * as_complex(state.quadratic) * line[0] * line[1] + stiff[0] * line[1] + stiff[1] * line[0])


def forced_amplitude(state: LoadedMean, forcing, detuning) -> Float[Array, " solutions"]:
    """Amplitudes A, smallest first and NaN where there are fewer than three, under a resonant forcing.

    A^2 [(detuning - kappa A^2)^2 + zeta^2] = (|forcing| / (2 omega_0))^2.

    Args:
        state: the expansion about the loaded mean.
        forcing: amplitude, complex or not.
        detuning: frequency of the forcing minus omega_0 (and its shift).
    """
    return _amplitudes(state, jnp.abs(jnp.asarray(forcing)), real(detuning))


@program
def _resonance(state: LoadedMean, frequency: Curve, order: int) -> Resonance:
    def at(forced):
        detuning = order * forced - state.frequency - frequency_shift(state, forced, order)
        found = _amplitudes(state, jnp.abs(effective_forcing(state, forced, order)), detuning)
        square = state.kappa * found**2
        return found, (detuning - square) * (detuning - 3 * square) + state.damping_ratio**2 > 0

    amplitude, stable = jax.vmap(at, out_axes=1)(frequency)
    return Resonance(frequency, amplitude, stable)


@program
def _sub_harmonic(state: LoadedMean, frequency: Curve, order: int) -> Resonance:
    def at(forced):
        shift = frequency_shift(state, forced, parametric=order)
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
    middle = state.frequency + frequency_shift(state, at, parametric=order)
    return 2 * (middle - width) / order, 2 * (middle + width) / order


def _coupling(state: LoadedMean, frequency: Scalar, order: int) -> Complex[Array, ""]:
    """h = 2 a_2 Lambda + Q / 2 of one order."""
    line = state.response(frequency)[order - 1]
    return 2 * as_complex(state.quadratic) * line + 0.5 * state.parametric[order - 1]


def _of_line(state: LoadedMean, model: DimensionlessModel, frequency: Scalar, place: int):
    """Half amplitude of the response to one excitation of a model, and the stiffness harmonic of the same order."""
    place = whole("combination_forcing", "place", place, 0, len(model.orders) - 1)
    order = model.orders[place]
    forced = order * frequency
    same = state.orders == order
    own = as_complex(model.torque[place]) * turned(model.torque_angles[place])
    moved = as_complex(forced**2 * model.displacement[place]) * turned(model.displacement_angles[place])
    forcing = jnp.where(same.any(), jnp.sum(jnp.where(same, state.forcing(frequency), 0.0)), own + moved)
    return 0.5 * forcing / state.receptance_inverse(forced), jnp.sum(jnp.where(same, state.parametric, 0.0))


def _amplitudes(state: LoadedMean, forcing: Scalar, detuning: Scalar) -> Float[Array, " solutions"]:
    """Roots A of the cubic in u = A^2 |kappa|: u ((d - u)^2 + zeta^2) = c, d with the sign of kappa."""
    kappa, zeta = state.kappa, state.damping_ratio
    size = jnp.maximum(jnp.abs(kappa), 1e-12)  # without kappa the curve is the linear one
    drive = (forcing / (2 * state.frequency)) ** 2 * size
    sign = jnp.where(kappa < 0, -1.0, 1.0).astype(zeta.dtype)
    d = sign * detuning
    # u = 2 d / 3 + t leaves t^3 + p t + q = 0
    p = zeta**2 - d**2 / 3
    q = 2 * d**3 / 27 + 2 * d * zeta**2 / 3 - drive
    inner = 0.25 * q**2 + p**3 / 27
    root = safe_sqrt(jnp.maximum(inner, 0.0))
    # the sum of two cube roots, the smaller of which follows from their product
    larger = jnp.cbrt(-0.5 * q - jnp.where(q > 0, root, -root))
    single = larger - p / (3 * jnp.where(larger == 0, 1.0, larger))
    radius = 2 * safe_sqrt(jnp.maximum(-p / 3, 0.0))
    cosine = jnp.clip(-4 * q / jnp.where(radius > 0, radius, 1.0) ** 3, -1.0, 1.0)
    turns = real(np.arange(3) * 2 * np.pi).astype(d.dtype)
    triple = radius * jnp.cos((jnp.arccos(cosine) - turns) / 3)
    three = inner < 0
    u = 2 * d / 3 + jnp.where(three, triple, jnp.stack([single, *[single * jnp.nan] * 2]))

    def polish(_, u):
        value, slope = u * ((d - u) ** 2 + zeta**2) - drive, (d - u) * (d - 3 * u) + zeta**2
        return u - jnp.where(slope == 0, 0.0, value / jnp.where(slope == 0, 1.0, slope))

    u = jnp.sort(jax.lax.fori_loop(0, _POLISH, polish, u))
    return jnp.where(u >= 0, safe_sqrt(jnp.where(u >= 0, u, 1.0) / size), jnp.nan)
