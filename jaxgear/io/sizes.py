"""The array sizes of a mesh that a design file asks for."""

from ..contact import Resolution
from . import schema, template
from .errors import DesignFileError
from .toml import decode

# Slices where a modification varies along the face: the mean of a parabola over the middles of n slices is 1 / n^2 too
# small, so that 11 show a lead crowning to 1 %.
_SLICES = 11


def resolution_of(table: schema.Tables, uneven: list[str], *, bent: bool) -> Resolution:
    """The array sizes.

    Args:
        table: of that name.
        uneven: keys of the modifications that vary along the face.
        bent: shafts bend; slices show it where the file says nothing else.

    Raises:
        DesignFileError: for one slice where modifications vary along the face.
    """
    sizes = decode("resolution", table, schema.ResolutionSection).given()
    if sizes.get("slice_widths") is not None:
        sizes.setdefault("slices", len(sizes["slice_widths"]))
    if bent:
        sizes.setdefault("slices", _SLICES)
    if uneven and sizes.setdefault("slices", _SLICES) == 1:
        problem = f"must be at least 2, 1 cannot show {uneven[0]}, which varies along the face"
        raise DesignFileError("resolution.slices", f"{problem} ({_SLICES} where the key is left out)")
    return template.Part(Resolution, sizes, "resolution").build({})
