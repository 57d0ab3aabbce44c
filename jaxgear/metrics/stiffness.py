"""Mesh stiffness."""

from jaxtyping import Array, Float

from ..contact import MeshCycle
from ..numerics import over_batch, safe_divide


@over_batch
def secant_stiffness(cycle: MeshCycle) -> Float[Array, " positions"]:
    """Average slope k = F / (loaded - unloaded transmission error) [N/um]; 0 at zero torque.

    It serves static deflections; for small vibrations about the loaded state use `cycle.tangent_stiffness`, the local
    slope (Cooley, Liu, Dai, Parker, Mech. Mach. Theory 105 (2016) 540-553). The secant falls in the hand-over between
    pairs even where nothing softens.
    """
    return safe_divide(cycle.force, cycle.transmission_error - cycle.unloaded_transmission_error)
