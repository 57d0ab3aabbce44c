"""Are limits that can be kept kept? `python -m benchmarks.limits`.

Random pairs, loads and objectives, each with limits on two quantities that a random design is known to keep, by 0.2 to
10 %. A search has failed where it calls the problem infeasible, or where its optimum passes a limit on a mesh of four
times the positions that it was judged on. Exit code 1 when one has failed; the failures are printed with their numbers.
"""

import argparse
from dataclasses import dataclass

import jax
import numpy as np
from rich.console import Console
from rich.progress import track

import jaxgear as jg
from jaxgear.numerics import quick

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
)
POSITIONS = 512  # of the mesh on which an optimum is judged
SEARCH = jg.Resolution(positions=64, pairs=3)
CHECK = jg.Resolution(positions=4 * POSITIONS, pairs=3)
_LEAST_ROOM, _MOST_ROOM = 0.002, 0.1  # by which the known design keeps the limits, relative to them
_ROUNDING = 1e-9
_STIFF = 6.0  # most deflection [um] per mm of module: three pairs are enough


@dataclass(frozen=True)
class Problem:
    """A pair under a torque [N m], the range of its designs, and one that keeps the limits."""

    pair: jg.GearPair
    torque: float
    bounds: dict[str, tuple[float, float]]
    known: dict[str, float]
    room: tuple[float, float]


def design(x):
    """Tip reliefs of both gears over one length, with one curve."""
    curve = jg.Power(x["exponent"])
    return jg.TipRelief(x["pinion"], x["length"], curve), jg.TipRelief(x["wheel"], x["length"], curve)


def drawn(random: np.random.Generator) -> Problem:
    """A pair that can run, loaded to a usual pressure at the pitch point."""
    while True:
        module = random.uniform(1.0, 6.0)
        pinion = int(random.integers(17, 45))
        teeth = pinion, int(pinion * random.uniform(1.0, 4.0))
        shift = random.uniform(-0.1, 0.4), random.uniform(-0.3, 0.3)
        width = module * random.uniform(5.0, 14.0)
        pair = jg.GearPair(
            *(
                jg.Gear(z, module, profile_shift=x, face_width=width, bore_diameter=0.5 * module * (z - 2.5))
                for z, x in zip(teeth, shift)
            )
        )
        try:
            mesh = jg.prepare(pair, resolution=SEARCH)
        except ValueError:  # undercut or pointed teeth, or a path of contact for more pairs
            continue
        cycle = jg.solve(mesh, 100.0)
        pressure = float(jg.quantities["max_flank_pressure"](cycle))
        torque = 100.0 * (random.uniform(600.0, 1400.0) / pressure) ** 2
        deflection = float(jg.quantities["mean_te"](jg.solve(mesh, torque)))
        if not 0.5 < deflection < _STIFF * module:
            continue
        most = 2.0 * deflection
        bounds = {"pinion": (0.0, most), "wheel": (0.0, most), "length": (0.5 * module, 1.9 * module)}
        bounds["exponent"] = (1.0, 3.0)
        known = {name: random.uniform(low, high) for name, (low, high) in bounds.items()}
        room = random.uniform(_LEAST_ROOM, _MOST_ROOM, 2)
        return Problem(pair, torque, bounds, known, (float(room[0]), float(room[1])))


def numbers(mesh: jg.Mesh, torque: float, parameters: dict[str, float] | None, names) -> dict[str, float]:
    """Quantities of a design; None for unmodified flanks."""
    pinion, wheel = (
        design({name: np.float64(value) for name, value in parameters.items()}) if parameters else (None,) * 2
    )
    cycle = jg.solve(mesh, torque, pinion=pinion, wheel=wheel)
    if not bool(cycle.converged.all()):
        return dict.fromkeys(names, float("nan"))
    return {name: float(jg.quantities[name](cycle)) for name in names}


def failure(problem: Problem, row: tuple[str, str, str]) -> str | None:
    """What is wrong with the answer to a problem, or nothing; "" for a known design that meets no contact."""
    objective, *limited = row
    fine = jg.prepare(problem.pair, resolution=CHECK)
    kept, plain = (numbers(fine, problem.torque, of, row) for of in (problem.known, None))
    if not np.isfinite([*kept.values(), *plain.values()]).all():
        return ""
    # what is zero, such as the pressure of corners that touch nothing, has room of that of unmodified flanks
    limits = {}
    for name, room in zip(limited, problem.room):
        upper = jg.quantities[name].better == "smaller"
        least = room * abs(kept[name] or plain[name])
        limits[name] = ("high", kept[name] + least) if upper else ("low", kept[name] - least)
    found = jg.minimize(
        design,
        problem.bounds,
        mesh=jg.prepare(problem.pair, resolution=SEARCH),
        torque=problem.torque,
        objective=objective,
        constraints=[jg.Constraint(name, **{side: limit}) for name, (side, limit) in limits.items()],
        positions=POSITIONS,
    )
    judged = numbers(fine, problem.torque, found.parameters, row)
    gears = " / ".join(f"{float(gear.teeth):g}" for gear in (problem.pair.pinion, problem.pair.wheel))
    said = ", ".join(f"{name} {judged[name]:.6g} ({side} {limit:.6g})" for name, (side, limit) in limits.items())
    said = f"{gears} m {float(problem.pair.pinion.module):.3f}, {problem.torque:.1f} N m, {objective}: {said}"
    if not found.feasible:
        return f"called infeasible: {said}"
    for name, (side, limit) in limits.items():
        sign = 1 if side == "high" else -1
        if not sign * (judged[name] - limit) <= _ROUNDING * abs(limit):
            return f"limit passed: {said}"
    return None


def main(arguments: list[str] | None = None) -> int:
    """Draws the problems, solves them, prints those that failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--problems", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args(arguments)
    jax.config.update("jax_enable_x64", True)
    quick.compile_quickly()
    console, random = Console(), np.random.default_rng(given.seed)
    failed: list[str] = []
    solved = 0
    for i in track(range(given.problems), description="problems", console=console):
        said = failure(drawn(random), ROWS[i % len(ROWS)])
        solved += said != ""
        if said:
            failed.append(said)
            console.print(f"{i}: {said}", soft_wrap=True)
    console.print(f"{solved} problems solved, {len(failed)} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main())
