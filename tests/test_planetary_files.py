"""Design files of planetary stages: what they mean, what they refuse, and quantities of the whole stage."""

import numpy as np
import pytest
from catalogue import LINE
from typer.testing import CliRunner

import jaxgear as jg
from jaxgear import planetary
from jaxgear.cli.app import app
from jaxgear.io import DesignFileError, load_design
from jaxgear.io.named_quantities import quantity_named
from jaxgear.metrics import Analysis
from jaxgear.numerics import changed
from jaxgear.planetary.table import StageSection
from jaxgear.studies.export import ExportStudy

STAGE = f"""
[sun]
teeth = 24
module = 3.0
face_width = 18.0

[planet]
teeth = 18
module = 3.0
face_width = 18.0

[ring]
teeth = 60
module = 3.0
face_width = 18.0
addendum = 0.8

[stage]
planets = 4
tangential_pin_error = [0.0, 0.0, 0.0, 0.0]
radial_pin_stiffness = 500.0
tangential_pin_stiffness = 500.0
pin_tolerance = 20.0
pin_samples = 3

[load]
torque = 400.0
speed = 1500.0

[resolution]
positions = {LINE.positions}
pairs = {LINE.pairs}
slide_steps = 0

[variables]
both = {{ low = 0.0, high = 30.0, value = 6.0 }}
ring = {{ low = 0.0, high = 30.0, value = 8.0 }}

[[planet.modification]]
type = "tip_relief"
amount = "both"
length = 4.0

[[ring.modification]]
type = "tip_relief"
amount = "ring"
length = 4.0
"""


def load(folder, text=STAGE):
    path = folder / "stage.toml"
    path.write_text(text)
    return load_design(path)


@pytest.mark.parametrize(
    ("driving", "fixed", "torque", "speed"),
    [
        ("sun", "ring", 1.0, 60 / 84),  # a driving sun turns against the carrier by z_r / (z_s + z_r) of its speed
        ("ring", "sun", 24 / 60, 60 / 84),
        ("carrier", "ring", 24 / 84, 60 / 24),
    ],
)
def test_a_mesh_carries_its_share_of_the_load(tmp_path, driving, fixed, torque, speed):
    """Torque on the sun by the ratio of torques, speeds against the carrier by Willis' equation."""
    text = STAGE.replace("planets = 4", f'planets = 4\ndriving = "{driving}"\nfixed = "{fixed}"')
    design = load(tmp_path, text)
    assert np.isclose(design.torque, 400.0 * torque / 4)
    np.testing.assert_allclose(design.torque_range, (0.5 * design.torque, 2 * design.torque))
    assert np.isclose(design.speed, 1500.0 * speed)
    point = design.operating_point(design.values)
    assert np.isclose(point.torque, design.torque) and np.isclose(point.speed, design.speed)


def test_flanks_of_a_stage(tmp_path):
    """A planet's modification is that of both flanks but where the flank towards the ring has its own."""
    design = load(tmp_path)
    assert design.bounds.keys() == {"both", "ring"} == set(design.design.names)
    sun, planet = design.design({"both": 5.0, "ring": 7.0})
    assert float(planet.to_sun.amount) == float(planet.to_ring.amount) == 5.0 and float(planet.ring.amount) == 7.0
    own = '\n[[planet.ring_modification]]\ntype = "tip_relief"\namount = 2.0\nlength = 3.0\n'
    planet = load(tmp_path, STAGE + own).design({"both": 5.0, "ring": 7.0})[1]
    assert float(planet.to_sun.amount) == 5.0 and float(planet.to_ring.amount) == 2.0
    bare = STAGE.partition("[variables]")[0]
    assert isinstance(load(tmp_path, bare).design({})[1], jg.microgeometry.NoModification)


def test_quantities_are_those_of_the_stage(tmp_path):
    """As `solve_stage` gives them; the 95 % quantile of three stages lies between their mean and the worst."""
    design = load(tmp_path)
    section = design.tables["stage"]
    assert isinstance(section, StageSection)
    settings = section.settings(design)
    sun, planet = design.design(design.values)
    analysis = Analysis(jg.solve(design.mesh(), design.torque, pinion=sun, wheel=planet))
    flanks = {"planet_to_sun": planet.to_sun, "planet_to_ring": planet.to_ring, "ring": planet.ring, "sun": sun}
    cycle = planetary.solve_stage(settings.prepared, 400.0, **flanks)
    found = quantity_named(design, "of", "stage_ppte_um")(analysis)
    assert np.isclose(found, np.ptp(cycle.transmission_error), rtol=1e-9) and cycle.converged.all()
    shares = []
    for errors in settings.pin_errors:
        stage = changed(settings.prepared.stage, tangential_pin_error=errors)
        with_errors = planetary.solve_stage(changed(settings.prepared, stage=stage), 400.0, **flanks)
        shares.append(float(with_errors.load_sharing_factor))
    assert len(shares) == 3 and min(shares) > 1.01
    found = float(quantity_named(design, "of", "load_sharing_factor_with_pin_errors")(analysis))
    assert np.mean(shares) < found < max(shares)


BARE = STAGE.partition("[variables]")[0]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[sun]", "[pinion]", "sun: missing, this table is required with [stage]"),
        ("[load]", "[wheel]\nteeth = 3\n\n[load]", "stage: has no effect with [wheel]: give [sun], [planet]"),
        ("[load]", "[tolerance]\nquality_class = 6\n\n[load]", "stage: has no effect with [tolerance]"),
        ("[load]", "[pair]\nbacklash = 50.0\n\n[load]", "pair.backlash: has no effect with [stage]"),
        ("teeth = 24", "teeth = 2", "sun.teeth: 2 must be at least"),
        ("teeth = 18", "teeth = 3", "planet.teeth: 3 must be at least"),
        ("teeth = 60", "teeth = 61", "stage: "),
        ("addendum = 0.8", "addendum = 3.0", "ring"),
        (
            "addendum = 0.8",
            'support = { type = "support_arcs", arcs = 6, width = 6.0 }',
            "ring.support: has to hold the ring of a stage alike all round",
        ),
        (
            "planets = 4\ntangential_pin_error = [0.0, 0.0, 0.0, 0.0]",
            "planets = 5",
            "stage: 84 teeth of sun and ring are no multiple of 5 planets",
        ),
        ("planets = 4", 'planets = 4\nfixed = "sun"', 'stage: driving = "sun" must not be the fixed member'),
        ("pin_tolerance = 20.0", "", "stage.pin_samples: 3 has no effect without stage.pin_tolerance"),
        ("torque = 400.0", "torque = -400.0", "load.torque: -400 N m is carried by the coast flanks"),
        ("torque = 400.0", 'torque = "t"', 'load.torque: "t"'),
        ("[stage]", "[stages]", "stages"),
    ],
)
def test_what_a_stage_refuses(tmp_path, old, new, message):
    """One line, with the names that the file has."""
    with pytest.raises(DesignFileError) as error:
        load(tmp_path, BARE.replace(old, new))
    text = str(error.value).removeprefix(f"{tmp_path}/stage.toml: ")
    assert text.startswith(message), text


def test_sun_and_planet_need_a_stage(tmp_path):
    pair = BARE.replace("[sun]", "[pinion]").replace("[planet]", "[wheel]").partition("[ring]")
    load_part = "[load]" + pair[2].partition("[load]")[2]
    text = pair[0] + load_part + "\n[sun]\nteeth = 24\nmodule = 3.0\nface_width = 18.0\n"
    with pytest.raises(DesignFileError, match=r"sun: has no effect without \[stage\]"):
        load(tmp_path, text)


def test_new_stage(tmp_path):
    """The file that `new` writes loads, with the ring that closes the stage; what cannot be assembled is refused."""
    path = tmp_path / "new.toml"
    given = ["--teeth", "26", "19", "--module", "3", "--torque", "650", "--face-width", "20"]
    result = CliRunner().invoke(app, ["new", str(path), *given, "--planetary", "5"])
    assert result.exit_code == 0, result.output
    design = load_design(path)
    assert design.torque == 130.0 and len(design.bounds) == 4
    refused = CliRunner().invoke(app, ["new", str(tmp_path / "b.toml"), *given, "--planetary", "4"])
    assert isinstance(refused.exception, ValueError) and "90 teeth of sun and ring" in str(refused.exception)
    assert not (tmp_path / "b.toml").exists()


def test_losses_of_a_stage_need_speed_and_friction(tmp_path):
    """The part of the power that the carrier takes along is not lost: 1 - (1 - eta_0) i_0 / (i_0 - 1)."""
    without = load(tmp_path, BARE.replace("speed = 1500.0", ""))
    with pytest.raises(DesignFileError, match=r'"stage_efficiency" needs load\.speed'):
        quantity_named(without, "of", "stage_efficiency")
    with pytest.raises(DesignFileError, match=r"needs load\.friction or the table \[lubricant\]"):
        quantity_named(load(tmp_path, BARE), "of", "stage_efficiency")


def test_vibration_of_a_stage_needs_the_inertia_of_its_carrier(tmp_path):
    """What a carrier alone has is refused without it, and so is the quantity."""
    with pytest.raises(DesignFileError, match=r'"stage_dynamic_factor" needs stage\.carrier_inertia'):
        quantity_named(load(tmp_path, BARE), "of", "stage_dynamic_factor")
    with pytest.raises(DesignFileError, match=r"stage\.damping_ratio: has no effect without stage\.carrier_inertia"):
        load(tmp_path, BARE.replace("planets = 4", "planets = 4\ndamping_ratio = 0.1"))
    soft = "planets = 4\ncarrier_support = 100.0\ncarrier_inertia = 0.1"
    with pytest.raises(DesignFileError, match=r"stage\.carrier_mass: missing"):
        load(tmp_path, BARE.replace("planets = 4", soft))


def test_what_knows_a_pair_alone_says_so(tmp_path):
    """A study of the mesh of sun and planet tells it."""
    design = load(tmp_path)
    assert ExportStudy.of(design).omits().startswith("the mesh of sun and planet alone")


def test_tilted_pins_need_slices(tmp_path):
    """Both meshes then have as many, and the flanks that carry with the ring have a key of their own."""
    tilted = load(tmp_path, BARE.replace("planets = 4", "planets = 4\ntangential_pin_tilt = [0.1, 0.1, 0.1, 0.1]"))
    assert tilted.resolution().slices > 1
    coast = '\n[[planet.coast_modification]]\ntype = "tip_relief"\namount = 2.0\nlength = 3.0\n'
    with pytest.raises(
        DesignFileError, match=r"planet\.coast_modification: has no effect with \[stage\]: planet\.ring"
    ):
        load(tmp_path, BARE + coast)
