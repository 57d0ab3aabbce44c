"""Results of a revolution as quantities: objectives, limits, columns of sweeps.

A quantity of a revolution needs the deviations of the teeth besides its name: `Teeth.quantity` supplies them in Python,
the table [teeth] in a design file.
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..metrics import Analysis, Quantity, Vocabulary
from ..numerics import maximum, safe_sqrt
from .orders import over_revolution, shaft_orders, side_bands, tooth_to_tooth_error, total_composite_error
from .settings import Teeth
from .solve import GearName, Revolution, solve_revolution

Scalar = Float[Array, ""]


def _rss(amplitudes: Array) -> Scalar:
    """Root of the sum of squares; the derivative at zero is zero."""
    return safe_sqrt(jnp.sum(amplitudes**2))


def _mesh_order(revolution: Revolution) -> Scalar:
    """Amplitude of the mesh order over all windows."""
    turn = 2 * jnp.pi * revolution.phase.astype(revolution.transmission_error.dtype)
    error = revolution.transmission_error
    return _rss(2 * jnp.stack([jnp.mean(error * jnp.cos(turn)), jnp.mean(error * jnp.sin(turn))]))


def _largest_share(revolution: Revolution) -> Scalar:
    share = revolution.pair_share  # of a pair of teeth, which is that of both
    return maximum(share) if share.shape[-1] else jnp.full((), jnp.nan, share.dtype)


def _of_gear(gear: GearName) -> dict[str, Callable[[Revolution], Scalar]]:
    return {
        f"{gear}_shaft_order": lambda revolution: shaft_orders(revolution, gear, 1).amplitude[0],
        f"{gear}_side_bands": lambda revolution: _rss(side_bands(revolution, gear)),
    }


# of a revolution, by the name of the quantity
OF_REVOLUTION: Mapping[str, Callable[[Revolution], Scalar]] = {
    "total_composite_error": total_composite_error,
    "tooth_to_tooth_error": tooth_to_tooth_error,
    "mesh_order": _mesh_order,
    **_of_gear("pinion"),
    **_of_gear("wheel"),
    "largest_tooth_share": _largest_share,
    "max_revolution_pressure": lambda revolution: maximum(over_revolution(revolution, "max_flank_pressure")),
}


def number_of(name: str, revolution: Revolution) -> Scalar:
    """Value of a quantity of a revolution, shape (); NaN if a contact has not converged."""
    return jnp.where(jnp.all(revolution.converged), OF_REVOLUTION[name](revolution), jnp.nan)


def _number(name: str, analysis: Analysis, teeth: Teeth) -> Scalar:
    # all quantities of the same teeth come from one revolution
    return number_of(name, analysis.once(teeth, "revolution", lambda: _revolution(analysis, teeth)))


def _revolution(analysis: Analysis, teeth: Teeth) -> Revolution:
    return solve_revolution(analysis.prepared_mesh, analysis.operating_point, teeth, **analysis.flanks)


def _quantity(name: str, unit: str, meaning: str, **options: Any) -> Quantity:
    return Quantity(name, partial(_number, name), unit, meaning, takes=Teeth, **options)


def _quantities_of(gear: GearName) -> tuple[Quantity, ...]:
    return (
        _quantity(f"{gear}_shaft_order", "um", f"transmission error once per revolution of the {gear}, amplitude"),
        _quantity(
            f"{gear}_side_bands",
            "um",
            f"side bands z +- 1 to 3 of the mesh order, {gear}, root of their squares",
        ),
    )


REVOLUTION_QUANTITIES = Vocabulary(
    (
        _quantity("total_composite_error", "um", "range of the transmission error over all teeth"),
        _quantity("tooth_to_tooth_error", "um", "largest range of the transmission error over one base pitch"),
        _quantity("mesh_order", "um", "transmission error at the mesh order over all teeth, amplitude"),
        *_quantities_of("pinion"),
        *_quantities_of("wheel"),
        _quantity(
            "largest_tooth_share", "", "load of the most loaded teeth, over their time in mesh, over the mean one"
        ),
        _quantity("max_revolution_pressure", "MPa", "largest flank pressure over all teeth", form=".0f"),
    )
)
