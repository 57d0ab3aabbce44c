"""The layout of the table [wear]."""

from typing import Annotated

from ..wear import Wear
from .kinds import choice, positive
from .layout import section_of


class WearSection(section_of(Wear, ("dynamics",), open=False)):  # type: ignore[misc]
    """How long the pair runs, and how fast it wears; for `jaxgear wear` and for the quantities that need it.

    Attributes:
        line_load: under which the flanks wear; "dynamic" is that of the steady motion, which needs the table
            [dynamics] and load.speed.
        largest_increment: depth that no block of `jaxgear wear` wears off beyond a tenth more; in place of `blocks`.
    """

    line_load: Annotated[str, choice("static", "dynamic")] = "static"
    largest_increment: Annotated[float | None, positive("um")] = None
