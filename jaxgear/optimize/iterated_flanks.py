"""Flanks whose material is removed point by point along the path of contact."""

import jax.numpy as jnp
import numpy as np

from ..contact import Mesh
from ..metrics import removed_at
from ..microgeometry import AbstractModification, NoModification, TabulatedProfile


class Flanks:
    """Both flanks: the modifications of the start, and what is taken off beside them in the contact points."""

    def __init__(self, mesh: Mesh, pinion: AbstractModification, wheel: AbstractModification, most: float):
        contact = mesh.path_of_contact
        pitch, self._most = float(contact.base_pitch), most
        start, end = float(contact.start), float(contact.end)
        positions = mesh.resolution.positions
        first, last = np.ceil(start / pitch * positions), np.floor(end / pitch * positions)
        # the profile points are those that touch at a mesh position, and the ends of the path
        number = np.arange(first, last + 1)
        self._path = np.unique(np.concatenate([[start], number * pitch / positions, [end]]))
        self._phase = np.asarray(mesh.phase)
        # part of the way from the first double contact to either tip
        double = max(end - start - pitch, np.finfo(float).tiny)
        self._way = tuple(np.clip((tip + double) / double, 0.0, 1.0) for tip in (self._path - end, start - self._path))
        self._pitch, self._start = pitch, (pinion, wheel)
        self._roll = (
            np.asarray(contact.pinion_roll_length(jnp.asarray(self._path))),
            np.asarray(contact.wheel_roll_length(jnp.asarray(self._path))),
        )
        self._given = tuple(
            np.asarray(removed_at(side, modification, jnp.asarray(roll)))
            for side, modification, roll in zip(mesh.sides, self._start, self._roll)
        )
        self._extra = [np.zeros_like(self._path), np.zeros_like(self._path)]

    def modifications(self, slant: float = 0.0) -> tuple[AbstractModification, AbstractModification]:
        """Of pinion and wheel, with what is taken off slanted towards the tips."""
        made = []
        for index, (given, roll) in enumerate(zip(self._start, self._roll)):
            before = self._given[index]
            slanted = self._extra[index] * np.maximum(1 + slant * (2 * self._way[index] - 1), 0.0)
            extra = np.clip(before + slanted, 0.0, self._most) - before
            order = np.argsort(roll)
            table = TabulatedProfile(jnp.asarray(roll[order]), jnp.asarray(extra[order]))
            made.append(table if isinstance(given, NoModification) else given + table)
        return made[0], made[1]

    def take_off(self, missing: np.ndarray, alone: np.ndarray) -> None:
        """Takes off what is missing to the level at every position [um]; where there is too much, gives back."""
        at_path = np.interp(self._path / self._pitch, self._phase, missing, period=1.0)
        for index, outwards in enumerate((1.0, -1.0)):
            depth = outwards * self._path
            outer = depth >= self._onset(missing, alone, outwards)
            total = np.clip(self._given[index] + self._extra[index] + at_path, 0.0, self._most)
            self._extra[index] = np.where(outer, total - self._given[index], self._extra[index])

    def _onset(self, missing: np.ndarray, alone: np.ndarray, outwards: float) -> float:
        """Distance from the pitch point at which the transmission error leaves its extreme in single contact [mm]."""
        # phases as distances on the way out, half a base pitch to either side of the pitch point
        distance = outwards * ((self._phase + 0.5) % 1 - 0.5) * self._pitch
        side = alone & (distance >= 0)
        if not side.any():
            return 0.0
        return float(distance[side][np.argmin(missing[side])])
