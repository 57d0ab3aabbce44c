"""The genetic algorithm of bit strings, as the genetic-algorithm study of the 19/48 pair states it."""

from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np

from ..numerics import Checked, count, decoded, next_generation, number, random_strings
from .evaluate import fitness
from .problem import Problem
from .search import AbstractMethod, Record

_MOST = 100_000
_MOST_BITS = 24  # as many as a number of single precision holds


class BinaryGenetic(Checked, AbstractMethod):
    """Genetic algorithm of bit strings: roulette-wheel selection, one-point crossover, fitness 1 / objective.

    Every generation replaces the one before it; the best design of all is kept apart. The defaults are those of the
    genetic-algorithm study of the 19/48 pair but for the bits, which it does not say. Its "mutation with a probability
    of 0.5" is that with which one bit of a string flips. A design that passes a limit has next to no chance to be
    selected beside those that keep all.

    Attributes:
        population: designs per generation.
        generations: how many.
        bits: of every parameter, whose range they divide into 2^bits - 1 steps.
        crossover: probability with which a design has the end of its string from a second parent.
        mutation: probability with which one bit of a design flips.
        seed: of the random numbers.

    Raises:
        ValueError: for an objective that is negative, or that is to be large: its inverse is no fitness.
    """

    name: ClassVar[str] = "binary_genetic"
    population: int = count(low=2, high=_MOST, default=100)
    generations: int = count(high=_MOST, default=100)
    bits: int = count(high=_MOST_BITS, default=10)
    crossover: float = number("", low=0.0, high=1.0, static=True, default=0.5)
    mutation: float = number("", low=0.0, high=1.0, static=True, default=0.5)
    seed: int = count(low=0, high=2**31 - 1, default=0)

    def search(self, problem: Problem, record: Record) -> None:
        """Runs the generations."""
        key, first = jax.random.split(jax.random.key(self.seed))
        strings = random_strings(first, self.population, len(problem.names), self.bits)
        for generation in range(1, self.generations + 1):
            ranks = np.asarray(fitness(record.judge(decoded(strings, self.bits))))
            if (ranks < 0).any():
                raise ValueError("binary_genetic: needs an objective that is positive and to be made small")
            record.look(generation, self.generations)
            key, breed = jax.random.split(key)
            # relative to the best, so that neither an objective of zero nor its unit matters
            least = np.maximum(ranks, np.finfo(ranks.dtype).tiny)
            strings = next_generation(breed, strings, jnp.asarray(least.min() / least), self.crossover, self.mutation)
