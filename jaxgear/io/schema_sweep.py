"""The layout of the tables [sweep] and [tolerance]."""

from typing import Annotated

from ..tolerance import Tolerance
from .kinds import LEVEL, QUALITY_CLASSES, SEED, WEIGHTS, choice, count, either, list_of, positive, real, table, text
from .layout import Section, section_of


class SweepSection(Section):
    """Variants to be evaluated.

    Attributes:
        sampling: how they are spread over the bounds of the variables.
        samples: number of variants, of "sobol" and "latin_hypercube".
        seed: of the same.
        levels: values per variable, of "full_factorial": one number, or a number or list of values per variable.
        file: CSV or Parquet file of the variants, of "list".
        torques: on the pinion; the design torque alone without it.
        weights: of the torques.
        results: quantities to be listed.
        part_rows: variants per file of the table; without it there are about 64 files.
    """

    sampling: Annotated[str, choice("sobol", "latin_hypercube", "full_factorial", "list")] = "sobol"
    samples: Annotated[int | None, count(1, 2**40)] = None
    seed: Annotated[int | None, SEED] = None
    levels: Annotated[
        int | dict[str, int | list[float]] | None,
        either(
            LEVEL,
            table(either(LEVEL, list_of(real()), "a whole number or a list of values")),
            "a whole number, or a table with one entry per variable",
        ),
    ] = None
    file: Annotated[str | None, text()] = None
    torques: Annotated[list[float] | None, list_of(positive("N m"))] = None
    weights: Annotated[list[float] | None, WEIGHTS] = None
    results: Annotated[list[str] | None, list_of(text())] = None
    part_rows: Annotated[int | None, count(1, 2**24)] = None


class ToleranceSection(section_of(Tolerance, ("pinion", "wheel", "distribution"), open=False)):  # type: ignore[misc]
    """Deviations of manufactured gears after ISO 1328-1: the scatter of all designs of analyze, optimize and wear.

    Attributes:
        quality_class: of both gears, or of pinion and wheel; that of the gears without it.
        samples: manufactured pairs per design, or variant of a sweep.
        seed: of their deviations.
    """

    quality_class: Annotated[int | list[int] | None, QUALITY_CLASSES] = None
    samples: Annotated[int, count(2, 100_000)] = 64
    seed: Annotated[int, SEED] = 0
