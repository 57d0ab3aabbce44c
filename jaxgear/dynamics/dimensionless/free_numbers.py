"""The numbers of a relief that are free in dynamic modification, and their bounds."""

import operator
from collections.abc import Mapping, Sequence
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...microgeometry import Polynomial, Power, Quadratic
from ...numerics import concrete, real
from .model import DimensionlessModel
from .relief import CycleRelief

Free = Literal["amount", "length", "curve"]


def vector(relief: CycleRelief, free: Sequence[str]) -> Float[Array, " numbers"]:
    """The free numbers of a relief."""
    parts = [jnp.ravel(leaf) for name in free for leaf in jax.tree.leaves(getattr(relief, name))]
    if not parts:
        raise ValueError(f"dynamic_profile_modification: {type(relief.curve).__name__} has no coefficients to optimize")
    return jnp.concatenate(parts)


def made(relief: CycleRelief, free: Sequence[str], vector: Float[Array, " numbers"]) -> CycleRelief:
    """The relief with other free numbers."""
    for name in free:
        leaves, tree = jax.tree.flatten(getattr(relief, name))
        new = []
        for leaf in leaves:
            part, vector = vector[: leaf.size], vector[leaf.size :]
            new.append(part.reshape(leaf.shape))
        relief = eqx.tree_at(operator.attrgetter(name), relief, jax.tree.unflatten(tree, new))
    return relief


def bounds_of(model: DimensionlessModel, relief: CycleRelief, free: Sequence[str], given: Mapping):
    if set(given) - set(free):
        raise ValueError(f"dynamic_profile_modification: bounds = {sorted(given)} must be of what is free, {free!r}")
    ratio = relief.contact_ratio
    usual = {
        "amount": (jnp.zeros_like(model.load), 4 * model.load),
        "length": (0.2 * (ratio - 1), 0.5 * ratio),
        "curve": (0.5, 4.0) if isinstance(relief.curve, Power) else (-4.0, 4.0),
    }
    if isinstance(relief.curve, Polynomial | Quadratic):  # b_0 would be a step where the relief starts
        fixed = jnp.concatenate([jnp.ravel(leaf) for leaf in jax.tree.leaves(relief.curve)])
        inner = jnp.arange(len(fixed)) > 0
        usual["curve"] = (jnp.where(inner, -4.0, fixed), jnp.where(inner, 4.0, fixed))
    low, high = [], []
    for name in free:
        count = sum(leaf.size for leaf in jax.tree.leaves(getattr(relief, name)))
        least, most = given.get(name, usual[name])
        known = concrete(real(least)), concrete(real(most))
        if known[0] is not None and known[1] is not None and (known[0] > known[1]).any():
            raise ValueError(f"dynamic_profile_modification: bounds of {name} = ({least}, {most}) must not fall")
        low.append(jnp.broadcast_to(real(least), count))
        high.append(jnp.broadcast_to(real(most), count))
    return jnp.concatenate(low), jnp.concatenate(high)
