"""A stepped shaft with its bearings, gears, couplings and loads.

All shafts of a gearbox are parallel to z. Positions on a shaft count from its left end, which is the end of least z.
Directions x, y, z, rx, ry are those of the gearbox, rotations right-handed.
"""

from abc import abstractmethod
from collections.abc import Iterator
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..geometry import Gear, Material
from ..numerics import Checked, concrete, number, positive_definite, program
from .stepped_beam import ROUNDING, SteppedBeam, beam, check_symmetric, rigid, symmetric

Scalar = Float[Array, ""]
Matrix = Float[Array, "5 5"]


class AbstractBearing(Checked):
    """Support of a shaft at one position, mounted on the housing, or on rigid ground where there is none."""

    name: eqx.AbstractVar[str]
    position: eqx.AbstractVar[Scalar]

    @property
    @abstractmethod
    def matrix(self) -> Matrix:
        """Stiffness in x, y, z, rx, ry [N/um, N/mrad, N mm/mrad], symmetric and positive semidefinite."""

    @property
    @abstractmethod
    def play(self) -> Scalar | None:
        """Radial clearance [um]; None for a bearing without clearance."""


class Bearing(AbstractBearing):
    """Bearing with the same stiffness in all radial directions.

    Attributes:
        name: name of the bearing, and of its seat in the housing.
        position: distance from the left end of the shaft [mm].
        radial: radial stiffness [N/um].
        axial: axial stiffness [N/um]; 0 for a floating bearing. A shaft of helical gears needs a bearing with axial
            stiffness.
        tilting: stiffness against rotation about x and y [N m/rad]; 0 for a self-aligning bearing.
        clearance: radial clearance, half the diametral clearance [um]; None for none. Its effect is described in
            `operating_point`.
    """

    name: str = eqx.field(static=True)
    position: Scalar = number("mm")
    radial: Scalar = number("N/um", low=0.0)
    axial: Scalar = number("N/um", low=0.0, default=0.0)
    tilting: Scalar = number("N m/rad", low=0.0, default=0.0)
    clearance: Scalar | None = number("um", low=0.0, optional=True, default=None)

    @property
    def matrix(self) -> Matrix:
        """Diagonal stiffness matrix in x, y, z, rx, ry [N/um, N mm/mrad]."""
        # 1 N m/rad is 1 N mm/mrad
        return jnp.diag(jnp.stack([self.radial, self.radial, self.axial, self.tilting, self.tilting]))

    @property
    def play(self) -> Scalar | None:
        """Radial clearance [um]; None for none."""
        return self.clearance


class MatrixBearing(AbstractBearing):
    """Bearing with a full stiffness matrix, for instance the tangent stiffness at its load from a bearing program.

    Attributes:
        name: name of the bearing, and of its seat in the housing.
        position: distance from the left end of the shaft [mm].
        stiffness: stiffness matrix in x, y, z, rx, ry [N/um, N/mrad = N mm/um, N mm/mrad = N m/rad], shape (5, 5).

    Raises:
        ValueError: for a matrix that is not 5 x 5, symmetric and positive semidefinite.
    """

    name: str = eqx.field(static=True)
    position: Scalar = number("mm")
    stiffness: Matrix = number("N/um", shape=("directions", "directions"))

    def check_together(self) -> None:
        if self.stiffness.shape != (5, 5):
            raise ValueError(f'MatrixBearing "{self.name}": stiffness has shape {self.stiffness.shape}, must be (5, 5)')
        known = concrete(self.stiffness)
        if known is None:
            return
        check_symmetric(f'MatrixBearing "{self.name}": stiffness', known)
        least, most = np.linalg.eigvalsh(known)[[0, -1]]
        if least < -ROUNDING * most:
            raise ValueError(
                f'MatrixBearing "{self.name}": stiffness must be positive semidefinite, smallest eigenvalue {least:g}'
            )

    @property
    def matrix(self) -> Matrix:
        """Symmetric part of `stiffness`, which is symmetric within rounding, shape (5, 5)."""
        return symmetric(self.stiffness)

    @property
    def play(self) -> None:
        """None: a tangent stiffness includes the clearance."""
        return None


class Section(Checked):
    """Section of a shaft with constant diameters.

    Attributes:
        length: length of the section [mm].
        diameter: outer diameter [mm].
        bore: inner diameter [mm].
    """

    length: Scalar = number("mm", low=0.0, open_low=True)
    diameter: Scalar = number("mm", low=0.0, open_low=True)
    bore: Scalar = number("mm", low=0.0, default=0.0)

    def check_together(self) -> None:
        outer, inner = concrete(self.diameter), concrete(self.bore)
        if outer is not None and inner is not None and inner >= outer:
            raise ValueError(f"Section: bore = {float(inner):g} mm must be less than {float(outer):g} mm, the diameter")


class MountedGear(Checked):
    """A gear on a shaft.

    Attributes:
        name: name of the gear, used by a mesh.
        gear: the gear; its face width is the width of the gear body.
        position: distance of the middle of the face from the left end of the shaft [mm].
        body_diameter: effective diameter of the shaft over the face width [mm], for stiffening by the gear body:
            `integral_diameter` for an integral pinion, less for a pressed or keyed wheel; None for no stiffening.
    """

    name: str = eqx.field(static=True)
    gear: Gear
    position: Scalar = number("mm")
    body_diameter: Scalar | None = number("mm", low=0.0, open_low=True, optional=True, default=None)

    def check_together(self) -> None:
        if self.gear.is_internal:
            raise ValueError(f'MountedGear: gear "{self.name}" is a ring gear: shafts carry external gears alone')

    @property
    def start(self) -> Scalar:
        """Left end of the face [mm]."""
        return self.position - 0.5 * self.gear.face_width

    @property
    def end(self) -> Scalar:
        """Right end of the face [mm]."""
        return self.position + 0.5 * self.gear.face_width


class Coupling(Checked):
    """Coupling at which torque enters or leaves a gearbox.

    Attributes:
        position: distance from the left end of the shaft [mm].
        torque: torque on the shaft [N m], positive for an input, negative for an output; None at one coupling of a
            gearbox, whose torque balances the others.
    """

    position: Scalar = number("mm")
    torque: Scalar | None = number("N m", optional=True, default=None)


class ShaftLoad(Checked):
    """External force and moment: belt, weight, overhung impeller.

    Attributes:
        position: distance from the left end of the shaft [mm].
        force: force in x, y and z [N], shape (3,).
        moment: moment about x and y [N m], shape (2,); a torque needs a `Coupling`.
    """

    position: Scalar = number("mm")
    force: Float[Array, "3"] = number("N", shape=("axes",), default=(0.0, 0.0, 0.0))
    moment: Float[Array, "2"] = number("N m", shape=("axes",), default=(0.0, 0.0))

    def check_together(self) -> None:
        for name, value, size in (("force", self.force, 3), ("moment", self.moment, 2)):
            if value.shape != (size,):
                raise ValueError(f"ShaftLoad: {name} has shape {value.shape}, must be a list of {size} numbers")

    @property
    def vector(self) -> Float[Array, "5"]:
        """Force and moment in x, y, z, rx, ry [N, N mm]."""
        return jnp.concatenate([self.force, 1e3 * self.moment])


def integral_diameter(gear: Gear) -> Scalar:
    """Diameter of a plain shaft that is as stiff as an integral gear [mm].

    d + 2 x m - h_fP m, halfway between reference circle and root circle for an unshifted gear. This is the torsion
    diameter d - m h_aP0, whose torsional wind-up agrees with a program of influence numbers within 0.3 %.
    """
    return 2 * gear.root_circle_radius + gear.dedendum * gear.module


OfGears = Float[Array, " gears"]

# A shaft is supported if the least stiffness against a rigid-body displacement exceeds this share of the total.
_SUPPORTED = 1e-9
_ROUNDING = 1e-6  # of a sum of lengths, in single precision too


class Shaft(Checked):
    """Stepped shaft: Timoshenko beam in bending, with torsion and tension.

    Attributes:
        name: name of the shaft.
        sections: sections from left to right.
        bearings: bearings of the shaft.
        gears: gears on the shaft, which stiffen it if they have a body diameter.
        couplings: couplings at which torque enters and leaves.
        loads: external loads.
        material: material of shaft and gear bodies.

    Raises:
        ValueError: for a part beyond the ends of the shaft, gears that overlap, a shaft or body as thick as the gear, a
            body diameter below that of the shaft, or bearings that do not support the shaft against every displacement
            and tilting. Axial support is required only if an axial force acts on the shaft.
    """

    name: str = eqx.field(static=True)
    sections: tuple[Section, ...] = eqx.field(converter=tuple)
    bearings: tuple[AbstractBearing, ...] = eqx.field(converter=tuple)
    gears: tuple[MountedGear, ...] = eqx.field(converter=tuple, default=())
    couplings: tuple[Coupling, ...] = eqx.field(converter=tuple, default=())
    loads: tuple[ShaftLoad, ...] = eqx.field(converter=tuple, default=())
    material: Material = eqx.field(default_factory=Material)

    def check_together(self) -> None:
        for kind, parts in (("sections", self.sections), ("bearings", self.bearings)):
            if not parts:
                raise ShaftError(kind, f'Shaft "{self.name}": {kind} must not be empty')
        _check(self)

    @property
    def length(self) -> Scalar:
        """Length of the shaft [mm]."""
        return sum((section.length for section in self.sections), jnp.zeros(()))

    @property
    def beam(self) -> SteppedBeam:
        """Stepped beam of the shaft, with a piece between every two steps of the diameters, gear bodies included."""
        ends = jnp.cumsum(jnp.stack([section.length for section in self.sections]))
        bodies = [(gear, gear.body_diameter) for gear in self.gears if gear.body_diameter is not None]
        faces = [end for gear, _ in bodies for end in (gear.start, gear.end)]
        steps = jnp.stack([*ends, *faces]) if faces else ends
        edges = jnp.concatenate([jnp.zeros_like(ends[:1]), jnp.sort(jnp.clip(steps, 0.0, ends[-1]))])
        middle = 0.5 * (edges[:-1] + edges[1:])
        which = jnp.sum(middle[:, None] > ends[None, :-1], axis=-1)
        diameter = jnp.stack([section.diameter for section in self.sections])[which]
        bore = jnp.stack([section.bore for section in self.sections])[which]
        for gear, body in bodies:
            inside = (middle > gear.start) & (middle < gear.end)
            diameter = jnp.where(inside, jnp.maximum(diameter, body), diameter)
        return beam(edges, diameter, bore, self.material)

    @property
    def valid(self) -> Bool[Array, ""]:
        """True if the shaft passes its checks; a concrete shaft that fails them raises an error when it is made."""
        return _holds(facts_of(self))

    def _named(self) -> tuple[tuple[str, str], ...]:
        """Keys and names of the parts on the shaft, in the order of `ShaftFacts.low`."""
        return (
            *((f"bearings[{index}]", f'bearing "{item.name}"') for index, item in enumerate(self.bearings)),
            *((f"gears[{index}]", f'gear "{item.name}"') for index, item in enumerate(self.gears)),
            *((f"couplings[{index}]", f"coupling {index}") for index in range(len(self.couplings))),
            *((f"loads[{index}]", f"load {index}") for index in range(len(self.loads))),
        )


class ShaftError(ValueError):
    """Error of a shaft that is not valid.

    Attributes:
        part: key of the faulty part, such as `bearings[1].position`; "" if it is not a single part.
    """

    def __init__(self, part: str, problem: str) -> None:
        self.part = part
        super().__init__(problem)


class ShaftFacts(NamedTuple):
    """Values for the checks of a shaft: errors for concrete numbers, a status for traced ones.

    Attributes:
        length: length of the shaft [mm].
        low, high: ends of all parts on the shaft [mm], shape (items,).
        inside: True for items within the shaft.
        hollow: True for sections with a bore less than the diameter.
        thinnest, thickest: smallest and largest diameter of the sections under the face of every gear [mm].
        body: body diameter of every gear, 0 where it has none [mm].
        tip: tip diameter of every gear [mm].
        overlap: True if the faces of two gears have more than an end in common.
        supported: True if the bearings resist every rigid-body displacement in x, y, rx, ry.
        axial: True if the bearings resist axial displacement, or if neither loads nor helical gears act axially.
    """

    length: Scalar
    low: Float[Array, " items"]
    high: Float[Array, " items"]
    inside: Bool[Array, " items"]
    hollow: Bool[Array, " sections"]
    thinnest: OfGears
    thickest: OfGears
    body: OfGears
    tip: OfGears
    overlap: Bool[Array, "gears gears"]
    supported: Bool[Array, ""]
    axial: Bool[Array, ""]


@program
def facts_of(shaft: Shaft) -> ShaftFacts:
    others: tuple[Coupling | ShaftLoad, ...] = (*shaft.couplings, *shaft.loads)
    points = [item.position for item in shaft.bearings], [item.position for item in others]
    length = shaft.length
    slack = _ROUNDING * length
    starts, ends = ([getattr(gear, end) for gear in shaft.gears] for end in ("start", "end"))
    low, high = (jnp.stack([*points[0], *faces, *points[1]]) for faces in (starts, ends))
    first, last = (jnp.stack(faces) if faces else jnp.zeros(0) for faces in (starts, ends))
    diameter = jnp.stack([section.diameter for section in shaft.sections])
    bore = jnp.stack([section.bore for section in shaft.sections])
    steps = jnp.cumsum(jnp.stack([jnp.zeros(()), *(section.length for section in shaft.sections)]))
    under = (steps[None, :-1] < last[:, None] - slack) & (steps[None, 1:] > first[:, None] + slack)
    bodies = [jnp.zeros(()) if gear.body_diameter is None else gear.body_diameter for gear in shaft.gears]
    tips = [2 * gear.gear.tip_radius for gear in shaft.gears]
    common = jnp.minimum(last[:, None], last[None]) - jnp.maximum(first[:, None], first[None])
    angles = [mounted.gear.helix_angle for mounted in shaft.gears if mounted.gear.helix_angle is not None]
    pushed = jnp.max(jnp.abs(jnp.stack([jnp.zeros(()), *(load.force[2] for load in shaft.loads), *angles])))
    stiffness = _bearing_stiffness(shaft)
    bending = np.array([0, 1, 3, 4])
    return ShaftFacts(
        length=length,
        low=low,
        high=high,
        inside=(low >= -slack) & (high <= length + slack),
        hollow=bore < diameter,
        thinnest=jnp.min(jnp.where(under, diameter[None], jnp.inf), axis=1),
        thickest=jnp.max(jnp.where(under, diameter[None], 0.0), axis=1),
        body=jnp.stack(bodies) if bodies else jnp.zeros(0),
        tip=jnp.stack(tips) if tips else jnp.zeros(0),
        overlap=jnp.triu(common > slack, 1),
        supported=_resists(stiffness[bending[:, None], bending]),
        axial=(stiffness[2, 2] > 0) | (pushed == 0),
    )


def _bearing_stiffness(shaft: Shaft) -> Float[Array, "5 5"]:
    """Stiffness of all bearings against rigid-body displacements, rotations as displacements at the shaft ends."""
    scale = jnp.stack([1.0, 1.0, 1.0, 1 / shaft.length, 1 / shaft.length])
    places = rigid(jnp.stack([item.position for item in shaft.bearings]))
    return sum(r.T @ item.matrix @ r for r, item in zip(places, shaft.bearings)) * scale[None] * scale[:, None]


def _resists(stiffness: Float[Array, "4 4"]) -> Bool[Array, ""]:
    # the trace is the sum of the eigenvalues
    least = max(_SUPPORTED, 10 * float(jnp.finfo(stiffness.dtype).eps)) * jnp.trace(stiffness)
    return positive_definite(stiffness - least * jnp.eye(len(stiffness), dtype=stiffness.dtype))


def _holds(facts: ShaftFacts) -> Bool[Array, ""]:
    """True if all checks of the facts pass."""
    fits = jnp.maximum(facts.thickest, facts.body) < facts.tip
    several = jnp.all(facts.inside) & jnp.all(facts.hollow) & jnp.all(fits) & ~jnp.any(facts.overlap)
    return several & facts.supported & facts.axial


def _check(shaft: Shaft) -> None:
    """Raise for a shaft of concrete numbers that is not valid, or for a gear body without effect."""
    if any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(shaft)):
        return
    facts = facts_of(shaft)
    if isinstance(facts.length, jax.core.Tracer):  # within a trace of something else
        return
    facts = jax.tree.map(np.asarray, facts)
    for part, fault in _faults(shaft, facts):
        raise ShaftError(part, f'Shaft "{shaft.name}": {fault}')


def _faults(shaft: Shaft, facts: ShaftFacts) -> Iterator[tuple[str, str]]:
    """Faulty parts, each with its message."""
    for (part, what), first, last, inside in zip(shaft._named(), facts.low, facts.high, facts.inside):
        if not inside:
            place = f"{first:g} mm" if first == last else f"{first:g} to {last:g} mm"
            yield f"{part}.position", f"{what} at {place} must lie within 0 and {facts.length:g} mm"
    for index, (mounted, thin, thick, body, tip) in enumerate(
        zip(shaft.gears, facts.thinnest, facts.thickest, facts.body, facts.tip)
    ):
        part, gear = f"gears[{index}].body_diameter", f'gear "{mounted.name}"'
        if not thick < tip:
            yield (
                f"gears[{index}]",
                f"its diameter under {gear} is {thick:g} mm, must be less than {tip:g} mm, the tip diameter",
            )
        if not body < tip:
            yield part, f"body_diameter of {gear} = {body:g} mm must be less than {tip:g} mm, the tip diameter"
        if mounted.body_diameter is not None and body <= thin:
            problem = f"= {body:g} mm has no effect on a shaft of {thin:g} mm: it must be more, or left out"
            yield part, f"body_diameter of {gear} {problem}"
    first = len(shaft.bearings)
    faces = [f"{low:g} to {high:g} mm" for low, high in zip(facts.low[first:], facts.high[first:])]
    for pair in np.argwhere(facts.overlap):
        places = [f'"{shaft.gears[index].name}" at {faces[index]}' for index in pair]
        yield "gears", f"gears {' and '.join(places)} must not overlap"
    if not facts.supported:
        names = ", ".join(f'"{item.name}"' for item in shaft.bearings)
        problem = "needs two that are radially stiff and apart, or one that is stiff against tilting too"
        yield "bearings", f"bearings {names} do not hold it: it {problem}"
    if not facts.axial:
        helical = [f'the axial force of gear "{each.name}"' for each in shaft.gears if not each.gear.is_spur]
        what = helical[0] if helical else "an axial load"
        yield "bearings", f"{what} needs a bearing of axial stiffness: give one an axial [N/um] above 0"
