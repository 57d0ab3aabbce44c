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
        """Radial clearance [um]; None for a bearing without clearance."""


class Bearing(AbstractBearing):
    """Bearing with the same stiffness in all radial directions.

    Attributes:
        name: name of the bearing, and of its seat in the housing.
        position: distance from the left end of the shaft [mm].
        radial: radial stiffness [N/um].
        axial: axial stiffness [N/um]; 0 for a floating bearing. A shaft of helical gears needs a bearing with axial
            stiffness.
        tilting: stiffness against rotation about x and y [N m/rad]; 0 for a self-aligning bearing.
        clearance: radial clearance, half the diametral clearance [um]; None for none. Its effect is described in
            `operating_point`.
    """

    name: str = eqx.field(static=True)
    position: Scalar = number("mm")
    radial: Scalar = number("N/um", low=0.0)
    axial: Scalar = number("N/um", low=0.0, default=0.0)
    tilting: Scalar = number("N m/rad", low=0.0, default=0.0)
    clearance: Scalar | None = number("um", low=0.0, optional=True, default=None)

    @property
    def matrix(self) -> Matrix:
        """Diagonal stiffness matrix in x, y, z, rx, ry [N/um, N mm/mrad]."""
        # 1 N m/rad is 1 N mm/mrad
        return jnp.diag(jnp.stack([self.radial, self.radial, self.axial, self.tilting, self.tilting]))

    @property
    def play(self) -> Scalar | None:
        """Radial clearance [um]; None for none."""
        return self.clearance


class MatrixBearing(AbstractBearing):
    """Bearing with a full stiffness matrix, for instance the tangent stiffness at its load from a bearing program.

    Attributes:
        name: name of the bearing, and of its seat in the housing.
        position: distance from the left end of the shaft [mm].
        stiffness: stiffness matrix in x, y, z, rx, ry [N/um, N/mrad = N mm/um, N mm/mrad = N m/rad], shape (5, 5).

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
        """Symmetric part of `stiffness`, which is symmetric within rounding, shape (5, 5)."""
        return symmetric(self.stiffness)

    @property
    def play(self) -> None:
        """None: a tangent stiffness includes the clearance."""
        return None
