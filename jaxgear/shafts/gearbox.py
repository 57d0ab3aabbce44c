"""Gearbox: shafts, meshes and housing; positions of the axes, and path of the torque."""

from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..contact.status import Status, Statuses, status_of
from ..geometry import Gear, GearPair, margins
from ..numerics import Checked, changed, concrete, number, program, within_limits
from .housing import Housing
from .misalignment import Misalignment
from .shaft import MountedGear, Shaft
from .stepped_beam import semidefinite


class Path(NamedTuple):
    """Path of the torque through the tree of shafts and meshes.

    Attributes:
        turning: 1 for shafts that turn in the direction of the first shaft, -1 for the others.
        inwards: meshes, ordered from the farthest to the nearest to the output shaft, each with the shaft on its far
            side. The output shaft is the one whose coupling has no given torque.
    """

    turning: tuple[int, ...]
    inwards: tuple[tuple[int, int], ...]


def _torque_path(shafts: Sequence[str], meshes: Sequence[tuple[int, int]], outlet: int) -> Path:
    """Path of the torque through shafts, from meshes (shaft of the pinion, shaft of the wheel) and the output shaft.

    Raises:
        ValueError: for shafts that no mesh joins to the others, or for meshes that form a loop: how they share the
            torque depends on their backlash.
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
            f'Gearbox: the mesh of shafts "{one}" and "{two}" closes a loop, whose load sharing depends on backlash: '
            "model the branches one by one"
        )
    start = turning[0]
    return Path(tuple(start * turning[index] for index in range(len(shafts))), tuple(reversed(outwards)))


Scalar = Float[Array, ""]
Direction = Literal["counterclockwise", "clockwise"]


class GearMesh(Checked):
    """Two gears of a gearbox that mesh.

    Attributes:
        pinion, wheel: names of the driving and the driven gear.
        angle: angle of the direction from the pinion axis to the wheel axis, from x towards y [deg].
        center_distance: centre distance [mm]; None for the backlash-free centre distance.
        misalignment: misalignment of the axes without load; deflections under load add to it.
        axial_offset: offset of the middle of the wheel face from the middle of the pinion face [mm].
    """

    pinion: str = eqx.field(static=True)
    wheel: str = eqx.field(static=True)
    angle: Scalar = number("deg", default=0.0)
    center_distance: Scalar | None = number("mm", low=0.0, open_low=True, optional=True, default=None)
    misalignment: Misalignment = eqx.field(default_factory=Misalignment)
    axial_offset: Scalar = number("mm", default=0.0)


class Gearbox(Checked):
    """Parallel shafts, the meshes between them, and the housing that supports them.

    Axes: z along the shafts, x and y across, right-handed. One coupling has no given torque: its torque follows from
    the equilibrium with the other couplings.

    Attributes:
        shafts: each with its bearings, gears, couplings and loads.
        meshes: meshes, in which pinions drive wheels; shafts and meshes form a tree. Empty for a single shaft.
        housing: housing with the seats of all bearings; None for rigid seats.
        direction: sense of rotation of the first shaft, seen against z: x points to the right and y upwards.

    Raises:
        ValueError: for names that are unknown or given twice, gears that cannot mesh, shafts that no mesh joins or that
            form a loop, no coupling for the output torque, a wheel that drives its pinion, or a housing without a seat
            for every bearing.
    """

    shafts: tuple[Shaft, ...] = eqx.field(converter=tuple)
    meshes: tuple[GearMesh, ...] = eqx.field(converter=tuple)
    housing: Housing | None = None
    direction: Direction = eqx.field(static=True, default="counterclockwise")

    def check_together(self) -> None:
        if not self.shafts:
            raise ValueError("Gearbox: shafts must not be empty")
        names = [shaft.name for shaft in self.shafts]
        _check_single("shaft", names)
        _check_single("gear", [gear.name for shaft in self.shafts for gear in shaft.gears])
        _check_single("bearing", list(self.bearing_names))
        for mesh in self.meshes:
            for name in (mesh.pinion, mesh.wheel):
                _check_known("gear", name, [gear.name for shaft in self.shafts for gear in shaft.gears])
        if self.housing is not None:
            self._check_housing(self.housing)
        _ = self.path, [self.pair(index) for index in range(len(self.meshes))]
        torques = concrete(_torques(self))
        if torques is None:
            return
        for mesh, known in zip(self.meshes, torques):
            if known < 0:
                raise ValueError(
                    f'Gearbox: the torque of gear "{mesh.pinion}" is {float(known):g} N m, must be at least 0 N m: the '
                    "pinion of a mesh drives its wheel"
                )

    def _check_housing(self, housing: Housing) -> None:
        for seat in housing.seats:
            _check_known("seat of the housing", seat, list(self.bearing_names))
        for name in self.bearing_names:
            if name not in housing.seats:
                raise ValueError(f'Gearbox: the housing has no seat for bearing "{name}"')

    @property
    def status(self) -> Statuses:
        """Status of the numeric checks of the gearbox and of its gears.

        The checks: all numbers in their ranges, shafts supported, all parts within the ends of their shafts, a definite
        housing matrix, pinions that drive, and gears that can run. A concrete gearbox that fails raises an error when
        it is made; the load over the face of a traced gearbox carries this status.
        """
        return _status(self)

    @property
    def bearing_names(self) -> tuple[str, ...]:
        """Names of the bearings of all shafts, in the order of the shafts."""
        return tuple(bearing.name for shaft in self.shafts for bearing in shaft.bearings)

    @property
    def path(self) -> Path:
        """Path of the torque through shafts and meshes."""
        return _torque_path(
            [shaft.name for shaft in self.shafts],
            [(self.place(mesh.pinion)[0], self.place(mesh.wheel)[0]) for mesh in self.meshes],
            self._outlet(),
        )

    def place(self, gear: str) -> tuple[int, MountedGear]:
        """Index of the shaft of a gear, and the mounted gear; raises `ValueError` for an unknown name."""
        for index, shaft in enumerate(self.shafts):
            for mounted in shaft.gears:
                if mounted.name == gear:
                    return index, mounted
        raise ValueError(f'Gearbox: gear "{gear}" is on no shaft')

    def pair(self, mesh: int) -> GearPair:
        """Gear pair of a mesh, for `prepare`; face coordinates point along z.

        A `GearPair` turns counterclockwise. If the pinion turns clockwise, helical gears are returned with the opposite
        hand: that pair is the mirror image about the plane through both axes and has the same contact.
        """
        given = self.meshes[mesh]
        (shaft, pinion), (_, wheel) = self.place(given.pinion), self.place(given.wheel)
        gears = pinion.gear, wheel.gear
        if self.turning(shaft) < 0:
            gears = _other_hand(pinion.gear), _other_hand(wheel.gear)
        return GearPair(*gears, given.center_distance, given.axial_offset)

    def turning(self, shaft: int) -> int:
        """Sense of rotation of a shaft: 1 for counterclockwise, seen against z, -1 for clockwise."""
        return self.path.turning[shaft] * (1 if self.direction == "counterclockwise" else -1)

    def pinion_torques(self) -> Float[Array, " meshes"]:
        """Torque on the pinion of every mesh [N m], by equilibrium from the couplings."""
        brought = [
            sum((item.torque for item in shaft.couplings if item.torque is not None), jnp.zeros(()))
            for shaft in self.shafts
        ]
        torques = [jnp.zeros(())] * len(self.meshes)
        for index, far in self.path.inwards:
            pair = self.pair(index)
            drives = self.place(self.meshes[index].pinion)[0] == far
            near = self.place(self.meshes[index].wheel if drives else self.meshes[index].pinion)[0]
            torques[index] = brought[far] if drives else -brought[far] / pair.gear_ratio
            brought[near] = brought[near] + brought[far] * (pair.gear_ratio if drives else 1 / pair.gear_ratio)
        return jnp.stack(torques) if torques else jnp.zeros(0)

    def _outlet(self) -> int:
        free = [index for index, shaft in enumerate(self.shafts) for item in shaft.couplings if item.torque is None]
        if not self.meshes and not any(shaft.couplings for shaft in self.shafts):
            return 0
        if len(free) != 1:
            raise ValueError(
                f"Gearbox: {len(free)} couplings have no torque, must be 1, which takes the sum of the others"
            )
        return free[0]


def _other_hand(gear: Gear) -> Gear:
    return gear if gear.helix_angle is None else changed(gear, helix_angle=-gear.helix_angle)


@program
def _torques(gearbox: Gearbox) -> Float[Array, " meshes"]:
    return gearbox.pinion_torques()


@program
def _status(gearbox: Gearbox) -> Statuses:
    bearings = jnp.stack([bearing.matrix for shaft in gearbox.shafts for bearing in shaft.bearings])
    each = [within_limits(gearbox), jnp.all(jax.vmap(semidefinite)(bearings))]
    each += [shaft.valid for shaft in gearbox.shafts]
    if gearbox.housing is not None:
        each.append(gearbox.housing.valid)
    possible = jnp.all(jnp.stack(each)) & jnp.all(gearbox.pinion_torques() >= 0)
    run = [margins(gearbox.pair(index)).valid for index in range(len(gearbox.meshes))]
    gears = {Status.GEARS_CANNOT_RUN: ~jnp.all(jnp.stack(run))} if run else {}
    return status_of({Status.SUPPORT_NOT_POSSIBLE: ~possible} | gears)


def _check_single(kind: str, names: list[str]) -> None:
    for index, name in enumerate(names):
        if name in names[:index]:
            raise ValueError(f'Gearbox: {kind} "{name}" is given twice')


def _check_known(kind: str, name: str, names: list[str]) -> None:
    if name not in names:
        raise ValueError(f'Gearbox: {kind} "{name}" is not known, must be one of {", ".join(names)}')


def axes_of(gearbox: Gearbox) -> np.ndarray:
    """Coordinates x, y, z of the left ends of all shafts, the first one at the origin [mm], shape (shafts, 3).

    Args:
        gearbox: gearbox of concrete numbers; centre distances and angles of its meshes give the positions.
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
    """Radial clearances between the tips of gears and the other shafts and their gears, mates excepted [mm].

    Args:
        gearbox: gearbox of concrete numbers.
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
