"""Pareto fronts, a genetic algorithm of bit strings, and points that fill a box evenly."""

from bisect import bisect_left, bisect_right

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from .conversion import Given, Numbers
from .programs import kernel


def pareto_front(values: Numbers) -> np.ndarray:
    """Rows that no other row dominates, where smaller is better in every objective (negate what is to be large).

    A row dominates another one if it is nowhere worse and somewhere better; equal rows do not dominate each other. Rows
    that are not finite are never on the front. Up to three objectives by sorting and a staircase of the best seen
    so far (Kung, Luccio and Preparata 1975, doi 10.1145/321906.321910), O(n log n); more of them row by row, O(n) for
    every row of the front.

    Args:
        values: shape (rows, objectives).

    Returns:
        bool, shape (rows,).

    Raises:
        ValueError: for another number of axes, or no objective.
    """
    values = np.asarray(values, float)
    if values.ndim != 2 or not values.shape[1]:
        raise ValueError(f"values has shape {values.shape}, must be (rows, at least 1 objective)")
    front = np.zeros(len(values), bool)
    rows = np.flatnonzero(np.isfinite(values).all(axis=1))
    if rows.size == 0:
        return front
    rows = rows[_not_beaten_by_few(values[rows])]
    rows = rows[np.lexsort(values[rows].T[::-1])]
    ordered = values[rows]
    # of equal rows, neighbours after sorting, the first one stands for all
    first = np.r_[True, (ordered[1:] != ordered[:-1]).any(axis=1)]
    best = _SWEEPS.get(values.shape[1], _one_by_one)(ordered[first])
    front[rows] = best[np.cumsum(first) - 1]
    return front


_RULERS = 32  # well placed rows that sort out most others before anything is sorted


def _not_beaten_by_few(values: np.ndarray) -> np.ndarray:
    """Rows that the rows of the smallest scaled sums leave; these beat nearly all rows of a usual table."""
    low, high = values.min(axis=0), values.max(axis=0)
    total = ((values - low) / np.where(high > low, high - low, 1.0)).sum(axis=1)
    left = np.arange(len(values))
    if left.size <= _RULERS:
        return left
    for ruler in np.argpartition(total, _RULERS)[:_RULERS]:
        rest = values[left]
        beaten = (rest >= values[ruler]).all(axis=1) & (rest > values[ruler]).any(axis=1)
        left = left[~beaten]
    return left


def _sweep_one(ordered: np.ndarray) -> np.ndarray:
    return np.arange(len(ordered)) == 0


def _sweep_two(ordered: np.ndarray) -> np.ndarray:
    """In ascending order of the first objective, a row is good if its second one is the smallest so far."""
    second = ordered[:, 1]
    return second < np.r_[np.inf, np.minimum.accumulate(second)[:-1]]


def _sweep_three(ordered: np.ndarray) -> np.ndarray:
    """In ascending order of the first objective, a row is good if it lies below the staircase of the other two."""
    good = np.zeros(len(ordered), bool)
    # corners of the staircase: seconds ascend, thirds descend
    seconds: list[float] = []
    thirds: list[float] = []
    for i, (_, second, third) in enumerate(ordered.tolist()):
        at = bisect_right(seconds, second)
        if at and thirds[at - 1] <= third:
            continue
        good[i] = True
        start = end = bisect_left(seconds, second)
        while end < len(thirds) and thirds[end] >= third:
            end += 1
        seconds[start:end], thirds[start:end] = [second], [third]
    return good


def _one_by_one(ordered: np.ndarray) -> np.ndarray:
    """In ascending order of the first objective, a row that none before it beats is good."""
    good = np.ones(len(ordered), bool)
    for i, row in enumerate(ordered):
        if good[i]:
            good &= ~((ordered >= row).all(axis=1) & (ordered > row).any(axis=1))
    return good


_SWEEPS = {1: _sweep_one, 2: _sweep_two, 3: _sweep_three}


Strings = Bool[Array, "population length"]


def random_strings(key: PRNGKeyArray, population: int, numbers: int, bits: int) -> Strings:
    """Random first population of bit strings, each with several numbers of several bits."""
    return jax.random.bernoulli(key, shape=(population, numbers * bits))


def decoded(strings: Strings, bits: int) -> Float[Array, "population numbers"]:
    """Numbers encoded by bit strings, from 0 (all bits off) to 1 (all bits on), most significant bit first."""
    worth = 2.0 ** np.arange(bits - 1, -1, -1) / (2.0**bits - 1)
    return jnp.sum(jnp.where(strings.reshape(len(strings), -1, bits), worth[None, None], 0.0), axis=-1)


@kernel
def next_generation(
    key: PRNGKeyArray, strings: Strings, fitness: Float[Array, " population"], crossover: Given, mutation: Given
) -> Strings:
    """A population that replaces the given one.

    Args:
        key: key of the random numbers.
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


def halton(dimensions: int, count: int, seed: int | None = None) -> np.ndarray:
    """Points of a Halton sequence in the unit box, shape (count, dimensions); with a seed scrambled (Owen 2017).

    Those of `scipy.stats.qmc.Halton`, which takes longer to import than a search may take.
    """
    rng = None if seed is None else np.random.default_rng(seed)
    return np.stack([_van_der_corput(count, base, rng) for base in _primes(dimensions)], axis=1)


def _van_der_corput(count: int, base: int, rng: np.random.Generator | None) -> np.ndarray:
    """Van der Corput numbers: the reversed digits of 0, 1, 2, ..., optionally permuted, after the point."""
    digits = int(np.ceil(54 / np.log2(base))) - 1  # that a double can show
    permuted = np.repeat(np.arange(base)[None], digits, axis=0)
    if rng is not None:
        for each in permuted:
            rng.shuffle(each)
    left, found, place = np.arange(count), np.zeros(count), 1.0
    for each in permuted:
        place /= base
        found += each[left % base] * place
        left //= base
    return found


def _primes(count: int) -> list[int]:
    found: list[int] = []
    number = 2
    while len(found) < count:
        if all(number % prime for prime in found):
            found.append(number)
        number += 1
    return found
