"""The command `convert` with its options; the library is imported when it runs."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from ..cli import interrupt


def convert(
    source: Annotated[Path, typer.Argument(metavar="IN", help="FILE.toml or FILE.rexs.", show_default=False)],
    target: Annotated[
        Path | None, typer.Argument(metavar="OUT", help="The other kind of file; none to list the stages of IN.")
    ] = None,
    stage: Annotated[int | None, typer.Option(metavar="ID", help="Stage, where there are several.")] = None,
    flank: Annotated[
        Literal["left", "right"] | None, typer.Option(help="Flanks that touch, where both are modified differently.")
    ] = None,
    load_case: Annotated[int | None, typer.Option(metavar="ID", help="Load case, where there are several.")] = None,
    torque: Annotated[
        float | None, typer.Option(metavar="NM", help="Torque on the driving gear in N m, in place of the file's.")
    ] = None,
    given: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="KEY=VALUE", help="A number in place of that of a REXS file, as pinion.tip_diameter=63.5."
        ),
    ] = None,
) -> int:
    """Convert a design file into a REXS file, or a stage of a REXS file into a design file.

    REXS is the open exchange format for gearbox data. The gears with their modifications, torque and speed are
    converted. An existing file is never replaced. Without OUT the stages of a REXS file are listed, with the reason why
    a stage is not converted.
    """
    with interrupt.importing():
        from . import convert as conversion
    conversion.convert(source, target, stage=stage, flank=flank, load_case=load_case, torque=torque, given=given or [])
    return 0
