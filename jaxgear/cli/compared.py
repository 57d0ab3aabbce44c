"""The designs that a study compares: unmodified, rule-based, that of the file or the optimum of its variables."""

import jax

from ..contact import Mesh
from ..io import DesignFile, OptimizeRequest, optimize_request
from ..io.schema import METHODS_WITHOUT_VARIABLES
from ..microgeometry import AbstractModification, NoModification
from ..optimize import Front
from .commands import rule_based
from .progress import Stages
from .run import coarse

Modifications = tuple[AbstractModification, AbstractModification]


def search_of(design: DesignFile, *, quick: bool) -> OptimizeRequest | None:
    """The search that the file asks for; None where its modifications are numbers and it names no method."""
    if design.bounds or design.optimize.method in METHODS_WITHOUT_VARIABLES:
        return optimize_request(design, quick=quick)
    return None


def first_mesh(design: DesignFile, torque: float, *, quick: bool) -> Mesh:
    """The mesh on which a search begins, up to a torque [N m]."""
    size = design.resolution(torque)
    return jax.block_until_ready(design.mesh(coarse(size) if quick else size))


def compared(
    design: DesignFile, torque: float, search: OptimizeRequest | None, stages: Stages, *, quick: bool
) -> tuple[Mesh, dict[str, Modifications]]:
    """The designs by their names, and the mesh on which they are compared, up to a torque [N m]."""
    stages.begin("preparing the mesh")
    mesh = first_mesh(design, torque, quick=quick)
    involute = NoModification()
    relief = rule_based(design)
    designs: dict[str, Modifications] = {"unmodified": (involute, involute), "rule-based": (relief, relief)}
    if not design.bounds:
        given = design.design({})
        if any(not isinstance(flank, NoModification) for flank in given):
            designs["modified"] = given
    if search is not None:
        stages.begin(f"searching the optimum ({search.method})")
        found = search(mesh, stages.step)
        optimum = found.compromise if isinstance(found, Front) else found
        designs["optimum"] = optimum.pinion, optimum.wheel
        mesh = optimum.mesh  # on which the search has ended
    return mesh, designs
