"""Scatter of the transmission error over manufactured gears."""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh as DeviceMesh
from jax.sharding import PartitionSpec
from jaxtyping import Array, Bool, Float

from ..contact import Mesh, removed_material, solve_removed
from ..microgeometry import AbstractModification
from ..numerics import check, real, whole
from .deviation import deviation_field, deviation_of, flank_basis
from .limits import Tolerance, check_slices

Scalar = Float[Array, ""]

_BLOCK = 4096  # samples per call and device, all side by side on an accelerator
_CPU_BATCH = 128  # samples side by side on a CPU, whose arrays then stay in the cache


class Scatter(eqx.Module):
    """Result of `monte_carlo`.

    A sample fails when its contact solution does not converge or is not finite. It stays in every array and counts
    against the design: its `ppte` is NaN, which makes `mean` and `std` NaN, and in every quantile it ranks beyond all
    others, so that bounds can only widen. `scatter.ppte[scatter.converged]` is what is left without them.

    Attributes:
        ppte: peak-to-peak transmission error of every sample [um], shape (samples,).
        converged: bool, shape (samples,).
        nominal_ppte: PPTE of the design without deviations [um].
        mean, std: of `ppte` [um].
        ppte_quantile95: 95 % of the samples stay below it [um].
        phase: mesh position in base pitches, shape (positions,).
        nominal_transmission_error: of the design without deviations [um], shape (positions,).
        quantiles: levels of the quantile curves, ascending, shape (quantiles,).
        transmission_error_quantiles: of the transmission error at every phase [um], shape (quantiles, positions).
    """

    ppte: Float[Array, " samples"]
    converged: Bool[Array, " samples"]
    nominal_ppte: Scalar
    mean: Scalar
    std: Scalar
    ppte_quantile95: Scalar
    phase: Float[Array, " positions"]
    nominal_transmission_error: Float[Array, " positions"]
    quantiles: Float[Array, " quantiles"]
    transmission_error_quantiles: Float[Array, "quantiles positions"]

    @property
    def failed(self) -> int:
        """Number of failed samples."""
        return int(np.sum(~np.asarray(self.converged)))

    @property
    def converged_share(self) -> float:
        """Share of the samples that did not fail."""
        return 1 - self.failed / self.converged.shape[0]

    def __str__(self) -> str:
        return "\n".join(
            [
                f"Scatter of {self.ppte.shape[0]} samples, {self.failed} failed",
                f"  PPTE nominal         {float(self.nominal_ppte):.3f} um",
                f"  PPTE mean            {float(self.mean):.3f} um, standard deviation {float(self.std):.3f} um",
                f"  PPTE 95 % quantile   {float(self.ppte_quantile95):.3f} um",
            ]
        )


def monte_carlo(
    mesh: Mesh,
    torque,
    *,
    tolerance: Tolerance,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
    samples: int = 100_000,
    seed: int = 0,
    quantiles: Sequence[float] = (0.05, 0.25, 0.5, 0.75, 0.95),
) -> Scatter:
    """Scatter of the transmission error of one design over manufactured gears.

    Runs in blocks on all local devices; one compilation serves every tolerance, torque, seed and amount of
    modification. Beyond the blocks it holds one transmission error curve per sample in memory. For gradients, average
    over `sample_deviations` yourself:

        deviations = jg.sample_deviations(tolerance, mesh, 500, seed=0)

        def mean_ppte(amount):
            def one(deviation):
                removed = jg.deviated_material(mesh, torque, deviation, pinion=jg.TipRelief(amount, 4.0))
                return jg.peak_to_peak(jg.solve_removed(mesh, torque, removed).transmission_error)

            return jax.numpy.mean(jax.vmap(one)(deviations))

    Args:
        mesh: prepared mesh.
        torque: on the pinion [N m], scalar.
        tolerance: limits and distribution of the deviations.
        pinion: modification of the pinion flank; None for the nominal involute.
        wheel: modification of the wheel flank; None for the nominal involute.
        samples: how many, at least 2.
        seed: of the random numbers; sample i is that of `sample_deviations` with the same seed.
        quantiles: levels of the transmission error curves, between 0 and 1.

    Raises:
        ValueError: for a torque, a number of samples or a quantile outside its range, or lead deviations on a mesh of
            one slice.
    """
    check("monte_carlo", "torque", torque, "N m", low=0.0)
    levels = np.sort(np.asarray(quantiles, float))
    check("monte_carlo", "quantiles", levels, "", low=0.0, high=1.0)
    whole("monte_carlo", "samples", samples, 2)
    check_slices("monte_carlo", tolerance, mesh)
    task = (mesh, real(torque), tolerance, pinion, wheel, jax.random.key(seed))
    curves, converged = _run(task, samples + 1)
    return _scatter(mesh.phase, curves, converged, levels)


def _run(task, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Transmission errors (count, positions) and success (count,) on the host; number 0 is the nominal design."""
    devices = len(jax.local_devices())
    block = min(_BLOCK, -(-count // devices)) * devices
    parts = []
    for start in range(0, count, block):
        numbers = start + jnp.arange(block)
        parts.append(jax.device_get(_block(task, numbers)))
    curves, converged = (np.concatenate(part)[:count] for part in zip(*parts))
    return curves, converged


@eqx.filter_jit
def _block(task, numbers):
    arrays, rest = eqx.partition(task, eqx.is_array)
    devices = jax.local_devices()

    def run(arrays, numbers):
        return _solve_numbers(eqx.combine(arrays, rest), numbers)

    if len(devices) > 1:
        everywhere, split = PartitionSpec(), PartitionSpec("samples")
        grid = DeviceMesh(np.asarray(devices), ("samples",))
        run = jax.shard_map(run, mesh=grid, in_specs=(everywhere, split), out_specs=split, check_vma=False)
    return run(arrays, numbers)


def _solve_numbers(task, numbers):
    """The samples of the given numbers; the nominal design rides along as number 0, without its own compilation."""
    mesh, torque, tolerance, pinion, wheel, key = task
    design = removed_material(mesh, torque, pinion=pinion, wheel=wheel)
    basis = flank_basis(mesh, torque)

    def one(number):
        deviation = deviation_of(tolerance, mesh, key, number - 1)
        field = deviation_field(deviation, basis)
        cycle = solve_removed(mesh, torque, design + jnp.where(number > 0, field, 0.0))
        return cycle.transmission_error, jnp.all(cycle.converged)

    on_cpu = jax.default_backend() == "cpu"
    return jax.lax.map(one, numbers, batch_size=_CPU_BATCH if on_cpu else numbers.shape[0])


def _scatter(phase, curves: np.ndarray, converged: np.ndarray, levels: np.ndarray) -> Scatter:
    """Statistics of the solved samples, on the host: reductions of the device drop NaN from large arrays."""
    spread = np.ptp(curves, axis=1)
    converged = converged & np.isfinite(curves).all(axis=1)
    nominal, ppte, fine = curves[0], np.where(converged, spread, np.nan)[1:], converged[1:]

    def array(value):
        return jnp.asarray(value, curves.dtype)

    return Scatter(
        ppte=array(ppte),
        converged=jnp.asarray(fine),
        nominal_ppte=array(np.where(converged[0], spread[0], np.nan)),
        mean=array(np.mean(ppte, dtype=float)),
        std=array(np.std(ppte, ddof=1, dtype=float)),
        ppte_quantile95=array(_quantiles(ppte, fine, np.array(0.95))),
        phase=phase,
        nominal_transmission_error=array(nominal),
        quantiles=array(levels),
        transmission_error_quantiles=array(_quantiles(curves[1:], fine, levels)),
    )


def _quantiles(values: np.ndarray, fine: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """Quantiles over the samples of the first axis in which failed ones rank beyond all others, on either side.

    Each is the value of a sample, the outer one of the two at the level: interpolation towards an infinite neighbour
    would give NaN. Shape (levels, ...).
    """
    ordered = np.sort(np.ascontiguousarray(values[fine].T), axis=-1)
    count, failed = ordered.shape[-1], len(values) - ordered.shape[-1]
    place = levels * (len(values) - 1)
    pick = np.where(levels >= 0.5, np.ceil(place), np.floor(place) - failed).astype(int)
    ends = [np.full((*ordered.shape[:-1], 1), end, ordered.dtype) for end in (-np.inf, np.inf)]
    bounded = np.concatenate([ends[0], ordered, ends[1]], axis=-1)
    return bounded[..., np.clip(pick, -1, count) + 1].T
