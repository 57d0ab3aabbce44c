"""The compliance of a mesh from one table per gear and plane."""

from pathlib import Path
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...geometry import Gear, GearPair, RingGear, check_spur
from ...numerics import AbstractSpring, Checked, check, concrete, program
from ..assembly import AbstractCompliance, Outside, Structures, between_planes, with_edge
from ..hertz import ContactGeometry, DepthReferenced
from ..plane import (
    Plane,
    PlaneState,
    check_plane_state,
    contact_plane,
    plane_modulus,
    plane_stress_share,
    structure_planes,
)
from ..tooth import ToothLoad
from .build import build, hub
from .compliance_table import GearTable, Scale, different, scaled, shape_of
from .files import read_table
from .shape import Shape
from .table_cache import cached, default_folder

Matrix = Float[Array, "pairs pairs positions"]


class TabulatedCompliance(AbstractCompliance, Checked):
    """Teeth and bodies from tables over the roll length, the contact by the depth-referenced law and what it lacks.

    Per gear, in place of beam, ring and their neighbours (see `GearTable`):

        own tooth        center(rho) - hub
        other teeth      neighbours_k(rho, rho') - hub,    zero beyond the table's last neighbour
        contact law      depth-referenced law + local(rho) q, softened at tip corners as always

    `hub` is taken out of all entries, because a mesh carries it once. In plane "auto" every entry lies between those of
    plane strain and plane stress as in `default_compliance`; `local` belongs to the law and is that of plane strain.

    A gear of another size, modulus or face width is scaled. A gear of another shape is not that of the table: `prepare`
    refuses it, and where its numbers are traced the result is NaN and does not converge. Derivatives by numbers that
    shape a gear (teeth, profile shift, rack, tip, bore, tooth thickness allowance, Poisson's ratio) raise a
    `ValueError`; by the module too where bore or tip diameter are given, as it moves their ratio. With an allowance
    those by the module are NaN.

    Attributes:
        pinion, wheel: tables of each gear, in the order of `structure_planes`, or one for all planes.
        plane: as in `Compliance`.
    """

    pinion: tuple[GearTable, ...]
    wheel: tuple[GearTable, ...]
    plane: PlaneState = eqx.field(static=True)
    averages_over_loaded_width: ClassVar[bool] = True

    def structure(self, pinion: ToothLoad, wheel: ToothLoad) -> Structures:
        return jnp.stack([self._of_gear(self.pinion, pinion, False), self._of_gear(self.wheel, wheel, True)])

    def hub(self, pinion: ToothLoad, wheel: ToothLoad) -> Float[Array, "gears"]:
        plane = contact_plane(self.plane)
        hubs = [
            Scale.of(tables[0], load.outline.gear, plane).value * tables[0].hub
            for tables, load in ((self.pinion, pinion), (self.wheel, wheel))
        ]
        return jnp.stack(hubs)

    def law(self, geometry: ContactGeometry, pinion: ToothLoad, wheel: ToothLoad, outside: Outside) -> AbstractSpring:
        plane = contact_plane(self.plane)
        missing = _local(self.pinion[0], pinion, plane) + _local(self.wheel[0], wheel, plane)
        law = DepthReferenced().prepare(geometry)
        constant, *rest = law.series
        law = eqx.tree_at(lambda each: each.series, law, (constant + missing[:, None], *rest))
        return with_edge(law, geometry, pinion, wheel, outside)

    def check(self, pair: GearPair) -> None:
        _check_known(pair)
        for name, tables in (("pinion", self.pinion), ("wheel", self.wheel)):
            gear: Gear = getattr(pair, name)
            if any(concrete(leaf) is None for leaf in jax.tree.leaves(gear)):
                continue
            for table, plane in zip(tables, structure_planes(self.plane)):
                fault = different(table, _concrete(gear, plane)[0])
                if fault:
                    raise ValueError(f"{name} {fault}: make one for every shape of gear")

    def _of_gear(self, tables: tuple[GearTable, ...], load: ToothLoad, driven: bool) -> Matrix:
        planes = structure_planes(self.plane)
        found = [_structure(table, load, plane, driven) for table, plane in zip(tables, planes)]
        return between_planes(plane_stress_share(load.outline, load.outline.gear.face_width), *found)


def _structure(table: GearTable, load: ToothLoad, plane: Plane, driven: bool) -> Matrix:
    """Compliance of one gear between its teeth in contact, without the hub."""
    scale = Scale.of(table, load.outline.gear, plane)
    weights = table.weights(load.roll_length * scale.length)
    pairs, most = load.roll_length.shape[0], table.neighbours.shape[0]
    # the following tooth lies counter-clockwise on the driving gear, clockwise on the driven one
    neighbours = (table.neighbours.mT if driven else table.neighbours) - table.hub
    steps = np.arange(pairs)[:, None] - np.arange(pairs)[None]
    apart = jnp.asarray(steps == np.arange(1, most + 1)[:, None, None], weights.dtype)
    below = jnp.einsum("kij,jpm,kmn,ipn->ijp", apart, weights, neighbours, weights)
    own = weights @ (table.center - table.hub)
    return scale.value * (below + below.swapaxes(0, 1) + jnp.eye(pairs, dtype=own.dtype)[:, :, None] * own[None])


def _local(table: GearTable, load: ToothLoad, plane: Plane) -> Float[Array, "pairs positions"]:
    scale = Scale.of(table, load.outline.gear, plane)
    return scale.value * (table.weights(load.roll_length * scale.length) @ table.local)


_INCOMPRESSIBLE = 0.5


def finite_element_compliance(
    pair: GearPair,
    plane: PlaneState = "auto",
    *,
    pinion_table: str | Path | None = None,
    wheel_table: str | Path | None = None,
    cache: str | Path | bool | None = True,
) -> TabulatedCompliance:
    """Teeth and gear bodies by finite elements: two-dimensional, whole ring, once per gear. The bore is held rigidly, a
    ring gear all round at its rim diameter.

    Takes one to three seconds per gear and plane, then comes from the disk. A table holds for every module, modulus,
    face width, centre distance, torque and modification of the gear.

    Args:
        pair: spur gear pair of concrete numbers, external or internal.
        plane: as in `default_compliance`.
        pinion_table, wheel_table: tables of another program for that gear, as for a thin rim or a web, in the format
            of `write_table`. In plane "auto" such a table is taken as it is.
        cache: folder for tables; True for that of the user, None or False for none.

    Returns:
        for `prepare`. See `TabulatedCompliance` for what may vary and what it is differentiable by.

    Raises:
        ValueError: for helical gears, a ring gear with a `support`, numbers that are traced, a shape that cannot be
            meshed, or a table that cannot be right, naming the number or the line.
    """
    check_plane_state(plane)
    _check_known(pair)
    folder = default_folder() if cache is True else Path(cache) if cache else None
    tables: dict[str, tuple[GearTable, ...]] = {}
    for name, path in (("pinion", pinion_table), ("wheel", wheel_table)):
        gear: Gear = getattr(pair, name)
        if any(concrete(leaf) is None for leaf in jax.tree.leaves(gear)):
            raise ValueError(f"pair: {name} is traced, must be of concrete numbers")
        # elements of displacements lock in plane strain
        ratio = gear.material.poisson_ratio
        check("poisson_ratio", ratio, "", high=_INCOMPRESSIBLE, open_high=True)
        tables[name] = _tables(gear, plane, None if path is None else Path(path), folder)
    return TabulatedCompliance(pinion=tables["pinion"], wheel=tables["wheel"], plane=plane)


def _tables(gear: Gear, state: PlaneState, path: Path | None, folder: Path | None) -> tuple[GearTable, ...]:
    planes = structure_planes(state)
    if path is not None:
        shape, modulus = _concrete(gear, planes[0])
        wind_up = hub(shape) * 1e3 / modulus
        return (read_table(path, shape, float(gear.module), modulus, wind_up),)
    found = []
    for plane in planes:
        shape, modulus = _concrete(gear, plane)
        numbers = cached(folder, shape, build)
        found.append(scaled(shape, numbers, hub(shape), float(gear.module), modulus))
    return tuple(found)


def _check_known(pair: GearPair) -> None:
    check_spur(*pair.gears)
    for name, gear in zip(("pinion", "wheel"), pair.gears):
        if gear.protuberance is not None:
            raise ValueError(f"{name} protuberance: must be left out, its fillet is not known here yet")
        if isinstance(gear, RingGear) and gear.support is not None:
            raise ValueError(f"{name} support: must be None, finite elements hold the rim of a ring gear all round")


def _concrete(gear: Gear, plane: Plane) -> tuple[Shape, float]:
    """The rounded numbers of a gear and its plane modulus [MPa], also while something else is being traced."""
    with jax.ensure_compile_time_eval():
        numbers, modulus = map(np.asarray, _numbers(gear, plane))
    return Shape(*map(float, numbers)).rounded(), float(modulus)


@program
def _numbers(gear: Gear, plane: Plane) -> tuple[Float[Array, " numbers"], Float[Array, ""]]:
    return shape_of(gear, plane), plane_modulus(gear.material, plane)
