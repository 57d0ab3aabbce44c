"""Who competes in the throughput benchmark; every contender lives in its own process.

Only so can each have its own floating-point type, its own cold start and its own peak memory. A process waits idle
while another one is measured.
"""

import multiprocessing
import os
import resource
import sys
import time
from dataclasses import dataclass
from multiprocessing.connection import Connection

import numpy as np

from .baselines.problem import Problem, random_variants


@dataclass(frozen=True)
class Contender:
    """One row of the table.

    Attributes:
        kind: "jaxgear", "C", "NumPy" or "SciPy".
        chunk: variants per call.
        slices: slices of the face; more than one adds lead crowning.
        threads: processor cores in use.
        precision: "float64" or "float32".
        gradient: whether the derivatives by the four parameters are computed too.
        batch: variants per batch of jaxgear or NumPy; zero where there is none.
        coupled: whether slices are coupled, which those of the baselines are not.
        helix_angle: [deg]; zero for spur gears, the only ones of the baselines.
    """

    kind: str
    chunk: int
    slices: int = 1
    threads: int = 1
    precision: str = "float64"
    gradient: bool = False
    batch: int = 0
    coupled: bool = False
    helix_angle: float = 0.0

    @property
    def name(self) -> str:
        """What the table calls it."""
        kind = " coupled" * self.coupled + f" helical {self.helix_angle:g}" * (self.helix_angle != 0)
        return f"{self.kind} {self.precision}{kind}" + " + gradient" * self.gradient

    @property
    def physics(self) -> tuple[int, bool, float]:
        """What has to be equal for two contenders to agree."""
        return self.slices, self.coupled, self.helix_angle


@dataclass(frozen=True)
class Start:
    """How a contender came up.

    Attributes:
        cold: from the start of the process to the first result [s].
        compiled: part of it that compiled the analysis [s].
        versions: of the software it runs on.
        problem: the plain numbers of the prepared mesh, from jaxgear only.
    """

    cold: float
    compiled: float
    versions: dict[str, str]
    problem: Problem | None


class Process:
    """A running contender; use it as a context manager."""

    def __init__(self, contender: Contender, positions: int, problem: Problem | None = None):
        """Starts the process and waits for its first result.

        Args:
            contender: which one.
            positions: mesh positions.
            problem: input of the baselines; jaxgear prepares its own.
        """
        context = multiprocessing.get_context("spawn")
        self.contender = contender
        self._connection, child = context.Pipe()
        arguments = (child, contender, positions, problem, time.time())
        self._process = context.Process(target=_serve, args=arguments, daemon=True)
        self._process.start()
        child.close()
        self.start: Start = self._receive()

    def __enter__(self) -> "Process":
        return self

    def __exit__(self, *_) -> None:
        self._connection.close()
        self._process.join(timeout=10)
        if self._process.is_alive():
            self._process.terminate()

    def results(self, variants: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
        """PPTE and, if the contender computes it, its gradient."""
        return self._ask("results", variants)

    def rate(self, seconds: float) -> tuple[float, float]:
        """Variants per second and per second of processor time, over the given time or one chunk if that is longer."""
        return self._ask("rate", seconds)

    def peak_memory(self) -> float:
        """Largest resident memory of the process so far [MiB]."""
        return self._ask("memory", None)

    def _ask(self, request, argument):
        self._connection.send((request, argument))
        return self._receive()

    def _receive(self):
        try:
            answer = self._connection.recv()
        except EOFError:
            raise RuntimeError(f"{self.contender.name}: the process has ended") from None
        if isinstance(answer, Exception):
            raise RuntimeError(f"{self.contender.name}: {answer}") from answer
        return answer


def _serve(connection: Connection, contender: Contender, positions: int, problem, begin: float) -> None:
    """The life of a contender's process: answers requests until the other end closes."""
    try:
        variants = random_variants(contender.chunk, seed=1)
        kernel, versions = _make(contender, positions, problem)
        evaluate = kernel.gradient if contender.gradient else kernel.ppte
        before = time.time()
        evaluate(variants)
        end = time.time()
        own = kernel.problem if contender.kind == "jaxgear" and not contender.helix_angle else None
        connection.send(Start(end - begin, end - before, versions, own))
        while True:
            request, argument = connection.recv()
            if request == "results":
                ppte = kernel.ppte(argument)
                connection.send((ppte, kernel.gradient(argument) if contender.gradient else None))
            elif request == "rate":
                connection.send(_rate(evaluate, variants, argument))
            else:
                # Linux counts in KiB, macOS in bytes
                unit = 2**20 if sys.platform == "darwin" else 2**10
                connection.send(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit)
    except EOFError:
        pass
    except Exception as error:
        connection.send(error)


def _rate(evaluate, variants: np.ndarray, seconds: float) -> tuple[float, float]:
    # the processor time of all threads does not count what other programs take from this one
    calls, begin, busy = 0, time.perf_counter(), time.process_time()
    while True:
        evaluate(variants)
        calls += 1
        elapsed = time.perf_counter() - begin
        if elapsed >= seconds:
            count = calls * len(variants)
            return count / elapsed, count / (time.process_time() - busy)


def _make(contender: Contender, positions: int, problem: Problem | None):
    """The kernel and the versions of what it runs on; imports only what it needs."""
    versions = {"Python": sys.version.split()[0], "NumPy": np.__version__}
    if contender.kind == "jaxgear":
        os.environ["JAX_PLATFORMS"] = "cpu"
        import jax
        import jaxlib

        jax.config.update("jax_enable_x64", contender.precision == "float64")
        jax.config.update("jax_num_cpu_devices", contender.threads)
        # a cold start is that of a user who has never run this before
        jax.config.update("jax_enable_compilation_cache", False)
        from .baselines.jax_kernel import JaxKernel

        kernel = JaxKernel(
            positions=positions,
            slices=contender.slices,
            batch=contender.batch,
            gradient=contender.gradient,
            coupled=contender.coupled,
            helix_angle=contender.helix_angle,
        )
        return kernel, versions | {"JAX": jax.__version__, "jaxlib": jaxlib.__version__}
    if contender.kind == "C":
        from .baselines.c_kernel import CKernel, compiler_version

        return CKernel(problem, threads=contender.threads), {"C compiler": compiler_version()}
    if contender.kind == "NumPy":
        from .baselines.numpy_kernel import NumpyKernel

        return NumpyKernel(problem, batch=contender.batch), versions
    import scipy

    from .baselines.scipy_kernel import ScipyKernel

    return ScipyKernel(problem), versions | {"SciPy": scipy.__version__}
