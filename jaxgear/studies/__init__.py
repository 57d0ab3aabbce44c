"""Studies of a design file: worked out, summed up, tabulated and drawn, with or without the command line.

    study = WearStudy.of(load_design("pair.toml"))
    result = study.run(checkpoints=Checkpoints("kept"), callback=print)
    write_results("results", study, result)

`AbstractStudy` and `AbstractStudyResult` are the extension points; `registry` says how a study of another package
becomes a command. The public names are listed in `__init__.pyi` and imported when they are asked for, so that the
command line knows the studies without importing them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
