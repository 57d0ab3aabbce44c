"""Materials of gears: endurance limits over hardness, and what else follows from the heat treatment.

References:
    ISO 6336-5:2003/2016 for the limits, sigma_lim = A x + B over the hardness x; ISO 6336-1, -2 and -3 for running-in,
    S-N lines and the factors of notch, surface, size and mean stress. The numbers of through-hardened, case-hardened
    and nitrided steels have been checked against published ratings; those of castings and of induction hardening not.
"""

from collections.abc import Mapping
from typing import Any, Literal, NamedTuple, get_args

HeatTreatment = Literal[
    "normalized",
    "cast_steel",
    "black_malleable_iron",
    "nodular_iron",
    "ferritic_nodular_iron",
    "grey_iron",
    "through_hardened_carbon",
    "through_hardened",
    "through_hardened_carbon_cast",
    "through_hardened_cast",
    "case_hardened",
    "induction_hardened",
    "gas_nitrided",
    "through_hardened_nitrided",
    "nitrocarburized",
]
MaterialQuality = Literal["ML", "MQ", "ME"]
QUALITIES: tuple[str, ...] = get_args(MaterialQuality)

Knees = tuple[tuple[float, float], ...]  # (load cycles, life factor), the last but one is the endurance limit


class Kind(NamedTuple):
    """Numbers that the materials of one kind have in common.

    Attributes:
        flank, root: knees of the S-N lines up to the endurance limit.
        running_in: "hard" for surface-hardened flanks, "soft" for others of steel, "cast" for grey iron.
        notch: (strength [MPa], slip layer thickness rho' [mm]) by yield strength; one row for any.
        static_notch: Y_deltarelT of static strength: a + b Y_S; or, by the yield strength sigma_S, (1 + c (Y_S - 1)) /
            (1 + c) with c = a (b / sigma_S)^0.25, where the third says so.
        surface: a, b, e, most of Y_RrelT = a - b (R_z + 1)^e, at most `most`.
        size: a, b, least of Y_X = a - b m_n from 5 mm on, at least `least`.
        mean_stress: M of Y_M, fatigue: a - b Y_S.
        static_mean_stress: likewise of static strength.
        hardened: whether the flank is harder than the core.
    """

    flank: Knees
    root: Knees
    running_in: Literal["hard", "soft", "cast"]
    notch: Knees
    static_notch: tuple[float, float, bool]
    surface: tuple[float, float, float, float]
    size: tuple[float, float, float]
    mean_stress: tuple[float, float]
    static_mean_stress: tuple[float, float]
    hardened: bool


_LIFE = (1e5, 1.6), (5e7, 1.0)
_SHORT_LIFE = (1e5, 1.3), (2e6, 1.0)
PITTING_PERMITTED: Knees = (6e5, 1.6), (1e7, 1.3), (1e9, 1.0)  # in place of _LIFE
LONG_LIFE = 1e10  # cycles, at which S-N lines end
_ROOT_SOFT, _ROOT_HARD, _ROOT_SHORT = (
    ((1e4, 2.5), (3e6, 1.0)),
    ((1e3, 2.5), (3e6, 1.0)),
    ((1e3, 1.6), (3e6, 1.0)),
)
_OF_STEEL, _OF_SOFT, _OF_IRON = (
    (5.306, 4.203, 0.01, 1.07),
    (1.674, 0.529, 0.1, 1.12),
    (4.299, 3.259, 0.005, 1.025),
)
_SIZE_SOFT, _SIZE_HARD, _SIZE_IRON = (1.03, 0.006, 0.85), (1.05, 0.01, 0.80), (1.075, 0.015, 0.70)
_NOTCH_STEEL = (300.0, 0.0833), (400.0, 0.0445)
_NOTCH_SOFT = (500.0, 0.0281), (600.0, 0.0194), (800.0, 0.0064), (1000.0, 0.0014)
_NOTCH_IRON = ((300.0, 0.3095),)
_NOTCH_GREY = (150.0, 0.3124), (300.0, 0.3095)
_NOTCH_HARD, _NOTCH_NITRIDED = ((0.0, 0.0030),), ((0.0, 0.1005),)

_STEEL = Kind(
    flank=_LIFE,
    root=_ROOT_SOFT,
    running_in="soft",
    notch=_NOTCH_STEEL,
    static_notch=(0.93, 200.0, True),
    surface=_OF_STEEL,
    size=_SIZE_SOFT,
    mean_stress=(0.3, 0.0),
    static_mean_stress=(0.5, 0.0),
    hardened=False,
)
_AS_CAST: dict[str, Any] = {"mean_stress": (0.4, 0.0), "static_mean_stress": (0.6, 0.0)}
_CAST_STEEL = _STEEL._replace(static_notch=(0.86, 0.07, False), **_AS_CAST)
_SOFT = _STEEL._replace(notch=_NOTCH_SOFT, static_notch=(0.82, 300.0, True), surface=_OF_SOFT)
_CAST = _SOFT._replace(**_AS_CAST)
_FERRITIC = _CAST._replace(
    flank=_SHORT_LIFE,
    root=_ROOT_SHORT,
    running_in="cast",
    notch=_NOTCH_IRON,
    static_notch=(1.0, 0.0, False),
    surface=_OF_IRON,
    size=_SIZE_IRON,
)
_HARD = Kind(
    flank=_LIFE,
    root=_ROOT_HARD,
    running_in="hard",
    notch=_NOTCH_HARD,
    static_notch=(0.12, 0.44, False),
    surface=_OF_SOFT,
    size=_SIZE_HARD,
    mean_stress=(0.8, 0.15),
    static_mean_stress=(0.7, 0.0),
    hardened=True,
)
_NITRIDED = _HARD._replace(
    flank=_SHORT_LIFE,
    root=_ROOT_SHORT,
    notch=_NOTCH_NITRIDED,
    static_notch=(0.6, 0.2, False),
    surface=_OF_IRON,
    mean_stress=(0.3, 0.0),
    static_mean_stress=(0.4, 0.0),
)


class Limit(NamedTuple):
    """A x + B of the hardness x, at most `most` [MPa]."""

    slope: float
    offset: float
    most: float = float("inf")


class Group(NamedTuple):
    """A group of materials of ISO 6336-5.

    Attributes:
        hardness: unit of its hardness.
        ranges: of hardness, for the qualities ML, MQ and ME.
        pitting: sigma_Hlim for the three qualities.
        bending: sigma_Flim for the three qualities.
        kind: what else follows.
    """

    hardness: Literal["HBW", "HV"]
    ranges: tuple[tuple[float, float], ...]
    pitting: tuple[Limit, ...]
    bending: tuple[Limit, ...]
    kind: Kind


def _group(unit: Literal["HBW", "HV"], ranges, pitting, bending, kind: Kind) -> Group:
    """A group of rows of two (ML like MQ) or three qualities, ranges of one for all or three."""

    def three(rows):
        return (rows[0], *rows) if len(rows) == 2 else tuple(rows) * (3 // len(rows))

    pits, bends = (tuple(Limit(*row) for row in three(rows)) for rows in (pitting, bending))
    return Group(unit, three(ranges), pits, bends, kind)


GROUPS: Mapping[str, Group] = {
    "normalized": _group(
        "HBW", [(110, 210)], [(1.0, 190), (1.52, 250)], [(0.455, 69), (0.386, 147)], _STEEL
    ),
    "cast_steel": _group(
        "HBW", [(140, 210)], [(0.986, 131), (1.143, 237)], [(0.313, 62), (0.254, 137)],
        _CAST_STEEL,
    ),
    "black_malleable_iron": _group(
        "HBW", [(135, 250), (175, 250)], [(1.371, 143), (1.333, 267)], [(0.345, 77), (0.403, 128)], _CAST
    ),
    "nodular_iron": _group(
        "HBW", [(175, 300), (200, 300)], [(1.434, 211), (1.5, 250)], [(0.35, 119), (0.38, 134)], _CAST
    ),
    "ferritic_nodular_iron": _group(
        "HBW", [(175, 300), (200, 300)], [(1.434, 211), (1.5, 250)], [(0.35, 119), (0.38, 134)], _FERRITIC
    ),
    "grey_iron": _group(
        "HBW", [(150, 240), (175, 275)], [(1.033, 132), (1.465, 122)], [(0.256, 8), (0.2, 53)],
        _FERRITIC._replace(notch=_NOTCH_GREY),
    ),
    "through_hardened_carbon": _group(
        "HV", [(135, 210)], [(0.963, 283), (0.925, 360), (0.838, 432)],
        [(0.25, 108), (0.24, 163), (0.283, 202)], _SOFT,
    ),
    "through_hardened": _group(
        "HV", [(200, 360), (200, 390)], [(1.313, 188), (1.313, 373), (2.213, 260)],
        [(0.423, 104), (0.425, 187), (0.358, 231)], _SOFT,
    ),
    "through_hardened_carbon_cast": _group(
        "HV", [(130, 215)], [(0.831, 300), (0.951, 345)], [(0.224, 117), (0.286, 167)], _CAST
    ),
    "through_hardened_cast": _group(
        "HV", [(200, 360)], [(1.276, 298), (1.35, 356)], [(0.364, 161), (0.356, 186)], _CAST
    ),
    "case_hardened": _group(
        "HV", [(600, 800), (660, 800), (660, 800)], [(0, 1300), (0, 1500), (0, 1650)],
        [(0, 312), (0, 425), (0, 525)], _HARD,
    ),
    "induction_hardened": _group(
        "HV", [(485, 615), (500, 615), (500, 615)], [(0.74, 602), (0.541, 882), (0.505, 1013)],
        [(0.305, 76), (0.138, 290, 369), (0.271, 237)],
        _HARD._replace(**_AS_CAST),
    ),
    "gas_nitrided": _group(
        "HV", [(650, 900)], [(0, 1125), (0, 1250), (0, 1450)], [(0, 270), (0, 420), (0, 468)], _NITRIDED
    ),
    "through_hardened_nitrided": _group(
        "HV", [(450, 650)], [(0, 788), (0, 998), (0, 1217)], [(0, 258), (0, 363), (0, 432)], _NITRIDED
    ),
    "nitrocarburized": _group(
        "HV", [(300, 650)], [(0, 650), (1.167, 425, 950), (1.167, 425, 950)],
        [(0, 224), (0.653, 94, 388), (0.653, 94, 388)],
        _NITRIDED._replace(flank=((1e5, 1.1), (2e6, 1.0)), root=((1e3, 1.1), (3e6, 1.0))),
    ),
}  # fmt: skip
