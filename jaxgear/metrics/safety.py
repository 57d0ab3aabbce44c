"""Safety factors, and damage by a load: what material and oil bear over what the mesh does to them.

Palmgren and Miner: every cycle at a stress takes 1 / N of a life, N = N_0 (sigma_0 / sigma)^p, and the shares add up.
So the mean over a load spectrum, whose weights are shares of the revolutions, is the damage sum, a life is 1e6 / damage
revolutions of the pinion, and the lives of two designs are as the inverse of their damage.

References:
    ISO 6336-6 (load spectra); ISO 6336-2 and -3 for the nominal stresses.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import MeshCycle
from ..numerics import Checked, number, over_batch
from .lubricant import Lubricant
from .lubrication import contact_temperature, specific_film_thickness
from .quantity import Quantity
from .settings import with_settings
from .stress import nominal_contact_stress, nominal_root_stress, root_stress

Real = Float[Array, "..."]
Scalar = Float[Array, ""]
Load = Float[Array, "pairs slices positions"]

# A stress that is not there is borne as often as one likes, which is no failure, as numbers that are not finite are.
LARGEST_SAFETY = 1000.0


class Strength(Checked):
    """Permissible stresses of both gears; factors of life, surface and size are included.

    Attributes:
        pitting: nominal contact stress that the pinion bears, and the wheel where it has none of its own: sigma_HG
            of ISO 6336-2.
        wheel_pitting: the same of the wheel; None for that of the pinion.
        bending: nominal stress in the tooth root that the pinion bears, with its notch, and the wheel where it has
            none of its own: sigma_FG of ISO 6336-3.
        wheel_bending: the same of the wheel; None for that of the pinion.
        pressure: permissible pressure of the contact analysis, tip edges included.
        pitting_exponent: p of the Woehler line N = `pitting_cycles` (pitting / stress)^p of both gears, for damage.
        pitting_cycles: that `pitting` is borne for.
        bending_exponent: of the Woehler line of the tooth roots, likewise.
        bending_cycles: that `bending` is borne for.
    """

    table = "strength"

    pitting: Scalar | None = number("MPa", low=0.0, open_low=True, optional=True, default=None)
    wheel_pitting: Scalar | None = number("MPa", low=0.0, open_low=True, optional=True, default=None)
    bending: Scalar | None = number("MPa", low=0.0, open_low=True, optional=True, default=None)
    wheel_bending: Scalar | None = number("MPa", low=0.0, open_low=True, optional=True, default=None)
    pressure: Scalar | None = number("MPa", low=0.0, open_low=True, optional=True, default=None)
    pitting_exponent: Scalar | None = number("", low=1.0, high=100.0, optional=True, default=None)
    pitting_cycles: Scalar | None = number("", low=0.0, open_low=True, optional=True, default=None)
    bending_exponent: Scalar | None = number("", low=1.0, high=100.0, optional=True, default=None)
    bending_cycles: Scalar | None = number("", low=0.0, open_low=True, optional=True, default=None)

    def check_together(self) -> None:
        for name in ("pitting", "bending"):
            exponent, cycles = f"{name}_exponent", f"{name}_cycles"
            pairs = (f"wheel_{name}", name), (exponent, name), (exponent, cycles), (cycles, exponent)
            for given, needed in pairs:
                if getattr(self, given) is not None and getattr(self, needed) is None:
                    raise ValueError(f"Strength: {needed} must be given where {given} is")

    def quantity(self, name: str) -> Quantity:
        """A safety factor or damage for objectives, constraints, sweeps and tables, with these strengths.

        Args:
            name: "pinion_pitting_safety", "wheel_pitting_safety" (need `pitting`), "pinion_root_safety",
                "wheel_root_safety", "pinion_local_root_safety", "wheel_local_root_safety" (need `bending`),
                "pressure_safety" (needs `pressure`), "pinion_pitting_damage", "wheel_pitting_damage" (need
                `pitting_exponent`), "pinion_root_damage" or "wheel_root_damage" (need `bending_exponent`).

        Raises:
            ValueError: for another name, and for a strength that is missing.
        """
        return with_settings(name, self)


def safety_factor(borne: Real, reached: Real) -> Real:
    """What is borne over what is reached, at most 1000."""
    return borne / jnp.maximum(reached, borne / LARGEST_SAFETY)


@over_batch
def pitting_safety(cycle: MeshCycle, strength: Strength) -> tuple[Scalar, Scalar]:
    """S_H of pinion and wheel: pitting strength over the nominal contact stress."""
    stress = nominal_contact_stress(cycle)
    limits = strengths_of("pitting_safety", strength, "pitting")
    return safety_factor(limits[0], stress.pinion), safety_factor(limits[1], stress.wheel)


@over_batch
def root_safety(cycle: MeshCycle, strength: Strength) -> tuple[Scalar, Scalar]:
    """S_F of pinion and wheel after ISO 6336-3: bending strength over the nominal root stress."""
    stress = nominal_root_stress(cycle)
    limits = strengths_of("root_safety", strength, "bending")
    return safety_factor(limits[0], stress.pinion), safety_factor(limits[1], stress.wheel)


@over_batch
def local_root_safety(cycle: MeshCycle, strength: Strength) -> tuple[Load, Load]:
    """Bending strength over the local root stress of pinion and wheel at every contact.

    Larger than the standard's S_F where a pair that touches early or late shares the load.
    """
    stress = root_stress(cycle)
    limits = strengths_of("local_root_safety", strength, "bending")
    return safety_factor(limits[0], stress.pinion), safety_factor(limits[1], stress.wheel)


@over_batch
def pressure_safety(cycle: MeshCycle, strength: Strength) -> Load:
    """p_lim / p at every contact, on the flanks and at the tip edges."""
    limit = given_strength("pressure_safety", strength, "pressure")
    return safety_factor(limit, cycle.contact_pressure + cycle.corner_pressure)


@over_batch
def micropitting_safety(cycle: MeshCycle, lubricant: Lubricant) -> Load:
    """S_lambda at every contact: specific film thickness h / Ra over the permissible one (ISO/TS 6336-22).

    Raises:
        ValueError: for a lubricant without `permissible_film`.
    """
    limit = given_strength("micropitting_safety", lubricant, "permissible_film")
    return safety_factor(specific_film_thickness(cycle, lubricant), limit)


@over_batch
def scuffing_safety(cycle: MeshCycle, lubricant: Lubricant) -> Load:
    """S_B at every contact: rise from the oil to the temperature of scuffing over that to the contact temperature.

        S_B = (T_S - T_oil) / (T_B - T_oil)

    Raises:
        ValueError: for a lubricant without `scuffing_temperature`.

    References:
        ISO/TS 6336-20 (ISO/TR 13989-1), flash temperature method.
    """
    limit = given_strength("scuffing_safety", lubricant, "scuffing_temperature")
    oil = lubricant.temperature
    return safety_factor(limit - oil, contact_temperature(cycle, lubricant) - oil)


def strengths_of(owner: str, strength: Strength, name: str) -> tuple[Scalar, Scalar]:
    """That of pinion and wheel; raises a `ValueError` where there is none."""
    pinion, wheel = given_strength(owner, strength, name), getattr(strength, f"wheel_{name}")
    return pinion, pinion if wheel is None else wheel


def given_strength(owner: str, settings: Checked, name: str) -> Scalar:
    """A number of settings; raises a `ValueError` where it is not given."""
    value = getattr(settings, name)
    if value is None:
        raise ValueError(f"{owner}: needs {type(settings).__name__}.{name}")
    return value


REVOLUTIONS = 1e6  # of the pinion, by which numbers are near 1


@over_batch
def pitting_damage(cycle: MeshCycle, strength: Strength) -> tuple[Scalar, Scalar]:
    """Damage of pinion and wheel by the nominal contact stress, per million revolutions of the pinion.

    Raises:
        ValueError: for a strength without `pitting` or without its Woehler line.
    """
    stress = nominal_contact_stress(cycle)
    return _damage(cycle, "pitting", strength, stress.pinion, stress.wheel)


@over_batch
def root_damage(cycle: MeshCycle, strength: Strength) -> tuple[Scalar, Scalar]:
    """Damage of the tooth roots of pinion and wheel by the nominal root stress, per million revolutions of the pinion.

    Raises:
        ValueError: for a strength without `bending` or without its Woehler line.
    """
    stress = nominal_root_stress(cycle)
    return _damage(cycle, "bending", strength, stress.pinion, stress.wheel)


def _damage(cycle: MeshCycle, name: str, strength: Strength, pinion, wheel):
    """Of both gears by their stresses."""
    owner = f"{name} damage"
    exponent, cycles = (given_strength(owner, strength, f"{name}_{part}") for part in ("exponent", "cycles"))
    limits = strengths_of(owner, strength, name)
    of_pinion, of_wheel = (
        REVOLUTIONS / cycles * (stress / limit) ** exponent for stress, limit in zip((pinion, wheel), limits)
    )
    return of_pinion, of_wheel / cycle.kinematics.pair.gear_ratio
