"""Gradient-free searches: evolution (evosax) and full factorial tables."""

import functools
from abc import abstractmethod
from collections.abc import Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp

from ..numerics import whole
from ..numerics.fields import Checked, count, number
from ..sweeps import FullFactorial
from .method import AbstractSearch
from .problem import Problem
from .search import Record, fitness

_LEAST_POPULATION, _MOST = 4, 100_000
# Mutation of the genetic algorithm: standard deviation in the unit box, falling geometrically over the generations so
# that it explores first and refines then.
_FIRST_MUTATION, _LAST_MUTATION = 0.2, 0.002


class _Evolution(Checked, AbstractSearch):
    """Generations of a population in the unit box; individuals outside it are moved to its surface.

    Attributes:
        population: number of designs per generation.
        generations: number of generations.
        seed: seed of the random numbers.
    """

    population: int = count(low=_LEAST_POPULATION, high=_MOST, default=100)
    generations: int = count(high=_MOST, default=100)
    seed: int = count(low=0, high=2**31 - 1, default=0)

    def search(self, problem: Problem, record: Record) -> None:
        """Run all generations and store the best design in the record."""
        with _relaxed():
            algorithm, parameters = _made(replace(self, seed=0), len(problem.names), problem.low.dtype)
        key, first = jax.random.split(jax.random.key(self.seed))
        state, rest = self._begin(algorithm, parameters, problem, record, first)
        for generation in range(1, rest + 1):
            key, ask, tell = jax.random.split(key, 3)
            with _relaxed():
                points, state = algorithm.ask(ask, state, parameters)
                points = jnp.clip(points, 0.0, 1.0).astype(problem.low.dtype)
            ranks = fitness(record.judge(points))
            with _relaxed():
                state, _ = algorithm.tell(tell, points, ranks, state, parameters)
            record.look(generation + self.generations - rest, self.generations)

    def _begin(self, algorithm, parameters, problem, record, key):
        """State before the next generation, and number of remaining generations."""
        points = jax.random.uniform(key, (self.population, len(problem.names)), problem.low.dtype)
        ranks = fitness(record.judge(points))
        record.look(1, self.generations)
        with _relaxed():
            return algorithm.init(key, points, ranks, parameters), self.generations - 1

    @abstractmethod
    def _algorithm(self, example):
        """Algorithm and its parameters for designs of the shape of the example."""


class Genetic(_Evolution):
    """Genetic algorithm with real genes (evosax.SimpleGA): uniform crossover, Gaussian mutation, the better half mates.

    The defaults are the population, the generations and the crossover rate of the genetic-algorithm study of the 19/48
    pair, whose own algorithm codes its genes in bits. Mutation shrinks here over the generations.

    Attributes:
        crossover: share of the genes that come from the second parent.
    """

    name: ClassVar[str] = "genetic"
    crossover: float = number("", low=0.0, high=1.0, static=True, default=0.5)

    def _algorithm(self, example):
        last = max(self.generations - 1, 1)

        def mutation(generation):
            return _FIRST_MUTATION * (_LAST_MUTATION / _FIRST_MUTATION) ** (generation / last)

        made = _evosax().SimpleGA(self.population, example, std_schedule=mutation)
        return made, made.default_params.replace(crossover_rate=self.crossover)


class DifferentialEvolution(_Evolution):
    """Differential evolution (Storn and Price 1997; evosax.DifferentialEvolution), about the best individual."""

    name: ClassVar[str] = "differential_evolution"

    def _algorithm(self, example):
        made = _evosax().DifferentialEvolution(self.population, example)
        return made, made.default_params


class CMAES(_Evolution):
    """Covariance matrix adaptation (Hansen and Ostermeier 2001; evosax.CMA_ES), from the middle of the box.

    Attributes:
        spread: standard deviation of the first generation in the unit box.
    """

    name: ClassVar[str] = "cma_es"
    population: int = count(low=_LEAST_POPULATION, default=16)
    spread: float = number("", low=0.0, high=1.0, open_low=True, static=True, default=0.3)

    def _algorithm(self, example):
        made = _evosax().CMA_ES(self.population, example)
        return made, made.default_params.replace(std_init=self.spread)

    def _begin(self, algorithm, parameters, problem, record, key):
        with _relaxed():
            return algorithm.init(key, jnp.full_like(problem.low, 0.5), parameters), self.generations


@functools.lru_cache(maxsize=16)
def _made(method: _Evolution, parameters: int, dtype):
    """Cached algorithm: algorithms hash by identity, and a new one would compile all its functions again."""
    return method._algorithm(jnp.full(parameters, 0.5, dtype))


@contextmanager
def _relaxed():
    """Context with standard type promotion: evosax mixes floating-point types and ranks."""
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
        yield


def _evosax():
    try:
        import evosax.algorithms
    except ImportError:
        raise ValueError("evolutionary methods need the library evosax: pip install 'jaxgear[evolution]'") from None
    return evosax.algorithms


_LEVELS = 5
_MOST_DESIGNS = 10**7
_CHUNK = 2048  # designs between two reports


class Factorial(AbstractSearch):
    """Every combination of equally spaced levels of every parameter, bounds included.

    Attributes:
        levels: number of levels per parameter: one number, or a number by the name of every parameter.
    """

    name: ClassVar[str] = "factorial"
    levels: int | tuple[tuple[str, int], ...] = eqx.field(static=True, default=_LEVELS)

    def __post_init__(self) -> None:
        if isinstance(self.levels, Mapping):
            self.levels = tuple(self.levels.items())

    def __check_init__(self) -> None:
        for value in [self.levels] if isinstance(self.levels, int) else dict(self.levels).values():
            whole("Factorial: levels", value, 2)

    def search(self, problem: Problem, record: Record) -> None:
        """Evaluate all combinations and store the best design in the record."""
        levels = self.levels if isinstance(self.levels, int) else dict(self.levels)
        plan = FullFactorial({name: (0.0, 1.0) for name in problem.names}, levels)
        if plan.size > _MOST_DESIGNS:
            raise ValueError(f"Factorial: {plan.size} designs must be at most {_MOST_DESIGNS}; take fewer levels")
        chunk = min(_CHUNK, plan.size)
        for start in range(0, plan.size, chunk):
            stop = min(start + chunk, plan.size)
            record.judge(plan.rows(start, stop), chunk)
            record.look(stop, plan.size)
