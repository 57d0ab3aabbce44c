"""Stiffness, transmission error and force of a mesh as files, for programs of rotor and multibody dynamics."""

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np

from ..contact import Mesh, solve
from ..contact.operating_point import operating_point_of
from ..contact.solve import check_mesh
from ..contact.status import WithStatus
from ..metrics import harmonics
from ..microgeometry import AbstractModification
from ..numerics import check, whole
from ..numerics.durable import write_durably
from .force_map import dte_levels
from .from_contact import mesh_force
from .systems import equivalent_mass, inertia_of

FILES = ("mesh.npz", "transmission_error.csv", "stiffness.csv", "force_map.csv", "te_orders.csv")
CONVENTIONS = (
    "phase: mesh position in base pitches, one mesh cycle is 1, it grows as the pinion turns in the driving direction",
    "transmission error (TE): how much farther the pinion has turned than the wheel, on the line of action "
    "in the transverse plane, positive under load",
    "force: on the same line, positive on the drive flanks, zero in the clearance, negative on the coast flanks; "
    "the torque of a gear is force times base radius",
)
_ORDERS = 10


def _table(meaning: str) -> Any:
    return field(metadata={"meaning": meaning})


@dataclass(frozen=True, eq=False)
class MeshTables(WithStatus):
    """Tables of a mesh over one cycle; made by `mesh_tables`. The file `mesh.npz` has an array of each name.

    Attributes:
        torque: torque on the pinion for the force map [N m].
        torques: torques on the pinion in ascending order [N m], shape (torques,).
        phase: mesh positions [base pitches], shape (positions,).
        transmission_error: loaded transmission error [um], shape (torques, positions).
        stiffness: tangent stiffness d force / d transmission error at a fixed position [N/um], shape (torques,
            positions).
        order: orders of the mesh frequency, shape (orders,).
        amplitude: amplitudes of the transmission error [um], shape (torques, orders).
        order_phase: phase angles of the transmission error [deg], shape (torques, orders);
            TE = mean + sum of amplitude cos(360 deg order phase + order_phase).
        map_phase: mesh positions of the force map [base pitches], shape (map_positions,).
        map_dte: ascending dynamic transmission errors of the force map [um], shape (map_positions, nodes).
        map_force: mesh force [N], shape (map_positions, nodes).
        teeth: numbers of teeth of pinion and wheel, shape (2,).
        base_radius: base radii of pinion and wheel [mm], shape (2,).
        inertia: moments of inertia of both bodies, rings from bore to reference circle [kg m2], shape (2,).
        equivalent_mass: equivalent mass of both gears on the line of action [kg].
        status: worst status of all contacts.
    """

    torque: float = _table("torque on the pinion of the force map [N m]")
    torques: np.ndarray = _table("torques on the pinion [N m], shape (torques,)")
    phase: np.ndarray = _table("mesh positions [base pitches], shape (positions,)")
    transmission_error: np.ndarray = _table("loaded transmission error [um], shape (torques, positions)")
    stiffness: np.ndarray = _table("tangent mesh stiffness dF/dTE [N/um], shape (torques, positions)")
    order: np.ndarray = _table("orders of the mesh frequency, shape (orders,)")
    amplitude: np.ndarray = _table("amplitudes of the transmission error [um], shape (torques, orders)")
    order_phase: np.ndarray = _table(
        "their phases [deg], shape (torques, orders): TE = mean + sum amplitude cos(360 deg order phase + order_phase)"
    )
    map_phase: np.ndarray = _table("mesh positions of the force map [base pitches], shape (map_positions,)")
    map_dte: np.ndarray = _table("dynamic transmission errors (DTE), rising [um], shape (map_positions, nodes)")
    map_force: np.ndarray = _table(
        "mesh force there [N], same shape; linear between nodes, and between positions at the same node"
    )
    teeth: np.ndarray = _table("teeth of pinion and wheel, shape (2,)")
    base_radius: np.ndarray = _table("base radii of pinion and wheel [mm], shape (2,)")
    inertia: np.ndarray = _table("moments of inertia of their bodies [kg m2], shape (2,)")
    equivalent_mass: float = _table("of both bodies on the line of action [kg]")
    status: np.ndarray = _table("0 where all contacts converged")

    def write(self, folder: str | Path) -> None:
        """Write `mesh.npz` and the tables as CSV into a folder; each file describes its units, signs and axes.

        Raises:
            ValueError: if a contact has not converged.
            OSError: if a file cannot be written.
        """
        if not self.converged:
            raise ValueError("MeshTables.write: a contact did not converge, must have converged at all positions")
        arrays = {of.name: np.asarray(getattr(self, of.name)) for of in fields(self)}
        about = [*CONVENTIONS, *(f"{of.name}: {of.metadata['meaning']}" for of in fields(self))]
        packed = io.BytesIO()
        np.savez_compressed(packed, about=np.asarray(about), **arrays)  # type: ignore[arg-type]
        path = Path(folder)
        path.mkdir(parents=True, exist_ok=True)
        write_durably(path / "mesh.npz", lambda file: file.write(packed.getvalue()))
        for name, lines, columns, rows in self._csv():
            _write_csv(path / name, (*lines, *CONVENTIONS), columns, rows)

    def _csv(self) -> Iterator[tuple[str, Sequence[str], Sequence[str], np.ndarray]]:
        """Name, lines of the header, columns and rows of every table."""
        by_torque = ["phase", *(f"{torque:.9g}_Nm" for torque in self.torques)]
        axes = "rows: phase; columns: torque on the pinion [N m]"
        for name, of, table in (
            ("transmission_error.csv", "loaded transmission error [um]", self.transmission_error),
            ("stiffness.csv", "tangent mesh stiffness dF/dTE [N/um]", self.stiffness),
        ):
            yield name, (of, axes), by_torque, np.column_stack([self.phase, table.T])
        nodes = np.broadcast_to(self.map_phase[:, None], self.map_dte.shape), self.map_dte, self.map_force
        lines: tuple[str, ...] = (
            f"mesh force [N] over phase and dynamic transmission error (DTE) [um], made for {self.torque:.9g} N m",
            f"{self.map_dte.shape[1]} nodes per phase, rising; linear between nodes, and between phases at equal node",
        )
        yield "force_map.csv", lines, ("phase", "dte_um", "force_N"), np.stack([each.ravel() for each in nodes], axis=1)
        torque, order = (each.ravel() for each in np.meshgrid(self.torques, self.order, indexing="ij"))
        rows = np.stack([torque, order, self.amplitude.ravel(), self.order_phase.ravel()], axis=1)
        lines = ("transmission error = mean + sum of amplitude cos(360 deg order phase + phase_deg)",)
        yield "te_orders.csv", lines, ("torque_Nm", "order", "amplitude_um", "phase_deg"), rows


def _write_csv(path: Path, lines: Sequence[str], columns: Sequence[str], rows: np.ndarray) -> None:
    header = "".join(f"# {line}\n" for line in lines) + ",".join(columns)
    text = io.StringIO()
    np.savetxt(text, rows, fmt="%.9g", delimiter=",", header=header, comments="")
    write_durably(path, lambda file: file.write(text.getvalue().encode()))


def mesh_tables(
    mesh: Mesh,
    torque: float,
    torques: Sequence[float] | np.ndarray = (),
    *,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
    orders: int | None = None,
    positions: int = 640,
    levels: int = 48,
) -> MeshTables:
    """Stiffness and transmission error over phase and torque, their orders, and the force over phase and DTE.

    Args:
        mesh: prepared mesh; stiffness and transmission error are tabulated at its positions.
        torque: positive torque on the pinion for the force map [N m].
        torques: further torques for stiffness and transmission error [N m], in any order.
        pinion: modification of the pinion flank; None for the nominal involute.
        wheel: modification of the wheel flank; None for the nominal involute.
        orders: number of orders of the transmission error, fewer than half of the positions; None for up to 10.
        positions: number of mesh positions of the force map, see `mesh_force`.
        levels: number of DTE levels of the force map, see `mesh_force`.

    Raises:
        TypeError: if the arguments are not a prepared mesh or modifications.
        ValueError: in one line for a number outside its range, and for all errors of `mesh_force`.
    """
    check_mesh(mesh)
    most = (mesh.resolution.positions - 1) // 2
    count = min(_ORDERS, most) if orders is None else whole("orders", orders, 1, most)
    load = operating_point_of(torque, mesh.slice_width.dtype).torque
    check("torque", load, "N m", low=0.0, open_low=True)
    every = np.unique([float(load), *np.asarray(torques, float).ravel()])
    check("torques", jnp.asarray(every), "N m", low=0.0)
    made = mesh_force(mesh, load, pinion=pinion, wheel=wheel, positions=positions, levels=levels)
    cycles = [solve(mesh, each, pinion=pinion, wheel=wheel) for each in jnp.asarray(every, load.dtype)]
    error = jnp.stack([cycle.transmission_error for cycle in cycles])
    phase, first = np.asarray(cycles[0].phase), float(mesh.kinematics.first_phase)
    found = harmonics(error, count, first_phase=first)
    start, force = np.asarray(made.start), np.asarray(made.node_force)  # type: ignore[attr-defined]
    beyond = start[..., None] + np.asarray(dte_levels(made.reach, levels))  # type: ignore[attr-defined]
    gears = mesh.pair.pinion, mesh.pair.wheel
    return MeshTables(
        torque=float(load),
        torques=every,
        phase=phase,
        transmission_error=np.asarray(error),
        stiffness=np.stack([np.asarray(cycle.tangent_stiffness) for cycle in cycles]),
        order=np.arange(1, count + 1),
        amplitude=np.asarray(found.amplitude),
        order_phase=np.asarray(found.phase),
        map_phase=np.asarray(first + np.arange(positions) / positions),
        # without backlash rounding may swap the ends of the clearance
        map_dte=np.maximum.accumulate(np.concatenate([-beyond[1, :, ::-1], beyond[0]], axis=1), axis=1),
        map_force=np.concatenate([-force[1, :, ::-1], force[0]], axis=1),
        teeth=np.array([int(gear.teeth) for gear in gears]),
        base_radius=np.array([float(gear.signed(gear.base_radius)) for gear in gears]),
        inertia=np.array([float(inertia_of(gear)) for gear in gears]),
        equivalent_mass=float(equivalent_mass(mesh.pair)),
        status=np.max([np.asarray(made.status).max(), *(np.asarray(cycle.status).max() for cycle in cycles)]),  # type: ignore[attr-defined]
    )
