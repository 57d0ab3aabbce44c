"""The layout of the table [wear]."""

from typing import Annotated

from ..wear import Wear
from .kinds import WEIGHTS, choice, list_of, positive
from .layout import section_of


class WearSection(section_of(Wear, ("dynamics", "loads"), open=False)):  # type: ignore[misc]
    """How long the pair runs, and how fast it wears; for `jaxgear wear` and for the quantities that need it.

    Attributes:
        line_load: under which the flanks wear; "dynamic" is that of the steady motion, which needs the table
            [dynamics] and load.speed.
        largest_increment: depth that no block of the lives of `jaxgear wear` wears off beyond a tenth more; blocks of
            equal length without it. Quantities and the search over the life take `blocks` in any case.
        torques: on the pinion, of a spectrum whose loads wear one flank together; the load of the file without it.
        weights: of the torques in the revolutions.
        speeds: of the pinion at every torque; that of the file without it.
    """

    line_load: Annotated[str, choice("static", "dynamic")] = "static"
    largest_increment: Annotated[float | None, positive("um")] = None
    torques: Annotated[list[float] | None, list_of(positive("N m"))] = None
    weights: Annotated[list[float] | None, WEIGHTS] = None
    speeds: Annotated[list[float] | None, list_of(positive("rpm"))] = None
