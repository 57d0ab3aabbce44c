"""The loads and manufactured gears over which a design is judged."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import Mesh
from ..numerics import check, real, whole
from ..tolerance import Tolerance, sample_deviations
from ..tolerance.deviation import deviation_field, flank_basis
from .load import LoadSpectrum


class Cases(eqx.Module):
    """Torques, and under each of them the same number of manufactured pairs.

    What a deviation removes depends on the mesh and the torque, not on the design: it is worked out once. Every design
    of an optimization meets the same gears (common random numbers), every torque meets others.

    Attributes:
        torque: on the pinion [N m], shape (torques,).
        weight: of every torque, sum 1, shape (torques,).
        removed: material that deviations remove [um], shape (torques, samples, pairs, slices, positions); one sample of
            zeros without deviations.
    """

    torque: Float[Array, " torques"]
    weight: Float[Array, " torques"]
    removed: Float[Array, "torques samples pairs slices positions"]

    @property
    def count(self) -> int:
        """Contact analyses per design."""
        return self.removed.shape[0] * self.removed.shape[1]

    @property
    def weights(self) -> Float[Array, " cases"]:
        """Weight of every case, torques first; sum 1."""
        samples = self.removed.shape[1]
        return jnp.repeat(self.weight / samples, samples)


def cases(
    mesh: Mesh, torque, *, tolerance: Tolerance | None = None, samples: int | None = None, seed: int = 0
) -> Cases:
    """Cases of a torque or a load spectrum.

    Args:
        mesh: prepared mesh.
        torque: on the pinion [N m], or a `LoadSpectrum`.
        tolerance: of manufactured gears; None for perfect ones.
        samples: manufactured pairs per torque.
        seed: of their deviations.

    Raises:
        ValueError: for a negative torque, samples without a tolerance or the other way round, and for lead deviations
            on a mesh of one slice.
    """
    load = torque if isinstance(torque, LoadSpectrum) else None
    if load is None:
        check("minimize", "torque", torque, "N m", low=0.0)
        load = LoadSpectrum.of(real(torque))
    if (tolerance is None) != (samples is None):
        raise ValueError(
            f"minimize: samples = {samples!r} must be given with a tolerance, and a tolerance with samples"
        )
    dtype, size = mesh.phase.dtype, mesh.resolution
    torques, weights = load.torques.astype(dtype), load.weights.astype(dtype)
    count = len(torques)
    if tolerance is None or samples is None:
        removed = jnp.zeros((count, 1, size.pairs, size.slices, size.positions), dtype)
        return Cases(torques, weights, removed)
    whole("minimize", "samples", samples)
    deviations = sample_deviations(tolerance, mesh, count * samples, seed)
    deviations = jax.tree.map(lambda leaf: leaf.reshape(count, samples, *leaf.shape[1:]), deviations)
    return Cases(torques, weights, _removed(mesh, torques, deviations))


@eqx.filter_jit
def _removed(mesh: Mesh, torques, deviations):
    def at(torque, several):
        basis = flank_basis(mesh, torque)
        return jax.vmap(lambda one: deviation_field(one, basis))(several)

    return jax.vmap(at)(torques, deviations)
