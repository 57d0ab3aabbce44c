"""What a shaft is made of and what sits on it: sections, gears, couplings, loads.

Positions on a shaft count from its left end, which is the end of least z. Directions x, y, z, rx, ry are those of the
gearbox, rotations right-handed.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Gear
from ..numerics import Checked, concrete, number

Scalar = Float[Array, ""]


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


def integral_diameter(gear: Gear) -> Scalar:
    """Diameter of a shaft that is as stiff as a gear cut into it [mm].

    d + 2 x m - h_fP m, halfway between reference circle and root circle of an unshifted gear: the torsion diameter
    d - m h_aP0 with which a straight torsional wind-up agrees with a program of influence numbers within 0.3 %.
    """
    return 2 * gear.root_circle_radius + gear.dedendum * gear.module
