"""Lists the stages of a REXS file, with the reason why a stage cannot be read."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from ..io.errors import DesignFileError, naming
from ..io.toml import content
from .forms import parse
from .model import Component, Model
from .open_numbers import Completed
from .planetary import PLANETARY, completed_of_stage, meshes_of, read_planetary
from .read import read_stage

_PAIR = "cylindrical_stage"
_OTHER = {  # kinds of stages without a pair of their own
    "bevel_stage": "bevel gears, must be cylindrical gears",
    "worm_stage": "worm gears, must be cylindrical gears",
}


@dataclass(frozen=True)
class RexsStage:
    """One stage of a REXS file.

    Attributes:
        id: id of its component, for `read_rexs` and the option --stage.
        kind: type of its component.
        name: name of its component, "" without one.
        teeth: numbers of teeth, gear 1 first, or of sun, planet and ring; None if the file gives none.
        module: normal module of gear 1 [mm]; None if the file gives none.
        helix_angle: helix angle of gear 1 on the reference cylinder [deg]; None if the file gives none.
        center_distance: centre distance [mm]; None if the file gives none.
        completed: descriptions of the numbers that are completed, by their keys in a design file.
        problem: reason why the stage cannot be read, "" for none.
    """

    id: int
    kind: str
    name: str
    teeth: tuple[int | None, ...]
    module: float | None
    helix_angle: float | None
    center_distance: float | None
    completed: Mapping[str, str]
    problem: str


def rexs_stages(path: str | Path) -> tuple[RexsStage, ...]:
    """Every stage of a REXS file, with the reason why a stage cannot be read.

    Args:
        path: path of the file, see `read_rexs`.

    Raises:
        DesignFileError: where the file is not a REXS file.
    """
    with naming(Path(path)):
        model = parse(content(Path(path)))
        return tuple(_stages_of(model))


def is_planetary(path: str | Path, stage: int | None) -> bool:
    """True if the stage of an id, or without one the only stage of a file but for those of its parts, is planetary.

    Raises:
        DesignFileError: where the file is not a REXS file.
    """
    with naming(Path(path)):
        model = parse(content(Path(path)))
    if stage is not None:
        return stage in model.components and model.components[stage].type == PLANETARY
    stages = {part.id: part for part in model.components.values() if part.type in (PLANETARY, _PAIR)}
    whole = [part for part in stages.values() if part.type == PLANETARY]
    parts = {part.id for each in whole for part in model.related("assembly", "assembly", each.id, "part")}
    return len(whole) == 1 and not stages.keys() - parts - {whole[0].id}


def _stages_of(model: Model) -> Iterator[RexsStage]:
    for part in [*model.components.values()]:
        if part.type.endswith("_stage"):
            yield _rexs_stage(model, part)


def _rexs_stage(model: Model, stage: Component) -> RexsStage:
    completed, problem = Completed({}), ""
    gears = [gear for role in ("gear_1", "gear_2") for gear in model.related("stage", "stage", stage.id, role)]
    center_distance = _number(stage, "center_distance", "mm")
    try:
        if stage.type == PLANETARY:
            completed, one = completed_of_stage({}), meshes_of(model, stage)[0]
            gears, center_distance = [one.sun, one.planet, one.ring], _number(one.at_sun, "center_distance", "mm")
            read_planetary(model, stage, None, next(iter(model.cases), None), completed)
        elif stage.type == _PAIR:
            read_stage(model, stage.id, None, completed)
        else:
            problem = _OTHER.get(stage.type, "is not a pair of gears")
    except DesignFileError as error:
        problem = ": ".join(part for part in (error.key, error.problem) if part)
    teeth = tuple(_number(gear, "number_of_teeth", "none") for gear in gears)
    first = gears[0] if gears else Component(0, "")
    return RexsStage(
        id=stage.id,
        kind=stage.type,
        name=stage.name,
        teeth=tuple(None if number is None else int(number) for number in teeth),
        module=_number(first, "normal_module", "mm"),
        helix_angle=_number(first, "helix_angle_reference_diameter", "deg"),
        center_distance=center_distance,
        completed=completed.numbers,
        problem=problem,
    )


def _number(part: Component, attribute: str, unit: str) -> float | None:
    """Number of a component, None if it cannot be read."""
    try:
        return part.number(attribute, unit)
    except DesignFileError:
        return None
