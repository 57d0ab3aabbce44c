"""A second opinion on designs: what they are worth where finite elements stand in for the structure of the mesh."""

from dataclasses import dataclass, replace
from pathlib import Path

import equinox as eqx
import numpy as np

from ..compliance import TabulatedCompliance, finite_element_compliance
from ..conditions import solve_case, solved
from ..contact import Mesh, MeshCycle, prepare
from ..contact.mesh import begin_mesh
from ..microgeometry import AbstractModification
from .problem import Problem
from .result import Optimum
from .verdict import judged


class Verified(eqx.Module):
    """What a design is worth by one model of the structure and by finite elements, all else being equal.

    Attributes:
        claimed: PPTE by the structure of the mesh [um].
        ppte: PPTE by the finite-element structure [um]; infinite where a contact solution failed.
        claimed_objectives: what a search made small, by name and unit; empty where it levelled a curve.
        objectives: the same by the finite-element structure, by the same measure over the same cases.
        cycle: mesh cycle by the finite-element structure.
    """

    claimed: float
    ppte: float
    claimed_objectives: dict[str, float]
    objectives: dict[str, float]
    cycle: MeshCycle

    def __str__(self) -> str:
        rows = [("PPTE [um]", self.claimed, self.ppte)]
        rows += [(name, self.claimed_objectives[name], value) for name, value in self.objectives.items()]
        lines = [f"{'':<24} {'claimed':>10} {'finite elements':>16}"]
        return "\n".join([*lines, *(f"{name:<24} {claimed:>10.4g} {found:>16.4g}" for name, claimed, found in rows)])


@dataclass(frozen=True)
class Verification:
    """Evaluates designs of a mesh with the finite-element structure in place of its own; `verification` makes one."""

    _mesh: Mesh
    _problem: Problem | None  # on that mesh

    def __call__(
        self, cycle: MeshCycle, objectives: dict[str, float], pinion: AbstractModification, wheel: AbstractModification
    ) -> Verified:
        """Both numbers of a design.

        Args:
            cycle: of the design on the mesh; its operating point is that of the PPTE.
            objectives: as `judged` by the problem on the mesh.
            pinion, wheel: its modifications.
        """
        found = solve_case(self._mesh, cycle.operating_point, pinion, wheel)
        others = {} if self._problem is None else judged(self._problem, pinion, wheel)
        return Verified(_ppte(cycle), _ppte(found), objectives, others, found)


def verification(mesh: Mesh, compliance: TabulatedCompliance, problem: Problem | None = None) -> Verification:
    """What evaluates designs of a mesh with tables of its gears.

    Args:
        mesh: prepared mesh, by whose structure the numbers are claimed.
        compliance: tables of its gears, see `structure_for`.
        problem: whose objectives are compared besides the PPTE.
    """
    other = prepare(mesh.pair, compliance=compliance, resolution=mesh.resolution, support=mesh.support)
    other = replace(other, automatic=mesh.automatic)
    return Verification(other, None if problem is None else problem.on(other))


def structure_for(mesh: Mesh, *, cache: str | Path | bool | None = True) -> TabulatedCompliance:
    """Finite-element tables for the gears and the plane of a mesh, which take seconds where they are not on the disk.

    Args:
        mesh: prepared mesh of concrete gears.
        cache: as in `finite_element_compliance`.

    Raises:
        ValueError: for a mesh whose structure is a table already, gears that are traced, and a shape that cannot be
            meshed.
    """
    if isinstance(mesh.compliance, TabulatedCompliance):
        raise ValueError("verify: mesh has the finite-element structure already, there is nothing to compare it with")
    return finite_element_compliance(mesh.pair, mesh.compliance.plane, cache=cache)


def begin_verification(mesh: Mesh, compliance: TabulatedCompliance, positions: int | None = None) -> None:
    """Starts to compile what `verification` needs, where programs are kept, while a search goes on.

    Args:
        mesh: prepared mesh on which the search begins.
        compliance: tables of its gears.
        positions: of the mesh on which it ends; None for those of the mesh.
    """
    count = mesh.resolution.positions if positions is None else positions
    sizes = replace(mesh.resolution, positions=count)
    begin_mesh(mesh.pair, compliance, sizes, mesh.support, mesh.even)


def verify(optimum: Optimum, *, cache: str | Path | bool | None = True) -> Verified:
    """Evaluates an optimum again with the finite-element structure on the same mesh, in the same cases.

    A search finds the best design of its model: what it claims below the accuracy of the model is not there. It takes
    seconds for the tables of the gears when they are new, and then milliseconds.

    Args:
        optimum: of any method; of a front, its compromise.
        cache: as in `finite_element_compliance`.

    Raises:
        ValueError: as `structure_for`.
    """
    flanks = optimum.pinion, optimum.wheel
    second = verification(optimum.mesh, structure_for(optimum.mesh, cache=cache), optimum.problem)
    claimed = {} if optimum.problem is None else judged(optimum.problem, *flanks)
    return second(optimum.cycle, claimed, *flanks)


def _ppte(cycle: MeshCycle) -> float:
    return float(np.ptp(np.asarray(cycle.transmission_error))) if solved(cycle) else float("inf")
