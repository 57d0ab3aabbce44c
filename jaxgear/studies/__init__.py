"""Studies of a design file: calculation, summary, tables and figures, with or without the command line.

    study = WearStudy.of(load_design("pair.toml"))
    result = study.run(checkpoints=Checkpoints("kept"), callback=print)
    write_results("results", study, result)

`AbstractStudy` and `AbstractStudyResult` are the extension points; `registry` describes how a study of another package
becomes a command. The public names are listed in `__init__.pyi` and imported on first use, so that the command line can
list the studies without importing them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
