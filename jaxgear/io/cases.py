"""Loads and tolerances that the tables of a design file ask for."""

from ..conditions import LoadSpectrum
from ..tolerance import Tolerance, ToleranceClass
from .design_file import DesignFile
from .errors import DesignFileError, problem, refuse_given, refused
from .schema_optimize import OptimizeSection
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
    return _class_of(design, "pinion", first), _class_of(design, "wheel", second)


def _class_of(design: DesignFile, name: str, quality: int) -> ToleranceClass:
    gear = getattr(design.pair(), name)
    try:
        return ToleranceClass.of(gear, quality)
    except ValueError as error:
        field, _, text = problem(error).partition(" = ")
        key, text = (f"{name}.{field}", text) if hasattr(gear, field) else (name, problem(error))
        raise DesignFileError(key, f"{text} for tolerances of ISO 1328-1") from None


def tolerance_of(design: DesignFile) -> Tolerance | None:
    """The tolerance of the table [tolerance] if there is one; without lead deviations on a mesh of one slice."""
    section = design.tolerance
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
