"""A page on which a design is moved by sliders: `jaxgear explore pair.toml`, or `jaxgear.explore` in a notebook.

Needs the extra `explore`. `Explorer` gives the answers without a page.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
