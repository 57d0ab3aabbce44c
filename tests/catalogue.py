"""Gears, meshes and reference values that several tests share."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp

import jaxgear as jg
from jaxgear.compliance.laws import LinearLaw
from jaxgear.contact import removed_material, solve_removed
from jaxgear.microgeometry import AbstractModification

# Sizes that tests share, so that the programs of these sizes are compiled once for all of them: contacts that stay at
# their nominal places, contacts that slide (where sliding is argued), and coupled slices.
LINE = jg.Resolution(positions=16, pairs=2, slide_steps=0)
SLIDING = jg.Resolution(positions=16, pairs=2)
FACE = jg.Resolution(positions=8, slices=6, pairs=2, face_modes=3, slide_steps=0, contact_nodes=1)
# two pairs reach as far as 40 um of deflection at contact ratios below 2, and compile in half the time of four
TWO_PAIRS = jg.Resolution(positions=32, pairs=2)
FOUR_PAIRS = jg.Resolution(positions=32, pairs=4)
SLICED = jg.Resolution(positions=32, slices=7, face_modes=3, pairs=2)


def gear_pair(
    teeth=(19, 48),
    module=3.0,
    *,
    shift=(0.0, 0.0),
    face_width=18.0,
    bores=(24.0, 70.0),
    tips=(None, None),
    addendum=1.0,
    **rack,
) -> jg.GearPair:
    """A pair of gears from one basic rack; (pinion, wheel) tuples.

    Every diameter is given explicitly: all pairs then have one tree structure and share what JAX compiles.
    """

    def gear(z, x, bore, tip):
        tip = module * (z + 2 * x + 2 * addendum) if tip is None else tip
        bore = 0.5 * module * (z - 2.5) if bore is None else bore
        return jg.Gear(
            z,
            module,
            profile_shift=x,
            face_width=face_width,
            bore_diameter=bore,
            tip_diameter=tip,
            addendum=addendum,
            **rack,
        )

    return jg.GearPair(*(gear(*numbers) for numbers in zip(teeth, shift, bores, tips)))


def flank(
    *, tip=0.0, tip_length=1.0, curve=(0.44, 0.56), root=0.0, root_length=1.0, barrel=0.0, profile_slope=0.0,
    crowning=0.0, lead_slope=0.0, end=0.0, end_length=1.0, constant=0.0,
) -> AbstractModification:  # fmt: skip
    """Every kind of modification at once, of amount zero where not asked for: one compilation serves them all.

    Amounts in um, lengths in mm; `curve` holds the linear and quadratic coefficients of the tip relief.
    """
    return (
        jg.TipRelief(tip, tip_length, jg.Quadratic(0.0, *curve))
        + jg.RootRelief(root, root_length)
        + jg.ProfileCrowning(barrel)
        + jg.ProfileSlope(profile_slope)
        + jg.LeadCrowning(crowning)
        + jg.LeadSlope(lead_slope)
        + jg.EndRelief(end, end_length)
        + jg.TabulatedProfile([0.0, 1e3], [constant, constant])
    )


POWER_BOX = {"pinion": (0.0, 20.0), "wheel": (0.0, 20.0), "length": (1.0, 5.7), "exponent": (1.0, 3.0)}


def power_reliefs(x):
    """Reliefs of both gears of one power curve, from the parameters of `POWER_BOX`."""
    curve = jg.Power(x["exponent"])
    return jg.TipRelief(x["pinion"], x["length"], curve), jg.TipRelief(x["wheel"], x["length"], curve)


def prepare(
    pair: jg.GearPair, compliance: jg.Compliance | None = None, resolution: jg.Resolution = TWO_PAIRS
) -> jg.Mesh:
    """`jaxgear.prepare` with two pairs."""
    return jg.prepare(pair, compliance=compliance, resolution=resolution)


def solve(mesh: jg.Mesh, torque, pinion=None, wheel=None) -> jg.MeshCycle:
    """`jaxgear.solve` with the modifications of `flank`, so that one compilation serves all tests."""
    return jg.solve(mesh, torque, pinion=pinion or flank(), wheel=wheel or flank())


def solve_any(mesh: jg.Mesh, torque, pinion=None, wheel=None, deviation=0.0) -> jg.MeshCycle:
    """Mesh cycle of any modifications, on top of them the material that deviations remove [um].

    The contact solution compiles once for all kinds of modifications.
    """
    removed = removed_material(mesh, jnp.asarray(torque), pinion=pinion, wheel=wheel) + deviation
    cycle = solve_removed(mesh, jnp.asarray(torque), removed)
    assert bool(jnp.all(cycle.converged))
    return cycle


def ppte(mesh: jg.Mesh, torque, pinion=None, wheel=None, deviation=0.0) -> float:
    """PPTE [um] of `solve_any`."""
    return float(jg.peak_to_peak(solve_any(mesh, torque, pinion, wheel, deviation).transmission_error))


class Point(NamedTuple):
    """Loaded transmission error [um] at a point of the path of contact, by finite elements and by the ring model."""

    place: str
    finite_element: float
    ring: float


class Case(NamedTuple):
    """A pair with reference values: plane stress, hub wind-up included, Weber contact, no modification.

    Attributes:
        line_load: force over face width [N/mm].
        points: transmission error at A (two pairs), in the middle of double contact, and at C, B, D with one pair.
        share: share of the first pair at A, finite elements and ring model, or None.
        ppte: peak to peak with corner contact by finite elements [um].
        uncoupled: the same with the usual uncoupled model: Sainsot's foundation and constant Hertz compliance [um].
        effective_contact_ratio: by finite-element compliances, with corner contact.
    """

    name: str
    teeth: tuple[int, int]
    module: float
    face_width: float
    bores: tuple[float, float]
    torque: float
    line_load: float
    points: tuple[Point, ...]
    share: tuple[float, float] | None
    ppte: float
    uncoupled: float
    effective_contact_ratio: float

    def pair(self) -> jg.GearPair:
        """The gears, from the ISO 53 rack A."""
        return gear_pair(self.teeth, self.module, face_width=self.face_width, bores=self.bores)


# Plane-stress finite elements of both whole gears, bores clamped, combined with Weber contact; "ring" is the beam up to
# the crossing of load line and centreline, plus elastic ring with coupling, plus Weber contact.
FINITE_ELEMENT_CASES = (
    Case(
        "30/30 m2", (30, 30), 2.0, 20.0, (12.6, 12.6), 150.0, 266.04,
        (
            Point("A", 23.307, 23.693), Point("middle", 22.884, 23.269),
            Point("C", 28.810, 29.572), Point("B", 29.091, 29.846), Point("D", 29.091, 29.846),
        ),
        (0.396, 0.402), 5.95, 11.9, 1.869,
    ),
    Case(
        "20/30 m4", (20, 30), 4.0, 40.0, (23.4, 76.6), 98.0, 65.18,
        (
            Point("A", 3.797, 3.883), Point("middle", 3.693, 3.774),
            Point("C", 5.383, 5.570), Point("B", 5.506, 5.698), Point("D", 5.461, 5.637),
        ),
        (0.401, 0.405), 1.755, 2.04, 1.672,
    ),
    Case(
        "19/48 m3", (19, 48), 3.0, 18.0, (24.0, 70.0), 50.0, 103.72,
        (
            Point("A", 5.694, 5.834), Point("middle", 5.504, 5.628),
            Point("C", 8.043, 8.323), Point("B", 8.263, 8.568), Point("D", 8.094, 8.354),
        ),
        (0.389, 0.391), 2.635, 3.09, 1.754,
    ),
)  # fmt: skip


def kahraman_gear(tip_diameter=154.5709, **changes) -> jg.Gear:
    """Gear of the 50/50 module 3 test pair; tip diameter 154.5709 mm makes the contact ratio 1.37, 156 mm 1.755."""
    return jg.Gear(50, 3.0, face_width=20.0, tip_diameter=tip_diameter, bore_diameter=50.0, **changes)


def high_contact_ratio_pair() -> jg.GearPair:
    """Slender teeth, contact ratio between 2 and 3."""
    return gear_pair((40, 60), 2.0, bores=(40.0, 60.0), addendum=1.4, dedendum=1.65, root_radius=0.25)


def constant_stiffness_mesh(pair: jg.GearPair, stiffness: float, resolution: jg.Resolution) -> jg.Mesh:
    """A mesh of uncoupled tooth pairs, all of one stiffness [N/um] on the path of contact, and apart outside."""
    mesh = prepare(pair, resolution=resolution)
    per_width = jnp.full_like(mesh.path, pair.face_width / stiffness)
    return eqx.tree_at(
        lambda m: (m.structure, m.law, m.corner_gap, m.lever, m.hub),
        mesh,
        (
            jnp.zeros_like(mesh.structure),
            LinearLaw(per_width),
            jnp.where(mesh.outside > 0, 1e6, 0.0),
            jnp.ones_like(mesh.lever),
            jnp.zeros_like(mesh.hub),
        ),
    )
