"""The quantities of this package that need a lubricant or strengths, or know more with them.

A name alone does not say which: `Lubricant.quantity` and `Strength.quantity` give the quantities, and a design file has
the tables [lubricant] and [strength].
"""

from collections.abc import Iterator
from functools import partial
from typing import Any

from jaxtyping import Array, Float

from ..contact import MeshCycle
from ..numerics.reductions import Max, Min
from .lubrication import (
    bulk_temperature,
    contact_temperature,
    film_thickness,
    flash_temperature,
    friction_coefficient,
    loss_power,
    lubricated_flash_temperature,
    mesh_efficiency,
    specific_film_thickness,
)
from .quantity import Quantity
from .safety import (
    local_root_safety,
    micropitting_safety,
    pitting_damage,
    pitting_safety,
    pressure_safety,
    root_damage,
    root_safety,
    scuffing_safety,
)
from .settings import WithoutSettings

Load = Float[Array, "pairs slices positions"]


def _flash(cycle: MeshCycle) -> Load:
    operating_point = cycle.operating_point
    if operating_point.speed is None:
        raise ValueError("max_flash_temperature: needs a speed, solve with OperatingPoint(torque, speed)")
    options = {} if operating_point.friction is None else {"friction": operating_point.friction}
    return flash_temperature(cycle, operating_point.speed, **options)


def _oiled(name: str, of: Any, unit: str, meaning: str, needs: str | None = None, **options: Any) -> Quantity:
    alone = {key: options.pop(key) for key in ("otherwise", "operating_point") if key in options}
    stands = WithoutSettings(name, "jaxgear.metrics.Lubricant", "lubricant", of, needs, **alone)
    return Quantity(name, stands, unit, meaning, **options)


def _borne(name: str, of: Any, meaning: str, needs: str, **options: Any) -> Quantity:
    stands = WithoutSettings(name, "jaxgear.metrics.Strength", "strength", of, needs)
    return Quantity(name, stands, meaning=meaning, **{"better": "larger", **options})


def _of_gears(kind: str, of: Any, meaning: str, needs: str, **options: Any) -> Iterator[Quantity]:
    """A quantity of pinion and wheel, which `of` gives together."""
    for number, gear in enumerate(("pinion", "wheel")):
        labelled = options | {"label": f"{gear} {options['label']}"}
        yield _borne(f"{gear}_{kind}", partial(_one, of, number), f"{meaning}, {gear}", needs, **labelled)


def _one(of: Any, number: int, cycle: MeshCycle, strength: Any) -> Any:
    return of(cycle, strength)[number]


_LEAST: dict[str, Any] = {"reduction": Min(), "better": "larger"}

LUBRICATED = (
    _oiled(
        "max_flash_temperature",
        lubricated_flash_temperature,
        "K",
        "largest rise of the flank temperature",
        reduction=Max(),
        local=True,
        otherwise=_flash,
        operating_point=("speed",),
        form=".1f",
    ),
    _oiled(
        "friction_coefficient",
        friction_coefficient,
        "",
        "mean coefficient of friction",
        label="mean coefficient of friction",
        form=".4f",
    ),
    _oiled(
        "loss_power",
        loss_power,
        "W",
        "power that friction of the flanks takes",
        otherwise=loss_power,
        operating_point=("speed", "friction"),
        label="power loss of the flanks",
    ),
    _oiled(
        "mesh_efficiency",
        mesh_efficiency,
        "",
        "share of the power that the flanks pass on",
        better="larger",
        otherwise=mesh_efficiency,
        operating_point=("friction",),
        label="efficiency of the mesh",
        form=".5f",
    ),
    _oiled("bulk_temperature", bulk_temperature, "degC", "of the teeth between two contacts", form=".1f"),
    _oiled(
        "max_contact_temperature",
        contact_temperature,
        "degC",
        "largest temperature in the contact",
        reduction=Max(),
        form=".1f",
    ),
    _oiled(
        "min_film_thickness",
        film_thickness,
        "um",
        "smallest thickness of the oil film, at most 1000",
        form=".3f",
        **_LEAST,
    ),
    _oiled(
        "min_specific_film_thickness",
        specific_film_thickness,
        "",
        "lambda, smallest thickness of the oil film over roughness",
        form=".3f",
        **_LEAST,
    ),
    _oiled(
        "micropitting_safety",
        micropitting_safety,
        "",
        "S_lambda, specific over permissible film thickness",
        "permissible_film",
        label="micropitting safety S_lambda",
        form=".2f",
        **_LEAST,
    ),
    _oiled(
        "scuffing_safety",
        scuffing_safety,
        "",
        "S_B, rise to the scuffing temperature over that to the contact temperature",
        "scuffing_temperature",
        label="scuffing safety S_B",
        form=".2f",
        **_LEAST,
    ),
)
RATED = (
    *_of_gears(
        "pitting_safety",
        pitting_safety,
        "S_H, pitting strength over nominal contact stress",
        "pitting",
        label="pitting safety S_H",
        form=".2f",
    ),
    *_of_gears(
        "root_safety",
        root_safety,
        "S_F, bending strength over root stress after ISO 6336-3",
        "bending",
        label="root safety S_F",
        form=".2f",
    ),
    *_of_gears(
        "local_root_safety",
        local_root_safety,
        "bending strength over the largest root stress of the contact analysis",
        "bending",
        **_LEAST,
        local=True,
        label="root safety, contact analysis",
        form=".2f",
    ),
    _borne(
        "pressure_safety",
        pressure_safety,
        "pressure that is borne over the largest of flanks and tip edges",
        "pressure",
        reduction=Min(),
        local=True,
        label="pressure safety p_lim / p_max",
        form=".2f",
    ),
    *_of_gears(
        "pitting_damage",
        pitting_damage,
        "share of the life that pitting takes in 1e6 revolutions of the pinion",
        "pitting_exponent",
        better="smaller",
        label="pitting damage per 1e6 revolutions",
        form=".3g",
    ),
    *_of_gears(
        "root_damage",
        root_damage,
        "share of the life that bending takes in 1e6 revolutions of the pinion",
        "bending_exponent",
        better="smaller",
        label="root damage per 1e6 revolutions",
        form=".3g",
    ),
)
LUBRICANT_QUANTITIES = tuple(quantity.name for quantity in LUBRICATED)
STRENGTH_QUANTITIES = tuple(quantity.name for quantity in RATED)
