"""A misspelt key is reported before JAX is imported, in the words of the full check."""

import json
import subprocess
import sys

import pytest
from design_texts import loaded, text

from jaxgear.io import DesignFileError
from jaxgear.io.first_look import KEYS, check_keys
from jaxgear.io.reference import checked_tables, known_keys
from jaxgear.io.table_keys import decode

RELIEF = '[[pinion.modification]]\ntype = "tip_relief"\namount = 5.0\nlenght = 3.0\n'
ENDS = "_in", "_psi", "_lbf_in"
TYPOS = {
    "top level": text(tail="[lode]\ntorque = 1.0"),
    "gear": text(wheel="face_widht = 3.0"),
    "load": text(load="application_factor = 1.25"),
    "further table": text(tail="[sweep]\nsampels = 8"),
    "modification": text(pinion=RELIEF),
    "variable": text(tail="[variables.height]\nlow = 0.0\nhihg = 1.0"),
    "not TOML": text(load="speed = 1,5"),
}


def test_the_keys_are_those_of_the_classes():
    said = "python -m jaxgear.io keys > keys.json && mv keys.json jaxgear/io/"
    assert json.loads(KEYS.read_text(encoding="utf-8")) == known_keys(), said


def test_the_first_look_refuses_nothing_that_a_table_takes():
    """Words of the trade and keys that end in a unit, which the table does not know either."""
    words = "diametral_pitch", "tip_chamfer", "root_diameter", "backlash", "application_factor", "double_helical"
    known = {kind: set(keys) for kind, keys in json.loads(KEYS.read_text(encoding="utf-8")).items()}
    for kind, section in checked_tables().items():
        for name in {*words, *(f"{key}{end}" for key in section.keys for end in ENDS)} - known[kind]:
            with pytest.raises(DesignFileError, match="unknown key"):
                decode("table", {name: 1.0}, section)


@pytest.mark.parametrize("case", TYPOS)
def test_the_first_look_says_what_the_full_check_says(tmp_path, case):
    with pytest.raises(DesignFileError) as full:
        loaded(tmp_path, TYPOS[case])
    with pytest.raises(DesignFileError) as first:
        check_keys(tmp_path / "gear.toml")
    assert str(first.value) == str(full.value)


def test_what_a_user_may_add_is_left_to_the_full_check(tmp_path):
    file = tmp_path / "gear.toml"
    file.write_text(text(pinion=RELIEF.replace('"tip_relief"', '"my_relief"'), load="torque_range = 5"))
    check_keys(file)


def test_a_typo_is_reported_before_anything_slow_is_imported(tmp_path):
    file = tmp_path / "gear.toml"
    file.write_text(text(pinion="tip_diametre = 63.0"))
    code = "import sys\nfrom jaxgear.cli import main\ntry: main(sys.argv[1:])\nfinally: print('numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code, "analyze", file], capture_output=True, text=True)
    assert done.returncode == 2 and 'pinion.tip_diametre: unknown key, did you mean "tip_diameter"?' in done.stderr
    assert done.stdout == "False\n"  # neither NumPy nor what is built on it, which takes seconds
