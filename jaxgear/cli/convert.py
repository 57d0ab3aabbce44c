"""What the commands `new` and `convert` do: a design file to begin with, and its conversion to REXS and back."""

import os
from pathlib import Path
from typing import Any, Literal

import jax

from ..geometry import GearPair
from ..io import DesignFileError, load_design, read_rexs, write_design, write_rexs
from ..io.toml import read
from ..io.write_design import write_starter
from . import interrupt, terminal

_REXS, _DESIGN = (".rexs", ".xml", ".rexsj", ".json"), (".toml",)
_TAKEN = {"title", "materials", "pinion", "wheel", "pair", "load"}  # tables of a design file that REXS has a place for


def convert(
    source: Path,
    target: Path,
    *,
    stage: int | None,
    flank: Literal["left", "right"] | None,
    load_case: int | None,
    torque: float | None,
) -> None:
    """Converts a file by the ends of both names; a file that is there is never replaced."""
    jax.config.update("jax_enable_x64", True)
    if os.path.lexists(target):  # a link that leads nowhere is there too
        raise ValueError(f"{target}: exists already, choose another name")
    if source.suffix in _REXS and target.suffix in _DESIGN:
        found = read_rexs(source, stage=stage, flank=flank, load_case=load_case)
        torque = found.torque if torque is None else torque
        if torque is None:
            raise DesignFileError("", "names no torque of the pinion, give it with --torque", source)
        with interrupt.held(f"{target} is there"):
            write_design(
                target,
                found.pair,
                torque=torque,
                pinion=found.pinion,
                wheel=found.wheel,
                speed=found.speed,
                quality_classes=found.quality_classes,
                title=found.title,
            )
        _say(target, found.pair)
    elif source.suffix in _DESIGN and target.suffix in _REXS:
        options = {"--stage": stage, "--flank": flank, "--load-case": load_case, "--torque": torque}
        for name, given in options.items():
            if given is not None:
                raise ValueError(f"{name} has no effect on a design file, leave it out")
        _to_rexs(source, target)
    else:
        raise ValueError(f"{source.name} to {target.name}: one name must end in .toml, the other in .rexs or .rexsj")


def _to_rexs(source: Path, target: Path) -> None:
    design = load_design(source)
    design.check_drive("jaxgear convert")
    free = [name for name in design.bounds if design.open_case or name not in design.values]
    if free:
        problem = f"convert needs numbers, these are free: {', '.join(free)}; give each a value"
        raise DesignFileError("variables", problem, source)
    pinion, wheel = design.design(design.values)
    with interrupt.held(f"{target} is there"):
        write_rexs(
            target,
            design.pair(),
            pinion=pinion,
            wheel=wheel,
            torque=design.torque,
            speed=design.speed,
            quality_classes=design.quality_classes,
            materials=design.materials,
            title=design.title,
        )
    _say(target, design.pair())
    tables = read(source)
    left = [f"[{name}]" for name in tables if name not in _TAKEN]
    left += [f"{gear}.coast_modification" for gear in ("pinion", "wheel") if "coast_modification" in tables[gear]]
    left += [f"load.{name}" for name in tables["load"] if name not in ("torque", "speed")]
    if left:
        terminal.say(f"left out, REXS has no place for it: {', '.join(left)}")


def _say(target: Path, pair: GearPair) -> None:
    pinion, wheel = pair.pinion, pair.wheel
    terminal.say(
        f"{target}: {int(pinion.teeth)}/{int(wheel.teeth)} teeth, module {float(pinion.module):g} mm, "
        f"centre distance {float(pair.working_center_distance):.6g} mm"
    )


def new(
    path: Path,
    teeth: tuple[int, int],
    *,
    module: float,
    torque: float,
    face_width: float,
    speed: float | None,
    helix_angle: float = 0.0,
) -> None:
    """Writes a design file; a file that is there is never replaced."""
    jax.config.update("jax_enable_x64", True)
    given: dict[str, Any] = {"module": module, "torque": torque, "face_width": face_width, "speed": speed}
    with interrupt.held(f"{path} is there"):
        pair = write_starter(path, teeth, **given, helix_angle=helix_angle)
    terminal.say(
        f"{path}: {teeth[0]}/{teeth[1]} teeth, module {module:g} mm, centre distance "
        f"{float(pair.working_center_distance):.6g} mm; jaxgear optimize {path} finds its tip reliefs"
    )
