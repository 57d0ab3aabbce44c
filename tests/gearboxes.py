"""Gearboxes that several tests share: two stages, one stage with clearance, one with gears off the middle."""

import jax.numpy as jnp
import numpy as np

import jaxgear as jg
from jaxgear.shafts import (
    Bearing,
    Coupling,
    Gearbox,
    GearMesh,
    MatrixBearing,
    MountedGear,
    Section,
    Shaft,
    ShaftLoad,
    integral_diameter,
    support,
)
from jaxgear.shafts.stepped_beam import shear_coefficient

# tip diameters as in the design files of other tests: one program for gears of this kind
PINION = jg.Gear(teeth=19, module=3.0, face_width=18.0, bore_diameter=24.0, tip_diameter=63.0)
WHEEL = jg.Gear(teeth=48, module=3.0, face_width=18.0, bore_diameter=40.0, tip_diameter=150.0)
PAIR = jg.GearPair(PINION, WHEEL)
LENGTH = 150.0
TILTED = np.diag([300.0, 400.0, 0.0, 2e4, 3e4]) + 0.0
TILTED[0, 4] = TILTED[4, 0] = 500.0
TILTED[1, 3] = TILTED[3, 1] = -400.0


E, NU = 206_000.0, 0.3
G = E / (2 * (1 + NU))
STIFF = 1e14  # N/um and N m/rad: what it gives is below every tolerance here


def inertia(diameter, bore=0.0):
    return np.pi / 64 * (diameter**4 - bore**4)


def shear_area(diameter, bore=0.0):
    return float(shear_coefficient(jnp.asarray(bore / diameter), jnp.asarray(NU))) * np.pi / 4 * (diameter**2 - bore**2)


def two_stages(radial=500.0, diameter=36.0, housing=None, further=()):
    """A reducer whose second mesh sits at 100 degrees from the first one; further couplings on its first shaft."""
    into = Shaft(
        "in",
        [Section(70, 30), Section(80, 25)],
        [Bearing("A", 10, radial, 50.0), Bearing("B", 140, 300.0)],
        [MountedGear("p1", PINION, 50, integral_diameter(PINION))],
        [Coupling(0.0, 60.0), *further],
    )
    middle = Shaft(
        "middle",
        [Section(150, diameter)],
        [Bearing("C", 10, 600.0), MatrixBearing("D", 140, TILTED)],
        [MountedGear("w1", WHEEL, 50), MountedGear("p2", PINION, 100, integral_diameter(PINION))],
    )
    out = Shaft(
        "out",
        [Section(200, 45)],
        [Bearing("E", 10, 900.0), Bearing("F", 140, 700.0)],
        [MountedGear("w2", WHEEL, 100)],
        [Coupling(200.0)],
        [ShaftLoad(180.0, (0.0, -400.0, 0.0))],
    )
    return Gearbox([into, middle, out], [GearMesh("p1", "w1", 0.0), GearMesh("p2", "w2", 100.0)], housing)


def stage(clearance, radial=300.0, moment=40.0):
    """One stage with clearance in all bearings; the wheel shaft carries a belt too."""

    def held(names, factor):
        return [Bearing(n, z, radial, clearance=factor * clearance) for n, z in zip(names, (0.0, 120.0))]

    into = Shaft("in", [Section(120, 30)], held("AB", 1.0), [MountedGear("p", PINION, 50)], [Coupling(0.0, moment)])
    belt = ShaftLoad(100.0, (900.0, 200.0, 0.0))
    out = Shaft("out", [Section(120, 40)], held("CD", 1.5), [MountedGear("w", WHEEL, 50)], [Coupling(120.0)], [belt])
    return Gearbox([into, out], [GearMesh("p", "w")])


def gearbox(radial=150.0, *, mirrored=False, modulus=206e3, housing=None, torque=50.0, pair=PAIR, **given):
    """One stage between bearings, its gears off the middle; `mirrored` about the plane across the shafts."""

    def at(position):
        return LENGTH - position if mirrored else position

    def shaft(name, sections, seats, gear, coupling):
        sections = [Section(length, diameter) for length, diameter in sections]
        bearings = [Bearing(seat, at(place), radial, 50.0) for seat, place in zip(seats, (10.0, 140.0))]
        material = jg.Material(elastic_modulus=modulus)
        return Shaft(name, sections[::-1] if mirrored else sections, bearings, [gear], [coupling], material=material)

    pinion = MountedGear("pinion", pair.pinion, at(45.0), integral_diameter(pair.pinion))
    wheel = MountedGear("wheel", pair.wheel, at(45.0))
    shafts = [
        shaft("in", [(50.0, 30.0), (100.0, 26.0)], "AB", pinion, Coupling(at(LENGTH), torque)),
        shaft("out", [(150.0, 40.0)], "CD", wheel, Coupling(at(0.0))),
    ]
    return Gearbox(shafts, [GearMesh("pinion", "wheel")], housing, **given)


def over_shafts(x):
    """Two gearboxes side by side, with clearance in their bearings."""
    return [support(stage(1.0, radial=300.0 * x + more)).influence(jnp.linspace(-8.0, 8.0, 41)) for more in (0, 1)]
