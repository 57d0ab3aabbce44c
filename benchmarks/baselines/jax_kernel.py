"""PPTE of a batch of variants with jaxgear, compiled once and spread over all host devices."""

import numpy as np

from .problem import CROWNING, TORQUE, Problem, plain, prepare


class JaxKernel:
    """Chunks of `batch` variants that stay in the cache, one after the other on each core."""

    def __init__(
        self,
        *,
        positions: int = 64,
        slices: int = 1,
        batch: int = 64,
        gradient: bool = False,
        coupled: bool = False,
        helix_angle: float = 0.0,
    ):
        """Prepares the mesh; compiles nothing of the solution yet."""
        import jax
        import jax.numpy as jnp

        import jaxgear as jg

        def modification(amount, length):
            relief = jg.TipRelief(amount, length, jg.Parabolic())
            return relief + jg.LeadCrowning(CROWNING) if slices > 1 else relief

        def ppte(mesh, variant):
            pinion, wheel = modification(variant[0], variant[1]), modification(variant[2], variant[3])
            cycle = jg.solve(mesh, TORQUE, pinion=pinion, wheel=wheel)
            return jg.peak_to_peak(cycle.transmission_error)

        evaluate = jax.value_and_grad(ppte, argnums=1) if gradient else ppte

        def chunked(mesh, variants):
            return jax.lax.map(lambda variant: evaluate(mesh, variant), variants, batch_size=batch)

        automatic = (jax.sharding.AxisType.Auto,)
        devices = jax.make_mesh((jax.device_count(),), ("variants",), axis_types=automatic)
        split, same = jax.P("variants"), jax.P()
        self._run = jax.jit(
            jax.shard_map(chunked, mesh=devices, in_specs=(same, split), out_specs=split, check_vma=False)
        )
        self._mesh = prepare(positions, slices, coupled=coupled, helix_angle=helix_angle)
        self._dtype = jnp.result_type(float)
        self._multiple = batch * jax.device_count()
        self._gradient = gradient
        self._shape = 0

    @property
    def problem(self) -> Problem:
        """The numbers of the prepared mesh for the baselines."""
        return plain(self._mesh)

    def ppte(self, variants: np.ndarray) -> np.ndarray:
        """Peak-to-peak transmission error [um], shape (variants,)."""
        found = self._evaluate(variants)
        return found[0] if self._gradient else found

    def gradient(self, variants: np.ndarray) -> np.ndarray:
        """Derivatives of PPTE by the four parameters, shape (variants, 4)."""
        return self._evaluate(variants)[1]

    def _evaluate(self, variants: np.ndarray):
        import jax

        count = len(variants)
        # every device gets the same number of whole batches, every call the shape of the largest one so far
        size = self._shape = max(self._shape, -(-count // self._multiple) * self._multiple)
        padded = np.concatenate([variants, np.ones((size - count, 4))]).astype(self._dtype)
        found = self._run(self._mesh, padded)
        return jax.tree.map(lambda x: np.asarray(x)[:count], found)
