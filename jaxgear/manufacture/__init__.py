"""How flanks are ground: form-grinding wheel, its dressed approximation, and the volumes ground off.

Functions of flanks take one gear's side of the contact, of `mesh.sides`, and the modification. The quantities
`pinion_quadratic_deviation`, `pinion_removed_volume` and others are named in `application.toml`; pictures are in
`manufacture.figures`. The public names are listed in `__init__.pyi` and imported when they are asked for.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
