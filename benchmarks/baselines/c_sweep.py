"""Steady states over speed with hand-written C: `sweep.c`, compiled on the fly and called through ctypes."""

import ctypes
from pathlib import Path

import numpy as np

from .c_kernel import compiled, pointer
from .vibration import Vibration

_SOURCE = Path(__file__).with_name("sweep.c")
_Numbers = ctypes.POINTER(ctypes.c_double)


class _Model(ctypes.Structure):
    _fields_ = [
        ("levels", ctypes.c_long),
        *((name, ctypes.c_double) for name in ("reach", "mass", "damping", "load")),
        *((name, _Numbers) for name in ("start", "force", "rise")),
    ]


class CSweep:
    """One design; the force is tabulated at the places that the steps of a cycle meet, as jaxgear does."""

    def __init__(self, vibration: Vibration, steps: int):
        """Compiles the kernel; steps is the largest number of them in a cycle.

        Raises:
            RuntimeError: without a C compiler.
        """
        self._library = compiled(_SOURCE)
        self._steps, self._load = steps, vibration.load
        self._kept = [np.ascontiguousarray(part) for part in vibration.places(2 * steps)]
        numbers = vibration.reach, vibration.mass, vibration.damping, vibration.load
        self._model = _Model(vibration.force.shape[-1], *numbers, *(pointer(part) for part in self._kept))

    def settle(self, frequency: float, state, cycles: int) -> np.ndarray:
        """State after some mesh cycles: dte [um] and its rate [um/s]."""
        state = np.array(state, float)
        self._library.settle(
            ctypes.byref(self._model), ctypes.c_double(frequency), ctypes.c_long(self._steps), ctypes.c_long(cycles),
            pointer(state),
        )  # fmt: skip
        return state

    def sweep(self, frequencies, steps, state, *, tolerance: float, most_cycles: int) -> np.ndarray:
        """K_v, rms of the DTE [um] and mesh cycles integrated, negative where it did not settle, of every speed.

        Shape (speeds, 3), in the order in which the speeds are given and gone through. The steps per cycle, one for
        each speed, divide the largest number of them.
        """
        frequencies, state = np.array(frequencies, float), np.array(state, float)
        counts = np.array(steps, ctypes.c_long)
        numbers = np.empty((len(frequencies), 3))
        self._library.sweep(
            ctypes.byref(self._model), ctypes.c_long(len(frequencies)), pointer(frequencies),
            counts.ctypes.data_as(ctypes.POINTER(ctypes.c_long)), ctypes.c_long(self._steps),
            ctypes.c_double(tolerance), ctypes.c_long(most_cycles), pointer(state), pointer(numbers),
        )  # fmt: skip
        numbers[:, 0] /= self._load
        return numbers
