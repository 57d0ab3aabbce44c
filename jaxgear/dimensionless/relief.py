"""Tip relief of a mesh as one displacement excitation over the mesh cycle."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import GearPair, path_of_contact
from ..microgeometry import AbstractCurve, Linear, TipRelief
from ..numerics import Checked, Given, check, concrete, number, real

Scalar = Float[Array, ""]

_SAME_RATIO = 1e-3  # by which two contact ratios may differ and still be those of one pair


class CycleRelief(Checked):
    """Tip relief of both gears as a displacement C(phase) that is subtracted from the DTE of the mesh.

    The modification of one pair is `amount * curve(delta)`, with delta from 0 at the start of the relief to 1 at the
    tip, at both ends of the path of contact. For two equally stiff pairs in contact C is the mean of both,
    k (q - C_1) + k (q - C_2) = 2 k (q - (C_1 + C_2) / 2), as long as both pairs touch. A contact analysis computes the
    load sharing instead.

    Attributes:
        amount: amount C_max at the tip [half clearances].
        length: length lambda on the line of action [base pitches], at most half of the contact ratio; a length of
            contact ratio - 1 reaches from the tip to the highest point of single contact.
        contact_ratio: contact ratio, from 1 to 2.
        curve: C / C_max over delta: `Power`, `Quadratic`, `Polynomial`, `Sinusoidal` or any other.
        begin: mesh position where the second pair comes into contact [base pitches].
    """

    amount: Scalar = number("half clearances")
    length: Scalar = number("base pitches", low=0.0, open_low=True)
    contact_ratio: Scalar = number("", low=1.0, high=2.0)
    curve: AbstractCurve = eqx.field(default_factory=Linear)
    begin: Scalar = number("base pitches", default=0.0)

    def __call__(self, phase: Scalar) -> Scalar:
        """Displacement C [half clearances] at a mesh position [base pitches]."""
        turned = phase - self.begin
        first = turned - jnp.floor(turned)
        two = first < self.contact_ratio - 1
        one_alone, behind = self.of_pair(first), self.of_pair(first + 1)
        return jnp.where(two, 0.5 * (one_alone + behind), one_alone)

    def of_pair(self, travel: Scalar) -> Scalar:
        """Modification of one pair [half clearances], `travel` base pitches after the begin of its contact."""
        length = self.length
        from_begin, to_end = (length - travel) / length, (travel - self.contact_ratio + length) / length
        lost = jnp.zeros_like(from_begin)
        for depth in (from_begin, to_end):
            inside = (depth > 0) & (depth <= 1 + 1e-9)
            lost = lost + jnp.where(inside, self.curve(jnp.where(inside, depth, 0.5)), 0.0)
        return self.amount * lost

    def check_together(self) -> None:
        ratio = concrete(self.contact_ratio)
        if ratio is not None:
            check("CycleRelief: length", self.length, "base pitches", high=0.5 * ratio)

    @property
    def ends(self) -> Float[Array, " two"]:
        """Mesh positions where the number of pairs changes [base pitches], in [0, 1)."""
        ends = jnp.stack([self.begin, self.begin + self.contact_ratio - 1])
        return ends - jnp.floor(ends)


def cycle_relief(relief: TipRelief, pair: GearPair, half_clearance: Given) -> CycleRelief:
    """Relief over the mesh cycle for the same tip relief on both gears.

    Args:
        relief: tip relief of either gear.
        pair: pinion and wheel, with a contact ratio from 1 to 2.
        half_clearance: b, half of the backlash on the line of action [um].

    Raises:
        ValueError: for a half clearance that is not positive, or a relief without length or longer than half of the
            path of contact.
    """
    check("half_clearance", half_clearance, "um", low=0.0, open_low=True)
    path = path_of_contact(pair)
    # at mesh position 0 a pair touches at the pitch point, and one later it is a base pitch further on
    begin = path.start / path.base_pitch
    return CycleRelief(
        relief.amount / real(half_clearance),
        relief.length / path.base_pitch,
        path.contact_ratio,
        relief.curve,
        begin - jnp.floor(begin),
    )


def tip_relief(relief: CycleRelief, pair: GearPair, half_clearance: Given) -> TipRelief:
    """Tip relief of either gear from a relief over the mesh cycle: the inverse of `cycle_relief`.

    The last step of a dynamic profile modification: the distance on the line of action is one of roll length, which
    over the base radius is a roll angle (`tolerance.profile_trace` tabulates the flank over either).

    Args:
        relief: relief over the mesh cycle, for instance from `dynamic_profile_modification`.
        pair: pinion and wheel.
        half_clearance: b, half of the backlash on the line of action [um].

    Raises:
        ValueError: for a half clearance that is not positive, or if the contact ratio of the relief differs from that
            of the pair.
    """
    check("half_clearance", half_clearance, "um", low=0.0, open_low=True)
    path = path_of_contact(pair)
    ratio, own = concrete(relief.contact_ratio), concrete(path.contact_ratio)
    if ratio is not None and own is not None and abs(ratio - own) > _SAME_RATIO:
        raise ValueError(f"contact_ratio = {ratio:.4g} of the relief must be that of the pair, {own:.4g}")
    return TipRelief(relief.amount * real(half_clearance), relief.length * path.base_pitch, relief.curve)


def largest_relief(load: Given, torque_fluctuation: Given, displacement: Given, least_stiffness: Given) -> Scalar:
    """Largest relief C_max = (F_m + F_ah + F_aT) / K_min [half clearances] by the paper on dynamic modification.

    The rule adds different quantities: F_m and F_aT are forces over b k_mean, but F_ah is a displacement over b, whose
    force is F_ah Omega^2. `sizing.dynamic_relief` has the consistent rule, with forces in N and a stiffness in N/um.

    Args:
        load, torque_fluctuation, displacement: F_m, F_aT, F_ah.
        least_stiffness: smallest stiffness over its mean, 1 + sum B_j cos(...) at its least.
    """
    check("least_stiffness", least_stiffness, "", low=0.0, open_low=True)
    return (real(load) + real(displacement) + real(torque_fluctuation)) / real(least_stiffness)
