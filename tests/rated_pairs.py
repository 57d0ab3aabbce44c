"""Pairs of published ratings, all of one tree structure: one program rates them all."""

from dataclasses import replace
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

import jaxgear as jg
from jaxgear.geometry.path import path_between
from jaxgear.metrics import Lubricant
from jaxgear.numerics import changed, quick_jit, real
from jaxgear.rating import GearRating, Rating, mesh_geometry, rate


class Case(NamedTuple):
    """A pair as it is rated; the roots by the upper limit of the tooth thickness."""

    gears: tuple[jg.Gear, jg.Gear]
    center_distance: Any
    torque: Any
    speed: Any
    rating: Rating


def gears(
    teeth, module, shift, width, tips, rack, bores, *, beta=0.0, modulus=206e3, blank=(3.0, 1.0), allowance=(0, 0)
):
    made = []
    for side, hand in enumerate((beta, -beta)):
        gear = jg.Gear(
            teeth[side], module, profile_shift=shift[side], face_width=width, helix_angle=hand,
            tip_diameter=tips[side], dedendum=rack[0], root_radius=rack[1], bore_diameter=bores[side],
            rim_thickness=blank[0] * module, web_thickness=blank[1] * width,
            tooth_thickness_allowance=allowance[side], material=jg.Material(modulus),
        )  # fmt: skip
        made.append(changed(gear, helix_angle=real(hand)))
    return tuple(made)


def gear(pitting, bending, rz, ra, root, pitch, form, inertia):
    return GearRating(
        "case_hardened", pitting_limit=pitting, bending_limit=bending, flank_roughness_rz=rz, flank_roughness_ra=ra,
        root_roughness_rz=root, base_pitch_deviation=pitch, profile_form_deviation=form, moment_of_inertia=inertia,
    )  # fmt: skip


def rating(pinion, wheel, oil, face, **given):
    given = {"dynamic_factor": None, "edition": "2006", "service_life": 1e4, "tip_relief": 0.0, **given}
    return Rating(pinion=pinion, wheel=wheel, lubricant=Lubricant(*oil), face_load_factor=face, **given)


def ring(radius, width, bore=0.0):
    """Moment of inertia of a ring of steel [kg m^2], lengths in mm."""
    return 0.5e-15 * np.pi * 7850.0 * width * (radius**4 - bore**4)


# KS3 and TR1 are rated with the profile shift, FC with the upper limit of the tooth thickness and with the K_Hbeta that
# its contact stress has
STAGE_3 = Case(
    gears((24, 95), 14.0, (0.48, 0.6691), 360.0, (380.747, 1395.376), (1.25, 0.38), (179.1, 1193.32), beta=10.0,
          blank=(5.0, 0.25)),
    861.0, 40953.0, 1165.9,
    rating(gear(1500.0, 430.0, 4.8, 0.6, 20.0, 13.1, 18.0, 3.87681),
           gear(1500.0, 430.0, 4.8, 0.6, 20.0, 15.9465, 22.0, 399.02862), (220.0, 19.0, 80.0, 0.6), 1.15,
           application_factor=1.25, service_life=175_200.0, required_pitting_safety=1.25, required_root_safety=1.56),
)  # fmt: skip
FZG_C = Case(
    gears((16, 24), 4.5, (0.1818, 0.1714), 14.0, (82.45, 118.35), (1.39, 0.25), (30.0, 30.0), modulus=210e3,
          allowance=(-85.0, -85.0)),
    91.5, 130.0, 1500.0,
    rating(gear(1510.0, 475.0, 1.8, 0.3, 20.0, 7.0, 8.0, ring(35.836, 14.0)),
           gear(1510.0, 475.0, 1.8, 0.3, 20.0, 7.0, 8.0, ring(53.787, 14.0)),
           (90.02, 10.41, 60.0, 0.3), 1.3163, service_life=20_000.0, long_life_factor=1.0, required_root_safety=1.0),
)  # fmt: skip
EXAMPLE_1 = Case(
    gears((17, 103), 8.0, (0.14522, 0.0), 100.0, (159.66, 872.35), (1.4, 0.39), (60.0, 350.0), beta=15.8),
    500.0, 9000.0, 360.0,
    rating(gear(1500.0, 430.0, 6.0, 1.0, 20.0, 8.5, 9.5, 0.05), gear(1500.0, 430.0, 6.0, 1.0, 20.0, 9.0, 9.5, 35.0),
           (320.0, 24.0, 70.0, 1.0), 1.16, service_life=50_000.0, tip_relief=70.0),
)  # fmt: skip


def unlimited(pair: jg.GearPair):
    """Path of contact up to the tips; form circles, which do not limit it, take long to compile."""
    none = jnp.zeros_like(pair.pinion.module)
    return path_between(pair.pinion, pair.wheel, pair.center_distance, (none, none))


@quick_jit
def _rated(case):
    pair = jg.GearPair(*case.gears, case.center_distance)
    return rate(pair, case.torque, case.speed, case.rating, path=unlimited(pair))


def rated(case: Case):
    """The rating of a case."""
    return _rated(jax.tree.map(jnp.asarray, case))


@quick_jit
def _geometry(gears, center_distance):
    pair = jg.GearPair(*gears, center_distance)
    return mesh_geometry(pair, unlimited(pair))


def geometry_of(case: Case):
    """The geometry of a case."""
    return _geometry(*jax.tree.map(jnp.asarray, case[:2]))


def with_rating(case: Case, **fields) -> Case:
    """A case with other settings."""
    return case._replace(rating=replace(case.rating, **fields))
