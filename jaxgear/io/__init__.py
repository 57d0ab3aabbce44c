"""Files: design files (TOML) in, results (JSON, CSV) out.

The public names are listed in `__init__.pyi` and imported when they are asked for: the command line looks at the keys
of a file (`first_look`) before it imports JAX.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
