"""A gear mesh as a part of a larger model."""

import equinox as eqx

from ..microgeometry import AbstractModification, NoModification
from ..numerics import Frozen
from .cycle import MeshCycle
from .mesh import Mesh
from .operating_point import Torque
from .solve import check_mesh, solve


class ModifiedMesh(eqx.Module):
    """A prepared mesh with its flank modifications, as a component of a larger model.

    The numbers of the modifications are its trainable parameters, nothing else is: the prepared arrays are `Frozen`. A
    `Mesh` held directly would train its own compliances.

        model = jg.ModifiedMesh(mesh, pinion=jg.TipRelief(7.0, 4.0))
        cycle = model(50.0)

    Attributes:
        pinion, wheel: the modifications.

    Raises:
        TypeError: when `mesh` is not a prepared mesh.
    """

    pinion: AbstractModification
    wheel: AbstractModification
    _mesh: Frozen[Mesh]

    def __init__(
        self, mesh: Mesh, *, pinion: AbstractModification | None = None, wheel: AbstractModification | None = None
    ) -> None:
        check_mesh(mesh)
        self.pinion = NoModification() if pinion is None else pinion
        self.wheel = NoModification() if wheel is None else wheel
        self._mesh = Frozen(mesh)

    @property
    def mesh(self) -> Mesh:
        """The prepared mesh, constant to every derivative."""
        return self._mesh()

    def __repr__(self) -> str:
        return f"ModifiedMesh({self.mesh!r}, pinion={self.pinion!r}, wheel={self.wheel!r})"

    def __call__(self, torque: Torque) -> MeshCycle:
        """Mesh cycle under a torque on the pinion [N m]; see `solve`."""
        return solve(self.mesh, torque, pinion=self.pinion, wheel=self.wheel)
