"""A class of settings that is defined outside the package is a table of design files by the name that it says."""

import functools
import re
from typing import Literal

import jax
import numpy as np
import pytest
from design_texts import loaded, text

from jaxgear.io import DesignFileError, reference
from jaxgear.microgeometry import AbstractCurve, Linear
from jaxgear.numerics import Checked, number
from jaxgear.numerics.fields import count
from jaxgear.vocabulary import quantities


@pytest.fixture
def load(tmp_path):
    """Loads a design file with the given content, text or bytes."""
    return functools.partial(loaded, tmp_path)


class Seal(Checked):
    """A user's own settings.

    Attributes:
        width: of the lip.
        preloads: of its springs.
        speed: at which its loss is told.
        lips: how many.
        material: of the lips.
        wears: whether they do.
        curve: of the wear.
    """

    table = "my_seal"

    width: jax.Array = number("mm", low=0.0, open_low=True, high=20.0)
    preloads: jax.Array = number("N", low=0.0, shape=("springs",))
    speed: jax.Array | None = number("rpm", low=0.0, optional=True, default=None)
    lips: int = count(high=4, default=1)
    material: Literal["nbr", "fkm"] = "nbr"
    wears: bool = True
    curve: AbstractCurve = Linear()

    def check_together(self) -> None:
        if len(self.preloads) != self.lips:
            raise ValueError(f"Seal: preloads has {len(self.preloads)} numbers, must have one for each of the lips")


WHOLE = """
[my_seal]
width = 4.5
preloads = [1.0, 2.0]
lips = 2
material = "fkm"
wears = false
curve = { type = "power", exponent = 1.5 }
"""


def test_its_fields_are_the_keys_and_the_file_holds_an_object_of_it(load):
    seal = load(text(tail=WHOLE)).tables["my_seal"]
    assert isinstance(seal, Seal)
    assert (float(seal.width), seal.lips, seal.material, seal.wears, seal.speed) == (4.5, 2, "fkm", False, None)
    np.testing.assert_array_equal(seal.preloads, [1.0, 2.0])
    assert float(seal.curve.exponent) == 1.5
    assert load(text()).tables == {}


def test_the_table_may_stand_in_a_file_of_its_own(load, tmp_path):
    (tmp_path / "seal.toml").write_text("width = 3.0\npreloads = [5.0]\n")
    assert float(load(text(tail='[my_seal]\nfile = "seal.toml"\nspeed = 900.0')).tables["my_seal"].width) == 3.0
    (tmp_path / "seal.toml").write_text("width = 30.0\npreloads = [5.0]\n")
    with pytest.raises(DesignFileError, match=r"my_seal\.file: seal\.toml: width: 30 mm must be greater than 0 mm and"):
        load(text(tail='[my_seal]\nfile = "seal.toml"\n'))


WRONG = {
    "unknown key": ("wears =", "wear =", '.wear: unknown key, did you mean "wears"?'),
    "missing key": ("width = 4.5\n", "", ".width: missing, this key is required"),
    "range": ("4.5", "45.0", ".width: 45 mm must be greater than 0 mm and at most 20 mm"),
    "kind": ("4.5", '"4.5 mm"', ".width: must be a number, not a string"),
    "size of the unit": (
        "lips = 2",
        "lips = 2\nspeed = 1e9",
        ".speed: 1e+09 rpm must be at least 0 rpm and at most 1e+07",
    ),
    "element": ("2.0]", "-2.0]", ".preloads[1]: -2 N must be at least 0 N"),
    "count": ("lips = 2", "lips = 5", ".lips: 5 must be at least 1 and at most 4"),
    "choice": ("fkm", "fmk", '.material: "fmk" is not known, did you mean "fkm"?'),
    "object within": ("exponent = 1.5", "exponnt = 1.5", '.curve.exponnt: unknown key, did you mean "exponent"?'),
    "together": ("lips = 2", "lips = 3", "my_seal: preloads has 2 numbers, must have one for each of the lips"),
    "its own name": ("[my_seal]", "[my_sael]", 'my_sael: unknown key, did you mean "my_seal"?'),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_one_line_with_key_value_unit_and_range(load, tmp_path, case):
    old, new, expected = WRONG[case]
    assert old in WHOLE
    expected = f"my_seal{expected}" if expected.startswith(".") else expected
    with pytest.raises(DesignFileError, match=f"^{re.escape(f'{tmp_path}/gear.toml: {expected}')}") as caught:
        load(text(tail=WHOLE.replace(old, new)))
    assert "\n" not in str(caught.value)


def test_of_two_classes_of_a_name_the_later_is_meant_but_none_takes_the_place_of_the_library(load):
    class First(Checked):
        table = "twice"
        a: jax.Array = number("", default=1.0)

    class Second(Checked):
        table = "twice"
        b: jax.Array = number("", default=1.0)

    class Oil(Checked):
        table = "lubricant"
        b: jax.Array = number("", default=1.0)

    class Gears(Checked):
        table = "pinion"
        b: jax.Array = number("", default=1.0)

    tables = load(text(tail="[twice]\nb = 2.0\n")).tables
    assert isinstance(tables["twice"], Second)
    with pytest.raises(DesignFileError, match=r"twice\.a: unknown key, must be one of b, file"):
        load(text(tail="[twice]\na = 2.0\n"))
    with pytest.raises(DesignFileError, match=r"lubricant\.b: unknown key"):
        load(text(load="speed = 9.0", tail="[lubricant]\nb = 2.0\n"))
    assert (First.table, Gears.table) == ("twice", "pinion")


def test_a_table_without_settings_says_so(load):
    project = load(text(tail='[project]\ncustomer = "a"\n')).tables["project"]
    with pytest.raises(
        DesignFileError, match=r'^optimize\.objective: "ppte" takes settings, which \[project\] does not give'
    ):
        project.quantity(None, "optimize.objective", quantities["ppte"])


def test_the_reference_lists_the_tables_of_the_library_alone():
    assert "my_seal" not in reference()
