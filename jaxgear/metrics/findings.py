"""Warnings about values outside the usual range.

One table of limits covers inputs and results. A finding is a warning, never an error.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..compliance import AbstractCompliance, TabulatedCompliance
from ..contact import MeshCycle, Resolution
from ..geometry import Material
from ..microgeometry import AbstractModification, EndRelief, NoModification, RootRelief, TipRelief
from ..numerics import Given, Usual, fields_of, program
from .flank import flank_surface
from .load_distribution import effective_contact_ratio
from .lubricant import Lubricant
from .stress import nominal_root_stress


def _of_field(cls: type[eqx.Module], name: str) -> Usual:
    """Usual range that a class declares for its field."""
    usual = fields_of(cls)[name].usual
    assert usual is not None
    return usual


LIMITS = {
    "torque": Usual(0.0, np.inf, "N m", "the design torque lies outside of load.torque_range"),
    "module": Usual(0.05, 100.0, "mm", "ISO 54 lists 1 to 50 mm, fine mechanics goes down to 0.1 mm"),
    "elastic modulus": _of_field(Material, "elastic_modulus"),
    "density": Usual(500.0, 25_000.0, "kg/m^3", "steel 7850 kg/m^3: is it in g/cm^3?"),
    "rim thickness in modules": Usual(1.75, 30.0, "", "of a ring gear that is held all round its outer circle"),
    "bore to root diameter": Usual(0.1, 0.95, "", "a ring fixed at its bore, out of the usual proportions"),
    "face width in modules, plane stress": Usual(0.0, 20.0, "", 'wide teeth are in plane strain: plane = "auto"'),
    "face width in modules": Usual(2.0, 48.0, "", "range compared with finite elements; narrower contacts are softer"),
    "overhang in modules, one slice": Usual(
        0.0, 1.0, "", "the load concentrates beside it: take resolution.slices = 9"
    ),
    "tip edge radius in modules": Usual(0.0, 0.2, "", "usual tip edge radii are 0.01 to 0.1 modules"),
    "roll length between the form circle and the tip of the mate": Usual(
        -1e-6, np.inf, "mm", "the mate's tip reaches below the form circle: the path of contact begins there"
    ),
    "least backlash": Usual(-0.1, np.inf, "um", "the thickest teeth within the tolerances have no backlash"),
    "coefficient of friction": Usual(0.0, 0.5, "", "lubricated gears 0.03 to 0.12, dry steel 0.4 to 0.6"),
    "coefficient of friction of the oil": Usual(
        0.01, 0.2, "", "lubricated gears 0.03 to 0.12: out of the validity of the law"
    ),
    "bulk temperature": Usual(
        -np.inf, 180.0, "degC", "case-hardened steel softens there, and mineral oil ages above 120"
    ),
    "temperature of the oil": Usual(
        -30.0, np.inf, "degC", "mineral gear oils stop flowing at -10 to -30 degC, synthetic ones at -30 to -60"
    ),
    "cooling factor": Usual(0.2, 1.2, "", "ISO/TS 6336-20: X_S is 0.2 for submerged teeth, 1 for dip, 1.2 for spray"),
    "contact ratio": Usual(1.0, 2.0, "", "stresses and safeties of ISO 6336-2 and -3 are valid for 1 to 2"),
    "pitch line velocity": Usual(0.0, 250.0, "m/s", "turbo gears reach 200 m/s: is the speed in rpm?"),
    "amount of the modification": Usual(0.0, np.inf, "um", "negative: material is added; positive removes it"),
    "depth of the modification": _of_field(TipRelief, "amount"),
    "depth of the modification in modules": Usual(0.0, 0.04, "", "ISO 53:1974 limits tip relief to 0.02 modules"),
    "length of the modification": Usual(0.0, np.inf, "mm", "longer than the flank: it has no start on the flank"),
    "length of the end relief": Usual(0.0, np.inf, "mm", "shorter than the overhang beyond the mate: it has no effect"),
    "slices over the end relief": Usual(2.0, np.inf, "", "the load peaks beside it: jaxgear.contact.end_relief_widths"),
    "mean transmission error in modules": Usual(0.0, 0.02, "", "the deflection is out of the validity of the model"),
    "PPTE": Usual(0.1, np.inf, "um", "below the accuracy of the model for modified flanks"),
    "PPTE by finite elements": Usual(0.03, np.inf, "um", "below the accuracy of a two-dimensional model"),
    "flank pressure": Usual(0.0, 1650.0, "MPa", "endurance limit of the best case-hardened steel (ISO 6336-5)"),
    "corner pressure": Usual(0.0, 1650.0, "MPa", "edge contact above the endurance limit of any flank: add tip relief"),
    "root stress": Usual(0.0, 1050.0, "MPa", "endurance limit of the best case-hardened steel (ISO 6336-5)"),
    "effective contact ratio": Usual(1.0, np.inf, "", "less than one pair in contact: the teeth lose contact"),
}

_RELIEFS = TipRelief, RootRelief, EndRelief


class Finding(NamedTuple):
    """A number with its usual range.

    Attributes:
        key: name of the number, as in `LIMITS`.
        where: "pinion", "wheel", or another part; "" for the pair.
        value: the number, in the unit of the usual range.
        usual: usual range; a number out of it is reported.
        severity: "warning".
    """

    key: str
    where: str
    value: float
    usual: Usual
    severity: Literal["warning"] = "warning"

    @property
    def is_unusual(self) -> bool:
        """True if the value is outside its usual range."""
        return not self.usual.holds(self.value)

    @property
    def number(self) -> str:
        """Text of the value with its unit."""
        return self.usual.text(self.value)

    def __str__(self) -> str:
        return (
            f"{f'{self.where}, ' if self.where else ''}{self.key} {self.number} is {self.usual.missed_by(self.value)}"
        )


def of_limits(
    limits: Mapping[str, Usual],
    key: str,
    where: str,
    value: Given,
    *,
    low: float | None = None,
    high: float | None = None,
) -> Finding:
    """Finding about a value, with the usual range of the table or with other limits `low` and `high`."""
    usual = limits[key]
    usual = usual._replace(low=usual.low if low is None else low, high=usual.high if high is None else high)
    return Finding(key, where, float(value), usual)


def unusual(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Findings whose value is outside the usual range."""
    return tuple(finding for finding in findings if finding.is_unusual)


def findings_of(
    cycle: MeshCycle,
    *,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
    torque_range: tuple[float, float] | None = None,
    speed: float | None = None,
    friction: float | None = None,
    oil_friction: float | None = None,
    bulk_temperature: float | None = None,
    lubricant: Lubricant | None = None,
    compliance: AbstractCompliance | None = None,
    verified: float | None = None,
    support_deflection: float = 0.0,
) -> tuple[Finding, ...]:
    """Findings about a solved design: values outside their usual range; empty if there are none.

    Args:
        cycle: solved cycle of one design at one torque, not traced.
        pinion, wheel: modifications; None for the modifications of the cycle.
        torque_range: lowest and highest torque of interest [N m].
        speed: speed of the pinion [rpm]; None for the speed of the cycle.
        friction: coefficient of friction; None for the value of the cycle.
        oil_friction: coefficient of friction by a law of the lubricant; None without a lubricant.
        bulk_temperature: bulk temperature of the teeth [degC]; None without a lubricant.
        lubricant: lubricant; None without one.
        compliance: compliance of the cycle; None for a compliance composed of models.
        verified: PPTE of the design by the finite-element structure [um]; None if not computed.
        support_deflection: mean transmission error due to shafts, bearings and housing [um].
    """
    flanks = tuple(given or own or NoModification() for given, own in ((pinion, cycle.pinion), (wheel, cycle.wheel)))
    rpm = cycle.operating_point.speed if speed is None else speed
    coefficient = cycle.operating_point.friction if friction is None else friction
    # without the flanks: one program serves every kind of them
    bare = replace(cycle, pinion=None, wheel=None, kinematics=cycle.kinematics.explicit)
    gears, results, sides, overhangs = _numbers(bare)
    (name, where, deflection), *others = results
    deflection = float(deflection) - 1e-3 * support_deflection / float(cycle.kinematics.pair.pinion.module)
    numbers = [_finding(*each) for each in (*gears, (name, where, deflection), *others)]
    sizes, common = cycle.kinematics.resolution, float(sides[0].common_width)
    numbers[len(gears) : len(gears)] = [
        *_of_flanks(sides, flanks),
        *_of_end_reliefs(sizes, common, overhangs, flanks),
    ]
    pair = cycle.kinematics.pair
    if any(float(gear.tooth_thickness_tolerance) for gear in (pair.pinion, pair.wheel)):
        numbers.append(_finding("least backlash", "", pair.backlash_limits[0]))
    if rpm is not None:
        # from numbers, as a product of arrays compiles anew in every process
        angle = 0.0 if pair.pinion.helix_angle is None else float(pair.pinion.helix_angle)
        diameter = float(pair.pinion.module) * float(pair.pinion.teeth) / float(np.cos(np.deg2rad(angle)))
        velocity = float(rpm) * np.pi / 60 * diameter * 1e-3
        numbers.append(_finding("pitch line velocity", "", velocity))
    if coefficient is not None:
        numbers.append(_finding("coefficient of friction", "", coefficient))
    elif oil_friction is not None:
        numbers.append(_finding("coefficient of friction of the oil", "", oil_friction))
    if bulk_temperature is not None:
        numbers.append(_finding("bulk temperature", "", bulk_temperature))
    if lubricant is not None:
        numbers.append(_finding("temperature of the oil", "", lubricant.temperature))
        numbers.append(_finding("cooling factor", "", lubricant.cooling_factor))
    if torque_range is not None:
        low, high = torque_range
        numbers.append(_finding("torque", "", cycle.torque, low=low, high=high))
    found = unusual(numbers)
    if not all(isinstance(flank, NoModification) for flank in flanks):
        found += finding_of_claim(float(np.ptp(np.asarray(cycle.transmission_error))), compliance, verified)
    return found


def finding_of_claim(
    ppte: float, compliance: AbstractCompliance | None = None, verified: float | None = None
) -> tuple[Finding, ...]:
    """Finding about a PPTE of modified flanks below the accuracy of the model; empty otherwise.

    Args:
        ppte: computed PPTE [um].
        compliance: compliance of the computation; None for a compliance composed of models.
        verified: PPTE of the design by the finite-element structure [um]; None if not computed.
    """
    finding = _finding("PPTE by finite elements" if isinstance(compliance, TabulatedCompliance) else "PPTE", "", ppte)
    if verified is not None:
        remark = f"{finding.usual.remark}; with finite-element structure: {verified:.3g} um"
        finding = finding._replace(usual=finding.usual._replace(remark=remark))
    return unusual([finding])


_finding = partial(of_limits, LIMITS)


@program
def _numbers(cycle: MeshCycle):
    """Numbers of the gears and of the solution with their names, both sides, and by how much they overhang the load."""
    pair = cycle.kinematics.pair
    gears = []
    for where, gear in (("pinion", pair.pinion), ("wheel", pair.wheel)):
        gears += [
            ("module", where, gear.module),
            ("elastic modulus", where, gear.material.elastic_modulus),
            ("density", where, gear.material.density),
            ("rim thickness in modules", where, gear.body_thickness / gear.module)
            if gear.is_internal
            else ("bore to root diameter", where, gear.bore_radius / gear.root_circle_radius),
            ("tip edge radius in modules", where, gear.edge_radius / gear.module),
        ]
        form = getattr(cycle.margins, f"{where}_form_clearance")
        gears.append(("roll length between the form circle and the tip of the mate", where, form))
    module, stress = pair.pinion.module, nominal_root_stress(cycle)
    in_stress = cycle.kinematics.plane == "stress"
    name = "face width in modules, plane stress" if in_stress else "face width in modules"
    gears.append((name, "", pair.face_width / module))
    if cycle.kinematics.resolution.slices == 1:
        wider = jnp.maximum(*(gear.face_width for gear in pair.gears)) - pair.face_width
        gears.append(("overhang in modules, one slice", "", wider / module))
    results = [
        ("mean transmission error in modules", "", 1e-3 * jnp.mean(cycle.transmission_error) / module),
        ("flank pressure", "", jnp.max(cycle.contact_pressure)),
        ("corner pressure", "", jnp.max(cycle.corner_pressure)),
        ("root stress", "pinion", stress.pinion),
        ("root stress", "wheel", stress.wheel),
        ("effective contact ratio", "", effective_contact_ratio(cycle)),
        ("contact ratio", "", cycle.kinematics.path_of_contact.contact_ratio),
    ]
    return gears, results, cycle.sides, pair.overhangs


def _of_flanks(sides, flanks) -> Iterator[Finding]:
    for where, side, modification in zip(("pinion", "wheel"), sides, flanks):
        if isinstance(modification, NoModification):
            continue
        surface = flank_surface(side, modification)
        depth = float(np.abs(surface.removed).max())
        if depth > 0:
            yield _finding("depth of the modification", where, depth)
        yield _finding("depth of the modification in modules", where, depth / 1e3 / float(side.gear.module))
        start, *_, tip = np.asarray(surface.roll_length)
        for amount in _amounts(modification):
            yield _finding("amount of the modification", where, amount)
        for length, longest in _lengths(modification, tip - start, 0.5 * float(side.face_width)):
            yield _finding("length of the modification", where, length, high=longest)


def _amounts(modification: AbstractModification) -> Iterator[float]:
    """Amounts of all reliefs, which are meant to remove material; slopes and crownings may have either sign."""
    for term in jax.tree.leaves(modification, is_leaf=lambda part: isinstance(part, _RELIEFS)):
        if isinstance(term, _RELIEFS):
            yield float(term.amount)


def _lengths(modification: AbstractModification, profile: float, half_face: float) -> Iterator[tuple[float, float]]:
    """Lengths of all terms, and the longest that the flank has in their direction."""
    terms = jax.tree.leaves(modification, is_leaf=lambda part: hasattr(part, "length"))
    for term in terms:
        if hasattr(term, "length"):
            yield float(term.length), half_face if getattr(term, "varies_along_face", False) else profile


def _of_end_reliefs(sizes: Resolution, face_width: float, overhangs, flanks) -> Iterator[Finding]:
    """Findings on end reliefs beyond the common face, and on slices that cannot resolve them."""
    for where, ends, modification in zip(("pinion", "wheel"), overhangs, flanks):
        for term in jax.tree.leaves(modification, is_leaf=lambda part: isinstance(part, EndRelief)):
            if isinstance(term, EndRelief) and term.varies_along_face:
                sides = {"negative": (0,), "positive": (1,), "both": (0, 1)}[term.side]
                yield _finding(
                    "length of the end relief", where, term.length, low=max(float(ends[end]) for end in sides)
                )
                reach = {end: (float(term.length) - float(ends[end])) / face_width for end in sides}
                shown = [_slices_over(sizes, end, share) for end, share in reach.items() if share > 0]
                if sizes.slices > 1 and shown:
                    yield _finding("slices over the end relief", where, min(shown))


def _slices_over(sizes: Resolution, end: int, share: float) -> float:
    """Number of slices over a share of the face from its negative (0) or positive (1) end."""
    edges = sizes.slice_edges + 0.5
    count = np.interp(share, 1.0 - edges[::-1] if end else edges, np.arange(len(edges)))
    return round(float(count), 6)  # the end of a slice is one, rounding or not
