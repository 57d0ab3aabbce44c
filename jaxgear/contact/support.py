"""Interface of shafts, bearings and housing to the contact analysis."""

from abc import abstractmethod

from jaxtyping import Array, Float

from ..geometry import GearPair
from ..numerics import Checked
from .status import Statuses

Slices = Float[Array, " slices"]
Scalar = Float[Array, ""]


class AbstractSupport(Checked):
    """Gap between the flanks along the line of action by the deflection of shafts, bearings and housing."""

    @property
    @abstractmethod
    def pair(self) -> GearPair:
        """The gears of the mesh."""

    @property
    def torque(self) -> Scalar | None:
        """Pinion torque at which influence and gap hold [N m]; None where they hold at every torque."""
        return None

    @property
    def needs_even_slices(self) -> bool:
        """Whether the support is known over slices of equal width alone."""
        return False

    @property
    def tabulated(self) -> Float[Array, "slices slices"] | None:
        """Influence [um/N] of any shape over the slices, which modes may fail to follow; None for a smooth one."""
        return None

    @property
    @abstractmethod
    def status(self) -> Statuses:
        """Whether such a support is possible and its gears can run, shape (): a concrete one that is not is refused."""

    @abstractmethod
    def influence(self, y: Slices) -> Float[Array, "slices slices"]:
        """Gap that opens at y[s] under a unit force between the flanks at y[t], in um/N, symmetric, semidefinite."""

    @abstractmethod
    def gap(self, y: Slices) -> Slices:
        """Gap at y by everything else than the force of this mesh [um]."""
