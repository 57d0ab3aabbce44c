"""A free flank replaced by a named curve, and what that costs."""

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy

from ..conditions import solve_case
from ..contact import MeshCycle, Side
from ..metrics import peak_to_peak, removed_at
from ..microgeometry import (
    AbstractCurve,
    AbstractModification,
    Linear,
    ParabolicLinear,
    Polynomial,
    Power,
    TipRelief,
)
from ..numerics import program, real
from .result import Optimum

_SAMPLES = 201  # points of the fit, from the pitch point to the tip
_LENGTHS = (0.3, 0.5, 0.7, 0.9)  # of the relief, relative to the addendum, from which the fits start
_LEAST_LENGTH = 0.02

# Shape parameters of a curve: how to make it, where the fit starts, and its bounds. Polynomials keep their amount in
# their coefficients.
_Shape = tuple[Callable[..., AbstractCurve], tuple[float, ...], tuple[float, ...], tuple[float, ...]]
CURVES: Mapping[str, _Shape] = MappingProxyType(
    {
        "linear": (Linear, (), (), ()),
        "power": (Power, (1.5,), (0.3,), (6.0,)),
        "parabolic_linear": (ParabolicLinear, (0.5,), (0.01,), (1.0,)),
        "quadratic": (lambda b: Polynomial(jnp.stack([0.0 * b, b, 1 - b])), (0.5,), (-6.0,), (6.0,)),
        "cubic": (
            lambda b, c: Polynomial(jnp.stack([0.0 * b, b, c, 1 - b - c])),
            (0.5, 0.5),
            (-12.0, -12.0),
            (12.0, 12.0),
        ),
    }
)


class Projection(eqx.Module):
    """Flanks of a named curve in place of others.

    Attributes:
        curve: its name.
        pinion, wheel: tip reliefs.
        cycle: mesh cycle with them, under the torque of the original.
        ppte: peak-to-peak transmission error [um].
        loss: by how much it is larger than that of the original flanks [um].
        misfit: largest distance from the original flanks, from the pitch points to the tips [um].
    """

    curve: str = eqx.field(static=True)
    pinion: TipRelief
    wheel: TipRelief
    cycle: MeshCycle
    ppte: float
    loss: float
    misfit: float

    def __str__(self) -> str:
        lines = [f"{self.curve}: PPTE {self.ppte:.3f} um, {self.loss:+.3f} um; misfit {self.misfit:.2f} um"]
        for name, relief in (("pinion", self.pinion), ("wheel", self.wheel)):
            lines.append(f"  {name} {float(relief.amount):.2f} um over {float(relief.length):.2f} mm")
        return "\n".join(lines)


def project(optimum: Optimum, curve: str = "power") -> Projection:
    """Fits a tip relief of a named curve to each flank of an optimum, by least squares from the pitch point to the tip.

    This is what grinding and drawings need of a free-form or iterated flank: an amount, a length and a form. The fit
    minimizes the distance of the flanks, not the PPTE: `minimize` with the same curve finds a better one.

    Args:
        optimum: of `free_form` or `iterate_transmission_error`.
        curve: "linear", "power", "parabolic_linear", "quadratic" or "cubic".

    Raises:
        ValueError: for an unknown curve.
    """
    if curve not in CURVES:
        raise ValueError(f'project: curve = "{curve}" is not known, must be one of {", ".join(CURVES)}')
    mesh, torque = optimum.mesh, optimum.cycle.operating_point
    fits = [_fit(side, flank, curve) for side, flank in zip(mesh.sides, (optimum.pinion, optimum.wheel))]
    pinion, wheel = (relief for relief, _ in fits)
    cycle = solve_case(mesh, torque, pinion, wheel)
    ppte = float(peak_to_peak(cycle.transmission_error))
    misfit = max(distance for _, distance in fits)
    return Projection(curve, pinion, wheel, cycle, ppte, ppte - optimum.ppte, misfit)


def _fit(side: Side, modification: AbstractModification, curve: str):
    """The best relief of one gear, and its largest distance from the flank."""
    _, first, low, high = CURVES[curve]
    roll = jnp.linspace(side.pitch_roll_length, side.tip_roll_length, _SAMPLES)
    addendum = float(roll[-1] - roll[0])
    flank = removed_at(side, modification, roll)
    most = max(float(flank.max()), 1e-3)

    def residual(values, of=_distance):
        return np.asarray(of(jnp.asarray(values), side, flank, roll, curve)) / most

    bounds = [0.0, _LEAST_LENGTH * addendum, *low], [3 * most, addendum, *high]
    starts = [[most, share * addendum, *first] for share in _LENGTHS]
    fits = [
        scipy.optimize.least_squares(residual, values, jac=partial(residual, of=_slope), bounds=bounds)
        for values in starts
    ]
    best = min(fits, key=lambda fit: fit.cost)
    return _relief(jnp.asarray(best.x), curve), float(np.abs(best.fun).max()) * most


def _relief(values, curve: str) -> TipRelief:
    amount, length, *shape = values
    return TipRelief(real(amount), real(length), CURVES[curve][0](*shape))


@program
def _distance(values, side: Side, flank, roll, curve: str):
    return removed_at(side, _relief(values, curve), roll) - flank


_slope = program(jax.jacfwd(_distance))
