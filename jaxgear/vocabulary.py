"""All quantities by name: those of the packages, and those that users add."""

from .dynamics import DYNAMIC_QUANTITIES
from .manufacture import GROUND_QUANTITIES
from .metrics import MESH_QUANTITIES, Vocabulary
from .revolution import REVOLUTION_QUANTITIES
from .wear import WEAR_QUANTITIES

_PARTS = MESH_QUANTITIES, DYNAMIC_QUANTITIES, WEAR_QUANTITIES, REVOLUTION_QUANTITIES, GROUND_QUANTITIES

quantities = Vocabulary(quantity for part in _PARTS for quantity in part.values())
quantity_of = quantities.quantity_of
