"""Quantities of a design, differentiated only at the mesh positions that determine them.

A peak-to-peak value depends on two positions, a largest pressure on one. The contact at a position does not depend on
other positions: the value of such a quantity needs all positions, its derivatives need a few.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple, overload

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..conditions import solved
from ..contact import Mesh, MeshCycle, OperatingPoint, solve
from ..contact.mesh import at_position
from ..contact.operating_point import Torque, operating_point_of
from ..contact.solve import check_mesh, flanks_of, known_at, solve_known
from ..metrics import AbstractSettings, Analysis, Quantity, share_settings
from ..microgeometry import AbstractModification
from ..numerics.programs import is_eager
from ..vocabulary import quantity_of

Scalar = Float[Array, ""]
One = str | Quantity | Callable[[MeshCycle], Any]
Several = list[One] | tuple[One, ...]


class _Given(NamedTuple):
    """Inputs of one analysis: mesh, operating point, flanks, settings."""

    mesh: Mesh
    operating_point: OperatingPoint
    pinion: AbstractModification
    wheel: AbstractModification
    settings: tuple[AbstractSettings, ...]

    def analysis(self) -> Analysis:
        """Solve the contact and return its analysis."""
        cycle = solve(self.mesh, self.operating_point, pinion=self.pinion, wheel=self.wheel)
        return Analysis(cycle, self.mesh, self.settings)


@overload
def evaluate(
    mesh: Mesh,
    torque: Torque,
    quantities: One,
    *,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
) -> Scalar: ...


@overload
def evaluate(
    mesh: Mesh,
    torque: Torque,
    quantities: Several,
    *,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
) -> tuple[Scalar, ...]: ...


def evaluate(
    mesh: Mesh,
    torque: Torque,
    quantities: One | Several,
    *,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
) -> Scalar | tuple[Scalar, ...]:
    """Quantities of one design under one torque, with fast derivatives.

    Values and derivatives of any order, in either mode, equal those of the quantities of `solve`. If all quantities are
    extremes over the positions, or a difference of two extremes such as PPTE, only the positions of the extremes are
    differentiated: value and gradient of PPTE take half the time of `solve`.

        slope = jax.grad(lambda amount: evaluate(mesh, 50.0, "ppte", pinion=jg.TipRelief(amount, 4.0)))(7.0)

    Args:
        mesh: prepared mesh.
        torque: torque on the pinion [N m], shape (); or an `OperatingPoint`.
        quantities: name, `Quantity` or function of a mesh cycle; or a list of them.
        pinion: modification of the pinion flank; None for the nominal involute.
        wheel: modification of the wheel flank; None for the nominal involute.

    Returns:
        the value in the unit of the quantity, shape (), or a tuple of values; NaN if the contact has not converged at
        every position. As in `solve`, no pairs are added to the mesh while tracing.

    Raises:
        TypeError, ValueError: errors of `solve`; for a quantity that is unknown or lacks its settings, and for an empty
            list.
    """
    check_mesh(mesh)
    several = quantities if isinstance(quantities, list | tuple) else [quantities]
    if not several:
        raise ValueError("quantities is empty, give at least one")
    wanted, settings = share_settings([quantity_of(each) for each in several])
    operating_point = operating_point_of(torque, mesh.slice_width.dtype)
    given = _Given(mesh, operating_point, *flanks_of(mesh, pinion, wheel), settings)
    if is_eager() or not all(each.local and _pieces(each) for each in wanted):
        numbers = _numbers(wanted, given)
    else:
        numbers = _of_extremes(wanted, given._replace(mesh=replace(mesh, automatic=False)))
    return numbers if several is quantities else numbers[0]


def _pieces(of: Quantity) -> tuple[int, float, float] | None:
    """Sign of a quantity and factors of its largest and smallest value; None if it needs all values."""
    both = ((sign, of.reduction.factors(sign)) for sign in (1, -1))
    return next(((sign, *factors) for sign, factors in both if factors is not None), None)


def _numbers(wanted: tuple[Quantity, ...], given: _Given) -> tuple[Scalar, ...]:
    analysis = given.analysis()
    fine = solved(analysis.cycle)
    return tuple(jnp.where(fine, of(analysis), jnp.nan) for of in wanted)


@eqx.filter_custom_jvp
def _of_extremes(wanted: tuple[Quantity, ...], given: _Given) -> tuple[Scalar, ...]:
    return _numbers(wanted, given)


@_of_extremes.def_jvp
def _of_extremes_jvp(primals: tuple[Any, ...], tangents: tuple[Any, ...]) -> tuple[Any, Any]:
    (wanted, given), (_, along) = primals, tangents
    analysis = given.analysis()
    fine, count = solved(analysis.cycle), given.mesh.resolution.positions
    numbers, shares, entries = [], [], []
    for of in wanted:
        values = of.values(analysis).ravel()
        numbers.append(jnp.where(fine, of.reduction(values), jnp.nan))
        sign, above, below = _pieces(of) or (1, 0.0, 0.0)
        if above:
            shares.append((of, sign * above))
            entries.append(jnp.argmax(above * values))
        if below:
            shares.append((of, -sign * below))
            entries.append(jnp.argmin(below * values))

    def at(entry: Array, given: _Given) -> Array:
        mesh, known = at_position(given.mesh, entry % count), known_at(analysis.cycle, entry % count)
        cycle = solve_known(mesh, given.operating_point, known, given.pinion, given.wheel)
        there = Analysis(cycle, mesh, given.settings)
        return jnp.stack([of.values(there).ravel()[entry // count] for of in wanted])

    def decided(given: _Given) -> tuple[Scalar, ...]:
        found = jax.vmap(at, (0, None))(jnp.stack(entries), given)
        return tuple(
            sum(factor * row[number] for (of, factor), row in zip(shares, found) if of is each)
            for number, each in enumerate(wanted)
        )

    return tuple(numbers), eqx.filter_jvp(decided, (given,), (along,))[1]
