"""One design under one load: what quantities are worked out from."""

from collections.abc import Callable, Hashable, Sequence
from typing import Any, TypeVar

import equinox as eqx
import jax
from jax.extend.core import get_opaque_trace_state
from jaxtyping import Array, Float

from ..contact import Mesh, MeshCycle, OperatingPoint, removed_material
from ..numerics import Checked, over_slices

_Found = TypeVar("_Found")
Settings = TypeVar("Settings", bound=Checked)


class Analysis:
    """A design under a load, and what further analyses make of it: each when it is asked for first, and once.

    Quantities take a mesh cycle, which is all that most of them need, or an analysis, which those need that solve
    further on the mesh: of vibration, of worn flanks.

        worst = Dynamics(frequencies, damping_ratio=0.05).quantity("worst_dynamic_factor")
        worst(Analysis(cycle, mesh))

    It is made where a cycle is, inside what `jax.jit` or `jax.vmap` trace, and is no pytree.

    Attributes:
        cycle: the solved mesh cycle of the design.
        mesh: that it was solved on; None where nothing is solved further.
        shared: settings that several quantities have in common, see `share_settings`.
    """

    def __init__(self, cycle: MeshCycle, mesh: Mesh | None = None, shared: Sequence[Checked] = ()) -> None:
        """Takes a cycle and the mesh that it was solved on.

        Raises:
            ValueError: for a cycle with batch axes beside a mesh: map over it with `jax.vmap`, so that the mesh is not
                repeated.
        """
        if cycle.batch_ndim and mesh is not None:
            use = "jax.vmap(lambda cycle: quantity(Analysis(cycle, mesh)))"
            raise ValueError(f"Analysis: the cycle has batch axes, use {use}")
        self.cycle, self.mesh, self.shared = cycle, mesh, tuple(shared)
        self._found: list[tuple[Any, Any, Any, Any]] = []

    @property
    def operating_point(self) -> OperatingPoint:
        """Torque, speed and friction of the cycle."""
        return self.cycle.operating_point

    @property
    def flanks(self) -> dict[str, Any]:
        """Modifications of pinion and wheel, by these names."""
        return {"pinion": self.cycle.pinion, "wheel": self.cycle.wheel}

    @property
    def prepared_mesh(self) -> Mesh:
        """The mesh, for a quantity that solves further on it.

        Raises:
            ValueError: where there is none.
        """
        if self.mesh is None:
            raise ValueError("needs the prepared mesh besides the cycle, give it Analysis(cycle, mesh)")
        return self.mesh

    @property
    def deviation(self) -> Float[Array, "pairs slices positions"]:
        """Material that deviations have removed from the gears, besides their modifications [um].

        Of a cycle whose modifications are not known it is all that was removed.

        Raises:
            ValueError: where there is no mesh.
        """
        cycle, mesh = self.cycle, self.prepared_mesh
        removed = removed_material(mesh, cycle.torque, **self.flanks)
        deviation = cycle.gap - over_slices(mesh.corner_gap) - removed.amount
        if cycle.pinion is None or cycle.wheel is None:
            return deviation
        return jax.lax.stop_gradient(deviation)  # of the design it does not depend but by rounding

    def once(self, settings: Checked, what: Hashable, work: Callable[[], _Found]) -> _Found:
        """work(), or what it gave before for the same settings: compilers do not find out that two loops do the same.

        What was found while one function was being traced is not for another one.

        Args:
            settings: the very object that the work depends on.
            what: is worked out with them, by name.
            work: traceable; nothing else that changes may be in it.
        """
        now = get_opaque_trace_state()
        for trace, known, name, found in self._found:
            if trace == now and known is settings and name == what:
                return found
        found = work()
        self._found.append((now, settings, what, found))
        return found

    def in_precision(self, settings: Settings) -> Settings:
        """Settings with their numbers in the precision of the cycle."""
        dtype = self.cycle.transmission_error.dtype

        def cast(leaf: Any) -> Any:
            return leaf.astype(dtype) if eqx.is_inexact_array(leaf) else leaf

        return self.once(settings, "settings", lambda: jax.tree.map(cast, settings))
