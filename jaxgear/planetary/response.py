"""Linear vibration of a planetary stage over speed, excited by the transmission errors of its loaded meshes."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Complex, Float

from ..dynamics.oscillator import NEWTON
from ..numerics import Checked, Given, check, maximum, minimum, program, real, result, solve_dense, whole
from .cycle import StageCycle
from .vibration import StageSystem

Scalar = Float[Array, ""]
Speeds = Float[Array, " speeds"]
Spectrum = Complex[Array, "2 planets harmonics"]

_POINTS = 8  # of a cycle in which extremes are looked for, per harmonic


class StageResponse(Checked):
    """Steady vibration of a stage over the mesh frequency; made by `stage_response`.

    Complex amplitudes are those of e^(2 pi j l phase) and twice the Fourier coefficients: their modulus is the
    amplitude of harmonic l = 1 ... n.

    Attributes:
        mesh_frequency: mesh frequencies [Hz], shape (speeds,).
        motion: amplitudes of all coordinates [um], shape (speeds, harmonics, coordinates).
        transmission_error: amplitudes of the rotation of the sun against ring and carrier on its base circle [um],
            shape (speeds, harmonics).
        mesh_force: amplitudes of the force of every planet's mesh with sun and ring [N], shape (speeds, 2, planets,
            harmonics).
        pin_force: amplitudes of the radial and tangential force of every planet on its pin [N], of the same shape; None
            with rigid pins.
        mean_force: mean force of these meshes [N], shape (2, planets).
        names: names of the coordinates.
    """

    mesh_frequency: Speeds = result("Hz")
    motion: Complex[Array, "speeds harmonics coordinates"] = result("um")
    transmission_error: Complex[Array, "speeds harmonics"] = result("um")
    mesh_force: Complex[Array, "speeds 2 planets harmonics"] = result("N")
    pin_force: Complex[Array, "speeds 2 planets harmonics"] | None = result("N")
    mean_force: Float[Array, "2 planets"] = result("N")
    names: tuple[str, ...] = eqx.field(static=True)

    def force(self, points: int | None = None) -> Float[Array, "speeds 2 planets points"]:
        """Force of every mesh over one cycle [N], negative where the flanks would have to pull.

        Args:
            points: points of the cycle; None for eight per harmonic.
        """
        harmonics = self.mesh_force.shape[-1]
        count = _POINTS * harmonics if points is None else whole("points", points, low=2 * harmonics + 1)
        amplitudes = self.mesh_force
        mean = jnp.broadcast_to(self.mean_force.astype(amplitudes.dtype), amplitudes.shape[:-1])
        spectrum = jnp.concatenate([mean[..., None], 0.5 * amplitudes], axis=-1)
        return jnp.fft.irfft(spectrum, count, axis=-1) * count

    @property
    def dynamic_factor(self) -> Speeds:
        """Largest force of a mesh over the mean of all meshes, load sharing of the planets included."""
        return maximum(self.force(), (-3, -2, -1)) / jnp.mean(self.mean_force)

    @property
    def loses_contact(self) -> Bool[Array, " speeds"]:
        """True where a mesh would lose contact: there the linear response does not hold."""
        return minimum(self.force(), (-3, -2, -1)) < 0

    def amplitude(self, name: str) -> Float[Array, "speeds harmonics"]:
        """Amplitudes of a coordinate [um], such as "sun rotation".

        Raises:
            ValueError: for a coordinate that the stage does not have.
        """
        if name not in self.names:
            raise ValueError(f'"{name}" is not a coordinate of the stage, must be one of {", ".join(self.names)}')
        return jnp.abs(self.motion[..., self.names.index(name)])


def stage_response(
    system: StageSystem,
    cycle: StageCycle,
    mesh_frequencies: Given,
    *,
    damping_ratio: Given,
    harmonics: int = 5,
) -> StageResponse:
    """Linear frequency response of a stage to the loaded transmission errors of all its meshes.

    Every mesh is a spring of its mean stiffness k between flanks that are displaced by

        e(phase) = approach(phase) - F(phase) / k

    of the solved stage, each planet at its own phase: at low speed motions and mesh forces are those of the static
    stage. Stiffness that varies with the vibration, loss of contact and the speed of the carrier are left out; what
    needs them asks for `loses_contact`. Damping is that of the springs, 2 D times their stiffness as a loss factor:
    each mode has the damping ratio D at its resonance.

    Args:
        system: masses and springs, with the mean stiffness of the meshes of the cycle.
        cycle: the solved stage.
        mesh_frequencies: mesh frequencies [Hz], shape (speeds,); `mesh_frequency` has that of a speed.
        damping_ratio: damping ratio D of all modes.
        harmonics: number of harmonics of the mesh frequency, less than half of the positions of the cycle.

    Raises:
        ValueError: for numbers outside their ranges.
    """
    positions = cycle.sun_force.shape[-1]
    whole("harmonics", harmonics, low=1, high=(positions - 1) // 2)
    frequencies = real(mesh_frequencies)
    if frequencies.ndim != 1:
        raise ValueError(f"mesh_frequencies has shape {frequencies.shape}, must be a list of numbers")
    check("mesh_frequencies", frequencies, "Hz", low=0.0, open_low=True)
    check("damping_ratio", damping_ratio, "", low=0.0, high=1.0)
    dtype = system.mass.dtype
    curves = jnp.stack([cycle.sun_approach, cycle.ring_approach]), jnp.stack([cycle.sun_force, cycle.ring_force])
    return _response(system, curves, frequencies.astype(dtype), real(damping_ratio).astype(dtype), harmonics)


@program
def _response(
    system: StageSystem,
    curves: tuple[Float[Array, "2 planets positions"], Float[Array, "2 planets positions"]],
    frequencies: Speeds,
    damping_ratio: Scalar,
    harmonics: int,
) -> StageResponse:
    approach, force = curves
    error = approach - force / system.mesh_stiffness[..., None]
    displaced = 2 * jnp.fft.rfft(error, axis=-1)[..., 1 : harmonics + 1] / error.shape[-1]
    # all springs have the same loss factor
    spring = jax.lax.complex(jnp.ones_like(damping_ratio), 2 * damping_ratio)

    def damped(stiffness: Array) -> Array:
        return spring * stiffness.astype(spring.dtype)

    along, mesh_stiffness = system.of_contacts.astype(spring.dtype), damped(system.mesh_stiffness)
    stiffness, mass = damped(system.stiffness), jnp.diag(system.mass / NEWTON).astype(spring.dtype)
    load = jnp.einsum("sic,sil,si->lc", along, displaced, mesh_stiffness)
    orders = jnp.arange(1, harmonics + 1, dtype=frequencies.dtype)
    square = ((2 * jnp.pi * orders[None] * frequencies[:, None]) ** 2).astype(spring.dtype)
    dynamic = stiffness[None, None] - square[..., None, None] * mass[None, None]
    loads = jnp.broadcast_to(load, (*square.shape, load.shape[-1]))
    motion = jax.vmap(jax.vmap(_complex_solution))(dynamic, loads)
    met = jnp.einsum("sic,flc->fsil", along, motion) - displaced[None]
    pins = None
    if system.of_pins is not None:
        moved = jnp.einsum("sic,flc->fsil", system.of_pins.astype(spring.dtype), motion)
        pins = damped(system.pin_stiffness)[None, :, None, None] * moved
    return StageResponse(
        mesh_frequency=frequencies,
        motion=motion,
        transmission_error=motion @ system.of_error.astype(spring.dtype),
        mesh_force=mesh_stiffness[None, ..., None] * met,
        pin_force=pins,
        mean_force=jnp.mean(force, axis=-1),
        names=system.names,
    )


def _complex_solution(
    matrix: Complex[Array, "coordinates coordinates"], right: Complex[Array, " coordinates"]
) -> Complex[Array, " coordinates"]:
    """Solution of complex equations, by their real and imaginary parts."""
    real_part, imaginary = matrix.real, matrix.imag
    both = jnp.block([[real_part, -imaginary], [imaginary, real_part]])
    found = solve_dense(both, jnp.concatenate([right.real, right.imag]))
    return jax.lax.complex(found[: len(right)], found[len(right) :])
