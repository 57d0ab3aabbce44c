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
        face_coordinate: first and last, from the middle of the gear's face [mm]; the same for a profile alone.
        step: from one to the next [mm]: lines may stand in the middles of slices.
    """

    roll_length: tuple[float, float]
    face_coordinate: tuple[float, float]
    step: float = 0.0

    def check_on(self, gear: Gear, start_roll_length, common_width, common_middle) -> None:
        """Refuses a gear whose flank this is not.

        Args:
            gear: of concrete numbers.
            start_roll_length: at the start of its active profile [mm].
            common_width: over which its face and the mate's overlap [mm].
            common_middle: of that from the middle of the gear's face [mm].

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
        self._check_face(float(gear.face_width), float(common_width), float(common_middle))

    def _check_face(self, width: float, common: float, middle: float) -> None:
        low, high = self.face_coordinate
        furthest, half = high if high >= -low else low, 0.5 * width
        if abs(furthest) > half + _BEYOND * width:
            face = f"the face is {width:g} mm wide"
            raise _refusal("reaches face coordinate", furthest, "within", half, face, sign="+-")
        if low == high:
            return
        ends = middle - 0.5 * common, middle + 0.5 * common
        face = f"the mate meets the face from {ends[0]:g} to {ends[1]:g} mm"
        least, most = ends[0] + _LEFT_OUT * common, ends[1] - _LEFT_OUT * common
        outside = _BEYOND * common
        if low - 0.5 * self.step >= ends[0] - outside and high + 0.5 * self.step <= ends[1] + outside:
            low, high = low - 0.5 * self.step, high + 0.5 * self.step  # ends of slices
        if low > least:
            raise _refusal("begins at face coordinate", low, "at most", least, face)
        if high < most:
            raise _refusal("ends at face coordinate", high, "at least", most, face)


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
