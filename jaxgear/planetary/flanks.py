"""Modifications of the flanks of a stage as one design of its mesh of sun and planet."""

from jaxtyping import Array, Float

from ..microgeometry import AbstractModification
from ..microgeometry.base import Flank
from .meshes import StageFlanks


class PlanetFlanks(AbstractModification):
    """Modification of a planet towards the sun, together with those of the mesh of planet and ring.

    In the place of the wheel's modification it makes a design of a pair of sun and planet one of the whole stage:
    `lambda v: (sun, PlanetFlanks(to_sun, to_ring, ring))`. In that mesh it acts as `to_sun`.

    Attributes:
        to_sun: modification of the flanks of the planets that carry with the sun; None for the nominal involute.
        to_ring: of those that carry with the ring; None for the nominal involute.
        ring: of the flanks of the ring; None for the nominal involute.
    """

    to_sun: AbstractModification | None = None
    to_ring: AbstractModification | None = None
    ring: AbstractModification | None = None

    def __call__(self, flank: Flank) -> Float[Array, "..."]:
        return 0.0 * flank.roll_length if self.to_sun is None else self.to_sun(flank)

    @property
    def varies_along_face(self) -> bool:
        return self.to_sun is not None and self.to_sun.varies_along_face


def of_design(sun: AbstractModification | None, planet: AbstractModification | None) -> StageFlanks:
    """The modifications of a stage by a design of its pair of sun and planet.

    One of the planet that is no `PlanetFlanks` belongs to both its flanks, and the ring has none.
    """
    if isinstance(planet, PlanetFlanks):
        return StageFlanks(sun, planet.to_sun, planet.to_ring, planet.ring)
    return StageFlanks(sun, planet, planet, None)
