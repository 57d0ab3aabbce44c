"""The command `new`: a design file to begin with."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax

from ..io.write_design import write_starter
from ..provided import provided
from . import interrupt, terminal

_NO_STAGE = {"helix_angle": 0.0, "pressure_angle": 20.0, "profile_shift": (0.0, 0.0), "ring": False}


def new(path: Path, teeth: tuple[int, int], *, planets: int | None = None, **given: Any) -> None:
    """Write a design file with the options of `write_starter`, or of a stage; an existing file is never replaced."""
    jax.config.update("jax_enable_x64", True)
    with interrupt.delayed(f"{path} is there"):
        if planets is not None:
            made = _stage_starter(given)(path, teeth, planets, **given).gears
        else:
            made = write_starter(path, teeth, **given)
    terminal.say(
        f"{path}: {'/'.join(map(str, teeth))} teeth, module {given['module']:g} mm, centre distance "
        f"{float(made.working_center_distance):.6g} mm; jaxgear optimize {path} finds its tip reliefs"
    )


def _stage_starter(given: dict[str, Any]) -> Callable[..., Any]:
    """Function that writes the file of a stage; takes out the options that it does not know."""
    for name, usual in _NO_STAGE.items():
        if given.pop(name) != usual:
            raise ValueError(f"--{name.replace('_', '-')} has no effect with --planetary: give it in the file")
    starters = provided("starters")
    if "planetary" not in starters:
        raise ValueError("--planetary: planetary stages are not installed")
    found: Callable[..., Any] = starters["planetary"].load()
    return found
