"""Searches beside sequential linear programming: gradients (optax, L-BFGS), evolution (evosax), full factorial tables.

Gradient searches follow soft extremes whose width shrinks in stages, with a penalty on limits.
"""

import functools
from abc import abstractmethod
from collections.abc import Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy  # its packages load when they are used

from ..numerics import kernel, whole
from ..numerics.fields import Checked, count, number
from ..sweeps import FullFactorial
from .method import AbstractSearch
from .problem import GRADIENT_COST, Problem, Score, real_points
from .search import Record, fitness, start_points

# Widths of the soft extremes in the stages of a search, relative to the best objective among the start points: from
# wide, where most positions pull, to narrow, where the soft objective is within about a percent of the true one.
STAGE_WIDTHS = (0.5, 0.2, 0.1, 0.05, 0.02, 0.01)
# Penalty on relative violations, in terms of the same objective: it is exact where no limit costs more than that, and
# smooth over this part of the width of the extremes.
_PENALTY, _ROUNDED = 30.0, 0.05
_LEAST_SCALE = 1e-3  # [um] of the objective, where the start is best already
_LONGEST = 20  # steps of Adam between two reports
_FIRST_RATE, _LAST_RATE = 0.05, 0.002  # its step sizes in the unit box


def _softened(problem: Problem, x, width, scale):
    """Soft objective with penalty at one point, and the true objective and violation."""
    values, true, excess, fine = problem.soft_and_true(x, width * scale)
    good = fine & jnp.isfinite(jnp.sum(values))
    passed, rounded = jnp.maximum(excess, 0.0), _ROUNDED * width
    penalty = _PENALTY * scale * jnp.sum(jnp.sqrt(passed**2 + rounded**2) - rounded)
    return values[0] + penalty, (jnp.where(good, true[0], jnp.inf), jnp.max(passed, initial=0.0))


_gradient = jax.value_and_grad(_softened, argnums=1, has_aux=True)


def _scale(start: Score) -> float:
    """Reference of the widths: the best objective among the start points."""
    known = np.abs(start.value[np.isfinite(start.value)])
    return max(float(known.min()), _LEAST_SCALE) if len(known) else 1.0


class Adam(Checked, AbstractSearch):
    """Adam (optax) from many start points at once, on a soft objective whose width shrinks in stages.

    Points outside the box are moved to its surface.

    Attributes:
        starts: number of start points; the first is the middle of the box.
        steps: gradient steps of every start, over all stages.
    """

    name: ClassVar[str] = "adam"
    starts: int = count(default=16)
    steps: int = count(low=len(STAGE_WIDTHS), default=300)

    def search(self, problem: Problem, record: Record) -> None:
        """Run all stages and store the best design in the record."""
        points = real_points(problem, start_points(problem, self.starts))
        scale = real_points(problem, _scale(record.judge(points)))
        stages = max(self.steps // _LONGEST, len(STAGE_WIDTHS))
        steps = self.steps // stages
        for stage, rate in enumerate(np.geomspace(_FIRST_RATE, _LAST_RATE, stages)):
            width = STAGE_WIDTHS[stage * len(STAGE_WIDTHS) // stages]
            numbers = (real_points(problem, each) for each in (width, rate))
            points, seen = _adam(problem, points, scale, *numbers, steps=steps)
            record.spend(steps * self.starts, analyses=GRADIENT_COST)
            record.offer(*jax.tree.map(lambda part: np.reshape(part, (steps * self.starts, *part.shape[2:])), seen))
            record.look((stage + 1) * steps, stages * steps)


@kernel
def _adam(problem: Problem, points, scale, width, rate, *, steps: int):
    """Points after `steps` steps, and all evaluated points with objective and violation."""
    import optax

    adam = optax.scale_by_adam()

    def step(carry, _):
        points, moments = carry
        (_, judged), slopes = jax.vmap(lambda x: _gradient(problem, x, width, scale))(points)
        # optax mixes its integer step count with floats, which strict promotion would forbid
        with jax.numpy_dtype_promotion("standard"):
            update, moments = adam.update(jnp.where(jnp.isfinite(slopes), slopes, 0.0), moments)
        return (jnp.clip(points - rate * update, 0.0, 1.0), moments), (points, *judged)

    (points, _), met = jax.lax.scan(step, (points, adam.init(points)), length=steps)
    return points, met


class LBFGS(Checked, AbstractSearch):
    """Limited-memory BFGS within the box (scipy), from one start point after the other, on a soft objective.

    Attributes:
        starts: number of start points; the first is the middle of the box.
        steps: analyses with gradient of every start, over all stages.
    """

    name: ClassVar[str] = "lbfgs"
    starts: int = count(default=16)
    steps: int = count(low=len(STAGE_WIDTHS), default=150)

    def search(self, problem: Problem, record: Record) -> None:
        """Run all stages and store the best design in the record."""
        points = start_points(problem, self.starts)
        scale, steps = _scale(record.judge(points)), self.steps // len(STAGE_WIDTHS)
        for stage, width in enumerate(STAGE_WIDTHS):

            def loss(x, width=width):
                numbers = (real_points(problem, each) for each in (x, width, scale))
                (value, judged), slopes = jax.device_get(_slopes(problem, *numbers))
                record.spend(1, analyses=GRADIENT_COST)
                record.offer(x, *judged)
                return value.item(), slopes.astype(float)

            options = {"jac": True, "bounds": [(0.0, 1.0)] * len(problem.names)}
            options |= {"options": {"maxfun": steps}, "method": "L-BFGS-B"}
            points = np.stack([scipy.optimize.minimize(loss, point, **options).x for point in points])
            record.look((stage + 1) * steps, steps * len(STAGE_WIDTHS))


@kernel
def _slopes(problem: Problem, x, width, scale):
    return _gradient(problem, x, width, scale)


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
