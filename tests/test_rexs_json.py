"""REXS files in JSON say what those in XML say."""

import base64
import json
from types import SimpleNamespace

import equinox as eqx
import numpy as np
import pytest
from rexs_schema import data_model

import jaxgear as jg
from jaxgear.io import DesignFileError
from jaxgear.rexs import read_rexs, write_rexs

PAIR = jg.GearPair(
    jg.Gear(teeth=19, module=3.0, face_width=20.0, bore_diameter=24.0, tooth_thickness_allowance=-33.3),
    jg.Gear(teeth=48, module=3.0, face_width=18.0, bore_diameter=70.0),
    100.5,
)
PINION = jg.TipRelief(6.9, 3.0, jg.Linear()) + jg.LeadSlope(4.1) + jg.TabulatedProfile([9.0, 12.0], [0.0, 2.3])


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rexs")
    found = SimpleNamespace(xml=folder / "pair.rexs", json=folder / "pair.rexsj", path=folder / "changed.rexsj")
    for path in (found.xml, found.json):
        write_rexs(path, PAIR, pinion=PINION, torque=50.0, speed=3000.0, title="über 19/48")
    found.data = json.loads(found.json.read_text("utf-8-sig"))
    return found


def test_both_forms_say_the_same(written):
    by_xml, by_json = read_rexs(written.xml), read_rexs(written.json)
    assert eqx.tree_equal(by_xml.pair, by_json.pair) and by_xml.title == by_json.title == "über 19/48"
    assert (by_json.torque, by_json.speed) == (50.0, 3000.0)
    assert eqx.tree_equal(by_xml.pinion, by_json.pinion, rtol=1e-13, atol=1e-13)


def test_every_value_stands_under_the_name_of_its_type(written):
    model, checked = data_model(), 0
    cases = [part for case in written.data["model"]["load_spectrum"]["load_cases"] for part in case["components"]]
    for component in written.data["model"]["components"] + cases:
        for attribute in component["attributes"]:
            if not attribute["id"].startswith("custom_"):
                unit, kind, choices, _ = model.attributes[component["type"], attribute["id"]]
                assert set(attribute) == {"id", "unit", kind} and attribute["unit"] == unit
                assert kind != "enum" or attribute["enum"] in choices
                checked += 1
    assert checked > 60


def test_arrays_may_be_in_base64(written):
    data = json.loads(json.dumps(written.data))
    parts = [part for part in data["model"]["components"] if part["type"] == "topographical_modification"]
    for item in parts[0]["attributes"]:
        if "floating_point_array" in item:
            values = np.array(item.pop("floating_point_array"), "<f8")
            item["floating_point_array_coded"] = {"code": "float64", "value": base64.b64encode(values).decode()}
    written.path.write_text(json.dumps(data))
    assert eqx.tree_equal(read_rexs(written.path).pinion, read_rexs(written.json).pinion)
    item["floating_point_array_coded"]["code"] = "float16"
    written.path.write_text(json.dumps(data))
    with pytest.raises(DesignFileError, match='code "float16" is not known, must be one of float64, float32, int32'):
        read_rexs(written.path)


@pytest.mark.parametrize(
    "text, wanted",
    [
        ("{", "line 1, column 2: not valid JSON: Expecting property name"),
        ("{}", "model: must be a JSON object"),
        ('{"model": []}', "model: must be a JSON object"),
        ('{"model": {"version": "2.0.0", "components": {}}}', "components: must be a JSON array"),
        ('{"model": {"version": "2.0.0", "components": [1]}}', "components: must be a JSON object"),
        ('{"model": {"version": "2.0.0", "components": [{"id": 1.5}]}}', 'component: id: "1.5" is not a whole number'),
        ('{"model": {"version": "2.0.0"}}', "has no cylindrical_stage"),
        ('{"model": {"version": 2}}', 'model: version: "2" is not a version of REXS'),
        ('{"model":' * 5000, "not valid JSON"),
        (b'{"\xff', "not valid JSON: not UTF-8 text"),
    ],
)
def test_what_is_no_model_is_refused_in_one_line(written, text, wanted):
    written.path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(DesignFileError) as caught:
        read_rexs(written.path)
    assert wanted in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("value", [[1.0], {"a": 1}, None, True, "abc", 1e999])
def test_what_is_no_number_is_refused(written, value):
    data = json.loads(json.dumps(written.data))
    gear = next(part for part in data["model"]["components"] if part["type"] == "cylindrical_gear")
    width = next(item for item in gear["attributes"] if item["id"] == "face_width")
    width["floating_point"] = value
    written.path.write_text(json.dumps(data))
    with pytest.raises(DesignFileError, match="cylindrical_gear 3: face_width: "):
        read_rexs(written.path)
