"""Scuffing, micropitting and losses of a rating as quantities: objectives, limits, columns of sweeps.

The numbers of the standards are called "rated_..." where the contact analysis has one of its own. Those of the contact
analysis, at every contact and under the load factors of the rating, are called "local_...".
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import jax.numpy as jnp

from ..metrics import Analysis, Lubricant, Quantity, Vocabulary
from ..metrics.safety import micropitting_safety, scuffing_safety
from ..numerics import changed
from ..numerics.reductions import Min
from .micropitting import material_factor, permissible_film_thickness
from .quantities import rating_of, tip_reliefs
from .scuffing import scuffing_temperature
from .settings import Rating
from .thermal import ThermalRating, thermal_rating

# fields of the lubricant of which one must be given, by the quantity
_SCUFFED = "fzg_stage", "scuffing_temperature"
_PITTED = "micropitting_test", "micropitting_test_film", "permissible_film"
_DIPPED = "pinion_immersion", "wheel_immersion"
NEEDED: dict[str, tuple[tuple[str, ...], ...]] = {
    "rated_scuffing_safety": (_SCUFFED,),
    "local_scuffing_safety": (_SCUFFED,),
    "rated_scuffing_temperature": (_SCUFFED,),
    "integral_scuffing_safety": (("fzg_stage",),),
    "permissible_specific_film_thickness": (_PITTED,),
    "rated_micropitting_safety": (_PITTED,),
    "local_micropitting_safety": (_PITTED,),
    "no_load_loss_power": (_DIPPED,),
    "churning_loss_power": (_DIPPED, ("oil_volume",)),
}


def missing(name: str, lubricant: Lubricant | None) -> str:
    """Fields that a lubricant lacks for a quantity, in words; "" where none."""
    for several in NEEDED.get(name, ()):
        if all(getattr(lubricant, each, None) is None for each in several):
            return " or ".join(f"lubricant.{each}" for each in several)
    return ""


def thermal_of(analysis: Analysis, rating: Rating) -> ThermalRating:
    """Scuffing, micropitting and losses of an analyzed design, worked out once for all quantities."""

    def worked_out() -> ThermalRating:
        found, speed = rating_of(analysis, rating), analysis.operating_point.speed
        assert speed is not None
        dips = rating.lubricant is not None and rating.lubricant.wheel_immersion is not None
        if dips and analysis.cycle.kinematics.pair.wheel.is_internal:
            raise ValueError("lubricant.wheel_immersion: the losses of a ring gear that dips into oil are not covered")
        return thermal_rating(found, analysis.cycle.torque, speed, rating, tip_reliefs(analysis))

    return analysis.once(rating, "thermal", worked_out)


def _check(name: str, rating: Rating) -> Lubricant:
    if rating.lubricant is None:
        raise ValueError("needs the lubricant")
    if lacks := missing(name, rating.lubricant):
        raise ValueError(f"needs {lacks}")
    return rating.lubricant


def _of(name: str, number: Callable[[ThermalRating], Any], analysis: Analysis, rating: Rating) -> Any:
    _check(name, rating)
    return number(thermal_of(analysis, rating))


def _loaded(name: str, analysis: Analysis, rating: Rating) -> Lubricant:
    """The lubricant under the load factors that the contact analysis does not know: on slices it knows K_Hbeta."""
    factors = rating_of(analysis, rating).factors
    known = factors.face if analysis.cycle.kinematics.resolution.slices > 1 else jnp.ones_like(factors.face)
    return changed(_check(name, rating), load_factor=factors.flank / known)


def _local_scuffing(analysis: Analysis, rating: Rating) -> Any:
    oil = _loaded("local_scuffing_safety", analysis, rating)
    return scuffing_safety(analysis.cycle, changed(oil, scuffing_temperature=scuffing_temperature(oil)))


def _local_micropitting(analysis: Analysis, rating: Rating) -> Any:
    oil = _loaded("local_micropitting_safety", analysis, rating)
    permitted = permissible_film_thickness(oil, jnp.stack([material_factor(gear) for gear in rating.gears]))
    return micropitting_safety(analysis.cycle, changed(oil, permissible_film=permitted))


def _one(name: str, number: Callable[[ThermalRating], Any], label: str, unit: str = "", **options: Any) -> Quantity:
    given: dict[str, Any] = {"form": ".2f", **options}
    return Quantity(name, partial(_of, name, number), unit, label, label=label, takes=Rating, **given)


_SAFETY: dict[str, Any] = {"better": "larger"}

THERMAL_QUANTITIES = Vocabulary(
    (
        _one("rated_scuffing_safety", lambda of: of.flash.safety, "scuffing safety S_B, ISO/TS 6336-20", **_SAFETY),
        _one("rated_scuffing_temperature", lambda of: of.flash.scuffing_temperature, "scuffing temperature", "degC"),
        _one(
            "rated_contact_temperature",
            lambda of: of.flash.contact_temperature,
            "largest contact temperature, ISO/TS 6336-20",
            "degC",
        ),
        _one(
            "integral_scuffing_safety",
            lambda of: of.integral.safety,
            "scuffing safety S_intS, ISO/TS 6336-21",
            **_SAFETY,
        ),
        _one(
            "integral_temperature",
            lambda of: of.integral.integral_temperature,
            "integral temperature theta_int",
            "degC",
        ),
        _one(
            "rated_micropitting_safety",
            lambda of: of.micropitting.safety,
            "micropitting safety S_lambda, method B of ISO/TS 6336-22",
            **_SAFETY,
        ),
        _one(
            "rated_specific_film_thickness",
            lambda of: of.micropitting.min_specific_film_thickness,
            "smallest specific film thickness, method B",
            form=".3f",
            **_SAFETY,
        ),
        _one(
            "permissible_specific_film_thickness",
            lambda of: of.micropitting.permissible_film,
            "permissible specific film thickness lambda_GFP",
            form=".3f",
        ),
        _one("rated_loss_power", lambda of: of.loss_power, "mesh loss P_VZP by Schlenk and H_v", "W", form=".1f"),
        _one("rated_mesh_efficiency", lambda of: of.efficiency, "efficiency of the mesh by H_v", form=".5f", **_SAFETY),
        _one("no_load_loss_power", lambda of: of.no_load_loss_power, "estimated no-load loss by Mauz", "W", form=".1f"),
        _one(
            "churning_loss_power",
            lambda of: of.churning_loss_power,
            "estimated churning loss by Changenet and Velex",
            "W",
            form=".1f",
        ),
        Quantity(
            "local_scuffing_safety",
            _local_scuffing,
            "",
            "S_B of the contact analysis under the load factors of the rating",
            Min(),
            label="scuffing safety, contact analysis",
            form=".2f",
            takes=Rating,
            **_SAFETY,
        ),
        Quantity(
            "local_micropitting_safety",
            _local_micropitting,
            "",
            "S_lambda by the pressures and the film of the contact analysis under the load factors of the rating",
            Min(),
            label="micropitting safety, method A by the contact analysis",
            form=".2f",
            takes=Rating,
            **_SAFETY,
        ),
    )
)
