"""A negative torque in a design file: the coast flanks with their own modifications, and who does not know them."""

import pytest

import jaxgear as jg
from jaxgear.io import DesignFileError, load_design
from jaxgear.rexs.convert import convert
from jaxgear.studies import AnalysisStudy
from jaxgear.studies.study import AbstractStudy

FILE = """
[pinion]
teeth = 19
module = 3.0
face_width = 20.0
helix_angle = 15.0
{pinion}

[wheel]
teeth = 48
module = 3.0
face_width = 20.0
{wheel}

[load]
torque = {torque}
"""
BOTH = '[[pinion.modification]]\ntype = "lead_slope"\namount = 6.0\n'
OWN = """
[[pinion.coast_modification]]
type = "lead_slope"
amount = "slope"

[variables]
slope = { low = 0, high = 9, value = 2 }
"""


@pytest.fixture
def load(tmp_path):
    def load(torque, pinion="", wheel="", further=""):
        text = FILE.format(torque=torque, pinion=pinion, wheel=wheel)
        (tmp_path / "pair.toml").write_text(text + further, encoding="utf-8")
        return load_design(tmp_path / "pair.toml")

    return load


def test_a_design_file_analyzes_the_flanks_that_carry_its_torque(load):
    drive, coast, own = load(150, further=BOTH), load(-150.0, further=BOTH), load(-150.0, further=BOTH + OWN)
    assert not drive.coast and coast.coast and coast.torque == 150.0 and coast.signed_torque == -150.0
    assert coast.torque_range == (75.0, 300.0) and float(coast.operating_point({}).torque) == 150.0
    assert float(coast.pair().pinion.helix_angle) == 15.0 and float(coast._meshing.pinion.helix_angle) == -15.0
    assert drive._meshing == drive.pair() and coast.load_in_words == "-150 N m, coast flanks,"
    amounts = [float(file.design(file.values)[0].amount) for file in (drive, coast, own, load(150, further=BOTH + OWN))]
    assert amounts == [6.0, 6.0, 2.0, 6.0]
    assert own.bounds == {"slope": (0.0, 9.0)} and load(150, further=BOTH + OWN).bounds == {}
    bare = load(-150.0, pinion="coast_modification = []", further=BOTH)
    assert isinstance(bare.design({})[0], jg.NoModification)


def test_what_knows_drive_flanks_alone_says_so(load, tmp_path):
    known = "load.torque: -150 N m is carried by the coast flanks, which {} does not know: give a positive torque"
    for table, name in (("[misalignment]\ndirect = 3.0\n", "misalignment"), ("[dynamics]\n", "dynamics")):
        with pytest.raises(DesignFileError) as refused:
            load(-150.0, further=table)
        assert known.format(f"[{name}]") in str(refused.value)

    class Other(AbstractStudy):
        name = "other"
        work_out = None

    design = load(-150.0)
    with pytest.raises(DesignFileError) as refused:
        Other.of(design).run()
    assert known.format("jaxgear other") in str(refused.value) and AnalysisStudy.takes_coast
    options = {"stage": None, "flank": None, "load_case": None, "torque": None, "given": ()}
    with pytest.raises(DesignFileError, match="coast flanks, which jaxgear convert does not know"):
        convert(tmp_path / "pair.toml", tmp_path / "pair.rexs", **options)
    with pytest.raises(DesignFileError, match="load.torque: 0 N m must be greater than 0 N m"):
        load(0)
