"""The page in a notebook."""

from html import escape
from pathlib import Path

from ..io import DesignFile
from .explorer import Explorer
from .server import Page

_HEIGHT = 760  # [px]


class Shown(Page):
    """A page that a notebook shows under its cell; `link` opens it in a window of its own, `close()` ends it."""

    def _repr_html_(self) -> str:
        return f'<iframe src="{escape(self.link)}" width="100%" height="{_HEIGHT}" style="border:0"></iframe>'


def explore(design: DesignFile | str | Path) -> Shown:
    """Open a page on which sliders move a design, as the command `jaxgear explore` does.

    The page runs in threads of this process, on the loopback interface alone. It computes in the precision of JAX,
    which `jax_enable_x64` sets.

    Args:
        design: design file, or its path.

    Returns:
        the page, which a notebook shows; it is ready some seconds later.

    Raises:
        DesignFileError: for errors in the file, in one line.
    """
    page = Shown(Explorer(design.path if isinstance(design, DesignFile) else design))
    page.start()
    return page
