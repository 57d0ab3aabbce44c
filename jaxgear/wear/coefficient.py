"""Coefficients of wear: a number for each gear, or a function of the state of lubrication."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import MeshCycle, OperatingPoint
from ..metrics.flash import flash_temperature
from ..numerics import check, real

Field = Float[Array, "#gears #pairs #slices #positions"]
_GEARS = 2

# Lubricated steel has 1e-18 to 5e-16 m2/N, see `wear`; two hundred times the upper end is no such gear any more, and a
# larger number most often one in mm2/N, which is 1e6 times as large.
LARGEST_COEFFICIENT = 1e-13


class Constant(eqx.Module):
    """A coefficient of each gear [m2/N], shape (gears, 1, 1, 1)."""

    value: Field

    def __call__(self, cycle: MeshCycle) -> Field:
        return self.value


class OfLubrication(eqx.Module):
    """A function of pressure [MPa], sliding speed [m/s] and flash temperature [K] at every contact that is loaded."""

    of: Callable[..., Any]

    def __call__(self, cycle: MeshCycle) -> Field:
        kinematics, speed = cycle.kinematics, cycle.operating_point.speed
        assert speed is not None  # `wear_law` has asked for it
        friction = {} if cycle.operating_point.friction is None else {"friction": cycle.operating_point.friction}
        contact = kinematics.path_of_contact
        sliding = contact.sliding_speed(jnp.clip(kinematics.path, contact.start, contact.end), speed)
        pressure = cycle.contact_pressure + cycle.corner_pressure
        shape = cycle.line_load.shape
        given = (
            pressure,
            jnp.broadcast_to(jnp.abs(sliding)[:, None], shape),
            flash_temperature(cycle, speed, **friction),
        )
        # without load nothing wears, and the slope of a power of no pressure may be infinite
        loaded = cycle.line_load > 0
        found = self.of(*(jnp.where(loaded, field, 1.0) for field in given))
        both = found if isinstance(found, tuple | list) else (found, found)
        if len(both) != _GEARS:
            raise ValueError(f"wear: coefficient gives {len(both)} values, must give one or a pair: pinion, wheel")
        fields = [jnp.asarray(field, pressure.dtype) for field in both]
        for field in fields:
            if jnp.broadcast_shapes(field.shape, shape) != shape:
                raise ValueError(f"wear: coefficient gives an array of shape {field.shape}, must be {shape}")
        return jnp.where(loaded, jnp.stack([jnp.broadcast_to(field, shape) for field in fields]), 0.0)


def wear_law(coefficient: Any, loads: OperatingPoint, dtype) -> Constant | OfLubrication:
    """What gives the coefficient of both gears at every contact of a cycle, (gears, pairs, slices, positions).

    Raises:
        ValueError: for negative coefficients, more than two, and a function where the loads have no speed.
    """
    if callable(coefficient):
        if loads.speed is None:
            raise ValueError("wear: coefficient is a function, which needs a speed: give OperatingPoint(torque, speed)")
        return OfLubrication(coefficient)
    values = real(coefficient).astype(dtype)
    if values.shape not in ((), (_GEARS,)):
        raise ValueError(f"wear: coefficient has shape {values.shape}, must be one number or a pair: pinion, wheel")
    check("wear", "coefficient", values, "m2/N", low=0.0, high=LARGEST_COEFFICIENT)
    return Constant(jnp.broadcast_to(values, (_GEARS,))[:, None, None, None])
