"""What the names of quantities in a design file mean."""

from ..dynamics import DYNAMIC_QUANTITIES
from ..metrics import Quantity, quantities
from ..wear import WEAR_QUANTITIES
from .design_file import DesignFile
from .dynamics_request import dynamic_quantity
from .errors import check_known
from .wear_request import wear_quantity


def quantity_named(design: DesignFile, key: str, name: str) -> str | Quantity:
    """What a name of the vocabulary means in a design file: some quantities come with settings of one of its tables.

    Args:
        design: the design file.
        key: where the name stands.
        name: in either spelling.

    Raises:
        DesignFileError: for an unknown name, and for one that needs a table or a key that the file does not have.
    """
    check_known(key, name, quantities)
    plain = quantities[name].name
    if plain in DYNAMIC_QUANTITIES:
        return dynamic_quantity(design, key, plain)
    return wear_quantity(design, key, plain) if plain in WEAR_QUANTITIES else name
