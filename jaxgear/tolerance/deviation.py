"""Random deviations between tolerance limits, and the material they remove at the contacts of a mesh."""

from collections.abc import Iterator
from functools import cache
from types import ModuleType
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int, PRNGKeyArray

from ..contact import Mesh, RemovedMaterial, removed_material
from ..contact.operating_point import Torque, operating_point_of
from ..contact.slide import nominal_material
from ..microgeometry import AbstractModification, Flank, LeadSlope, NoModification, ProfileSlope
from ..numerics import Checked, number, program, real, result, spread
from ..numerics.fields import count
from .limits import AbstractDistribution, GearTolerance, Tolerance, check_slices

Real = Float[Array, "*samples"]
Load = Float[Array, "pairs slices positions"]

# Whole waves over the active profile. Shorter ones are smoothed away by the width of the contact.
HARMONICS = 4
_SHAPE_POINTS = 129  # at which the height of a waviness is taken: 32 per shortest wave, 0.5 % of it at most


class GearDeviation(Checked):
    """Deviations of one gear, positive for missing material; a leading axis for several samples.

    Attributes:
        profile_slope: profile slope deviation, as the amount of `ProfileSlope` [um], shape (*samples,).
        waviness: coefficients of the profile form deviation [um], shape (*samples, 2 * HARMONICS); see `Waviness`.
        pitch: displacement of the tooth of every pair [um], shape (*samples, pairs).
        helix_slope: helix slope deviation over the face of the gear, as the amount of `LeadSlope` [um], shape
            (*samples,).
    """

    profile_slope: Real = result("um")
    waviness: Float[Array, "*samples waves"] = result("um")
    pitch: Float[Array, "*samples pairs"] = result("um")
    helix_slope: Real = result("um")


class Deviation(Checked):
    """Deviations of a gear pair, made by `ManufacturedGears`; a leading axis for several samples.

    Attributes:
        pinion, wheel: deviations of the two gears.
        misalignment: lead slope of the contact of all pairs over the common face width, shape (*samples,).
    """

    pinion: GearDeviation
    wheel: GearDeviation
    misalignment: Real = result("um")


class Waviness(AbstractModification):
    """Profile form deviation: waves over the active profile without mean and without slope.

    w = sum_k c_k cos(2 pi k x) + s_k (sin(2 pi k x) + 6 / (pi k) (x - 1/2)), x from 0 at the start of the active
    profile to 1 at the tip. The straight line makes the sine waves orthogonal to the mean profile line: a least-squares
    slope through sin(2 pi k x) is -6 / (pi k).

    Attributes:
        coefficients: c_1 ... c_n, s_1 ... s_n, shape (2 n,).
    """

    coefficients: Float[Array, " waves"] = number("um", shape=("waves",))

    varies_along_face = False

    def __call__(self, flank: Flank) -> Float[Array, "..."]:
        x = (flank.roll_length - flank.start_roll_length) / (flank.tip_roll_length - flank.start_roll_length)
        x = jnp.clip(x, 0.0, 1.0)
        waves = _waves(x[..., None], self.coefficients.shape[0] // 2, jnp)
        return jnp.sum(waves * self.coefficients.astype(waves.dtype).reshape((1,) * x.ndim + (-1,)), axis=-1)


class ManufacturedGears(Checked):
    """Random manufactured gear pairs within a tolerance, for the evaluation of designs.

    Sample i depends only on the seed and on i, not on the number of samples, and is a smooth function of the limits:
    the same seed gives common random numbers for all designs and tolerances.

    Attributes:
        tolerance: limits and distribution of the deviations.
        samples: number of pairs.
        seed: seed of the deviations.
    """

    tolerance: Tolerance
    samples: int = count(default=64)
    seed: int = count(low=0, default=0)

    def on(self, mesh: Mesh) -> Deviation:
        """Random deviations of all pairs, with a leading axis (samples,).

        Args:
            mesh: prepared mesh, of which only the number of pairs and the floating-point type are used.

        Raises:
            ValueError: for lead deviations on a mesh of one slice.
        """
        check_slices(self.tolerance, mesh)
        return _sampled(self.tolerance, mesh, jax.random.key(self.seed), self.samples)


@program
def _sampled(tolerance: Tolerance, mesh: Mesh, key: PRNGKeyArray, samples: int) -> Deviation:
    return jax.vmap(lambda number: deviation_of(tolerance, mesh, key, number))(jnp.arange(samples))


def deviation_of(tolerance: Tolerance, mesh: Mesh, key: PRNGKeyArray, number: int | Int[Array, ""]) -> Deviation:
    """Random deviation of the sample with a given number."""
    pinion, wheel, shafts = jax.random.split(jax.random.fold_in(key, number), 3)
    draw, dtype = tolerance.distribution, mesh.slice_width.dtype
    return Deviation(
        pinion=_gear_deviation(tolerance.pinion, draw, mesh, pinion),
        wheel=_gear_deviation(tolerance.wheel, draw, mesh, wheel),
        misalignment=_within(tolerance.misalignment, draw(shafts, (), dtype)),
    )


@program
def deviated_material(
    mesh: Mesh,
    torque: Torque,
    deviation: Deviation,
    *,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
) -> RemovedMaterial:
    """Material removed from both flanks of one manufactured pair, for `solve_removed`: design plus deviations.

    It is differentiable with respect to design and deviation, and so to the tolerance limits.

    Args:
        mesh: prepared mesh.
        torque: torque on the pinion [N m], shape ().
        deviation: one sample; use `jax.vmap` for several, which then share all computations on the mesh.
        pinion: modification of the pinion flank; None for the nominal involute.
        wheel: modification of the wheel flank; None for the nominal involute.

    Returns:
        the material removed by the design, with the deviations added to its amount.
    """
    design = removed_material(mesh, torque, pinion=pinion, wheel=wheel)
    return design + deviation_field(deviation, flank_basis(mesh, torque))


def deviation_field(deviation: Deviation, basis: Float[Array, "terms pairs slices positions"]) -> Load:
    """Material removed by the deviations of one sample [um], shape (pairs, slices, positions), from `flank_basis`."""
    pitch = deviation.pinion.pitch + deviation.wheel.pitch
    return jnp.tensordot(_coefficients(deviation), basis, 1) + pitch[:, None, None]


def flank_basis(mesh: Mesh, torque: Torque) -> Float[Array, "terms pairs slices positions"]:
    """Material removed per unit of every flank deviation [um/um], shape (terms, pairs, slices, positions).

    It is evaluated at the nominal contact points, so that samples differ only by their coefficients: the contact shift
    includes the slopes of the design, but not of the deviations.
    """
    unit = real(1.0).astype(mesh.slice_width.dtype)
    waves = jnp.eye(2 * HARMONICS, dtype=mesh.slice_width.dtype)

    def removed(side: str, modification: AbstractModification) -> Load:
        flanks = {"pinion": NoModification(), "wheel": NoModification(), side: modification}
        return nominal_material(mesh, operating_point_of(torque, mesh.slice_width.dtype).torque, **flanks)

    def terms(side: str) -> Iterator[Array]:
        yield removed(side, ProfileSlope(unit))[None]
        yield jax.vmap(lambda row: removed(side, Waviness(row)))(waves)

    profiles = [*terms("pinion"), *terms("wheel")]
    if mesh.resolution.slices > 1:
        leads = [removed(side, LeadSlope(unit)) for side in ("pinion", "wheel")]
        across = mesh.face_coordinate / mesh.pair.face_width
        leads.append(jnp.broadcast_to(across[None, :, None], leads[0].shape))
    else:  # without lead deviations, see `check_slices`
        leads = [jnp.zeros_like(profiles[0][0])] * 3
    return jnp.concatenate([*profiles, jnp.stack(leads)])


def _coefficients(deviation: Deviation) -> Float[Array, " terms"]:
    """Coefficients of the deviation in the order of `flank_basis`."""
    pinion, wheel = deviation.pinion, deviation.wheel
    profiles = [part for gear in (pinion, wheel) for part in (gear.profile_slope[None], gear.waviness)]
    leads = jnp.stack([pinion.helix_slope, wheel.helix_slope, deviation.misalignment])
    return jnp.concatenate([*profiles, leads])


def _gear_deviation(limits: GearTolerance, draw: AbstractDistribution, mesh: Mesh, key: PRNGKeyArray) -> GearDeviation:
    slope, height, shape, pitch, helix = jax.random.split(key, 5)
    dtype = mesh.slice_width.dtype
    return GearDeviation(
        profile_slope=_within(limits.profile_slope, draw(slope, (), dtype)),
        waviness=_within(limits.profile_form, draw(height, (), dtype)) * _random_shape(shape, dtype),
        pitch=_within(0.5 * limits.pitch, draw(pitch, (mesh.resolution.chosen_pairs,), dtype)),
        helix_slope=_within(limits.helix_slope, draw(helix, (), dtype)),
    )


def _within(limit: Array | None, draws: Array) -> Array:
    return jnp.zeros_like(draws) if limit is None else limit.astype(draws.dtype) * draws


def _random_shape(key: PRNGKeyArray, dtype: np.dtype) -> Float[Array, " waves"]:
    """Coefficients of a waviness of unit height from peak to valley: random phases, amplitudes falling as 1 / k."""
    angle = jax.random.uniform(key, (HARMONICS,), dtype, 0.0, 2 * np.pi)
    order = jnp.arange(1, HARMONICS + 1, dtype=dtype)
    shape = jnp.concatenate([jnp.cos(angle) / order, jnp.sin(angle) / order])
    heights = jnp.asarray(_grid(), dtype) @ shape
    return shape / spread(heights)


@cache
def _grid() -> np.ndarray:
    return _waves(np.linspace(0.0, 1.0, _SHAPE_POINTS)[:, None], HARMONICS, np)


def _waves(x: Any, count: int, xp: ModuleType) -> Any:
    """Cosine and sine waves of `Waviness` at x of shape (..., 1), with jnp or np as xp; shape (..., 2 * count)."""
    order = xp.arange(1, count + 1, dtype=x.dtype).reshape((1,) * (x.ndim - 1) + (-1,))
    angle = 2 * np.pi * order * x
    return xp.concatenate([xp.cos(angle), xp.sin(angle) + 6 / (np.pi * order) * (x - 0.5)], axis=-1)
