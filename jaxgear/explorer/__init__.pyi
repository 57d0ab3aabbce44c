"""The public names, for type checkers and for `__init__.py`, which imports each when it is asked for."""

from .explorer import Explorer as Explorer
from .notebook import explore as explore
from .server import Page as Page
from .sliders import Opened as Opened
from .sliders import Slider as Slider

__all__: list[str]
