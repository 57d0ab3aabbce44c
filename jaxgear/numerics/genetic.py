"""A genetic algorithm of bit strings: roulette selection, one-point crossover, mutation (Goldberg 1989)."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from .programs import kernel

Strings = Bool[Array, "population length"]


def random_strings(key: Any, population: int, numbers: int, bits: int) -> Strings:
    """A first population; each string holds so many numbers of so many bits, one after the other."""
    return jax.random.bernoulli(key, shape=(population, numbers * bits))


def decoded(strings: Strings, bits: int) -> Float[Array, "population numbers"]:
    """The numbers that strings stand for, 0 with all bits off to 1 with all bits on; the first bit counts most."""
    worth = 2.0 ** np.arange(bits - 1, -1, -1) / (2.0**bits - 1)
    return jnp.sum(jnp.where(strings.reshape(len(strings), -1, bits), worth[None, None], 0.0), axis=-1)


@kernel
def next_generation(key: Any, strings: Strings, fitness: Float[Array, " population"], crossover, mutation) -> Strings:
    """A population that replaces the given one.

    Args:
        key: of the random numbers.
        strings: the population.
        fitness: not negative, nor NaN; a string becomes a parent with the probability of its share in the sum. Where
            the sum is zero all are alike.
        crossover: probability with which a child has the tail of a second parent, from a random place on.
        mutation: probability with which one random bit of a child is flipped. Were it that of every bit, a half would
            make the search a random one.
    """
    count, length = strings.shape
    chosen, second, crossed, place, mutated, bit = jax.random.split(key, 6)
    total = jnp.sum(fitness)
    share = jnp.where(total > 0, fitness / jnp.where(total > 0, total, 1.0), 1.0 / count)
    mother, father = (strings[jax.random.choice(each, count, (count,), p=share)] for each in (chosen, second))
    at = jnp.arange(length)[None]
    cut = jax.random.randint(place, (count, 1), 1, max(length, 2))
    tail = jax.random.bernoulli(crossed, crossover, (count, 1)) & (at >= cut)
    flip = jax.random.bernoulli(mutated, mutation, (count, 1)) & (at == jax.random.randint(bit, (count, 1), 0, length))
    return jnp.where(tail, father, mother) ^ flip
