"""Load spectra of the tables of a design file."""

from typing import Any

from ..conditions import LoadSpectrum
from .design_file import DesignFile
from .errors import refused


def load_of(design: DesignFile, section: Any) -> LoadSpectrum:
    """The load spectrum of a table with torques and weights; the design torque where it names no torques."""
    if section.torques is None:
        section.refuse(["weights"], f" without {section.at}.torques")
    return spectrum(design, section.at, section.torques or [design.torque], section.weights)


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
