"""The table [tolerance], and the flank tolerances of the gears of a design file."""

from ..tolerance import ManufacturedGears, Tolerance, ToleranceClass
from .design_file import DesignFile
from .errors import DesignFileError, problem, refused
from .table_keys import entry, section_of
from .tables import FurtherTable
from .value_types import QUALITY_CLASSES, SEED, count

_LIMITS = section_of(Tolerance, ("pinion", "wheel", "distribution"), open=False)


class ToleranceSection(FurtherTable, _LIMITS):  # type: ignore[misc, valid-type]
    """Deviations of manufactured gears after ISO 1328-1: the scatter of all designs of analyze, optimize and wear.

    Attributes:
        quality_class: quality class of both gears, or of pinion and wheel; that of the gears without it.
        samples: manufactured pairs per design, or variant of a sweep.
        seed: seed of their deviations.
    """

    table = "tolerance"
    classified = True

    quality_class: int | list[int] | None = entry(QUALITY_CLASSES)
    samples: int = entry(count(2, 100_000), 64)
    seed: int = entry(SEED, 0)


def quality_classes(design: DesignFile) -> tuple[ToleranceClass, ToleranceClass] | None:
    """The flank tolerances of pinion and wheel where the file names their classes."""
    if design.quality_classes is None:
        return None
    first, second = design.quality_classes
    return _class_of(design, "pinion", first), _class_of(design, "wheel", second)


def _class_of(design: DesignFile, name: str, quality: int) -> ToleranceClass:
    gear = getattr(design.pair(), name)
    try:
        return ToleranceClass.of(gear, quality)
    except ValueError as error:
        field, _, text = problem(error).partition(" = ")
        key, text = (f"{name}.{field}", text) if hasattr(gear, field) else (name, problem(error))
        raise DesignFileError(key, f"{text} for tolerances of ISO 1328-1") from None


def manufactured_of(design: DesignFile, most: int | None = None) -> ManufacturedGears | None:
    """The manufactured gears of the table [tolerance] if there is one, at most so many pairs."""
    tolerance = tolerance_of(design)
    if tolerance is None:
        return None
    section = design.tables["tolerance"]
    return ManufacturedGears(tolerance, min(section.samples, most or section.samples), section.seed)


def tolerance_of(design: DesignFile) -> Tolerance | None:
    """The tolerance of the table [tolerance] if there is one; without lead deviations on a mesh of one slice."""
    section = design.tables.get("tolerance")
    if section is None:
        return None
    quality_classes(design)  # which names the gear that no class is made for
    given = {"quality_class": section.quality_class, "misalignment": section.misalignment}
    tolerance = refused("tolerance", Tolerance.from_class, design.pair(), **given)
    if design.resolution().slices > 1:
        return tolerance
    if section.misalignment is not None:
        needed = "needs resolution.slices of at least 2, one slice cannot show it"
        raise DesignFileError("tolerance.misalignment", needed)
    return tolerance.without_lead()
