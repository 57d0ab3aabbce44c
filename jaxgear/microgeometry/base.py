"""Interface of flank modifications, and their composition with `+`, `-` and factors."""

from abc import abstractmethod

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..numerics import Checked, Given, Usual, concrete, number, real, result

AMOUNTS = Usual(0.1, np.inf, "um", "less than flanks can be measured to: is it in mm?")  # of every modification
# mm, of reliefs along profile and face: ISO 1328-1 ends at modules of 70 mm, whose active profile is some 350 mm long,
# and at face widths of 1200 mm
LONGEST = 1000.0


class Flank(Checked):
    """Points on one gear's flank at which a modification is evaluated. The fields broadcast against each other.

    Attributes:
        roll_length: radius of curvature of the involute at the point.
        tip_roll_length: roll length at the tip.
        start_roll_length: roll length at the start of the active profile.
        base_radius: base radius of the gear.
        face_coordinate: position along the face of the gear, from its middle.
        face_width: face width of the gear, which may be wider than its mate.
    """

    roll_length: Float[Array, "..."] = result("mm")
    tip_roll_length: Float[Array, "..."] = result("mm")
    start_roll_length: Float[Array, "..."] = result("mm")
    base_radius: Float[Array, "..."] = result("mm")
    face_coordinate: Float[Array, "..."] = result("mm")
    face_width: Float[Array, "..."] = result("mm")


class AbstractModification(Checked):
    """Material removed from a flank. Modifications add up with `+` and `sum`; a number scales them.

    Raises:
        TypeError: if the other term of a sum is not a modification, or the factor is not a number.
    """

    __array_ufunc__ = None  # NumPy's numbers leave the product to `__rmul__`

    @abstractmethod
    def __call__(self, flank: Flank) -> Float[Array, "..."]:
        """Material removed normal to the flank [um], in the broadcast shape of the flank's points."""

    @property
    @abstractmethod
    def varies_along_face(self) -> bool:
        """True if the modification varies along the face, which a mesh of one slice cannot represent."""

    def __add__(self, other: "AbstractModification") -> "Sum":
        if not isinstance(other, AbstractModification):
            given = f"{self!r} + {other!r}"
            raise TypeError(f"{given}: only another modification can be added to a modification")
        return Sum((*terms(self), *terms(other)))

    def __radd__(self, other: object) -> "AbstractModification":
        if isinstance(other, int) and other == 0:  # where `sum` starts
            return self
        raise TypeError(f"{other!r} + {self!r}: only another modification can be added to a modification")

    def __mul__(self, factor: Given) -> "Scaled":
        if not isinstance(factor, int | float | np.ndarray | np.generic | jax.Array):
            raise TypeError(f"{factor!r} * {self!r}: only a number can scale a modification")
        return Scaled(real(factor), self)

    __rmul__ = __mul__

    def __neg__(self) -> "Scaled":
        return Scaled(real(-1.0), self)

    def __sub__(self, other: "AbstractModification") -> "Sum":
        return self + (-other if isinstance(other, AbstractModification) else other)


class Sum(AbstractModification):
    """Sum of several modifications on one flank, the result of `+`."""

    terms: tuple[AbstractModification, ...]

    def __call__(self, flank: Flank) -> Float[Array, "..."]:
        total = self.terms[0](flank)
        for term in self.terms[1:]:
            total = total + term(flank)
        return total

    @property
    def varies_along_face(self) -> bool:
        return any(term.varies_along_face for term in self.terms)

    def __repr__(self) -> str:
        return " + ".join(map(repr, self.terms))


class Scaled(AbstractModification):
    """Modification times a number, the result of `*`."""

    factor: Float[Array, ""] = number("")
    modification: AbstractModification

    def __call__(self, flank: Flank) -> Float[Array, "..."]:
        removed = self.modification(flank)
        return self.factor.astype(removed.dtype) * removed

    @property
    def varies_along_face(self) -> bool:
        return acts(self.factor) and self.modification.varies_along_face


class NoModification(AbstractModification):
    """Nominal involute, without material removed."""

    varies_along_face = False

    def __call__(self, flank: Flank) -> Float[Array, "..."]:
        return jnp.zeros_like(flank.roll_length)


def acts(amount: Float[Array, "..."]) -> bool:
    """True if an amount is traced or not zero everywhere."""
    known = concrete(amount)
    return known is None or bool(known.any())


def terms(modification: AbstractModification) -> tuple[AbstractModification, ...]:
    """The modifications of a sum, or the modification alone."""
    return modification.terms if isinstance(modification, Sum) else (modification,)
