"""Load line of a contact on a tooth, and the tooth as a cantilever of its true outline (potential energy method)."""

from abc import abstractmethod
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry.outline import Curves, Outline
from ..numerics import Checked, bracketed_root, count, gauss_legendre, result, safe_sqrt
from .plane import Plane, plane_modulus, shear_modulus

Real = Float[Array, "..."]


class ToothLoad(Checked):
    """Load normal to the involute at given points of one gear's flank. The other arrays share one shape.

    Attributes:
        outline: the tooth.
        roll_length: roll length of the loaded point [mm].
        angle: angle between the load line and the normal to the tooth centreline [rad].
        height: y of the crossing of load line and centreline [mm].
        depth: distance from the loaded point to that crossing along the load line [mm].
        normal: load on the tooth of the virtual gear at the same height of the tooth; None for a spur gear.
    """

    outline: Outline
    roll_length: Real = result("mm")
    angle: Real = result("rad")
    height: Real = result("mm")
    depth: Real = result("mm")
    normal: "ToothLoad | None" = eqx.field(default=None, repr=False)


def tooth_load(outline: Outline, roll_length: Real) -> ToothLoad:
    """The load line of every point, which is the normal to the involute there.

    Args:
        outline: the tooth.
        roll_length: roll lengths of the loaded points [mm].
    """
    drawn = outline.curves.over(roll_length.shape)
    angle = jnp.arctan(roll_length / drawn.base_radius) - drawn.half_angle(roll_length)  # as `load_angle`
    x, _ = drawn.involute(roll_length)
    normal = None
    if outline.normal is not None:
        gear = outline.normal.gear
        above = gear.signed(jnp.sqrt(drawn.base_radius**2 + roll_length**2)) - outline.gear.pitch_radius
        virtual = safe_sqrt((gear.pitch_radius + above) ** 2 - gear.base_radius**2)
        normal = tooth_load(outline.normal, gear.signed(virtual))
    return ToothLoad(outline, roll_length, angle, drawn.base_radius / jnp.cos(angle), x / jnp.cos(angle), normal)


_SHEAR_FACTOR = 1.2  # rectangular section (energy method, Yang & Sun 1985; Tian 2004)


class AbstractTooth(Checked):
    """Compliance of the tooth alone, root circle held."""

    @abstractmethod
    def compliance(self, load: ToothLoad, plane: Plane) -> Float[Array, "..."]:
        """Displacement of the crossing point along the load line, in um per N/mm; shape of the load.

        Args:
            load: loads on the tooth.
            plane: "stress" or "strain"; what lies between them is put together from both.
        """

    def in_planes(self, load: ToothLoad, planes: tuple[Plane, ...]) -> Float[Array, "planes ..."]:
        """`compliance` in each of several planes."""
        return jnp.stack([self.compliance(load, plane) for plane in planes])


class Beam(AbstractTooth):
    """Beam over the generated outline from the root circle up to where the load line crosses the centreline.

        1/k_b = int [(y_C - y) cos a]^2 / (E I) dy,   1/k_s = int 1.2 cos^2 a / (G A) dy,   1/k_a = int sin^2 a / (E A)
        dy

    with I = 2/3 x(y)^3 and A = 2 x(y) per unit width. Stopping at the crossing instead of at the contact point leaves
    the part of the tooth beside the load to the depth-referenced contact law, which contains it. The trochoid is the
    true one, so there is no case distinction between root and base circle.

    Attributes:
        nodes: Gauss-Legendre nodes on the fillet and on the involute each.

    References:
        X. Tian, MSc thesis, Univ. of Alberta 2004; X. Liang, M. J. Zuo, M. Pandey 2014; limits as in C. Weber &
        K. Banaschek 1953.
    """

    nodes: int = count(high=1000, default=12)

    def compliance(self, load: ToothLoad, plane: Plane) -> Float[Array, "..."]:
        return self.in_planes(load, (plane,))[0]

    def in_planes(self, load: ToothLoad, planes: tuple[Plane, ...]) -> Float[Array, "planes ..."]:
        material = load.outline.gear.material
        bending, area = self._integrals(load)
        cosine, sine = jnp.cos(load.angle), jnp.sin(load.angle)

        def total(modulus: Array) -> Array:
            return (
                bending * cosine**2 / modulus
                + _SHEAR_FACTOR * area * cosine**2 / shear_modulus(material)
                + area * sine**2 / modulus
            )

        return 1e3 * jnp.stack([total(plane_modulus(material, plane)) for plane in planes])

    def _integrals(self, load: ToothLoad) -> tuple[Array, Array]:
        """int (y_C - y)^2 / I dy and int 1 / A dy up to the crossing height."""
        outline, height = load.outline, load.height
        drawn, root = outline.curves.over(height.shape), jnp.full_like(height, jnp.pi / 2)
        junction, form = (jnp.broadcast_to(end, height.shape) for end in (outline.junction, outline.form_roll_length))
        in_fillet = height < drawn.trochoid(junction)[1]
        # the ends of the fillet for heights beyond them
        fillet_end = bracketed_root(_above_fillet, junction, root, (drawn, height))
        involute_end = bracketed_root(_above_involute, form, drawn.tip_roll_length, (drawn, height))
        fillet = self._segment(load, Curves.trochoid, root, jnp.where(in_fillet, fillet_end, junction))
        flank = self._segment(load, Curves.involute, form, jnp.where(in_fillet, form, involute_end))
        return fillet[0] + flank[0], fillet[1] + flank[1]

    def _segment(
        self, load: ToothLoad, curve: Callable[[Curves, Array], tuple[Array, Array]], start: Array, end: Array
    ) -> tuple[Array, Array]:
        """The two integrals over a part of the outline, with the quadrature nodes on a leading axis."""
        nodes, weights = (
            jnp.asarray(table, start.dtype).reshape((-1,) + (1,) * start.ndim) for table in gauss_legendre(self.nodes)
        )
        parameter, extent = (
            start[None] + nodes * (end - start)[None],
            jnp.broadcast_to(end - start, (self.nodes, *start.shape)),
        )
        drawn = load.outline.curves.over(parameter.shape)
        (x, y), (_, slope) = jax.jvp(lambda t: curve(drawn, t), (parameter,), (extent,))
        step = weights * slope
        return jnp.sum(step * (load.height[None] - y) ** 2 * 1.5 / x**3, axis=0), jnp.sum(step * 0.5 / x, axis=0)


def _above_fillet(g: Array, given: tuple[Curves, Array]) -> Array:
    """Height of the trochoid above a given one."""
    drawn, height = given
    return drawn.trochoid(g)[1] - height


def _above_involute(rho: Array, given: tuple[Curves, Array]) -> Array:
    """Height of the involute above a given one."""
    drawn, height = given
    return drawn.involute(rho)[1] - height
