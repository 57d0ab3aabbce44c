"""Small vibrations about the loaded mean by the method of multiple scales: primary, super-, sub-harmonic, combination
resonances and the thresholds of parametric instability.

    y'' + 2 zeta y' + (omega_0^2 + sum Q_n cos) y + (a_2 + sum R_n cos) y^2 + a_3 y^3 = sum P_n(Omega) cos

with y = x - x_m and every cos at n Omega with its own angle: the mesh force expanded about x_m. At a resonance of an
order, y = A cos(omega t - gamma) + (forced response), and A changes slowly. Forcing, parametric excitation, damping and
a_2 y^2 are small of first order, a_3 y^3 of second order.

Reference: Nayfeh, Mook, Nonlinear Oscillations (Wiley 1979), chapters 4 (forced) and 5 (parametric), which treat single
harmonics; the sums over harmonics are derived in the same way.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..numerics import Checked, program, real, result, safe_sqrt
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
