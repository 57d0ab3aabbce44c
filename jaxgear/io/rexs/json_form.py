"""REXS files in JSON, the other form of the same model (REXS 1.5 and later).

A value stands under the name of its type: `{"id": "face_width", "unit": "mm", "floating_point": 20.0}`. Numbers are
read as text, so that their digits are those of the file.
"""

import json
from collections.abc import Callable
from typing import Any

from ..errors import DesignFileError
from .rexs_model import Attribute, Component, Model, Relation, current, origin
from .values import checked_version, decoded, whole

_SCALARS = (
    "floating_point",
    "integer",
    "boolean",
    "enum",
    "string",
    "reference_component",
    "file_reference",
    "date_time",
)
_ARRAYS = tuple(f"{kind}_array" for kind in ("floating_point", "integer", "boolean", "enum", "string"))
_CODED = "_coded"
_MAKE: dict[str, Callable[[str], Any]] = {
    "floating_point": float,
    "integer": int,
    "boolean": lambda text: text == "true",
}


def parse_json(content: bytes) -> Model:
    """The model of a file.

    Raises:
        DesignFileError: for what is not valid JSON, or no REXS model.
    """
    try:
        data = json.loads(content.decode("utf-8-sig"), parse_float=str, parse_int=str, parse_constant=str)
    except json.JSONDecodeError as error:
        raise DesignFileError("", f"line {error.lineno}, column {error.colno}: not valid JSON: {error.msg}") from None
    except UnicodeDecodeError:
        raise DesignFileError("", "not valid JSON: not UTF-8 text") from None
    except RecursionError:
        raise DesignFileError("", "not valid JSON: nested too deeply") from None
    root = _object(_object(data, "file").get("model"), "model")
    model = Model(checked_version(str(root.get("version", ""))))
    for item in _objects(root, "components"):
        model.put(_component(item))
    model.relations = [_relation(item) for item in _objects(root, "relations")]
    spectrum = root.get("load_spectrum")
    for case in [] if spectrum is None else _objects(_object(spectrum, "load_spectrum"), "load_cases"):
        said = [_component(item) for item in _objects(case, "components")]
        model.put_case(whole(case.get("id"), "load_case: id"), said)
    return model


def to_json(model: Model) -> bytes:
    """The file: UTF-8 with a byte order mark, as REXS has it."""
    root: dict[str, Any] = {
        **origin(model),
        "relations": [
            {
                "id": number,
                "type": relation.type,
                **({} if relation.order is None else {"order": relation.order}),
                "refs": [
                    {"id": part, "role": role, "hint": model.components[part].type} for role, part in relation.refs
                ],
            }
            for number, relation in enumerate(model.relations, 1)
        ],
        "components": [_written(component) for component in model.components.values()],
    }
    if model.cases:
        cases = [{"id": case, "components": [_written(c) for c in said.values()]} for case, said in model.cases.items()]
        root["load_spectrum"] = {"id": 1, "load_cases": cases}
    return b"\xef\xbb\xbf" + json.dumps({"model": root}, ensure_ascii=False, indent=1).encode("utf-8") + b"\n"


def _component(item: dict[str, Any]) -> Component:
    number = whole(item.get("id"), "component: id")
    component = Component(number, str(item.get("type", "")), str(item.get("name", "")))
    for attribute in _objects(item, "attributes"):
        name = str(attribute.get("id", ""))
        unit = attribute.get("unit")
        try:
            value = _value(attribute)
        except ValueError as error:
            raise component.refuse(name, str(error)) from None
        component.attributes[current(component.type, name)] = Attribute(value, None if unit is None else str(unit))
    return component


def _value(attribute: dict[str, Any]) -> str | tuple[str, ...] | None:
    for kind, value in attribute.items():
        if kind in _SCALARS:
            return _text(value)
        if kind in _ARRAYS:
            if not isinstance(value, list):
                raise ValueError(f"{kind} must be a list")
            return tuple(_text(item) for item in value)
        if kind.removesuffix(_CODED) in _ARRAYS:
            coded = value if isinstance(value, dict) else {}
            return decoded(str(coded.get("value", "")), str(coded.get("code", "")))
    return None


def _text(value: Any) -> str:
    if isinstance(value, list | dict):
        raise ValueError("must be a single value, not a list or an object")
    return "" if value is None else str(value).lower() if isinstance(value, bool) else value


def _relation(item: dict[str, Any]) -> Relation:
    kind, order = str(item.get("type", "")), item.get("order")
    where = f"relation {item.get('id', '')} ({kind}): ref: id"
    refs = tuple((str(ref.get("role", "")), whole(ref.get("id"), where)) for ref in _objects(item, "refs"))
    return Relation(kind, refs, None if order is None else whole(order, "relation: order"))


def _written(component: Component) -> dict[str, Any]:
    name = {"name": component.name} if component.name else {}
    return {
        "id": component.id,
        "type": component.type,
        **name,
        "attributes": [
            {"id": attribute, "unit": held.unit, held.kind: _plain(held)}
            for attribute, held in component.attributes.items()
        ],
    }


def _plain(held: Attribute) -> Any:
    """A value as JSON has it."""
    make = _MAKE.get(held.kind.removesuffix("_array"), str)
    return [make(item) for item in held.value] if isinstance(held.value, tuple) else make(held.value or "")


def _object(data: Any, where: str) -> dict[str, Any]:
    if not isinstance(data, dict):
        raise DesignFileError("", f"{where}: must be a JSON object")
    return data


def _objects(data: dict[str, Any], key: str) -> list[dict[str, Any]]:
    found = data.get(key, [])
    if not isinstance(found, list):
        raise DesignFileError("", f"{key}: must be a JSON array")
    return [_object(item, key) for item in found]
