"""The layout of the table [wear]."""

from typing import Annotated

from ..wear import Wear
from .kinds import positive
from .layout import section_of


class WearSection(section_of(Wear, ("dynamics",), open=False)):  # type: ignore[misc]
    """How long the pair runs, and how fast it wears; for `jaxgear wear` and for the quantities that need it.

    Attributes:
        largest_increment: depth that no block of `jaxgear wear` wears off beyond a tenth more; in place of `blocks`.
    """

    largest_increment: Annotated[float | None, positive("um")] = None
