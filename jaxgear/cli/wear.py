"""The command `jaxgear wear`: from a design file to its flanks over their life."""

import os
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

from ..io import DesignFile, WearRequest, result_folder, wear_request, write_summary, write_worn
from ..wear import WearLife, wear_in_steps
from . import interrupt, report, wear_report
from .commands import import_ahead
from .compared import compared, search_of
from .devices import compile_quickly
from .document import document
from .kept import Kept, Marches
from .progress import Stages
from .run import default_folder, opened
from .wear_report import Study


def run_wear(
    file: Path,
    output: Path | None,
    *,
    quick: bool,
    figures: bool,
    cache: bool,
    command: Sequence[str] | None = None,
) -> bool:
    """The command with its options; False when a contact was not found."""
    asked = document(command, file)
    compile_quickly()
    with Stages() as stages:
        design = opened(file, cache=cache)
        request = wear_request(design, quick=quick)
        search = search_of(design, quick=quick)
        target = output or default_folder(file, "wear", quick=quick)
        with ExitStack() as putting_in_place, result_folder(target) as folder:
            if figures:
                import_ahead("matplotlib.pyplot")
            mesh, designs = compared(design, max(design.torque, design.torque_range[1]), search, stages, quick=quick)
            kept = Kept(target.with_name(f".{target.name}.runs"), Marches())
            lives = {name: _life(design, request, mesh, name, flanks, kept, stages) for name, flanks in designs.items()}
            study = Study(design, request, designs, lives)
            stages.begin("writing the results")
            data = {**wear_report.summary(study), "quick": quick}
            write_summary(folder / "summary.json", data)
            wear_report.write_lives(folder / "life.csv", study)
            write_worn(folder / "worn_flanks.csv", lives)
            files = wear_report.write_figures(folder, study) if figures else []
            if asked is not None:
                asked.write(folder, design, data, wear_report.found(study, files))
            putting_in_place.enter_context(interrupt.held(f"the results are in {target}{os.sep}"))
            putting_in_place.callback(kept.remove)
    report.console().print(wear_report.table(study))
    report.say(*wear_report.verdict(study))
    if quick:
        report.say("quick run: coarse positions and few blocks, not a result to build on")
    report.say(f"results in {target}{os.sep}, {stages.elapsed:.1f} s")
    failures = list(wear_report.failures(study))
    for line in failures:
        report.warn(line)
    return not failures


def _life(design: DesignFile, request: WearRequest, mesh, name: str, flanks, kept: Kept, stages: Stages) -> WearLife:
    """The life of one design, at the torque of the file."""
    stages.begin(f"wearing the {name} design")
    settings, (pinion, wheel) = request.settings, flanks

    def progress(done: float, total: float) -> None:
        stages.count(int(done), int(total), f"{done:.3g} of {total:.3g} revolutions")

    return wear_in_steps(
        mesh,
        design.torque,
        settings.revolutions,
        coefficient=settings.coefficients,
        pinion=pinion,
        wheel=wheel,
        points=settings.points,
        blocks=settings.blocks,
        largest_increment=request.largest_increment,
        keep=kept,
        callback=progress,
    )
