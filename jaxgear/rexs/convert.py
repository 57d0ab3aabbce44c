"""Conversion of a design file to REXS and back, and the list of the stages of a REXS file."""

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Literal

import jax

from ..cli import interrupt, terminal
from ..geometry import GearPair
from ..io import DesignFileError, load_design, write_design
from ..io.toml import read
from ..report import Table
from .read import RexsStage, read_rexs, rexs_stages
from .write import write_rexs

_REXS, _DESIGN = (".rexs", ".xml", ".rexsj", ".json", ".rexsz", ".zip"), (".toml",)
_LOAD = "torque", "torque_lbf_in", "torque_lbf_ft", "speed"  # of [load], likewise
_TAKEN = {
    "title",
    "materials",
    "pinion",
    "wheel",
    "ring",
    "pair",
    "load",
}  # tables of a design file that REXS has a place for


def convert(
    source: Path,
    target: Path | None,
    *,
    stage: int | None,
    flank: Literal["left", "right"] | None,
    load_case: int | None,
    torque: float | None,
    given: Iterable[str],
) -> None:
    """Convert a file into the format given by the suffix of the target; an existing file is never replaced.

    Without a target it prints the stages of a REXS file.
    """
    jax.config.update("jax_enable_x64", True)
    options = {"--stage": stage, "--flank": flank, "--load-case": load_case, "--torque": torque, "--set": given or None}
    if target is None:
        _check_unused(options, "without OUT")
        if source.suffix not in _REXS:
            raise ValueError(f"{source.name}: give OUT, only a REXS file has stages to list")
        terminal.say_columns(_stages(rexs_stages(source)))
        return
    if os.path.lexists(target):  # a link that leads nowhere is there too
        raise ValueError(f"{target}: exists already, choose another name")
    if source.suffix in _REXS and target.suffix in _DESIGN:
        found = read_rexs(source, stage=stage, flank=flank, load_case=load_case, given=_numbers(given))
        torque = found.torque if torque is None else torque
        if torque is None:
            raise DesignFileError("", "names no torque of the pinion, give it with --torque", source)
        with interrupt.delayed(f"{target} is there"):
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
        _check_unused(options, "on a design file")
        _to_rexs(source, target)
    else:
        ends = ", ".join(_REXS)
        raise ValueError(f"{source.name} to {target.name}: one name must end in .toml, the other in {ends}")


def _check_unused(options: dict[str, Any], where: str) -> None:
    for name, value in options.items():
        if value is not None:
            raise ValueError(f"{name} has no effect {where}, leave it out")


def _numbers(given: Iterable[str]) -> dict[str, float]:
    """Numbers by their keys, from KEY=VALUE."""
    found: dict[str, float] = {}
    for text in given:
        key, equals, value = text.partition("=")
        try:
            found[key.strip()] = float(value)
        except ValueError:
            raise ValueError(f"--set {text}: must be KEY=NUMBER, as in --set pinion.tip_diameter=63.5") from None
    return found


def _stages(stages: Iterable[RexsStage]) -> Table:
    """Table of the stages of a file, with the reason why a stage is not converted."""

    def shown(value: float | None) -> str:
        return "-" if value is None else f"{value:.6g}"

    table = Table(("id", "stage", "teeth", "m_n mm", "beta deg", "a mm", "converted"))
    for stage in stages:
        teeth = "/".join(map(shown, stage.teeth)) or "-"
        numbers = shown(stage.module), shown(stage.helix_angle), shown(stage.center_distance)
        names = ", ".join(dict.fromkeys(key.partition(".")[2] for key in stage.completed))
        result = f"no: {stage.problem}" if stage.problem else f"yes, completed: {names}" if names else "yes"
        table.add_row(str(stage.id), stage.kind.removesuffix("_stage"), teeth, *numbers, result)
    return table


def _to_rexs(source: Path, target: Path) -> None:
    design = load_design(source)
    design.check_drive("jaxgear convert")
    for name in design.part_of:
        raise DesignFileError(name, "REXS is written of single pairs: give one of its meshes as a file", source)
    free = [name for name in design.bounds if design.open_case or name not in design.values]
    if free:
        problem = f"convert needs numbers, these are free: {', '.join(free)}; give each a value"
        raise DesignFileError("variables", problem, source)
    pinion, wheel = design.design(design.values)
    with interrupt.delayed(f"{target} is there"):
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
    gears = (name for name in ("pinion", "wheel", "ring") if name in tables)
    left += [f"{gear}.coast_modification" for gear in gears if "coast_modification" in tables[gear]]
    left += [f"load.{name}" for name in tables["load"] if name not in _LOAD]
    if left:
        terminal.say(f"left out, REXS has no place for it: {', '.join(left)}")


def _say(target: Path, pair: GearPair) -> None:
    pinion, wheel = pair.pinion, pair.wheel
    terminal.say(
        f"{target}: {int(pinion.teeth)}/{int(wheel.teeth)} teeth, module {float(pinion.module):g} mm, "
        f"centre distance {float(pair.working_center_distance):.6g} mm"
    )
