"""What contact analyses of all array sizes need to know of both gears, evaluated once for all of them."""

import equinox as eqx

from ..compliance import AbstractCompliance
from ..geometry import GearPair, Margins, Outline, margins_between, outline, path_of_contact
from ..numerics import on_both, program


class Gears(eqx.Module):
    """Both gears, without any position of the mesh.

    Attributes:
        outlines: of their teeth.
        margins: how far the pair is from what cannot run.
        compliance: the model, with what it knows of these gears alone.
    """

    outlines: tuple[Outline, Outline]
    margins: Margins
    compliance: AbstractCompliance


@program
def gears_of(pair: GearPair, compliance: AbstractCompliance, count: int) -> Gears:
    """Both gears of an `explicit` pair.

    A program of its own: half of what a mesh compiles is the same for all numbers of positions and slices.

    Args:
        pair: gear pair.
        compliance: compliance model.
        count: tooth pairs that are carried along.
    """
    outlines = on_both(outline, pair.pinion, pair.wheel)
    margins = margins_between(*outlines, path_of_contact(pair), pair.center_distance, pair.face_overlap)
    return Gears(outlines, margins, compliance.of_gears(*outlines, count))
