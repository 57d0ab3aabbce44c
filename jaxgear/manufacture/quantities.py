"""What grinding asks, in the vocabulary of quantities: objectives, limits, columns of sweeps."""

import jax.numpy as jnp

from ..contact import MeshCycle, Side
from ..metrics import Quantity, gear_volume, quantities
from ..microgeometry import NoModification
from ..numerics.reductions import Max
from .spline import wheel_spline
from .volume import ground_area, relative_volume

_DEGREES = {2: "quadratic", 3: "cubic"}


def _of_gear(index: int, function):
    """A function of a gear's side and modification as one of a cycle."""

    def of(cycle: MeshCycle):
        modification = (cycle.pinion, cycle.wheel)[index]
        return function(cycle.sides[index], NoModification() if modification is None else modification)

    return of


def _deviation(degree):
    return lambda side, modification: jnp.abs(wheel_spline(side, modification, degree=degree).deviation)


def _area(side: Side, _):
    return ground_area(side)


def _relative(parabolic: bool):
    return lambda side, modification: relative_volume(side, modification, parabolic=parabolic)


for _index, _gear in enumerate(("pinion", "wheel")):
    quantities.add(
        *(
            Quantity(
                f"{_gear}_{_name}_deviation",
                _of_gear(_index, _deviation(_degree)),
                "um",
                f"of the flank from the best wheel of involute and {_name} polynomial, {_gear}",
                Max(),
            )
            for _degree, _name in _DEGREES.items()
        ),
        Quantity(
            f"{_gear}_ground_area", _of_gear(_index, _area), "mm2", f"area of the flanks that are ground, {_gear}"
        ),
        Quantity(f"{_gear}_removed_volume", _of_gear(_index, gear_volume), "mm3", f"material ground off, {_gear}"),
        *(
            Quantity(
                f"{_gear}_volume_over_{_name}",
                _of_gear(_index, _relative(_parabolic)),
                "",
                f"removed volume per that of a {_name} relief from the pitch point, {_gear}",
            )
            for _parabolic, _name in ((False, "linear"), (True, "parabolic"))
        ),
        package=__package__,
    )
