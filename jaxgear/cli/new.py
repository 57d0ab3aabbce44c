"""The command `new`: a design file to begin with."""

from pathlib import Path
from typing import Any

import jax

from ..io.write_design import write_starter
from . import interrupt, terminal


def new(path: Path, teeth: tuple[int, int], **given: Any) -> None:
    """Write a design file with the options of `write_starter`; an existing file is never replaced."""
    jax.config.update("jax_enable_x64", True)
    with interrupt.delayed(f"{path} is there"):
        pair = write_starter(path, teeth, **given)
    terminal.say(
        f"{path}: {teeth[0]}/{teeth[1]} teeth, module {given['module']:g} mm, centre distance "
        f"{float(pair.working_center_distance):.6g} mm; jaxgear optimize {path} finds its tip reliefs"
    )
