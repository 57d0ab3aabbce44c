"""What the main design of an optimization gains over the others, first in the objective that was asked for."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from ..optimize import Problem
from . import report

_PPTE = "ppte [um]"
_SAME = 0.05  # [%]; a smaller change rounds to nothing
_NO_RATIO = ("degC",)  # units whose zero is a convention


@dataclass(frozen=True)
class Judged:
    """A number by which designs are compared.

    Attributes:
        label: name in words.
        unit: "" for a pure number.
        sign: 1 where small values are the better ones, else -1.
        values: by the name of the design.
        verified: the same with the finite-element structure; empty where that was not asked for.
    """

    label: str
    unit: str
    sign: int
    values: Mapping[str, float]
    verified: Mapping[str, float]

    def change(self, before: float, after: float, than: str) -> str:
        """What becomes of a number: "31.1 % less than unmodified"; "" where nobody can say."""
        if not (math.isfinite(before) and math.isfinite(after)):
            return ""
        worse = " (worse)" if self.sign * (after - before) > 0 else ""
        if self.unit in _NO_RATIO or before <= 0:
            return f"{after - before:+.3g} {self.unit}".rstrip() + f"{worse} against {than}"
        percent = 100 * (after / before - 1)
        if abs(percent) < _SAME:
            return f"as {than}"
        return f"{abs(percent):.1f} % {'more' if percent > 0 else 'less'}{worse} than {than}"

    def row(self, values: Mapping[str, float]) -> str:
        """The main design, which is the last, against the first and against those between."""
        form = ".3f" if self.unit == "um" else ".4g"
        (first, before), *others, (_, after) = values.items()
        changes = [self.change(before, after, first)]
        changes += [self.change(value, after, f"{other} ({value:{form}})") for other, value in others]
        said = ", ".join(change for change in changes if change)
        return f"{before:{form}} -> {after:{form}} {self.unit}".rstrip() + f": {said}" * bool(said)


def gains(evaluations: report.Evaluations, problem: Problem | None) -> Iterator[tuple[str, str]]:
    """Rows of label and text: the objectives, then PPTE where it is none of them, each by finite elements too.

    Args:
        evaluations: designs by their names, the first of which is unmodified.
        problem: by whose measure they were judged; None for PPTE alone.
    """
    main = report.main_name(evaluations)
    compared = {name: found for name, found in evaluations.items() if not name.startswith("as ")}
    compared = {name: compared[name] for name in (*(name for name in compared if name != main), main)}
    for judged in _numbers(compared, problem):
        yield judged.label, judged.row(judged.values)
        if judged.verified:
            yield "  by finite elements", judged.row(judged.verified)


def _numbers(evaluations: report.Evaluations, problem: Problem | None) -> Iterator[Judged]:
    signs = [of.sign for of in problem.objectives] if problem is not None else []
    labels = list(next(iter(evaluations.values())).objectives)
    several = all(found.verified is not None for found in evaluations.values())
    for label, sign in zip(labels, signs):
        name, _, unit = label.partition(" [")
        verified = {of: found.verified.objectives[label] for of, found in evaluations.items() if found.verified}
        values = {of: found.objectives[label] for of, found in evaluations.items()}
        yield Judged(words(name), unit.rstrip("]"), sign, values, verified if several else {})
    if _PPTE not in labels:
        verified = {of: found.verified.ppte for of, found in evaluations.items() if found.verified}
        values = {of: float(found.metrics["ppte_um"]) for of, found in evaluations.items()}
        yield Judged(words("ppte"), "um", 1, values, verified if several else {})


def words(name: str) -> str:
    """Name of a quantity as a table says it."""
    return name.replace("ppte", "PPTE").replace("_", " ")
