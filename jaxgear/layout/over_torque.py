"""K_Hbeta of a mesh on its shafts over the torque, by the one-dimensional analysis."""

from jaxtyping import Array, Float

from ..conditions import LoadSpectrum
from ..numerics import program, whole
from ..shafts import AbstractSupport, face_load_factor
from .flank_line import FlankLine
from .life import face_loads, under_loads
from .stations import STATIONS, Stations


def face_load_over_torques(
    support: AbstractSupport,
    torques,
    *,
    pinion: FlankLine | None = None,
    wheel: FlankLine | None = None,
    stations: int = STATIONS,
) -> Float[Array, " torques"]:
    """K_Hbeta at several torques, without deviations.

    Args:
        support: shafts at the mesh; couplings are scaled to every torque, loads from outside stay.
        torques: on the pinion [N m], shape (torques,), all different.
        pinion, wheel: flank lines; None for none.
        stations: over the face.

    Raises:
        ValueError: for torques that are negative or repeated, and other numbers out of range.
    """
    whole("face_load_over_torques", "stations", stations, 2, 1001)
    faces = under_loads(support, LoadSpectrum(torques), stations=stations)
    return _factors(faces, pinion or FlankLine(), wheel or FlankLine())


@program
def _factors(faces: Stations, pinion: FlankLine, wheel: FlankLine) -> Float[Array, " torques"]:
    return face_load_factor(face_loads(faces, pinion, wheel).line_load)
