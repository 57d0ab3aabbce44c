"""Numbers of a rating as quantities: objectives, limits, columns of sweeps.

Where the contact analysis has a number of its own, that of the standard is called "rated_...": the face load factor of
a rating is `rated_face_load_factor`. The pitting safety S_H and the root safety S_F have the names of those of
`metrics.Strength`, which measure the same stresses, without load factors, by strengths that are given as a whole.
"""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..metrics import Analysis, Quantity, Vocabulary
from ..metrics.flank import removed_at
from ..metrics.load_distribution import face_load_factor, over_several_slices
from ..metrics.safety import safety_factor
from ..metrics.stress import root_stress
from ..numerics.reductions import Min
from .chain import PairRating, rate
from .settings import Rating

Scalar = Float[Array, ""]
Number = Callable[[PairRating], Any]


def rating_of(analysis: Analysis, rating: Rating) -> PairRating:
    """The rating of an analyzed design under its load, worked out once for all quantities of the same settings.

    K_Hbeta is that of the contact analysis under the torque as it stands; 1 on one slice. ISO 6336-1 has it under K_A
    K_gamma K_v times the torque, where the load is more even as long as shafts do not bend: that of an analysis at this
    torque can be given as `face_load_factor`. C_a is the relief of the flanks in the middle of the
    face.

    Raises:
        ValueError: for an operating point without speed, and for what the rating lacks.
    """
    return analysis.once(rating, "rating", lambda: _rated(analysis, rating))


def _rated(analysis: Analysis, rating: Rating) -> PairRating:
    cycle, speed = analysis.cycle, analysis.operating_point.speed
    if speed is None:
        raise ValueError("needs a speed, solve with OperatingPoint(torque, speed)")
    return rate(
        cycle.kinematics.pair,
        cycle.torque,
        speed,
        rating,
        path=cycle.kinematics.path_of_contact,
        face_load_factor=over_several_slices(face_load_factor, cycle),
        tip_relief=ends_relief(analysis),
    )


def ends_relief(analysis: Analysis) -> Scalar:
    """C_a [um]: the smaller of those of both tips."""
    return jnp.min(tip_reliefs(analysis))


def tip_reliefs(analysis: Analysis) -> Float[Array, " gears"]:
    """C_a of both tips [um]: C_a1 + C_f2 and C_a2 + C_f1, what the flanks give way at the ends E and A of the path."""
    cycle = analysis.cycle
    path = cycle.kinematics.path_of_contact
    ends = jnp.stack([path.end, path.start])
    removed = jnp.zeros_like(ends)
    flanks = (cycle.pinion, path.pinion_roll_length(ends)), (cycle.wheel, path.wheel_roll_length(ends))
    for side, (modification, rolls) in zip(cycle.sides, flanks):
        if modification is not None:
            removed = removed + removed_at(side, modification, rolls)
    return jnp.maximum(removed, 0.0)


def _of(number: Number, analysis: Analysis, rating: Rating) -> Any:
    return number(rating_of(analysis, rating))


def _of_gear(number: Number, gear: int, analysis: Analysis, rating: Rating) -> Any:
    return number(rating_of(analysis, rating))[gear]


def _local_root_safety(gear: int, analysis: Analysis, rating: Rating) -> Any:
    found = rating_of(analysis, rating)
    of = root_stress(analysis.cycle)
    outer = found.factors.application * found.factors.mesh * found.factors.dynamic
    return safety_factor(found.bending.limit[gear], outer * (of.pinion, of.wheel)[gear])


def _both(
    name: str, number: Number, label: str, unit: str = "", form: str = ".3f", **options: Any
) -> Iterator[Quantity]:
    for gear, of in enumerate(("pinion", "wheel")):
        yield Quantity(
            f"{of}_{name}",
            partial(_of_gear, number, gear),
            unit,
            f"{label} after ISO 6336, {of}",
            label=f"{of} {label}",
            form=form,
            takes=Rating,
            **options,
        )


def _one(name: str, number: Number, label: str, unit: str = "", form: str = ".3f", **options: Any) -> Quantity:
    meaning = f"{label} after ISO 6336"
    return Quantity(name, partial(_of, number), unit, meaning, label=label, form=form, takes=Rating, **options)


_SAFETY: dict[str, Any] = {"form": ".2f", "better": "larger"}
_STRESS: dict[str, Any] = {"unit": "MPa", "form": ".2f"}
_STRENGTH: dict[str, Any] = {**_STRESS, "better": "larger"}
_DAMAGE: dict[str, Any] = {"form": ".3g", "needs": "service_life"}

RATING_QUANTITIES = Vocabulary(
    (
        _one("tangential_force", lambda of: of.tangential_force, "tangential force F_t", "N", ".1f"),
        _one("rated_dynamic_factor", lambda of: of.factors.dynamic, "dynamic factor K_v"),
        _one("resonance_ratio", lambda of: of.factors.resonance_ratio, "resonance ratio N"),
        _one("rated_face_load_factor", lambda of: of.factors.face, "face load factor K_Hbeta of the rating"),
        _one("rated_root_face_load_factor", lambda of: of.factors.root_face, "face load factor K_Fbeta of the rating"),
        _one("transverse_load_factor", lambda of: of.factors.transverse, "transverse load factor K_Halpha"),
        _one("root_transverse_load_factor", lambda of: of.factors.root_transverse, "transverse load factor K_Falpha"),
        _one("mesh_stiffness", lambda of: of.factors.mesh_stiffness, "mesh stiffness c_gamma_alpha", "N/(mm um)"),
        _one("single_stiffness", lambda of: of.factors.single_stiffness, "single stiffness c'", "N/(mm um)"),
        _one("reduced_mass", lambda of: of.factors.reduced_mass, "reduced mass m_red", "kg/mm", ".5f"),
        _one("zone_factor", lambda of: of.flank.zone, "zone factor Z_H"),
        _one("elasticity_factor", lambda of: of.flank.elasticity, "elasticity factor Z_E", "MPa^0.5"),
        _one("contact_ratio_factor", lambda of: of.flank.contact_ratio, "contact ratio factor Z_eps"),
        _one("helix_angle_factor", lambda of: of.flank.helix_angle, "helix angle factor Z_beta"),
        _one("lubricant_factor", lambda of: of.flank.lubricant, "lubricant factor Z_L", better="larger"),
        _one("velocity_factor", lambda of: of.flank.velocity, "velocity factor Z_v", better="larger"),
        _one("roughness_factor", lambda of: of.flank.roughness, "roughness factor Z_R", better="larger"),
        *_both("single_pair_contact_factor", lambda of: of.flank.single_pair, "single pair contact factor Z_B, Z_D"),
        *_both("rated_contact_stress", lambda of: of.pitting.stress, "contact stress sigma_H", **_STRESS),
        *_both("work_hardening_factor", lambda of: of.flank.work_hardening, "work hardening factor Z_W"),
        *_both("pitting_life_factor", lambda of: of.pitting.life_factor, "life factor Z_NT"),
        *_both("size_factor", lambda of: of.flank.size, "size factor Z_X"),
        *_both("pitting_stress_limit", lambda of: of.pitting.limit, "pitting stress limit sigma_HG", **_STRENGTH),
        *_both(
            "permissible_contact_stress",
            lambda of: of.pitting.permissible,
            "permissible contact stress sigma_HP",
            **_STRENGTH,
        ),
        *_both("pitting_safety", lambda of: of.pitting.safety, "pitting safety S_H", **_SAFETY),
        *_both("static_pitting_safety", lambda of: of.pitting.static_safety, "static pitting safety", **_SAFETY),
        *_both("pitting_damage_sum", lambda of: of.pitting.damage, "pitting damage over the service life", **_DAMAGE),
        *_both("form_factor", lambda of: of.root.form, "form factor Y_F"),
        *_both("stress_correction_factor", lambda of: of.root.correction, "stress correction factor Y_S"),
        *_both("rim_factor", lambda of: of.root.rim, "rim factor Y_B"),
        *_both("rated_root_stress", lambda of: of.bending.stress, "root stress sigma_F", **_STRESS),
        *_both(
            "notch_sensitivity_factor", lambda of: of.root.notch_sensitivity, "notch sensitivity factor Y_deltarelT"
        ),
        *_both("surface_factor", lambda of: of.root.surface, "surface factor Y_RrelT"),
        *_both("root_size_factor", lambda of: of.root.size, "size factor Y_X"),
        *_both("root_life_factor", lambda of: of.bending.life_factor, "life factor Y_NT"),
        *_both("mean_stress_factor", lambda of: of.root.mean_stress, "mean stress factor Y_M"),
        *_both("root_stress_limit", lambda of: of.bending.limit, "root stress limit sigma_FG", **_STRENGTH),
        *_both(
            "permissible_root_stress",
            lambda of: of.bending.permissible,
            "permissible root stress sigma_FP",
            **_STRENGTH,
        ),
        *_both("root_safety", lambda of: of.bending.safety, "root safety S_F", **_SAFETY),
        *_both("static_root_safety", lambda of: of.bending.static_safety, "static root safety", **_SAFETY),
        *_both("root_damage_sum", lambda of: of.bending.damage, "root damage over the service life", **_DAMAGE),
        *_both("service_life", lambda of: of.life, "life", "h", ".4g", better="larger", needs="service_life"),
        *(
            Quantity(
                f"{of}_rated_local_root_safety",
                partial(_local_root_safety, gear),
                "",
                f"root stress limit over the largest root stress of the contact analysis with K_A K_gamma K_v, {of}",
                Min(),
                label=f"{of} root safety, contact analysis",
                takes=Rating,
                **_SAFETY,
            )
            for gear, of in enumerate(("pinion", "wheel"))
        ),
    )
)
