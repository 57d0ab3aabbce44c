"""What the command `new` does: a design file to begin with."""

from pathlib import Path

import jax

from ..io.starter import write_starter
from . import interrupt, report


def new(
    path: Path, teeth: tuple[int, int], *, module: float, torque: float, face_width: float, speed: float | None
) -> None:
    """Writes a design file; a file that is there is never replaced."""
    jax.config.update("jax_enable_x64", True)
    with interrupt.held(f"{path} is there"):
        pair = write_starter(path, teeth, module=module, torque=torque, face_width=face_width, speed=speed)
    report.say(
        f"{path}: {teeth[0]}/{teeth[1]} teeth, module {module:g} mm, centre distance "
        f"{float(pair.working_center_distance):.6g} mm; jaxgear optimize {path} finds its tip reliefs"
    )
