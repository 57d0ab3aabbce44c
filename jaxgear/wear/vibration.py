"""Mesh forces of the steady vibration on worn flanks."""

from typing import Any, Literal, get_args

import equinox as eqx
import jax
from jaxtyping import Array, Float

from ..contact import Mesh, OperatingPoint
from ..contact.mesh import resized
from ..dynamics import Dynamics, mesh_frequency, steps_for
from ..dynamics.from_contact import interpolated
from ..dynamics.steady import SteadyForce
from ..microgeometry import AbstractModification
from ..numerics import check
from ..numerics.programs import is_eager

LineLoad = Literal["static", "dynamic"]
Flanks = dict[str, AbstractModification]  # of pinion and wheel
Deviation = Float[Array, "pairs slices positions"]


class Vibration(eqx.Module):
    """Vibrating system of a mesh that wears.

    Attributes:
        settings: masses, damping and settings of the mesh force; the speeds are not used.
        mesh: mesh prepared at the positions of the mesh force.
        coast: modifications of the coast flanks of (pinion, wheel), which do not wear.
        deviation: material removed from the drive flanks by manufacturing deviations at the positions of `mesh` [um];
            None for nominal gears.
        steps: steps of the integrator per mesh cycle.
        wears: True if the flanks wear under the forces of the motion.
    """

    settings: Dynamics
    mesh: Mesh
    coast: tuple[AbstractModification, AbstractModification]
    deviation: Deviation | None
    steps: int = eqx.field(static=True)
    wears: bool = eqx.field(static=True)

    def force(self, flanks: Flanks, load: OperatingPoint, phase: Float[Array, " positions"]) -> SteadyForce:
        """Mesh force of the steady motion that starts at rest [N], at mesh positions [base pitches]."""
        assert load.speed is not None  # `vibration_of` has asked for it
        more: dict[str, Any] = {"coast": self.coast, "deviation": self.deviation}
        oscillator, _ = self.settings.oscillator_and_mesh(self.mesh, load.torque, **flanks, **more)
        frequency = mesh_frequency(self.mesh.pair.pinion.teeth, load.speed)
        return self.settings.force(oscillator, frequency, phase, self.steps)


def vibration_of(
    mesh: Mesh,
    loads: OperatingPoint,
    settings: Dynamics | None,
    line_load: LineLoad | None,
    flanks: Flanks,
    deviation: Deviation | None,
) -> Vibration | None:
    """Vibrating system of a wear analysis; None without dynamics.

    With concrete numbers the numbers of pairs of the mesh and of steps of the integrator follow from the new flanks.

    Args:
        mesh: prepared mesh.
        loads: operating points with a leading axis (torques,).
        settings, line_load: as for `wear`.
        flanks: modifications of the new flanks.
        deviation: material removed by manufacturing deviations [um], in addition to the modifications.

    Raises:
        TypeError: if settings are not `Dynamics`.
        ValueError: for a dynamic load without dynamics, an unknown `line_load`, loads without a speed, with zero speed
            or with zero torque, and for all errors of `mesh_force`.
    """
    check_line_load(line_load, settings)
    if settings is None:
        return None
    if loads.speed is None:
        raise ValueError("dynamics needs a speed: give OperatingPoint(torque, speed), or speeds of the spectrum")
    check("speed with dynamics", loads.speed, "rpm", low=0.0, open_low=True)
    check("torque with dynamics", loads.torque, "N m", low=0.0, open_low=True)
    numbers, rest = eqx.partition(settings, eqx.is_array)
    settings = eqx.combine(jax.tree.map(lambda number: number.astype(loads.torque.dtype), numbers), rest)
    coast, steps = (flanks["pinion"], flanks["wheel"]), settings.traced_steps
    fine = resized(mesh, positions=settings.positions)
    given = mesh, loads, settings, flanks, deviation
    if is_eager() and not any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(given)):
        counts: list[int] = []
        for number in range(len(loads.torque)):
            torque, speed = loads.torque[number], loads.speed[number]
            off = None if deviation is None else interpolated(deviation, mesh, fine)
            oscillator, fine = settings.oscillator_and_mesh(fine, torque, **flanks, coast=coast, deviation=off)
            counts += steps_for(oscillator, mesh_frequency(mesh.pair.pinion.teeth, speed)[None])
        steps = max(counts) if settings.steps is None else settings.steps
    off = None if deviation is None else interpolated(deviation, mesh, fine)
    return Vibration(settings, fine, coast, off, steps, line_load != "static")


def check_line_load(line_load: object, dynamics: object) -> None:
    """Check `line_load` and `dynamics` of a wear analysis.

    Raises:
        TypeError: if dynamics are not `Dynamics`.
        ValueError: for an unknown `line_load`, and for a dynamic load without dynamics.
    """
    if line_load not in (None, *get_args(LineLoad)):
        raise ValueError(f'line_load = {line_load!r} must be "static" or "dynamic"')
    if dynamics is None and line_load == "dynamic":
        raise ValueError('line_load = "dynamic" needs dynamics: give jaxgear.dynamics.Dynamics(...)')
    if dynamics is not None and not isinstance(dynamics, Dynamics):
        raise TypeError(f"dynamics is of type {type(dynamics).__name__}, must be Dynamics")
