"""The command `new`: a design file to begin with."""

from pathlib import Path
from typing import Any

import jax

from ..io.write_design import write_starter
from . import interrupt, terminal


def new(
    path: Path,
    teeth: tuple[int, int],
    *,
    module: float,
    torque: float,
    face_width: float,
    speed: float | None,
    helix_angle: float = 0.0,
    pressure_angle: float = 20.0,
    profile_shift: tuple[float, float] = (0.0, 0.0),
) -> None:
    """Writes a design file; a file that is there is never replaced."""
    jax.config.update("jax_enable_x64", True)
    given: dict[str, Any] = {"module": module, "torque": torque, "face_width": face_width, "speed": speed}
    given |= {"helix_angle": helix_angle, "pressure_angle": pressure_angle, "profile_shift": profile_shift}
    with interrupt.held(f"{path} is there"):
        pair = write_starter(path, teeth, **given)
    terminal.say(
        f"{path}: {teeth[0]}/{teeth[1]} teeth, module {module:g} mm, centre distance "
        f"{float(pair.working_center_distance):.6g} mm; jaxgear optimize {path} finds its tip reliefs"
    )
