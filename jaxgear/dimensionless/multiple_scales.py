"""Small vibrations about the loaded mean by the method of multiple scales: primary, super-, sub-harmonic, combination
resonances and the thresholds of parametric instability.

    y'' + 2 zeta y' + (omega_0^2 + sum Q_n cos) y + (a_2 + sum R_n cos) y^2 + a_3 y^3 = sum P_n(Omega) cos

with y = x - x_m and every cos at n Omega with its own angle: the mesh force expanded about x_m. At a resonance of an
order, y = A cos(omega t - gamma) + (forced response), and A changes slowly. Forcing, parametric excitation, damping and
a_2 y^2 are small of first order, a_3 y^3 of second order.

Reference: Nayfeh, Mook, Nonlinear Oscillations (Wiley 1979), chapters 4 (forced) and 5 (parametric), which treat single
harmonics; the sums over harmonics are derived in the same way.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float

from ..numerics import Checked, Given, Numbers, check, program, real, real_roots, result, safe_divide, safe_sqrt, whole
from .model import DimensionlessModel, loaded_te

Scalar = Float[Array, ""]
Lines = Complex[Array, " orders"]

_POSITIONS = 1024  # of the mesh cycle, where the harmonics of the expansion are found
_NEWTON = 30
_HIGHEST = 6  # order of the mesh frequency that is kept


def turned(angle: Float[Array, "*any"]) -> Complex[Array, "*any"]:
    """Complex number e^(i angle), angle in rad."""
    return jax.lax.complex(jnp.cos(angle), jnp.sin(angle))


def as_complex(part: Float[Array, "*any"]) -> Complex[Array, "*any"]:
    """Complex number with an imaginary part of zero."""
    return jax.lax.complex(part, jnp.zeros_like(part))


class LoadedMean(Checked):
    """A mesh force expanded about its loaded mean. Complex amplitudes c stand for Re(c e^(i n Omega t)).

    Attributes:
        mean: x_m, at which the mean mesh force is F_m.
        frequency: omega_0 there, sqrt(f') without modification.
        quadratic, cubic: a_2 = f'' / 2, a_3 = f''' / 6.
        damping_ratio: zeta of the model, by which free vibrations decay as exp(-zeta t).
        orders: n = 1 ... of the mesh frequency, shape (orders,).
        force: harmonics of F_m - (force at x_m) and of the torque, -B_n F_m without modification, shape (orders,).
        inertia: P_n = force + (n Omega)^2 inertia, that is F_ah, shape (orders,).
        parametric: Q_n, B_n omega_0^2 without modification, shape (orders,).
        parametric_quadratic: R_n, shape (orders,).
    """

    mean: Scalar = result()
    frequency: Scalar = result()
    quadratic: Scalar = result()
    cubic: Scalar = result()
    damping_ratio: Scalar = result()
    orders: Float[Array, " orders"] = result()
    force: Lines = result()
    inertia: Lines = result()
    parametric: Lines = result()
    parametric_quadratic: Lines = result()

    @property
    def kappa(self) -> Scalar:
        """Shift of the frequency per squared amplitude, 3 a_3 / (8 omega_0) - 5 a_2^2 / (12 omega_0^3)."""
        omega = self.frequency
        return 3 * self.cubic / (8 * omega) - 5 * self.quadratic**2 / (12 * omega**3)

    def forcing(self, frequency: Scalar) -> Lines:
        """Forcing amplitudes P_n at a mesh frequency Omega, shape (orders,)."""
        return self.force + as_complex((self.orders * frequency) ** 2) * self.inertia

    def receptance_inverse(self, frequency: Float[Array, "*any"]) -> Complex[Array, "*any"]:
        """Inverse receptance omega_0^2 - frequency^2 + 2 i zeta frequency."""
        return jax.lax.complex(self.frequency**2 - frequency**2, 2 * self.damping_ratio * frequency)

    def response(self, frequency: Scalar, without: int = 0) -> Lines:
        """Forced linear response at Omega, half amplitudes Lambda_n, shape (orders,); zero at the order `without`."""
        forced = self.orders * frequency
        gain = self.receptance_inverse(forced)
        return jnp.where(self.orders == without, 0.0, 0.5 * self.forcing(frequency) / gain)


@program
def loaded_mean(model: DimensionlessModel) -> LoadedMean:
    """Expand the mesh force of a model about its loaded mean, with orders 1 to 6 of the mesh frequency.

    The clearance should have three derivatives; a dead zone is piecewise linear, a_2 = a_3 = 0. Torque and displacement
    at orders other than whole numbers up to 6 are ignored; `combination_forcing` covers them.
    """
    force = model.mesh_force
    phase = real(np.arange(_POSITIONS) / _POSITIONS).astype(model.load.dtype)
    place = jax.vmap(force.at)(phase)

    def over_cycle(x):
        return jax.vmap(lambda at: force.force(at, x))(place)

    def derived(function):
        return lambda x: jax.jvp(function, (x,), (jnp.ones_like(x),))[1]

    first = derived(over_cycle)
    second = derived(first)
    third = derived(second)

    def newton(_, x):
        return x - (jnp.mean(over_cycle(x)) - model.load) / jnp.mean(first(x))

    shift = 0.0 if model.relief is None else jnp.mean(jax.vmap(model.relief)(phase))
    start = loaded_te(model.clearance, model.load) + shift
    x = jax.lax.fori_loop(0, _NEWTON, newton, start)
    orders = real(np.arange(1, _HIGHEST + 1)).astype(phase.dtype)
    turn = turned(-2 * jnp.pi * orders[:, None] * phase[None])

    def harmonics(curve):
        return 2 / _POSITIONS * (turn @ as_complex(curve))

    same = as_complex((model.orders[None] == orders[:, None]).astype(phase.dtype))
    torque = same @ (as_complex(model.torque) * turned(model.torque_angles))
    inertia = same @ (as_complex(model.displacement) * turned(model.displacement_angles))
    slope, bend = first(x), 0.5 * second(x)
    return LoadedMean(
        mean=x,
        frequency=safe_sqrt(jnp.mean(slope)),
        quadratic=jnp.mean(bend),
        cubic=jnp.mean(third(x)) / 6,
        damping_ratio=model.damping_ratio,
        orders=orders,
        force=torque - harmonics(over_cycle(x)),
        inertia=inertia,
        parametric=harmonics(slope),
        parametric_quadratic=harmonics(bend),
    )


def frequency_shift(state: LoadedMean, frequency: Scalar, resonant: int = 0, parametric: int = 0) -> Scalar:
    """Second-order shift of omega_0 by forced response and parametric excitation, dimensionless.

    Args:
        state: expansion about the loaded mean.
        frequency: mesh frequency Omega.
        resonant: order n in resonance, n Omega ~ omega_0, whose response is the slow amplitude; 0 for none. The order
            2 n excites parametrically and is not part of the shift.
        parametric: order n of parametric resonance, n Omega ~ 2 omega_0, which is not part of the shift; 0 for none.
    """
    omega, forced = state.frequency, state.orders * frequency
    line = state.response(frequency, resonant)
    coupling = as_complex(2 * state.quadratic) * line + 0.5 * state.parametric
    constant = -jnp.sum(2 * state.quadratic * jnp.abs(line) ** 2 + jnp.real(state.parametric.conj() * line))
    total = 6 * state.cubic * jnp.abs(line) ** 2 + 2 * jnp.real(state.parametric_quadratic * line.conj())
    # sum and difference of the vibration's frequency and the line's; one that resonates is no small correction
    total = total + jnp.abs(coupling) ** 2 / (forced * (2 * omega + forced))
    close = (state.orders == parametric) | (state.orders == 2 * resonant) & (resonant > 0)
    apart = jnp.where(close, 1.0, forced * (2 * omega - forced))
    total = total - jnp.where(close, 0.0, jnp.abs(coupling) ** 2 / apart)
    return (jnp.sum(total) + 2 * state.quadratic * constant / omega**2) / (2 * omega)


def effective_forcing(state: LoadedMean, frequency: Scalar, order: int) -> Complex[Array, ""]:
    """Effective forcing amplitude at `order` Omega: P_n plus the nonlinear contributions of lower orders.

    Order 2: P_2 - 2 a_2 Lambda_1^2 - Q_1 Lambda_1. Order 3: P_3 - 2 a_3 Lambda_1^3 - R_1 Lambda_1^2 - 4 a_2 Lambda_1
    Lambda_2 - Q_1 Lambda_2 - Q_2 Lambda_1, where Lambda_2 is the whole response at 2 Omega. Half amplitudes Lambda.
    Order 1: P_1.

    Args:
        state: expansion about the loaded mean.
        frequency: mesh frequency Omega.
        order: order 1, 2 or 3.
    """
    if order not in (1, 2, 3):
        raise ValueError(f"order = {order!r} must be 1, 2 or 3")
    direct, line = state.forcing(frequency), state.response(frequency)
    if order == 1:
        return direct[0]
    one, a2, a3 = line[0], as_complex(state.quadratic), as_complex(state.cubic)
    q, r = state.parametric, state.parametric_quadratic
    twice = -2 * a2 * one * one - q[0] * one
    if order == 2:
        return direct[1] + twice
    two = line[1] + 0.5 * twice / state.receptance_inverse(2 * frequency)
    made = 2 * a3 * one * one * one + r[0] * one * one + 4 * a2 * one * two + q[0] * two + q[1] * one
    return direct[2] - made


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
