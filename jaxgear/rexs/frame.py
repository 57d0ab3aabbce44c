"""One gear's flank within its pair, in the coordinates of REXS.

REXS counts along the profile by diameters, the library by roll lengths. Over the face both count along the axis from
the middle of the gear's face. Where REXS speaks of the datum face, its gears say at which end it is.
"""

from dataclasses import dataclass
from typing import Literal

import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from ..geometry import Gear, GearPair, path_of_contact
from ..microgeometry import AbstractModification, Flank
from ..numerics import program

_SAME = 1e-9  # mm: what a diameter in 12 digits leaves open
_ROUNDING = 1e-12  # of the squares of radii
_POINTS = 1024  # evaluated at a time: one shape is compiled once


@dataclass(frozen=True)
class Frame:
    """One gear's flank within its pair, all numbers in mm.

    Attributes:
        base_radius: base radius of the gear, negative of a ring gear.
        start, tip: roll lengths at both ends of the active profile, likewise.
        width: face width of the gear.
        datum: -1 where the datum face is at negative coordinates of the file, 1 at positive ones.
        mirror: -1 where face coordinates of the library are those of the file with the other sign.
    """

    base_radius: float
    start: float
    tip: float
    width: float
    datum: int = -1
    mirror: int = 1

    def diameter(self, roll_length: ArrayLike) -> np.ndarray | np.floating:
        """Diameter at a roll length."""
        return 2 * np.hypot(self.base_radius, roll_length)

    def roll_length(self, diameter: ArrayLike) -> np.ndarray:
        """Roll length at a diameter; NaN below the base circle."""
        square = (0.5 * np.asarray(diameter)) ** 2 - self.base_radius**2
        below = square < -_ROUNDING * self.base_radius**2
        return np.where(below, np.nan, np.copysign(np.sqrt(np.maximum(square, 0.0)), self.base_radius))

    def place(self, face: str, length: float) -> float:
        """Coordinate of the file at a distance from the middle towards the "datum_face" or the "non_datum_face"."""
        return self.datum * length if face == "datum_face" else -self.datum * length

    def side(self, face: str) -> Literal["negative", "positive"]:
        """End of the face, "negative" or "positive" by its coordinate, of the "datum_face" or the "non_datum_face"."""
        return "negative" if self.mirror * self.place(face, 1.0) < 0 else "positive"

    def removed(
        self, modification: AbstractModification, roll_length: ArrayLike, face_coordinate: ArrayLike
    ) -> np.ndarray:
        """Material removed at points of the flank [um], of the shape of their coordinates."""
        shape, count = np.shape(roll_length), np.size(roll_length)
        chunks = -(-count // _POINTS)
        padding = (0, chunks * _POINTS - count)
        points = [np.pad(np.ravel(of), padding, mode="edge") for of in (roll_length, face_coordinate)]
        parts = zip(*(np.split(of, chunks) for of in points))
        found = [np.asarray(_amount(modification, self._flank(rho, y))) for rho, y in parts]
        return np.concatenate([np.broadcast_to(part, _POINTS) for part in found])[:count].reshape(shape)

    def _flank(self, roll_length, face_coordinate) -> Flank:
        return Flank(
            roll_length=jnp.asarray(roll_length),
            tip_roll_length=jnp.asarray(self.tip),
            start_roll_length=jnp.asarray(self.start),
            base_radius=jnp.asarray(self.base_radius),
            face_coordinate=jnp.asarray(face_coordinate),
            face_width=jnp.asarray(self.width),
        )


@program
def _amount(modification: AbstractModification, flank: Flank):
    return modification(flank)


def frames(pair: GearPair) -> tuple[Frame, Frame]:
    """Frames of the flanks of pinion and wheel."""
    path = path_of_contact(pair)
    starts = path.pinion_roll_length(path.start), path.wheel_roll_length(path.end)
    pinion, wheel = (_frame(gear, start) for gear, start in zip(pair.gears, starts))
    return pinion, wheel


def _frame(gear: Gear, start) -> Frame:
    return Frame(float(gear.base_radius), float(start), float(gear.tip_roll_length), float(gear.face_width))


def same(first: float, second: float) -> bool:
    """True if two lengths are equal within the digits of a file [mm]."""
    return abs(first - second) <= _SAME
