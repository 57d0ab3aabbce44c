"""The helical pair that several tests share, and its solved mesh."""

from dataclasses import replace
from functools import cache

import jaxgear as jg

SIZES = jg.Resolution(positions=8, slices=5, pairs=3, newton_steps=12)
TORQUE = 150.0


def pair_of(beta=15.0, width=20.0, bores=(20.0, 100.0), **given) -> jg.GearPair:
    """The pair of the finite elements that the model is compared with; a left-hand wheel."""
    other = None if beta is None else -beta
    return jg.GearPair(
        jg.Gear(19, 3.0, face_width=width, helix_angle=beta, bore_diameter=bores[0], **given),
        jg.Gear(48, 3.0, face_width=width, helix_angle=other, bore_diameter=bores[1], **given),
    )


def flanks(slope=0.0, relief=0.0):
    """A lead slope of the pinion and the same tip relief of both gears [um]: one program for all that have either."""
    tip = jg.TipRelief(relief, 4.0)
    return {"pinion": jg.LeadSlope(slope) + tip, "wheel": tip}


@cache
def solved(beta=15.0, slope=0.0, relief=0.0) -> tuple[jg.Mesh, jg.MeshCycle]:
    mesh = jg.prepare(pair_of(beta), resolution=SIZES)
    mesh = replace(mesh, alternates=mesh.kinematics.helical)  # at small angles too, which two pairs are enough for
    return mesh, jg.solve(mesh, TORQUE, **flanks(slope, relief))


@cache
def example() -> jg.GearPair:
    """The gears of the first worked example of ISO/TR 6336-30."""
    rack = {"face_width": 100.0, "dedendum": 1.4, "root_radius": 0.39}
    return jg.GearPair(
        jg.Gear(17, 8.0, 20.0, 0.145, helix_angle=15.8, tip_diameter=159.66, **rack),
        jg.Gear(103, 8.0, 20.0, 0.0, helix_angle=-15.8, tip_diameter=872.35, **rack),
        center_distance=500.0,
    )
