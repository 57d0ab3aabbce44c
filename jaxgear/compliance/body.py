"""Gear-body models: deflection of the root of a loaded tooth and of its neighbours."""

from abc import abstractmethod
from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PyTree

from ..geometry import Gear, GearPair, RingGear
from ..geometry.outline import Outline
from ..numerics import Checked, count, on_both
from . import rim, ring
from .plane import Plane, plane_modulus, plane_poisson
from .plate import axial_compliance
from .tooth import ToothLoad

Scalar = Float[Array, ""]
Matrices = Float[Array, "planes pairs pairs positions"]
Arcs = Float[Array, "planes pairs 3 3"]
Rim = Float[Array, "planes pairs pairs 3 3"]
Roots = tuple[Float[Array, "*planes pairs 3 3"], Float[Array, "*planes pairs pairs 3 3"] | None]


class AbstractBody(Checked):
    """Compliance of the gear body between the teeth in contact."""

    def check(self, pair: GearPair) -> None:
        """Refuses a pair that the model does not hold for; by default a ring gear that is not held all round.

        Raises:
            ValueError: naming the gear and its field.
        """
        if isinstance(pair.wheel, RingGear) and pair.wheel.support is not None:
            name = type(self).__name__
            raise ValueError(f"RingGear: support must be None with the body {name}: ElasticRing alone knows supports")

    @abstractmethod
    def compliance(self, load: ToothLoad, step: int, plane: Plane) -> Float[Array, "pairs pairs positions"]:
        """Displacement of tooth i along its load line per unit line load on tooth j, in um per N/mm.

        Args:
            load: loads on neighbouring teeth in the order of mesh, arrays of shape (pairs, positions).
            step: +1 where the following tooth lies counter-clockwise when the load pushes counter-clockwise (driving
                gear), -1 for the driven gear.
            plane: "stress" or "strain"; what lies between them is put together from both.
        """

    def of_gears(self, pinion: Outline, wheel: Outline, count: int, planes: tuple[Plane, ...]) -> PyTree | None:
        """Data of `of_both` for `count` pairs that are the same at all positions; None without any."""
        return None

    def of_both(
        self, pinion: ToothLoad, wheel: ToothLoad, planes: tuple[Plane, ...], known: PyTree | None = None
    ) -> tuple[Matrices, Matrices]:
        """`compliance` of driving and driven gear, each in several planes; `known` is the result of `of_gears`."""
        first, second = (
            jnp.stack([self.compliance(load, step, plane) for plane in planes])
            for load, step in ((pinion, +1), (wheel, step_of(wheel)))
        )
        return first, second

    def slope(self, outline: Outline) -> Float[Array, ""]:
        """Slope of the body at its rim along the radius under an axial force there [um/N per mm]; zero by default."""
        return jnp.zeros_like(outline.gear.base_radius)

    @abstractmethod
    def hub(self, outline: Outline) -> Float[Array, ""]:
        """Deflection that all teeth share, on the line of action, in um per N/mm of total line load: rotation of the
        root circle against the bore, for helical gears also the axial deflection of the body.
        """


def step_of(wheel: ToothLoad) -> int:
    """`step` of a driven gear: a ring gear turns the way of its planet."""
    return +1 if wheel.outline.gear.is_internal else -1


class ElasticRing(AbstractBody):
    """Elastic ring with exact coupling of neighbouring teeth (see `ring`), fixed at the bore or the rim of a ring gear.

    Attributes:
        hub_windup: include the torsion of the ring between bore and root circle. It is common to all teeth: it shifts
            the transmission error and changes neither its variation nor the load sharing.
        coupling: couple neighbouring teeth. Off only to show what the coupling is worth.
        harmonics: Fourier terms of the ring solution.
    """

    hub_windup: bool = eqx.field(static=True, default=True)
    coupling: bool = eqx.field(static=True, default=True)
    harmonics: int = count(high=100_000, default=400)

    def of_gears(self, pinion: Outline, wheel: Outline, count: int, planes: tuple[Plane, ...]) -> tuple[Roots, Roots]:
        return on_both(lambda outline: self._roots(outline, count, planes), pinion, wheel)

    def of_both(
        self, pinion: ToothLoad, wheel: ToothLoad, planes: tuple[Plane, ...], known: tuple[Roots, Roots] | None = None
    ) -> tuple[Matrices, Matrices]:
        if known is None:
            known = self.of_gears(pinion.outline, wheel.outline, pinion.angle.shape[0], planes)

        def of_one(given: tuple[ToothLoad, int | Array, Roots]) -> Array:
            load, step, roots = given
            modulus = jnp.stack([plane_modulus(load.outline.gear.material, plane) for plane in planes])
            return jax.vmap(partial(self._between_teeth, load, step))(modulus, roots)

        return on_both(of_one, (pinion, +1, known[0]), (wheel, step_of(wheel), known[1]))

    def compliance(self, load: ToothLoad, step: int, plane: Plane) -> Float[Array, "pairs pairs positions"]:
        roots = jax.tree.map(lambda leaf: leaf[0], self._roots(load.outline, load.angle.shape[0], (plane,)))
        return self._between_teeth(load, step, plane_modulus(load.outline.gear.material, plane), roots)

    def check(self, pair: GearPair) -> None:
        """Accepts every pair."""

    def _roots(self, outline: Outline, count: int, planes: tuple[Plane, ...]) -> Roots:
        return self._arcs(outline, count, planes), self._by_supports(outline, count, planes)

    def _by_supports(self, outline: Outline, count: int, planes: tuple[Plane, ...]) -> Rim | None:
        """Between the root arcs of teeth, by what supports the rim of a ring gear; times the plane modulus."""
        gear = outline.gear
        support = gear.support if isinstance(gear, RingGear) else None
        if support is None:
            return None
        inner = -_rim_radius(gear)
        # the loaded tooth of the reference pair is half a pitch before the middle of the space of its mate
        behind = np.arange(count) - (count - 1) // 2 - 0.5

        def in_plane(plane: Plane) -> Array:
            modulus = plane_modulus(gear.material, plane)
            return rim.support_compliance(
                gear.signed(outline.root_half_angle),
                inner / -gear.bore_radius,
                plane_poisson(gear.material, plane),
                jnp.asarray(behind, modulus.dtype) * (2 * jnp.pi / gear.teeth),
                support,
                rim.softness(support, modulus, inner, gear.face_width),
            )

        return jnp.stack([in_plane(plane) for plane in planes])

    def _arcs(self, outline: Outline, count: int, planes: tuple[Plane, ...]) -> Arcs:
        """Between the root arc of a tooth and those of itself and its neighbours, times the plane modulus."""
        gear, angle = outline.gear, outline.root_half_angle
        spacing = jnp.arange(count, dtype=angle.dtype) * (2 * jnp.pi / gear.teeth)
        ratio = gear.root_circle_radius / gear.bore_radius
        poisson = jnp.stack([plane_poisson(gear.material, plane) for plane in planes])
        # one program for all planes: the ring's equations are most of what there is to compile
        return jax.vmap(
            lambda of: ring.arc_compliance(gear.signed(angle), ratio, of, spacing, self.harmonics, gear.is_internal)
        )(poisson)

    def _between_teeth(
        self, load: ToothLoad, step: int | Array, modulus: Array, roots: Roots
    ) -> Float[Array, "pairs pairs positions"]:
        """`compliance` by what lies between the root arcs."""
        blocks, by_supports = roots
        outline, count = load.outline, load.angle.shape[0]
        gear = outline.gear
        modes = _modes(load, gear.root_circle_radius)
        own = blocks[:1] - ring.relaxation(gear.signed(outline.root_half_angle))[None]
        blocks = jnp.concatenate([own, blocks[1:]])
        # the responding tooth i lies (i - j) steps from the loaded tooth j; K(-phi) = K(phi)^T
        order = np.arange(count)[:, None] - np.arange(count)[None]
        both = jnp.stack([blocks, blocks.mT])
        between = both[(order < 0).astype(int), abs(order)]
        between = jnp.where(step > 0, between, between.mT)
        shape = jnp.einsum("iap,ijab,jbp->ijp", modes, between, modes)
        if by_supports is not None:
            modes = _modes(load, _rim_radius(gear))
            shape = shape + jnp.einsum("iap,ijab,jbp->ijp", modes, by_supports, modes)
        if not self.coupling:
            shape = shape * jnp.eye(count, dtype=shape.dtype)[:, :, None]
        return 1e3 / modulus * shape

    def hub(self, outline: Outline) -> Float[Array, ""]:
        """(1 + nu) (h^2 - 1) / (2 pi E) (r_b / r_f)^2: torsion of the ring, the same in both plane states; of helical
        gears with what the axial force tilts and dishes the body (see `plate`).
        """
        gear, material = outline.gear, outline.gear.material
        ratio = gear.root_circle_radius / gear.bore_radius
        torsion = (1 + material.poisson_ratio) * gear.signed(ratio**2 - 1) / (2 * jnp.pi * material.elastic_modulus)
        value = 1e3 * torsion * (gear.base_radius / gear.root_circle_radius) ** 2
        if gear.helix_angle is not None:
            axial = axial_compliance(gear).deflection
            value = value + axial * gear.face_width * jnp.tan(gear.base_helix_angle) ** 2
        return value if self.hub_windup else jnp.zeros_like(value)

    def slope(self, outline: Outline) -> Float[Array, ""]:
        gear = outline.gear
        if gear.helix_angle is None or not self.hub_windup:
            return super().slope(outline)
        return axial_compliance(gear).slope


def _rim_radius(gear: Gear) -> Scalar:
    """Radius of the circle on which the teeth of a ring gear load the rim that its supports let bend [mm]."""
    return gear.root_circle_radius + rim.STIFFENED * gear.module


def _modes(load: ToothLoad, radius: Scalar) -> Float[Array, "pairs 3 positions"]:
    """Moment, shear and compression of unit loads on the chord of the root arc at a radius."""
    chord = load.outline.root_height / load.outline.gear.root_circle_radius * radius
    arm, cosine = (load.height - chord) / radius, jnp.cos(load.angle)
    return jnp.stack([-arm * cosine, cosine, -jnp.sin(load.angle)], axis=1)
