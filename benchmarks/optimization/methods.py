"""Every method of optimization, ready to run on a task."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import metadata
from importlib.util import find_spec

import jaxgear as jg
from jaxgear.microgeometry import AbstractModification

from .tasks import Task

ROBUST_TORQUES = (0.7, 1.0, 1.3)  # relative to the design torque
_EVOLUTION = "evosax"


@dataclass(frozen=True)
class Effort:
    """How much every method may spend.

    Attributes:
        positions, fine: mesh positions of the search, and of the judgement.
        gears: manufactured gears of the judgement.
        levels: of the factorial, per variable.
        population, generations: of the genetic algorithm and of differential evolution.
        cma_population, cma_generations: of CMA-ES.
        starts, steps, lbfgs_steps: of Adam and L-BFGS.
        slp_starts: of sequential linear programming.
        points: of the free-form flanks.
        samples: manufactured gears per torque of the robust design.
    """

    positions: int = 64
    fine: int = 256
    gears: int = 4083
    levels: int = 10
    population: int = 100
    generations: int = 100
    cma_population: int = 16
    cma_generations: int = 100
    starts: int = 16
    steps: int = 300
    lbfgs_steps: int = 150
    slp_starts: int = 4
    points: int = 40
    samples: int = 16


# populations as large as the factorial, so that one program scores all
QUICK = Effort(
    positions=16,
    fine=32,
    gears=243,
    levels=4,
    population=64,
    generations=5,
    cma_population=64,
    cma_generations=5,
    slp_starts=2,
    points=12,
)


@dataclass(frozen=True)
class Found:
    """A design and its price.

    Attributes:
        pinion, wheel: modifications.
        evaluations: contact analyses, one with its gradient counted as three.
        steps: of the transmission-error iteration, None of other methods.
        optimum: what the method returned, None where it searched nothing.
    """

    pinion: AbstractModification | None
    wheel: AbstractModification | None
    evaluations: int
    steps: int | None = None
    optimum: jg.optimize.Optimum | None = None


@dataclass(frozen=True)
class Method:
    """A row of the table.

    Attributes:
        name: its name.
        run: finds a design; the last argument is what the method `after` found.
        after: the method that comes before, whose price is added.
        needs: library that it cannot do without.
        slow: compiles long and is left out of a quick run.
    """

    name: str
    run: Callable[[Task, jg.Mesh, Found | None], Found]
    after: str | None = None
    needs: str | None = None
    slow: bool = False

    @property
    def missing(self) -> str | None:
        """The library that it lacks."""
        return self.needs if self.needs and find_spec(self.needs) is None else None


def methods(effort: Effort) -> list[Method]:
    """All methods, in the order of the table."""
    population, generations = effort.population, effort.generations
    return [
        Method("unmodified", lambda task, mesh, _: Found(None, None, 0)),
        Method("rule-based", _rule),
        Method("factorial", _searched(jg.optimize.Factorial(effort.levels))),
        Method("genetic", _searched(jg.optimize.Genetic(population, generations)), needs=_EVOLUTION),
        Method(
            "differential evolution",
            _searched(jg.optimize.DifferentialEvolution(population, generations)),
            needs=_EVOLUTION,
        ),
        Method("CMA-ES", _searched(jg.optimize.CMAES(effort.cma_population, effort.cma_generations)), needs=_EVOLUTION),
        Method("Adam", _searched(jg.optimize.Adam(effort.starts, effort.steps)), slow=True),
        Method("L-BFGS", _searched(jg.optimize.LBFGS(effort.starts, effort.lbfgs_steps)), slow=True),
        Method("slp", _searched(jg.optimize.SLP(effort.slp_starts))),
        Method("robust slp", _robust(effort), slow=True),
        Method("iteration, type 1", _iterated),
        Method("iteration, type 2", _iterated_from_relief(effort), slow=True),
        Method(
            "free form",
            lambda task, mesh, _: _found(
                jg.minimize(jg.Problem(mesh, task.torque), jg.optimize.FreeForm(effort.points), positions=None)
            ),
        ),
        Method("free form as cubic", _projected("cubic"), after="free form"),
        Method("free form as power", _projected("power"), after="free form"),
    ]


def versions() -> dict[str, str]:
    """Of the libraries that matter."""
    names = ("jax", "numpy", "optax", _EVOLUTION)
    return {name: metadata.version(name) for name in names if find_spec(name) is not None}


def _found(optimum: jg.optimize.Optimum, before: int = 0) -> Found:
    steps = len(optimum.iterations) - 1 if optimum.iterations else None
    return Found(optimum.pinion, optimum.wheel, before + optimum.evaluations, steps, optimum)


def _rule(task: Task, mesh: jg.Mesh, _) -> Found:
    relief = jg.iso_relief(task.pair, task.torque)
    return Found(relief, relief, 0)


def _searched(method):
    def run(task: Task, mesh: jg.Mesh, _) -> Found:
        return _found(jg.minimize(jg.Problem(mesh, task.torque, task.design, task.bounds), method, positions=None))

    return run


def _robust(effort: Effort):
    """The mean of the worst tenth over three torques and manufactured gears."""

    def run(task: Task, mesh: jg.Mesh, _) -> Found:
        load = jg.LoadSpectrum([share * task.torque for share in ROBUST_TORQUES])
        found = jg.minimize(
            jg.Problem(
                mesh,
                load,
                task.design,
                task.bounds,
                measure=jg.CVaR(0.9),
                manufactured=jg.ManufacturedGears(task.tolerance, effort.samples),
            ),
            method=jg.optimize.SLP(effort.slp_starts),
            positions=None,
        )
        return _found(found)

    return run


def _iterated(task: Task, mesh: jg.Mesh, _) -> Found:
    method = jg.optimize.TransmissionErrorIteration(max_relief=task.max_relief)
    return _found(jg.minimize(jg.Problem(mesh, task.torque), method))


def _iterated_from_relief(effort: Effort):
    """From the tip relief of least contact pressure, which levels nothing by itself."""

    def run(task: Task, mesh: jg.Mesh, _) -> Found:
        start = jg.minimize(
            jg.Problem(mesh, task.torque, task.relief, task.relief_bounds, objective="max_contact_pressure"),
            method=jg.optimize.SLP(effort.slp_starts),
            positions=None,
        )
        method = jg.optimize.TransmissionErrorIteration("given", max_relief=task.max_relief)
        found = jg.minimize(jg.Problem(mesh, task.torque, lambda variables: (start.pinion, start.wheel)), method)
        return _found(found, start.evaluations)

    return run


def _projected(curve: str):
    def run(task: Task, mesh: jg.Mesh, before: Found | None) -> Found:
        assert before is not None and before.optimum is not None
        fit = jg.optimize.project(before.optimum, curve)
        return Found(fit.pinion, fit.wheel, before.evaluations + 1)

    return run
