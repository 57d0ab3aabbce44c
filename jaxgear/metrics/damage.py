"""Damage by a load: the share of a life that a million revolutions of the pinion take.

Palmgren and Miner: every cycle at a stress takes 1 / N of a life, N = N_0 (sigma_0 / sigma)^p, and the shares add up.
So the mean over a load spectrum, whose weights are shares of the revolutions, is the damage sum, a life is 1e6 / damage
revolutions of the pinion, and the lives of two designs are as the inverse of their damage.

References:
    ISO 6336-6 (load spectra); ISO 6336-2 and -3 for the nominal stresses.
"""

from jaxtyping import Array, Float

from ..contact import MeshCycle
from ..numerics import over_batch
from .contact_stress import nominal_contact_stress
from .root_stress import nominal_root_stress
from .safety import Strength, given_strength, strengths_of

Scalar = Float[Array, ""]

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
