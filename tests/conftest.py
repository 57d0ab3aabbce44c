"""Settings of every test: double precision, no silent promotion of dtypes or ranks, annotated shapes checked, compiled
functions kept on disk, and a garbage collector that does not look through everything all the time."""

import contextlib
import ctypes
import functools
import gc
import os
import threading
import uuid
import zlib
from pathlib import Path

import jax
import pytest
import typechecker
from jax._src import compilation_cache
from jax._src.interpreters import mlir
from jax._src.lru_cache import LRUCache

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_dtype_promotion", "strict")
jax.config.update("jax_numpy_rank_promotion", "raise")
# Most of the time of a test goes into compiling a program that runs once: without optimization that takes a quarter.
jax.config.update("jax_disable_most_optimizations", True)
# No test asks which lines of which files an operation of a program comes from, which takes a twentieth of the time.
jax.config.update("jax_traceback_in_locations_limit", 0)


MOST_KEPT = 1 << 30  # bytes of compiled programs, of which one run needs a tenth
# Compilers take and free memory all the time: workers keep it (of the GNU library) in place of asking the system again,
# which takes a sixth less of the system's time. `_forget` gives it back.
ALLOCATOR = {"MALLOC_TRIM_THRESHOLD_": "2000000000", "MALLOC_MMAP_THRESHOLD_": "1000000000"}
OPTIMIZATION = "xla_backend_optimization_level"
# These two passes over loops take an eighth of the time of compiling, and what they find gains a test nothing.
PASSES = "while-loop-constant-sinking,while-loop-invariant-code-motion"


def pytest_addoption(parser):
    parser.addoption("--costs", action="store_true", help="tell where the time of the tests goes")
    parser.addoption("--part", type=_part, metavar="I/N", help="of the files with chosen tests each Nth, from I on")


def _part(text: str) -> tuple[int, int]:
    first, _, every = text.partition("/")
    part = int(first), int(every)
    if not 0 <= part[0] < part[1]:
        raise ValueError(text)
    return part


def pytest_configure(config):
    """Before anything else imports jaxgear. Slow tests run without checks of annotations, as what users run."""
    if config.option.markexpr != "slow":
        typechecker.install()
    if "PYTEST_XDIST_WORKER" not in os.environ:
        _before_the_workers()


def _before_the_workers():
    """What they find when they start: room in the cache, and the quicker of two code generators, where there are two.

    To split a program among threads costs work, and gains nothing where every core has a worker.
    """
    from jaxgear.numerics import durable, programs

    with contextlib.suppress(OSError):
        durable.forget_the_oldest(Path(jax.config.jax_compilation_cache_dir), MOST_KEPT)
    for name, value in ALLOCATOR.items():
        os.environ.setdefault(name, value)
    if "XLA_FLAGS" not in os.environ:
        wanted = {**programs.OPTIONS, "xla_cpu_parallel_codegen_split_count": 1, "xla_disable_hlo_passes": PASSES}
        del wanted[OPTIMIZATION]  # the configuration says it, which a test can change
        flags = (f"--{name}={str(value).lower()}" for name, value in programs.supported_options(wanted).items())
        os.environ["XLA_FLAGS"] = " ".join(flags)


@pytest.hookimpl(trylast=True)
def pytest_sessionstart(session):
    if session.config.option.costs:
        from costs import Costs  # of which a run without it knows nothing

        session.config.pluginmanager.register(Costs(session.config))


# Files of tests that take the longest come first: at the end, one of them would keep a single worker busy. Those that
# need the same programs are far from each other, since two workers would compile them at the same time.
LONGEST = (
    "examples guides reproductions layout_command slice_widths cli wear_command face_coupling dynamic_wear tolerance "
    "finite_element_compliance face_widths wear dynamics_command speed_sweep layout mesh_cycle optimize helical"
).split()


@pytest.hookimpl(trylast=True)  # after the marks have chosen
def pytest_collection_modifyitems(config, items):
    places = {f"test_{name}": place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: places.get(item.path.stem, len(places)))
    if config.option.part:
        first, every = config.option.part
        files = list(dict.fromkeys(item.path for item in items))[first::every]
        config.hook.pytest_deselected(items=[item for item in items if item.path not in files])
        items[:] = (item for item in items if item.path in files)


# Collections of the oldest objects took a fifth of the time of tracing: a trace makes many objects, and each collection
# looks through the imported modules and the collected tests again. Larger thresholds make them rare (the defaults are
# 700, 10 and 10 in Python 3.11), and what is there before the first test is left out.
RARELY = (50_000, 20, 10)


def pytest_collection_finish(session):
    gc.collect()
    gc.freeze()
    gc.set_threshold(*RARELY)


def _compilation_cache() -> Path:
    """A folder of this user only, since what is in it gets executed, for all workers of this and of later runs."""
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    folder = Path(base) / "jaxgear" / "tests"
    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    folder.chmod(0o700)
    return folder


def _put_whole(self, key, value):
    """In place of `LRUCache.put`, which lets other workers read what it is still writing."""
    path = self.path / f"{key}-cache"
    if not path.exists():
        temporary = path.with_name(f".{uuid.uuid4().hex}.tmp")
        temporary.write_bytes(value)
        temporary.replace(path)


class _QuickZlib:
    """In place of `zlib` in JAX's cache, where no better one is installed: a third of the time, a little larger."""

    compress, decompress = staticmethod(functools.partial(zlib.compress, level=1)), staticmethod(zlib.decompress)


try:
    jax.config.update("jax_compilation_cache_dir", str(_compilation_cache()))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)
    jax.config.update("jax_persistent_cache_enable_xla_caches", "none")  # they make an entry one of its folder
    LRUCache.put = _put_whole
    compilation_cache.zlib = _QuickZlib
except OSError:  # a read-only home: the tests run all the same, only slower
    pass


class _Context(threading.local):
    """In place of `mlir.make_ir_context`: one context for the programs that a thread lowers, not one for each.

    To make one takes half of the time of lowering a small program, of which tests have thousands. What a context has
    been told stays in it, so that a new one takes its place now and then.
    """

    MOST = 500  # programs
    made, programs, make = None, 0, staticmethod(mlir.make_ir_context)

    def __call__(self):
        if self.made is None or self.programs >= self.MOST:
            self.made, self.programs = self.make(), 0
        self.programs += 1
        return self.made


mlir.make_ir_context = _Context()


# Each compiled program holds some 20 mappings of memory, of which Linux grants a process 65530, and memory, of which
# all workers, a browser and the processes of a test have to share what a machine has. A worker may hold the smaller
# size on any machine, and up to the larger one, with which two workers trace nothing twice, as long as all of them hold
# no more than a half of it; what one file adds, less than 2 GiB, comes on top.
MOST_MAPPINGS = 50_000
MOST_MEMORY = 3 << 30, 7 << 30  # bytes


@pytest.fixture(scope="module", autouse=True)
def _forget_compiled_programs():
    """Drops what files of tests compiled once it is much: the system refuses a process that holds too many programs."""
    yield
    _make_room()


@pytest.fixture
def room():
    """For tests that compile as much as other files do: what was compiled before them goes once it is much."""
    _make_room()


def _make_room():
    if _holds_much():
        _forget()


def _holds_much() -> bool:
    """Whether this process holds more than it should; true where the system does not say."""
    process = Path("/proc/self")
    try:
        pages = int((process / "statm").read_text().split()[1])
        mappings = (process / "maps").read_bytes().count(b"\n")
    except OSError:
        return True
    page, (least, most) = os.sysconf("SC_PAGE_SIZE"), MOST_MEMORY
    share = os.sysconf("SC_PHYS_PAGES") * page // (2 * int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", 1)))
    return mappings > MOST_MAPPINGS or pages * page > min(max(least, share), most)


def _forget():
    jax.clear_caches()
    gc.collect()  # programs in reference cycles too
    with contextlib.suppress(OSError, AttributeError):  # the memory too, which the GNU library would keep
        ctypes.CDLL("libc.so.6").malloc_trim(0)


@pytest.fixture
def nothing_compiled():
    """For tests that count traces or replace what is traced: no program of another test, and none for another one."""
    _forget()
    yield
    _forget()


@pytest.fixture
def optimized(nothing_compiled):
    """For slow tests of what users run: programs with all optimizations of the compiler."""
    jax.config.update("jax_disable_most_optimizations", False)
    yield
    jax.config.update("jax_disable_most_optimizations", True)


@pytest.fixture
def no_cache(monkeypatch):
    """Commands leave the compilation cache of the tests alone."""
    monkeypatch.setenv("JAXGEAR_NO_CACHE", "1")


@pytest.fixture
def file(tmp_path):
    """Writes the text of a design file and gives its path."""

    def written(text):
        path = tmp_path / "pair.toml"
        path.write_text(text)
        return path

    return written


@pytest.fixture
def clean_figures():
    """Closes the figures of a test, which must not have changed anybody's settings."""
    import matplotlib
    import matplotlib.pyplot as plt

    before = dict(matplotlib.rcParams)
    yield
    plt.close("all")
    assert dict(matplotlib.rcParams) == before


@pytest.fixture(scope="module")
def mesh():
    """The 19/48 pair at a coarse resolution, where a file has no mesh of its own."""
    from catalogue import gear_pair, prepare

    return prepare(gear_pair())


@pytest.fixture(scope="session")
def solved():
    """The coupled reference cases of the catalogue, each solved once with its own torque: {name: (case, cycle)}."""
    from catalogue import FINITE_ELEMENT_CASES, prepare, solve

    return {case.name: (case, solve(prepare(case.pair()), case.torque)) for case in FINITE_ELEMENT_CASES}
