"""How a mesh is run through its speeds: what vibrates, at which speeds, and the quantities that are made of it."""

from typing import Any, Literal

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import Mesh
from ..metrics import Quantity
from ..microgeometry import AbstractModification
from ..numerics import Checked, concrete, count, number
from .force_map import mesh_force
from .oscillator import Oscillator
from .response import SpeedResponse
from .speed_sweep import speed_sweep
from .systems import inertia_of, torsional

Scalar = Float[Array, ""]

# Of the critical damping, where nothing is said: gears with splash lubrication have 0.03 to 0.1.
DAMPING_RATIO = 0.05


class Dynamics(Checked):
    """How a mesh is run: masses, damping and speeds.

    Attributes:
        mesh_frequencies: [Hz], increasing, shape (speeds,).
        damping_ratio: of the approach, to the critical damping at the mean stiffness; 0.05 without it or `damping`.
        damping: viscous damping of the approach, in place of the ratio.
        pinion_inertia: polar moment of inertia of the pinion and what turns with it; that of the body without it.
        wheel_inertia: likewise.
        compliance: of what lies between the teeth and the inertias, in series with the mesh.
        model: of the mesh force.
        kick: dynamic factor with which a second run from the highest speed down begins, to find orbits that hang
            together with no other; 1 for no such run.
        steps: of the integrator per mesh cycle; chosen by the natural frequency without it.
    """

    mesh_frequencies: Float[Array, " speeds"] = number("Hz", low=0.0, open_low=True, shape=("speeds",))
    damping_ratio: Scalar | None = number("", low=0.0, optional=True, default=None)
    damping: Scalar | None = number("N s/um", low=0.0, optional=True, default=None)
    pinion_inertia: Scalar | None = number("kg m2", low=0.0, open_low=True, optional=True, default=None)
    wheel_inertia: Scalar | None = number("kg m2", low=0.0, open_low=True, optional=True, default=None)
    compliance: Scalar = number("um/N", low=0.0, default=0.0)
    model: Literal["map", "stiffness", "error", "tangent"] = "map"
    kick: Scalar = number("", low=1.0, default=3.0)
    steps: int | None = count(low=32, high=65_536, optional=True, default=None)
