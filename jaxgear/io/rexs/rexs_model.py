"""A REXS model as data, from and to the XML of a file.

REXS, the Reusable Engineering EXchange Standard of FVA (https://www.rexs.info), describes a gear unit by its parts and
what they have to do with each other. A file holds one model. Whatever is wrong with it is refused in one line that
names component and attribute.

A file comes from anywhere, so it is read without a document type: Expat reports the start of one before anything that
it declares is looked at, and the file is refused there. Without declarations there are no entities to expand, inside
the file or from elsewhere. REXS has a schema (XSD) and no document type, so that no proper file is lost.
"""

import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from decimal import Decimal
from typing import Any
from xml.etree.ElementTree import Element, SubElement, TreeBuilder, indent, tostring
from xml.parsers import expat

import numpy as np

from ...numerics import Number
from ..errors import DesignFileError
from ..value_types import outside
from .values import checked_version, decoded, kind_of, whole, written

CUSTOM = "custom_jaxgear_"  # of attributes that REXS does not know: it leaves "custom_..." to programs
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
# what earlier versions call a unit of the current one
_ALSO = {"deg": ("\u00b0",), "MPa": ("N / mm^2",), "none": ("",), "mum": ("\u00b5m", "\u03bcm", "um")}
# names in versions before 2, by the type of the component
_EARLIER = {
    "rack_shaped_tool": {
        "tip_radius": "tip_corner_radius_reference_profile",
        "tip_radius_factor": "tip_corner_radius_factor_reference_profile",
        "machining_allowance_din_3972": "machining_allowance_din_3972_1952",
        "relative_machining_allowance_din_3972": "relative_machining_allowance_din_3972_1952",
    },
    "cylindrical_gear": {
        "thermal_contact_coefficient_agma_925_a03": "thermal_contact_coefficient_agma_925_2003",
    },
}
# the library's names of units of REXS, by the shift between them
_OWN = {
    ("mm", 3): "um",
    ("mum", 0): "um",
    ("1 / min", 0): "rpm",
    ("kg / dm^3", 3): "kg/m^3",
    ("N / (mm s^0.5 K)", 3): "N/(m s^0.5 K)",
    ("none", 0): "",
}


@dataclass(frozen=True)
class Attribute:
    """Attribute of a component.

    Attributes:
        value: text of a scalar, texts of an array, None for a matrix or another nested value.
        unit: unit as the file names it, None without one.
        kind: type of the value by its name in REXS, "" where the file does not say.
    """

    value: str | tuple[str, ...] | None
    unit: str | None = None
    kind: str = ""


@dataclass
class Component:
    """A part of the gear unit, or something that belongs to one.

    Attributes:
        id: of the file, 0 for what the file does not hold.
        type, name: of the component.
        attributes: by their names.
        without_unit: attributes that were taken in the unit of the standard.
        keys: keys of a design file, by the attributes that a user may give beside the file.
    """

    id: int
    type: str
    name: str = ""
    attributes: dict[str, Attribute] = field(default_factory=dict)
    without_unit: list[str] = field(default_factory=list)
    keys: dict[str, str] = field(default_factory=dict)

    def where(self, attribute: str = "") -> str:
        """`cylindrical_gear 15: face_width`."""
        return f"{self.type} {self.id}" + (f": {attribute}" if attribute else "")

    def refuse(self, attribute: str, problem: str) -> DesignFileError:
        """The refusal of an attribute."""
        return DesignFileError(self.where(attribute), problem)

    def missing(self, attribute: str) -> DesignFileError:
        """The refusal of an attribute that is not there, with the option that gives it."""
        key = self.keys.get(attribute)
        return self.refuse(attribute, f"missing, give it with --set {key}=VALUE" if key else "missing")

    def number(self, attribute: str, unit: str, *, shift: int = 0) -> float | None:
        """A number times 10^shift, None where it is absent. The shift is of the decimal digits, so that it is exact."""
        value = self._value(attribute, unit)
        if value is None:
            return None
        if not isinstance(value, str):
            raise self.refuse(attribute, "must be a number, not an array")
        return self._float(attribute, value, unit, shift)

    def needed(self, attribute: str, unit: str) -> float:
        """A number that has to be there."""
        value = self.number(attribute, unit)
        if value is None:
            raise self.missing(attribute)
        return value

    def numbers(self, attribute: str, unit: str, *, shift: int = 0) -> np.ndarray:
        """An array that has to be there, times 10^shift."""
        value = self._value(attribute, unit)
        if value is None:
            raise self.missing(attribute)
        if isinstance(value, str):
            raise self.refuse(attribute, "must be an array, not a single value")
        return np.array([self._float(attribute, item, unit, shift) for item in value])

    def choice(self, attribute: str, default: str | None, allowed: Iterable[str]) -> str:
        """One of several words, which has to be there where there is no default."""
        value = self._value(attribute, "none") or default
        names = tuple(allowed)
        if value is None:
            raise self.refuse(attribute, f"missing, must be one of {', '.join(names)}")
        if value not in names:
            raise self.refuse(attribute, f'"{value}" is not supported, must be one of {", ".join(names)}')
        return str(value)

    def flag(self, attribute: str, default: bool) -> bool:
        """True or false."""
        return self.choice(attribute, str(default).lower(), ("true", "false")) == "true"

    def text(self, attribute: str) -> str:
        """Free text, "" where it is absent."""
        value = self.attributes[attribute].value if attribute in self.attributes else ""
        return value if isinstance(value, str) else ""

    def _value(self, attribute: str, unit: str) -> str | tuple[str, ...] | None:
        if attribute not in self.attributes:
            return None
        held = self.attributes[attribute]
        if held.unit is None and unit != "none":
            self.without_unit.append(f"{self.where(attribute)} in {unit}")
        if held.unit is not None and held.unit != unit and held.unit not in _ALSO.get(unit, ()):
            raise self.refuse(attribute, f'unit "{held.unit}" must be "{unit}"')
        if held.value is None:
            raise self.refuse(attribute, "must be a single value or an array, not a matrix")
        return held.value or None  # an empty element says nothing

    def _float(self, attribute: str, text: str, unit: str, shift: int) -> float:
        if not _NUMBER.fullmatch(text) or not math.isfinite(value := float(text)):
            raise self.refuse(attribute, f'"{text[:40]}" is not a finite number')
        value = float(Decimal(text).scaleb(shift)) if value else 0.0
        if problem := outside(Number(_OWN.get((unit, shift), unit)), value):
            raise self.refuse(attribute, problem)
        return value


@dataclass(frozen=True)
class Relation:
    """Relation of several components: type, and (role, id) of each component."""

    type: str
    refs: tuple[tuple[str, int], ...]
    order: int | None = None


@dataclass
class Model:
    """Components, relations and load cases of a REXS file.

    Attributes:
        version: version of REXS.
        components: components by id.
        relations: relations in their order.
        cases: load cases of the spectrum by id; each holds components with their attributes under this load, by id.
    """

    version: str
    components: dict[int, Component] = field(default_factory=dict)
    relations: list[Relation] = field(default_factory=list)
    cases: dict[int, dict[int, Component]] = field(default_factory=dict)

    def component(self, number: int) -> Component:
        """The component of an id."""
        if number not in self.components:
            raise DesignFileError("", f"a relation names component {number}, which is missing")
        return self.components[number]

    def put(self, component: Component) -> None:
        """Takes up a component of a file."""
        if component.id in self.components:
            raise DesignFileError(component.where(), "is given twice in the file")
        self.components[component.id] = component

    def put_case(self, number: int, said: Iterable[Component]) -> None:
        """Takes up a load case of a file."""
        if number in self.cases:
            raise DesignFileError(f"load_case {number}", "is given twice in the file")
        self.cases[number] = {component.id: component for component in said}

    def related(self, kind: str, role: str, number: int, wanted: str) -> list[Component]:
        """The components with a wanted role in the relations of a kind in which a component has a role."""
        found = [
            relation.refs for relation in self.relations if relation.type == kind and (role, number) in relation.refs
        ]
        ids = [other for refs in found for name, other in refs if name == wanted]
        return [self.component(other) for other in dict.fromkeys(ids)]

    def add(self, kind: str, name: str = "", **values: tuple[Any, str]) -> Component:
        """A new component; values are (value, unit), those of None are left out."""
        component = Component(len(self.components) + 1, kind, name, attributes_of(values))
        self.components[component.id] = component
        return component

    def relate(self, kind: str, *, order: int | None = None, **roles: Component) -> None:
        """A new relation."""
        self.relations.append(Relation(kind, tuple((role, part.id) for role, part in roles.items()), order))

    def under_load(self, case: int, component: Component, **values: tuple[Any, str]) -> None:
        """Sets the attributes of a component in a load case; values are (value, unit)."""
        said = Component(component.id, component.type, component.name, attributes_of(values))
        self.cases.setdefault(case, {})[component.id] = said


def current(kind: str, attribute: str) -> str:
    """The name that an attribute of a type of component has in REXS 2."""
    return _EARLIER.get(kind, {}).get(attribute, attribute)


def attributes_of(values: dict[str, tuple[Any, str]]) -> dict[str, Attribute]:
    """Attributes from (value, unit); those of None are left out."""
    given = {name: pair for name, pair in values.items() if pair[0] is not None}
    return {name: Attribute(written(value), unit, kind_of(name, value, unit)) for name, (value, unit) in given.items()}


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
        raise DesignFileError("", f"line {error.lineno}, column {error.offset + 1}: not valid XML: {problem}") from None
    except (ValueError, LookupError) as error:  # of an encoding
        if isinstance(error, DesignFileError):
            raise
        raise DesignFileError("", f"not valid XML: {error}") from None
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
