"""Where the shafts of a gearbox lie, and whether gears have room beside what they do not mesh with."""

from collections.abc import Iterator
from itertools import combinations
from typing import NamedTuple

import numpy as np

from .gearbox import Gearbox
from .shaft import Shaft


def axes_of(gearbox: Gearbox) -> np.ndarray:
    """Left ends of all shafts in x, y, z, that of the first one at the origin, shape (shafts, 3) [mm].

    Args:
        gearbox: of concrete numbers; its meshes say how far and in which direction axes are apart.
    """
    at = {0: np.zeros(3)}
    while len(at) < len(gearbox.shafts):
        for index, mesh in enumerate(gearbox.meshes):
            (one, pinion), (other, wheel) = gearbox.place(mesh.pinion), gearbox.place(mesh.wheel)
            angle, distance = np.deg2rad(float(mesh.angle)), float(gearbox.pair(index).working_center_distance)
            along = float(pinion.position + mesh.axial_offset - wheel.position)
            step = np.array([distance * np.cos(angle), distance * np.sin(angle), along])
            if one in at:
                at.setdefault(other, at[one] + step)
            elif other in at:
                at[one] = at[other] - step
    return np.stack([at[index] for index in range(len(gearbox.shafts))])


def tip_clearances(gearbox: Gearbox) -> dict[str, float]:
    """Room between the tips of gears and what passes them on other shafts: gears, but their mates, and the shafts [mm].

    Args:
        gearbox: of concrete numbers.
    """
    axes, meshing = axes_of(gearbox), {frozenset((mesh.pinion, mesh.wheel)) for mesh in gearbox.meshes}
    bodies = [each for index, shaft in enumerate(gearbox.shafts) for each in _bodies(index, shaft, axes[index][2])]
    found: dict[str, float] = {}
    for one, other in combinations(bodies, 2):
        pair = frozenset((one.gear, other.gear))
        if one.shaft == other.shaft or pair in meshing or pair == {None}:
            continue
        if min(one.end, other.end) > max(one.start, other.start):
            apart = float(np.hypot(*(axes[one.shaft] - axes[other.shaft])[:2]))
            name, room = f"{one.name} and {other.name}", apart - one.radius - other.radius
            found[name] = min(room, found.get(name, room))
    return found


class _Body(NamedTuple):
    """A gear or a section of a shaft: names, the shaft, ends along z and radius [mm]."""

    name: str
    gear: str | None
    shaft: int
    start: float
    end: float
    radius: float


def _bodies(index: int, shaft: Shaft, left: float) -> Iterator[_Body]:
    for gear in shaft.gears:
        ends = left + float(gear.start), left + float(gear.end)
        yield _Body(f'gear "{gear.name}"', gear.name, index, *ends, float(gear.gear.tip_radius))
    for section in shaft.sections:
        end = left + float(section.length)
        yield _Body(f'shaft "{shaft.name}"', None, index, left, end, 0.5 * float(section.diameter))
        left = end
