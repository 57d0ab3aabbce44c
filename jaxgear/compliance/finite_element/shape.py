"""One tooth by its scale-free numbers, and its outline in double precision whatever the precision of JAX is.

The curves are those of `geometry.outline`, in NumPy: a table is made once, from numbers, on the same bits everywhere,
also where JAX computes in single precision or is tracing. Of a ring gear, number of teeth, radii and roll lengths are
negative, as in ISO 21771; the formulas of external gears then hold for it.
"""

from typing import NamedTuple, TypeVar

import numpy as np
import scipy  # its packages load when they are used

from ...geometry.cutter import Cutter, cutter_contact, rolling
from ...geometry.fillet import FilletArc, fillet_arc

_DIGITS = 7  # significant ones of the numbers, so that both precisions mean the same table

OneOrMany = TypeVar("OneOrMany", float, np.ndarray)


class Shape(NamedTuple):
    """Numbers that the elasticity of a gear depends on besides its size and its modulus; lengths in modules.

    Attributes:
        teeth: number of teeth, negative for a ring gear.
        pressure_angle: pressure angle of the basic rack [deg].
        profile_shift, dedendum, root_radius: as in `Gear`; the root radius of a ring gear without cutter is the radius
            of its given fillet.
        tip_ratio, bore_ratio: radii of the tip circle and of the held circle over the module; the latter is the bore,
            or the rim circle of a ring gear.
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

    @property
    def is_internal(self) -> bool:
        """True for a ring gear."""
        return self.teeth < 0

    def signed(self, value: OneOrMany) -> OneOrMany:
        """A positive radius, roll length or angle with the sign of ISO 21771: negative for a ring gear."""
        return -value if self.is_internal else value

    def rounded(self) -> "Shape":
        """The shape with numbers of seven significant digits, which single precision holds."""
        return Shape(*(float(f"{value:.{_DIGITS}g}") for value in self))


class Tooth:
    """Outline of the right flank; tooth frame and trochoid as in `geometry.outline`, lengths in modules.

    Attributes:
        shape: its numbers.
        base, root, tip, bore: radii; the bore is the circle that is held.
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
        turn = (np.pi / 2 + 2 * self._shift * np.tan(alpha)) / shape.teeth
        self._base_half_angle = turn + np.tan(alpha) - alpha
        cutter = self._cutter = self._rolling()
        given = self._arc = self._given_fillet()
        arc = shape.root_radius
        land = np.pi / 4 - shape.dedendum * np.tan(alpha) - (1 - np.sin(alpha)) * arc / np.cos(alpha)
        self._offset, self._depth = np.pi / 2 - land, shape.dedendum - self._shift - arc
        if cutter is not None:
            self.root = float(cutter.root_circle_radius)
            self._alpha = float(np.arctan(cutter.tangent))
        if given is not None:
            self._alpha = float(np.arctan(given.tangent))
        self.tip_roll_length = shape.signed(float(np.sqrt(max(self.tip**2 - self.base**2, 0.0))))
        self.junction, self.form_roll_length = self._junction()
        end = shape.signed(self.trochoid(np.pi / 2))
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
        if (arc := self._arc) is not None:
            r, phi, distance = -arc.center_radius, -arc.angle, self.shape.root_radius
        elif (cutter := self._cutter) is not None:
            r = float(cutter.gear_pitch_radius)
            reach, phi = cutter_contact(g, r, cutter.pitch_radius, cutter.offset, cutter.depth)
            distance = reach + self.shape.root_radius
        return np.stack([r * np.sin(phi) - distance * np.cos(g - phi), r * np.cos(phi) - distance * np.sin(g - phi)])

    def half_angle(self, rho: OneOrMany) -> OneOrMany:
        """Between centreline and involute [rad]."""
        return self._base_half_angle - (rho / self.base - np.arctan(rho / self.base))

    def involute(self, rho: float | np.ndarray) -> np.ndarray:
        """Points of the involute, shape (2, ...), from roll lengths."""
        r, angle = self.shape.signed(np.sqrt(self.base**2 + np.square(rho))), self.half_angle(np.asarray(rho))
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
        """Length of the involute from the base circle; negative for a ring gear, so that it grows towards the tip."""
        return np.square(rho) / (2 * self.base)

    def roll_length(self, arc: OneOrMany) -> OneOrMany:
        """Roll length from the length of the involute."""
        return self.shape.signed(np.sqrt(2 * self.base * arc))

    def _junction(self) -> tuple[float, float]:
        """Where fillet and involute meet: parameter [rad] and roll length."""
        alpha = self._alpha
        straight = self.shape.dedendum - self._shift - self.shape.root_radius * (1 - np.sin(alpha))
        tangential = self.pitch * np.sin(alpha) - straight / np.sin(alpha)
        if self._cutter is not None:
            tangential = self._cutter.form_roll_length
        if self.shape.is_internal:  # no cutter undercuts a ring gear
            given = self._arc
            return float(alpha), float(tangential if given is None else -given.form_roll_length)
        if tangential > -1e-12 * self.pitch:
            return float(alpha), max(float(tangential), 0.0)
        at_base = scipy.optimize.brentq(lambda g: np.hypot(*self.trochoid(g)) - self.base, alpha, np.pi / 2)
        cut = scipy.optimize.brentq(self._beside_involute, alpha, at_base)
        return float(cut), float(np.sqrt(max(np.sum(self.trochoid(cut) ** 2) - self.base**2, 0.0)))

    def _rolling(self) -> Cutter | None:
        """The cutter in mesh with the gear; None of a rack or a given fillet."""
        shape = self.shape
        if not shape.cutter_teeth:
            return None
        reach = {"root_circle_radius": self.root} if shape.is_internal else {"height": shape.dedendum}
        return rolling(
            shape.teeth,
            shape.cutter_teeth,
            module=1.0,
            pressure_angle=shape.pressure_angle,
            generating_shift=self._shift,
            cutter_shift=shape.cutter_profile_shift,
            radius=shape.root_radius,
            **reach,
        )

    def _given_fillet(self) -> FilletArc | None:
        """The given fillet of a ring gear; None for the fillet of a tool."""
        shape = self.shape
        if not shape.is_internal or shape.cutter_teeth:
            return None
        return fillet_arc(shape.root_radius, -self.base, -self.root, -self._base_half_angle)

    def _beside_involute(self, g: float) -> float:
        x, y = self.trochoid(g)
        rho = np.sqrt(max(x**2 + y**2 - self.base**2, 0.0))
        return float(np.arctan2(x, y) - self.half_angle(rho))
