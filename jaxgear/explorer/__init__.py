"""A page on which a design is moved by sliders: `jaxgear explore pair.toml`, or `jaxgear.explore` in a notebook.

Needs the extra `explore`. `Explorer` gives the answers without a page.
"""

from .explorer import Explorer as Explorer
from .notebook import explore as explore
from .server import Page as Page
from .sliders import Opened as Opened
from .sliders import Slider as Slider
