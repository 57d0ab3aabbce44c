"""Evaluation of designs over the torques of a design file, by one compiled program for all of them."""

import time
from dataclasses import dataclass, field, replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..contact import Mesh, MeshCycle, removed_material, solve_removed
from ..metrics import flash_temperature, summary
from ..microgeometry import AbstractModification

Metrics = dict[str, float | bool]

_SURFACE_REACH, _SURFACE_TORQUES = 2.0, 21


@dataclass(frozen=True)
class Evaluation:
    """One design.

    Attributes:
        pinion, wheel: its modifications.
        cycle: mesh cycle at the design torque.
        metrics: numbers at the design torque, by name and unit.
        transmission_error: over the torques, shape (torques, positions) [um].
        ppte: peak-to-peak transmission error over the torques [um].
        objectives: what an optimization made small, by name and unit, of this design; empty without one.
        failed_torques: torques without a converged contact solution [N m], the design torque included.
        seconds: what finding and evaluating it took, without compilation [s].
    """

    pinion: AbstractModification
    wheel: AbstractModification
    cycle: MeshCycle
    metrics: Metrics
    transmission_error: np.ndarray
    ppte: np.ndarray
    failed_torques: list[float]
    seconds: float
    objectives: dict[str, float] = field(default_factory=dict)


class Evaluator:
    """Evaluates designs of one mesh at the design torque and over a range of torques.

    The contact solution takes the material removed in the contacts, not the modifications: it is compiled once for
    every kind of design.
    """

    def __init__(self, mesh: Mesh, torque: float, torques: np.ndarray, speed: float | None, friction: float | None):
        self._mesh = mesh
        self._torques = np.concatenate([[torque], torques])
        self._heat = tuple(None if value is None else jnp.asarray(value) for value in (speed, friction))

    def __call__(self, pinion: AbstractModification, wheel: AbstractModification) -> Evaluation:
        """Evaluates one design."""
        removed = self._removed(self._torques, pinion, wheel)
        cycle = self._solve(removed, 0)  # compiles, where it has to
        metrics = jax.tree.map(np.asarray, _numbers(cycle, *self._heat))
        began = time.perf_counter()
        cycles = [self._solve(removed, index) for index in range(len(self._torques))]
        curves = np.asarray([cycle.transmission_error for cycle in cycles])
        converged = np.asarray([cycle.converged for cycle in cycles]) & np.isfinite(curves)
        seconds = time.perf_counter() - began
        return Evaluation(
            pinion=pinion,
            wheel=wheel,
            cycle=replace(cycle, pinion=pinion, wheel=wheel),
            metrics={name: value.item() for name, value in metrics.items()},
            transmission_error=curves[1:],
            ppte=np.ptp(curves[1:], axis=1),
            failed_torques=sorted({float(torque) for torque in self._torques[~converged.all(axis=1)]}),
            seconds=seconds,
        )

    def response_surface(self, pinion: AbstractModification, wheel: AbstractModification):
        """Transmission error from zero load to twice the design torque.

        Returns:
            the torques [N m], shape (torques,), and the transmission error [um], shape (torques, positions).
        """
        torques = np.linspace(0.0, _SURFACE_REACH * self._torques[0], _SURFACE_TORQUES)
        removed = self._removed(torques, pinion, wheel)
        cycles = [solve_removed(self._mesh, float(t), jnp.asarray(r)) for t, r in zip(torques, removed)]
        return torques, np.asarray([cycle.transmission_error for cycle in cycles])

    def _removed(self, torques: np.ndarray, pinion: AbstractModification, wheel: AbstractModification):
        """Material removed from both flanks [um], (torques, pairs, slices, positions)."""
        return np.asarray(
            [removed_material(self._mesh, torque, pinion=pinion, wheel=wheel) for torque in jnp.asarray(torques)]
        )

    def _solve(self, removed: np.ndarray, index: int) -> MeshCycle:
        return solve_removed(self._mesh, float(self._torques[index]), jnp.asarray(removed[index]))


@eqx.filter_jit
def _numbers(cycle: MeshCycle, speed, friction):
    """The numbers of a cycle, with the flash temperature where there is a speed [rpm]."""
    values = summary(cycle)
    if speed is not None:
        options = {} if friction is None else {"friction": friction}
        values["max_flash_temperature_K"] = jnp.max(flash_temperature(cycle, speed, **options))
    return values
