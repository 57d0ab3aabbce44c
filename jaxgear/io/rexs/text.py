"""From a `Model` to the text of a REXS file in XML."""

from collections.abc import Iterable
from datetime import UTC, datetime
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from .model import Component, Model

_CASES = "1"  # id of the one load spectrum


def xml(model: Model) -> bytes:
    """The file: UTF-8 with a byte order mark, as REXS has it."""
    root = Element("model", origin(model))
    relations = SubElement(root, "relations")
    for number, relation in enumerate(model.relations, 1):
        order = {} if relation.order is None else {"order": str(relation.order)}
        element = SubElement(relations, "relation", {"id": str(number), "type": relation.type, **order})
        for role, part in relation.refs:
            SubElement(element, "ref", id=str(part), role=role, hint=model.components[part].type)
    _components(SubElement(root, "components"), model.components.values())
    if model.cases:
        spectrum = SubElement(root, "load_spectrum", id=_CASES)
        for case, said in model.cases.items():
            _components(SubElement(spectrum, "load_case", id=str(case)), said.values())
    indent(root)
    return b"\xef\xbb\xbf" + tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"


def _components(parent: Element, components: Iterable[Component]) -> None:
    for component in components:
        name = {"name": component.name} if component.name else {}
        element = SubElement(parent, "component", {"id": str(component.id), "type": component.type, **name})
        for attribute, held in component.attributes.items():
            unit = {} if held.unit is None else {"unit": held.unit}
            item = SubElement(element, "attribute", {"id": attribute, **unit})
            if isinstance(held.value, tuple):
                array = SubElement(item, "array")
                for value in held.value:
                    SubElement(array, "c").text = value
            else:
                item.text = held.value


def origin(model: Model) -> dict[str, str]:
    """Version of REXS, program and time."""
    return {
        "version": model.version,
        "applicationId": "jaxgear",
        "applicationVersion": _own_version(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def _own_version() -> str:
    from importlib import metadata

    try:
        return metadata.version("jaxgear")
    except metadata.PackageNotFoundError:  # code that runs uninstalled
        return "unknown"
