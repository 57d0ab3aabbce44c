"""Axes that are not parallel open the gap over the face as a lead slope does: in the library, in files, in sweeps."""

import json

import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import FACE as SIZES
from catalogue import gear_pair, prepare
from commands import FACE, FIXED, LINE, assert_refused, call

import jaxgear as jg
from jaxgear.io import DesignFileError, Search, load_design
from jaxgear.shafts import Misalignment, RigidSupport

AMOUNT = 12.0
# on both gears: no pair touches with a tip corner, beyond the path of contact, where a misalignment closes with the
# lever of the transmission error and a slope does not
RELIEF = jg.TipRelief(15.0, 3.0)


@pytest.fixture(scope="module")
def pair():
    return gear_pair()


@pytest.fixture(scope="module")
def sloped(pair):
    return jg.solve(prepare(pair, resolution=SIZES), 50.0, pinion=RELIEF + jg.LeadSlope(AMOUNT), wheel=RELIEF)


@pytest.mark.slow
def test_misalignment_is_the_lead_slope_of_its_amount(pair, sloped):
    """Given over the face, or as f_Sigma_beta and f_Sigma_delta over the bearing span."""
    angle, width = float(pair.working_pressure_angle), float(pair.face_width)
    span, inclination = 120.0, 20.0
    skew = (AMOUNT * span / width - inclination * np.sin(angle)) / np.cos(angle)
    supports = [
        RigidSupport(pair, given) for given in (Misalignment(direct=AMOUNT), Misalignment(skew, inclination, span))
    ]
    mesh = jg.prepare(pair, resolution=SIZES, support=supports[0])
    gaps = [np.asarray(support.gap(mesh.face_coordinate)) for support in supports]
    np.testing.assert_allclose(gaps[1], gaps[0], rtol=1e-12, atol=1e-12)
    assert np.ptp(gaps[0]) == pytest.approx(AMOUNT * 5 / 6)  # between the middles of six slices
    found = jg.solve(mesh, 50.0, pinion=RELIEF + jg.LeadSlope(0.0), wheel=RELIEF)
    inside = np.broadcast_to(np.asarray(mesh.outside == 0), found.gap.shape)
    np.testing.assert_allclose(mesh.held(found.gap)[inside], sloped.gap[inside], rtol=1e-12, atol=1e-12)
    # two programs, each solved to 1e-11
    np.testing.assert_allclose(found.transmission_error, sloped.transmission_error, rtol=1e-11)
    np.testing.assert_allclose(found.line_load, sloped.line_load, rtol=1e-9, atol=1e-7)
    assert bool(jnp.all(found.converged)) and not np.asarray(found.line_load)[~inside].any()
    assert np.ptp(np.asarray(sloped.line_load)[0, :, 0]) > 50


@pytest.mark.slow
def test_a_slope_takes_a_misalignment_back(pair):
    mesh = jg.prepare(pair, resolution=SIZES, support=RigidSupport(pair, Misalignment(direct=AMOUNT)))
    level = jg.solve(mesh, 50.0, pinion=jg.LeadSlope(-AMOUNT))
    np.testing.assert_allclose(jg.metrics.face_load_factor(level), 1.0, atol=1e-9)


def test_one_slice_cannot_show_it(pair):
    with pytest.raises(ValueError, match="1 slice"):
        prepare_one = jg.Resolution(positions=8, pairs=2)
        jg.prepare(pair, resolution=prepare_one, support=RigidSupport(pair, Misalignment(direct=AMOUNT)))


# the gears of `gear_pair` with all their diameters: on the same support they share its programs
PAIR = FIXED.replace("19\nmodule = 3.0\n", "19\nmodule = 3.0\nbore_diameter = 24.0\ntip_diameter = 63.0\n").replace(
    "48\nmodule = 3.0\n", "48\nmodule = 3.0\nbore_diameter = 70.0\ntip_diameter = 150.0\n"
)


@pytest.fixture
def load(tmp_path):
    def write_and_load(table, tail=""):
        path = tmp_path / "gear.toml"
        path.write_text(f"{PAIR}\n[misalignment]\n{table}\n{tail}", encoding="utf-8")
        return load_design(path)

    return write_and_load


def test_design_files_take_it_and_enough_slices(load):
    file = load("direct = 12.0")
    assert file.resolution().slices == 11
    assert load("direct = 0.0").resolution().slices == load("").resolution().slices == 1
    with pytest.raises(DesignFileError, match=r"resolution.slices: must be at least 2, 1 cannot show misalignment"):
        load_one = PAIR.replace(LINE, f"{LINE}\nslices = 1")
        file.path.write_text(f"{load_one}\n[misalignment]\ndirect = 12.0\n")
        load_design(file.path)


@pytest.mark.slow
def test_design_file_gives_the_mesh_of_the_library(load):
    file = load("skew = 40.0\nbearing_span = 120.0")
    mesh = file.mesh(SIZES)
    given = Misalignment(skew=40.0, bearing_span=120.0)
    expected = jg.prepare(
        mesh.pair, compliance=mesh.compliance, resolution=SIZES, support=RigidSupport(mesh.pair, given)
    )
    cycles = [jg.solve(one, 50.0, pinion=jg.TipRelief(5.0, 3.0)) for one in (mesh, expected)]
    np.testing.assert_allclose(cycles[0].line_load, cycles[1].line_load, rtol=1e-12, atol=1e-10)


VARIABLES = "[variables]\nf = { low = 0.0, high = 20.0 }\n"


def test_an_optimization_does_not_vary_it(load):
    with pytest.raises(DesignFileError, match=r'misalignment\.direct: "f" is a variable, which a sweep alone'):
        Search.of(load('direct = "f"', VARIABLES + "[optimize]\n"))


@pytest.mark.slow
def test_its_numbers_are_variables_of_a_sweep(load):
    tail = VARIABLES + '[sweep]\nsampling = "full_factorial"\nlevels = 2\nresults = ["face_load_factor"]\n'
    file = load('direct = "f"', tail)
    assert file.resolution().slices == 11 and file.units == {"f": "um"}
    mesh = file.sweep_mesh(SIZES)
    assert not isinstance(mesh, jg.Mesh)
    parallel = jg.prepare(file.pair(), resolution=SIZES)
    meshes = mesh({"f": 0.0}), mesh({"f": 20.0}), parallel
    cycles = [jg.solve(each, 50.0, pinion=jg.TipRelief(5.0, 3.0)) for each in meshes]
    even, skew, without = (float(jg.metrics.face_load_factor(cycle)) for cycle in cycles)
    assert even == pytest.approx(without, abs=1e-9) and even == pytest.approx(1.0, abs=1e-9) and skew > 1.5


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("skew = 3.0", "misalignment.skew: 3 um needs bearing_span"),
        ("skew = 3.0\nbearing_span = 0", "misalignment.bearing_span"),
        ("tilt = 3.0", "misalignment.tilt"),
        ('direct = "much"', "misalignment.direct"),
    ],
)
def test_refusals_of_a_design_file(load, table, message):
    with pytest.raises(DesignFileError, match=message):
        load(table)


def test_the_command_refuses_it_in_one_line(tmp_path):
    path = tmp_path / "gear.toml"
    path.write_text(f"{FIXED}\n[misalignment]\nskew = 3.0\n")
    assert_refused(call("analyze", path, "-o", tmp_path / "out"), "misalignment.skew: 3 um needs bearing_span")
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_analyze_writes_what_is_seen_across_the_face(tmp_path):
    path = tmp_path / "gear.toml"
    path.write_text(FIXED.replace(LINE, FACE) + "\n[misalignment]\ndirect = 12.0\n")
    result = call("analyze", path, "-o", tmp_path / "out")
    assert result.code == 0 and "face load factor K_Hbeta" in result.out
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["misalignment_um"] == 12.0
    written = {entry.name for entry in (tmp_path / "out").iterdir()}
    assert {"contact_pattern.png", "line_load.png", "face_gap.png", "face_load_over_torque.png"} <= written
