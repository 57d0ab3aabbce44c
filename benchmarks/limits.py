"""Are limits that can be kept kept? `python -m benchmarks.limits --problems 200 --seed 0`.

Random pairs, loads and objectives, each with limits on two quantities that a random design is known to keep, by 0.2 to
10 %. A search has failed where it raises an error, where it calls the problem infeasible, and where its optimum passes
a limit on a mesh of four times the positions that searches are judged on. Exit code 1 when one has failed. Draws that
give no problem are counted and replaced: as many problems are judged as were asked for.
"""

import argparse
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import jax
import numpy as np
from rich.console import Console
from rich.table import Table

import jaxgear as jg
from jaxgear.contact import OperatingPoint
from jaxgear.metrics import Lubricant, Quantity, Strength
from jaxgear.numerics import programs

# What is made best and what is limited; every problem of a row shares its programs.
ROWS = (
    ("max_flank_pressure", "ppte", "max_corner_pressure"),
    ("ppte", "max_corner_pressure", "mesh_loss_factor"),
    ("mesh_loss_factor", "ppte", "pinion_root_stress"),
    ("wheel_root_stress", "te_rms", "max_flank_pressure"),
    ("force_excitation", "removed_volume", "max_corner_pressure"),
    ("effective_contact_ratio", "ppte", "max_contact_pressure"),
    ("removed_volume", "te_harmonic_1", "wheel_root_stress"),
    ("te_harmonic_1", "te_harmonic_2", "effective_contact_ratio"),
    ("min_tangent_stiffness", "ppte", "corner_force"),
    ("max_corner_pressure", "mean_te", "te_harmonic_1"),
    ("loss_power", "ppte", "pinion_root_safety"),
    ("scuffing_safety", "ppte", "wheel_local_root_safety"),
    ("micropitting_safety", "loss_power", "pressure_safety"),
    ("pinion_local_root_safety", "max_contact_temperature", "te_rms"),
)
OIL = Lubricant(
    viscosity_40=100.0,
    viscosity_100=11.1,
    temperature=80.0,
    roughness=0.5,
    permissible_film=0.2,
    scuffing_temperature=300.0,
)
STRENGTH = Strength(bending=900.0, pressure=3000.0)
_OILED = "loss_power", "scuffing_safety", "micropitting_safety", "max_contact_temperature"
_SAFE = "pinion_root_safety", "pinion_local_root_safety", "wheel_local_root_safety", "pressure_safety"
QUANTITIES: Mapping[str, Quantity] = {
    **jg.quantities,
    **{name: OIL.quantity(name) for name in _OILED},
    **{name: STRENGTH.quantity(name) for name in _SAFE},
}
POSITIONS = 512  # of the mesh on which an optimum is judged
SEARCH = jg.Resolution(positions=64, pairs=3)
CHECK = jg.Resolution(positions=4 * POSITIONS, pairs=3)
_LEAST_ROOM, _MOST_ROOM = 0.002, 0.1  # by which the known design keeps the limits, relative to them
_ROUNDING = 1e-9
_VELOCITY = 2.0, 20.0  # at the pitch line [m/s]
_STIFF = 6.0  # most deflection [um] per mm of module: three pairs are enough


@dataclass(frozen=True)
class Problem:
    """A pair in operation, the range of its designs, and one that keeps the limits."""

    pair: jg.GearPair
    load: OperatingPoint
    bounds: dict[str, tuple[float, float]]
    known: dict[str, float]
    room: tuple[float, float]


def design(x):
    """Tip reliefs of both gears over one length, with one curve."""
    curve = jg.Power(x["exponent"])
    return jg.TipRelief(x["pinion"], x["length"], curve), jg.TipRelief(x["wheel"], x["length"], curve)


@dataclass(frozen=True)
class Answer:
    """What became of a problem.

    Attributes:
        failure: what is wrong; "" where the limits are kept.
        said: the problem and its numbers.
        room: least distance from a limit on the finer mesh, relative to it; negative where it is passed.
        seconds: of the search.
    """

    failure: str
    said: str
    room: float
    seconds: float


def drawn(random: np.random.Generator, refused: Counter[str]) -> Problem:
    """A pair that can run, loaded to a usual pressure at the pitch point; counts why others are refused."""
    while True:
        module = random.uniform(1.0, 6.0)
        pinion = int(random.integers(17, 45))
        teeth = pinion, int(pinion * random.uniform(1.0, 4.0))
        shift = random.uniform(-0.1, 0.4), random.uniform(-0.3, 0.3)
        width = module * random.uniform(5.0, 14.0)
        gears = (
            jg.Gear(z, module, profile_shift=x, face_width=width, bore_diameter=0.5 * module * (z - 2.5))
            for z, x in zip(teeth, shift)
        )
        try:  # undercut or pointed teeth, or a path of contact for more pairs
            pair = jg.GearPair(*gears)
            mesh = jg.prepare(pair, resolution=SEARCH)
        except ValueError:
            refused["gears that cannot run"] += 1
            continue
        cycle = jg.solve(mesh, 100.0)
        pressure = float(jg.quantities["max_flank_pressure"](cycle))
        torque = 100.0 * (random.uniform(600.0, 1400.0) / pressure) ** 2
        deflection = float(jg.quantities["mean_te"](jg.solve(mesh, torque)))
        if not 0.5 < deflection < _STIFF * module:
            refused["too stiff or too soft"] += 1
            continue
        most = 2.0 * deflection
        bounds = {"pinion": (0.0, most), "wheel": (0.0, most), "length": (0.5 * module, 1.9 * module)}
        bounds["exponent"] = (1.0, 3.0)
        known = {name: random.uniform(low, high) for name, (low, high) in bounds.items()}
        room = random.uniform(_LEAST_ROOM, _MOST_ROOM, 2)
        speed = random.uniform(*_VELOCITY) * 6e4 / (np.pi * module * pinion)
        return Problem(pair, OperatingPoint(torque, speed), bounds, known, (float(room[0]), float(room[1])))


def numbers(mesh: jg.Mesh, load: OperatingPoint, parameters: dict[str, float] | None, names) -> dict[str, float]:
    """Quantities of a design; None for unmodified flanks."""
    pinion, wheel = (
        design({name: np.float64(value) for name, value in parameters.items()}) if parameters else (None,) * 2
    )
    cycle = jg.solve(mesh, load, pinion=pinion, wheel=wheel)
    if not bool(cycle.converged.all()):
        return dict.fromkeys(names, float("nan"))
    return {name: float(QUANTITIES[name](cycle)) for name in names}


def limits_of(problem: Problem, row: tuple[str, ...], fine: jg.Mesh) -> dict[str, tuple[str, float]] | None:
    """Side and value of the limits that the known design keeps; None where its numbers, or those without it, fail."""
    kept, plain = (numbers(fine, problem.load, of, row) for of in (problem.known, None))
    if not np.isfinite([*kept.values(), *plain.values()]).all():
        return None
    limits = {}
    for name, room in zip(row[1:], problem.room):
        upper = QUANTITIES[name].better == "smaller"
        # what is zero, such as the pressure of corners that touch nothing, has room of that of unmodified flanks
        least = room * abs(kept[name] or plain[name])
        limits[name] = ("high", kept[name] + least) if upper else ("low", kept[name] - least)
    return limits


def answer(problem: Problem, row: tuple[str, ...], refused: Counter[str]) -> Answer | None:
    """What a search makes of a problem; None where there is no problem, which is counted."""
    fine = jg.prepare(problem.pair, resolution=CHECK)
    limits = limits_of(problem, row, fine)
    if limits is None:
        refused["a known design without a converged contact"] += 1
        return None
    gears = " / ".join(f"{float(gear.teeth):g}" for gear in (problem.pair.pinion, problem.pair.wheel))
    said = f"{gears} m {float(problem.pair.pinion.module):.3f}, {float(problem.load.torque):.1f} N m, {row[0]}"
    began = time.perf_counter()
    try:
        found = jg.minimize(
            jg.Problem(
                jg.prepare(problem.pair, resolution=SEARCH),
                problem.load,
                design,
                problem.bounds,
                objective=QUANTITIES[row[0]],
                constraints=[
                    jg.Constraint(QUANTITIES[name], **{side: limit}) for name, (side, limit) in limits.items()
                ],
            ),
            positions=POSITIONS,
        )
    except RuntimeError as error:
        return Answer(f"error: {error}", said, float("nan"), time.perf_counter() - began)
    seconds = time.perf_counter() - began
    judged = numbers(fine, problem.load, found.parameters, row)
    said += ": " + ", ".join(f"{name} {judged[name]:.6g} ({side} {of:.6g})" for name, (side, of) in limits.items())
    rooms = [
        (limit - judged[name]) * (1 if side == "high" else -1) / (abs(limit) or 1.0)
        for name, (side, limit) in limits.items()
    ]
    failure = "" if min(rooms) >= -_ROUNDING else "limit passed"
    return Answer(failure if found.feasible else "called infeasible", said, min(rooms), seconds)


def answers(
    console: Console, rows: list[tuple[str, ...]], problems: int, seed: int, refused: Counter[str]
) -> Iterator[tuple[str, Answer]]:
    """So many problems, in turn of every row, with a line for each of them."""
    random, began = np.random.default_rng(seed), time.perf_counter()
    for number in range(problems):
        row, found = rows[number % len(rows)], None
        while found is None:
            found = answer(drawn(random, refused), row, refused)
        spent = time.perf_counter() - began
        what = f"{found.failure.upper() or 'kept'}, {found.said}"
        console.print(f"{number + 1}/{problems}, {spent:.0f} s, seed {seed}: {what}", soft_wrap=True, highlight=False)
        yield row[0], found


def summary(found: list[tuple[str, Answer]]) -> Table:
    """A row for every objective."""
    table = Table("objective", "problems", "failed", "least room [%]", "median time [s]")
    for name in [row[0] for row in ROWS]:
        of_row = [each for objective, each in found if objective == name]
        if of_row:
            failed, room = sum(bool(each.failure) for each in of_row), min(each.room for each in of_row)
            seconds = float(np.median([each.seconds for each in of_row]))
            table.add_row(name, f"{len(of_row)}", f"{failed}", f"{100 * room:.3f}", f"{seconds:.1f}")
    return table


def main(arguments: list[str] | None = None) -> int:
    """Draws the problems of every seed, solves them, prints what became of them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--problems", type=int, default=200, help="of every seed")
    parser.add_argument("--seed", type=int, nargs="+", default=[0], help="one or several")
    known = [row[0] for row in ROWS]
    parser.add_argument("--objective", nargs="+", default=known, choices=known, metavar="NAME", help="of these alone")
    given = parser.parse_args(arguments)
    jax.config.update("jax_enable_x64", True)
    programs.compile_quickly()
    console, refused = Console(), Counter[str]()
    rows = [row for row in ROWS if row[0] in given.objective]
    found = [each for seed in given.seed for each in answers(console, rows, given.problems, seed, refused)]
    failed = sum(bool(each.failure) for _, each in found)
    console.print(summary(found))
    console.print(f"{len(found)} problems judged, {failed} failed")
    console.print(f"draws replaced: {', '.join(f'{count} {why}' for why, count in refused.items()) or 'none'}")
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main())
