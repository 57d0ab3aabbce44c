"""Options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer
from typer.models import OptionInfo

File = Annotated[Path, typer.Argument(metavar="FILE.toml", help="Design file.", show_default=False)]


def output_option(folder: str) -> OptionInfo:
    """The option --output of a command with its own folder, which a quick run marks with -quick."""
    return typer.Option("--output", "-o", metavar="DIR", help="Result folder.", show_default=f"results/FILE/{folder}")


NoFigures = Annotated[bool, typer.Option("--no-figures", help="Write no figures.")]
NoCache = Annotated[
    bool, typer.Option("--no-cache", envvar="JAXGEAR_NO_CACHE", help="Do not keep compiled programs on disk.")
]
Quick = Annotated[
    bool, typer.Option("--quick", help="Coarse positions and a short search: for a first look, not for a result.")
]


Reported = Annotated[
    bool, typer.Option("--report", help="Write report.html too, a self-contained file (needs jaxgear\\[report]).")
]
