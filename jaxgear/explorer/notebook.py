"""The page in a notebook."""

from pathlib import Path
from typing import Any

from ..io import DesignFile
from .needs import check_installed


def explore(design: DesignFile | str | Path) -> Any:
    """Open a page on which sliders move a design, as the command `jaxgear explore` does.

    The page runs in threads of this process, on the loopback interface alone. It computes in the precision of JAX,
    which `jax_enable_x64` sets.

    Args:
        design: design file, or its path.

    Returns:
        the `explorer.Page`, which a notebook shows under its cell: `link` opens it in a window of its own, `close()`
        ends it. It is ready some seconds later.

    Raises:
        DesignFileError: for errors in the file, in one line.
        ValueError: for a library of the extra `explore` that is missing.
    """
    check_installed("jaxgear.explore")
    from . import serve

    return serve.shown(design.path if isinstance(design, DesignFile) else Path(design))
