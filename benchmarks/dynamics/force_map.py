"""Force map against the contact analysis at the same DTE."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from rich.console import Console
from rich.table import Table

import jaxgear as jg
from jaxgear.contact import removed_material
from jaxgear.contact.mesh import prepare_from
from jaxgear.contact.prescribed import solve_series
from jaxgear.dynamics import mesh_force

_POSITIONS = 16  # of one call of the contact analysis
_SEED = 0
_LARGEST_LOAD = 3.0  # in static forces
_ALLOWANCE = -72.4  # of either gear [um]
MOST_PERCENT = 0.5


@dataclass(frozen=True)
class MapError:
    """Largest difference of a map from the contact analysis in one case.

    Attributes:
        pair, relief: of the case.
        percent: of the static force, or of the force itself where that is larger.
        dte: where [um].
        phase: where [base pitches].
        places: how many mesh positions and DTEs have been compared.
        megabytes: of the map's tables.
    """

    pair: str
    relief: str
    percent: float
    dte: float
    phase: float
    places: int
    megabytes: float


def map_against_direct(*, phases: int = 160, dtes: int = 240, **sizes: int) -> list[MapError]:
    """Force map against the contact analysis at random places, on the drive flanks up to three static forces.

    Args:
        phases: mesh positions compared, a multiple of 16.
        dtes: compared at each of them.
        sizes: `positions` and `levels` of `mesh_force`, where not its defaults.
    """
    random = np.random.default_rng(_SEED)
    firsts = random.uniform(0, 1 / _POSITIONS, phases // _POSITIONS)
    return [_map_error(*case, firsts, random.uniform(0, 1, dtes), sizes) for case in _cases()]


def print_map_errors(console: Console, rows: Sequence[MapError]) -> None:
    console.print("Force map against the contact analysis, of the static force or of the force where that is larger")
    table = Table("pair", "relief")
    for title in ("largest error [%]", "at DTE [um]", "and phase", "places", "map [MB]"):
        table.add_column(title.replace("[", r"\["), justify="right")
    for row in rows:
        numbers = f"{row.percent:.3f}", f"{row.dte:.2f}", f"{row.phase:.3f}", f"{row.places}"
        table.add_row(row.pair, row.relief, *numbers, f"{row.megabytes:.2f}")
    console.print(table)


def _cases() -> Iterator[tuple]:
    """Name of the pair, the pair, torque [N m], name of the relief, reliefs."""
    for name, teeth, tips, bores, width, torque, amount, extent in (
        ("50/50", (50, 50), (154.5709, 154.5709), (40.0, 40.0), 20.0, 200.0, 7.0, 3.28),
        ("19/48", (19, 48), (63.0, 150.0), (24.0, 70.0), 18.0, 50.0, 6.0, 5.7),
    ):
        pair = jg.GearPair(
            *(
                jg.Gear(
                    z, 3.0, face_width=width, tip_diameter=tip, bore_diameter=bore, tooth_thickness_allowance=_ALLOWANCE
                )
                for z, tip, bore in zip(teeth, tips, bores)
            )
        )
        for kind, depth, share in (("none", 0.0, 1.0), ("short", amount, 0.6), ("long", amount, 1.0)):
            yield name, pair, torque, kind, jg.TipRelief(depth, share * extent)


def _map_error(name, pair, torque, kind, relief, firsts, shares, sizes) -> MapError:
    mesh = jg.prepare(pair, resolution=jg.Resolution(positions=_POSITIONS, pairs=4))
    both = {"pinion": relief, "wheel": relief}
    made = mesh_force(mesh, torque=torque, **both, **sizes)
    static = 1e3 * torque / pair.pinion.base_radius
    highest = jnp.max(jax.vmap(lambda at: made.static_te(at, _LARGEST_LOAD * static))(mesh.phase))
    lowest = jnp.min(made.start[0])
    dte = lowest + (highest - lowest) * shares
    wanted, phase = [], []
    for first in firsts:
        aside = prepare_from(first, mesh.pair, mesh.compliance, mesh.resolution, None, mesh.even)
        wanted.append(_direct(aside, removed_material(aside, torque, **both), dte))
        phase.append(aside.phase)
    wanted, phase = jnp.concatenate(wanted, axis=1), jnp.concatenate(phase)
    error = jnp.abs(_forces(made, phase, dte) - wanted) / jnp.maximum(wanted, static)
    row, column = np.unravel_index(int(jnp.argmax(error)), error.shape)
    return MapError(
        name,
        kind,
        100 * float(error[row, column]) if bool(jnp.all(jnp.isfinite(error))) else np.nan,
        float(dte[row]),
        float(phase[column]),
        error.size,
        (made.node_force.nbytes + made.node_stiffness.nbytes) / 1e6,
    )


@eqx.filter_jit
def _direct(mesh, removed, dte):
    """Force of the contact analysis, shape (DTEs, positions); nan where none has been found."""

    def at(q):
        found = solve_series(mesh, jnp.full(mesh.resolution.positions, q), removed, jnp.zeros_like(q))
        return jnp.where(found.converged, found.force, jnp.nan)

    return jax.vmap(at)(dte)


@eqx.filter_jit
def _forces(force, phase, dte):
    return jax.vmap(lambda q: jax.vmap(lambda at: force(at, q))(phase))(dte)


def map_section(console: Console) -> list[str]:
    rows = map_against_direct()
    print_map_errors(console, rows)
    return [
        f"the force map of {row.pair}, {row.relief} relief, is off by {row.percent:.2f} %, at most {MOST_PERCENT:g} %"
        for row in rows
        if not row.percent <= MOST_PERCENT
    ]
