"""From the bytes of a REXS file in XML to a `Model`.

A file comes from anywhere, so it is read without a document type: Expat reports the start of one before anything that
it declares is looked at, and the file is refused there. Without declarations there are no entities to expand, inside
the file or from elsewhere. REXS has a schema (XSD) and no document type, so that no proper file is lost.
"""

from collections.abc import Iterator
from typing import Any
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from ..errors import DesignFileError
from .model import Attribute, Component, Model, Relation, current
from .values import checked_version, decoded, whole

_DEEPEST = 16  # twice the depth of the schema


def parse(content: bytes) -> Model:
    """The model of a file.

    Raises:
        DesignFileError: for what is not well-formed XML, declares a document type or is no REXS model.
    """
    root = _tree(content)
    if root.tag != "model":
        raise DesignFileError("", f"<{root.tag}> is not the <model> of a REXS file")
    model = Model(checked_version(root.get("version", "")))
    for element in root.iterfind("components/component"):
        model.put(_component(element))
    model.relations = [_relation(element) for element in root.iterfind("relations/relation")]
    for case in root.iterfind("load_spectrum/load_case"):
        said = [_component(element) for element in case.iterfind("component")]
        model.put_case(whole(case.get("id", ""), "load_case: id"), said)
    return model


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
        raise DesignFileError("", f"line {error.lineno}, column {error.offset + 1}: no XML: {problem}") from None
    except (ValueError, LookupError) as error:  # of an encoding
        if isinstance(error, DesignFileError):
            raise
        raise DesignFileError("", f"no XML: {error}") from None
    return builder.close()


def _component(element: Element) -> Component:
    component = Component(
        whole(element.get("id", ""), "component: id"), element.get("type", ""), element.get("name", "")
    )
    for item in element.iterfind("attribute"):
        name = item.get("id", "")
        try:
            component.attributes[current(component.type, name)] = Attribute(_value(item), item.get("unit"))
        except ValueError as error:
            raise component.refuse(name, str(error)) from None
    return component


def _value(element: Element) -> str | tuple[str, ...] | None:
    array = element.find("array")
    if array is not None:
        if array.get("code"):
            return decoded(array.text or "", array.get("code", ""))
        return tuple((item.text or "").strip() for item in array.iterfind("c"))
    return None if len(element) else (element.text or "").strip()


def _relation(element: Element) -> Relation:
    kind = element.get("type", "")
    order = whole(element.get("order"), "relation: order") if "order" in element.keys() else None
    return Relation(kind, tuple(_refs(element, kind)), order)


def _refs(element: Element, kind: str) -> Iterator[tuple[str, int]]:
    for ref in element.iterfind("ref"):
        yield ref.get("role", ""), whole(ref.get("id", ""), f"relation {element.get('id', '')} ({kind}): ref: id")
