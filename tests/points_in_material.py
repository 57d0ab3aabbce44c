"""Whether two generated gears can run, by points of one tooth in the material of the other: NumPy alone, no formulas
of the library.

A point of a gear's transverse section is removed if the rack passes over it at any roll. The rack is that of the normal
section, whose lengths across the teeth are 1 / cos(beta) longer in the transverse one.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Rack:
    """Basic rack: normal module [mm], pressure and helix angle [rad], coefficients of the module."""

    module: float
    angle: float
    helix: float
    dedendum: float
    radius: float

    def outside(self, depth, across):
        """Distance of points from the rack tooth [mm], negative inside; depth below its pitch line, from its middle."""
        m, across = self.module, np.abs(across) * np.cos(self.helix)
        rho, tip = self.radius * m, self.dedendum * m
        centre = tip - rho
        half = 0.25 * np.pi * m - centre * np.tan(self.angle) - rho / np.cos(self.angle)
        flank = (across - 0.25 * np.pi * m + depth * np.tan(self.angle)) * np.cos(self.angle)
        over, beside = depth - centre, across - half
        # the arc counts between the normals of flank and tip
        arc = np.hypot(np.maximum(over, 0), np.maximum(beside, 0)) - rho
        in_arc = (beside > 0) & (over > 0) & (beside * np.tan(self.angle) < over)
        return np.where(in_arc, arc, np.maximum(flank, np.where(beside > 0, -np.inf, depth - tip)))


@dataclass(frozen=True)
class Toothed:
    """A gear that the rack generates: teeth, profile shift, tip radius [mm]."""

    rack: Rack
    teeth: int
    shift: float
    tip: float

    @property
    def transverse(self):
        return np.arctan(np.tan(self.rack.angle) / np.cos(self.rack.helix))

    @property
    def pitch(self):
        return 0.5 * self.rack.module / np.cos(self.rack.helix) * self.teeth

    @property
    def base(self):
        return self.pitch * np.cos(self.transverse)

    def half_angle(self, rho):
        """Between the middle of the tooth and its involute at a roll length."""
        t = np.tan(self.transverse)
        at_base = (0.5 * np.pi + 2 * self.shift * np.tan(self.rack.angle)) / self.teeth + t - np.arctan(t)
        return at_base - rho / self.base + np.arctan(rho / self.base)

    def depth(self, x, y):
        """How deep points lie in the material [mm], negative outside of it; the middle of a space is on the x axis."""
        rolls = np.linspace(-1.0, 1.0, 161) * min(1.5, 5.0 / np.sqrt(self.teeth))
        rolls = np.broadcast_to(rolls, (*x.shape, rolls.size))
        for _ in range(4):
            best = self._outside(x, y, rolls).argmin(-1)[..., None]
            step = rolls[..., 1:2] - rolls[..., :1]
            rolls = np.take_along_axis(rolls, best, -1) + step * np.linspace(-1.0, 1.0, 21)
        return np.minimum(self._outside(x, y, rolls).min(-1), self.tip - np.hypot(x, y))

    def _outside(self, x, y, roll):
        cosine, sine = np.cos(roll), np.sin(roll)
        height = x[..., None] * cosine + y[..., None] * sine - self.pitch - self.shift * self.rack.module
        across = -x[..., None] * sine + y[..., None] * cosine + self.pitch * roll
        return self.rack.outside(-height, across)

    @property
    def tip_roll(self):
        return np.sqrt(max(self.tip**2 - self.base**2, 0.0))

    @property
    def form_roll(self):
        """Lowest roll length at which the involute is there, of 200."""
        rho = np.linspace(1e-4, 1.0 - 1e-9, 200) * self.tip_roll
        angle = np.pi / self.teeth - self.half_angle(rho)
        radius = np.hypot(self.base, rho)
        there = np.abs(self.depth(radius * np.cos(angle), radius * np.sin(angle))) < 1e-5 * self.rack.module
        return rho[-1] if not there[-1] else rho[max(np.flatnonzero(~there), default=-1) + 1]


def working_angle(first, second, distance):
    return np.arccos(min((first.base + second.base) / distance, 1.0))


def total_contact_ratio(first, second, distance, width):
    """Transverse contact ratio between tips and form circles, and overlap ratio."""
    line = (first.base + second.base) * np.tan(working_angle(first, second, distance))
    start, end = max(line - second.tip_roll, first.form_roll), min(first.tip_roll, line - second.form_roll)
    pitch = 2 * np.pi * first.base / first.teeth
    overlap = width * np.sin(abs(first.rack.helix)) / (np.pi * first.rack.module)
    return (end - start) / pitch, overlap


def interference(gear, mate, distance):
    """How deep the tip of the mate comes into the material of the gear [mm]; zero on the flanks that touch."""
    rho = np.linspace(0.9, 1.0, 4) * mate.tip_roll
    radius, angle = np.hypot(mate.base, rho), mate.half_angle(rho)
    turn = np.linspace(-1.0, 1.0, 161) * min(4.5 / mate.teeth, 1.0) * np.pi / 2
    # the middle of the mate's tooth is in that of the gear's space at turn 0
    seen = turn[:, None] + angle[None]
    x, y = distance - radius * np.cos(seen), radius * np.sin(seen)
    turned = turn[:, None] * mate.teeth / gear.teeth
    cosine, sine = np.cos(turned), np.sin(turned)
    return float(gear.depth(x * cosine + y * sine, y * cosine - x * sine).max())


def runs(first, second, distance, width):
    """Why two gears cannot run, in words; "" where they can."""
    for gear in (first, second):
        if gear.half_angle(gear.tip_roll) <= 0:
            return "pointed tooth"
    transverse, overlap = total_contact_ratio(first, second, distance, width)
    if transverse <= 0 or transverse + overlap < 1:
        return f"total contact ratio {transverse + overlap:.3f}"
    for gear, mate in ((first, second), (second, first)):
        depth = interference(gear, mate, distance)
        if depth > 1e-3 + 1e-4 * first.rack.module:
            return f"tip {1e3 * depth:.1f} um in the material"
    return ""
