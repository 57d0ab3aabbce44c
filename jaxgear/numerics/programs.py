"""Compiled functions, which a command keeps for the next process or compiles in a fraction of the time.

`eqx.filter_jit` traces, lowers and compiles a function once per process, which takes seconds; JAX's own cache spares
the last of the three. A `ProgramStore` keeps what comes out at the end, by what it was made of: the next process loads
it.
"""

import enum
import functools
import io
import os
import pickle
import types
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, NamedTuple, ParamSpec, Protocol, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.experimental.serialize_executable import deserialize_and_load, serialize
from jax.extend.core import get_opaque_trace_state
from jaxtyping import PyTree

_Given = ParamSpec("_Given")
_Found = TypeVar("_Found")

# XLA without its optimizations and without the slower one of its code generators, where a version has two
OPTIONS: dict[str, Any] = {"xla_backend_optimization_level": 0, "xla_cpu_use_fusion_emitters": False}
# XLA with the optimizations that `jax_disable_most_optimizations` takes away
_ALL: dict[str, Any] = {"xla_backend_optimization_level": 3, "xla_llvm_disable_expensive_passes": False}

_everything = False


def compile_quickly() -> None:
    """Compile every program of this process quickly from now on, unless the user has set compiler options.

    For a process whose longest programs, too, take longer to compile than to run: they are compiled in a third of the
    time and run for 1.5 times as long.
    """
    global _everything
    if quick_options() is not None:
        _everything = True
        jax.config.update("jax_disable_most_optimizations", True)  # for operations outside of programs


def quick_jit(function: Callable[_Given, _Found], *, always: bool = True) -> Callable[_Given, _Found]:
    """Compile a function as `jax.jit` does, in a fraction of the time and without XLA's optimizations.

    For functions that run a few times, such as a gradient through `prepare`: their programs take a thousand times
    longer to compile than to run. Arrays and Python numbers (int, float, complex) are traced, so that another number
    compiles nothing anew; everything else (bools, strings, functions) is static, as in `equinox.filter_jit`.

    Within `jax.jit`, `jax.vmap` or `jax.grad` the function becomes part of the outer program, with all optimizations.

    Args:
        function: pure function of pytrees, positional and keyword arguments.
        always: False for a function that runs for longer than it compiles: it is optimized, unless the command line
            has asked for quick compilation of everything.

    Returns:
        the compiled function.
    """
    run = _jitted(function, always)

    @functools.wraps(function)
    def of_numbers(*args: _Given.args, **options: _Given.kwargs) -> _Found:
        args, options = jax.tree.map(_as_array, (args, options))
        return run(*args, **options)

    return of_numbers


def _as_array(leaf: Any) -> Any:
    """Python or NumPy number as an array of the type that `jax.jit` gives it; other values unchanged."""
    return jnp.asarray(leaf) if type(leaf) in (int, float, complex) or isinstance(leaf, np.generic) else leaf


def _jitted(function: Callable[_Given, _Found], always: bool | None) -> Callable[_Given, _Found]:
    """`eqx.filter_jit` with the options of `quick_jit`: Python numbers are static; None compiles never quickly."""
    full = eqx.filter_jit(function)

    @functools.cache
    def by_options() -> Callable[_Given, _Found]:
        options_of_jax: dict[str, Any] = {"compiler_options": _options(always)}
        return eqx.filter_jit(function, **options_of_jax)

    @functools.wraps(function)
    def run(*args: _Given.args, **options: _Given.kwargs) -> _Found:
        return (by_options() if _options(always) is not None and is_eager() else full)(*args, **options)

    return run


def _options(always: bool | None) -> dict[str, Any] | None:
    """Options of the compiler by the option given to `quick_jit`; None for its defaults."""
    if always is None:
        return _ALL if _everything else None
    return quick_options() if always or _everything else None


@functools.cache
def quick_options() -> dict[str, Any] | None:
    """Options for JAX's compiler that its version supports; None if the user has set compiler flags."""
    given = os.environ.get("XLA_FLAGS", "")
    if jax.default_backend() != "cpu" or any(option in given for option in OPTIONS):
        return None
    return supported_options(OPTIONS)


def supported_options(options: dict[str, Any]) -> dict[str, Any]:
    """Options that the compiler supports; it would refuse programs with an unsupported one."""
    if _compiles(options):
        return options
    return {name: value for name, value in options.items() if _compiles({name: value})}


def _compiles(options: dict[str, Any]) -> bool:
    try:
        jax.jit(lambda: 0.0).lower().compile(options)
    except jax.errors.JaxRuntimeError:
        return False
    return True


def is_eager() -> bool:
    """True if nothing is being traced: compiler options apply to whole programs only."""
    return bool(get_opaque_trace_state() == _untraced())


@functools.cache
def _untraced():
    """Trace state of a new thread, in which nothing is traced."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(get_opaque_trace_state).result()


_Run = Callable[..., Sequence[jax.Array]]

# Packages whose functions and classes a program may be made of: with their versions they are what their names say.
_KNOWN = (
    __name__.partition(".")[0],
    "jax",
    "jaxlib",
    "equinox",
    "numpy",
    "builtins",
    "functools",
    "operator",
    "collections",
)


# what pickle raises for something that cannot be written
_UNFIT = (pickle.PicklingError, AttributeError, TypeError, ValueError)


class Shelf(Protocol):
    """Where programs lie between two processes."""

    def read(self, made_of: bytes) -> bytes | None:
        """A program by what it is made of, as far as that differs from call to call."""

    def write(self, made_of: bytes, program: bytes) -> None:
        """Keeps a program."""


class _Shape(NamedTuple):
    """Stand-in for an array with known shape and type but unknown numbers."""

    shape: tuple[int, ...]
    dtype: str
    weak: bool = False
    shared: jax.sharding.Sharding | None = None  # among several devices

    @property
    def struct(self) -> jax.ShapeDtypeStruct:
        return jax.ShapeDtypeStruct(self.shape, self.dtype, weak_type=self.weak, sharding=self.shared)


class _Program(NamedTuple):
    """A function for arrays of some shapes.

    Attributes:
        run: makes a list of arrays from arrays.
        result: result of the function, with a `_Shape` in place of every array.
    """

    run: Future[_Run]
    result: Any

    def __call__(self, arrays: Sequence[jax.Array]) -> Any:
        return _filled(self.result, self.run.result()(*arrays))


class ProgramStore:
    """Compiled programs by their inputs and code; compiles in threads of its own.

    Args:
        shelf: store of the programs between two processes.
        threads: that compile.
    """

    def __init__(self, shelf: Shelf, threads: int = 2) -> None:
        self._shelf, self._pool = shelf, ThreadPoolExecutor(threads, "compiler")
        self._programs: dict[Any, _Program] = {}

    def program(
        self, function: Callable[..., Any], arguments: PyTree, *, quick: bool | None
    ) -> tuple[_Program, list[Any]] | None:
        """The program of a function for some arguments, and the arrays among them; None where JAX traces them."""
        leaves, tree = jax.tree.flatten(arguments)
        if any(map(_is_left_to_jax, leaves)) or not is_eager() or jax.process_count() > 1:
            return None
        fixed = [_shape_of(leaf) or leaf for leaf in leaves]
        precision = jax.dtypes.canonicalize_dtype(float)  # which a context can change
        key = function, tree, precision, tuple((type(leaf), leaf) for leaf in fixed)
        try:
            known = self._programs.get(key)
        except TypeError:  # something that cannot be told from others
            return None
        if known is None:
            known = self._programs[key] = self._made(
                function, jax.tree.unflatten(tree, fixed), str(precision), _options(quick)
            )
        return known, [leaf for leaf, shape in zip(leaves, fixed) if isinstance(shape, _Shape)]

    def _made(
        self, function: Callable[..., Any], arguments: Any, precision: str, options: dict[str, Any] | None
    ) -> _Program:
        made_of = _recipe((function, arguments, precision, options))
        kept = None if made_of is None else self._shelf.read(made_of)
        if kept is not None:
            _register()
            result, code = pickle.loads(kept)

            def loaded() -> _Run:
                try:
                    return _loaded(code, _devices(arguments))
                except Exception:  # noqa: BLE001 - whatever the runtime has against it, it is compiled again
                    return _lowered(function, arguments)[0].compile(options)

            return _Program(self._pool.submit(loaded), result)
        lowered, result = _lowered(function, arguments)

        def compiled() -> _Run:
            run = lowered.compile(options)
            kept = None if made_of is None else _packed(run, result)
            if made_of is not None and kept is not None:
                self._shelf.write(made_of, kept)
            return run

        return _Program(self._pool.submit(compiled), result)


_store: ProgramStore | None = None


def keep(store: ProgramStore | None) -> None:
    """From now on the programs of this process come from a store; None for no store any more."""
    global _store
    _store = store


def kernel(function: Callable[_Given, _Found], *, often: bool = False) -> Callable[_Given, _Found]:
    """`eqx.filter_jit`, for a function that runs for longer than it compiles; kept where a store is in use.

    Args:
        function: pure function of pytrees.
        often: True for a function that runs so often that it is optimized even where everything is compiled quickly.
    """
    return _compiled(function, quick=None if often else False)


def program(function: Callable[_Given, _Found]) -> Callable[_Given, _Found]:
    """`quick_jit`, for a function that compiles for longer than it runs; kept where a store is in use.

    What joins two programs is one too: its operations would be compiled one by one in every process.
    """
    return _compiled(function, quick=True)


def _compiled(function: Callable[_Given, _Found], *, quick: bool | None) -> Callable[_Given, _Found]:
    jitted = _jitted(function, always=quick)

    @functools.wraps(function)
    def run(*args: _Given.args, **options: _Given.kwargs) -> _Found:
        found = None if _store is None else _store.program(function, (args, options), quick=quick)
        if found is None:
            return jitted(*args, **options)
        made, arrays = found
        return made(arrays)

    run._quick = quick  # type: ignore[attr-defined]
    return run


def begin(function: Callable[..., Any], *args: PyTree, **options: PyTree) -> PyTree | None:
    """Starts to compile a `program` or `kernel` for arguments of these shapes, where a store is in use.

    Returns:
        what it will return, with a `jax.ShapeDtypeStruct` in place of every array; None where there is no store.
    """
    made: Any = function
    found = None if _store is None else _store.program(made.__wrapped__, (args, options), quick=made._quick)
    if found is None:
        return None
    result = found[0].result
    return _filled(result, [shape.struct for shape in jax.tree.leaves(result, is_leaf=_is_shape) if _is_shape(shape)])


class _Kind(enum.Enum):
    """Treatment of a class of arguments by a store."""

    TRACED = enum.auto()
    OF_JAX = enum.auto()
    WITH_SHAPE = enum.auto()
    OTHER = enum.auto()


@functools.cache  # every call of a program asks of every argument, and classes of JAX take long to tell
def _kind_of(cls: type) -> _Kind:
    if issubclass(cls, jax.core.Tracer):
        return _Kind.TRACED
    if issubclass(cls, jax.Array):
        return _Kind.OF_JAX
    return _Kind.WITH_SHAPE if issubclass(cls, np.ndarray | np.generic | jax.ShapeDtypeStruct) else _Kind.OTHER


@functools.cache
def _name_of(dtype) -> str:
    return str(dtype)


@functools.cache
def _is_extended(dtype) -> bool:
    return jnp.issubdtype(dtype, jax.dtypes.extended)


def _is_left_to_jax(leaf) -> bool:
    """True if an argument is traced or cannot be written to a file, such as a random key."""
    kind = _kind_of(leaf.__class__)
    return kind is _Kind.TRACED or (kind is _Kind.OF_JAX and _is_extended(leaf.dtype))


def _shape_of(leaf) -> _Shape | None:
    """Shape and type of an array; None for everything else."""
    kind = _kind_of(leaf.__class__)
    if kind is _Kind.OTHER:
        return None
    shared = leaf.sharding if kind is _Kind.OF_JAX and leaf.sharding.num_devices > 1 else None
    return _Shape(leaf.shape, _name_of(leaf.dtype), getattr(leaf, "weak_type", False), shared)


def _is_shape(leaf) -> bool:
    return isinstance(leaf, _Shape)


def _filled(tree: Any, arrays: Iterable[Any]) -> Any:
    """A tree with arrays in the places of their shapes."""
    left = iter(arrays)
    return jax.tree.map(lambda leaf: next(left) if _is_shape(leaf) else leaf, tree, is_leaf=_is_shape)


def _lowered(function: Callable[..., Any], arguments: Any) -> tuple[jax.stages.Lowered, Any]:
    """Function of arrays only, lowered for compilation, and the structure of its result."""
    shapes = [leaf.struct for leaf in jax.tree.leaves(arguments, is_leaf=_is_shape) if _is_shape(leaf)]
    results = []

    def of_arrays(*arrays):
        args, options = _filled(arguments, arrays)
        found, tree = jax.tree.flatten(function(*args, **options))
        results.append(jax.tree.unflatten(tree, [_shape_of(leaf) or leaf for leaf in found]))
        return [leaf for leaf in found if _shape_of(leaf)]

    of_arrays.__name__ = of_arrays.__qualname__ = function.__name__
    lowered = jax.jit(of_arrays).lower(*shapes)
    return lowered, results[-1]


def _packed(run, result: Any) -> bytes | None:
    """A compiled program as bytes; None where that cannot be."""
    try:
        return pickle.dumps((result, serialize(run)))
    except (*_UNFIT, NotImplementedError):  # what JAX raises for programs that hold large constants
        return None


@functools.cache
def _register() -> None:
    """Register LAPACK kernels, which JAX does on lowering: a program loaded from a file would lack them."""
    jax.jit(jax.lax.linalg.lu).lower(jax.ShapeDtypeStruct((1, 1), "float32"))


def _devices(arguments: Any) -> list[jax.Device]:
    """Devices on which a program for these arguments runs."""
    shapes = filter(_is_shape, jax.tree.leaves(arguments, is_leaf=_is_shape))
    shared = {shape.shared for shape in shapes} - {None}
    return jax.local_devices() if shared else jax.local_devices()[:1]


def _loaded(code: tuple[bytes, Any, Any], devices: list[jax.Device]) -> _Run:
    program, given, found = code
    return deserialize_and_load(program, given, found, execution_devices=devices)


class _Recipe(pickle.Pickler):
    """Pickler of a comparable description of a program: functions by name and enclosed values.

    Equal objects are written alike, whether they are one object or two, which differs from process to process.
    """

    def __init__(self, file: io.BytesIO) -> None:
        super().__init__(file)
        self.fast = True  # no references to what was written before

    def persistent_id(self, obj: object) -> tuple[object, ...] | None:
        if isinstance(obj, jax.sharding.Sharding | jax.sharding.Mesh):
            return "devices", repr(obj)
        if not isinstance(obj, type | types.FunctionType):
            return None
        if obj.__module__.partition(".")[0] not in _KNOWN:
            raise pickle.PicklingError(f"{obj.__module__} is not a package whose version is recorded")
        if isinstance(obj, type):
            return "class", obj.__module__, obj.__qualname__
        enclosed = [cell.cell_contents for cell in obj.__closure__ or ()]
        return "function", obj.__module__, obj.__qualname__, obj.__code__.co_firstlineno, enclosed, obj.__defaults__


def _recipe(made_of: Any) -> bytes | None:
    """Description of the code and inputs of a program as bytes; None if they cannot be written."""
    written = io.BytesIO()
    try:
        _Recipe(written).dump(made_of)
    except (*_UNFIT, RecursionError):
        return None
    return written.getvalue()
