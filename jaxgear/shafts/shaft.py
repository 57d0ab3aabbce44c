"""A stepped shaft with what sits on it and what loads it.

All shafts of a gearbox are parallel to z. Positions on a shaft count from its left end, which is the end of least z.
Directions x, y, z, rx, ry are those of the gearbox, rotations right-handed.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..geometry import Gear, Material
from ..numerics import Checked, concrete, number, program
from .beam import Beam, beam, rigid
from .bearing import AbstractBearing

Scalar = Float[Array, ""]

# A shaft is held where its bearings resist every movement by at least this share of what they resist the stiffest one.
_SUPPORTED = 1e-9
_ROUNDING = 1e-6  # of a sum of lengths, in single precision too


class Section(Checked):
    """Part of a shaft with one cross-section.

    Attributes:
        length: [mm].
        diameter: outer [mm].
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
        name: by which a mesh refers to it.
        gear: the gear; its face width is that of the body.
        position: of the middle of its face, from the left end of the shaft [mm].
        body_diameter: outer diameter of the shaft over the face width [mm], by which the gear body stiffens it: of an
            integral pinion `integral_diameter`, of a pressed or keyed wheel less; None where the body does not stiffen.
    """

    name: str = eqx.field(static=True)
    gear: Gear
    position: Scalar = number("mm")
    body_diameter: Scalar | None = number("mm", low=0.0, open_low=True, optional=True, default=None)

    @property
    def start(self) -> Scalar:
        """Left end of the face [mm]."""
        return self.position - 0.5 * self.gear.face_width

    @property
    def end(self) -> Scalar:
        """Right end of the face [mm]."""
        return self.position + 0.5 * self.gear.face_width


class Coupling(Checked):
    """Where torque enters or leaves a gearbox.

    Attributes:
        position: from the left end of the shaft [mm].
        torque: positive where it drives the shaft, negative where the shaft gives it away [N m]; None for what is left
            of the others, at one coupling of a gearbox.
    """

    position: Scalar = number("mm")
    torque: Scalar | None = number("N m", optional=True, default=None)


class ShaftLoad(Checked):
    """Force and moment from outside: belt, weight, overhung impeller.

    Attributes:
        position: from the left end of the shaft [mm].
        force: in x, y and z [N].
        moment: about x and y [N m]; torque enters by a `Coupling`.
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
        """In x, y, z, rx, ry [N, N mm]."""
        return jnp.concatenate([self.force, 1e3 * self.moment])


class Shaft(Checked):
    """Stepped shaft: Timoshenko beam in bending, with torsion and tension.

    Attributes:
        name: of the shaft.
        sections: from left to right.
        bearings: that hold it.
        gears: on it, which stiffen it where they have a body diameter.
        couplings: where torque enters and leaves.
        loads: from outside.
        material: of shaft and gear bodies.

    Raises:
        ValueError: for something beyond the ends of the shaft, two things of one name, or bearings that do not hold the
            shaft: one of no tilting stiffness leaves it free to turn, none to move. A shaft without axial stiffness is
            taken as held axially unless something pushes it that way.
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
                raise ValueError(f'Shaft "{self.name}": {kind} must not be empty')
        _check(self)

    @property
    def length(self) -> Scalar:
        """[mm]"""
        return sum((section.length for section in self.sections), jnp.zeros(()))

    @property
    def beam(self) -> Beam:
        """The pieces between all steps of the diameters, gear bodies included."""
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

    def _named(self) -> tuple[str, ...]:
        """What is on the shaft, in the order of `_Facts.low`."""
        return (
            *(f'bearing "{item.name}"' for item in self.bearings),
            *(f'gear "{item.name}"' for item in self.gears),
            *(f"coupling {index}" for index in range(len(self.couplings))),
            *(f"load {index}" for index in range(len(self.loads))),
        )


class _Facts(NamedTuple):
    """What a shaft is judged by.

    Attributes:
        length: of the shaft [mm].
        low, high: ends of everything on it [mm].
        held: stiffness of all bearings against movements of the whole shaft in x, y, rx, ry [N/um ...], rotations as
            displacements of its ends.
        axial: the same in z.
        pushed: largest axial force [N].
    """

    length: Scalar
    low: Float[Array, " items"]
    high: Float[Array, " items"]
    held: Float[Array, "4 4"]
    axial: Scalar
    pushed: Scalar


@program
def _facts(shaft: Shaft) -> _Facts:
    others: tuple[Coupling | ShaftLoad, ...] = (*shaft.couplings, *shaft.loads)
    points = [item.position for item in shaft.bearings], [item.position for item in others]
    length = shaft.length
    scale = jnp.stack([1.0, 1.0, 1.0, 1 / length, 1 / length])
    places = rigid(jnp.stack(points[0]))
    held = sum(r.T @ item.matrix @ r for r, item in zip(places, shaft.bearings)) * scale[None] * scale[:, None]
    bending = np.array([0, 1, 3, 4])
    return _Facts(
        length,
        jnp.stack([*points[0], *(gear.start for gear in shaft.gears), *points[1]]),
        jnp.stack([*points[0], *(gear.end for gear in shaft.gears), *points[1]]),
        held[bending[:, None], bending],
        held[2, 2],
        jnp.max(jnp.abs(jnp.stack([jnp.zeros(()), *(load.force[2] for load in shaft.loads)]))),
    )


def _check(shaft: Shaft) -> None:
    """Raises where a shaft of concrete numbers is not held, or something is beyond its ends."""
    if any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(shaft)):
        return
    facts = _facts(shaft)
    if isinstance(facts.length, jax.core.Tracer):  # within a trace of something else
        return
    length, low, high, held, axial, pushed = map(np.asarray, facts)
    slack = _ROUNDING * length
    for what, first, last in zip(shaft._named(), low, high):
        if first < -slack or last > length + slack:
            place = f"{first:g} mm" if first == last else f"{first:g} to {last:g} mm"
            raise ValueError(f'Shaft "{shaft.name}": {what} at {place} must lie within 0 and {length:g} mm')
    least, most = np.linalg.eigvalsh(held)[[0, -1]]
    if not least > _SUPPORTED * most:
        names = ", ".join(f'"{item.name}"' for item in shaft.bearings)
        raise ValueError(
            f'Shaft "{shaft.name}": bearings {names} do not hold it: it needs two that are radially stiff and apart, '
            "or one that is stiff against tilting too"
        )
    if axial == 0 and pushed != 0:
        raise ValueError(f'Shaft "{shaft.name}": an axial load needs a bearing of axial stiffness')


def integral_diameter(gear: Gear) -> Scalar:
    """Diameter of a shaft that is as stiff as a gear cut into it [mm].

    d + 2 x m - h_fP m, halfway between reference circle and root circle of an unshifted gear: the torsion diameter
    d - m h_aP0 with which a straight torsional wind-up agrees with a program of influence numbers within 0.3 %.
    """
    return 2 * gear.root_circle_radius + gear.dedendum * gear.module
