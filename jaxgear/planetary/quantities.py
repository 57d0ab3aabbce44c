"""Quantities of a whole planetary stage: objectives, limits, columns of sweeps.

They are those of a design of the mesh of sun and planet, in the place of whose wheel stand `PlanetFlanks`, and need the
stage besides: `StageSettings.quantity` supplies it in Python, the table [stage] in a design file.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, ClassVar, Literal, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact.status import Status
from ..dynamics.settings import DAMPING_RATIO
from ..metrics import AbstractSettings, Analysis, Lubricant, Quantity, Vocabulary, peak_to_peak
from ..numerics import Quantile, maximum, number, real
from ..numerics.reductions import AbstractReduction, Max, Range, Value
from .cycle import StageCycle
from .flanks import of_design
from .kinematics import driving_speed, driving_torque
from .losses import StageLosses, stage_losses
from .mesh_cycles import StageMeshes, mesh_cycles
from .response import StageResponse, stage_response
from .solve import PreparedStage, solve_stage
from .vibration import StageInertias, StageSystem, stage_system

Scalar = Float[Array, ""]

_MINUTE = 60.0  # s
_LEVEL = 0.95  # of the stages with errors that are no worse than a quantity with errors says


class StageSettings(AbstractSettings):
    """The stage of which a mesh of sun and planet is one.

    settings = StageSettings(prepare_stage(stage, sun=sun_mesh, ring=ring_mesh))
    design = lambda v: (sun(v), PlanetFlanks(to_sun(v), to_ring(v), ring(v)))
    objective = settings.quantity("stage_ppte")
    jaxgear.minimize(jaxgear.Problem(sun_mesh, torque / 3, design, bounds, objective=objective))

    The torque of such a design is that of one mesh, on the sun: the torque of the sun over the number of planets. The
    stage is solved at the positions that it was prepared at, whatever those of the mesh.

    Attributes:
        prepared: prepared stage.
        pin_errors: tangential displacements of the pins of many stages, in addition to those of the stage, shape
            (samples, planets); None for the stage alone.
        lubricant: lubricant, for losses; None where the load has a coefficient of friction.
        inertias: inertias of all members, for vibration; None for none.
        damping_ratio: damping ratio of its modes.
    """

    table: ClassVar[str] = "stage"

    prepared: PreparedStage
    pin_errors: Float[Array, "samples planets"] | None = number(
        "um", shape=("samples", "planets"), optional=True, default=None
    )
    lubricant: Lubricant | None = None
    inertias: StageInertias | None = None
    damping_ratio: Scalar = number("", low=0.0, high=1.0, default=DAMPING_RATIO)

    def check_together(self) -> None:
        planets = self.prepared.stage.planets
        if self.pin_errors is not None and self.pin_errors.shape[1] != planets:
            raise ValueError(
                f"StageSettings: pin_errors has {self.pin_errors.shape[1]} columns, must have one for each of the "
                f"{planets} planets"
            )

    def solve(self, analysis: Analysis) -> StageCycle:
        """The stage with the flanks and at the torque of an analysis."""
        return analysis.once(self, "stage", lambda: _solved(self.prepared, analysis))

    def contacts(self, analysis: Analysis) -> StageMeshes:
        """Contacts of all its meshes with the flanks and at the torque of an analysis."""
        point = analysis.operating_point
        speed = None if point.speed is None else driving_speed(self.prepared.stage, point.speed)
        options = {"speed": speed, "friction": point.friction}
        return analysis.once(self, "contacts", lambda: mesh_cycles(self.prepared, self.solve(analysis), **options))

    def losses(self, analysis: Analysis) -> StageLosses:
        """Losses of the flanks of all meshes with the flanks and at torque and speed of an analysis."""
        cycle, meshes = self.solve(analysis), self.contacts(analysis)
        return analysis.once(self, "losses", lambda: stage_losses(cycle, meshes, self.lubricant))

    def system(self, meshes: StageMeshes) -> StageSystem:
        """Masses and springs of the stage with meshes of their mean stiffness.

        Raises:
            ValueError: without `inertias`.
        """
        if self.inertias is None:
            raise ValueError("needs inertias of the StageSettings")
        stiffness = meshes.mean_stiffness
        stage, inertias = self.prepared.stage, self.inertias
        return stage_system(stage, inertias, sun_stiffness=stiffness.sun, ring_stiffness=stiffness.ring)

    def response(self, analysis: Analysis) -> StageResponse:
        """Linear vibration at the speed of an analysis, with its flanks and torque.

        Raises:
            ValueError: without `inertias`, and without a speed.
        """
        speed = analysis.operating_point.speed
        if speed is None:
            raise ValueError("needs a speed of the operating point")
        frequency = self.prepared.stage.gears.sun_teeth * speed / _MINUTE

        def found() -> StageResponse:
            system = self.system(self.contacts(analysis))
            return stage_response(system, self.solve(analysis), frequency[None], damping_ratio=self.damping_ratio)

        return analysis.once(self, "response", found)

    def solve_with_errors(self, analysis: Analysis) -> StageCycle:
        """The stages with pin errors, with an axis (samples,) in front.

        Raises:
            ValueError: without `pin_errors`.
        """
        errors = self.pin_errors
        if errors is None:
            raise ValueError("needs pin_errors of the StageSettings")

        def of(errors: Array) -> StageCycle:
            stage = self.prepared.stage
            own = stage.tangential_pin_error
            with_errors = replace(stage, tangential_pin_error=errors if own is None else own + errors)
            return _solved(replace(self.prepared, stage=with_errors), analysis)

        # one after the other: side by side they would take the memory of as many batches of designs
        return analysis.once(self, "stages with errors", lambda: jax.lax.map(of, errors))


def _solved(prepared: PreparedStage, analysis: Analysis) -> StageCycle:
    stage, cycle = prepared.stage, analysis.cycle
    torque = driving_torque(stage, stage.planets * cycle.torque)
    flanks = of_design(cycle.pinion, cycle.wheel)
    return solve_stage(prepared, torque, **flanks._asdict())


def _values(of: Callable[[StageCycle], Array], analysis: Analysis, settings: StageSettings) -> Float[Array, "..."]:
    cycle = settings.solve(analysis)
    return jnp.where(jnp.all(cycle.converged), of(cycle), jnp.nan)


def _of_contacts(of: Callable[[StageMeshes], Scalar], analysis: Analysis, settings: StageSettings) -> Scalar:
    meshes = settings.contacts(analysis)
    fine = jnp.all(settings.solve(analysis).converged) & jnp.all(meshes.status == Status.CONVERGED)
    return jnp.where(fine, of(meshes), jnp.nan)


def _of_losses(of: Callable[[StageLosses], Scalar], analysis: Analysis, settings: StageSettings) -> Scalar:
    return jnp.where(jnp.all(settings.solve(analysis).converged), of(settings.losses(analysis)), jnp.nan)


def _dynamic_factor(analysis: Analysis, settings: StageSettings) -> Scalar:
    fine = jnp.all(settings.solve(analysis).converged)
    return jnp.where(fine, settings.response(analysis).dynamic_factor[0], jnp.nan)


def _with_errors(name: str, analysis: Analysis, settings: StageSettings) -> Scalar:
    cycles, own = settings.solve_with_errors(analysis), OF_STAGE[name]
    values = jax.vmap(own.number)(cycles)
    alike = jnp.ones_like(values) / len(values)
    fine = jnp.all(cycles.converged)
    return jnp.where(fine, Quantile(real(_LEVEL))(values, alike), jnp.nan)


def _order(number: int, cycle: StageCycle) -> Scalar:
    return cycle.orders(number).amplitude[number - 1]


_ORDERS = 3

Curves = Float[Array, "..."]


class _OfCycle(NamedTuple):
    """A number of a stage: values and what makes one of them, unit and meaning."""

    of: Callable[[StageCycle], Curves]
    reduction: AbstractReduction
    unit: str
    meaning: str

    def number(self, cycle: StageCycle) -> Scalar:
        """The number of a stage."""
        return self.reduction(self.of(cycle).ravel())


OF_STAGE = {
    "stage_ppte": _OfCycle(
        lambda cycle: cycle.transmission_error,
        Range(),
        "um",
        "transmission error of the stage on the base circle of the sun, peak to peak",
    ),
    "mean_stage_transmission_error": _OfCycle(
        lambda cycle: jnp.mean(cycle.transmission_error),
        Value(),
        "um",
        "transmission error of the stage on the base circle of the sun, mean",
    ),
    **{
        f"stage_mesh_order_{order}": _OfCycle(
            partial(_order, order),
            Value(),
            "um",
            f"transmission error of the stage at {order} times the mesh frequency, amplitude",
        )
        for order in range(1, _ORDERS + 1)
    },
    "load_sharing_factor": _OfCycle(
        lambda cycle: cycle.mean_load_share,
        Max(),
        "",
        "load sharing factor K_gamma: largest mean load of a planet over the mean of all",
    ),
    "peak_load_sharing_factor": _OfCycle(
        lambda cycle: maximum(cycle.load_share, -2),
        Max(),
        "",
        "largest load of a planet at any position over the mean of all",
    ),
    "sun_orbit": _OfCycle(
        lambda cycle: cycle.orbit, Value(), "um", "largest distance of the sun's centre from its mean place"
    ),
    "max_pin_force": _OfCycle(
        lambda cycle: maximum(cycle.pin_force, -2), Max(), "N", "largest force of a planet on its pin"
    ),
    "pin_force_excitation": _OfCycle(
        lambda cycle: jax.vmap(peak_to_peak)(cycle.pin_force),
        Max(),
        "N",
        "force of a planet on its pin, largest peak to peak",
    ),
}

# of the contacts of all its meshes, in MPa
OF_CONTACTS: dict[str, tuple[Callable[[StageMeshes], Scalar], str]] = {
    "max_stage_flank_pressure": (
        lambda meshes: meshes.max_flank_pressure,
        "largest flank pressure in all meshes of the stage",
    ),
    "max_stage_corner_pressure": (
        lambda meshes: meshes.max_corner_pressure,
        "largest pressure of a tip corner in all meshes of the stage",
    ),
    "sun_root_stress": (lambda meshes: maximum(meshes.root_stress.sun), "largest local root stress of the sun"),
    "planet_root_stress": (
        lambda meshes: maximum(jnp.stack([meshes.root_stress.planet_to_sun, meshes.root_stress.planet_to_ring])),
        "largest local root stress of the planets, whose teeth bend both ways",
    ),
    "ring_root_stress": (lambda meshes: maximum(meshes.root_stress.ring), "largest local root stress of the ring"),
}
# of its losses, at the speed of the load
OF_LOSSES: dict[str, tuple[Callable[[StageLosses], Scalar], str, str, Literal["smaller", "larger"]]] = {
    "stage_efficiency": (
        lambda losses: losses.efficiency,
        "",
        "efficiency of the stage by the losses of its flanks",
        "larger",
    ),
    "stage_loss_power": (lambda losses: losses.loss_power, "W", "power that the flanks of the stage lose", "smaller"),
}
DYNAMIC_FACTOR = "stage_dynamic_factor"
WITH_ERRORS = "_with_pin_errors"
_ROBUST = "stage_ppte", "load_sharing_factor", "peak_load_sharing_factor", "max_pin_force"
_FORMS = {"N": ".0f", "MPa": ".0f"}


def _quantity(name: str, of: Callable[..., Any], unit: str, meaning: str, **options: Any) -> Quantity:
    return Quantity(name, of, unit, meaning, takes=StageSettings, form=_FORMS.get(unit, ".4g"), **options)


STAGE_QUANTITIES = Vocabulary(
    (
        *(
            _quantity(name, partial(_values, own.of), own.unit, own.meaning, reduction=own.reduction)
            for name, own in OF_STAGE.items()
        ),
        *(_quantity(name, partial(_of_contacts, of), "MPa", meaning) for name, (of, meaning) in OF_CONTACTS.items()),
        *(
            _quantity(name, partial(_of_losses, of), unit, meaning, better=better)
            for name, (of, unit, meaning, better) in OF_LOSSES.items()
        ),
        _quantity(
            DYNAMIC_FACTOR,
            _dynamic_factor,
            "",
            "largest force of a mesh over the mean of all meshes, linear vibration at the speed of the load",
        ),
        *(
            _quantity(
                f"{name}{WITH_ERRORS}",
                partial(_with_errors, name),
                OF_STAGE[name].unit,
                f"{OF_STAGE[name].meaning}; 95 % quantile over stages with pin errors",
            )
            for name in _ROBUST
        ),
    )
)
