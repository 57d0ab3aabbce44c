"""Whether a table of a flank can be of a gear: it must lie on the flank and cover most of it.

Beyond its ends a table goes on with its last values, so that one of another gear would pass for a flank unnoticed.
"""

from dataclasses import dataclass

from jaxtyping import Array, Float

from ..geometry import Gear, GearPair, path_of_contact
from .errors import DesignFileError

# Shares of the active profile or of the face. A trace may run over the edges by so much, which also covers the
# tolerance of the tip diameter; and it may leave out four times what ISO 1328-1 leaves out of the evaluation.
_BEYOND, _LEFT_OUT = 0.05, 0.2


@dataclass(frozen=True)
class FlankRange:
    """Where the points of a table are.

    Attributes:
        roll_length: first and last [mm].
        face_coordinate: first and last [mm], the same for a profile alone.
    """

    roll_length: tuple[float, float]
    face_coordinate: tuple[float, float]

    def check_on(self, gear: Gear, start_roll_length, common_width) -> None:
        """Refuses a gear whose flank this is not.

        Args:
            gear: of concrete numbers.
            start_roll_length: at the start of its active profile [mm].
            common_width: of its face and the mate's [mm].

        Raises:
            DesignFileError: in one line.
        """
        start, tip = float(start_roll_length), float(gear.tip_roll_length)
        active = tip - start
        if self.roll_length[1] > tip + _BEYOND * active:
            raise _refusal("reaches roll length", self.roll_length[1], "at most", tip, "the tip of the gear")
        if self.roll_length[0] > start + _LEFT_OUT * active:
            least = start + _LEFT_OUT * active
            raise _refusal("starts at roll length", self.roll_length[0], "at most", least, _profile(start, tip))
        if self.roll_length[1] < tip - _LEFT_OUT * active:
            least = tip - _LEFT_OUT * active
            raise _refusal("ends at roll length", self.roll_length[1], "at least", least, _profile(start, tip))
        self._check_face(0.5 * float(gear.face_width), 0.5 * float(common_width))

    def _check_face(self, half: float, common: float) -> None:
        face = f"the face is {2 * half:g} mm wide"
        low, high = self.face_coordinate
        furthest = high if high >= -low else low
        if abs(furthest) > half * (1 + 2 * _BEYOND):
            raise _refusal("reaches face coordinate", furthest, "within", half, face, sign="+-")
        if low == high:
            return
        covered = common * (1 - 2 * _LEFT_OUT)
        if low > -covered or high < covered:
            nearest = low if low > -covered else high
            raise _refusal("ends at face coordinate", nearest, "beyond", covered, face, sign="+-")


def starts(pair: GearPair) -> dict[str, Float[Array, ""]]:
    """Roll lengths at the starts of the active profiles [mm], by gear."""
    contact = path_of_contact(pair)
    return {
        "pinion": contact.pinion_roll_length(contact.start),
        "wheel": contact.wheel_roll_length(contact.end),
    }


def _profile(start: float, tip: float) -> str:
    return f"the active profile runs from {start:.6g} to {tip:.6g} mm"


def _refusal(what: str, value: float, relation: str, limit: float, why: str, sign: str = "") -> DesignFileError:
    return DesignFileError("", f"{what} {value:g} mm, must be {relation} {sign}{limit:.6g} mm ({why})")
