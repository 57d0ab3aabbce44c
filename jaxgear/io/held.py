"""What of the shafts of a design file acts in every analysis of the mesh, and what does not, in words."""

from ..contact import Resolution
from ..contact.kinematics import kinematics
from ..numerics import concrete, real
from ..shafts import ShaftSupport, TabulatedSupport


def over_slices(support: ShaftSupport, sizes: Resolution) -> TabulatedSupport:
    """Shafts that do at every torque what they do at one, as numbers over the slices of a mesh."""
    y = kinematics(support.pair, real(0.0), sizes, "strain").face_coordinate
    return TabulatedSupport(support.pair, support.influence(y), support.gap(y))


def left_out(support: ShaftSupport, sizes: Resolution, *, open_gears: bool, vibrates: bool) -> str:
    """What a mesh without them lacks, and why; "" where the shafts act.

    Args:
        support: the mesh on its shafts.
        sizes: of the mesh.
        open_gears: numbers of the gears or their model are variables.
        vibrates: the gears vibrate on the mesh.
    """
    why = _why_rigid(support, sizes, open_gears, vibrates)
    if not why:
        return ""
    parts = ["shafts", "bearings"]
    if support.gearbox.housing is not None:
        parts.append("housing")
    if any(mesh.misalignment.varies_along_face for mesh in support.gearbox.meshes):
        parts.append("the misalignment of [[meshes]]")
    named = f"{', '.join(parts[:-1])} and {parts[-1]}"
    return f"{named} are not part of this analysis, the gears stand rigid ({why}): jaxgear layout takes them"


def _why_rigid(support: ShaftSupport, sizes: Resolution, open_gears: bool, vibrates: bool) -> str:
    if vibrates:  # shafts without mass would lower the natural frequencies
        return "[dynamics] would need the inertia of the shafts too"
    if open_gears:
        return "the variables change the gears or their model"
    if len(support.gearbox.meshes) > 1:
        return "what other meshes do to them belongs to one torque"
    plays = [bearing.play for shaft in support.gearbox.shafts for bearing in shaft.bearings]
    if any(play is not None and concrete(play) != 0 for play in plays):
        return "bearings with clearance belong to one torque"
    if sizes.slices == 1:
        return "resolution.slices = 1 shows nothing over the face"
    if sizes.parts is not None:  # numbers over slices are for even ones, and shafts themselves for one torque
        return "resolution.slice_widths takes shafts at one torque"
    return "" if sizes.coupled_slices else "resolution.coupled_slices = false"
