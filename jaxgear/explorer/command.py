"""The command `explore` with its options; the library is imported when it runs."""

from pathlib import Path
from typing import Annotated

import typer

from ..cli import interrupt
from ..io.first_look import check_keys
from .needs import check_installed

_LOOPBACK = "127.0.0.1"


def explore(
    file: Annotated[Path, typer.Argument(metavar="FILE.toml", help="Design file.", show_default=False)],
    port: Annotated[int, typer.Option(metavar="N", min=0, max=65535, help="Port; 0 for a free one.")] = 0,
    host: Annotated[
        str, typer.Option(metavar="ADDRESS", help="Address to listen on; another one shows the page to a network.")
    ] = _LOOPBACK,
    token: Annotated[
        str | None,
        typer.Option(envvar="JAXGEAR_TOKEN", help="Secret of the link; random without it.", show_default=False),
    ] = None,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Print the link alone.")] = False,
    no_cache: Annotated[
        bool, typer.Option("--no-cache", envvar="JAXGEAR_NO_CACHE", help="Do not keep compiled programs on disk.")
    ] = False,
) -> int:
    """Open a page on which sliders move the design, and every movement shows transmission error, load and pressure.

    The page is on this machine alone, for who has its link. It needs jaxgear[explore].
    """
    check_installed("jaxgear explore")
    check_keys(file)
    with interrupt.importing():
        from . import serve
    serve.serve(file, host=host, port=port, token=token, browser=not no_browser, cache=not no_cache)
    return 0
