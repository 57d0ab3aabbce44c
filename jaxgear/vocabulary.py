"""All quantities by name: those of the packages, those of applications, and those that users add."""

from collections.abc import Iterator

from .dynamics import DYNAMIC_QUANTITIES
from .metrics import MESH_QUANTITIES, Quantity, Vocabulary
from .provided import provided
from .revolution import REVOLUTION_QUANTITIES
from .wear import WEAR_QUANTITIES

_PARTS = MESH_QUANTITIES, DYNAMIC_QUANTITIES, WEAR_QUANTITIES, REVOLUTION_QUANTITIES


def _of_applications() -> Iterator[Quantity]:
    for _, entry in sorted(provided("quantities").items()):
        yield from entry.load().values()


quantities = Vocabulary((quantity for part in _PARTS for quantity in part.values()), further=_of_applications)
quantity_of = quantities.quantity_of
