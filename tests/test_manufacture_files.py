"""Files of manufacture: dressing points and drawing of the wheel, charts of the measuring machine, measured flanks."""

import csv
import sys

import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import COARSE, kahraman_gear

import jaxgear as jg
from jaxgear import io, manufacture
from jaxgear.contact.kinematics import kinematics


@pytest.fixture(scope="module")
def side():
    """Pinion of the 50/50 pair of contact ratio 1.37."""
    pair = jg.GearPair(kahraman_gear(), kahraman_gear())
    return kinematics(pair, jnp.asarray(0.0), COARSE, "strain").sides[0]


@pytest.fixture(scope="module")
def relief():
    return jg.TipRelief(6.0, 3.0, jg.Linear())


@pytest.fixture(scope="module")
def profile(side, relief):
    return manufacture.wheel_profile(side, relief, points=21)


def rows_of(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_points_of_the_wheel(side, profile, tmp_path):
    """Both flanks to a nanometre; the radius of the wheel falls by y."""
    path = io.write_wheel_points(tmp_path / "wheel.csv", profile, wheel=manufacture.GrindingWheel(150.0, 40.0))
    rows = rows_of(path)
    assert [row["flank"] for row in rows] == ["left"] * 21 + ["right"] * 21
    table = np.array([[float(value) for name, value in row.items() if name != "flank"] for row in rows])
    x, y, size, roll, removed, radius = table.T
    np.testing.assert_array_equal(x[:21], -x[21:])
    np.testing.assert_allclose(x[21:], profile.x, atol=5.1e-7)
    np.testing.assert_allclose(np.hypot(x, y + float(side.gear.root_circle_radius)), size / 2, atol=1e-6)
    np.testing.assert_allclose(radius + y, 150.0, atol=1e-9)
    assert removed[20] == 6.0 and roll[20] == pytest.approx(float(side.tip_roll_length), abs=1e-6)


def test_flanks_that_differ(side, profile, tmp_path):
    other = manufacture.wheel_profile(side, jg.NoModification(), points=21)
    rows = rows_of(io.write_wheel_points(tmp_path / "wheel.csv", profile, other))
    assert "wheel_radius_mm" not in rows[0]
    assert float(rows[20]["x_mm"]) < -float(rows[41]["x_mm"]), "the relieved side is wider"


def test_a_folder_that_is_not_there_is_named(profile, tmp_path):
    with pytest.raises(ValueError, match="missing/wheel.csv: cannot be written: No such file"):
        io.write_wheel_points(tmp_path / "missing" / "wheel.csv", profile)


def test_drawing_of_the_wheel_holds_the_points(profile, tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    path = io.write_wheel_drawing(tmp_path / "wheel.dxf", profile)
    drawing = ezdxf.readfile(path)
    assert drawing.units == 4, "millimetres"
    left, right = drawing.modelspace().query("LWPOLYLINE")
    np.testing.assert_allclose(right.get_points("xy"), np.stack([profile.x, profile.y], axis=1), rtol=1e-12)
    np.testing.assert_allclose(left.get_points("xy"), np.stack([-profile.x, profile.y], axis=1), rtol=1e-12)
    assert not drawing.audit().has_errors


def test_a_drawing_without_its_package_says_what_to_install(profile, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ezdxf", None)
    with pytest.raises(ModuleNotFoundError, match=r"write_wheel_drawing: .* ezdxf: pip install jaxgear\[cad\]"):
        io.write_wheel_drawing(tmp_path / "wheel.dxf", profile)
    assert not list(tmp_path.iterdir())
