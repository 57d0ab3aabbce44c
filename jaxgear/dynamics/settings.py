"""Settings of dynamics: speeds, masses, damping; and the quantities of steady vibration.

A quantity of dynamics needs speeds, masses and damping besides its name: `Dynamics.quantity` supplies them in Python,
the table [dynamics] in a design file.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..contact import Mesh
from ..geometry import GearPair
from ..metrics import AbstractSettings, Analysis, Quantity, Vocabulary
from ..microgeometry import AbstractModification
from ..numerics import Given, concrete, count, number
from ..numerics.reductions import Max
from .force import AbstractMeshForce
from .from_contact import Model, force_and_mesh
from .oscillator import Oscillator
from .response import SpeedResponse
from .runs import Run, design_runs, speed_runs, with_like_kicks
from .speed_sweep import MOST_KICK, speed_sweep
from .steady import SteadyForce, SteadyNumbers, differentiable, steady_force
from .systems import DIRECTIONS, inertia_of, on_bearings, torsional

Scalar = Float[Array, ""]
Bearing = Float[Array, " directions"]

UP, DOWN, KICKED = "up", "down", "down, kicked"

# Of the critical damping, where nothing is said: gears with splash lubrication have 0.03 to 0.1.
DAMPING_RATIO = 0.05
# Dynamic factors with which flanks thrown apart come to orbits of two mesh cycles, where there are any. An orbit is met
# by kicks somewhat smaller than its own factor, which falls from about 4 at 1.35 times the natural frequency to 2.5 at
# twice of it; near the fold where it ends the window is 0.3 wide and lies between 2.1 and 4.
KICKS = (2.5, 3.0, 3.7)
_AXES = ("directions",)  # along and across, and axial
# Steps of a mesh cycle while its natural frequency is not known, since it is traced: 64 of its periods for one at four
# times the mesh frequency.
_STEPS = 256


class Dynamics(AbstractSettings):
    """Settings of dynamics: speeds, masses and damping.

    `quantity` returns the quantities of the vibration, `DYNAMIC_QUANTITIES`: "dynamic_factor", "dte_rms",
    "contact_loss_share" or "back_side_contact" at the speed of the operating point, the worse of the motions from rest
    and from a kick; with the prefix "worst_" the worst of all runs and speeds. The first two are differentiable if the
    steady state is an orbit of up to four mesh cycles; otherwise their derivative is zero.

    Attributes:
        mesh_frequencies: increasing mesh frequencies, shape (speeds,).
        damping_ratio: damping ratio of the DTE, relative to the critical damping at the mean stiffness; default 0.05 if
            `damping` is not given either.
        damping: viscous damping of the DTE, in place of the ratio.
        pinion_inertia: polar moment of inertia of the pinion and the parts that turn with it; by default that of the
            gear body.
        wheel_inertia: polar moment of inertia of the wheel and the parts that turn with it; by default that of the gear
            body.
        compliance: compliance of the parts between the teeth and the inertias, in series with the mesh.
        pinion_bearing: stiffness of the support of the pinion along and across the line of action, optionally with a
            third value along the axis (rigid by default); rigid if not given. Both gears need the same number of
            directions.
        wheel_bearing: stiffness of the support of the wheel, as for `pinion_bearing`.
        pinion_bearing_damping: viscous damping of the support of the pinion in the directions of its stiffness; zero by
            default.
        wheel_bearing_damping: viscous damping of the support of the wheel, as for `pinion_bearing_damping`.
        model: model of the mesh force.
        positions: number of mesh positions of the force, which is linear between them.
        kick: dynamic factor at the start of a second run from the highest speed down, in place of `kicks`; 1 for no
            second run.
        steps: integrator steps per mesh cycle; by default chosen by the natural frequency.
        kicks: dynamic factors of starts with separated flanks, tried at every speed of a second run down to find orbits
            that are not connected with others; the run continues with the orbit of the largest dynamic factor. Default
            2.5, 3 and 3.7 if `kick` is not given either.
    """

    table = "dynamics"
    mesh_frequencies: Float[Array, " speeds"] = number("Hz", low=0.0, open_low=True, shape=("speeds",))
    damping_ratio: Scalar | None = number("", low=0.0, high=1.0, optional=True, default=None)
    damping: Scalar | None = number("N s/um", low=0.0, optional=True, default=None)
    pinion_inertia: Scalar | None = number("kg m2", low=0.0, open_low=True, optional=True, default=None)
    wheel_inertia: Scalar | None = number("kg m2", low=0.0, open_low=True, optional=True, default=None)
    compliance: Scalar = number("um/N", low=0.0, default=0.0)
    pinion_bearing: Bearing | None = number("N/um", low=0.0, open_low=True, shape=_AXES, optional=True, default=None)
    wheel_bearing: Bearing | None = number("N/um", low=0.0, open_low=True, shape=_AXES, optional=True, default=None)
    pinion_bearing_damping: Bearing | None = number("N s/um", low=0.0, shape=_AXES, optional=True, default=None)
    wheel_bearing_damping: Bearing | None = number("N s/um", low=0.0, shape=_AXES, optional=True, default=None)
    model: Model = "map"
    positions: int = count(low=16, high=4096, default=128)
    kick: float | None = number("", low=1.0, high=MOST_KICK, optional=True, static=True, default=None)
    steps: int | None = count(low=32, high=65_536, optional=True, default=None)
    kicks: Float[Array, " kicks"] | None = number(
        "", low=1.0, high=MOST_KICK, shape=("kicks",), optional=True, default=None
    )

    def check_together(self) -> None:
        if self.damping_ratio is not None and self.damping is not None:
            raise ValueError("Dynamics: damping_ratio and damping are both given, must be one of them")
        if self.kick is not None and self.kicks is not None:
            raise ValueError("Dynamics: kick and kicks are both given, must be one of them")
        supports: Any = (self.pinion_bearing, self.wheel_bearing)
        if (supports[0] is None) != (supports[1] is None):
            raise ValueError("Dynamics: pinion_bearing and wheel_bearing must both be given, or none")
        for name in ("pinion_bearing", "wheel_bearing"):
            if getattr(self, f"{name}_damping") is not None and supports[0] is None:
                raise ValueError(f"Dynamics: {name}_damping has no effect without pinion_bearing and wheel_bearing")
            for of in (name, f"{name}_damping"):
                given = getattr(self, of)
                if given is not None and len(given) not in DIRECTIONS:
                    raise ValueError(
                        f"Dynamics: {of} has {len(given)} numbers, must be two: along and across, or three with axial"
                    )
                if given is not None and given.shape != supports[0].shape:
                    count = len(supports[0])
                    raise ValueError(f"Dynamics: {of} has {len(given)} numbers, must be {count} as pinion_bearing")
        known = concrete(self.mesh_frequencies)
        if known is not None and (known[1:] <= known[:-1]).any():
            raise ValueError("Dynamics: mesh_frequencies must increase")

    def oscillator(
        self,
        mesh: Mesh,
        torque: Given,
        *,
        pinion: AbstractModification | None = None,
        wheel: AbstractModification | None = None,
    ) -> Oscillator:
        """Oscillator with the dynamic transmission error as coordinate, and with the gear centres if bearings are
        given.

        Args:
            mesh: prepared mesh.
            torque: torque on the pinion [N m].
            pinion: modification of the pinion flank; None for the nominal involute.
            wheel: modification of the wheel flank; None for the nominal involute.

        Raises:
            TypeError, ValueError: as `mesh_force`, `torsional` and `on_bearings`.
        """
        return self._oscillator(mesh, torque, pinion=pinion, wheel=wheel)

    def _oscillator(self, mesh: Mesh, torque: Any, **flanks: Any) -> Oscillator:
        return self.oscillator_and_mesh(mesh, torque, **flanks)[0]

    def oscillator_and_mesh(self, mesh: Mesh, torque: Given, **flanks: Any) -> tuple[Oscillator, Mesh]:
        """Oscillator with optional coast flanks and manufacturing deviations, and the mesh of its mesh force."""
        options: dict[str, Any] = {"model": self.model, "compliance": self.compliance, "positions": self.positions}
        force, mesh = force_and_mesh(mesh, torque=torque, **options, **flanks)
        return self.masses(force, mesh.pair, torque), mesh

    def masses(self, force: AbstractMeshForce, pair: GearPair, torque: Given) -> Oscillator:
        """Oscillator of a pair with any mesh force, under a torque on the pinion [N m]."""
        given = (pair.pinion, self.pinion_inertia), (pair.wheel, self.wheel_inertia)
        inertias = tuple(inertia_of(gear) if inertia is None else inertia for gear, inertia in given)
        ratio = DAMPING_RATIO if self.damping_ratio is None and self.damping is None else self.damping_ratio
        options: dict[str, Any] = {"damping": self.damping} if ratio is None else {"damping_ratio": ratio}
        options |= {"pair": pair, "torque": torque, "inertias": inertias}
        if self.pinion_bearing is None or self.wheel_bearing is None:
            return torsional(force, **options)
        nothing = jnp.zeros_like(self.pinion_bearing)
        damping = [nothing if of is None else of for of in (self.pinion_bearing_damping, self.wheel_bearing_damping)]
        return on_bearings(
            force,
            bearing_stiffness=jax.vmap(jnp.diag)(jnp.stack([self.pinion_bearing, self.wheel_bearing])),
            bearing_damping=jax.vmap(jnp.diag)(jnp.stack(damping)),
            **options,
        )

    @property
    def run_names(self) -> tuple[str, ...]:
        """Names of the runs through the speeds: rising, falling, and falling with kicks."""
        falling = (DOWN,) if len(self.mesh_frequencies) > 1 else ()  # at one speed it is the rising run
        return UP, *falling, *((KICKED,) if self.kick is None or self.kick > 1 else ())

    def run(self, oscillator: Oscillator, name: str, *, steps: Sequence[int] | int | None = None) -> SpeedResponse:
        """Steady states of one run through the speeds.

        Args:
            oscillator: the oscillator.
            name: name of the run, one of `run_names`.
            steps: steps of the integrator per mesh cycle, one number or one for each speed; None for the field `steps`.
        """
        steps = self.steps if steps is None else steps
        run = with_like_kicks(self._runs)[name]  # so that one program does all of them
        return speed_sweep(oscillator, self.mesh_frequencies, steps=steps, **run._asdict())

    @property
    def _runs(self) -> dict[str, Run]:
        kicks = () if self.kick is not None else KICKS if self.kicks is None else self.kicks
        ways = {UP: Run("up"), DOWN: Run("down"), KICKED: Run("down", self.kick, kicks)}
        return {name: ways[name] for name in self.run_names}

    def kicks_of(self, name: str) -> Sequence[float] | jax.Array:
        """Dynamic factors of the kicks at every speed of one of `run_names`."""
        return self._runs[name].kicks

    def runs(self, oscillator: Oscillator) -> dict[str, SpeedResponse]:
        """Steady states of all runs, by the name of the run."""
        return speed_runs(oscillator, self.mesh_frequencies, self._runs, steps=self.steps)

    def runs_of(
        self,
        make: Callable[[Any], Oscillator],
        designs: Any,
        *,
        steps: Sequence[int] | int | None = None,
        keep: Callable[[dict[str, SpeedResponse]], Any] | None = None,
        batch: int | None = None,
    ) -> Any:
        """Steady states of all runs of many designs and torques, in one program.

        Mesh forces are made batch by batch: apart from the returned values, the memory does not grow with the number
        of designs:

            def make(design):
                relief = TipRelief(design["amount"], design["length"])
                return settings.oscillator(mesh, design["torque"], pinion=relief, wheel=relief)

            worst = settings.runs_of(make, designs, keep=lambda runs: jnp.max(runs["up"].dynamic_factor))

        Args:
            make: function that returns the oscillator of one design; traced. The program is compiled once per function.
            designs: array or tree of arrays with a leading axis (designs,).
            steps: steps of the integrator per mesh cycle, one number or one for each speed, for instance by `steps_for`
                of the stiffest design; None for the field `steps`, or 256.
            keep: function of the runs of one design that returns the values to keep, a tree of arrays; traced. None to
                keep all responses.
            batch: number of designs per batch on a device; None for the default of the device.

        Returns:
            the kept values with a leading axis (designs,). For a design whose contacts have not converged, values are
            NaN, and no speed has converged.

        Raises:
            ValueError: for designs without a common leading axis, and steps out of their range.
        """
        steps = self.traced_steps if steps is None else steps
        options: dict[str, Any] = {"steps": steps, "keep": keep, "batch": batch}
        return design_runs(make, designs, self.mesh_frequencies, self._runs, **options)

    @property
    def traced_steps(self) -> int:
        """Steps of the integrator per mesh cycle for a traced oscillator: the field `steps`, or 256."""
        return _STEPS if self.steps is None else self.steps

    def force(
        self, oscillator: Oscillator, mesh_frequency: Scalar, phase: Float[Array, " positions"], steps: int
    ) -> SteadyForce:
        """Mesh force of the steady motion from rest at a mesh frequency [Hz]; the speeds of the settings are not used.

        Args:
            oscillator: the oscillator; derivatives pass through it and the frequency.
            mesh_frequency: mesh frequency [Hz].
            phase: mesh positions of the returned force [base pitches], shape (positions,).
            steps: steps of the integrator per mesh cycle.
        """
        fixed, frequency = jax.lax.stop_gradient((oscillator, mesh_frequency))
        alone = replace(self, mesh_frequencies=frequency[None], steps=steps)
        return steady_force(oscillator, mesh_frequency, alone.run(fixed, UP), phase, steps)

    def numbers(self, oscillator: Oscillator) -> SteadyNumbers:
        """Results of all runs with their derivatives, leading axis (runs,).

        The integrator uses the field `steps`, or 256: the natural frequency of a traced oscillator is unknown.
        """
        steps = self.traced_steps
        runs = replace(self, steps=steps).runs(jax.lax.stop_gradient(oscillator))
        return differentiable(oscillator, tuple(runs.values()), steps)


Numbers = Float[Array, "runs speeds"]

_FIELDS = (
    ("dynamic_factor", "", "largest mesh force over the static one"),
    ("dte_rms", "um", "rms of the dynamic transmission error about its mean"),
    ("contact_loss_share", "", "share of the time without contact, which has no derivative"),
    ("back_side_contact", "", "share of the time on the coast flanks, which has no derivative"),
)
AT_SPEED = tuple(name for name, *_ in _FIELDS)  # at the speed of the operating point, the others at all of the settings


def _numbers(field: str, at_speed: bool, analysis: Analysis, dynamics: Dynamics) -> Numbers:
    """Values of a quantity for all runs and speeds, which the quantity reduces to the worst."""
    # all quantities of the same settings come from one sweep
    found, converged = analysis.once(dynamics, ("runs", at_speed), lambda: _swept(at_speed, analysis, dynamics))
    # a map of contacts that were not found is no force
    return jnp.where(converged, getattr(found, field), jnp.nan)


def _swept(at_speed: bool, analysis: Analysis, dynamics: Dynamics) -> tuple[SteadyNumbers, Bool[Array, ""]]:
    mesh, speed = analysis.prepared_mesh, analysis.operating_point.speed
    if at_speed:
        if speed is None:
            raise ValueError("needs a speed, solve with OperatingPoint(torque, speed)")
        frequency = mesh_frequency(mesh.pair.pinion.teeth, speed)
        dynamics = replace(dynamics, mesh_frequencies=frequency[None])
    torque, deviation = analysis.cycle.torque, analysis.deviation
    oscillator, _ = dynamics.oscillator_and_mesh(mesh, torque, **analysis.flanks, deviation=deviation)
    return dynamics.numbers(oscillator), oscillator.converged


def mesh_frequency(teeth: Scalar, speed: Scalar) -> Scalar:
    """Mesh frequency [Hz] of a gear by its speed [rpm]."""
    return teeth * speed / 60


def _quantities(at_speed: bool) -> Iterator[Quantity]:
    for field, unit, meaning in _FIELDS:
        name, where = (field, "the speed of the pinion") if at_speed else (f"worst_{field}", "its worst speed")
        label = "largest dynamic factor" if name == "worst_dynamic_factor" else ""
        of = partial(_numbers, field, at_speed)
        yield Quantity(name, of, unit, f"{meaning}, at {where}", Max(), label=label, takes=Dynamics)


DYNAMIC_QUANTITIES = Vocabulary((*_quantities(True), *_quantities(False)))
