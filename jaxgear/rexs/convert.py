"""Conversion of a design file to REXS and back, and the list of the stages of a REXS file."""

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Literal

import jax

from ..cli import interrupt, terminal
from ..geometry import GearPair
from ..io import DesignFile, DesignFileError, load_design, write_design, write_stage_design
from ..io.toml import read
from ..report import Table
from .planetary import BY_PARTS, read_rexs_stage, stage_keys
from .read import read_rexs
from .stages import RexsStage, is_planetary, rexs_stages
from .write import write_rexs
from .write_planetary import write_rexs_stage

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
    "sun",
    "planet",
    "stage",
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
        choices: dict[str, Any] = {"stage": stage, "flank": flank, "load_case": load_case, "given": _numbers(given)}
        (_to_stage if is_planetary(source, stage) else _to_pair)(source, target, torque, choices)
    elif source.suffix in _DESIGN and target.suffix in _REXS:
        _check_unused(options, "on a design file")
        _to_rexs(source, target)
    else:
        ends = ", ".join(_REXS)
        raise ValueError(f"{source.name} to {target.name}: one name must end in .toml, the other in {ends}")


def _to_pair(source: Path, target: Path, torque: float | None, choices: dict[str, Any]) -> None:
    found = read_rexs(source, **choices)
    with interrupt.delayed(f"{target} is there"):
        write_design(
            target,
            found.pair,
            torque=_torque(source, found.torque if torque is None else torque, "pinion"),
            pinion=found.pinion,
            wheel=found.wheel,
            speed=found.speed,
            quality_classes=found.quality_classes,
            title=found.title,
        )
    _say(target, found.pair)


def _to_stage(source: Path, target: Path, torque: float | None, choices: dict[str, Any]) -> None:
    found = read_rexs_stage(source, **choices)
    units = {name: kind.number.unit for name, kind in stage_keys().items() if kind.number}
    with interrupt.delayed(f"{target} is there"):
        write_stage_design(
            target,
            *found.pairs,
            torque=_torque(source, found.torque if torque is None else torque, "driving member"),
            stage=found.stage,
            units=units,
            flanks=found.flanks,
            speed=found.speed,
            quality_classes=found.quality_classes,
            title=found.title,
        )
        try:  # gears that mesh are not yet a stage that can be assembled
            load_design(target)
        except DesignFileError:
            target.unlink()
            raise
    _say(target, *found.pairs)


def _torque(source: Path, torque: float | None, member: str) -> float:
    if torque is None:
        raise DesignFileError("", f"names no torque of the {member}, give it with --torque", source)
    return torque


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
    free = [name for name in design.bounds if design.open_case or name not in design.values]
    if free:
        problem = f"convert needs numbers, these are free: {', '.join(free)}; give each a value"
        raise DesignFileError("variables", problem, source)
    with interrupt.delayed(f"{target} is there"):
        pairs = _stage_to_rexs(design, target) if design.part_of else _pair_to_rexs(design, target)
    _say(target, *pairs)
    tables = read(source)
    left = [f"[{name}]" for name in tables if name not in _TAKEN]
    gears = (name for name in ("pinion", "wheel", "sun", "planet", "ring") if name in tables)
    left += [f"{gear}.coast_modification" for gear in gears if "coast_modification" in tables[gear]]
    left += [f"load.{name}" for name in tables["load"] if name not in _LOAD]
    for name in design.part_of:
        own = [f"{name}.{key}" for key in design.tables[name].fields if key not in BY_PARTS]
        terminal.say(f"as attributes of jaxgear, which other programs ignore: {', '.join(own)}")
    if left:
        terminal.say(f"left out, REXS has no place for it: {', '.join(left)}")


def _pair_to_rexs(design: DesignFile, target: Path) -> tuple[GearPair, ...]:
    pinion, wheel = design.design(design.values)
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
    return (design.pair(),)


def _stage_to_rexs(design: DesignFile, target: Path) -> tuple[GearPair, ...]:
    table = design.tables[next(iter(design.part_of))]
    whole = table.whole_of(design, design.values)
    (sun, to_sun), (to_ring, ring) = whole.flanks
    inner, outer = whole.quality_classes
    write_rexs_stage(
        target,
        *whole.pairs,
        stage=table.fields,
        flanks={"sun": sun, "planet_to_sun": to_sun, "planet_to_ring": to_ring, "ring": ring},
        torque=whole.torque,
        speed=whole.speed,
        quality_classes=None if inner is None or outer is None else (*inner, outer[1]),
        title=design.title,
    )
    return whole.pairs


def _say(target: Path, *pairs: GearPair) -> None:
    gears = [pairs[0].pinion, *(pair.wheel for pair in pairs)]
    terminal.say(
        f"{target}: {'/'.join(str(int(gear.teeth)) for gear in gears)} teeth, module {float(gears[0].module):g} mm, "
        f"centre distance {float(pairs[0].working_center_distance):.6g} mm"
    )
