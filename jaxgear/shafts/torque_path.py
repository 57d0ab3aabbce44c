"""Which way the torque takes through a gearbox, and which way every shaft turns."""

from collections.abc import Sequence
from typing import NamedTuple


class Path(NamedTuple):
    """Shafts and meshes as a tree.

    Attributes:
        turning: 1 for shafts that turn as the first one does, -1 for the others.
        inwards: meshes from the farthest to the nearest of the shaft where the rest of the torque leaves, each with the
            shaft on its far side.
    """

    turning: tuple[int, ...]
    inwards: tuple[tuple[int, int], ...]


def torque_path(shafts: Sequence[str], meshes: Sequence[tuple[int, int]], outlet: int) -> Path:
    """The path through shafts that meshes (shaft of the pinion, shaft of the wheel) join.

    Raises:
        ValueError: for shafts that no mesh joins to the others, or that meshes join in a circle: how such meshes share
            the torque depends on their play.
    """
    turning = {outlet: 1}
    outwards: list[tuple[int, int]] = []
    left = set(range(len(meshes)))
    while True:
        near = [k for k in sorted(left) if (meshes[k][0] in turning) != (meshes[k][1] in turning)]
        if not near:
            break
        left.remove(near[0])
        first, second = meshes[near[0]]
        known, other = (first, second) if first in turning else (second, first)
        turning[other] = -turning[known]
        outwards.append((near[0], other))
    lost = [name for index, name in enumerate(shafts) if index not in turning]
    if lost:
        raise ValueError(f'Gearbox: no mesh joins shaft "{lost[0]}" to "{shafts[outlet]}", where the torque leaves')
    if left:
        one, two = (shafts[index] for index in meshes[min(left)])
        raise ValueError(
            f'Gearbox: the mesh of shafts "{one}" and "{two}" closes a circle, which shares its torque by its play: '
            "model the branches one by one"
        )
    start = turning[0]
    return Path(tuple(start * turning[index] for index in range(len(shafts))), tuple(reversed(outwards)))
