"""Analysis of one design under one load, from which quantities are computed."""

from collections.abc import Callable, Hashable, Sequence
from typing import Any, TypeVar

import equinox as eqx
import jax
from jax.extend.core import get_opaque_trace_state
from jaxtyping import Array, Float

from ..contact import Mesh, MeshCycle, OperatingPoint, removed_material
from ..numerics import Checked

_Found = TypeVar("_Found")
Settings = TypeVar("Settings", bound=Checked)


class Analysis:
    """Mesh cycle of a design under a load, with further analyses that are computed on first use and then reused.

    Most quantities need only a mesh cycle. Quantities with further solutions on the mesh, such as vibration and wear,
    need an analysis:

        worst = Dynamics(frequencies, damping_ratio=0.05).quantity("worst_dynamic_factor")
        worst(Analysis(cycle, mesh))

    Make an analysis next to its cycle, inside a function that `jax.jit` or `jax.vmap` traces; it is not a pytree.

    Attributes:
        cycle: solved mesh cycle of the design.
        mesh: prepared mesh of the cycle; None if no quantity needs it.
        shared: settings shared by several quantities, see `share_settings`.
    """

    def __init__(self, cycle: MeshCycle, mesh: Mesh | None = None, shared: Sequence[Checked] = ()) -> None:
        """Make an analysis from a cycle and its mesh.

        Raises:
            ValueError: for a mesh and a cycle with batch axes: use `jax.vmap` over the cycle, so that the mesh is not
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
        """Prepared mesh, for quantities with further solutions.

        Raises:
            ValueError: if the analysis has no mesh.
        """
        if self.mesh is None:
            raise ValueError("needs the prepared mesh besides the cycle, give it Analysis(cycle, mesh)")
        return self.mesh

    @property
    def deviation(self) -> Float[Array, "pairs slices positions"]:
        """Material removed by deviations, in addition to the modifications [um], shape (pairs, slices, positions).

        If the cycle does not contain its modifications, it is the total material removed.

        Raises:
            ValueError: if the analysis has no mesh.
        """
        cycle, mesh = self.cycle, self.prepared_mesh
        removed = removed_material(mesh, cycle.torque, **self.flanks)
        deviation = cycle.gap - mesh.corner_gap - removed.amount
        if cycle.pinion is None or cycle.wheel is None:
            return deviation
        return jax.lax.stop_gradient(deviation)  # of the design it does not depend but by rounding

    def once(self, settings: Checked, what: Hashable, work: Callable[[], _Found]) -> _Found:
        """Result of work(), computed once per settings and name; compilers do not merge equal loops.

        A result computed during one trace is not reused in another trace.

        Args:
            settings: settings that the work depends on, compared by identity.
            what: name of the result.
            work: traceable function that depends on nothing else that changes.
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
