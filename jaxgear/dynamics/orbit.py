"""Periodic orbits by Newton shooting on the Poincare map, with their Floquet multipliers and exact derivatives."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float

from ..contact.status import Status, Statuses, WithStatus, status_of
from ..numerics import (
    Checked,
    Given,
    Numbers,
    check,
    count,
    implicit_root,
    kernel,
    program,
    real,
    result,
    whole,
    with_jacobian,
)
from .integrate import Steps, cycles, history, largest, mean, rms, share, smallest
from .oscillator import Coordinates, Oscillator, State, static_force
from .poincare import STEPS, Nodes, Start, Unknowns, after, checked, moved, scaled, steps_at, unscaled

Scalar = Float[Array, ""]
Samples = Float[Array, " samples"]

# A multiplier counts as outside of the unit circle from this many roots of the rounding error on: coordinates that turn
# freely together have two multipliers of one, which rounding separates by that much.
_NEUTRAL = 100.0
_REFINEMENTS = 8  # evaluations of Newton's method from a settled state, which is near: three or four are enough
_SAME = 0.05  # largest distance of an orbit from the settled state that it refines, as part of its size


class Orbit(WithStatus, Checked):
    """Periodic orbit, whose state repeats after `periods` mesh cycles; `jax.vmap` adds leading batch axes.

    Attributes:
        displacement, velocity: displacements [um] and velocities [um/s] of the coordinates at mesh position 0, shape
            (coordinates,).
        mesh_frequency: mesh frequency [Hz].
        periods: number of mesh cycles after which the state repeats.
        phase: mesh positions of the samples [base pitches], from 0 to `periods`, shape (samples,).
        dte: dynamic transmission error (DTE) [um], shape (samples,).
        dte_rate: rate of the DTE [um/s], shape (samples,).
        force: elastic force of the mesh [N], shape (samples,).
        dynamic_factor: largest force over the static force; the static force is the mean over the cycle at rest if
            springs carry a part of the load.
        dte_rms: root mean square of the DTE about its mean [um].
        dte_mean, dte_min, dte_max: mean and extremes of the DTE [um].
        contact_loss_share, back_side_contact: share of the time without force, and with force on the coast flanks;
            they have no derivative.
        monodromy: derivative of the state after the orbit with respect to the state before, in displacements and
            velocities / (2 pi mesh frequency), shape (2 coordinates, 2 coordinates).
        residual: largest change over the orbit of displacements and velocities / (2 pi mesh frequency) [um].
        status: `converged` if the residual is within rounding, scaled by the size of the multipliers.
    """

    displacement: Coordinates = result("um")
    velocity: Coordinates = result("um/s")
    mesh_frequency: Scalar = result("Hz")
    phase: Samples = result()
    dte: Samples = result("um")
    dte_rate: Samples = result("um/s")
    force: Samples = result("N")
    dynamic_factor: Scalar = result()
    dte_rms: Scalar = result("um")
    dte_mean: Scalar = result("um")
    dte_min: Scalar = result("um")
    dte_max: Scalar = result("um")
    contact_loss_share: Scalar = result()
    back_side_contact: Scalar = result()
    monodromy: Float[Array, "unknowns unknowns"] = result()
    residual: Scalar = result("um")
    status: Statuses = result()
    periods: int = count()

    @property
    def start(self) -> State:
        """State at mesh position 0: displacements [um] and velocities [um/s]."""
        return self.displacement, self.velocity

    @property
    def amplitude(self) -> Float[Array, "..."]:
        """Half of the range of the DTE [um]."""
        return 0.5 * (self.dte_max - self.dte_min)

    def harmonic(self, order: Given) -> Complex[Array, ""]:
        """Complex amplitude c [um] of any order, DTE ~ Re(c e^(2 pi i order phase)); not for batches of orbits."""
        return _harmonic(self.phase, self.dte, real(order), self.periods)

    @property
    def multipliers(self) -> Complex[Array, "... unknowns"]:
        """Floquet multipliers, the growth factors of small deviations over one orbit, shape (2 coordinates,)."""
        return jnp.linalg.eigvals(self.monodromy)

    @property
    def stable(self) -> Bool[Array, "..."]:
        """True for a stable orbit: no multiplier lies outside the unit circle."""
        return _stable(self.monodromy)


@program
def _stable(monodromy: Float[Array, "*orbits unknowns unknowns"]) -> Bool[Array, "*orbits"]:
    return ~jnp.any(outside(jnp.abs(jnp.linalg.eigvals(jax.lax.stop_gradient(monodromy)))), axis=-1)


@program
def _harmonic(phase: Samples, dte: Samples, order: Scalar, periods: int) -> Complex[Array, ""]:
    length = jnp.diff(phase, append=jnp.full(1, periods, phase.dtype))
    part = 0.5 * (length + jnp.roll(length, 1)) / periods * dte
    angle = 2 * jnp.pi * order * phase
    return 2 * jax.lax.complex(jnp.sum(part * jnp.cos(angle)), -jnp.sum(part * jnp.sin(angle)))


def outside(moduli: Float[Array | np.ndarray, "..."]) -> Bool[Array | np.ndarray, "..."]:
    """True for multipliers outside the unit circle, from their moduli, within rounding."""
    return ~(moduli <= 1 + _NEUTRAL * np.sqrt(jnp.finfo(moduli.dtype).eps))


def find_orbit(
    oscillator: Oscillator, mesh_frequency: Given, start: Start, *, periods: int = 1, steps: Numbers = STEPS
) -> Orbit:
    """Find the periodic orbit next to a state, stable or unstable.

    Newton's method finds a zero of the change of the state over `periods` mesh cycles, integrated by Runge-Kutta steps
    of order four. The results are differentiable with respect to every number of the oscillator and to the mesh
    frequency, in forward and reverse mode, by the implicit function theorem; at a fold no derivatives exist.

    Args:
        oscillator: the oscillator.
        mesh_frequency: mesh frequency [Hz], shape ().
        start: displacements [um] and velocities [um/s] at mesh position 0, each of shape (coordinates,), not far from
            the orbit; no derivative passes through them.
        periods: mesh cycles after which the orbit repeats.
        steps: number of steps of a mesh cycle, placed by the mesh force; or their ends from 0 to 1 [base pitches], one
            of them at every jump of the force. A kink of the force within a step, for instance where stiff flanks
            separate, reduces the derivatives to first order in the step.

    Raises:
        TypeError: for something else than an `Oscillator`.
        ValueError: for a mesh frequency that is not positive, a start of another shape or steps out of order.
    """
    frequency, start, nodes = checked(oscillator, mesh_frequency, start, steps)
    return _found(oscillator, frequency, start, nodes, whole("periods", periods))


def settle(
    oscillator: Oscillator, mesh_frequency: Given, start: Start, *, cycles: int = 100, steps: Numbers = STEPS
) -> State:
    """State at mesh position 0 after a number of mesh cycles; it has no derivatives.

    With a damping ratio zeta deviations decay by exp(-2 pi zeta f_n / f) per cycle.

    Args:
        oscillator, mesh_frequency, start, steps: as for `find_orbit`.
        cycles: number of mesh cycles.

    Raises:
        TypeError, ValueError: as `find_orbit`.
    """
    frequency, start, nodes = checked(oscillator, mesh_frequency, start, steps)
    return _settled(oscillator, frequency, start, nodes, whole("cycles", cycles, 0))


def steady_orbit(
    oscillator: Oscillator,
    mesh_frequency: Given,
    start: Start,
    *,
    settle: int = 100,
    periods: int = 1,
    steps: Numbers = STEPS,
) -> Orbit:
    """Find the stable orbit on which the motion from a start settles, with exact derivatives.

    The motion is integrated over `settle` mesh cycles without derivatives; Newton's method then finds the orbit. The
    result has not converged if the motion does not settle on an orbit of `periods` mesh cycles, because that orbit is
    unstable or far away; it then contains the integrated cycles.

    Args:
        oscillator, mesh_frequency, start, periods, steps: as for `find_orbit`; the start need not be near the orbit.
        settle: number of mesh cycles before Newton's method, for instance 5 / (2 pi zeta f_n / f) with a damping
            ratio zeta.

    Raises:
        TypeError, ValueError: as `find_orbit`.
    """
    frequency, start, nodes = checked(oscillator, mesh_frequency, start, steps)
    settle, periods = whole("settle", settle, 0), whole("periods", periods)
    return settled_orbit(oscillator, frequency, start, nodes, settle, periods)


def steady_orbits(
    oscillator: Oscillator,
    mesh_frequencies: Numbers,
    start: Start,
    *,
    settle: int = 0,
    periods: int = 1,
    steps: Numbers = STEPS,
) -> Orbit:
    """Find steady orbits at many speeds, each from its own start, for objectives over a speed range.

    Use the states of a speed sweep as starts: every orbit then lies on the branch of the sweep. A smooth worst case is
    `reductions.Max().soft(orbits.dynamic_factor, width)`.

    Args:
        oscillator, settle, periods, steps: as for `steady_orbit`.
        mesh_frequencies: mesh frequencies [Hz], shape (speeds,).
        start: displacements [um] and velocities [um/s] at mesh position 0, each of shape (speeds, coordinates).

    Returns:
        orbits, every array with the leading axis (speeds,).

    Raises:
        TypeError, ValueError: as `find_orbit`.
    """
    frequencies, (x, v) = real(mesh_frequencies), (real(part) for part in start)
    if frequencies.ndim != 1 or x.shape[:1] != frequencies.shape:
        raise ValueError(
            f"mesh_frequencies have shape {frequencies.shape} and the start {x.shape}, "
            "must be (speeds,) and (speeds, coordinates)"
        )
    check("mesh_frequencies", frequencies, "Hz", low=0.0, open_low=True)

    def at(frequency, x, v):
        return steady_orbit(oscillator, frequency, (x, v), settle=settle, periods=periods, steps=steps)

    return eqx.filter_vmap(at)(frequencies, x, v)


@kernel
def _settled(oscillator, frequency, start, nodes, count: int) -> State:
    oscillator, frequency, start = jax.lax.stop_gradient((oscillator, frequency, start))
    return after(oscillator, start, steps_at(oscillator, nodes), frequency, count)


@kernel
def _found(oscillator, frequency, start, nodes, periods: int) -> Orbit:
    steps = steps_at(oscillator, nodes)
    first = scaled(start, jax.lax.stop_gradient(frequency))
    z = implicit_root(lambda z: moved(oscillator, z, steps, frequency, periods), first)
    return orbit_at(oscillator, z, steps, frequency, periods)


@kernel
def settled_orbit(
    oscillator: Oscillator, frequency: Scalar, start: State, nodes: Nodes, settle: int, periods: int
) -> Orbit:
    """Steady orbit as from `steady_orbit`, without checks of the arguments.

    If the motion does not settle on an orbit of `periods` cycles, the result contains the integrated cycles: they have
    not converged, and their derivatives hold for a fixed initial state.
    """
    steps = steps_at(oscillator, nodes)
    begin = scaled(_settled(oscillator, frequency, start, nodes, settle), jax.lax.stop_gradient(frequency))
    z = implicit_root(lambda z: moved(oscillator, z, steps, frequency, periods), begin, most=_REFINEMENTS)
    # a state of NaN does not count as near
    same = jax.lax.stop_gradient(jnp.linalg.norm(z - begin) <= _SAME * jnp.linalg.norm(z))
    orbit = orbit_at(oscillator, jnp.where(same, z, begin), steps, frequency, periods)
    status = status_of({Status.NO_STEADY_MOTION: ~(orbit.stable & same)}, orbit.status)
    return dataclasses.replace(orbit, status=status)


def orbit_at(
    oscillator: Oscillator,
    z: Unknowns,
    steps: Steps,
    frequency: Scalar,
    periods: int,
    *,
    monodromy: Float[Array, "unknowns unknowns"] | None = None,
) -> Orbit:
    """Orbit over `periods` mesh cycles from the unknowns z, with its monodromy matrix where that is not given."""

    def flown(z):
        end, states = cycles(oscillator, unscaled(z, frequency), steps, frequency, periods)
        return scaled(end, frequency), (end, states)

    if monodromy is None:
        last, monodromy, (end, states) = with_jacobian(flown, z, has_aux=True)
    else:
        last, (end, states) = flown(z)
    of = history(oscillator, states, end, steps, frequency)
    residual = jnp.max(jnp.abs(last - z))
    x, v = unscaled(z, frequency)
    return Orbit(
        displacement=x,
        velocity=v,
        mesh_frequency=frequency,
        phase=of.phase,
        dte=of.dte[0],
        dte_rate=of.velocity,
        force=of.force[0],
        dynamic_factor=largest(of.force) / static_force(oscillator),
        dte_rms=rms(of, of.dte),
        dte_mean=mean(of, of.dte),
        dte_min=smallest(of.dte),
        dte_max=largest(of.dte),
        contact_loss_share=share(of, of.force == 0),
        back_side_contact=share(of, of.force < 0),
        monodromy=monodromy,
        residual=residual,
        status=status_of({Status.NOT_CONVERGED: ~(residual <= _tolerance(z, monodromy))}),
        periods=periods,
    )


def _tolerance(z, monodromy) -> Scalar:
    """Largest residual of a root of Newton's method [um]."""
    size = jnp.linalg.norm(z) * (1 + jnp.linalg.norm(monodromy))
    return jax.lax.stop_gradient(jnp.sqrt(jnp.finfo(z.dtype).eps) * 0.1 * size)
