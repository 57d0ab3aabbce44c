"""The command `identify` with its options; the library is imported when it runs."""

from pathlib import Path
from typing import Annotated, Any

import typer

from ..cli.app import run_place
from ..cli.options import File, NoCache, NoFigures, Quick, Reported, output_option


def identify(
    context: typer.Context,
    file: File,
    measured: Annotated[
        Path, typer.Argument(metavar="TE.csv", help="Measured transmission error.", show_default=False)
    ],
    output: Annotated[Path | None, output_option("identify")] = None,
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
    no_figures: NoFigures = False,
    reported: Reported = False,
    no_cache: NoCache = False,
) -> int:
    """Find the values of the variables that gave a measured transmission error, and how well it tells them.

    The file has the columns torque_Nm, te_um, and phase (base pitches) or angle_deg (of the pinion). An error that is
    an angle names its shaft and unit: te_wheel_arcsec, te_pinion_deg.
    """
    shared = {"no_figures": no_figures, "reported": reported, "no_cache": no_cache}
    unknown: dict[str, Any] = {"noise": noise, "torque_scale": torque_scale, "offset": offset, "pitch": pitch}
    place = "jaxgear.identification.study:DesignIdentification"
    return run_place(place, context, file, output, **shared, measured=measured, quick=quick, **unknown)
