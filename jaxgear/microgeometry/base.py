"""The interface of a flank modification and its composition with `+`."""

from abc import abstractmethod

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float


class Flank(eqx.Module):
    """Points on one gear's flank at which a modification is evaluated. The fields broadcast against each other.

    Attributes:
        roll_length: radius of curvature of the involute at the point [mm].
        tip_roll_length: roll length at the tip [mm].
        start_roll_length: roll length at the start of the active profile [mm].
        base_radius: base radius of the gear [mm].
        face_coordinate: position along the face, from its middle [mm].
        face_width: common face width of the pair [mm].
    """

    roll_length: Float[Array, "..."]
    tip_roll_length: Float[Array, "..."]
    start_roll_length: Float[Array, "..."]
    base_radius: Float[Array, "..."]
    face_coordinate: Float[Array, "..."]
    face_width: Float[Array, "..."]


class AbstractModification(eqx.Module):
    """Material removed from a flank; modifications add up with `+`."""

    @abstractmethod
    def __call__(self, flank: Flank) -> Float[Array, "..."]:
        """Material removed normal to the flank [um], in the broadcast shape of the flank's points."""

    def __add__(self, other: "AbstractModification") -> "Sum":
        if not isinstance(other, AbstractModification):
            return NotImplemented
        return Sum((*terms(self), *terms(other)))


class Sum(AbstractModification):
    """Several modifications on one flank, the result of `+`."""

    terms: tuple[AbstractModification, ...]

    def __call__(self, flank: Flank) -> Float[Array, "..."]:
        total = self.terms[0](flank)
        for term in self.terms[1:]:
            total = total + term(flank)
        return total


class NoModification(AbstractModification):
    """The nominal involute."""

    def __call__(self, flank: Flank) -> Float[Array, "..."]:
        return jnp.zeros_like(flank.roll_length)


def terms(modification: AbstractModification) -> tuple[AbstractModification, ...]:
    """The modifications of a sum, or the modification alone."""
    return modification.terms if isinstance(modification, Sum) else (modification,)
