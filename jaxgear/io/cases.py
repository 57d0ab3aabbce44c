"""Loads and tolerances that the tables of a design file ask for."""

from collections.abc import Sequence

from ..conditions import LoadSpectrum
from ..tolerance import Tolerance
from . import schema_sweep
from .design_file import DesignFile
from .errors import DesignFileError, refused


def load_of(design: DesignFile, table: str, torques: Sequence[float] | None, weights) -> LoadSpectrum:
    """The load spectrum of a table; the design torque where it names no torques."""
    if torques is None:
        if weights is not None:
            raise DesignFileError(design.path, f"{table}.weights", f"has no effect without {table}.torques")
        torques = [design.torque]
    run_at = {"speeds": design.speed, "friction": design.friction}
    load = refused(design.path, f"{table}.torques", LoadSpectrum, torques, **run_at)
    if weights is None:
        return load
    return refused(design.path, f"{table}.weights", LoadSpectrum, torques, weights, **run_at)


def tolerance_of(design: DesignFile, section: schema_sweep.ToleranceSection) -> Tolerance:
    """The tolerance of the table [tolerance]; without lead deviations on a mesh of one slice."""

    def make():
        return Tolerance.from_class(design.pair(), section.quality_class, misalignment=section.misalignment)

    tolerance = refused(design.path, "tolerance", make)
    if design.resolution().slices > 1:
        return tolerance
    if section.misalignment is not None:
        problem = "needs resolution.slices of at least 2, one slice cannot show it"
        raise DesignFileError(design.path, "tolerance.misalignment", problem)
    return tolerance.without_lead()
