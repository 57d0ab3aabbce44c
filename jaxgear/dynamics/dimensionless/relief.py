"""The modification of a mesh as one displacement over the mesh cycle."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...microgeometry import AbstractCurve, Linear
from ...numerics import Checked, check, concrete, number, real

Scalar = Float[Array, ""]


class CycleRelief(Checked):
    """Tip relief of both gears as what it takes off the approach of the whole mesh, C(phase).

    One pair at the distance t from the begin of its path of contact has lost `amount * curve(delta)`, with delta = s /
    length from 0 where the relief starts to 1 at the tip, on either end of the path. Of two pairs in contact, equally
    stiff, the mesh feels the mean: k (q - C_1) + k (q - C_2) = 2 k (q - (C_1 + C_2) / 2). That is what a single C(t)
    can represent, and it holds while both pairs touch; the mesh force of a contact analysis shares the load as it is.

    Attributes:
        amount: C_max at the tip [half clearances].
        length: lambda, on the line of action [base pitches], at most half of the contact ratio; contact ratio - 1
            reaches from the tip to the highest point of single contact.
        contact_ratio: from 1 to 2.
        curve: C / C_max over delta: `Power`, `Quadratic`, `Polynomial`, `Sinusoidal` or any other.
        begin: mesh position where the second pair comes into contact [base pitches].
    """

    amount: Scalar = number("half clearances")
    length: Scalar = number("base pitches", low=0.0, open_low=True)
    contact_ratio: Scalar = number("", low=1.0, high=2.0)
    curve: AbstractCurve = eqx.field(default_factory=Linear)
    begin: Scalar = number("base pitches", default=0.0)

    def __call__(self, phase: Scalar) -> Scalar:
        """C [half clearances] at a mesh position [base pitches]."""
        turned = phase - self.begin
        first = turned - jnp.floor(turned)
        two = first < self.contact_ratio - 1
        one_alone, behind = self.of_pair(first), self.of_pair(first + 1)
        return jnp.where(two, 0.5 * (one_alone + behind), one_alone)

    def of_pair(self, travel: Scalar) -> Scalar:
        """What one pair has lost [half clearances], `travel` base pitches after the begin of its contact."""
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
            check("CycleRelief", "length", self.length, "base pitches", high=0.5 * ratio)

    @property
    def ends(self) -> Float[Array, " two"]:
        """Mesh positions where the number of pairs changes [base pitches], in [0, 1)."""
        ends = jnp.stack([self.begin, self.begin + self.contact_ratio - 1])
        return ends - jnp.floor(ends)


def largest_relief(load, torque_fluctuation, displacement, least_stiffness) -> Scalar:
    """C_max = (F_m + F_ah + F_aT) / K_min [half clearances], as the study of dynamic modification prints it.

    It adds amplitudes of different kinds: F_m and F_aT are forces over b k_mean, but F_ah is a displacement over b,
    whose force is F_ah Omega^2. In newtons over a stiffness in N/um the rule is sound: `sizing.dynamic_relief`.

    Args:
        load, torque_fluctuation, displacement: F_m, F_aT, F_ah.
        least_stiffness: smallest stiffness over its mean, 1 + sum B_j cos(...) at its least.
    """
    check("largest_relief", "least_stiffness", least_stiffness, "", low=0.0, open_low=True)
    return (real(load) + real(displacement) + real(torque_fluctuation)) / real(least_stiffness)
