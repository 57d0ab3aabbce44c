"""Settings of wear: revolutions, wear coefficients, limits; and the quantities of wear."""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..conditions import LoadSpectrum
from ..contact import Mesh
from ..contact.operating_point import Torque
from ..dynamics import Dynamics
from ..metrics import AbstractSettings
from ..microgeometry import AbstractModification
from ..numerics import Callback, Numbers, count, number
from .case import LARGEST_COEFFICIENT
from .history import BLOCKS, Keep, WearHistory, check_blocks, wear
from .vibration import LineLoad, check_line_load

Scalar = Float[Array, ""]


class Wear(AbstractSettings):
    """Settings of wear: revolutions, wear coefficients, limits, and the load that wears the flanks.

    `quantity` returns the quantities of worn flanks, `WEAR_QUANTITIES`. With `loads` the loads of that spectrum wear
    one flank together, independent of the load of the mesh cycle. Without `loads`, every load of a spectrum and every
    manufactured pair has its own wear history; a measure then joins the values of all cases. Use `Worst()` under a
    spectrum: it is the value of a pair that runs at one of the loads, while a mean mixes different flanks.

    A quantity is NaN where a contact has not converged, and where the blocks are so long that flanks overshoot: the
    error of the depth, estimated by `wear_depth_error`, exceeds a tenth of the depth, or a block wears off more than
    twice the deflection of the new teeth. Long blocks do not make `wear_depth_error` itself NaN. The integrator uses
    the number of steps of the dynamics, or 256.

    Attributes:
        revolutions: total revolutions of the pinion.
        coefficient: wear coefficient of the pinion, and of the wheel if `wheel_coefficient` is None: from 1e-18 for
            good films to 5e-16 for mild wear in mixed lubrication.
        wheel_coefficient: wear coefficient of the wheel; None for the wear coefficient of the pinion.
        blocks: even number of blocks of equal length, each a contact analysis and a step of wear.
        largest_increment: limit of the wear depth per block of a `history`, used instead of `blocks` and exceeded by a
            tenth at most; None for blocks of equal length. Quantities always use `blocks`.
        points: number of grid points along each flank; None for one and a half times the positions, from 33 to 97.
        depth_limit: wear depth at which the life ends, for `life_to_depth`.
        ppte_limit: peak-to-peak transmission error at which the life ends, for `life_to_ppte`.
        line_load: line load that wears the flanks: "static", or "dynamic" for the line load of the steady motion at the
            speed of the load; None for "dynamic" with dynamics, "static" without.
        dynamics: masses and damping of the vibration, whose speeds are not used; None for no vibration.
        loads: load spectrum that wears one flank, its weights shares of the revolutions; None for the load of the
            cycle.
    """

    table = "wear"
    revolutions: Scalar = number("revolutions", low=0.0, open_low=True)
    coefficient: Scalar = number("m2/N", low=0.0, high=LARGEST_COEFFICIENT)
    wheel_coefficient: Scalar | None = number("m2/N", low=0.0, high=LARGEST_COEFFICIENT, optional=True, default=None)
    blocks: int = count(low=2, high=100_000, default=BLOCKS)
    largest_increment: Scalar | None = number("um", low=0.0, open_low=True, optional=True, default=None)
    points: int | None = count(low=3, high=10_000, optional=True, default=None)
    depth_limit: Scalar | None = number("um", low=0.0, open_low=True, optional=True, default=None)
    ppte_limit: Scalar | None = number("um", low=0.0, open_low=True, optional=True, default=None)

    line_load: LineLoad | None = None
    dynamics: Dynamics | None = None
    loads: LoadSpectrum | None = None

    def check_together(self) -> None:
        check_blocks(self.blocks)
        check_line_load(self.line_load, self.dynamics)

    @property
    def coefficients(self) -> Float[Array, " gears"]:
        """Wear coefficients of pinion and wheel [m2/N], shape (gears,)."""
        wheel = self.coefficient if self.wheel_coefficient is None else self.wheel_coefficient
        return jnp.stack([self.coefficient, wheel])

    def history(
        self,
        mesh: Mesh,
        torque: Torque | None = None,
        *,
        pinion: AbstractModification | None = None,
        wheel: AbstractModification | None = None,
        deviation: Numbers | None = None,
        keep: Keep | None = None,
        callback: Callback | None = None,
    ) -> WearHistory:
        """Wear history of a design by these settings; see `wear` for arguments and errors.

        Args:
            mesh: prepared mesh.
            torque: torque on the pinion [N m], or an `OperatingPoint`; None if the settings have loads.
            pinion, wheel: modifications of the new flanks.
            deviation: material removed by manufacturing deviations [um], in addition to the modifications.
            keep, callback: as for `wear`.

        Raises:
            ValueError: if both a torque and loads are given, or neither.
        """
        if (torque is None) == (self.loads is None):
            raise ValueError("Wear: give a torque where there are no loads, and none where there are")
        loads = self.loads if torque is None else torque
        assert loads is not None
        options: dict[str, Any] = {"coefficient": self.coefficients, "blocks": self.blocks, "points": self.points}
        options |= {"dynamics": self.dynamics, "line_load": self.line_load}
        options |= {"largest_increment": self.largest_increment, "keep": keep, "callback": callback}
        flanks: dict[str, Any] = {"pinion": pinion, "wheel": wheel, "deviation": deviation}
        return wear(mesh, loads, self.revolutions, **flanks, **options)
