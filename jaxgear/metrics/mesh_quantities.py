"""Quantities of this package, and a summary of a mesh cycle by the most important ones.

References:
    For contact lines: ISO 21771 (ratios), ISO 6336-2 and G. Niemann, H. Winter, Maschinenelemente II (lengths).
"""

from collections.abc import Iterator
from functools import partial
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import MeshCycle
from ..geometry import GearPair, margins, path_of_contact
from ..numerics import UnitKey, over_batch, safe_divide
from ..numerics.reductions import Average, Harmonic, Max, Min, Range, Rms
from .excitation import force_excitation, relative_transmission_error
from .flank import max_relief, relief_reversal, removed_volume
from .load_distribution import (
    contact_shock,
    corner_force,
    edge_load_factor,
    effective_contact_ratio,
    face_load_factor,
    mean_face_load_factor,
    root_face_load_factor,
)
from .lubrication import loss_factor
from .quantity import Quantity, Vocabulary
from .rating import LUBRICATED, RATED
from .stress import nominal_contact_stress, nominal_root_stress, root_stress

Scalar = Float[Array, ""]
Curve = Float[Array, " positions"]


@over_batch
def total_contact_ratio(cycle: MeshCycle) -> Scalar:
    """Total contact ratio eps_gamma = eps_alpha + eps_beta, sum of transverse contact ratio and overlap ratio."""
    return cycle.kinematics.path_of_contact.contact_ratio + cycle.kinematics.pair.overlap_ratio


def contact_line_lengths(pair: GearPair) -> tuple[Scalar, Scalar]:
    """Least and mean total length of the theoretical contact lines of all pairs over the cycle [mm].

        mean   b eps_alpha / cos(beta_b)
        least  the mean less min(n_a n_b, (1 - n_a) (1 - n_b)) / eps_beta b / cos(beta_b)

    with the fractional parts n_a of the transverse contact ratio and n_b of the overlap ratio. For spur gears the least
    length is the face width times the integer part of the contact ratio.
    """
    transverse, overlap = path_of_contact(pair).contact_ratio, pair.overlap_ratio
    beyond, over = transverse - jnp.floor(transverse), overlap - jnp.floor(overlap)
    share = jnp.where(overlap < 1, 1.0, safe_divide(over, overlap))
    less = jnp.minimum(beyond * share, safe_divide((1 - beyond) * (1 - over), overlap, default=1.0))
    along = pair.face_width / jnp.cos(pair.pinion.base_helix_angle)
    return along * (transverse - less), along * transverse


@over_batch
def axial_force(cycle: MeshCycle) -> Scalar:
    """Axial force F_bt tan(abs(beta_b)) of the mesh [N], in opposite directions on pinion and wheel."""
    return cycle.force * jnp.abs(cycle.kinematics.pair.path_slope)


@over_batch
def tilting_moments(cycle: MeshCycle) -> tuple[Scalar, Scalar]:
    """Tilting moments F_ax r_w of the axial force on pinion and wheel, with their working pitch radii [N m]."""
    pair, force = cycle.kinematics.pair, 1e-3 * axial_force(cycle)
    secant = 1 / jnp.cos(pair.working_pressure_angle)
    return force * pair.pinion.base_radius * secant, force * pair.wheel.signed(pair.wheel.base_radius) * secant


@over_batch
def shuttling_moment(cycle: MeshCycle) -> Curve:
    """Moment of the forces on the line of action about the middle of the common face, sum of q y dy [N m].

    It is positive for a load at positive face coordinates. For helical gears it alternates while the contact lines pass
    over the face, and excites the bearings.
    """
    of = cycle.kinematics
    return 1e-3 * jnp.einsum("psn,s->n", cycle.line_load, of.face_coordinate * of.slice_width)


Load = Float[Array, "pairs slices positions"]


def _te(cycle: MeshCycle):
    return cycle.transmission_error


def _corner_length(cycle: MeshCycle) -> Scalar:
    shock = contact_shock(cycle)
    return shock.approach + shock.recess


def _contact_pressure(cycle: MeshCycle) -> Load:
    # a contact is on the flank or at the tip edge, and zero in the other field
    return cycle.contact_pressure + cycle.corner_pressure


def mean_removed_material(cycle: MeshCycle) -> Scalar:
    """Total material removed from both flanks, mean over the contacts on the path of contact [um].

    Use it to choose the design with the least grinding among designs of equal transmission error.
    """
    # on the path of contact unmodified flanks have no gap: what is there is the modification
    weight = jnp.where(cycle.kinematics.outside <= 0, cycle.kinematics.slice_width[None, :, None], 0.0)
    return jnp.sum(cycle.gap * weight) / jnp.sum(weight)


def _of_pair(of: Any):
    return lambda cycle: of(cycle.kinematics.pair)


def _margin(name: str):
    return lambda cycle: getattr(margins(cycle.kinematics.pair), name)


def _backlash_limit(end: int):
    return lambda cycle: cycle.kinematics.pair.backlash_limits[..., end]


def _of_flanks(function):
    return lambda cycle: function(cycle.kinematics, pinion=cycle.pinion, wheel=cycle.wheel)


def _stresses(name: str, of: Any, meaning: str, label: str = "", **options: Any) -> Iterator[Quantity]:
    """A stress of pinion and wheel, which `of` gives together."""
    for gear in ("pinion", "wheel"):
        labelled = options | {"label": f"{gear} {label}" * bool(label)}
        yield Quantity(f"{gear}_{name}", partial(_one, of, gear), "MPa", f"{meaning}, {gear}", **labelled)


def _one(of: Any, gear: str, cycle: MeshCycle) -> Any:
    return getattr(of(cycle), gear)


MESH_QUANTITIES = Vocabulary(
    (
        Quantity("ppte", _te, "um", "peak-to-peak transmission error", Range(), local=True, label="PPTE", form=".3f"),
        Quantity(
            "relative_ppte",
            relative_transmission_error,
            meaning="peak-to-peak over mean transmission error",
            reduction=Range(),
            label="PPTE over mean transmission error",
            form=".4f",
        ),
        Quantity(
            "mean_te",
            _te,
            "um",
            "mean transmission error",
            Average(),
            local=True,
            label="mean transmission error",
            form=".3f",
        ),
        Quantity("te_rms", _te, "um", "rms of the transmission error about its mean", Rms(), local=True),
        Quantity(
            "unloaded_ppte",
            lambda cycle: cycle.unloaded_transmission_error,
            "um",
            "peak-to-peak transmission error, unloaded",
            Range(),
            local=True,
            label="unloaded PPTE",
        ),
        *(
            Quantity(
                f"te_harmonic_{order}",
                _te,
                "um",
                f"amplitude of mesh harmonic {order} of the transmission error",
                Harmonic(order),
                local=True,
            )
            for order in (1, 2, 3)
        ),
        Quantity(
            "max_flank_pressure",
            lambda c: c.contact_pressure,
            "MPa",
            "largest Hertzian flank pressure",
            Max(),
            local=True,
            form=".0f",
        ),
        Quantity(
            "max_corner_pressure",
            lambda c: c.corner_pressure,
            "MPa",
            "largest pressure of a tip edge",
            Max(),
            local=True,
            form=".0f",
        ),
        Quantity(
            "max_contact_pressure",
            _contact_pressure,
            "MPa",
            "largest pressure of flanks and tip edges",
            Max(),
            local=True,
        ),
        Quantity(
            "max_line_load",
            lambda c: c.line_load,
            "N/mm",
            "largest line load: normal force per length of the contact line",
            Max(),
            local=True,
        ),
        Quantity(
            "face_load_factor",
            face_load_factor,
            meaning="K_Hbeta, largest over mean line load over the face",
            label="face load factor K_Hbeta",
            form=".3f",
        ),
        Quantity(
            "mean_face_load_factor",
            mean_face_load_factor,
            meaning="largest over mean load over the face of all pairs together, mean over the cycle",
            form=".3f",
        ),
        Quantity("root_face_load_factor", root_face_load_factor, meaning="K_Fbeta, face load factor for root stress"),
        Quantity("edge_load_factor", edge_load_factor, meaning="line load at an end of the face over its mean"),
        Quantity(
            "contact_ratio",
            lambda c: c.kinematics.path_of_contact.contact_ratio,
            meaning="theoretical contact ratio",
            better="larger",
            form=".3f",
        ),
        Quantity(
            "effective_contact_ratio",
            effective_contact_ratio,
            meaning="mean number of loaded pairs",
            better="larger",
            form=".3f",
        ),
        Quantity(
            "overlap_ratio",
            _of_pair(lambda pair: pair.overlap_ratio),
            meaning="face width in axial pitches, 0 of spur gears",
            better="larger",
            form=".3f",
        ),
        Quantity(
            "total_contact_ratio",
            total_contact_ratio,
            meaning="transverse contact ratio plus overlap ratio",
            better="larger",
            form=".3f",
        ),
        *(
            Quantity(
                f"{name}_contact_line_length",
                _of_pair(lambda pair, end=end: contact_line_lengths(pair)[end]),
                "mm",
                f"{name} length of the contact lines of all pairs together over the cycle, theoretical",
                better="larger",
                form=".2f",
            )
            for end, name in enumerate(("least", "mean"))
        ),
        Quantity("axial_force", axial_force, "N", "axial force of the mesh, 0 of spur gears", form=".1f"),
        *(
            Quantity(
                f"{gear}_tilting_moment",
                lambda cycle, number=number: tilting_moments(cycle)[number],
                "N m",
                f"axial force times working pitch radius, {gear}",
                form=".3f",
            )
            for number, gear in enumerate(("pinion", "wheel"))
        ),
        Quantity(
            "shuttling_moment",
            shuttling_moment,
            "N m",
            "peak to peak of the moment of the mesh force about the middle of the face, excites bearings",
            Range(),
            local=True,
            label="shuttling moment, peak to peak",
            form=".3f",
        ),
        Quantity(
            "mean_shuttling_moment",
            shuttling_moment,
            "N m",
            "mean moment of the mesh force about the middle of the face",
            Average(),
            local=True,
            form=".3f",
        ),
        Quantity("corner_contact_length", _corner_length, "mm", "loaded path beyond the theoretical path of contact"),
        Quantity(
            "corner_force",
            corner_force,
            "N",
            "largest force on a pair beyond the theoretical path of contact",
            Max(),
            local=True,
        ),
        *_stresses(
            "root_stress", nominal_root_stress, "root stress after ISO 6336-3", "root stress, ISO 6336-3", form=".1f"
        ),
        *_stresses(
            "local_root_stress",
            root_stress,
            "largest root stress of the contact analysis",
            "root stress, contact analysis",
            reduction=Max(),
            local=True,
            form=".1f",
        ),
        *_stresses(
            "contact_stress",
            nominal_contact_stress,
            "nominal contact stress after ISO 6336-2",
            "contact stress, ISO 6336-2",
            form=".1f",
        ),
        *(
            Quantity(f"{gear}_{name}", _margin(f"{gear}_{name}"), "mm", f"{meaning}, {gear}", better="larger")
            for gear in ("pinion", "wheel")
            for name, meaning in (
                ("tip_land", "thickness of the tooth at the tip"),
                ("form_clearance", "usable involute below the first contact"),
                ("tip_clearance", "from the tip to the mate's root circle"),
                ("rim_thickness", "from the bore to the root circle"),
            )
        ),
        Quantity("backlash", _margin("backlash"), "um", "backlash on the line of action", better="larger"),
        Quantity(
            "min_backlash", _backlash_limit(0), "um", "least backlash, of the thickest teeth allowed", better="larger"
        ),
        Quantity("max_backlash", _backlash_limit(1), "um", "largest backlash, of the thinnest teeth allowed"),
        Quantity(
            "mesh_loss_factor",
            loss_factor,
            meaning="loss power per input power and coefficient of friction",
            label="mesh loss factor H_V",
            form=".4f",
        ),
        Quantity(
            "force_excitation",
            force_excitation,
            "N",
            "peak to peak of stiffness times transmission error about its mean",
            Range(),
            label="force excitation, peak to peak",
            form=".1f",
        ),
        Quantity(
            "min_tangent_stiffness",
            lambda c: c.tangent_stiffness,
            "N/um",
            "smallest mesh stiffness",
            Min(),
            better="larger",
            local=True,
        ),
        Quantity(
            "max_tangent_stiffness", lambda c: c.tangent_stiffness, "N/um", "largest mesh stiffness", Max(), local=True
        ),
        Quantity("removed_material", mean_removed_material, "um", "mean material removed from both flanks together"),
        Quantity("max_relief", _of_flanks(max_relief), "um", "largest material removed from a flank"),
        Quantity(
            "relief_reversal", _of_flanks(relief_reversal), "um", "sum of decreases of the relief towards tip and root"
        ),
        Quantity("removed_volume", _of_flanks(removed_volume), "mm3", "material ground off all flanks"),
        *LUBRICATED,
        *RATED,
    )
)


_SUMMARY = (
    "ppte",
    "relative_ppte",
    "mean_te",
    "unloaded_ppte",
    "max_flank_pressure",
    "max_corner_pressure",
    "max_line_load",
    "contact_ratio",
    "effective_contact_ratio",
    "corner_contact_length",
    "corner_force",
    "pinion_root_stress",
    "wheel_root_stress",
    "pinion_local_root_stress",
    "wheel_local_root_stress",
    "pinion_contact_stress",
    "wheel_contact_stress",
    "mesh_loss_factor",
    "force_excitation",
)

_OBLIQUE = (  # of helical gears
    "overlap_ratio",
    "total_contact_ratio",
    "least_contact_line_length",
    "axial_force",
    "pinion_tilting_moment",
    "wheel_tilting_moment",
    "shuttling_moment",
)
_OVER_FACE = ("face_load_factor", "root_face_load_factor", "edge_load_factor")  # of several slices


@over_batch
def summary(cycle: MeshCycle) -> dict[str, Float[Array, ""]]:
    """Values of the most important quantities of a mesh cycle, by name and unit; traceable, supports `jax.vmap`."""
    names = _SUMMARY if cycle.kinematics.resolution.slices == 1 else (*_SUMMARY, *_OVER_FACE)
    names = (*names, *_OBLIQUE) if cycle.kinematics.helical else names
    return {
        UnitKey("torque", "N m"): cycle.torque,
        **{MESH_QUANTITIES[name].key: MESH_QUANTITIES[name](cycle) for name in names},
        "converged": jnp.all(cycle.converged),
    }
