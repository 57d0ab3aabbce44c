"""Build mesh, loads and modifications from the values of the variables of a problem."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.extend.core import ClosedJaxpr
from jax.interpreters.partial_eval import dce_jaxpr
from jaxtyping import Array, Bool, Float

from ..contact import Mesh, MeshCycle, removed_material, solve_removed
from ..contact.operating_point import Torque, operating_point_of
from ..contact.slide import nominal_material
from ..contact.solve import flanks_of
from ..contact.status import Status, Statuses, status_of
from ..microgeometry import AbstractModification, NoModification
from ..numerics import Checked, program, real, within_limits
from ..tolerance import ManufacturedGears
from .cases import Cases, Conditions, Loads, LoadSpectrum, conditions

Scalar = Float[Array, ""]
Parameters = Mapping[str, Scalar]
Modifications = tuple[AbstractModification | None, AbstractModification | None]
Design = Callable[[Parameters], Modifications]

Result = TypeVar("Result")


class Variant(NamedTuple):
    """One design with its mesh and loads.

    Attributes:
        mesh: prepared mesh.
        cases: loads and manufactured gears on the mesh.
        pinion, wheel: modifications.
        status: `Status.OUT_OF_VALIDITY` if a number computed from the variables is out of the range of its field.
    """

    mesh: Mesh
    cases: Cases
    pinion: AbstractModification
    wheel: AbstractModification
    status: Statuses


class Variants(Checked):
    """Flanks, pair and load of a problem as functions of its named variables.

    A variable is passed to every function that names it: to the flanks (`design`), the pair (a `mesh` that is a
    function), the load (a `torque` that is one). Anything else is the same for all variants and is computed once.

    Attributes:
        names: names of the variables.
        design: function that returns (pinion, wheel) modifications from the named variables.
        mesh: prepared mesh, or a function that prepares one from the named variables.
        torque: function of the named variables that returns a torque on the pinion [N m] or an `OperatingPoint`; None
            for the load of the conditions.
        conditions: loads and manufactured gears; its load is used if `torque` is None.
        cases: cases on a mesh common to all variants, else None.
    """

    names: tuple[str, ...] = eqx.field(static=True)
    design: Design
    mesh: Mesh | Callable[[Parameters], Mesh]
    torque: Callable[[Parameters], Any] | None
    conditions: Conditions
    cases: Cases | None

    def __call__(self, values: Iterable) -> Variant:
        """Variant for values of the variables, in the order of their names; traceable."""
        parameters = dict(zip(self.names, values))
        pinion, wheel = two_modifications(call_with("design", self.design, parameters))
        mesh, cases = self.mesh, self.cases
        made: list[Any] = [pinion, wheel]
        if not isinstance(mesh, Mesh):
            mesh = call_with("mesh", mesh, parameters)
            made.append(mesh.pair)
        if cases is None:
            conditions = self.conditions
            if self.torque is not None:
                operating_point = operating_point_of(
                    call_with("torque", self.torque, parameters), mesh.slice_width.dtype
                )
                made.append(operating_point)
                conditions = Conditions(LoadSpectrum.of(operating_point), conditions.deviations)
            cases = conditions.on(mesh)
        # Modules refuse concrete numbers out of range when they are made; traced ones pass
        possible = within_limits(eqx.filter(made, lambda leaf: isinstance(leaf, jax.core.Tracer)))
        return Variant(mesh, cases, pinion, wheel, status_of({Status.OUT_OF_VALIDITY: ~possible}))

    def mesh_shape(self, values: Iterable) -> Mesh:
        """Mesh common to all variants, or the shapes of the mesh if every variant has its own."""
        if isinstance(self.mesh, Mesh):
            return self.mesh
        parameters = dict(zip(self.names, map(real, values)))
        return eqx.filter_eval_shape(partial(call_with, "mesh", self.mesh), parameters)

    def traced(self, values: Iterable) -> ClosedJaxpr:
        """Jaxpr of mesh, load and modifications as functions of the variables, to identify the functions.

        Raises:
            ValueError: for variables without effect.
        """

        def made(values, mesh):
            whole = self if mesh is None else eqx.tree_at(lambda tree: tree.mesh, self, mesh)
            variant = whole(values)
            first = variant.cases.first
            both = flanks_of(variant.mesh, variant.pinion, variant.wheel)
            # where the contacts slide to takes longer to trace
            removed = nominal_material(variant.mesh, first.torque, *both)
            own = None if mesh is not None else (variant.mesh, variant.cases)
            return removed, first, eqx.filter(own, eqx.is_array)

        mesh = self.mesh if isinstance(self.mesh, Mesh) else None
        closed, _, _ = eqx.filter_make_jaxpr(made)(tuple(values), mesh)
        _, used = dce_jaxpr(closed.jaxpr, [True] * len(closed.jaxpr.outvars))
        if unused := [f'"{name}"' for name, is_used in zip(self.names, used) if not is_used]:
            raise ValueError(f"nothing depends on {', '.join(unused)}: use it in design, or leave it out")
        return closed


def variants(
    mesh: Mesh | Callable[[Parameters], Mesh],
    torque: Loads | Callable[[Parameters], Torque],
    design: Design,
    *,
    names: Sequence[str],
    values: Sequence[Any] | np.ndarray | Array,
    manufactured: ManufacturedGears | None = None,
) -> Variants:
    """Variants of a mesh and a load, checked.

    Args:
        mesh: prepared mesh, or a function of the named variables that prepares one; traced.
        torque: torque on the pinion [N m], an `OperatingPoint` or a `LoadSpectrum`; or a function of the named
            variables that gives a torque or an operating point.
        design: makes (pinion, wheel) modifications from the named variables.
        names: names of the variables.
        values: example values of the variables, with which the functions are checked.
        manufactured: manufactured gears, see `conditions`.

    Raises:
        ValueError: for all errors of the functions and of `conditions`.
    """
    parameters = {name: real(value) for name, value in zip(names, values)}
    # shapes only: the example may be a variant that cannot be
    example = mesh if isinstance(mesh, Mesh) else eqx.filter_eval_shape(partial(call_with, "mesh", mesh), parameters)
    if not isinstance(example, Mesh):
        raise ValueError(f"mesh gives {type(example).__name__}, must be a Mesh as `prepare` makes it")
    judged = conditions(example, 0.0 if callable(torque) else torque, manufactured)
    fixed = isinstance(mesh, Mesh) and not callable(torque)
    return Variants(
        names=tuple(names),
        design=design,
        mesh=mesh,
        torque=torque if callable(torque) else None,
        conditions=judged,
        cases=judged.on(example) if fixed else None,
    )


def call_with(name: str, function: Callable[[Parameters], Result], parameters: Parameters) -> Result:
    """Call a function of the named variables.

    Args:
        name: name of the function, for messages.
        function: traceable.
        parameters: values by the names of the variables.

    Raises:
        ValueError: if it uses a variable that does not exist.
        TypeError: if it needs the value of a traced number.
    """
    try:
        return function(parameters)
    except KeyError as error:
        missing = error.args[0] if error.args else None
        if not isinstance(missing, str) or missing in parameters:
            raise
        known = ", ".join(parameters)
        raise ValueError(f'{name}: asks for "{missing}", which is not a variable, must be one of {known}') from error
    except jax.errors.ConcretizationTypeError as error:
        raise TypeError(
            f"{name}: needs the value of a variable (by if, and, or, not, min, max, float or int), but variables are "
            "traced: use jax.numpy.where, minimum or maximum, and no other kind of modification"
        ) from error


def two_modifications(made: object) -> tuple[AbstractModification, AbstractModification]:
    """Modifications (pinion, wheel) returned by a design, with nominal involutes for None.

    Raises:
        ValueError: for anything but two modifications.
    """
    if not (isinstance(made, tuple | list) and len(made) == 2):
        what = f"{len(made)} values" if isinstance(made, tuple | list) else f"one {type(made).__name__}"
        raise ValueError(f"design: gives {what}, must give two modifications, (pinion, wheel); None for an involute")
    for name, modification in zip(("pinion", "wheel"), made):
        if not (modification is None or isinstance(modification, AbstractModification)):
            kind = type(modification).__name__
            raise ValueError(f"design: the {name} is of type {kind}, must be a modification or None for an involute")
    pinion, wheel = made
    return pinion or NoModification(), wheel or NoModification()


def solve_case(
    mesh: Mesh,
    torque: Torque,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
    deviation: Array | float | None = None,
) -> MeshCycle:
    """Mesh cycle of a design, by one compiled program for all kinds of modifications.

    Args:
        mesh: prepared mesh.
        torque: torque on the pinion [N m], shape (); or an `OperatingPoint`.
        pinion, wheel: modifications; None for nominal involutes.
        deviation: material removed by manufacturing deviations [um], in addition to the modifications, shape (pairs,
            slices, positions) or (); None for nominal gears.
    """
    pinion, wheel = pinion or NoModification(), wheel or NoModification()
    removed = removed_material(mesh, torque, pinion=pinion, wheel=wheel)
    removed = removed if deviation is None else removed + deviation
    return solve_removed(mesh, torque, removed, pinion=pinion, wheel=wheel)


def cycle_status(cycle: MeshCycle) -> Statuses:
    """Status of a cycle over all its positions, shape (*cycles,) of its leading axes.

    The transmission error has to be finite too: reductions of the backend can drop NaN.
    """
    return _over_positions(cycle.transmission_error, cycle.status)


def solved(cycle: MeshCycle) -> Bool[Array, "*cycles"]:
    """True if `cycle_status` is `Status.CONVERGED`."""
    return _converged(cycle_status(cycle))


@program
def _over_positions(transmission_error: Float[Array, "*cycles positions"], status: Statuses) -> Statuses:
    infinite = ~jnp.isfinite(jnp.sum(transmission_error, axis=-1))
    return status_of({Status.NOT_CONVERGED: infinite}, jnp.max(status, axis=-1))


@program
def _converged(status: Statuses) -> Bool[Array, "*cycles"]:
    return status == Status.CONVERGED
