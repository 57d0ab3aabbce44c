"""PPTE with hand-written C: `kernel.c` and `law.h`, compiled on the fly for this machine and called through ctypes."""

import ctypes
import os
import shutil
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from .law import APEX_DISTANCE, deflection
from .problem import Problem, two_candidates

_SOURCE = Path(__file__).with_name("kernel.c")
_LANES = 8
# MAX_BLOCKS and MAX_SLICES of kernel.c
_MOST = 64
# and its PEAK, the largest line load of a slice over a uniform one
_PEAK = 3
# From the most to the least that a compiler may understand; the fast mathematics lets it use vector logarithms.
_FLAGS = (
    ["-O3", "-march=native", "-ffast-math", "-mprefer-vector-width=512"],
    ["-O3", "-mcpu=native", "-ffast-math"],
    ["-O3"],
)
# ln((1 + sqrt(1 + x)) / 2) and 1 / (1 + sqrt(1 + x)) in powers of x
_LOG_SERIES = np.array([0, 1 / 4, -3 / 32, 5 / 96, -35 / 1024])
_INVERSE_SERIES = np.array([1 / 2, -1 / 8, 1 / 16, -5 / 128, 7 / 256])
# largest x at which the terms left out stay below 1e-9 um at 100 N/mm
_SERIES_REACH = 0.03


def find_compiler() -> str | None:
    """A C compiler on the path, `$CC` first."""
    names = [os.environ.get("CC", ""), "cc", "gcc", "clang"]
    return next((found for name in names if name and (found := shutil.which(name))), None)


def compiler_version() -> str:
    """First line of what the compiler says about itself."""
    answer = subprocess.run([str(find_compiler()), "--version"], capture_output=True, text=True)
    return answer.stdout.splitlines()[0]


class CKernel:
    """Two pairs that can touch at every position; every thread takes an equal part of the variants."""

    def __init__(self, problem: Problem, *, threads: int = 1):
        """Compiles the kernel.

        Raises:
            RuntimeError: without a C compiler.
            ValueError: for more positions or slices than the kernel has room for, or contacts so wide that the series
                does not converge.
        """
        if max(problem.corner_gap.shape[-1] / _LANES, len(problem.slice_width)) > _MOST:
            raise ValueError(f"CKernel: more than {_MOST * _LANES} positions or {_MOST} slices")
        self._positions = problem.corner_gap.shape[-1]
        self._crowning = np.ascontiguousarray(problem.crowning)
        self._table = _table(two_candidates(problem))
        self._library = compiled(_SOURCE)
        if self._library.block_rows() != self._table.shape[1]:
            raise RuntimeError("kernel.c and c_kernel.py disagree about the table")
        self._threads = threads
        self._pool = ThreadPoolExecutor(threads) if threads > 1 else None

    def ppte(self, variants: np.ndarray) -> np.ndarray:
        """Peak-to-peak transmission error [um], shape (variants,)."""
        return self._evaluate(variants, None)

    def gradient(self, variants: np.ndarray) -> np.ndarray:
        """Derivatives of PPTE by the four parameters, shape (variants, 4)."""
        gradient = np.empty((len(variants), 4))
        self._evaluate(variants, gradient)
        return gradient

    def _evaluate(self, variants, gradient):
        variants = np.ascontiguousarray(variants, dtype=float)
        ppte = np.empty(len(variants))

        def part(begin, end):
            slope = None if gradient is None else pointer(gradient[begin:end])
            # ctypes releases Python's lock during the call
            self._library.evaluate(
                pointer(self._table),
                self._positions,
                len(self._crowning),
                pointer(self._crowning),
                pointer(variants[begin:end]),
                ctypes.c_long(end - begin),
                pointer(ppte[begin:end]),
                slope,
            )

        edges = np.linspace(0, len(variants), self._threads + 1).astype(int)
        list((self._pool.map if self._pool else map)(part, edges[:-1], edges[1:]))
        return ppte


def pointer(array: np.ndarray):
    """The numbers of a contiguous array of doubles for C."""
    return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


def compiled(source: Path) -> ctypes.CDLL:
    """The functions of a C file, compiled for this machine.

    Raises:
        RuntimeError: without a C compiler, or where it does not understand the file.
    """
    compiler = find_compiler()
    if compiler is None:
        raise RuntimeError("no C compiler found")
    with tempfile.TemporaryDirectory() as folder:
        unit, library = Path(folder, "kernel.o"), Path(folder, "kernel.so")
        for flags in _FLAGS:
            command = [compiler, *flags, "-std=gnu11", "-fPIC", "-c", str(source), "-o", str(unit)]
            if subprocess.run(command, capture_output=True).returncode == 0:
                break
        else:
            raise RuntimeError(f"{compiler} does not compile {source.name}")
        # linked without fast mathematics, which would switch denormal numbers off in the whole process
        subprocess.run([compiler, "-shared", str(unit), "-o", str(library), "-lm"], check=True, capture_output=True)
        return ctypes.CDLL(str(library))


def _table(problem: Problem) -> np.ndarray:
    """Rows of the struct `Block` for every block of positions, shape (blocks, rows, lanes)."""
    law, lever, load = problem.law, problem.lever, problem.full_load
    largest = _PEAK * load if len(problem.slice_width) > 1 else load
    positions = lever.shape[-1]
    coupling = problem.structure[0, 1]
    own = np.stack([problem.structure[0, 0], problem.structure[1, 1]])
    alone, half = (own * share * load + deflection(law, share * load)[0] for share in (1.0, 0.5))
    half = half + 0.5 * coupling * load[::-1]
    series, logarithm = _flank_series(problem, own, largest)
    rows = [
        problem.corner_gap / lever,
        1 / lever,
        load,
        coupling / lever,
        alone / lever,
        half / lever,
        *(series / lever),
        logarithm / lever,
        law.width_factor,
        1e3 * law.truncation / lever,
        law.distance,
        1e3 * law.wedge / lever,
        (2 * law.reach / APEX_DISTANCE) ** 4,
        *problem.beyond_tip.reshape(-1, 2, positions),
        (law.distance < np.sqrt(1.01 * law.width_factor * largest)).astype(float),
        *problem.beyond_tip.max(axis=1),
    ]
    # the last position fills up the last block
    padded = np.pad(np.stack(rows, axis=1), ((0, 0), (0, 0), (0, -positions % _LANES)), mode="edge")
    blocks = padded.reshape(2, len(rows), -1, _LANES)
    per_block = slice(len(rows) - 3, None)
    blocks[:, per_block] = blocks[:, per_block].max(axis=-1, keepdims=True)
    return np.ascontiguousarray(blocks.transpose(2, 0, 1, 3).reshape(blocks.shape[2], -1, _LANES))


def _flank_series(problem: Problem, own: np.ndarray, largest: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Deflection per line load s without the corner: sum series[n] s^n - logarithm ln(s).

    The half width a is small against the depth h, so that both roots of the depth-referenced law are power series in
    x = (a / h)^2.
    """
    law = problem.law
    x = law.width_factor / law.depth**2
    if (x * largest).max() > _SERIES_REACH:
        raise ValueError("CKernel: the contact is too wide for the power series of the law")
    series = np.zeros((len(_LOG_SERIES), *own.shape))
    for compliance, poisson, ratio in zip(law.compliance, law.poisson, x):
        for n, (log_term, inverse_term) in enumerate(zip(_LOG_SERIES, _INVERSE_SERIES)):
            series[n] += compliance * (log_term - poisson * inverse_term) * ratio**n
    # ln of the depth over the half width, 2 h / a, at unit load
    series[0] += own + np.sum(law.compliance * np.log(2 / np.sqrt(x)), axis=0)
    return series, 0.5 * law.compliance.sum(axis=0)
