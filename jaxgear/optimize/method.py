"""Base classes of optimization methods, and the method of sequential linear programming."""

import time
from abc import abstractmethod
from collections.abc import Mapping
from typing import ClassVar

import equinox as eqx
import numpy as np

from ..numerics import Callback
from ..numerics.fields import Checked, count, number
from .linear_model import Linearizer
from .problem import Problem
from .refine import refined
from .result import Optimum
from .rounding import check_steps
from .search import Record, points_nearby, start_points
from .slp import Search, follow
from .verdict import optimum_of


class AbstractMethod(eqx.Module):
    """A method of optimization; its fields are its options.

    Most methods are an `AbstractSearch`.
    """

    takes_variables: ClassVar[bool] = True  # False for a method with its own variables

    @property
    @abstractmethod
    def name(self) -> str:
        """Name of the method in design files and tables."""

    @abstractmethod
    def find(
        self, problem: Problem, *, positions: int | None, rounding: Mapping[str, float], callback: Callback | None
    ) -> Optimum:
        """Find the best design of a problem; arguments as for `minimize`."""


class AbstractSearch(AbstractMethod):
    """Search of the unit box of a problem, continued from its best design on finer meshes."""

    @abstractmethod
    def search(self, problem: Problem, record: Record) -> None:
        """Search the box and store the best design in the record."""

    def pose(self, problem: Problem) -> Problem:
        """Problem with the variables of the method; by default the problem itself."""
        return problem

    def polish(self, problem: Problem, record: Record, point: np.ndarray) -> None:
        """Continue from a design on a finer mesh; by default evaluate the design."""
        record.judge(point[None])

    def finish(self, record: Record) -> None:
        """Final change of the best design that keeps its objective; none by default."""

    def find(
        self, problem: Problem, *, positions: int | None, rounding: Mapping[str, float], callback: Callback | None
    ) -> Optimum:
        began, problem = time.perf_counter(), self.pose(problem)
        if not problem.names:
            raise ValueError("bounds must name at least one variable")
        steps = check_steps(rounding, problem.bounds)
        record = Record(problem, callback)
        self.search(problem, record)
        record.check()
        found = refined(record, self.polish, positions, steps)
        self.finish(found.record)
        unrounded = found.unrounded if steps else None
        taken = {} if found.record is found.unrounded else steps
        return optimum_of(found.record, self.name, began, found.change, unrounded=unrounded, steps=taken)


# Reach of the start points of a later round about the best design, in the unit box. The kinks of PPTE make many shallow
# local optima close together; on the 19/48 pair they lie within a tenth of the range.
_NEARBY = 0.1
_POLISHED, _BESIDE = 4, 0.03  # searches on the finer mesh, and their reach about the design


class SLP(Checked, AbstractSearch):
    """Trust-region sequential linear programming from many start points, repeated around the best design.

    Each step solves a linear program in which the transmission error at every position is linear and the extremes are
    exact; see `linear_model`. It converges at the kinks where other gradient methods stall: a few dozen contact
    analyses find a local optimum to many digits. The method is local: it finds optima near its start points, and every
    further round searches near the best design.

    Attributes:
        starts: number of searches that advance together.
        rounds: number of rounds; the first one starts all over the box, each further one around the best design.
        steps: largest number of steps of every search.
        rtol: relative tolerance: a search ends if the predicted decrease is below this part of the objective.
    """

    name: ClassVar[str] = "slp"
    starts: int = count(high=4096, default=16)
    rounds: int = count(high=1000, default=2)
    steps: int = count(high=100_000, default=40)
    rtol: float = number("", low=0.0, high=1.0, open_low=True, open_high=True, static=True, default=1e-4)

    def search(self, problem: Problem, record: Record) -> None:
        """Run all rounds; a round ends when no search finds a better step."""
        points = start_points(problem, self.starts)
        record.linearizer = Linearizer(problem, self.starts)
        for round_ in range(self.rounds):
            if round_:
                points = points_nearby(record.point, self.starts, reach=_NEARBY, seed=round_)
            follow(
                record.linearizer,
                record,
                [Search(point) for point in points],
                steps=self.steps,
                rtol=self.rtol,
                round_of=(round_, self.rounds),
            )

    def polish(self, problem: Problem, record: Record, point: np.ndarray) -> None:
        """Search again from the design and from a few points near it."""
        linearizer = record.linearizer or Linearizer(problem, _POLISHED)
        beside = points_nearby(point, _POLISHED - 1, reach=_BESIDE, seed=0)
        follow(linearizer, record, [Search(start) for start in (point, *beside)], steps=self.steps, rtol=self.rtol)
