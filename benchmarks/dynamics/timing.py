"""Times of several contenders that take turns, so that a busy machine slows all alike."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import jax


@dataclass(frozen=True)
class Times:
    """Of the best of some calls: what disturbs a measurement only makes it slower.

    Attributes:
        wall, processor: [s]; processor time is that of all threads, which does not count what other programs take.
    """

    wall: float
    processor: float


def best_of(calls: Mapping[str, Callable[[], object]], repetitions: int) -> dict[str, Times]:
    """Each contender once to warm up, then all in turns."""
    taken: dict[str, list[Times]] = {name: [] for name in calls}
    for call in calls.values():
        jax.block_until_ready(call())
    for _ in range(repetitions):
        for name, call in calls.items():
            wall, processor = time.perf_counter(), time.process_time()
            jax.block_until_ready(call())
            taken[name].append(Times(time.perf_counter() - wall, time.process_time() - processor))
    return {name: _best(times) for name, times in taken.items()}


def _best(times: Sequence[Times]) -> Times:
    return Times(min(one.wall for one in times), min(one.processor for one in times))
