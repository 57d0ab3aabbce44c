"""REXS files in XML.

A file comes from anywhere, so it is read without a document type: Expat reports the start of one before anything that
it declares is looked at, and the file is refused there. Without declarations there are no entities to expand, inside
the file or from elsewhere. REXS has a schema (XSD) and no document type, so that no proper file is lost.
"""

from collections.abc import Iterable
from typing import Any
from xml.etree.ElementTree import Element, SubElement, TreeBuilder, indent, tostring
from xml.parsers import expat

from ..io.errors import DesignFileError

_DEEPEST = 16  # twice the depth of the schema


def parse_xml(content: bytes) -> dict[str, Any]:
    """The data of a file, see `model`.

    Raises:
        DesignFileError: for what is not well-formed XML, declares a document type or is no REXS model.
    """
    root = _tree(content)
    if root.tag != "model":
        raise DesignFileError("", f"<{root.tag}> is not the <model> of a REXS file")
    relations = [
        {**each.attrib, "refs": [ref.attrib for ref in each.iterfind("ref")]}
        for each in root.iterfind("relations/relation")
    ]
    cases = [
        {**case.attrib, "components": _read(case.iterfind("component"))}
        for case in root.iterfind("load_spectrum/load_case")
    ]
    components = _read(root.iterfind("components/component"))
    spectrum = {"load_cases": cases}
    return {**root.attrib, "components": components, "relations": relations, "load_spectrum": spectrum}


def _read(components: Iterable[Element]) -> list[dict[str, Any]]:
    return [
        {**each.attrib, "attributes": [_attribute(item) for item in each.iterfind("attribute")]} for each in components
    ]


def _attribute(element: Element) -> dict[str, Any]:
    named, array = {"id": element.get("id", ""), "unit": element.get("unit")}, element.find("array")
    if array is None:
        return named if len(element) else {**named, "string": (element.text or "").strip()}
    if code := array.get("code"):
        return {**named, "string_array_coded": {"value": array.text or "", "code": code}}
    return {**named, "string_array": [(item.text or "").strip() for item in array.iterfind("c")]}


def _tree(content: bytes) -> Element:
    builder, depth = TreeBuilder(), 0

    def start(name: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > _DEEPEST:
            raise DesignFileError("", f"line {parser.CurrentLineNumber}: elements are nested too deeply")
        builder.start(name, attributes)

    def end(name: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(name)

    def doctype(*_: Any) -> None:
        raise DesignFileError(
            "", f"line {parser.CurrentLineNumber}: declares a document type, which REXS does not have"
        )

    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler, parser.StartDoctypeDeclHandler = builder.data, doctype
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        problem = expat.errors.messages.get(error.code, "not well-formed")
        raise DesignFileError("", f"line {error.lineno}, column {error.offset + 1}: not valid XML: {problem}") from None
    except (ValueError, LookupError) as error:  # of an encoding
        if isinstance(error, DesignFileError):
            raise
        raise DesignFileError("", f"not valid XML: {error}") from None
    return builder.close()


def to_xml(data: dict[str, Any]) -> bytes:
    """The file: UTF-8 with a byte order mark, as REXS has it."""
    root = Element("model", _attributes(data))
    relations = SubElement(root, "relations")
    for relation in data["relations"]:
        element = SubElement(relations, "relation", _attributes(relation))
        for ref in relation["refs"]:
            SubElement(element, "ref", _attributes(ref))
    _write(SubElement(root, "components"), data["components"])
    if spectrum := data.get("load_spectrum"):
        cases = SubElement(root, "load_spectrum", _attributes(spectrum))
        for case in spectrum["load_cases"]:
            _write(SubElement(cases, "load_case", _attributes(case)), case["components"])
    indent(root)
    return b"\xef\xbb\xbf" + tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"


def _attributes(item: dict[str, Any]) -> dict[str, str]:
    return {name: str(value) for name, value in item.items() if not isinstance(value, list | dict)}


def _write(parent: Element, components: Iterable[dict[str, Any]]) -> None:
    for component in components:
        element = SubElement(parent, "component", _attributes(component))
        for attribute in component["attributes"]:
            name, unit, value = attribute.values()
            item = SubElement(element, "attribute", {"id": name, "unit": unit})
            if isinstance(value, str):
                item.text = value
            else:
                array = SubElement(item, "array")
                for each in value:
                    SubElement(array, "c").text = each
