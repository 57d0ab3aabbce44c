"""The command `identify` with its options; the library is imported when it runs."""

from pathlib import Path
from typing import Annotated, Any

import typer

from ..cli.app import Quick, command_of
from ..studies.registry import help_of

_PLACE = "jaxgear.identification.study:IdentificationStudy"


def _options(
    measured: Annotated[
        Path, typer.Argument(metavar="TE.csv", help="Measured transmission error.", show_default=False)
    ],
    noise: Annotated[
        float | None, typer.Option(metavar="UM", help="Standard deviation of a reading in um; else that of repeats.")
    ] = None,
    torque_scale: Annotated[
        float, typer.Option(metavar="SD", help="Standard deviation of true over measured torque, 0 for a right one.")
    ] = 0.01,
    offset: Annotated[
        float, typer.Option(metavar="UM", help="Standard deviation of an offset of all readings in um, 0 for none.")
    ] = 0.0,
    pitch: Annotated[
        bool, typer.Option("--pitch", help="Pitch deviations are unknown too, from readings of whole revolutions.")
    ] = False,
    quick: Quick = False,
) -> dict[str, Any]:
    return locals()


identify = command_of(_PLACE, "identify", _options)
identify.__doc__ = help_of(_PLACE)
