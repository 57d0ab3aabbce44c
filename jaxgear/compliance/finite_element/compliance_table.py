"""The compliance of one gear as a table over the roll length, interpolated in JAX."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy  # its packages load when they are used
from jaxtyping import Array, Float

from ...geometry import Gear, RingGear
from ...numerics import real
from ...numerics.spline import cell
from ..plane import Plane, plane_modulus, plane_poisson
from .build import GearNumbers
from .shape import Shape

Scalar = Float[Array, ""]
Points = Float[Array, " points"]

# A gear is that of its table up to here, relative: single precision, and a table's own rounding.
_ALIKE = 3e-6
# numbers of a gear on which its table depends in a way that the table does not know
_HELD = (
    "teeth",
    "pressure_angle",
    "profile_shift",
    "dedendum",
    "root_radius",
    "tooth_thickness_allowance",
    "tooth_thickness_tolerance",
)
_CUTTER = "cutter_teeth", "cutter_profile_shift"  # likewise, where there is one
# likewise, where they are given; the module then moves their ratio to it
_LENGTHS = "tip_diameter", "bore_diameter", "rim_diameter", "fillet_radius"

_WORDS = {
    "tip_ratio": "tip_diameter over 2 module",
    "bore_ratio": "bore_diameter over 2 module",
    "poisson": "Poisson's ratio of the plane problem",
    "allowance": "tooth_thickness_allowance over module",
}
_WORDS_OF_RINGS = {"bore_ratio": "rim_diameter over 2 module"}
_WORDS_OF_FILLETS = {"root_radius": "fillet_radius over module"}
_SIGNED = "teeth", "tip_ratio", "bore_ratio"  # negative for a ring gear, given as positive numbers
_KINDS = "an external gear", "a ring gear"

_ALLOWANCE = Shape._fields.index("allowance")


class GearTable(eqx.Module):
    """Deflection of one gear along its load lines, bore fixed, or the rim circle of a ring gear; roll lengths from the
    form circle to the tip.

    Attributes:
        shape: `numbers` of the `Shape` of the gear that it is for.
        module: that it is for [mm].
        modulus: of the plane problem, E', that it is for [MPa].
        roll_length: increasing, negative for a ring gear [mm], shape (points,).
        center: displacement of the point where the load line crosses the tooth's centreline, [um per N/mm], (points,).
        local: displacement of the flank against that point, beyond the depth-referenced law [um per N/mm], (points,).
        neighbours: displacement of the flanks of the teeth counter-clockwise of the loaded one, where the load pushes
            counter-clockwise [um per N/mm]; shape (teeth, loaded point, point of the neighbour). Teeth further away
            feel the hub's wind-up alone.
        hub: rotation of the root circle on the line of action [um per N/mm]; it is in `center` and `neighbours`.
        slopes: slopes at the points of the splines through the rows of a unit matrix [1/mm], (points, points).
    """

    shape: Float[Array, "numbers"]
    module: Scalar
    modulus: Scalar
    roll_length: Points
    center: Points
    local: Points
    neighbours: Float[Array, "neighbours points points"]
    hub: Scalar
    slopes: Float[Array, "points points"]

    def __repr__(self) -> str:
        return f"GearTable({self.roll_length.shape[0]} points, {self.neighbours.shape[0]} neighbours)"

    def weights(self, roll_length: Float[Array, "..."]) -> Float[Array, "... points"]:
        """Weights of the table's points in a cubic spline (not-a-knot), constant beyond the table's ends.

        Args:
            roll_length: of the table's module [mm].
        """
        knots = self.roll_length
        x = jnp.clip(roll_length, knots[0], knots[-1])
        left = cell(x, knots)
        width = knots[left + 1] - knots[left]
        t = ((x - knots[left]) / width)[..., None]
        unit = jnp.eye(knots.shape[0], dtype=x.dtype)
        low, high = unit[left], unit[left + 1]
        start, end = (width[..., None] * self.slopes[side] for side in (left, left + 1))
        rise = high - low
        return low + t * (start + t * (3 * rise - 2 * start - end + t * (start + end - 2 * rise)))


def gear_table(shape: Shape, module: float, modulus: float, numbers: GearNumbers, hub: float) -> GearTable:
    """A table of arrays that are those of a gear of that module [mm] and plane modulus [MPa]; fields as there."""
    unit = np.eye(len(numbers.roll_length))
    slopes = scipy.interpolate.CubicSpline(numbers.roll_length, unit)(numbers.roll_length, 1)
    return GearTable(
        shape=real(np.asarray(shape.numbers)),
        module=real(module),
        modulus=real(modulus),
        roll_length=real(numbers.roll_length),
        center=real(numbers.center),
        local=real(numbers.local),
        neighbours=real(numbers.neighbours),
        hub=real(hub),
        slopes=real(slopes),
    )


def scaled(shape: Shape, numbers: GearNumbers, hub: float, module: float, modulus: float) -> GearTable:
    """The table of a gear from numbers for unit module and unit plane modulus."""
    factor = 1e3 / modulus
    sized = GearNumbers(numbers.roll_length * module, *(factor * field for field in numbers[1:]))
    return gear_table(shape, module, modulus, sized, factor * hub)


def shape_of(gear: Gear, plane: Plane) -> Float[Array, " numbers"]:
    """The `numbers` of the `Shape` that a gear's table depends on; they may be traced."""
    cutter = [getattr(gear, name) for name in _CUTTER] if gear.cutter_teeth is not None else []
    fillet = gear.fillet_radius if isinstance(gear, RingGear) else None
    return jnp.stack(
        [
            gear.signed(gear.teeth),
            gear.pressure_angle,
            gear.profile_shift,
            gear.dedendum,
            gear.root_radius if fillet is None else fillet / gear.module,
            gear.tip_radius / gear.module,
            gear.bore_radius / gear.module,
            plane_poisson(gear.material, plane),
            1e-3 * gear.mean_tooth_thickness_allowance / gear.module,
            *cutter,
        ]
    )


class Scale(eqx.Module):
    """How a gear's size and modulus stand to those of its table.

    Attributes:
        length: table's module over the gear's.
        value: what the table's values are multiplied with; NaN where the gear is not that of the table.
    """

    length: Scalar
    value: Scalar

    @classmethod
    def of(cls, table: GearTable, gear: Gear, plane: Plane) -> "Scale":
        gear = _without_unknown_derivatives(gear)
        given = jax.lax.stop_gradient(shape_of(gear, plane))
        if given.shape != table.shape.shape:  # one is of a rack, the other of a cutter
            return cls(table.module / gear.module, jnp.full_like(gear.module, jnp.nan))
        apart = jnp.abs(given - table.shape) / jnp.maximum(jnp.abs(table.shape), 1.0)
        # a module that moves the tooth thickness against it has no derivative: NaN, as only the number tells
        factor = table.modulus / plane_modulus(gear.material, plane) + _unknown_slope(shape_of(gear, plane)[_ALLOWANCE])
        return cls(table.module / gear.module, jnp.where(jnp.any(apart > _ALIKE), jnp.nan, factor))


def different(table: GearTable, shape: Shape) -> str | None:
    """The first number of a gear that is not that of its table, in words; both are concrete."""
    known = Shape(*map(float, np.asarray(table.shape, float)))
    if known.is_internal != shape.is_internal:
        return f"is {_KINDS[shape.is_internal]}, its table is of {_KINDS[known.is_internal]}"
    words = _WORDS | (_WORDS_OF_RINGS if shape.is_internal else {})
    words |= _WORDS_OF_FILLETS if shape.is_internal and not shape.cutter_teeth else {}
    numbers = [*zip(Shape._fields, known, shape)]
    # a bore that is not given follows from the others: last, as it is not the reason
    for name, there, here in sorted(numbers, key=lambda number: number[0] == "bore_ratio"):
        if abs(here - there) > _ALIKE * max(abs(there), 1.0):
            if name in _SIGNED:
                here, there = abs(here), abs(there)
            return f"{words.get(name, name)} = {here:.7g} differs from {there:.7g} of its table"
    return None


def _without_unknown_derivatives(gear: Gear) -> Gear:
    """The gear; a derivative by a number that determines its table raises a `ValueError`."""
    names = _HELD if gear.cutter_teeth is None else (*_HELD, *_CUTTER)
    ratios = [name for name in _LENGTHS if getattr(gear, name, None) is not None]
    if ratios:  # the module moves their ratio to it
        names = (*names, *ratios, "module")
    if gear.tip_diameter is None:
        names = (*names, "addendum")
    held = {name: _held(name, getattr(gear, name)) for name in names if getattr(gear, name) is not None}
    poisson = _held("poisson_ratio", gear.material.poisson_ratio)
    replaced = [*held, "material"]
    material = eqx.tree_at(lambda m: m.poisson_ratio, gear.material, poisson)
    return eqx.tree_at(
        lambda g: [getattr(g, name) for name in replaced], gear, [*held.values(), material], is_leaf=lambda x: x is None
    )


@jax.custom_jvp
def _unknown_slope(x: Scalar) -> Scalar:
    """Zero, with a derivative of NaN by a number that is not zero."""
    return jnp.zeros_like(x)


@_unknown_slope.defjvp
def _unknown_slope_jvp(primals: tuple[Array], tangents: tuple[Array]) -> tuple[Array, Array]:
    (x,), (x_dot,) = primals, tangents
    return _unknown_slope(x), jnp.where(x == 0, 0.0, jnp.nan) * x_dot


def _held(name: str, value: Array) -> Array:
    """The value; a derivative by it raises a `ValueError`."""

    @jax.custom_jvp
    def identity(x: Array) -> Array:
        return x

    def rule(primals: tuple[Array], tangents: tuple[Any]) -> tuple[Array, Array]:
        if not isinstance(tangents[0], jax.custom_derivatives.SymbolicZero):
            raise ValueError(_refusal(name))
        return primals[0], jnp.zeros_like(primals[0])

    identity.defjvp(rule, symbolic_zeros=True)
    return identity(value)


def _refusal(name: str) -> str:
    if name == "module":
        why = f"it moves {', '.join(_LENGTHS[:-1])} or {_LENGTHS[-1]} against the module where given: leave them None"
    else:
        why = "its table is of one value: use default_compliance"
    return f"no derivative by {name}: {why}"
