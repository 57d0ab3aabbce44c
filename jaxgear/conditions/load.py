"""The loads over which a design is judged."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..contact import OperatingPoint
from ..numerics import Checked, check, concrete, number, optional_real, real


class LoadSpectrum(Checked):
    """Several torques, each with the share of time or revolutions that it is run for.

    Attributes:
        torques: on the pinion, shape (torques,).
        weights: shares, which sum to 1, shape (torques,).
        speeds: of the pinion at every torque, shape (torques,); None where nothing asks for them.
        friction: mean coefficient of friction at all of them; None for the default of whatever needs it.
        duration: of all of them together, for a life; None where nothing asks for it.
    """

    torques: Float[Array, " torques"] = number("N m", low=0.0, shape=("torques",))
    weights: Float[Array, " torques"] = number("", low=0.0, shape=("torques",))
    speeds: Float[Array, " torques"] | None = number("rpm", low=0.0, shape=("torques",), optional=True)
    friction: Float[Array, ""] | None = number("", low=0.0, optional=True)
    duration: Float[Array, ""] | None = number("h", low=0.0, open_low=True, optional=True)

    def __init__(self, torques, weights=None, speeds=None, friction=None, duration=None):
        """Makes the spectrum.

        Args:
            torques: on the pinion [N m], all different unless they have speeds.
            weights: of any sum; None for equal shares.
            speeds: of the pinion [rpm], one per torque or one for all; None for none.
            friction: mean coefficient of friction; None for the default of whatever needs it.
            duration: of all loads together [h], of which the weights are shares; None for none.

        Raises:
            ValueError: for torques, weights or speeds that are negative, not finite or of different number, loads that
                are repeated, or weights that are all zero.
        """
        self.torques = real(torques)
        if self.torques.ndim != 1 or not len(self.torques):
            raise ValueError("LoadSpectrum: torques must be a list of at least one torque")
        self.speeds = None if speeds is None else self._as_many("speeds", real(speeds))
        self.friction, self.duration = optional_real(friction), optional_real(duration)
        self._check_different()
        shares = real(np.ones(self.torques.shape, self.torques.dtype)) if weights is None else real(weights)
        check("LoadSpectrum", "weights", shares, "", low=0.0)
        if shares.ndim != 1:
            raise ValueError(f"LoadSpectrum: weights must be a list of {len(self.torques)}, one per torque")
        shares = self._as_many("weights", shares)
        known = concrete(shares)
        total = jnp.sum(shares) if known is None else known.sum()
        check("LoadSpectrum", "sum of the weights", total, "", low=0.0, open_low=True)
        self.weights = shares / total if known is None else real(known / total)

    def _as_many(self, name: str, values):
        if values.ndim == 0:
            values = jnp.full_like(self.torques, values)
        if values.shape != self.torques.shape:
            raise ValueError(f"LoadSpectrum: {values.size} {name} must be as many as the {len(self.torques)} torques")
        return values

    def _check_different(self) -> None:
        given = [self.torques] if self.speeds is None else [self.torques, self.speeds]
        known = [values for values in map(concrete, given) if values is not None]
        if len(known) < len(given):
            return
        if len(np.unique(np.stack(known, axis=1), axis=0)) != len(self.torques):
            raise ValueError("LoadSpectrum: torques must be different" + ", or their speeds" * (len(given) > 1))

    @staticmethod
    def from_hours(torques, hours, speeds=None, friction=None) -> "LoadSpectrum":
        """A duty cycle: every torque with the hours that it is run for.

        Args:
            torques, speeds, friction: as for the class.
            hours: at every torque [h].

        Raises:
            ValueError: as the class does, and for hours that are all zero.
        """
        spent = real(hours)
        check("LoadSpectrum", "hours", spent, "h", low=0.0)
        if spent.ndim != 1:
            raise ValueError("LoadSpectrum: hours must be a list, one entry per torque")
        check("LoadSpectrum", "sum of the hours", jnp.sum(spent), "h", low=0.0, open_low=True)
        return LoadSpectrum(torques, spent, speeds, friction, jnp.sum(spent))

    @property
    def hours(self) -> Float[Array, " torques"] | None:
        """At every torque [h]; None without a duration."""
        return None if self.duration is None else self.weights * self.duration

    @staticmethod
    def of(operating_point: OperatingPoint) -> "LoadSpectrum":
        """A spectrum of a single load."""
        torque, speed = operating_point.torque, operating_point.speed
        return LoadSpectrum(_alone(torque), None, None if speed is None else _alone(speed), operating_point.friction)


def _alone(number):
    known = concrete(number)
    return number[None] if known is None else known[None]
