"""Tables of a mesh for other programs: what they hold agrees with the contact, and the command `jaxgear export`."""

import importlib
from dataclasses import replace

import numpy as np
import pytest
from commands import FIXED, assert_refused, call
from helical_pairs import SIZES, pair_of

import jaxgear as jg
from jaxgear import dynamics
from jaxgear.dynamics.mesh_tables import FILES
from jaxgear.io import load_design
from jaxgear.studies import ExportStudy

RELIEF = jg.TipRelief(6.0, 4.0)
POSITIONS = 16  # of the force map, that of the command too: one program for both


@pytest.fixture(scope="module")
def spur(tmp_path_factory):
    """A mesh, and its tables at 50 N m and close to it."""
    path = tmp_path_factory.mktemp("export") / "pair.toml"
    path.write_text(FIXED, encoding="utf-8")
    mesh = load_design(path).mesh()
    return mesh, dynamics.mesh_tables(mesh, 50.0, [30.0, 49.9, 50.1], pinion=RELIEF, positions=POSITIONS)


def written(path):
    """Lines of the header, columns and numbers of a table."""
    lines = path.read_text(encoding="utf-8").splitlines()
    about = [line[2:] for line in lines if line.startswith("# ")]
    return about, lines[len(about)].split(","), np.loadtxt(lines[len(about) + 1 :], delimiter=",")


def test_the_tables_are_those_of_the_contact(spur):
    mesh, tables = spur
    assert tables.torques.tolist() == [30.0, 49.9, 50.0, 50.1] and tables.converged
    cycle = jg.solve(mesh, 50.0, pinion=RELIEF)
    np.testing.assert_array_equal(tables.transmission_error[2], cycle.transmission_error)
    # the stiffness is the slope of force over transmission error
    force = 0.2e3 / tables.base_radius[0]
    slope = force / (tables.transmission_error[3] - tables.transmission_error[1])
    np.testing.assert_allclose(tables.stiffness[2], slope, rtol=1e-3)
    # the force map carries the load at the static transmission error
    static = [np.interp(*of) for of in zip(tables.transmission_error[2], tables.map_dte, tables.map_force)]
    np.testing.assert_allclose(static, 50e3 / tables.base_radius[0], rtol=5e-3)
    np.testing.assert_allclose(tables.map_phase, tables.phase)
    assert (np.diff(tables.map_dte) >= 0).all() and (np.diff(tables.map_force) >= 0).all()


def test_orders_add_up_to_the_transmission_error(spur):
    """All but the one at half of the positions, which 16 positions cannot tell from a shift."""
    _, tables = spur
    angle = 360 * tables.order[:, None] * tables.phase + tables.order_phase[2][:, None]
    error = tables.transmission_error[2]
    found = error.mean() + tables.amplitude[2] @ np.cos(np.deg2rad(angle))
    highest = np.mean(error * (-1.0) ** np.arange(16)) * (-1.0) ** np.arange(16)
    np.testing.assert_allclose(found, error - highest, atol=1e-9)


def test_files_say_units_signs_and_axes(spur, tmp_path):
    _, tables = spur
    tables.write(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == set(FILES)
    with np.load(tmp_path / "mesh.npz") as kept:
        for name in ("torques", "transmission_error", "stiffness", "map_dte", "map_force", "equivalent_mass"):
            np.testing.assert_array_equal(kept[name], getattr(tables, name))
        text = "\n".join(kept["about"])
        assert all(f"{name}: " in text for name in kept.files if name != "about") and "positive under load" in text
    about, columns, rows = written(tmp_path / "transmission_error.csv")
    assert columns == ["phase", "30_Nm", "49.9_Nm", "50_Nm", "50.1_Nm"] and "[um]" in about[0]
    np.testing.assert_allclose(rows[:, 1:].T, tables.transmission_error, rtol=1e-8)
    about, columns, rows = written(tmp_path / "force_map.csv")
    assert columns == ["phase", "dte_um", "force_N"] and rows.shape == (16 * 96, 3)
    np.testing.assert_allclose(rows[:, 2], tables.map_force.ravel(), rtol=1e-8)
    _, columns, rows = written(tmp_path / "te_orders.csv")
    assert columns == ["torque_Nm", "order", "amplitude_um", "phase_deg"] and len(rows) == 4 * 7
    with pytest.raises(ValueError, match="did not converge"):
        replace(tables, status=np.asarray(1)).write(tmp_path / "other")
    assert not (tmp_path / "other").exists()


@pytest.mark.slow
def test_helical_gears():
    mesh = jg.prepare(pair_of(), resolution=SIZES)
    tables = dynamics.mesh_tables(mesh, 150.0, positions=8, levels=8)
    assert tables.converged and tables.order.tolist() == [1, 2, 3]
    static = [np.interp(*of) for of in zip(tables.transmission_error[0], tables.map_dte, tables.map_force)]
    np.testing.assert_allclose(static, 150e3 / tables.base_radius[0], rtol=1e-2)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"torque": 0.0}, "torque = 0 N m must be greater than 0 N m"),
        ({"torques": [-1.0]}, "torques = -1 N m must be at least 0 N m"),
        ({"torques": [float("nan")]}, "torques = nan N m must be"),
        ({"orders": 8}, "orders = 8 must be at most 7"),
        ({"levels": 1}, "levels = 1 must be a whole number of at least 4"),
    ],
)
def test_what_is_refused(spur, given, message):
    with pytest.raises(ValueError) as refused:
        dynamics.mesh_tables(spur[0], **{"torque": 50.0, **given})
    assert message in str(refused.value) and "\n" not in str(refused.value)


def test_the_command(tmp_path, monkeypatch):
    monkeypatch.setattr(importlib.import_module("jaxgear.studies.export"), "_QUICK_POSITIONS", POSITIONS)
    path = tmp_path / "pair.toml"
    path.write_text(FIXED, encoding="utf-8")
    assert_refused(call("export", tmp_path / "none.toml"), "none.toml: No such file")
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken" / "notes.txt").touch()
    assert_refused(call("export", path, "-o", tmp_path / "taken"), "taken: holds other files than results of jaxgear")
    assert [one.name for one in (tmp_path / "taken").iterdir()] == ["notes.txt"]
    result = ExportStudy.of(load_design(path), quick=True).run()
    assert result.name == "modified" and not list(result.failures())
    assert result.mesh.torques.tolist() == [*np.linspace(30, 60, 7)] == np.unique(result.mesh.torques).tolist()
    summary = result.summary()
    assert summary["mesh_frequency_Hz"] == pytest.approx(19 * 3000 / 60) and summary["files"] == list(FILES)
    (table,) = result.tables()
    assert len(table.rows) == 3
    lost = replace(result, mesh=replace(result.mesh, status=np.asarray(1)))
    lost.write(tmp_path / "lost")
    assert "the tables are not written" in next(lost.failures()) and not (tmp_path / "lost").exists()
