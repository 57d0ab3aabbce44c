"""Loads and tolerances that the tables of a design file ask for."""

from ..conditions import LoadSpectrum
from ..tolerance import Tolerance, ToleranceClass
from .design_file import DesignFile
from .errors import DesignFileError, refuse_given, refused
from .schema import OptimizeSection
from .schema_sweep import SweepSection


def load_of(design: DesignFile, table: str, section: OptimizeSection | SweepSection) -> LoadSpectrum:
    """The load spectrum of a table; the design torque where it names no torques."""
    if section.torques is None:
        refuse_given(table, section, ["weights"], f" without {table}.torques")
    return spectrum(design, table, section.torques or [design.torque], section.weights)


def spectrum(
    design: DesignFile,
    table: str,
    torques: list[float],
    weights: list[float] | None,
    speeds: list[float] | None = None,
) -> LoadSpectrum:
    """The load spectrum of keys of a table, at the speed of the file where it has no speeds of its own."""
    run_at = {"speeds": design.speed if speeds is None else speeds, "friction": design.friction}
    load = refused(f"{table}.{'torques' if speeds is None else 'speeds'}", LoadSpectrum, torques, **run_at)
    return load if weights is None else refused(f"{table}.weights", LoadSpectrum, torques, weights, **run_at)


def quality_classes(design: DesignFile) -> tuple[ToleranceClass, ToleranceClass] | None:
    """The flank tolerances of pinion and wheel where the file names their classes."""
    if design.quality_classes is None:
        return None
    first, second = design.quality_classes
    pair = design.pair()
    return ToleranceClass.of(pair.pinion, first), ToleranceClass.of(pair.wheel, second)


def tolerance_of(design: DesignFile) -> Tolerance | None:
    """The tolerance of the table [tolerance] if there is one; without lead deviations on a mesh of one slice."""
    section = design.tolerance
    if section is None:
        return None
    given = {"quality_class": section.quality_class, "misalignment": section.misalignment}
    tolerance = refused("tolerance", Tolerance.from_class, design.pair(), **given)
    if design.resolution().slices > 1:
        return tolerance
    if section.misalignment is not None:
        problem = "needs resolution.slices of at least 2, one slice cannot show it"
        raise DesignFileError("tolerance.misalignment", problem)
    return tolerance.without_lead()
