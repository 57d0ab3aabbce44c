"""Safety factors, permissible over occurring stress, temperature or film, and damage by a load.

Palmgren and Miner: every cycle at a stress adds 1 / N of its `SNLine` to the damage sum. The mean over a load spectrum,
whose weights are shares of the revolutions, is the damage sum of 1e6 revolutions of the pinion; the life is 1e6 over
that.

References:
    ISO 6336-6 (load spectra); ISO 6336-2 and -3 for the nominal stresses.
"""

from typing import Any, Literal

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import MeshCycle
from ..numerics import Checked, number, over_batch
from .lubricant import Lubricant
from .lubrication import contact_temperature, specific_film_thickness
from .quantity import AbstractSettings
from .sn_line import SNLine
from .stress import nominal_contact_stress, nominal_root_stress, root_stress

Real = Float[Array, "..."]
Mode = Literal["pitting", "bending"]
Scalar = Float[Array, ""]
Load = Float[Array, "pairs slices positions"]

# The safety without any stress: a finite number, since numbers that are not finite count as failures.
LARGEST_SAFETY = 1000.0


class Strength(AbstractSettings):
    """Permissible stresses and S-N curves of both gears; factors of life, surface and size are included.

    `quantity` gives with them the safety factors and damages, `metrics.STRENGTH_QUANTITIES`, each where its strength is
    given.

    Attributes:
        pitting: permissible nominal contact stress of the pinion, and of the wheel where it has none of its own:
            sigma_HG of ISO 6336-2.
        wheel_pitting: the same of the wheel; None for that of the pinion.
        bending: permissible nominal tooth root stress of the pinion, notch included, and of the wheel where it has none
            of its own: sigma_FG of ISO 6336-3.
        wheel_bending: the same of the wheel; None for that of the pinion.
        pressure: permissible pressure of the contact analysis, tip edges included.
        pitting_exponent: p of the S-N curve N = `pitting_cycles` (pitting / stress)^p of the pinion, and of the wheel
            where it has none of its own, for damage; without an endurance limit.
        pitting_cycles: load cycles for which `pitting` is permissible, likewise.
        bending_exponent: bending exponent of the S-N curve of the tooth roots, likewise.
        bending_cycles: load cycles for which `bending` is permissible, likewise.
        wheel_pitting_exponent, wheel_pitting_cycles: those of the wheel; None for those of the pinion.
        wheel_bending_exponent, wheel_bending_cycles: those of the wheel; None for those of the pinion.
        load_factor: product of the load factors, K_A K_gamma K_v K_Halpha as far as the contact analysis does not know
            them, by which safeties and damages take the load: stresses of the root times the factor, pressures times
            its square root.
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
    wheel_pitting_exponent: Scalar | None = number("", low=1.0, high=100.0, optional=True, default=None)
    wheel_pitting_cycles: Scalar | None = number("", low=0.0, open_low=True, optional=True, default=None)
    wheel_bending_exponent: Scalar | None = number("", low=1.0, high=100.0, optional=True, default=None)
    wheel_bending_cycles: Scalar | None = number("", low=0.0, open_low=True, optional=True, default=None)
    load_factor: Scalar = number("", low=0.0, high=100.0, open_low=True, default=1.0)

    def check_together(self) -> None:
        for name in ("pitting", "bending"):
            exponent, cycles = f"{name}_exponent", f"{name}_cycles"
            pairs = [(exponent, name), (exponent, cycles), (cycles, exponent)]
            pairs += [(f"wheel_{each}", each) for each in (name, exponent, cycles)]
            for given, needed in pairs:
                if getattr(self, given) is not None and getattr(self, needed) is None:
                    raise ValueError(f"Strength: {needed} must be given where {given} is")


def safety_factor(borne: Real, reached: Real) -> Real:
    """Permissible over occurring stress, at most 1000."""
    return borne / jnp.maximum(reached, borne / LARGEST_SAFETY)


def _safety(strength: Strength, name: Mode, stress: Any) -> tuple[Real, Real]:
    pinion, wheel = _strengths_of(strength, name)
    factor = _stress_factor(strength, name)
    return safety_factor(pinion, factor * stress.pinion), safety_factor(wheel, factor * stress.wheel)


def _stress_factor(strength: Strength, name: Mode) -> Scalar:
    """Ratio of a stress with the load factor to that without: a pressure grows with the square root of the load."""
    return strength.load_factor if name == "bending" else jnp.sqrt(strength.load_factor)


@over_batch
def pitting_safety(cycle: MeshCycle, strength: Strength) -> tuple[Scalar, Scalar]:
    """S_H of pinion and wheel: pitting strength over the nominal contact stress."""
    return _safety(strength, "pitting", nominal_contact_stress(cycle))


@over_batch
def root_safety(cycle: MeshCycle, strength: Strength) -> tuple[Scalar, Scalar]:
    """S_F of pinion and wheel after ISO 6336-3: bending strength over the nominal root stress."""
    return _safety(strength, "bending", nominal_root_stress(cycle))


@over_batch
def local_root_safety(cycle: MeshCycle, strength: Strength) -> tuple[Load, Load]:
    """Bending strength over the local root stress of pinion and wheel at every contact.

    Larger than the standard's S_F where a pair that touches early or late shares the load.
    """
    return _safety(strength, "bending", root_stress(cycle))


@over_batch
def pressure_safety(cycle: MeshCycle, strength: Strength) -> Load:
    """p_lim / p at every contact, on the flanks and at the tip edges."""
    limit = _given_strength(strength, "pressure")
    return safety_factor(limit, jnp.sqrt(strength.load_factor) * (cycle.contact_pressure + cycle.corner_pressure))


@over_batch
def micropitting_safety(cycle: MeshCycle, lubricant: Lubricant) -> Load:
    """S_lambda at every contact: specific film thickness h / Ra over the permissible one (ISO/TS 6336-22).

    Raises:
        ValueError: for a lubricant without `permissible_film`.
    """
    limit = _given_strength(lubricant, "permissible_film")
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
    limit = _given_strength(lubricant, "scuffing_temperature")
    oil = lubricant.temperature
    return safety_factor(limit - oil, contact_temperature(cycle, lubricant) - oil)


def _strengths_of(strength: Strength, name: str) -> tuple[Scalar, Scalar]:
    """Strength `name` of pinion and wheel, the wheel's by default the pinion's; raises a `ValueError` without any."""
    pinion, wheel = _given_strength(strength, name), getattr(strength, f"wheel_{name}")
    return pinion, pinion if wheel is None else wheel


def _given_strength(settings: Checked, name: str) -> Scalar:
    """Strength of the settings; raises a `ValueError` if it is missing."""
    value = getattr(settings, name)
    if value is None:
        raise ValueError(f"needs {type(settings).__name__}.{name}")
    return value


REVOLUTIONS = 1e6  # of the pinion, by which numbers are near 1


@over_batch
def pitting_damage(cycle: MeshCycle, strength: Strength) -> tuple[Scalar, Scalar]:
    """Damage of pinion and wheel by the nominal contact stress, per million revolutions of the pinion.

    Raises:
        ValueError: for a strength without `pitting` or without its S-N curve.
    """
    return _damage(cycle, "pitting", strength, nominal_contact_stress(cycle))


@over_batch
def root_damage(cycle: MeshCycle, strength: Strength) -> tuple[Scalar, Scalar]:
    """Damage of the tooth roots of pinion and wheel by the nominal root stress, per million revolutions of the pinion.

    Raises:
        ValueError: for a strength without `bending` or without its S-N curve.
    """
    return _damage(cycle, "bending", strength, nominal_root_stress(cycle))


def _damage(cycle: MeshCycle, name: Mode, strength: Strength, stress: Any) -> tuple[Scalar, Scalar]:
    pinion, wheel = damage_per_cycle(strength, name, (stress.pinion, stress.wheel))
    return REVOLUTIONS * pinion, REVOLUTIONS * wheel / cycle.kinematics.pair.gear_ratio


def damage_per_cycle(strength: Strength, name: Mode, stresses: tuple[Real, Real]) -> tuple[Real, Real]:
    """Damage of pinion and wheel by one load cycle of each, 1 / N of their S-N curves.

    Args:
        strength: strengths with the S-N curve.
        name: "pitting" or "bending".
        stresses: nominal stress of pinion and wheel [MPa].

    Raises:
        ValueError: for a strength without that S-N curve.
    """
    factor = _stress_factor(strength, name)
    pinion, wheel = (line.damage(factor * stress, 1.0) for line, stress in zip(sn_lines(strength, name), stresses))
    return pinion, wheel


def sn_lines(strength: Strength, name: Mode) -> tuple[SNLine, SNLine]:
    """S-N lines of pinion and wheel, power laws without an endurance limit.

    Raises:
        ValueError: for a strength without that S-N curve.
    """
    curves = zip(*(_strengths_of(strength, each) for each in (name, f"{name}_exponent", f"{name}_cycles")))
    pinion, wheel = (SNLine.power_law(limit, cycles, exponent) for limit, exponent, cycles in curves)
    return pinion, wheel
