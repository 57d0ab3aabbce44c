"""Composition of tooth, body and contact models into the compliance of a mesh."""

from abc import abstractmethod
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from ..geometry import GearPair, Outline
from ..numerics import AbstractSpring, on_both
from .body import AbstractBody, ElasticRing
from .edge import EdgeLaw, edge
from .hertz import AbstractContact, ContactGeometry, DepthReferenced
from .laws import AbstractLaw
from .plane import Plane, PlaneState, check_plane_state, plane_stress_share, structure_planes
from .tooth import AbstractTooth, Beam, ToothLoad

Structures = Float[Array, "gears pairs pairs positions"]
Outside = Float[Array, "pairs positions"]


class AbstractCompliance(eqx.Module):
    """Elasticity of both gears for a prepared mesh: composed of models, or a table.

    Attributes:
        plane: "auto", "stress" or "strain". The contact and its pressure are in plane stress for "stress" only; teeth
            and bodies use it as each model defines (`plane_stress_share`: where a gear lies between both).
        averages_over_loaded_width: True if modifications are averaged over the width by every contact's own load, which
            takes a second contact solution; else over the width by the usual load of unmodified flanks.
    """

    plane: eqx.AbstractVar[PlaneState]
    averages_over_loaded_width: ClassVar[bool] = False

    def of_gears(self, pinion: Outline, wheel: Outline, count: int) -> "AbstractCompliance":
        """Compliance for these gears alone, with everything evaluated that does not depend on the positions; by default
        the model itself.

        Args:
            pinion: outline of the pinion's teeth.
            wheel: outline of the wheel's teeth.
            count: tooth pairs that are carried along.
        """
        return self

    @abstractmethod
    def structure(self, pinion: ToothLoad, wheel: ToothLoad) -> Structures:
        """Compliance of teeth and bodies between all pairs in contact [um per N/mm], without hub wind-up.

        One matrix for the pinion and one for the wheel, each under a load that is uniform over its own face.

        Args:
            pinion: load lines of all contacts on the pinion, fields of shape (pairs, positions).
            wheel: load lines of all contacts on the wheel, likewise.
        """

    @abstractmethod
    def hub(self, pinion: ToothLoad, wheel: ToothLoad) -> Float[Array, "gears"]:
        """Wind-up of the bodies of pinion and wheel, in um per N/mm of total line load over their own faces."""

    def slope(self, pinion: ToothLoad, wheel: ToothLoad) -> Float[Array, "gears"]:
        """Slope of both bodies at the rim along the radius by an axial force there [um/N per mm]; zero by default."""
        return jnp.zeros((2,), pinion.roll_length.dtype)

    @abstractmethod
    def law(
        self,
        geometry: ContactGeometry,
        pinion: ToothLoad,
        wheel: ToothLoad,
        outside: Outside,
    ) -> AbstractSpring:
        """The prepared contact law, for contacts at a distance `outside` the path of contact [mm]."""

    def check(self, pair: GearPair) -> None:
        """Refuses a pair that it does not hold for, as far as its numbers are concrete; asked by `prepare`.

        Raises:
            ValueError: naming the gear and the number.
        """


class Compliance(AbstractCompliance):
    """Which models make up the compliance of the mesh.

    Attributes:
        tooth: the tooth alone, root held.
        body: gear body with hub wind-up and coupling of neighbouring teeth.
        contact: approach of the flanks.
        plane: "auto" for teeth and bodies between plane stress and plane strain, each gear by its face width over its
            root chord, and the contact in plane strain; "stress" or "strain" for everything in one of them, as
            two-dimensional references are: what overhangs the mate's face does not help there.
        edge_softening: soften the contact where a tip corner cuts it off (see `edge`).
    """

    tooth: AbstractTooth = eqx.field(default_factory=Beam)
    body: AbstractBody = eqx.field(default_factory=ElasticRing)
    contact: AbstractContact = eqx.field(default_factory=DepthReferenced)
    plane: PlaneState = eqx.field(static=True, default="auto")
    edge_softening: bool = eqx.field(static=True, default=True)

    def __check_init__(self) -> None:
        check_plane_state(self.plane)

    def check(self, pair: GearPair) -> None:
        self.body.check(pair)

    def of_gears(self, pinion: Outline, wheel: Outline, count: int) -> AbstractCompliance:
        known = self.body.of_gears(pinion, wheel, count, structure_planes(self.plane))
        return self if known is None else _OfGears(model=self, known=known, plane=self.plane)

    def structure(self, pinion: ToothLoad, wheel: ToothLoad) -> Structures:
        return self.structure_on(pinion, wheel, None)

    def structure_on(self, pinion: ToothLoad, wheel: ToothLoad, known: PyTree | None) -> Structures:
        """`structure` with what `body.of_gears` gives; None where that has not been asked."""
        planes = structure_planes(self.plane)
        shares = on_both(lambda load: plane_stress_share(load.outline, load.outline.gear.face_width), pinion, wheel)
        bodies = _mixed(shares, self.body.of_both(pinion, wheel, planes, known))
        teeth = _mixed(shares, on_both(lambda load: self._teeth(load, planes), pinion, wheel))
        own = jnp.eye(teeth.shape[1], dtype=bool)[None, :, :, None]
        return jnp.where(own, bodies + teeth[:, None], bodies)

    def _teeth(self, load: ToothLoad, planes: tuple[Plane, ...]) -> Float[Array, "planes pairs positions"]:
        """Compliance of the teeth, which bend in the section normal to their trace."""
        if load.normal is None:
            return self.tooth.in_planes(load, planes)
        gear = load.outline.gear
        along_trace = gear.helix_cosine / jnp.cos(gear.base_helix_angle) ** 2
        return self.tooth.in_planes(load.normal, planes) * along_trace

    def hub(self, pinion: ToothLoad, wheel: ToothLoad) -> Float[Array, "gears"]:
        return jnp.stack([self.body.hub(pinion.outline), self.body.hub(wheel.outline)])

    def slope(self, pinion: ToothLoad, wheel: ToothLoad) -> Float[Array, "gears"]:
        return jnp.stack([self.body.slope(pinion.outline), self.body.slope(wheel.outline)])

    def law(self, geometry: ContactGeometry, pinion: ToothLoad, wheel: ToothLoad, outside: Outside) -> AbstractSpring:
        law = self.contact.prepare(geometry)
        if not self.edge_softening:
            return law
        return with_edge(law, geometry, pinion, wheel, outside)


class _OfGears(AbstractCompliance):
    """A compliance, and what its body knows of one pair of gears."""

    model: Compliance
    known: Any
    plane: PlaneState = eqx.field(static=True)

    def structure(self, pinion: ToothLoad, wheel: ToothLoad) -> Structures:
        return self.model.structure_on(pinion, wheel, self.known)

    def hub(self, pinion: ToothLoad, wheel: ToothLoad) -> Float[Array, "gears"]:
        return self.model.hub(pinion, wheel)

    def slope(self, pinion: ToothLoad, wheel: ToothLoad) -> Float[Array, "gears"]:
        return self.model.slope(pinion, wheel)

    def law(self, geometry: ContactGeometry, pinion: ToothLoad, wheel: ToothLoad, outside: Outside) -> AbstractSpring:
        return self.model.law(geometry, pinion, wheel, outside)


def with_edge(
    law: AbstractLaw,
    geometry: ContactGeometry,
    pinion: ToothLoad,
    wheel: ToothLoad,
    outside: Outside,
) -> EdgeLaw:
    """The law of the uninterrupted flanks with the softening of the nearest tip corner."""
    truncation = 4e3 / jnp.pi * geometry.compliance
    return EdgeLaw(law, geometry.width_factor, truncation, edge(pinion, wheel, outside, geometry))


def _mixed(shares: tuple[Array, Array], in_planes: tuple[Array, Array]) -> Array:
    """Both gears' compliances, which have the planes of `structure_planes` on their leading axis."""
    return jnp.stack([between_planes(share, *planes) for share, planes in zip(shares, in_planes)])


def between_planes(plane_stress: Array, first: Array, *second: Array) -> Array:
    """Between plane strain and plane stress by the share of the latter, or that of the only plane."""
    return sum((plane_stress * (stress - first) for stress in second), start=first)


def default_compliance(plane: PlaneState = "auto", *, hub_windup: bool = True) -> Compliance:
    """Beam over the true outline, coupled elastic ring, depth-referenced Hertz contact.

    Args:
        plane: "auto" for the real gear, between plane stress and plane strain by its face width; "stress" or "strain"
            to compare with two-dimensional references.
        hub_windup: include the common torsion of the gear bodies between bore and root circle.
    """
    return Compliance(body=ElasticRing(hub_windup=hub_windup), plane=plane)
