"""The command `new`: a design file to begin with."""

from pathlib import Path
from typing import Any

import jax

from ..io.write_design import write_starter
from . import interrupt, terminal

_NO_STAGE = {"helix_angle": 0.0, "pressure_angle": 20.0, "profile_shift": (0.0, 0.0)}


def new(path: Path, teeth: tuple[int, int], *, planets: int | None = None, **given: Any) -> None:
    """Write a design file with the options of `write_starter`, or of a stage; an existing file is never replaced."""
    jax.config.update("jax_enable_x64", True)
    with interrupt.delayed(f"{path} is there"):
        if planets is not None:
            distance = _stage(path, teeth, planets, given)
        else:
            distance = float(write_starter(path, teeth, **given).working_center_distance)
    terminal.say(
        f"{path}: {'/'.join(map(str, teeth))} teeth, module {given['module']:g} mm, centre distance "
        f"{distance:.6g} mm; jaxgear optimize {path} finds its tip reliefs"
    )


def _stage(path: Path, teeth: tuple[int, int], planets: int, given: dict[str, Any]) -> float:
    """Write the file of a stage; gives its centre distance [mm]."""
    from ..planetary.starter import write_stage_starter

    for name, usual in _NO_STAGE.items():
        if given.pop(name) != usual:
            raise ValueError(f"--{name.replace('_', '-')} has no effect with --planetary: give it in the file")
    return float(write_stage_starter(path, teeth, planets, **given).gears.working_center_distance)
