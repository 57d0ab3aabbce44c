"""Deviations of the single teeth of a gear.

Teeth are counted in the order in which they come into mesh: pair n is tooth n mod z1 of the pinion on tooth n mod z2
of the wheel. Deviations are positive for missing material, like modifications. A measuring report that counts pitches
in this order has the same sign for the pinion, and the opposite sign for the wheel, whose opposite flanks are in
contact.
"""

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from ..geometry import Gear
from ..microgeometry import AbstractModification, Flank, NoModification, Sum, terms
from ..numerics import Checked, Given, check, concrete, number, real
from ..tolerance import AbstractDistribution, ToleranceClass, TruncatedNormal

Scalar = Float[Array, ""]
Pitches = Float[Array, " teeth"]

_MOST_ORDER = 1e5
# Reports round to 0.1 um: of so many rounded pitches the sum is off by less than this times the root of their number
_ROUNDED = 0.1
_RUN_OUT = 0.9  # F_rT over F_pT, ISO 1328-1:2013, annex on run-out


class Undulation(Checked):
    """Undulation of all flanks around a gear: w = a cos(order * turn + phase), with the angle of rotation `turn`.

    Tooth n touches at the roll length rho and the face coordinate y at turn = 2 pi n / z +- (rho / r_b - 2 y tan(beta)
    / d), + for the pinion and - for the wheel, whose contacts move from tip to root. An eccentric gear has order 1; a
    gear generated with a worm wheel of l teeth has the ghost order l.

    Attributes:
        amplitude: half of the peak-to-valley value, normal to the flank.
        order: number of waves around the gear.
        phase: phase angle at tooth 0 on the base circle.
    """

    amplitude: Scalar = number("um", low=0.0)
    order: Scalar = number("", low=1.0, high=_MOST_ORDER, whole=True)
    phase: Scalar = number("deg", default=0.0)


class _Waves(AbstractModification):
    """Every `Undulation` of a gear on one tooth: sum of a cos(turns (rho - slope y) / r_b + start)."""

    amplitude: Float[Array, " waves"] = number("um", shape=("waves",))
    turns: Float[Array, " waves"] = number("", shape=("waves",))
    start: Float[Array, " waves"] = number("rad", shape=("waves",))
    slope: Scalar | None = number("", optional=True, default=None)

    @property
    def varies_along_face(self) -> bool:
        return self.slope is not None

    def __call__(self, flank: Flank) -> Float[Array, "..."]:
        rolled = flank.roll_length
        if self.slope is not None:
            rolled = rolled - self.slope * flank.face_coordinate
        rolled = (rolled / flank.base_radius)[..., None]
        amplitude, turns, start = (
            each.reshape((1,) * (rolled.ndim - 1) + (-1,)) for each in (self.amplitude, self.turns, self.start)
        )
        return jnp.sum(amplitude * jnp.cos(turns * rolled + start), axis=-1)


def _stacked(flanks: Any) -> Any:
    """A list with one modification per tooth as one modification with a leading axis."""
    if not isinstance(flanks, list | tuple):
        return flanks
    kinds: list[Any] = [
        (jax.tree.structure(flank), [jnp.shape(leaf) for leaf in jax.tree.leaves(flank)]) for flank in flanks
    ]
    for tooth, flank in enumerate(flanks):
        if not isinstance(flank, AbstractModification):
            raise TypeError(f"TeethDeviations: flanks[{tooth}] is a {type(flank).__name__}, must be a modification")
        if kinds[tooth] != kinds[0]:
            raise ValueError(
                f"TeethDeviations: flanks[{tooth}] is of another kind or shape than flanks[0], must be of the same"
            )
    return jax.tree.map(lambda *leaves: jnp.stack(leaves), *flanks) if flanks else None


class TeethDeviations(Checked):
    """Deviations of every tooth of one gear.

        eccentric = TeethDeviations(np.zeros(48), undulations=[Undulation(10.0, order=1)])
        slopes = TeethDeviations(np.zeros(48), jax.vmap(jg.ProfileSlope)(np.linspace(-3, 3, 48)))

    Attributes:
        pitch: cumulative pitch deviation F_pi of every tooth on the reference circle, shape (teeth,); its mean affects
            only the mean transmission error.
        flanks: modifications of the teeth with a leading axis (teeth,) on every array, for instance made with
            `jax.vmap`; or a list of one modification per tooth, all of the same kind and size. None for none.
        undulations: undulations around the gear.

    Raises:
        ValueError: for flanks of another number of teeth.
        TypeError: if flanks are not modifications.
    """

    pitch: Pitches = number("um", shape=("teeth",), fewest=2)
    flanks: AbstractModification | None = eqx.field(converter=_stacked, default=None)
    undulations: tuple[Undulation, ...] = eqx.field(converter=tuple, default=())

    def check_together(self) -> None:
        if self.flanks is not None and not isinstance(self.flanks, AbstractModification):
            raise TypeError(f"TeethDeviations: flanks is a {type(self.flanks).__name__}, must be a modification")
        for wave in self.undulations:
            if not isinstance(wave, Undulation):
                raise TypeError(f"TeethDeviations: undulations holds a {type(wave).__name__}, must be of Undulation")
        for leaf in jax.tree.leaves(self.flanks):
            if jnp.shape(leaf)[:1] != (self.teeth,):
                raise ValueError(
                    f"TeethDeviations: flanks has numbers of shape {jnp.shape(leaf)}, must have {self.teeth} in front, "
                    "one per tooth: jax.vmap makes such modifications"
                )

    @property
    def teeth(self) -> int:
        """Number of teeth."""
        return self.pitch.shape[0]

    @classmethod
    def from_single_pitch(
        cls,
        deviations: Given | Sequence[float],
        flanks: AbstractModification | Sequence[AbstractModification] | None = None,
        undulations: Sequence[Undulation] = (),
    ) -> "TeethDeviations":
        """Deviations of the teeth from single pitch deviations.

        Args:
            deviations: single pitch deviation f_pi of every tooth against the previous one, on the reference circle
                [um], shape (teeth,).
            flanks, undulations: as for the class.

        Raises:
            ValueError: if the sum around the gear is not zero within the rounding of reports (0.1 um times the square
                root of the number of teeth); a smaller sum is distributed over all pitches.
        """
        single = real(deviations, "TeethDeviations: single pitch deviations")
        known, unit = concrete(single), "TeethDeviations: single pitch deviations"
        if single.ndim != 1:
            raise ValueError(f"{unit} have shape {single.shape}, must be a list of numbers, one per tooth")
        check("TeethDeviations: single pitch deviations", single, "um")
        allowed = _ROUNDED * np.sqrt(single.shape[0])
        if known is not None and abs(known.sum()) > allowed:
            raise ValueError(
                f"{unit} sum to {known.sum():.4g} um around the gear, must sum to 0 um within {allowed:.2g} um"
            )
        return cls(jnp.cumsum(single - jnp.mean(single)), _stacked(flanks), tuple(undulations))

    @classmethod
    def drawn(
        cls,
        gear: Gear,
        quality_class: Given,
        *,
        key: PRNGKeyArray,
        distribution: AbstractDistribution | None = None,
    ) -> "TeethDeviations":
        """Random deviations of a gear within the pitch and run-out tolerances of ISO 1328-1:2013.

        The gear has an eccentricity (order 1) up to half the run-out tolerance F_rT = 0.9 F_pT and an ovality (order 2)
        up to the remainder of the cumulative pitch tolerance F_pT, each times a random number and at a random phase.
        Every tooth is also displaced individually by up to half of the remainder of f_pT. No sample exceeds f_pT, F_pT
        or F_rT.

        Args:
            gear: gear with a concrete number of teeth.
            quality_class: flank tolerance class, 1 (finest) to 11.
            key: key of the random numbers; use `jax.vmap` over many keys.
            distribution: distribution between the limits; None for `TruncatedNormal()`.

        Raises:
            ValueError: for a class or a gear outside the range of the standard.
        """
        limits, draw = ToleranceClass.of(gear, quality_class), distribution or TruncatedNormal()
        known, dtype = concrete(gear.teeth), gear.module.dtype
        if known is None:
            raise ValueError("TeethDeviations.drawn: the number of teeth is being traced, must be concrete")
        teeth = int(known)
        sizes, phases, single = jax.random.split(key, 3)
        # along the line of action a pitch deviation counts by cos(alpha_t)
        cosine = jnp.cos(gear.transverse_pressure_angle)
        slow = 0.5 * cosine * jnp.maximum(limits.total_pitch - limits.single_pitch, 0.0)
        share = draw(sizes, (2,), dtype)
        eccentric = jnp.minimum(0.5 * _RUN_OUT * limits.total_pitch, slow) * jnp.abs(share[0])
        oval = (slow - eccentric) * jnp.abs(share[1])
        steps = 2 * np.pi / teeth * (eccentric + 2 * oval) / cosine
        alone = 0.5 * jnp.maximum(limits.single_pitch - steps, 0.0)
        degrees = jax.random.uniform(phases, (2,), dtype, 0.0, 360.0)
        waves = Undulation(eccentric, real(1.0), degrees[0]), Undulation(oval, real(2.0), degrees[1])
        return cls(alone * draw(single, (teeth,), dtype), undulations=waves)

    def along_line(self, gear: Gear) -> Pitches:
        """Displacement of every tooth by its pitch deviation, along the line of action [um]."""
        return self.pitch * jnp.cos(gear.transverse_pressure_angle).astype(self.pitch.dtype)

    @property
    def differ_in_shape(self) -> bool:
        """True if teeth differ in shape: the gear has flanks or undulations."""
        return self.flanks is not None or bool(self.undulations)

    def of_tooth(self, tooth: Array, gear: Gear, direction: float) -> AbstractModification:
        """Modification of one tooth without its pitch deviation.

        Args:
            tooth: number of the tooth.
            gear: the gear.
            direction: 1 for the pinion, -1 for the wheel.
        """
        found: list[AbstractModification] = []
        if self.flanks is not None:
            found += terms(jax.tree.map(lambda leaf: leaf[tooth], self.flanks))
        if self.undulations:
            slope = None if gear.is_spur else jnp.tan(gear.signed(gear.base_helix_angle))
            amplitude, order, phase = (
                jnp.stack([getattr(wave, name) for wave in self.undulations])
                for name in ("amplitude", "order", "phase")
            )
            start = 2 * np.pi / self.teeth * order * tooth.astype(order.dtype) + jnp.deg2rad(phase)
            found.append(_Waves(amplitude, direction * order, start, slope))
        return Sum(tuple(found)) if found else NoModification()
