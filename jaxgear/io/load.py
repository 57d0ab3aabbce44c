"""Design files, read and checked as a whole: a file is right or wrong whatever command it is for."""

from pathlib import Path

from .design_file import DesignFile, read_design
from .errors import naming
from .layout_request import check_layout
from .optimize_request import check_optimize
from .requests import dynamics_request, wear_request
from .sweep_request import check_sweep


def load_design(path: str | Path) -> DesignFile:
    """Reads and checks a design file, the tables of all commands included.

    Left to the commands is what their options can change (the method of a search, the number of variants), files of
    variants, and which numbers may be variables.

    Args:
        path: TOML file; examples/spur_19_48.toml shows and lists what it can say.

    Raises:
        DesignFileError: for anything that is wrong with it, in one line that names the file and the key.
    """
    design = read_design(Path(path))
    with naming(design.path):
        check_optimize(design)
        if design.sweep is not None:
            check_sweep(design, design.sweep)
        if design.layout is not None:
            check_layout(design, design.layout)
    if design.dynamics is not None:
        dynamics_request(design)
    if design.wear is not None:
        wear_request(design)
    return design
