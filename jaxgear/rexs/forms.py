"""Forms of REXS files: XML, JSON (REXS 1.5 and later), and zip archives that hold one model beside other files.

A file comes from anywhere. XML is read without a document type: Expat reports the start of one before anything that it
declares is looked at, and the file is refused there. Without declarations there are no entities to expand, inside the
file or from elsewhere. REXS has a schema (XSD) and no document type, so that no proper file is lost. Of an archive
nothing is unpacked to the disk, so that names of members are no paths, and no more than a limit is ever expanded.
"""

import io
import json
import struct
import zipfile
import zlib
from codecs import BOM_UTF8
from collections.abc import Callable, Iterable
from pathlib import PurePath, PurePosixPath
from typing import Any
from xml.etree.ElementTree import Element, SubElement, TreeBuilder, indent, tostring
from xml.parsers import expat

from ..io.errors import DesignFileError
from .model import Model, checked_object, data_of, model_of

_ARCHIVES = (".rexsz", ".zip")
_MODELS = (".rexs", ".xml", ".rexsj", ".json")
_START = b"PK\x03\x04"
_MOST = 256 * 2**20  # of a model [bytes]: a gearbox of a hundred gears has a few million
_MOST_MEMBERS = 10_000
_ENCRYPTED = 0x1  # flag of a member
_KNOWN = zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED
# what Python raises for one, offsets beyond the file and, as a RuntimeError, a version that it does not know included
_DAMAGED = zipfile.BadZipFile, zlib.error, EOFError, ValueError, IndexError, RuntimeError, struct.error


def parse(content: bytes) -> Model:
    """Model from the content of a file in XML or JSON, or of an archive with one such file.

    Raises:
        DesignFileError: for a file of another form, see `unpacked`, or no REXS model.
    """
    if content.startswith(_START):
        content = unpacked(content)
    is_json = content.removeprefix(BOM_UTF8).lstrip()[:1] == b"{"
    return model_of(_from_json(content) if is_json else _from_xml(content))


def content_of(model: Model, name: PurePath) -> bytes:
    """Content of the file of a model, in the form given by the file extension."""
    data, ending = data_of(model), name.suffix
    content = _to_json(data) if ending in (".rexsj", ".json") else _to_xml(data)
    return packed(content, f"{name.stem}.rexs") if ending in _ARCHIVES else content


def unpacked(held: bytes) -> bytes:
    """Content of the single model in a zip archive.

    Raises:
        DesignFileError: for an archive that is damaged or encrypted, has no model or several, or one of more than
            256 MiB.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(held)) as archive:
            if len(archive.infolist()) > _MOST_MEMBERS:
                raise DesignFileError("", f"holds {len(archive.infolist())} files, must be at most {_MOST_MEMBERS}")
            found = _model(archive)
            if found.flag_bits & _ENCRYPTED or found.compress_type not in _KNOWN:
                raise DesignFileError("", f"{found.filename}: is encrypted or compressed other than by deflate")
            with archive.open(found) as member:
                content = member.read(_MOST + 1)
    except DesignFileError:
        raise
    except _DAMAGED as error:
        raise DesignFileError("", f"is not a valid zip archive: {str(error) or 'it ends too early'}") from None
    if len(content) > _MOST:
        raise DesignFileError("", f"{found.filename}: expands to more than {_MOST >> 20} MiB")
    return content


def _model(archive: zipfile.ZipFile) -> zipfile.ZipInfo:
    members = [each for each in archive.infolist() if not each.is_dir()]
    models = [each for each in members if PurePosixPath(each.filename).suffix.lower() in _MODELS]
    own = [each for each in models if PurePosixPath(each.filename).suffix.lower() in (".rexs", ".rexsj")] or models
    if len(own) == 1:
        return own[0]
    if not own:
        raise DesignFileError("", f"holds no REXS file, whose name ends in {', '.join(_MODELS)}")
    shown = ", ".join(each.filename for each in own[:5])
    raise DesignFileError("", f"holds {len(own)} REXS files, unpack it and give one of them: {shown}")


def packed(content: bytes, name: str) -> bytes:
    """A zip archive of one model."""
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(name, content)
    return held.getvalue()


_DEEPEST = 16  # twice the depth of the schema


def _from_xml(content: bytes) -> dict[str, Any]:
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


def _to_xml(data: dict[str, Any]) -> bytes:
    """Content of the file: UTF-8 with a byte order mark."""
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


_MAKE: dict[str, Callable[[str], Any]] = {"floating_point": float, "integer": int, "boolean": "true".__eq__}


def _from_json(content: bytes) -> dict[str, Any]:
    try:
        data = json.loads(content.decode("utf-8-sig"), parse_float=str, parse_int=str, parse_constant=str)
    except json.JSONDecodeError as error:
        raise DesignFileError("", f"line {error.lineno}, column {error.colno}: not valid JSON: {error.msg}") from None
    except UnicodeDecodeError:
        raise DesignFileError("", "not valid JSON: not UTF-8 text") from None
    except RecursionError:
        raise DesignFileError("", "not valid JSON: nested too deeply") from None
    return checked_object(checked_object(data, "file").get("model"), "model")


def _to_json(data: dict[str, Any]) -> bytes:
    """Content of the file: UTF-8 with a byte order mark."""
    cases = data.get("load_spectrum", {}).get("load_cases", [])
    for component in sum((case["components"] for case in cases), data["components"]):
        component["attributes"] = [_typed(*attribute.items()) for attribute in component["attributes"]]
    return b"\xef\xbb\xbf" + json.dumps({"model": data}, ensure_ascii=False, indent=1).encode("utf-8") + b"\n"


def _typed(*items: tuple[str, Any]) -> dict[str, Any]:
    """An attribute with numbers and booleans in place of texts."""
    *named, (kind, value) = items
    make = _MAKE.get(kind.removesuffix("_array"), str)
    return {**dict(named), kind: make(value) if isinstance(value, str) else [make(each) for each in value]}
