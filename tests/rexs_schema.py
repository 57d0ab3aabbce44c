"""Holds a REXS file against the data model of REXS: every component, attribute, unit, value and relation."""

import lzma
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

FOLDER = Path(__file__).parent / "rexs"
_KINDS = {
    "floating_point": r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?",
    "integer": r"[+-]?\d+",
    "boolean": "true|false",
    "string": ".*",
    "reference_component": r"\d+",
}


class DataModel:
    """What the schema allows."""

    def __init__(self):
        root = ElementTree.fromstring(lzma.decompress((FOLDER / "rexs_schema_2.0.xml.xz").read_bytes()))
        units = {unit.get("id"): unit.get("name") for unit in root.find("units")}
        kinds = {kind.get("id"): kind.get("name") for kind in root.find("valueTypes")}
        attributes = {
            attribute.get("numericId"): (
                units[attribute.get("unit")],
                kinds[attribute.get("valueType")],
                {value.get("value") for value in attribute.iter("enumValue")},
                tuple(float(attribute.get(f"range{end}", sign)) for end, sign in (("Min", "-inf"), ("Max", "inf"))),
            )
            for attribute in root.find("attributes")
        }
        self.components = {component.get("componentId") for component in root.find("components")}
        self.attributes = {
            (mapping.get("componentId"), mapping.get("attributeId")): attributes[mapping.get("attributeNumericId")]
            for mapping in root.find("componentAttributeMappings")
        }
        self.ordered = {r.get("relationId") for r in root.find("relations") if r.get("orderRequired") == "true"}
        self.relations = {
            (relation.get("relationId"), frozenset((role.get("roleId"), role.get("componentId")) for role in allowed))
            for relation in root.find("relations")
            for allowed in relation.find("allowedCombinations")
        }


@cache
def data_model() -> DataModel:
    """The data model of REXS 2.0."""
    return DataModel()


def faults(content: bytes) -> list[str]:
    """What is not of the data model, one line each."""
    root, model = ElementTree.fromstring(content), data_model()
    types = {part.get("id"): part.get("type") for part in root.iterfind("components/component")}
    return [
        *(fault for part in root.iter("component") for fault in _component(part, types, model)),
        *(fault for relation in root.iter("relation") for fault in _relation(relation, types, model)),
    ]


def _component(part, types, model: DataModel) -> Iterator[str]:
    kind = part.get("type")
    if kind not in model.components:
        yield f"component {kind}"
    if types.get(part.get("id")) != kind:
        yield f"{kind} {part.get('id')} is another component elsewhere"
    for attribute in part.iterfind("attribute"):
        name = attribute.get("id")
        if name.startswith("custom_"):  # left to programs
            continue
        if (kind, name) not in model.attributes:
            yield f"{kind}: {name}"
            continue
        unit, value, choices, (low, high) = model.attributes[kind, name]
        if attribute.get("unit") != unit:
            yield f"{kind}: {name}: unit {attribute.get('unit')} is not {unit}"
        array = attribute.find("array")
        if (array is not None) != value.endswith("_array"):
            yield f"{kind}: {name} is not {value}"
            continue
        texts = [attribute.text or ""] if array is None else [item.text or "" for item in array]
        for text in texts:
            single = value.removesuffix("_array")
            if (single == "enum" and text not in choices) or not re.fullmatch(_KINDS.get(single, ".*"), text):
                yield f"{kind}: {name}: {text} is not of {value}"
            elif single in ("floating_point", "integer") and not low <= float(text) <= high:
                yield f"{kind}: {name}: {text} is not within {low:g} and {high:g}"


def _relation(relation, types, model: DataModel) -> Iterator[str]:
    kind = relation.get("type")
    roles = frozenset((ref.get("role"), types.get(ref.get("id"))) for ref in relation)
    if (kind, roles) not in model.relations or len(roles) != len(relation):
        yield f"relation {kind}: {sorted(roles)}"
    if kind in model.ordered and not relation.get("order"):
        yield f"relation {kind} has no order"
    for ref in relation:
        if ref.get("hint") not in (None, types.get(ref.get("id"))):
            yield f"relation {kind}: hint {ref.get('hint')}"
