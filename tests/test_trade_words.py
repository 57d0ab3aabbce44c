"""Words of the trade in design files: each says what to do, and none suggests a key for another quantity."""

import re

import numpy as np
import pytest
from design_texts import text

import jaxgear as jg
from jaxgear import io
from jaxgear.io.design_file import FileSection
from jaxgear.io.gears import GearSection, PairSection
from jaxgear.io.tables import LoadSection
from jaxgear.io.trade_words import _ADVICE, _SAME, remark_on, unknown_key

TABLES = {
    "pinion": GearSection.keys.keys(),
    "pair": PairSection.keys.keys(),
    "load": LoadSection.keys.keys(),
    "": FileSection.keys.keys(),
}


@pytest.mark.parametrize("word", _ADVICE)
def test_no_word_of_another_quantity_suggests_a_key(word):
    for keys in TABLES.values():
        said = unknown_key(word, keys)
        # the same symbol may be a key of another table: m is a module or a torque
        assert "did you mean" not in said or any(word in words.split() for words in _SAME.values()), said


@pytest.mark.parametrize(
    ("table", "word", "said"),
    [
        ("pinion", "diametral_pitch", "module = 25.4 mm / diametral pitch"),
        ("pinion", "transverse_module", "module = transverse module x cos(helix_angle)"),
        ("pinion", "tip_chamfer", "tip_form_diameter = tip_diameter - 2 x"),
        ("pinion", "active_tip_diameter", 'did you mean "tip_form_diameter"?'),
        ("pinion", "d_Na1", 'did you mean "tip_form_diameter"?'),
        ("pinion", "d_Nf1", "follows from the mate's tip: end that at its tip_form_diameter"),
        ("pinion", "herringbone", "one of its halves"),
        ("pinion", "root_diameter", "dedendum = (d - d_f) / (2 module) + profile_shift"),
        ("pinion", "pitch_diameter", "follows from teeth, module and helix_angle"),
        ("pinion", "h_aP", "addendum is a coefficient"),
        ("pair", "circumferential_backlash", "backlash = j_wt cos(alpha_wt) cos(beta_b)"),
        ("pair", "gear_ratio", "follows from the teeth"),
        ("load", "application_factor", "multiply load.torque by it"),
        ("load", "K_A", "multiply load.torque by it"),
        ("load", "output_torque", "torque x z1 / z2"),
        ("", "backlash", "is the key of the table [pair]"),
        ("pinion", "x1", 'did you mean "profile_shift", in modules?'),
        ("pinion", "alpha_n", 'did you mean "pressure_angle"?'),
        ("pinion", "b", 'did you mean "face_width"?'),
        ("pinion", "outside_diameter", 'did you mean "tip_diameter"?'),
        ("pinion", "facewidth", 'did you mean "face_width"?'),
        ("pinion", "face_wdith", 'did you mean "face_width"?'),
    ],
)
def test_a_word_of_the_trade_says_what_to_do(table, word, said):
    assert said in unknown_key(word, TABLES[table])


@pytest.mark.parametrize("word", ["base_helix", "pitch_diam", "reference_diameters", "tip_width"])
def test_likeness_of_letters_alone_suggests_nothing(word):
    """Half of the letters of a key of another quantity: the keys are listed instead."""
    assert unknown_key(word, TABLES["pinion"]).startswith("unknown key, must be one of addendum, ")


def test_the_conversions_are_right():
    """The formulas that are told give the quantity that they start from."""
    helix, normal = np.deg2rad(23.0), np.deg2rad(20.0)
    gear = jg.Gear(25, 3.0, 20.0, 0.2, helix_angle=23.0, face_width=30.0)
    reference, root = 2 * float(gear.pitch_radius), 2 * float(gear.root_circle_radius)
    assert (reference - root) / (2 * 3.0) + 0.2 == pytest.approx(1.25, rel=1e-6)
    assert reference / 25 * np.cos(helix) == pytest.approx(3.0, rel=1e-6)  # transverse module
    assert np.sin(float(gear.base_helix_angle)) / np.cos(normal) == pytest.approx(np.sin(helix), rel=1e-6)


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("pinion.quality_class", "A8", "quality_class = 8"),
        ("pinion.quality_class", "Q10", "about 17 - Q"),
        ("tolerance.quality_class[1]", "7", "quality_class = 7"),
        ("pinion.teeth", -30, "internal gear"),
        ("load.torque", "50,5", "write 50.5 without quotes"),
        ("load.speed", "fast", ""),
    ],
)
def test_a_value_that_is_refused_says_what_to_write(key, value, said):
    assert said in remark_on(key, value) and bool(said) == bool(remark_on(key, value))


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (text().replace("teeth = 48", "teeth = -48"), "-48 must be at least 5: a negative number means an"),
        (text(pinion='quality_class = "A8"'), "must be a whole number, not a string: write the"),
        (text(pinion='material = "16MnCr5"'), '"16MnCr5" is not known, must be one of STEEL, or a table ['),
        (text(wheel='profile_shift = "0,5"'), '"0,5" must be a number in x module alone: write 0.5 without quotes'),
        (text(wheel="profile_shift = 0,5"), "; if 0,5 has a decimal comma, write 0.5"),
    ],
)
def test_the_file_is_refused_in_these_words(tmp_path, content, said):
    file = tmp_path / "gear.toml"
    file.write_text(content)
    with pytest.raises(io.DesignFileError, match=re.escape(said)) as error:
        io.load_design(file)
    assert "\n" not in str(error.value)
