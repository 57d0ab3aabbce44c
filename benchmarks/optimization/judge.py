"""What a design is worth, whoever found it."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import jaxgear as jg

from .methods import Found
from .tasks import Task

_SEED = 1  # other manufactured gears than those of the robust design
_TORQUES = 2.0 ** np.linspace(-1.0, 1.0, 13)  # relative to the design torque
_DESIGN = 6
_SIDE_BY_SIDE = 16  # contact analyses that advance together


class Verdict(NamedTuple):
    """Attributes:
    ppte: at the design torque [um].
    worst_over_torque: largest PPTE from half to twice the torque [um].
    quantile95: of PPTE over manufactured gears of class 5 at the design torque [um].
    max_pressure: largest contact pressure at the design torque, flanks and tip corners [MPa].
    max_relief: largest material removed from a flank [um].
    """

    ppte: float
    worst_over_torque: float
    quantile95: float
    max_pressure: float
    max_relief: float


class Judge:
    """Judges designs of a task on a mesh of its own, so that none gains by a coarse one."""

    def __init__(self, task: Task, positions: int, gears: int):
        self._mesh = task.mesh(positions)
        self._torques = jnp.asarray(task.torque * _TORQUES)
        samples = jg.ManufacturedGears(task.tolerance, gears, _SEED).on(self._mesh)
        self._deviations = _fields(self._mesh, jnp.asarray(task.torque), samples)

    def __call__(self, found: Found) -> Verdict:
        """Judges a design; a contact solution that fails makes its PPTE infinite."""
        flanks = {"pinion": found.pinion, "wheel": found.wheel}
        each = [jg.contact.removed_material(self._mesh, torque, **flanks) for torque in self._torques]
        removed = jax.tree.map(lambda *fields: jnp.stack(fields), *each)
        relief = jg.metrics.max_relief(self._mesh, **flanks)
        ppte, pressure = (np.asarray(part) for part in _solved(self._mesh, self._torques, removed, self._deviations))
        count = len(_TORQUES)
        # the value of a sample: interpolation towards an infinite neighbour would give NaN
        quantile = np.quantile(ppte[count:], 0.95, method="higher")
        numbers = ppte[_DESIGN], ppte[:count].max(), quantile, pressure[_DESIGN], relief
        return Verdict(*map(float, numbers))


@eqx.filter_jit
def _fields(mesh: jg.Mesh, torque, samples: jg.tolerance.Deviation):
    """Material that the deviations of every sample remove, shape (gears, pairs, slices, positions)."""
    return jax.vmap(lambda one: jg.tolerance.deviated_material(mesh, torque, one).amount)(samples)


@eqx.filter_jit
def _solved(mesh: jg.Mesh, torques, designs, deviations):
    """PPTE and largest pressure at every torque, then of every manufactured gear at the design torque."""
    gears = len(deviations)
    loads = jnp.concatenate([torques, jnp.full((gears,), torques[_DESIGN])])
    deviated = jax.vmap(lambda one: jax.tree.map(lambda field: field[_DESIGN], designs) + one)(deviations)
    removed = jax.tree.map(lambda *fields: jnp.concatenate(fields), designs, deviated)

    def one(case):
        cycle = jg.contact.solve_removed(mesh, *case)
        ppte = jg.peak_to_peak(cycle.transmission_error)
        fine = jnp.all(cycle.converged) & jnp.isfinite(ppte)
        pressure = jnp.max(jnp.maximum(cycle.contact_pressure, cycle.corner_pressure))
        return jnp.where(fine, ppte, jnp.inf), pressure

    return jax.lax.map(one, (loads, removed), batch_size=_SIDE_BY_SIDE)
