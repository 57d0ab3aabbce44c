"""Commands as the tests of them run them, in this process, and design files that they share."""

import contextlib
import io
from types import SimpleNamespace

import jax
import pytest

from jaxgear.cli import main

# the array sizes of `catalogue.LINE` and `catalogue.FACE`: one program of a size serves all tests
LINE = "positions = 16\npairs = 2\nslide_steps = 0"
FACE = "positions = 8\nslices = 6\npairs = 2\nface_modes = 3\nslide_steps = 0\ncontact_nodes = 1"

FIXED = f"""
title = "a [small] pair"
[pinion]
teeth = 19
module = 3.0
face_width = 18.0
[wheel]
teeth = 48
module = 3.0
face_width = 18.0
[load]
torque = 50.0
torque_range = [30.0, 60.0]
speed = 3000
[resolution]
{LINE}
[[pinion.modification]]
type = "tip_relief"
amount = 6.5
length = 5.0
[[wheel.modification]]
type = "tip_relief"
amount = 7.5
length = 5.0
"""
VARIABLES = """
[variables]
height = { low = 0.0, high = 20.0, unit = "um" }
"""
FREE = (
    FIXED.replace("amount = 6.5", 'amount = "height"')
    + VARIABLES
    + """[optimize]
starts = 2
steps = 100
"""
)
SWEEP = (
    FIXED.replace("amount = 6.5", 'amount = "height"')
    + VARIABLES
    + """
[sweep]
sampling = "latin_hypercube"
samples = 60
part_rows = 25
results = ["ppte", "effective_contact_ratio"]
"""
)


def call(*arguments):
    """Exit code, stdout and stderr of the command."""
    out, err = io.StringIO(), io.StringIO()
    # a process of its own has JAX's defaults, and optax needs them
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), pytest.raises(SystemExit) as exit_:
            main([str(argument) for argument in arguments])
    return SimpleNamespace(code=exit_.value.code, out=out.getvalue(), err=err.getvalue())


def assert_refused(result, *fragments):
    """One line on stderr, nothing on stdout, exit code 2."""
    assert result.code == 2, result.err
    assert result.out == ""
    assert result.err.startswith("jaxgear: error: ") and result.err.count("\n") == 1
    assert "Traceback" not in result.err
    for fragment in fragments:
        assert fragment in result.err
