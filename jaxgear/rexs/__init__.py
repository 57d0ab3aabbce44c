"""REXS files (https://www.rexs.info): the open exchange format for gearbox data, read and written.

The public names are listed in `__init__.pyi` and imported when they are asked for. The command `convert` and the format
`rexs` of results are named in `application.toml`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
