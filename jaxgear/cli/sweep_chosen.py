"""The best variants of a sweep, evaluated like the designs of `jaxgear analyze`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import jax
import numpy as np
import rich.table

from ..contact import Mesh, Resolution
from ..io import DesignFile
from ..metrics import findings_of
from ..microgeometry import NoModification
from ..sweeps import SweepTable, over_torques
from . import report
from .progress import Stages
from .run import Modifications, torques_of
from .study import evaluate, grid_change, grid_line

CHOSEN = 3  # variants


@dataclass(frozen=True)
class Chosen:
    """What was found of the best variants.

    Attributes:
        tables: side by side with the unmodified pair, best first.
        figures: files of their pictures.
        pages: those of each variant alone, by its name.
        findings: what is not usual of them; None where they are not evaluated.
        failures: what is not to be trusted.
        lines: why they are not evaluated.
    """

    tables: Sequence[rich.table.Table] = ()
    figures: Sequence[Path] = ()
    pages: Mapping[str, Sequence[Path]] = field(default_factory=dict)
    findings: Sequence[str] | None = None
    failures: Sequence[str] = ()
    lines: Sequence[str] = ()


def evaluate_best(
    folder: Path, design: DesignFile, best: SweepTable, size: Resolution, *, quick: bool, figures: bool
) -> Chosen:
    """Evaluates the best variants at the torques of the design file.

    Variants of more than the flanks, of other gears or loads, have no common mesh and stay as the table has them.

    Args:
        folder: for the pictures.
        design: the design file.
        best: the best variants, best first.
        size: array sizes of the mesh.
        quick: few torques.
        figures: whether pictures are drawn.
    """
    if design.open_case or not len(best):
        why = ["The variants differ in more than their flanks: their numbers are those of the table."]
        return Chosen(lines=why if len(best) else ())
    with Stages() as stages:
        stages.begin("evaluating the best variants")
        mesh, torques = jax.block_until_ready(design.mesh(size)), torques_of(design, quick=quick)
        involute = NoModification()
        modifications: dict[str, Modifications] = {"unmodified": (involute, involute)}
        first = best.take(range(min(CHOSEN, len(best))))
        for number, parameters in reversed([*zip(first.column("variant"), first.designs())]):
            modifications[f"variant {number}"] = design.design(parameters)
        found = {name: evaluate(design, mesh, torques, *flanks) for name, flanks in modifications.items()}
        drawn = report.write_figures(folder, design, mesh, found, torques) if figures else []
        pages = _alone(folder, mesh, found) if figures else {}
    findings = report.finding_lines(report.findings(design, mesh, found))
    best_first = {name: found[name] for name in ("unmodified", *reversed(list(found)))}
    return Chosen([report.table(design, best_first)], drawn, pages, list(findings), list(report.failures(found)))


def said_of_best(design: DesignFile, best: SweepTable, size: Resolution) -> tuple[str, list[str]]:
    """By how much the numbers of the best variant change on a finer mesh, and what is not usual of it."""
    parameters = best.take([0]).designs()[0]
    made = design.sweep_mesh(size)
    mesh = made if isinstance(made, Mesh) else made(parameters)
    torque = float(design.operating_point(parameters).torque)
    pinion, wheel = design.design(parameters)
    (cycle,) = over_torques(mesh, np.asarray([torque]), pinion=pinion, wheel=wheel)
    name = f"variant {best.column('variant')[0]} at {torque:g} N m"
    findings = findings_of(cycle, pinion=pinion, wheel=wheel, compliance=mesh.compliance)
    grid = grid_line(f"{size.positions} positions", {name: grid_change(mesh, cycle, pinion, wheel)})
    return grid, [f"{report.WARNING}{name}: {finding}" for finding in findings]


def _alone(folder: Path, mesh: Mesh, found: report.Evaluations) -> dict[str, list[Path]]:
    """Pictures of each variant beside the unmodified pair alone."""
    from .. import plot

    first, *others = found
    pages = {}
    for name in others:
        both = {first: found[first], name: found[name]}
        axes = {
            "transmission_error": plot.transmission_error({one: of.cycle for one, of in both.items()}),
            "k_chart": plot.k_chart(mesh, report.flanks(both)),
        }
        named = {f"{kind}_{name.replace(' ', '_')}": ax for kind, ax in axes.items()}
        pages[name] = report.save_figures(folder, named, bold=name)
    return pages
