"""The page as a command, which runs until Ctrl-C, and in the threads of a notebook."""

import webbrowser
from pathlib import Path

import jax

from ..cli import interrupt, terminal
from ..cli.jax_setup import enable_cache
from ..numerics import compile_quickly
from .explorer import Explorer
from .server import LOOPBACK, Page

_LEAST_TOKEN = 16  # characters


def shown(file: Path) -> Page:
    """Page of a design file that runs in threads of this process."""
    page = Page(Explorer(file))
    page.start()
    return page


def serve(file: Path, *, host: str, port: int, token: str | None, browser: bool, cache: bool) -> None:
    """Serve the page of a design file until Ctrl-C.

    Args:
        file: design file.
        host, port: address and port to listen on; port 0 for a free one.
        token: secret of the link; None for a random one.
        browser: True to open the page in the browser.
        cache: True to keep compiled programs on disk.

    Raises:
        DesignFileError: for errors in the file, in one line.
        ValueError: for an address that cannot be listened on, and a short token.
    """
    if token is not None and len(token) < _LEAST_TOKEN:
        raise ValueError(f"--token has {len(token)} characters, must have at least {_LEAST_TOKEN}")
    jax.config.update("jax_enable_x64", True)
    compile_quickly()
    if cache:
        enable_cache()
    page = Page(Explorer(file), host=host, port=port, token=token)
    interrupt.note("the page is closed, saved files are complete")
    if host != LOOPBACK:
        terminal.warn(
            f"everybody who has the link and reaches {host} can open the page, and its answers are not encrypted"
        )
    page.start()
    terminal.say(f"{page.link}", "Ctrl-C ends")
    if browser:
        webbrowser.open(page.link)
    try:
        page.wait(lambda stage: terminal.console(stderr=True).print(f"jaxgear: {stage}", soft_wrap=True))
    finally:
        page.close()
