"""The command `jaxgear wear`: from a design file to its flanks over their life."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path

from ..contact import OperatingPoint
from ..io import DesignFile, WearRequest, wear_request, write_worn
from ..io.errors import naming
from ..io.tolerance import tolerance_of
from ..numerics import optional_real, real
from ..wear import WearLife, wear_in_steps
from . import wear_report, wear_scatter
from .comparison import compared, first_mesh, search_of, sought
from .progress import Stages
from .study import Kept, Marches, runs_beside
from .study_command import Make, StudyCommand
from .wear_report import WearStudy

_MOST_BLOCKS = 1000  # of a life of manufactured gears


def _plan(design: DesignFile, quick: bool) -> Make[WearStudy]:
    request = wear_request(design, quick=quick)
    search = search_of(design, quick=quick)
    # a step of the search wears a life: under the static load, which takes far less than a motion in every block
    static = dataclasses.replace(request.settings, line_load=None, dynamics=None)
    lasting = None if search is None else search.over_life(static)
    with naming(design.path):
        tolerance = None if wear_scatter.left_out(design) else tolerance_of(design)

    def make(target: Path, stages: Stages):
        highest = max(design.torque, design.torque_range[1])
        mesh, designs = compared(design, highest, search, target, stages, quick=quick)
        if lasting is not None:
            stages.begin("searching the optimum over the life")
            start = first_mesh(design, highest, quick=quick)
            name = wear_report.OVER_LIFE
            _, designs[name] = sought(design, name, lasting, start, target, stages, quick=quick)
        kept = Kept(runs_beside(target), Marches())
        lives = {name: _life(design, request, mesh, name, flanks, kept, stages) for name, flanks in designs.items()}
        scatters: Mapping[str, wear_scatter.Samples] = {}
        if tolerance is not None:
            stages.begin("wearing manufactured gears of all designs")
            # of one length, as quantities take them, and as many as the nominal gears have taken
            blocks = min(max(len(life.revolutions) - 1 for life in lives.values()), _MOST_BLOCKS)
            settings = dataclasses.replace(request.settings, blocks=blocks)
            of_pairs = Kept(runs_beside(target), wear_scatter.Arrays())
            scatters = wear_scatter.scattered(design, settings, mesh, designs, tolerance, of_pairs, quick=quick)
        return WearStudy(design, request, designs, lives, scatters), kept.remove

    return make


def _write(folder: Path, study: WearStudy) -> None:
    wear_report.write_lives(folder / "life.csv", study)
    for name in ("worn_flanks.csv", "worn_flanks.parquet"):
        write_worn(folder / name, study.lives)


def _life(design: DesignFile, request: WearRequest, mesh, name: str, flanks, kept: Kept, stages: Stages) -> WearLife:
    """The life of one design, at the torque of the file."""
    stages.begin(f"wearing the {name} design")
    settings, (pinion, wheel) = request.settings, flanks

    def progress(done: float, total: float) -> None:
        stages.count(int(done), int(total), f"{done:.3g} of {total:.3g} revolutions")

    return wear_in_steps(
        mesh,
        settings.loads
        or OperatingPoint(real(design.torque), optional_real(design.speed), optional_real(design.friction)),
        settings.revolutions,
        coefficient=settings.coefficients,
        pinion=pinion,
        wheel=wheel,
        points=settings.points,
        dynamics=settings.dynamics,
        line_load=settings.line_load,
        blocks=settings.blocks,
        largest_increment=request.largest_increment,
        keep=kept,
        callback=progress,
    )


run_wear = StudyCommand(
    "wear",
    "coarse positions and few blocks",
    _plan,
    wear_report.summary,
    _write,
    wear_report.write_figures,
    wear_report.tables,
    wear_report.verdict,
    wear_report.failures,
    (wear_report.ASSUMED,),
    omits=wear_scatter.left_out,
)
