"""Output streams of a command: warnings, one-line error messages and a closed standard output.

Imports nothing of the library: help and usage errors need none of it.
"""

import logging
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager


def silence_compiler() -> None:
    """Hide the messages of XLA on long compilations, which ask for a bug report; its errors are still raised."""
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")  # fatal ones alone


@contextmanager
def warnings() -> Iterator[None]:
    """Show the warnings of the library as lines on stderr."""
    lines = logging.StreamHandler()
    lines.setLevel(logging.WARNING)
    lines.setFormatter(logging.Formatter("jaxgear: warning: %(message)s"))
    logger, unusual = logging.getLogger("jaxgear"), logging.getLogger("jaxgear.unusual")
    logger.addHandler(lines)
    before, unusual.disabled = unusual.disabled, True  # commands ask about the numbers of their designs themselves
    try:
        yield
    finally:
        unusual.disabled = before
        logger.removeHandler(lines)


def one_line(error: Exception) -> str:
    """Message of an error in one line."""
    if hasattr(error, "format_message"):  # usage errors of typer
        return f"{' '.join(error.format_message().split())} (jaxgear --help shows the usage)"
    message = " ".join(str(error).split())
    if isinstance(error, ValueError | RuntimeError) and message:
        return message
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename or 'standard output'}: {error.strerror}"
    return f"unexpected {type(error).__name__}: {message} (JAXGEAR_DEBUG=1 shows where)"


def forget_output() -> None:
    """Avoid an error message at exit if standard output is closed."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
