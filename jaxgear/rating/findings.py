"""Numbers of a rating that are out of the validity of ISO 6336; nothing is refused for them, and they stay."""

from collections.abc import Iterator

import numpy as np

from ..geometry import Gear, GearPair
from ..metrics.findings import Finding, unusual
from ..metrics.stress import NOTCH_LIMITS
from ..numerics import Usual
from .chain import PairRating
from .load_factors import LEAST_SPEED
from .settings import Rating

# of Y_B, C_R and the notch factor
_LEAST_RIM, _LEAST_WEB, _SHARPEST = 0.5, 0.2, 4.0
_INFINITE = np.inf

VALIDITY = {
    "helix angle": Usual(0.0, 30.0, "deg", "Y_beta is known up to 30 deg"),
    "transverse contact ratio": Usual(1.0, 2.5, "", "ISO 6336-2 and -3 are valid for 1 to 2.5"),
    "flank roughness Rz": Usual(1.0, 40.0, "um", "Z_R is known from 1 to 40 um"),
    "root roughness Rz": Usual(1.0, 40.0, "um", "Y_RrelT is known from 1 to 40 um, and taken there"),
    "notch parameter q_s": Usual(*NOTCH_LIMITS, "", "Y_S is known from 1 to 8, and taken there"),
    "rim thickness over tooth height": Usual(_LEAST_RIM, _INFINITE, "", "Y_B is known from 0.5 on, and taken there"),
    "web thickness over face width": Usual(_LEAST_WEB, _INFINITE, "", "C_R is known from 0.2 on, and taken there"),
    "grinding notch depth over radius": Usual(0.0, _SHARPEST, "", "Y_Sg is known below 4"),
    "application factor K_A": Usual(1.0, _INFINITE, "", "less than the nominal load"),
    "dynamic factor K_v": Usual(1.0, _INFINITE, "", "less than the static load"),
    "face load factor K_Hbeta": Usual(1.0, _INFINITE, "", "the largest line load is at least the mean"),
    "face load factor K_Fbeta": Usual(1.0, _INFINITE, "", "the largest line load is at least the mean"),
    "transverse load factor K_Halpha": Usual(1.0, _INFINITE, "", "at least the even share"),
    "v z1 / 100 sqrt(u^2 / (1 + u^2))": Usual(LEAST_SPEED, _INFINITE, "m/s", "K_v by method B is of little use below"),
    "profile shift x1 - x2": Usual(0.0, _INFINITE, "", "c' of ISO 6336-1 is known for x1 >= x2"),
    "profile shift x1 + x2": Usual(-0.5, 2.0, "", "c' of ISO 6336-1 is known from -0.5 to 2"),
}
_DIGITS = 6  # to which profile shifts are compared
# resonance ratios to be kept clear of
_RESONANCE = 0.85, 1.15
_BELOW, _ABOVE = (
    Usual(0.0, _RESONANCE[0], "", "main resonance: change teeth, masses or speed, or analyze the vibration"),
    Usual(_RESONANCE[1], _INFINITE, "", "main resonance: change teeth, masses or speed, or analyze the vibration"),
)


def rating_findings(pair: GearPair, rating: Rating, found: PairRating) -> tuple[Finding, ...]:
    """Numbers of a rating that are out of the validity of their formulas; of concrete numbers only."""
    return unusual([*_of_mesh(rating, found), *_of_gears(pair, rating, found)])


def _finding(key: str, value, where: str = "") -> Finding:
    return Finding(key, where, float(value), VALIDITY[key])


def _of_mesh(rating: Rating, found: PairRating) -> Iterator[Finding]:
    geometry, factors = found.geometry, found.factors
    yield _finding("helix angle", np.rad2deg(geometry.helix_angle))
    yield _finding("transverse contact ratio", geometry.contact_ratio)
    yield _finding("application factor K_A", rating.application_factor)
    given = {
        "dynamic factor K_v": rating.dynamic_factor,
        "face load factor K_Hbeta": rating.face_load_factor,
        "face load factor K_Fbeta": rating.root_face_load_factor,
        "transverse load factor K_Halpha": rating.transverse_load_factor,
    }
    yield from (_finding(key, value) for key, value in given.items() if value is not None)
    if rating.dynamic_factor is None:
        yield _finding("v z1 / 100 sqrt(u^2 / (1 + u^2))", factors.usable_speed)
        ratio = float(factors.resonance_ratio)
        yield Finding("resonance ratio N", "", ratio, _BELOW if ratio < 1 else _ABOVE)
    first, second = map(float, geometry.profile_shift)
    teeth = [abs(float(number)) for number in geometry.teeth]
    if teeth[0] > teeth[1]:  # 1 is the smaller gear of c', whatever drives
        first, second = second, first
    yield _finding("profile shift x1 - x2", round(first - second, _DIGITS))
    yield _finding("profile shift x1 + x2", first + second)


def _of_gears(pair: GearPair, rating: Rating, found: PairRating) -> Iterator[Finding]:
    for of, (where, gear, settings) in enumerate(zip(("pinion", "wheel"), pair.gears, rating.gears)):
        yield _finding("flank roughness Rz", settings.roughness, where)
        if settings.root_roughness_rz is not None:
            yield _finding("root roughness Rz", settings.root_roughness_rz, where)
        yield _finding("notch parameter q_s", found.root.notch[of], where)
        depth, radius = settings.grinding_notch_depth, settings.grinding_notch_radius
        if depth is not None and radius is not None:
            ratio = depth / radius
            yield _finding("grinding notch depth over radius", ratio, where)
        yield from _of_blank(gear, where)


def _of_blank(gear: Gear, where: str) -> Iterator[Finding]:
    if gear.rim_thickness is not None and gear.web_thickness is not None:
        height = gear.tip_radius - gear.root_circle_radius
        yield _finding("rim thickness over tooth height", gear.rim_thickness / height, where)
        yield _finding("web thickness over face width", gear.web_thickness / gear.face_width, where)
