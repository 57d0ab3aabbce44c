"""Life under a duty cycle in the five cases of deviations: what further crowning is worth.

Without deviations further crowning only gathers the load in the middle and shortens the life; what it saves, it saves
where the flanks deviate.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..conditions import LoadSpectrum
from ..numerics import program, whole
from ..shafts import AbstractSupport
from .flank_line import FlankLine
from .life import Endurance, damage_of, under_loads
from .stations import STATIONS, Stations
from .tolerance_cases import FlankLineTolerance


def lives_in_cases(
    support: AbstractSupport,
    load: LoadSpectrum,
    endurance: Endurance | tuple[Endurance, Endurance],
    tolerance: FlankLineTolerance,
    *,
    pinion: FlankLine | None = None,
    wheel: FlankLine | None = None,
    stations: int = STATIONS,
) -> Float[Array, " cases"]:
    """Life [h] without deviations and in the four combinations of the largest ones, see `CASES`.

    Args:
        support, load, endurance, pinion, wheel, stations: as for `damage`.
        tolerance: the deviations.

    Raises:
        ValueError: as `damage` does.
    """
    both = endurance if isinstance(endurance, tuple) else (endurance, endurance)
    whole("lives_in_cases", "stations", stations, 3, 1001)
    faces = under_loads(support, load, stations=stations)
    return _lives(faces, load, both, tolerance, pinion or FlankLine(), wheel or FlankLine())


@program
def _lives(
    faces: Stations,
    load: LoadSpectrum,
    endurance: tuple[Endurance, Endurance],
    tolerance: FlankLineTolerance,
    pinion: FlankLine,
    wheel: FlankLine,
) -> Float[Array, " cases"]:
    pair = jax.tree.map(lambda leaf: leaf[0], faces.pair)

    def life(slope):
        on_wheel = FlankLine(slope).on(pair, "wheel")
        deviated = FlankLine(wheel.slope + on_wheel.slope, wheel.crowning + on_wheel.crowning)
        return damage_of(faces, load, endurance, pinion, deviated).life

    return jax.vmap(life)(jnp.asarray(tolerance.slopes))
