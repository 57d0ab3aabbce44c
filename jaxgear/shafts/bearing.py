"""Bearings as stiffness matrices."""

from abc import abstractmethod

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..numerics import Checked, concrete, number
from .stepped_beam import ROUNDING, check_symmetric, symmetric

Scalar = Float[Array, ""]
Matrix = Float[Array, "5 5"]


class AbstractBearing(Checked):
    """Support of a shaft at one position, mounted on the housing, or on rigid ground where there is none."""

    name: eqx.AbstractVar[str]
    position: eqx.AbstractVar[Scalar]

    @property
    @abstractmethod
    def matrix(self) -> Matrix:
        """Stiffness in x, y, z, rx, ry [N/um, N/mrad, N mm/mrad], symmetric and positive semidefinite."""

    @property
    @abstractmethod
    def play(self) -> Scalar | None:
        """Radial clearance [um]; None for a bearing without any."""


class Bearing(AbstractBearing):
    """Bearing with the same stiffness in all radial directions.

    Attributes:
        name: of bearing and seat, which is how a housing names it.
        position: distance from the left end of the shaft [mm].
        radial: [N/um].
        axial: [N/um]; 0 for a floating bearing, which takes no axial force. Shafts of helical gears need one that does.
        tilting: against rotation about x and y [N m/rad]; 0 for a bearing that aligns itself.
        clearance: by which the shaft can move to every side before the bearing resists, half the diametral clearance
            [um]; None for none. See `operating_point` for what is made of it.
    """

    name: str = eqx.field(static=True)
    position: Scalar = number("mm")
    radial: Scalar = number("N/um", low=0.0)
    axial: Scalar = number("N/um", low=0.0, default=0.0)
    tilting: Scalar = number("N m/rad", low=0.0, default=0.0)
    clearance: Scalar | None = number("um", low=0.0, optional=True, default=None)

    @property
    def matrix(self) -> Matrix:
        """Diagonal stiffness."""
        # 1 N m/rad is 1 N mm/mrad
        return jnp.diag(jnp.stack([self.radial, self.radial, self.axial, self.tilting, self.tilting]))

    @property
    def play(self) -> Scalar | None:
        """`clearance`."""
        return self.clearance


class MatrixBearing(AbstractBearing):
    """Bearing with a full stiffness matrix, for instance the tangent at its load of a bearing program.

    Attributes:
        name: of bearing and seat.
        position: distance from the left end of the shaft [mm].
        stiffness: in x, y, z, rx, ry: N/um, N/mrad = N mm/um, N mm/mrad = N m/rad.

    Raises:
        ValueError: for a matrix that is not 5 x 5, symmetric and positive semidefinite.
    """

    name: str = eqx.field(static=True)
    position: Scalar = number("mm")
    stiffness: Matrix = number("N/um", shape=("directions", "directions"))

    def check_together(self) -> None:
        if self.stiffness.shape != (5, 5):
            raise ValueError(f'MatrixBearing "{self.name}": stiffness has shape {self.stiffness.shape}, must be (5, 5)')
        known = concrete(self.stiffness)
        if known is None:
            return
        check_symmetric(f'MatrixBearing "{self.name}": stiffness', known)
        least, most = np.linalg.eigvalsh(known)[[0, -1]]
        if least < -ROUNDING * most:
            raise ValueError(
                f'MatrixBearing "{self.name}": stiffness must be positive semidefinite, smallest eigenvalue {least:g}'
            )

    @property
    def matrix(self) -> Matrix:
        """The symmetric part, of which `stiffness` is made within rounding."""
        return symmetric(self.stiffness)

    @property
    def play(self) -> None:
        """None: the matrix is a tangent that knows of it."""
        return None
