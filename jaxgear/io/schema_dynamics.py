"""The layout of the table [dynamics]."""

from typing import Annotated

from ..dynamics import Dynamics
from .kinds import count, list_of, positive
from .layout import section_of


class DynamicsSection(section_of(Dynamics, ("mesh_frequencies",), open=False)):  # type: ignore[misc]
    """At which speeds the pair runs, and what vibrates; for `jaxgear dynamics` and for the quantities that need it.

    Attributes:
        mesh_frequencies: lowest and highest frequency of the mesh; either these or `speeds`.
        speeds: lowest and highest speed of the pinion.
        number: of speeds, at equal steps.
        torque_factors: torques of `jaxgear dynamics`, in design torques; 0.5, 1 and 2 without it.
        run_up: duration of a change of speed from the lowest to the highest in `jaxgear dynamics`, at constant
            acceleration; no run-up without it.
    """

    mesh_frequencies: Annotated[list[float] | None, list_of(positive("Hz"), length=2)] = None
    speeds: Annotated[list[float] | None, list_of(positive("rpm"), length=2)] = None
    number: Annotated[int, count(2, 10_000)] = 100
    torque_factors: Annotated[list[float], list_of(positive(""))] = [0.5, 1.0, 2.0]
    run_up: Annotated[float | None, positive("s")] = None
