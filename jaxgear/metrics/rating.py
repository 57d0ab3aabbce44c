"""The quantities of this package that need a lubricant or strengths, or know more with them.

A name alone does not say which: `Lubricant.quantity` and `Strength.quantity` give the quantities, and a design file has
the tables [lubricant] and [strength].
"""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from jaxtyping import Array, Float

from ..contact import MeshCycle
from ..numerics.reductions import Max, Min
from .lubricant import Lubricant
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
from .quantity import Analysis, Quantity
from .safety import (
    Strength,
    local_root_safety,
    micropitting_safety,
    pitting_damage,
    pitting_safety,
    pressure_safety,
    root_damage,
    root_safety,
    scuffing_safety,
)

Load = Float[Array, "pairs slices positions"]


def _of_cycle(of: Callable[[MeshCycle, Any], Any], analysis: Analysis, settings: Any) -> Any:
    return of(analysis.cycle, settings)


def _one(of: Callable[[MeshCycle, Any], Any], gear: int, analysis: Analysis, settings: Any) -> Any:
    return of(analysis.cycle, settings)[gear]


def _flash(analysis: Analysis, lubricant: Lubricant | None) -> Load:
    if lubricant is not None:
        return lubricated_flash_temperature(analysis.cycle, lubricant)
    speed, friction = analysis.operating_point.speed, analysis.operating_point.friction
    if speed is None:
        raise ValueError("needs a speed, solve with OperatingPoint(torque, speed)")
    return flash_temperature(analysis.cycle, speed, **({} if friction is None else {"friction": friction}))


def _oiled(name: str, of: Any, unit: str, meaning: str, **options: Any) -> Quantity:
    return Quantity(name, partial(_of_cycle, of), unit, meaning, takes=Lubricant, **options)


def _rated(name: str, of: Any, meaning: str, **options: Any) -> Quantity:
    return Quantity(name, of, meaning=meaning, takes=Strength, **{"better": "larger", **options})


def _of_gears(name: str, of: Any, meaning: str, **options: Any) -> Iterator[Quantity]:
    """A quantity of pinion and wheel, which `of` gives together."""
    for number, gear in enumerate(("pinion", "wheel")):
        labelled = options | {"label": f"{gear} {options['label']}"}
        yield _rated(f"{gear}_{name}", partial(_one, of, number), f"{meaning}, {gear}", **labelled)


_LEAST: dict[str, Any] = {"reduction": Min(), "better": "larger"}

LUBRICATED = (
    Quantity(
        "max_flash_temperature",
        _flash,
        "K",
        "largest rise of the flank temperature",
        Max(),
        local=True,
        form=".1f",
        takes=Lubricant,
        without=("speed",),
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
        "power loss by friction of the flanks",
        without=("speed", "friction"),
        label="power loss of the flanks",
    ),
    _oiled(
        "mesh_efficiency",
        mesh_efficiency,
        "",
        "efficiency of the mesh: transmitted over input power",
        better="larger",
        without=("friction",),
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
        needs="permissible_film",
        label="micropitting safety S_lambda",
        form=".2f",
        **_LEAST,
    ),
    _oiled(
        "scuffing_safety",
        scuffing_safety,
        "",
        "S_B, rise to the scuffing temperature over that to the contact temperature",
        needs="scuffing_temperature",
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
        needs="pitting",
        label="pitting safety S_H",
        form=".2f",
    ),
    *_of_gears(
        "root_safety",
        root_safety,
        "S_F, bending strength over root stress after ISO 6336-3",
        needs="bending",
        label="root safety S_F",
        form=".2f",
    ),
    *_of_gears(
        "local_root_safety",
        local_root_safety,
        "bending strength over the largest root stress of the contact analysis",
        needs="bending",
        **_LEAST,
        local=True,
        label="root safety, contact analysis",
        form=".2f",
    ),
    _rated(
        "pressure_safety",
        partial(_of_cycle, pressure_safety),
        "permissible pressure over the largest of flanks and tip edges",
        needs="pressure",
        reduction=Min(),
        local=True,
        label="pressure safety p_lim / p_max",
        form=".2f",
    ),
    *_of_gears(
        "pitting_damage",
        pitting_damage,
        "damage sum of pitting in 1e6 revolutions of the pinion",
        needs="pitting_exponent",
        better="smaller",
        label="pitting damage per 1e6 revolutions",
        form=".3g",
    ),
    *_of_gears(
        "root_damage",
        root_damage,
        "damage sum of tooth root bending in 1e6 revolutions of the pinion",
        needs="bending_exponent",
        better="smaller",
        label="root damage per 1e6 revolutions",
        form=".3g",
    ),
)
LUBRICANT_QUANTITIES = tuple(quantity.name for quantity in LUBRICATED)
STRENGTH_QUANTITIES = tuple(quantity.name for quantity in RATED)
