"""One tooth by its scale-free numbers, and its outline in double precision whatever the precision of JAX is.

The curves are those of `geometry.outline`, in NumPy: a table is made once, from numbers, on the same bits everywhere,
also where JAX computes in single precision or is tracing.
"""

from typing import NamedTuple, TypeVar

import numpy as np
import scipy  # its packages load when they are used

from ...geometry.cutter import Cutter, cutter_contact, rolling

_DIGITS = 7  # significant ones of the numbers, so that both precisions mean the same table


class Shape(NamedTuple):
    """Numbers that the elasticity of a gear depends on besides its size and its modulus; lengths in modules.

    Attributes:
        teeth: number of teeth.
        pressure_angle: pressure angle of the basic rack [deg].
        profile_shift, dedendum, root_radius: as in `Gear`.
        tip_ratio, bore_ratio: radii of tip and bore over the module.
        poisson: Poisson's ratio of the plane problem.
        allowance: tooth thickness allowance over the module.
        cutter_teeth, cutter_profile_shift: as in `Gear`; 0 teeth for a rack.
    """

    teeth: float
    pressure_angle: float
    profile_shift: float
    dedendum: float
    root_radius: float
    tip_ratio: float
    bore_ratio: float
    poisson: float
    allowance: float = 0.0
    cutter_teeth: float = 0.0
    cutter_profile_shift: float = 0.0

    @property
    def numbers(self) -> tuple[float, ...]:
        """All numbers of the gear; those of the cutter only where a cutter generates the tooth."""
        return tuple(self) if self.cutter_teeth else tuple(self[:-2])

    def rounded(self) -> "Shape":
        """The shape with numbers of seven significant digits, which single precision holds."""
        return Shape(*(float(f"{value:.{_DIGITS}g}") for value in self))


OneOrMany = TypeVar("OneOrMany", float, np.ndarray)


class Tooth:
    """Outline of the right flank; tooth frame and trochoid as in `geometry.outline`, lengths in modules.

    Attributes:
        shape: its numbers.
        base, root, tip, bore: radii.
        tip_roll_length, form_roll_length: ends of the involute.
        junction: parameter of the trochoid where it meets the involute [rad].
        root_half_angle: half angle of the tooth at the root circle [rad].
    """

    def __init__(self, shape: Shape) -> None:
        self.shape = shape
        self._alpha = alpha = np.deg2rad(shape.pressure_angle)
        self.pitch = 0.5 * shape.teeth
        self.base = self.pitch * np.cos(alpha)
        self._shift = shape.profile_shift + 0.5 * shape.allowance / np.tan(alpha)  # x_E of `Gear`
        self.root = self.pitch + self._shift - shape.dedendum
        self.tip, self.bore = shape.tip_ratio, shape.bore_ratio
        cutter = self._cutter = self._rolling()
        turn = (np.pi / 2 + 2 * self._shift * np.tan(alpha)) / shape.teeth
        self._base_half_angle = turn + np.tan(alpha) - alpha
        arc = shape.root_radius
        land = np.pi / 4 - shape.dedendum * np.tan(alpha) - (1 - np.sin(alpha)) * arc / np.cos(alpha)
        self._offset, self._depth = np.pi / 2 - land, shape.dedendum - self._shift - arc
        if cutter is not None:
            self.root = float(cutter.root_circle_radius)
            self._alpha = float(np.arctan(cutter.tangent))
        self.tip_roll_length = float(np.sqrt(max(self.tip**2 - self.base**2, 0.0)))
        self.junction, self.form_roll_length = self._junction()
        end = self.trochoid(np.pi / 2)
        self.root_half_angle = float(np.arctan2(end[0], end[1]))

    @property
    def sector_half_angle(self) -> float:
        """Half the angle of a pitch [rad]."""
        return np.pi / self.shape.teeth

    def trochoid(self, g: float | np.ndarray) -> np.ndarray:
        """Points of the fillet, shape (2, ...), from parameters [rad]."""
        r = self.pitch
        phi = (self._depth / np.tan(g) + self._offset) / r
        distance = self._depth / np.sin(g) + self.shape.root_radius
        if (cutter := self._cutter) is not None:
            r = float(cutter.gear_pitch_radius)
            reach, phi = cutter_contact(g, r, cutter.pitch_radius, cutter.offset, cutter.depth)
            distance = reach + self.shape.root_radius
        return np.stack([r * np.sin(phi) - distance * np.cos(g - phi), r * np.cos(phi) - distance * np.sin(g - phi)])

    def half_angle(self, rho: OneOrMany) -> OneOrMany:
        """Between centreline and involute [rad]."""
        return self._base_half_angle - (rho / self.base - np.arctan(rho / self.base))

    def involute(self, rho: float | np.ndarray) -> np.ndarray:
        """Points of the involute, shape (2, ...), from roll lengths."""
        r, angle = np.sqrt(self.base**2 + np.square(rho)), self.half_angle(np.asarray(rho))
        return np.stack([r * np.sin(angle), r * np.cos(angle)])

    def load_angle(self, rho: OneOrMany) -> OneOrMany:
        """Between the load line and the normal to the centreline [rad]."""
        return np.arctan(rho / self.base) - self.half_angle(rho)

    def depth(self, rho: OneOrMany) -> OneOrMany:
        """From a point of the flank to the centreline along the load line."""
        return self.involute(rho)[0] / np.cos(self.load_angle(rho))

    def crossing(self, rho: OneOrMany) -> OneOrMany:
        """Height at which the load line crosses the centreline."""
        return self.base / np.cos(self.load_angle(rho))

    def arc(self, rho: OneOrMany) -> OneOrMany:
        """Length of the involute from the base circle."""
        return np.square(rho) / (2 * self.base)

    def _junction(self) -> tuple[float, float]:
        """Where fillet and involute meet: parameter [rad] and roll length."""
        alpha = self._alpha
        straight = self.shape.dedendum - self._shift - self.shape.root_radius * (1 - np.sin(alpha))
        tangential = self.pitch * np.sin(alpha) - straight / np.sin(alpha)
        if self._cutter is not None:
            tangential = self._cutter.form_roll_length
        if tangential > -1e-12 * self.pitch:
            return float(alpha), max(float(tangential), 0.0)
        at_base = scipy.optimize.brentq(lambda g: np.hypot(*self.trochoid(g)) - self.base, alpha, np.pi / 2)
        cut = scipy.optimize.brentq(self._beside_involute, alpha, at_base)
        return float(cut), float(np.sqrt(max(np.sum(self.trochoid(cut) ** 2) - self.base**2, 0.0)))

    def _rolling(self) -> Cutter | None:
        """The cutter in mesh with the gear; None of a rack."""
        shape = self.shape
        if not shape.cutter_teeth:
            return None
        return rolling(
            shape.teeth,
            shape.cutter_teeth,
            module=1.0,
            pressure_angle=shape.pressure_angle,
            generating_shift=self._shift,
            cutter_shift=shape.cutter_profile_shift,
            height=shape.dedendum,
            radius=shape.root_radius,
        )

    def _beside_involute(self, g: float) -> float:
        x, y = self.trochoid(g)
        rho = np.sqrt(max(x**2 + y**2 - self.base**2, 0.0))
        return float(np.arctan2(x, y) - self.half_angle(rho))
