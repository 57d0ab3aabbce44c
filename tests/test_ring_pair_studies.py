"""Studies of internal pairs: signs of sliding and wear, inertia, coast flanks, rating, and files of ring gears."""

import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from typer.testing import CliRunner

import jaxgear as jg
from jaxgear.cli.app import app
from jaxgear.dynamics import equivalent_mass
from jaxgear.dynamics.force_map import _coast_phase
from jaxgear.geometry import outline, path_of_contact
from jaxgear.io import load_design, read_flank, write_design
from jaxgear.metrics.lubrication import ohlendorf_loss_factor
from jaxgear.metrics.stress import critical_section
from jaxgear.rating.mesh_geometry import mesh_geometry
from jaxgear.rating.root import rim_factor
from jaxgear.studies.optimization_result import _from_tip
from jaxgear.tolerance import ToleranceClass, profile_trace
from jaxgear.wear.worn_volume import deposit, passage_depth, specific_sliding, worn

BOTH = {"module": 3.0, "face_width": 20.0}
PLANET = jg.Gear(19, bore_diameter=24.0, **BOTH)
RING = jg.RingGear(64, cutter_teeth=25, root_radius=0.25, rim_diameter=236.4, **BOTH)
PAIR = jg.GearPair(PLANET, RING)


@pytest.fixture(scope="module")
def mesh():
    return jg.prepare(PAIR, resolution=jg.Resolution(positions=16))


def test_flanks_slide_by_the_difference_of_the_speeds():
    """v_g = w1 s (1 - z1 / z2), and Ohlendorf's loss factor is the mean of |v_g| / v_tb for even load sharing."""
    path = path_of_contact(PAIR)
    place = jnp.linspace(path.start, path.end, 9)
    speed = 1500 * np.pi / 30 * np.asarray(place) * (1 - 19 / 64) * 1e-3
    assert np.allclose(path.sliding_speed(place, 1500.0), speed, rtol=1e-12)
    fine = np.linspace(float(path.start), float(path.end), 400_001)
    single = (fine > float(path.inner_single)) & (fine < float(path.outer_single))
    mean = np.trapezoid(np.abs(fine) * np.where(single, 1.0, 0.5), fine) / float(path.base_pitch)
    wanted = mean * (1 / float(PLANET.base_radius) - 1 / abs(float(RING.base_radius)))
    assert float(ohlendorf_loss_factor(PAIR)) == pytest.approx(wanted, rel=1e-4)


@pytest.mark.slow
def test_both_flanks_wear_where_they_touch(mesh):
    """The same volume of both; one passage wears the ring rho_1 z_2 / (rho_2 z_1) times as deep as the planet."""
    cycle = jg.solve(mesh, 100.0)
    place = deposit(mesh, jnp.asarray(100.0), 65)
    depth = jnp.sum(worn(cycle.line_load, cycle.shift, 1e-18, place), axis=1)[:, 0]
    volumes = jnp.sum(depth * place.arc, axis=1)
    assert float(volumes[1]) == pytest.approx(float(volumes[0]), rel=1e-9) and float(volumes[0]) > 0
    of_planet, of_ring = passage_depth(cycle, 1e-18)
    rho = [np.abs(side.contact_roll_length) for side in mesh.sides]
    worn_there = np.asarray(of_planet > 0) & np.asarray(mesh.kinematics.outside == 0)
    ratio = (np.asarray(of_ring) * rho[1])[worn_there] / (np.asarray(of_planet) * rho[0])[worn_there]
    assert np.allclose(ratio, 64 / 19, rtol=1e-9)
    # in the middle between D and E one pair slides one way under half the load: the depth there is that of the passage
    path = mesh.path_of_contact
    s = 0.5 * (path.outer_single + path.end)
    of_place = [jnp.interp(path.wheel_roll_length(s), place.roll_length[1], depth[1])]
    load = jnp.interp(s, *(jnp.ravel(each[::-1, 0]) for each in (mesh.kinematics.path, cycle.line_load)))
    assert float(of_place[0]) == pytest.approx(1e-9 * float(load * specific_sliding(path, s)[1]), rel=0.03)


def test_inertia_of_a_ring_is_that_of_its_rim():
    outer, inner = 118.2e-3, 96e-3
    inertia = np.pi / 2 * 7850 * 20e-3 * (outer**4 - inner**4)
    solid = np.pi / 2 * 7850 * 20e-3 * (28.5e-3**4 - 12e-3**4)
    mass = 1 / (28.5e-3**2 / solid + 96e-3**2 / inertia) / np.cos(np.deg2rad(20)) ** 2
    density = float(PLANET.material.density) / 7850
    assert float(equivalent_mass(PAIR)) == pytest.approx(mass * density, rel=1e-9)


@pytest.mark.parametrize("shift", [0.0, 0.3])
def test_coast_flanks_touch_by_the_thickness_of_the_teeth(shift):
    """A planet tooth thicker by 4 x m tan(alpha) moves the middle by 4 x tan(alpha) / (2 pi) base pitches."""
    shifted = jg.GearPair(jg.Gear(19, profile_shift=shift, **BOTH), jg.RingGear(64, profile_shift=-shift, **BOTH))
    own = jg.prepare(shifted, resolution=jg.Resolution(positions=16))
    first, places, play = _coast_phase(own)
    middle = float(first) * 16 + float(places) + float(own.kinematics.first_phase) * 16
    wanted = 0.5 + 4 * shift * np.tan(np.deg2rad(20)) / (2 * np.pi)
    assert (middle / 16 - wanted + 0.5) % 1 - 0.5 == pytest.approx(0.0, abs=1e-9)
    assert float(play) == pytest.approx(0.0, abs=1e-6)


def test_critical_section_of_the_root_is_where_the_fillet_is_inclined_by_60_degrees():
    """Chord and depth against the fillet drawn point by point."""
    found, curves = critical_section(RING), outline(RING).curves
    g = jnp.linspace(0.5, 1.4, 20_001)
    x, y = map(np.asarray, curves.over(g.shape).trochoid(g))
    tangent = np.rad2deg(np.arctan2(np.abs(np.gradient(x)), np.abs(np.gradient(y))))
    at = np.argmin(np.abs(tangent - 60))
    assert float(found.chord) == pytest.approx(2 * x[at], abs=2e-3)
    assert float(found.depth) == pytest.approx(y[at], abs=2e-3)


def test_numbers_of_the_rating():
    """Contact stress by the signed u; Y_B of a ring; surface speeds with one sign; the reduced radius at C."""
    geometry = mesh_geometry(PAIR)
    assert float(geometry.gear_ratio) == pytest.approx(-64 / 19)
    assert float(geometry.center_distance) == pytest.approx(67.5)
    assert float(geometry.reduced_radius(0.0)) == pytest.approx(13.8632, abs=6e-5)
    pinion, wheel = geometry.surface_speeds(0.0, 1000.0)
    assert float(pinion) == pytest.approx(float(wheel))
    for rim, wanted in ((3.5 * 3, 1.0), (2.5 * 3, 1.15 * np.log(8.324 / 2.5)), (1.0, 1.15 * np.log(8.324 / 1.75))):
        ring = jg.RingGear(64, rim_diameter=199.5 + 2 * rim, **BOTH)
        assert float(rim_factor(ring)) == pytest.approx(wanted, rel=3e-3)


def test_place_of_a_relief_on_a_drawing_of_the_ring(mesh):
    """4 mm of roll length from the tip, at rho_2 = 24.960 mm, outwards."""
    said = _from_tip(mesh.sides[1], jg.TipRelief(10.0, 4.0), 4.0)
    diameter = float(re.search(r"diameter ([\d.]+) mm", said)[1])
    base, tip = 32 * 3 * np.cos(np.deg2rad(20)), np.sqrt(93.6**2 - (32 * 3 * np.cos(np.deg2rad(20))) ** 2)
    assert diameter == pytest.approx(2 * np.hypot(base, tip + 4), abs=1e-3)


@pytest.mark.parametrize("sign", [1, -1])
def test_flank_of_a_ring_from_a_file(tmp_path, mesh, sign):
    """Roll lengths of either sign, or diameters: the amount at the tip is that of the tip."""
    side, path = mesh.sides[1], tmp_path / "flank.csv"
    roll = np.linspace(-float(side.tip_roll_length), -float(side.start_roll_length), 5)
    rows = "".join(f"{sign * rho},{amount}\n" for rho, amount in zip(roll, (8.0, 3.0, 1.0, 0.5, 0.0)))
    path.write_text("roll_length_mm,modification_um\n" + rows)
    flank = read_flank(path, side=side)
    trace = profile_trace(side, flank)
    assert float(trace.design[-1]) == pytest.approx(-8.0, abs=1e-5)
    assert float(trace.design[0]) == pytest.approx(0.0, abs=1e-5)
    path.write_text("diameter_mm,modification_um\n187.2,8\n197.0,0\n")
    assert float(read_flank(path, base_radius=float(RING.base_radius)).amount[-1]) == 8.0


def test_tolerances_of_a_ring_are_those_of_its_diameter():
    ring, wheel = (ToleranceClass.of(gear, 6) for gear in (RING, jg.Gear(64, **BOTH)))
    assert float(ring.profile_slope) == float(wheel.profile_slope)


def test_design_files_of_ring_pairs(tmp_path):
    """`jaxgear new --ring` writes one that reads; what `write_design` writes is the same pair."""
    path = tmp_path / "new.toml"
    given = ["--teeth", "19", "64", "--module", "3", "--torque", "100", "--face-width", "20", "--ring"]
    assert CliRunner().invoke(app, ["new", str(path), *given]).exit_code == 0
    assert isinstance(load_design(path).pair().wheel, jg.RingGear)
    path = tmp_path / "written.toml"
    write_design(path, PAIR, torque=100.0, pinion=jg.NoModification(), wheel=jg.TipRelief(10.0, 4.0))
    design = load_design(path)
    assert jax.tree.all(jax.tree.map(lambda one, two: bool(one == two), design.pair().wheel, RING))
    assert float(design.design({})[1].amount) == 10.0
