"""One process of the latency benchmark: runs a case and writes down what JAX did in it."""

import json
import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

# what JAX calls the durations that it reports (jax.monitoring)
_DURATIONS = {
    "/jax/core/compile/jaxpr_trace_duration": "trace",
    "/jax/core/compile/jaxpr_to_mlir_module_duration": "lower",
    "/jax/core/compile/backend_compile_duration": "compile",
    "/jax/compilation_cache/cache_retrieval_time_sec": "cache",
}


class Counts:
    """What JAX has reported so far: how often, and for how long [s]."""

    def __init__(self):
        self.times: Counter[str] = Counter()
        self.seconds: Counter[str] = Counter()
        self.began: float | None = None  # when it started again

    def listen(self) -> None:
        """Counts from now on."""
        import jax

        jax.monitoring.register_event_duration_secs_listener(self._add)

    def forget(self) -> None:
        """Starts again: what was needed until here is not what is asked."""
        self.times.clear()
        self.seconds.clear()
        self.began = time.perf_counter()

    def _add(self, name: str, seconds: float, **_) -> None:
        if name in _DURATIONS:
            self.times[_DURATIONS[name]] += 1
            self.seconds[_DURATIONS[name]] += seconds


counts = Counts()


def _pair(teeth: int = 19):
    import jaxgear as jg

    pinion = jg.Gear(teeth, 3.0, profile_shift=0.2, face_width=20.0, bore_diameter=24.0)
    return jg.GearPair(pinion, jg.Gear(48, 3.0, profile_shift=-0.1, face_width=20.0, bore_diameter=70.0))


def _ppte(mesh, torque: float, relief):
    import jaxgear as jg

    return float(jg.peak_to_peak(jg.solve(mesh, torque, pinion=relief, wheel=relief).transmission_error))


def solve() -> None:
    """A first result."""
    import jaxgear as jg

    _ppte(jg.prepare(_pair()), 50.0, jg.TipRelief(8.0, 5.0))


def new_numbers() -> None:
    """Another torque, amount and number of teeth, where one of each was solved."""
    import jaxgear as jg

    solve()
    counts.forget()
    _ppte(jg.prepare(_pair(23)), 70.0, jg.TipRelief(3.0, 4.0))


def new_shape() -> None:
    """Twice the positions, where some were solved."""
    import jaxgear as jg

    solve()
    counts.forget()
    _ppte(jg.prepare(_pair(), resolution=jg.Resolution(positions=128)), 50.0, jg.TipRelief(8.0, 5.0))


def own_modification() -> None:
    """A class of the user's own, where another one was solved."""
    import jax.numpy as jnp
    from jaxtyping import Array

    import jaxgear as jg
    from jaxgear.microgeometry import AbstractModification
    from jaxgear.numerics import number

    class Wave(AbstractModification):
        """A wave along the profile."""

        depth: Array = number("um")
        varies_along_face = False

        def __call__(self, flank):
            return self.depth * (1 + jnp.sin(flank.roll_length))

    solve()
    counts.forget()
    _ppte(jg.prepare(_pair()), 50.0, Wave(2.0))


def macro_gradient() -> None:
    """PPTE and its derivatives by all numbers of the gears."""
    import jax

    import jaxgear as jg

    def ppte(pair):
        mesh = jg.prepare(pair, resolution=jg.Resolution(pairs=2))
        return jg.peak_to_peak(jg.solve(mesh, 50.0).transmission_error)

    pair = _pair()
    counts.forget()
    jax.block_until_ready(jg.quick_jit(jax.value_and_grad(ppte))(pair))


SCRIPTS: dict[str, Callable[[], None]] = {
    function.__name__: function for function in (solve, new_numbers, new_shape, own_modification, macro_gradient)
}


def main(arguments: list[str]) -> None:
    """Runs `OUT.json script NAME` or `OUT.json jaxgear ARGUMENTS ...`."""
    out, kind, *rest = arguments
    code = 0
    if rest != ["--help"]:  # which comes without JAX
        counts.listen()
    try:
        if kind == "script":
            import jax

            jax.config.update("jax_enable_x64", True)
            SCRIPTS[rest[0]]()
        else:
            from jaxgear.cli import main as command

            command(rest)
    except SystemExit as end:
        code = int(end.code or 0)
    found = {"code": code, "times": counts.times, "seconds": counts.seconds}
    if counts.began is not None:
        found["wall"] = time.perf_counter() - counts.began
    Path(out).write_text(json.dumps(found), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
