"""What the library warns of while a command runs."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def warnings_on_stderr() -> Iterator[None]:
    """Shows what the library warns of as lines on stderr."""
    lines = logging.StreamHandler()
    lines.setLevel(logging.WARNING)
    lines.setFormatter(logging.Formatter("jaxgear: warning: %(message)s"))
    logger = logging.getLogger("jaxgear")
    logger.addHandler(lines)
    try:
        yield
    finally:
        logger.removeHandler(lines)
