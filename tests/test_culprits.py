"""Messages about gears that do not go together name the number that is wrong."""

import pytest

from jaxgear.io import DesignFileError, load_design

TEXT = """
[pinion]
teeth = 24
module = 2.0
face_width = 20.0
{pinion}
[wheel]
teeth = 48
module = {module}
face_width = 20.0
{wheel}
[pair]
{pair}
[load]
torque = {torque}
"""
IN_RADIANS = "helix_angle = 0.5236"


@pytest.mark.parametrize(
    "key, said, numbers",
    [
        ("wheel.module", "3 mm must equal", {"module": 3.0, "wheel": "tip_diameter = 100.0"}),
        ("pinion.helix_angle", "30 deg?", {"pinion": f"{IN_RADIANS}\ntip_diameter = 59.43"}),
        ("pinion.helix_angle", "30 deg?", {"pinion": IN_RADIANS, "pair": "center_distance = 83.14"}),
        ("pinion.teeth_spanned", "15.4329 mm over 3 teeth", {"pinion": "span = 15.4\nteeth_spanned = 4"}),
        ("pinion.teeth_spanned", "15.4329 mm over 3 teeth", {"pinion": "span = 15.4\nteeth_spanned = 2"}),
        ("load.torque", "at most 250 um per mm of module", {"torque": 180_000.0}),
    ],
)
def test_the_wrong_number_is_named(tmp_path, key, said, numbers):
    path = tmp_path / "design.toml"
    path.write_text(TEXT.format(**{"module": 2.0, "pinion": "", "wheel": "", "pair": "", "torque": 50.0, **numbers}))
    with pytest.raises(DesignFileError) as found:
        load_design(path).resolution()
    assert f"{key}: " in str(found.value) and said in str(found.value)
