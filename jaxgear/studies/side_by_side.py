"""Designs side by side: table, lines and figures."""

from collections.abc import Iterator, Mapping
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..contact import Mesh
from ..io import DesignFile, describe
from ..io.results import unit_of
from ..io.tables import FurtherTable
from ..io.tolerance_table import quality_classes
from ..metrics import Finding, Quantity, findings_of
from ..microgeometry import AbstractModification
from ..numerics import program
from ..optimize import Verified
from ..report import Figure, Table
from ..vocabulary import quantities
from .evaluation import Evaluation, grid_lines, grid_of

Evaluations = Mapping[str, Evaluation]


_BY_FINITE_ELEMENTS = "  by finite elements"
WARNING = "warning: "
_HARRIS_CURVES = 7
_ORDERS = 8  # of the transmission error that are drawn
_TITLE = 9.0  # [pt]


def table(file: DesignFile, evaluations: Evaluations) -> Table:
    """Table of the designs side by side at the design torque."""
    result = Table(("", *evaluations), title=f"{file.title}, {file.load_in_words} on the pinion")
    first = next(iter(evaluations.values()))
    second = verified(evaluations)
    rows = _quantities_of(evaluations)
    asked = [quantity for quantity in rows if quantity.named in first.objectives]
    for label in objectives(evaluations):
        result.add_row(label, *(format(evaluation.objectives[label], ".4g") for evaluation in evaluations.values()))
        if second:
            result.add_row(_BY_FINITE_ELEMENTS, *(format(each.objectives[label], ".4g") for each in second))
    for quantity in dict.fromkeys([*asked, *rows]):  # requested quantities come first
        cells = (evaluation.metrics[quantity.key] for evaluation in evaluations.values())
        result.add_row(quantity.heading, *(format(cell, quantity.form) for cell in cells))
        if second and (quantity.name == "ppte" or quantity in asked):
            found = [each.ppte if quantity.name == "ppte" else each.objectives[quantity.named] for each in second]
            result.add_row(_BY_FINITE_ELEMENTS, *(format(each, quantity.form) for each in found))
    result.add_section()
    flanks = [dict(_flank_cells(evaluation)) for evaluation in evaluations.values()]
    for label in dict.fromkeys(label for cells in flanks for label in cells):
        result.add_row(label, *(cells.get(label, "-") for cells in flanks))
    if any(flanks):
        result.add_section()
    result.add_row("computing time [s]", *(f"{evaluation.seconds:.2f}" for evaluation in evaluations.values()))
    return result


def failures(evaluations: Evaluations) -> Iterator[str]:
    """Line for every design whose contact has not converged at some torque."""
    for name, evaluation in evaluations.items():
        if evaluation.failed_torques:
            torques = ", ".join(f"{torque:g}" for torque in evaluation.failed_torques)
            yield (
                f"CONTACT SOLUTION NOT CONVERGED: {name} at {torques} N m, {evaluation.cause}; do not use its numbers. "
                "Raise resolution.newton_steps, or resolution.pairs where the deflection is large."
            )


def findings(file: DesignFile, mesh: Mesh, evaluations: Evaluations) -> dict[str, tuple[Finding, ...]]:
    """Findings by the name of the design."""
    options: dict[str, Any] = {"torque_range": file.torque_range, "speed": file.speed, "friction": file.friction}
    options |= {"compliance": mesh.compliance, "lubricant": file.tables.get("lubricant")}
    found = {}
    for name, design in evaluations.items():
        options |= {"pinion": design.pinion, "wheel": design.wheel}
        options |= {"oil_friction": design.metrics.get("friction_coefficient")}
        options |= {"bulk_temperature": design.metrics.get("bulk_temperature_degC")}
        if mesh.support is not None:
            options["support_deflection"] = float(_support_deflection(mesh, design.cycle.line_load))
        options["verified"] = design.verified and design.verified.ppte
        found[name] = findings_of(design.cycle, **options)
        for given in (each for each in file.tables.values() if isinstance(each, FurtherTable)):
            found[name] += given.findings(file, design.cycle)
    return found


@program
def _support_deflection(mesh: Mesh, line_load) -> Float[Array, ""]:
    """Mean transmission error due to the deflection of the support [um]."""
    return jnp.mean(mesh.support_deflection(line_load))


def finding_lines(found: Mapping[str, tuple[Finding, ...]]) -> Iterator[str]:
    """Line for every finding, with the designs that have it and their values if these differ."""
    grouped: dict[tuple[str, str], dict[str, Finding]] = {}
    for design, several in found.items():
        for finding in several:
            grouped.setdefault((finding.key, finding.where), {})[design] = finding
    for same in grouped.values():
        finding = list(same.values())[-1]  # the main design is the last
        numbers = {design: each.number for design, each in same.items()}
        if len(set(numbers.values())) > 1:
            said = f"{', '.join(f'{design} {number}' for design, number in numbers.items())}: "
        else:
            said = "" if len(same) == len(found) else f"{', '.join(same)}: "
        yield f"{WARNING}{said}{finding}"


def grid(evaluations: Evaluations, more: str = "") -> Iterator[str]:
    """Lines on the grid of the mesh and on the changes on a finer grid, with the text `more`."""
    moving = next(iter(evaluations.values())).cycle.kinematics
    changes = {name: evaluation.grid_change for name, evaluation in evaluations.items()}
    return grid_lines(grid_of(moving.resolution, helical=moving.helical), changes, more)


def _quantities_of(evaluations: Evaluations) -> list[Quantity]:
    """Quantities evaluated for all designs, in the order of the vocabulary."""
    known = [evaluation.metrics for evaluation in evaluations.values()]
    return [quantity for quantity in quantities.values() if all(quantity.key in metrics for metrics in known)]


def objectives(evaluations: Evaluations) -> list[str]:
    """Labels of objectives of an optimization that are not rows of the table already."""
    known = {quantity.named for quantity in _quantities_of(evaluations)}
    return [label for label in next(iter(evaluations.values())).objectives if label not in known]


def verified(evaluations: Evaluations) -> list[Verified]:
    """Results of the designs with the finite-element structure; empty if it was not evaluated."""
    return [evaluation.verified for evaluation in evaluations.values() if evaluation.verified is not None]


def main(evaluations: Evaluations) -> Evaluation:
    """Evaluation of the main design: the optimum if it exists, else the last."""
    return evaluations[main_name(evaluations)]


def main_name(evaluations: Evaluations) -> str:
    """Name of the main design."""
    return "optimum" if "optimum" in evaluations else list(evaluations)[-1]


def figures(file: DesignFile, mesh: Mesh, evaluations: Evaluations, torques: np.ndarray) -> Iterator[Figure]:
    """Figures of the designs, the lines of the main one bold; the Harris map shows the main one."""
    from .. import plot

    for figure in _figures(file, mesh, evaluations, torques):
        plot.emphasize(figure.figure, main_name(evaluations))
        yield figure


def _figures(file: DesignFile, mesh: Mesh, evaluations: Evaluations, torques: np.ndarray) -> Iterator[Figure]:
    from .. import plot

    cycles = {name: evaluation.cycle for name, evaluation in evaluations.items()}
    few = np.unique(np.linspace(0, len(torques) - 1, _HARRIS_CURVES).round().astype(int))
    ppte = {name: evaluation.ppte for name, evaluation in evaluations.items()}
    best = main(evaluations)
    yield Figure.of(plot.transmission_error, cycles)
    yield Figure.of(plot.transmission_error_orders, cycles, count=_orders(mesh))
    yield Figure.of(plot.load_sharing, cycles)
    yield Figure.of(plot.pressure, cycles)
    if mesh.resolution.slices > 1:
        yield from _maps(mesh, best, main_name(evaluations))
    yield Figure.of(plot.k_chart, mesh, flanks(evaluations), **_band(file, evaluations))
    if mesh.resolution.slices > 1:
        yield Figure.of(plot.lead_chart, mesh, flanks(evaluations), **_band(file, evaluations))
    yield Figure.of(plot.ppte_over_torque, torques, ppte, design_torque=file.torque)
    of_main = best.transmission_error[few]
    yield Figure.of(plot.harris_map, mesh.phase, torques[few], of_main, design=main_name(evaluations))
    if mesh.resolution.slices > 1:
        factors = {name: evaluation.face_load for name, evaluation in evaluations.items()}
        yield Figure.of(plot.face_load_over_torque, torques, factors, design_torque=file.torque)


def _maps(mesh: Mesh, design: Evaluation, name: str) -> Iterator[Figure]:
    """Figures of one design over the face, with its name."""
    from .. import plot

    cycle = design.cycle
    for draw in (plot.pressure_map, *([plot.plane_of_action] * cycle.kinematics.helical), plot.contact_pattern):
        figure = Figure.of(draw, cycle)
        first = np.ravel(figure.axes)[0]
        over = {"pad": plot.figure.ABOVE_MARKS} if first.texts else {}
        first.set_title(name, loc="left", fontsize=_TITLE, **over)
        yield figure
    for figure in (Figure.of(plot.line_load, cycle), Figure.of(plot.face_gap, cycle, mesh)):
        figure.axes.get_legend().set(title=name, alignment="left")
        yield figure


def _orders(mesh: Mesh) -> int:
    """Number of orders that the positions resolve, at most `_ORDERS`."""
    return max(1, min(_ORDERS, (mesh.resolution.positions - 1) // 2))


def _band(file: DesignFile, evaluations: Evaluations) -> dict[str, Any]:
    """The tolerance band of a chart about the main design, where the file names a quality class."""
    classes = quality_classes(file)
    return {} if classes is None else {"tolerance": classes, "about": main_name(evaluations)}


def flanks(evaluations: Evaluations) -> dict[str, tuple[AbstractModification, AbstractModification]]:
    """Modifications (pinion, wheel) by the name of the design."""
    return {name: (evaluation.pinion, evaluation.wheel) for name, evaluation in evaluations.items()}


def _flank_cells(evaluation: Evaluation) -> Iterator[tuple[str, str]]:
    """Label and text of every number of both modifications."""
    for gear, modification in (("pinion", evaluation.pinion), ("wheel", evaluation.wheel)):
        seen: dict[str, int] = {}
        for part in describe(modification):
            name = part.pop("type")
            kind = name.replace("_", " ")
            seen[kind] = seen.get(kind, 0) + 1
            again = f" {seen[kind]}" if seen[kind] > 1 else ""
            for field, value in part.items():
                unit = f" [{unit_of(name, field)}]" if unit_of(name, field) else ""
                yield f"{gear} {kind}{again}, {field}{unit}", _text(value)


def _text(value, form: str = ".3f") -> str:
    if isinstance(value, dict):
        numbers = [_text(number, ".3g") for name, number in value.items() if name != "type"]
        return " ".join([value["type"], *numbers])
    if isinstance(value, list):
        return " ".join(_text(number, ".3g") for number in value) if len(value) <= 4 else f"({len(value)} values)"
    return value if isinstance(value, str) else format(value, form)
