"""A solved stage in tables, chapters and figures."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..numerics import Given, concrete, program, real
from ..report import Chapter, Figure, Part, Record, Table, numbers_of, table_of
from .cycle import StageCycle
from .kinematics import (
    axial_loads,
    gear_ratio,
    member_speeds,
    member_torques,
    mesh_frequency,
    output_member,
    phasing,
    planet_phases,
)
from .losses import StageLosses, stage_losses
from .mesh_cycles import StageMeshes, mesh_cycles
from .meshes import StageFlanks
from .quantities import OF_LOSSES, OF_STAGE, StageSettings
from .response import stage_response
from .solve import PreparedStage, solve_stage
from .stage import PlanetaryStage
from .vibration import StageModes, natural_modes

_ORDERS = 6
_MEMBERS = "sun", "ring", "carrier"

_FLANKS = {
    "sun": "sun",
    "planet_to_sun": "planet, flank to the sun",
    "planet_to_ring": "planet, flank to the ring",
    "ring": "ring",
}


def _pressure(mesh: str, kind: str, meshes: StageMeshes) -> float:
    found = meshes.flank_pressure if kind == "flank" else meshes.corner_pressure
    return float(jnp.max(getattr(found, mesh)))


def _root_stress(flank: str, meshes: StageMeshes) -> float:
    return float(jnp.max(getattr(meshes.root_stress, flank)))


# of a cycle
_HEADINGS = {
    "stage_ppte": "PPTE of the stage [µm]",
    "mean_stage_transmission_error": "mean transmission error of the stage [µm]",
    "load_sharing_factor": "load sharing factor K_gamma",
    "peak_load_sharing_factor": "largest load share",
    "sun_orbit": "orbit of the sun [µm]",
    "max_pin_force": "largest force on a pin [N]",
}
_NUMBERS: tuple[Record[StageCycle], ...] = tuple(
    Record(name, of.unit, of.number, heading, ".0f" if of.unit == "N" else ".3f")
    for name, heading in _HEADINGS.items()
    for of in [OF_STAGE[name]]
)

# of the contacts of all planets
_OF_MESHES: tuple[Record[StageMeshes], ...] = tuple(
    Record(f"max_{mesh}_mesh_{kind}_pressure", "MPa", partial(_pressure, mesh, kind), heading.format(mesh), ".0f")
    for kind, heading in (("flank", "flank pressure, {} [MPa]"), ("corner", "corner pressure, {} [MPa]"))
    for mesh in ("sun", "ring")
) + tuple(
    Record(f"{flank}_root_stress", "MPa", partial(_root_stress, flank), f"root stress, {words} [MPa]", ".0f")
    for flank, words in _FLANKS.items()
)

_OF_LOSSES: tuple[Record[StageLosses], ...] = tuple(
    Record(name, OF_LOSSES[name][1], OF_LOSSES[name][0], heading, form)
    for name, heading, form in (
        ("stage_efficiency", "efficiency", ".5f"),
        ("stage_loss_power", "power loss [W]", ".1f"),
    )
)


@program
def stages_over_torques(
    prepared: PreparedStage, torques: Float[Array, " torques"], flanks: StageFlanks
) -> tuple[StageCycle, StageCycle]:
    """The stage under several torques on the driving member [N m], without and with modifications of its flanks."""

    def of(share: Array, torque: Array) -> StageCycle:
        scaled = (None if each is None else share * each for each in flanks)
        return solve_stage(prepared, torque, **StageFlanks(*scaled)._asdict())

    shares = jnp.asarray([0.0, 1.0], torques.dtype)
    both = jax.vmap(jax.vmap(of, (None, 0)), (0, None))(shares, torques)
    return jax.tree.map(lambda leaf: leaf[0], both), jax.tree.map(lambda leaf: leaf[1], both)


def part(
    settings: StageSettings,
    over_torques: Mapping[str, StageCycle],
    speed: float | None,
    friction: float | None = None,
) -> Part:
    """The stage under load with the flanks of several designs, for the terminal, the report and the files.

    Args:
        settings: the stage.
        over_torques: cycles of one stage under several torques by the name of their design, with an axis (torques,) in
            front: under the design torque, then over a range. The last one is the design of the report.
        speed: speed of the driving member [rpm]; None for none.
        friction: mean coefficient of friction; None for that of the lubricant, if there is one.
    """
    prepared, lubricant = settings.prepared, settings.lubricant
    cycles = {name: jax.tree.map(lambda leaf: leaf[0], each) for name, each in over_torques.items()}
    name, cycle = list(cycles.items())[-1]
    meshes = {name: mesh_cycles(prepared, each, speed=speed, friction=friction) for name, each in cycles.items()}
    modes, responses = None, {}
    if settings.inertias is not None:
        systems = {name: settings.system(each) for name, each in meshes.items()}
        modes = natural_modes(systems[name])
        frequencies = real(np.linspace(*_FREQUENCIES, _MANY) * float(modes.frequency[-1]))
        responses = {
            name: stage_response(system, cycles[name], frequencies, damping_ratio=settings.damping_ratio)
            for name, system in systems.items()
        }
    of_losses = {}
    if speed is not None and (lubricant is not None or friction is not None):
        of_losses = {name: stage_losses(each, meshes[name], lubricant) for name, each in cycles.items()}
    numbers = table_of(_NUMBERS, cycles, "Planetary stage", "stage", across=True, note=_note(cycle))
    return Part(
        tables=(
            numbers,
            *([table_of(_OF_LOSSES, of_losses, "Losses of the flanks", across=True)] if of_losses else []),
            table_of(_OF_MESHES, meshes, "Meshes of the stage", "largest over planets", across=True),
            _over_torques(over_torques),
        ),
        chapters=(*_chapters(name, cycles, speed), *_vibration(modes)),
        data={
            name: {**numbers_of(_NUMBERS, each), **numbers_of(_OF_MESHES, meshes[name]), **_lists(each)}
            | (numbers_of(_OF_LOSSES, of_losses[name]) if of_losses else {})
            for name, each in cycles.items()
        },
        lines=tuple(_lines(cycles)),
        figures=(
            *(partial(_drawn, name, cycles) for name in _FIGURES),
            *([partial(_drawn, "dynamic_factors", responses)] if responses else []),
        ),
    )


def _over_torques(cycles: Mapping[str, StageCycle]) -> Table:
    """Transmission error over the range of torques."""
    first = next(iter(cycles.values()))
    header = ("torque [N m]", *(f"{name} [µm]" for name in cycles))
    table = Table(header, (), f"PPTE of the stage over the torque on the {first.stage.driving}")
    errors = [np.ptp(np.asarray(cycle.transmission_error), axis=-1)[1:] for cycle in cycles.values()]
    for torque, *row in zip(np.asarray(first.torque)[1:], *errors):
        table.add_row(f"{torque:.4g}", *(f"{value:.3f}" for value in row))
    return table


def _note(cycle: StageCycle) -> str:
    error = np.asarray(cycle.transmission_error)
    half = np.ptp(error[::2]) - np.ptp(error)
    torque = float(member_torques(cycle.stage, cycle.torque).sun)
    return (
        f"{torque:g} N m on the sun, {len(error)} positions; half as many change the PPTE by {half:+.2g} µm. In the "
        "other tables the sun is the pinion and a planet, under its share of the load, the wheel."
    )


def _lists(cycle: StageCycle) -> dict[str, Any]:
    """Numbers of planets and orders as plain data."""
    return {
        "mean_load_share": np.asarray(cycle.mean_load_share).tolist(),
        "mesh_orders_um": np.asarray(cycle.orders(_ORDERS).amplitude).tolist(),
        "converged": bool(np.all(cycle.converged)),
    }


def _lines(cycles: Mapping[str, StageCycle]) -> Iterator[tuple[str, ...]]:
    """Rows of `stage.csv`: transmission error and mesh forces of every design over the positions."""
    planets = next(iter(cycles.values())).stage.planets
    forces = [f"{member}_force_{planet + 1}_N" for member in ("sun", "ring") for planet in range(planets)]
    yield ("design", "phase", "transmission_error_um", *forces)
    for name, cycle in cycles.items():
        curves = [cycle.phase, cycle.transmission_error, *cycle.sun_force, *cycle.ring_force]
        for row in np.stack([np.asarray(each) for each in curves], axis=1):
            yield (name, *(f"{value:.7g}" for value in row))


def _chapters(name: str, cycles: Mapping[str, StageCycle], speed: float | None) -> Iterator[Chapter]:
    cycle = cycles[name]
    tables = [_members(cycle.stage, cycle.torque, speed), _planets(cycle), _orders(cycles)]
    yield Chapter("Planetary stage", tuple(_texts(cycle.stage, cycle.torque, speed)), tables=tables, new_page=True)


def _texts(stage: PlanetaryStage, torque: Given, speed: float | None) -> Iterator[str]:
    output = output_member(stage)
    yield (
        f"{stage.planets} planets, the {stage.fixed} is fixed, the {stage.driving} drives the {output}, ratio "
        f"{float(gear_ratio(stage)):.5g}. The transmission error is that of the sun on its base circle, with ring and "
        "carrier held."
    )
    if speed is not None:
        yield f"Mesh frequency {float(mesh_frequency(stage, speed)):.5g} Hz."
    if concrete(stage.gears.helix_angle):
        axial = axial_loads(stage, torque)
        yield (
            f"The axial force on the sun is {float(jnp.abs(axial.sun)):.4g} N, that on the ring its opposite. Planets "
            f"have none, but a tilting moment of {float(axial.planet_moment):.4g} N m each on their bearings, by which "
            "they do not tilt in this analysis."
        )
    yield (
        "Forces act along the lines of action, without friction. All planets and their teeth are alike but for the "
        "errors of [stage]."
    )


def _members(stage: PlanetaryStage, torque: Any, speed: float | None) -> Table:
    torques = member_torques(stage, torque)
    speeds = None if speed is None else member_speeds(stage, speed)
    supports = {"sun": stage.sun_support, "ring": stage.ring_support, "carrier": stage.carrier_support}
    table = Table(("member", "torque [N m]", *["speed [rpm]"] * (speed is not None), "support [N/µm]"), (), "Members")
    for member in _MEMBERS:
        support = supports[member]
        held = "rigid" if support is None else f"{float(support):g}" if float(support) else "floats"
        turns = [] if speeds is None else [f"{float(getattr(speeds, member)):.5g}"]
        table.add_row(member, f"{float(getattr(torques, member)):.5g}", *turns, held)
    if speeds is not None:
        table.add_row("planets", "0", f"{float(speeds.planet):.5g}", "pins")
    return table


def _planets(cycle: StageCycle) -> Table:
    stage = cycle.stage
    places = np.rad2deg(np.asarray(stage.planet_angles))
    sun, ring = (np.asarray(each) for each in planet_phases(stage))
    header = ("planet", "place [deg]", "phase, sun", "phase, ring", "load share", "force on the pin [N]")
    table = Table(header, (), "Planets", "phases in base pitches; shares and forces are means of the cycle")
    shares, forces = np.asarray(cycle.mean_load_share), np.asarray(cycle.pin_force).mean(axis=-1)
    for number, row in enumerate(zip(places, sun, ring, shares, forces)):
        table.add_row(str(number + 1), *(f"{value:{form}}" for value, form in zip(row, _PLANET_FORMS)))
    return table


def _vibration(modes: StageModes | None) -> Iterator[Chapter]:
    if modes is None:
        return
    table = Table(("mode", "frequency [Hz]", "kind"), (), "Natural frequencies", "of the last design, carrier at rest")
    for number, (frequency, kind) in enumerate(zip(np.asarray(modes.frequency), modes.kinds)):
        table.add_row(str(number + 1), f"{frequency:.5g}", _KINDS[kind])
    yield Chapter("Vibration of the stage", (_LINEAR,), tables=[table])


_KINDS = {
    "rotation": "members turn, all planets alike",
    "translation": "centres of members move",
    "planet": "planets alone",
}
_LINEAR = (
    "Linear vibration about the loaded state: meshes of their mean stiffness, excited by their loaded transmission "
    "errors. Where a mesh would lose contact it does not hold."
)
_FREQUENCIES, _MANY = (0.02, 1.1), 400  # mesh frequencies over the highest natural frequency
_PLANET_FORMS = ".3f", ".4f", ".4f", ".4f", ".0f"


def _orders(cycles: Mapping[str, StageCycle]) -> Table:
    note = "what equal planets excite by their phases: rotation (R), translation (T) or neither"
    table = Table(("mesh order", "excites", *(f"{name} [µm]" for name in cycles)), (), "Transmission error", note)
    kinds = phasing(next(iter(cycles.values())).stage, _ORDERS).kinds
    amplitudes = [np.asarray(cycle.orders(_ORDERS).amplitude) for cycle in cycles.values()]
    for order, (kind, *row) in enumerate(zip(kinds, *amplitudes)):
        table.add_row(str(order + 1), kind, *(f"{value:.3f}" for value in row))
    return table


_FIGURES = "stage_drawing", "transmission_error", "load_shares", "orders", "orbit"


def _drawn(name: str, results: Mapping[str, Any]) -> Figure:
    from . import figures  # imports matplotlib

    of: Any = results
    if name in ("stage_drawing", "load_shares"):
        last = list(results.values())[-1]
        of = last.stage if name == "stage_drawing" else last
    found = Figure.of(getattr(figures, name), of)
    return replace(found, name=name if name.startswith("stage") else f"stage_{name}")
