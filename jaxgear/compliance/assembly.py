"""Composition of tooth, body and contact models into the compliance of a mesh."""

from abc import abstractmethod

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import AbstractSpring, on_both
from .beam import AbstractTooth, Beam
from .body import AbstractBody, ElasticRing, Sainsot
from .edge import EdgeLaw, edge
from .hertz import AbstractContact, ConstantHertz, ContactGeometry, DepthReferenced
from .plane import Plane, check_plane
from .toothload import ToothLoad


class AbstractCompliance(eqx.Module):
    """What a prepared mesh needs to know of the elasticity of both gears: composed of models, or a table.

    Attributes:
        plane: "stress" or "strain", of the elastic constants.
    """

    plane: eqx.AbstractVar[Plane]

    @abstractmethod
    def structure(self, pinion: ToothLoad, wheel: ToothLoad) -> Float[Array, "pairs pairs positions"]:
        """Compliance of teeth and bodies between all pairs in contact [um per N/mm], without hub wind-up.

        Args:
            pinion: load lines of all contacts on the pinion, fields of shape (pairs, positions).
            wheel: the same on the wheel.
        """

    @abstractmethod
    def hub(self, pinion: ToothLoad, wheel: ToothLoad) -> Float[Array, ""]:
        """Wind-up of both gear bodies, in um per N/mm of total line load."""

    @abstractmethod
    def law(
        self,
        geometry: ContactGeometry,
        pinion: ToothLoad,
        wheel: ToothLoad,
        outside: Float[Array, "pairs positions"],
    ) -> AbstractSpring:
        """The prepared contact law, for contacts at a distance `outside` the path of contact [mm]."""


class Compliance(AbstractCompliance):
    """Which models make up the compliance of the mesh.

    Attributes:
        tooth: the tooth alone, root held.
        body: gear body with hub wind-up and coupling of neighbouring teeth.
        contact: approach of the flanks.
        plane: "stress" for narrow faces, "strain" for wide ones (face width above about five tooth heights; Cornell
            1981).
        edge_softening: soften the contact where a tip corner cuts it off (see `edge`).
    """

    tooth: AbstractTooth = eqx.field(default_factory=Beam)
    body: AbstractBody = eqx.field(default_factory=ElasticRing)
    contact: AbstractContact = eqx.field(default_factory=DepthReferenced)
    plane: Plane = eqx.field(static=True, default="stress")
    edge_softening: bool = eqx.field(static=True, default=True)

    def __check_init__(self):
        check_plane(self.plane)

    def structure(self, pinion: ToothLoad, wheel: ToothLoad) -> Float[Array, "pairs pairs positions"]:
        bodies = self.body.of_both(pinion, wheel, self.plane)
        first, second = on_both(lambda load: self.tooth.compliance(load, self.plane), pinion, wheel)
        own = jnp.eye(first.shape[0], dtype=bool)[:, :, None]
        return jnp.where(own, bodies + (first + second)[None], bodies)

    def hub(self, pinion: ToothLoad, wheel: ToothLoad) -> Float[Array, ""]:
        return self.body.hub(pinion.outline) + self.body.hub(wheel.outline)

    def law(self, geometry: ContactGeometry, pinion: ToothLoad, wheel: ToothLoad, outside) -> AbstractSpring:
        law = self.contact.prepare(geometry)
        if not self.edge_softening:
            return law
        truncation = 4e3 / jnp.pi * geometry.compliance
        return EdgeLaw(law, geometry.width_factor, truncation, edge(pinion, wheel, outside, geometry))


def default_compliance(plane: Plane = "stress", *, hub_windup: bool = True) -> Compliance:
    """Beam over the true outline, coupled elastic ring, depth-referenced Hertz contact.

    Args:
        plane: "stress" or "strain".
        hub_windup: include the common torsion of the gear bodies between bore and root circle.
    """
    return Compliance(body=ElasticRing(hub_windup=hub_windup), plane=plane)


def legacy_compliance() -> Compliance:
    """Beam, Sainsot's uncoupled foundation, constant Hertz stiffness, plane stress: the usual published model.

    It overstates the variation of the transmission error by 20 to 120 % against finite elements.
    """
    return Compliance(tooth=Beam(), body=Sainsot(), contact=ConstantHertz(), plane="stress", edge_softening=False)
