"""Stages of a REXS file: which of them are pairs of this library, and why others are not."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from ..io.errors import DesignFileError, naming
from ..io.toml import content
from .forms import parse
from .model import Component, Model
from .open_numbers import Completed
from .read import read_stage

_PAIR = "cylindrical_stage"
_OTHER = {  # kinds of stages without a pair of their own
    "planetary_stage": "planetary stage with its carrier: its external cylindrical stages are pairs of their own",
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
        teeth: numbers of teeth, gear 1 first; None if the file gives none.
        module: normal module of gear 1 [mm]; None if the file gives none.
        helix_angle: helix angle of gear 1 on the reference cylinder [deg]; None if the file gives none.
        center_distance: centre distance [mm]; None if the file gives none.
        completed: descriptions of the numbers that `read_rexs` completes, by their keys in a design file.
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
        path: of the file, see `read_rexs`.

    Raises:
        DesignFileError: where the file is not a REXS file.
    """
    with naming(Path(path)):
        model = parse(content(Path(path)))
        return tuple(_stages(model))


def _stages(model: Model) -> Iterator[RexsStage]:
    for part in [*model.components.values()]:
        if part.type.endswith("_stage"):
            yield _stage(model, part)


def _stage(model: Model, stage: Component) -> RexsStage:
    completed, problem = Completed({}), _OTHER.get(stage.type, "" if stage.type == _PAIR else "is not a pair of gears")
    try:
        if not problem:
            read_stage(model, stage.id, None, completed)
    except DesignFileError as error:
        problem = ": ".join(part for part in (error.key, error.problem) if part)
    gears = [gear for role in ("gear_1", "gear_2") for gear in model.related("stage", "stage", stage.id, role)]
    teeth = tuple(_number(gear, "number_of_teeth", "none") for gear in gears)
    first = gears[0] if gears else Component(0, "")
    return RexsStage(
        id=stage.id,
        kind=stage.type,
        name=stage.name,
        teeth=tuple(None if number is None else int(number) for number in teeth),
        module=_number(first, "normal_module", "mm"),
        helix_angle=_number(first, "helix_angle_reference_diameter", "deg"),
        center_distance=_number(stage, "center_distance", "mm"),
        completed=completed.numbers,
        problem=problem,
    )


def _number(part: Component, attribute: str, unit: str) -> float | None:
    """Number of a component, None if it cannot be read."""
    try:
        return part.number(attribute, unit)
    except DesignFileError:
        return None
