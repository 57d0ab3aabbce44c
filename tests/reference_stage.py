"""The reference stage: 26/19/64 teeth, module 3, with finite-element meshes.

`planetary_reference.npz` holds the tables of both meshes (approach [um] over 60 mesh positions and line load [N/mm]),
and the quasi-static stage that was computed from them: transmission error, centre of the sun, forces of all planets.
"""

from pathlib import Path

import numpy as np

from jaxgear.planetary import PlanetaryStage, PreparedStage, StageGears, TableMesh, prepare_stage

REFERENCE = np.load(Path(__file__).with_name("planetary_reference.npz"))
WIDTH = 20.0
HELD, FLOAT = 2000.0, 0.001
TORQUE = {3: 400.0, 5: 650.0}


def stage(planets: int = 3, *, teeth=(26, 19, 64), pin: float = 400.0, **options) -> PlanetaryStage:
    """Every error is an array, so that all stages of so many planets share one program."""
    none = {name: np.zeros(planets) for name in ("radial_pin_error", "tangential_pin_error", "sun_gap", "ring_gap")}
    given = {"sun_support": FLOAT, **none, **options}
    return PlanetaryStage(
        StageGears(*teeth, 3.0), planets, radial_pin_stiffness=pin, tangential_pin_stiffness=pin, **given
    )


def prepared(own: PlanetaryStage, kind: str = "none") -> PreparedStage:
    """The stage with the tables of unmodified flanks, or of those with "relief"."""
    load = REFERENCE["load"].astype(float)
    meshes = {name: TableMesh(REFERENCE[f"{name}_{kind}"].astype(float), load, WIDTH) for name in ("sun", "ring")}
    return prepare_stage(own, **meshes)
