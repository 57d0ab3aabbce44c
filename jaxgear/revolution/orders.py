"""Results of a revolution: shaft orders, composite deviations, load share of every tooth.

References:
    ISO 1328-1:1995 on the tangential composite deviation F'_i, the range over a whole revolution, and the
    tooth-to-tooth one f'_i, that over one pitch: here of the transmission error, without load or under it.
"""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy.typing import ArrayLike

from ..metrics import MESH_QUANTITIES, Quantity
from ..metrics.excitation import Harmonics
from ..numerics import maximum, safe_sqrt, spread, whole
from .settings import Teeth
from .solve import GEARS, Curve, GearName, Revolution, whole_revolutions
from .teeth import Undulation

_SIDE_BANDS = 3  # on either side of a mesh order


def shaft_orders(
    revolution: Revolution, gear: GearName, count: int | None = None, *, of: Curve | None = None
) -> Harmonics:
    """Amplitudes and phases of the orders 1 ... count of a shaft in the transmission error [um].

    The mesh order is the number of teeth of the gear, its multiples are the mesh harmonics.

    Args:
        revolution: revolution over whole revolutions of this gear and of all gears with deviations of single teeth.
        gear: gear on the shaft, "pinion" or "wheel".
        count: number of orders; None for orders up to three and a half mesh orders, or all that the positions resolve.
        of: another curve over the places of the revolution, shape (places,); None for the loaded transmission error.

    Raises:
        ValueError: for other revolutions or gears, and for more orders than the positions resolve.
    """
    turns = whole_revolutions(revolution, gear)
    curve = revolution.transmission_error if of is None else of
    places = curve.shape[-1]
    most = (places // 2 - 1) // turns
    if count is None:
        count = min(7 * revolution.teeth[GEARS.index(gear)] // 2, most)
    whole("count", count, high=most)
    lines = jnp.fft.rfft(curve)[..., turns : (count + 1) * turns : turns] * (2 / places)
    squared = lines.real**2 + lines.imag**2
    present = squared > 0
    angle = jnp.arctan2(jnp.where(present, lines.imag, 0.0), jnp.where(present, lines.real, 1.0))
    return Harmonics(safe_sqrt(squared), jnp.rad2deg(angle))


def side_bands(
    revolution: Revolution, gear: GearName, harmonic: int = 1, *, count: int = _SIDE_BANDS
) -> Float[Array, "*batch bands"]:
    """Amplitudes of the side bands of a mesh harmonic [um], shape (2 count,): orders harmonic z -+ 1 ... -+ count.

    Args:
        revolution, gear: as for `shaft_orders`.
        harmonic: number of the mesh harmonic.
        count: number of side bands on either side, less than half of the number of teeth.

    Raises:
        ValueError: as `shaft_orders`, and for more side bands.
    """
    whole("harmonic", harmonic)
    orders = np.asarray(_side_band_orders(revolution, gear, harmonic, count))
    return shaft_orders(revolution, gear, int(orders[-1])).amplitude[..., orders - 1]


def _side_band_orders(revolution: Revolution, gear: GearName, harmonic: int = 1, count: int = _SIDE_BANDS) -> list[int]:
    """Shaft orders of `side_bands` in ascending order."""
    whole_revolutions(revolution, gear)
    teeth = revolution.teeth[GEARS.index(gear)]
    whole("count", count, high=(teeth - 1) // 2)
    middle = harmonic * teeth
    return [middle + away for away in range(-count, count + 1) if away]


class NamedOrder(NamedTuple):
    """Line of the spectrum with its source.

    Attributes:
        name: source, such as "mesh", "wheel side band", "pinion ghost order".
        order: order of the shaft of the gear; for the mesh the number of the harmonic.
        pinion_order: order of the line on the pinion shaft, often not a whole number.
        amplitude: amplitude [um].
    """

    name: str
    order: int
    pinion_order: float
    amplitude: float


def amplitudes(curve: ArrayLike) -> np.ndarray:
    """Amplitudes of all lines of the spectrum of a curve, in its unit: line k has k waves over all windows."""
    return np.abs(np.fft.rfft(np.asarray(curve))) * (2 / np.size(curve))


def named_orders(revolution: Revolution, teeth: Teeth, harmonics: int = 3) -> list[NamedOrder]:
    """Mesh orders, shaft orders 1 to 3, side bands and ghost orders of both gears, if the windows resolve them.

    Args:
        revolution: a single revolution of concrete numbers.
        teeth: deviations of the teeth; the orders of their undulations are ghost orders.
        harmonics: number of mesh harmonics.

    Returns:
        the lines sorted by the pinion order, each with one name: a ghost order that is also a side band is named ghost
        order.
    """
    amplitude = amplitudes(revolution.transmission_error)
    windows, found = revolution.windows, {}
    for number in range(1, harmonics + 1):
        found[number * windows] = "mesh", number
    for gear, of, count in zip(GEARS, teeth.deviations, revolution.teeth):
        if windows % count or not revolution.repeats:
            continue
        for order, kind in _kinds(count, () if of is None else of.undulations, harmonics):
            line = order * (windows // count)
            if line not in found:
                found[line] = f"{gear} {kind}", order
            elif gear == "wheel" and found[line][0] == f"pinion {kind}":  # of equal numbers of teeth
                found[line] = f"pinion and wheel {kind}", order
    return [
        NamedOrder(*found[line], line * revolution.teeth[0] / windows, float(amplitude[line]))
        for line in sorted(found)
        if line < len(amplitude)
    ]


def _kinds(count: int, waves: Iterable[Undulation], harmonics: int) -> Iterator[tuple[int, str]]:
    """Orders of one shaft and their kinds."""
    orders = (int(wave.order) for wave in waves)
    yield from ((order, "ghost order") for order in orders if order > _SIDE_BANDS)
    yield from ((order, "shaft order") for order in range(1, _SIDE_BANDS + 1))
    for number in range(1, harmonics + 1):
        for away in range(-_SIDE_BANDS, _SIDE_BANDS + 1):
            yield number * count + away, "side band"


def total_composite_error(revolution: Revolution, of: Curve | None = None) -> Float[Array, "*batch"]:
    """Total composite deviation F'_i under load: range of the transmission error, or another curve, over all windows
    [um].
    """
    return spread(revolution.transmission_error if of is None else of, axis=-1)


def tooth_to_tooth_error(revolution: Revolution, of: Curve | None = None) -> Float[Array, "*batch"]:
    """Tooth-to-tooth composite deviation f'_i: largest range of the transmission error in a base pitch [um]."""
    curve = revolution.transmission_error if of is None else of
    positions, places = revolution.cycles.kinematics.resolution.positions, curve.shape[-1]
    if revolution.repeats:
        curve = jnp.concatenate([curve, curve[..., :positions]], axis=-1)
    begin = np.arange(places if revolution.repeats else max(places - positions, 1))
    stretch = np.minimum(begin[:, None] + np.arange(positions + 1), curve.shape[-1] - 1)
    return maximum(spread(curve[..., stretch], axis=-1), axis=-1)


def tooth_shares(revolution: Revolution, gear: GearName) -> Float[Array, "*batch teeth"]:
    """Load share of every tooth over its time in mesh, shape (teeth,): the largest `Revolution.pair_share` of the
    tooth.

    Equal teeth have a share of 1; a tooth with 1.1 carries 10 % more than the mean. NaN for teeth without a complete
    passage within the windows.

    Raises:
        ValueError: for an unknown gear.
    """
    if gear not in GEARS:
        raise ValueError(f'gear = {gear!r} must be "pinion" or "wheel"')
    share, teeth = revolution.pair_share, revolution.teeth[GEARS.index(gear)]
    tooth = (revolution.first_pair + np.arange(share.shape[-1])) % teeth
    largest = jnp.moveaxis(jax.ops.segment_max(jnp.moveaxis(share, -1, 0), tooth, teeth), 0, -1)
    return jnp.where(np.isin(np.arange(teeth), tooth), largest, jnp.nan)


def over_revolution(revolution: Revolution, of: str | Quantity) -> Float[Array, "*batch windows"]:
    """A quantity of mesh cycles, a name or a `Quantity`, in every window, shape (windows,)."""
    return MESH_QUANTITIES.quantity_of(of)(revolution.cycles)
