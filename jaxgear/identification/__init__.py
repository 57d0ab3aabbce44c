"""Identification: values of variables from a measured transmission error, with their uncertainty.

The public names are listed in `__init__.pyi` and imported when they are asked for. The command `identify` is named in
`application.toml`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
