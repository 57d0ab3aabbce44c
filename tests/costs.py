"""Where the time of the tests goes: `pytest --costs` tells it file by file, and what was compiled more than once.

Tracing, lowering, compiling, the cache and drawing are known by their own durations: what one of them does within
another one counts once, for the inner one. What is left of a test is running. Seconds are those of the clock, in all
processes together; "processor" is what these, and the processes they started, used of the processor.
"""

import functools
import hashlib
import os
import threading
import time
from collections import Counter, defaultdict
from typing import NamedTuple

import jax
from jax._src import compilation_cache, compiler  # no public name tells one program from another

KINDS = "tracing", "lowering", "compiling", "cache", "drawing"
_EVENTS = {
    "/jax/core/compile/jaxpr_trace_duration": "tracing",
    "/jax/core/compile/jaxpr_to_mlir_module_duration": "lowering",
    "/jax/core/compile/backend_compile_duration": "compiling",
}
_BEFORE, _AFTER = "imports, collection", "(end)"
_MOST = 40  # programs in the list of those that took the longest to compile
_FILES = 6  # that are named for each of them


class Program(NamedTuple):
    """A program that a process needed.

    Attributes:
        file: of the test that needed it.
        mark: the same for equal programs, whatever their names.
        seconds: until it was there, without tracing and lowering.
        kept: whether it was compiled before, by another process or an earlier run.
    """

    name: str
    file: str
    mark: str
    seconds: float
    kept: bool


class Costs:
    """Plugin that listens in its process; the first process adds up what all have heard."""

    def __init__(self, config):
        self.output = getattr(config, "workeroutput", None)
        self._waits = config.pluginmanager.has_plugin("dsession")  # while others test
        self.files: dict[str, Counter] = defaultdict(Counter)
        self.programs: list[Program] = []
        self._file, self._began, self._used = _BEFORE, time.perf_counter(), _processor()
        self._within, self._kept = threading.local(), False
        self._listen()

    def _listen(self):
        from matplotlib.figure import Figure

        jax.monitoring.register_event_duration_secs_listener(self._heard)
        jax.monitoring.register_event_listener(self._noticed)
        for owner, name, kind in (
            (compilation_cache, "get_executable_and_time", "cache"),
            (compilation_cache, "put_executable_and_time", "cache"),
            (Figure, "savefig", "drawing"),
        ):
            setattr(owner, name, self._timed(getattr(owner, name), kind))
        compiler.compile_or_get_cached = self._told_apart(compiler.compile_or_get_cached)

    def _heard(self, event, seconds, **_):
        if event in _EVENTS:
            self._ended(_EVENTS[event], seconds)

    def _noticed(self, event, **_):
        self._kept |= event == "/jax/compilation_cache/cache_hits"

    def _ended(self, kind, seconds):
        """Counts what has just ended, less what ended within it."""
        began, own = time.perf_counter() - seconds, seconds
        ended = self._within.__dict__.setdefault("ended", [])
        while ended and ended[-1][0] >= began:
            own -= ended.pop()[1]
        ended.append((began, seconds))
        self.files[self._file][kind] += own

    def _timed(self, function, kind):
        @functools.wraps(function)
        def run(*args, **options):
            began = time.perf_counter()
            try:
                return function(*args, **options)
            finally:
                self._ended(kind, time.perf_counter() - began)

        return run

    def _told_apart(self, function):
        @functools.wraps(function)
        def run(backend, computation, *args, **options):
            name = computation.operation.attributes["sym_name"].value
            mark = hashlib.sha256(str(computation).replace(name, "").encode()).hexdigest()
            self._kept, began = False, time.perf_counter()
            found = function(backend, computation, *args, **options)
            self.programs.append(Program(name, self._file, mark, time.perf_counter() - began, self._kept))
            return found

        return run

    def _turn_to(self, file):
        """From now on, what is heard belongs to another file."""
        now, used, found = time.perf_counter(), _processor(), self.files[self._file]
        found["clock"] += 0.0 if self._waits else now - self._began
        found["processor"] += used - self._used
        self._file, self._began, self._used = file, now, used

    def pytest_runtest_logstart(self, nodeid):
        if (file := nodeid.partition("::")[0]) != self._file and not self._waits:
            self._turn_to(file)

    def pytest_sessionfinish(self):
        self._turn_to(_AFTER)
        if self.output is not None:
            # execnet sends plain types alone
            files = {name: dict(found) for name, found in self.files.items()}
            self.output["costs"] = files, [*map(tuple, self.programs)]

    def pytest_testnodedown(self, node):
        files, programs = node.workeroutput.get("costs", ({}, ()))
        for file, found in files.items():
            self.files[file].update(found)
        self.programs += (Program(*each) for each in programs)

    def pytest_terminal_summary(self, terminalreporter):
        terminalreporter.section("where the time went, s")
        for line in (*table(self.files), "", *compiled(self.programs)):
            terminalreporter.write_line(line)


def table(files):
    """Lines of a table over the files, those that used the processor longest first."""
    columns = *KINDS, "running", "clock", "processor"
    yield f"{'':40}" + "".join(f"{name:>10}" for name in columns)
    total = sum(files.values(), Counter())
    for name, found in (("all", total), *sorted(files.items(), key=lambda each: -each[1]["processor"])):
        running = max(found["clock"] - sum(found[kind] for kind in KINDS), 0.0)  # other threads compile beside it
        yield f"{name:40}" + "".join(f"{running if c == 'running' else found[c]:10.1f}" for c in columns)


def compiled(programs):
    """Lines on the programs that were compiled: how many, how many of them again, which took the longest."""
    made = [each for each in programs if not each.kept]
    first = {each.mark: each for each in reversed(made)}
    again = sum(each.seconds for each in made) - sum(each.seconds for each in first.values())
    yield f"{len(made)} programs compiled, {len(programs) - len(made)} found in the cache"
    yield f"{len(made) - len(first)} of them were compiled by another process before, in {again:.1f} s"
    named = defaultdict(list)
    for each in made:
        named[each.name].append(each)
    for name, group in sorted(named.items(), key=lambda each: -sum(one.seconds for one in each[1]))[:_MOST]:
        different = len({each.mark for each in group})
        files = Counter()
        for each in group:
            files[each.file.removeprefix("tests/test_").removesuffix(".py")] += each.seconds
        most = ", ".join(f"{file} {seconds:.1f}" for file, seconds in files.most_common(_FILES))
        total = sum(files.values())
        yield f"{total:8.1f} s  {len(group):5} times, {different:5} different  {name:24} {most}"


def _processor():
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system
