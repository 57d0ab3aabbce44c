"""Nonlinear springs of a contact problem."""

from abc import abstractmethod

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

Real = Float[Array, "..."]

# Springs are linear below this load (of a contact: 0.01 N/mm), where those of elastic contacts have no finite slope.
LOAD_FLOOR = 1e-2


class AbstractSpring(eqx.Module):
    """A deflection that increases with the load, elementwise; every leaf has shape (pairs, 1, positions)."""

    @abstractmethod
    def secant(self, load: Real) -> Real:
        """Deflection per load, at positive loads."""

    def slope(self, load: Real, secant: Real) -> Real:
        """Derivative of the deflection with respect to the load, given the `secant` at this load."""
        return secant + load * jax.jvp(self.secant, (load,), (jnp.ones_like(load),))[1]

    def deflection(self, load: Real) -> Real:
        """Deflection at any load that is not negative; zero at zero."""
        return load * self.secant(jnp.maximum(load, LOAD_FLOOR))

    def moved(self, distance: Real) -> "AbstractSpring":
        """The spring of a contact that has moved by a distance; of most springs the same."""
        return self
