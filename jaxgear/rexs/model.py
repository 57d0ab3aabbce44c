"""A REXS model: components, relations and load cases, from and to the nested data that both forms of a file hold.

REXS, the Reusable Engineering EXchange Standard of FVA (https://www.rexs.info), describes a gear unit by its parts and
their relations. A file holds one model. Whatever is wrong with it is refused in one line that names component and
attribute.

The data are those of the JSON form with texts in place of numbers: an attribute is
`{"id": "face_width", "unit": "mm", "floating_point": "20.0"}`. The XML form says the same in elements.
"""

import base64
import binascii
import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from decimal import Decimal
from typing import Any

import numpy as np

from ..io.errors import DesignFileError
from ..io.value_types import outside
from ..numerics import Number
from ..version import version as own_version

CUSTOM = "custom_jaxgear_"  # of attributes that REXS does not know: it leaves "custom_..." to programs
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
# what earlier versions call a unit of the current one
_ALSO = {"deg": ("\u00b0",), "MPa": ("N / mm^2",), "none": ("",), "mum": ("\u00b5m", "\u03bcm", "um")}
_SCALARS = "floating_point integer boolean enum string reference_component file_reference date_time".split()
_ARRAYS = [f"{kind}_array" for kind in ("floating_point", "integer", "boolean", "enum", "string")]
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
    """Part of the gear unit, or data that belong to a part.

    Attributes:
        id: id in the file, 0 for a component that is not in the file.
        type, name: of the component.
        attributes: attributes by their names.
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
        """Place of a component or attribute in messages, such as `cylindrical_gear 15: face_width`."""
        return f"{self.type} {self.id}" + (f": {attribute}" if attribute else "")

    def refuse(self, attribute: str, problem: str) -> DesignFileError:
        """Error with a message for an attribute of the component."""
        return DesignFileError(self.where(attribute), problem)

    def missing(self, attribute: str) -> DesignFileError:
        """Error for a missing attribute, with the option that supplies it."""
        key = self.keys.get(attribute)
        return self.refuse(attribute, f"missing, give it with --set {key}=VALUE" if key else "missing")

    def number(self, attribute: str, unit: str, *, shift: int = 0) -> float | None:
        """Number times 10^shift, None if absent. The shift moves the decimal digits and is exact."""
        value = self._value(attribute, unit)
        if value is None:
            return None
        if not isinstance(value, str):
            raise self.refuse(attribute, "must be a number, not an array")
        return self._float(attribute, value, unit, shift)

    def needed(self, attribute: str, unit: str) -> float:
        """Number of a required attribute in a unit; raises if it is missing."""
        value = self.number(attribute, unit)
        if value is None:
            raise self.missing(attribute)
        return value

    def numbers(self, attribute: str, unit: str, *, shift: int = 0) -> np.ndarray:
        """Numbers of a required array attribute in a unit, times 10^shift."""
        value = self._value(attribute, unit)
        if value is None:
            raise self.missing(attribute)
        if isinstance(value, str):
            raise self.refuse(attribute, "must be an array, not a single value")
        return np.array([self._float(attribute, item, unit, shift) for item in value])

    def choice(self, attribute: str, default: str | None, allowed: Iterable[str]) -> str:
        """Word of an attribute, one of `allowed`; required unless a default is given."""
        value = self._value(attribute, "none") or default
        names = tuple(allowed)
        if value is None:
            raise self.refuse(attribute, f"missing, must be one of {', '.join(names)}")
        if value not in names:
            raise self.refuse(attribute, f'"{value}" is not supported, must be one of {", ".join(names)}')
        return str(value)

    def flag(self, attribute: str, default: bool) -> bool:
        """Boolean attribute, or its default if absent."""
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
    """Relation of several components.

    Attributes:
        type: type of the relation.
        refs: (role, id) of each component.
        order: order of the relation; None without one.
    """

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
        """Component of an id; raises `DesignFileError` if it is missing."""
        if number not in self.components:
            raise DesignFileError("", f"a relation names component {number}, which is missing")
        return self.components[number]

    def related(self, kind: str, role: str, number: int, wanted: str) -> list[Component]:
        """Components with the role `wanted` in relations of a kind where component `number` has the role `role`."""
        found = [
            relation.refs for relation in self.relations if relation.type == kind and (role, number) in relation.refs
        ]
        ids = [other for refs in found for name, other in refs if name == wanted]
        return [self.component(other) for other in dict.fromkeys(ids)]

    def add(self, kind: str, name: str = "", **values: tuple[Any, str]) -> Component:
        """Add a component; values are (value, unit), None is left out."""
        component = Component(len(self.components) + 1, kind, name, _attributes_of(values))
        self.components[component.id] = component
        return component

    def relate(self, kind: str, *, order: int | None = None, **roles: Component) -> None:
        """Add a relation of components by their roles."""
        self.relations.append(Relation(kind, tuple((role, part.id) for role, part in roles.items()), order))

    def under_load(self, case: int, component: Component, **values: tuple[Any, str]) -> None:
        """Set the attributes of a component in a load case; values are (value, unit)."""
        said = Component(component.id, component.type, component.name, _attributes_of(values))
        self.cases.setdefault(case, {})[component.id] = said


def _attributes_of(values: dict[str, tuple[Any, str]]) -> dict[str, Attribute]:
    """Attributes from (value, unit); values that are None are left out."""
    given = {name: pair for name, pair in values.items() if pair[0] is not None}
    return {name: Attribute(written(value), unit, _kind_of(name, value, unit)) for name, (value, unit) in given.items()}


def model_of(data: dict[str, Any]) -> Model:
    """Model from the data of a file.

    Raises:
        DesignFileError: for data of another structure, or an id that is not a number or occurs twice.
    """
    model = Model(_checked_version(str(data.get("version", ""))))
    for component in map(_component, _objects(data, "components")):
        if component.id in model.components:
            raise DesignFileError(component.where(), "is given twice in the file")
        model.components[component.id] = component
    model.relations = [_relation(item) for item in _objects(data, "relations")]
    spectrum = data.get("load_spectrum")
    for case in [] if spectrum is None else _objects(checked_object(spectrum, "load_spectrum"), "load_cases"):
        said, number = map(_component, _objects(case, "components")), whole(case.get("id", ""), "load_case: id")
        if number in model.cases:
            raise DesignFileError(f"load_case {number}", "is given twice in the file")
        model.cases[number] = {component.id: component for component in said}
    return model


def data_of(model: Model) -> dict[str, Any]:
    """Data of the file of a model: version of REXS, program and time, relations, components, load cases."""
    data: dict[str, Any] = {
        "version": model.version,
        "applicationId": "jaxgear",
        "applicationVersion": own_version(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
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
        "components": [_data(component) for component in model.components.values()],
    }
    if model.cases:
        cases = [{"id": case, "components": [*map(_data, said.values())]} for case, said in model.cases.items()]
        data["load_spectrum"] = {"id": 1, "load_cases": cases}
    return data


def checked_object(data: Any, where: str) -> dict[str, Any]:
    """Data of a named object; raises for any other."""
    if not isinstance(data, dict):
        raise DesignFileError("", f"{where}: must be a JSON object")
    return data


def _objects(data: dict[str, Any], key: str) -> list[dict[str, Any]]:
    found = data.get(key, [])
    if not isinstance(found, list):
        raise DesignFileError("", f"{key}: must be a JSON array")
    return [checked_object(item, key) for item in found]


def _component(item: dict[str, Any]) -> Component:
    number = whole(item.get("id", ""), "component: id")
    component = Component(number, str(item.get("type", "")), str(item.get("name", "")))
    current = _EARLIER.get(component.type, {})
    for attribute in _objects(item, "attributes"):
        name, unit = str(attribute.get("id", "")), attribute.get("unit")
        try:
            value = _value(attribute)
        except ValueError as error:
            raise component.refuse(name, str(error)) from None
        component.attributes[current.get(name, name)] = Attribute(value, None if unit is None else str(unit))
    return component


def _value(attribute: dict[str, Any]) -> str | tuple[str, ...] | None:
    for kind, value in attribute.items():
        if kind in _SCALARS:
            return _text(value)
        if kind in _ARRAYS:
            if not isinstance(value, list):
                raise ValueError(f"{kind} must be a list")
            return tuple(map(_text, value))
        if kind.removesuffix("_coded") in _ARRAYS:
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
    refs = tuple((str(ref.get("role", "")), whole(ref.get("id", ""), where)) for ref in _objects(item, "refs"))
    return Relation(kind, refs, None if order is None else whole(order, "relation: order"))


def _data(component: Component) -> dict[str, Any]:
    held = component.attributes.items()
    attributes = [{"id": name, "unit": each.unit, each.kind: each.value} for name, each in held]
    name = {"name": component.name} if component.name else {}
    return {"id": component.id, "type": component.type, **name, "attributes": attributes}


_TEXTS = ("model_name",)  # the other words are of lists
_CODES = {"float64": "<f8", "float32": "<f4", "int32": "<i4"}


def _kind_of(name: str, value: object, unit: str) -> str:
    """Type of a value by its name in REXS; a text is a word of a list, or a number written by `shifted`."""
    if isinstance(value, bool):
        return "boolean"
    if name in _TEXTS:
        return "string"
    array = np.asarray(value)
    kind = "integer" if array.dtype.kind == "i" else "floating_point"
    if array.dtype.kind == "U" and unit == "none":
        kind = "enum"
    return f"{kind}_array" if array.ndim else kind


def _checked_version(version: str) -> str:
    """Version of a file; raises for another text."""
    if not re.fullmatch(r"\d+(\.\d+){1,2}", version, re.ASCII):
        raise DesignFileError("model: version", f'"{version}" is not a version of REXS')
    return version


def whole(text: object, where: str) -> int:
    """Whole number of a text, for instance an id; raises for other text."""
    if not isinstance(text, str) or not re.fullmatch(r"\s*[+-]?\d{1,9}\s*", text, re.ASCII):
        raise DesignFileError(where, f'"{str(text)[:40]}" is not a whole number')
    return int(text)


def written(value: object) -> str | tuple[str, ...]:
    """A value as text: numbers by the shortest digits that read back as the same number."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return str(value).lower()
    array = np.asarray(value)
    return tuple(str(item) for item in array) if array.ndim else str(array[()])


def shifted(value: object, shift: int) -> str | tuple[str, ...]:
    """Numbers times 10^shift as text, exact because the decimal digits are shifted."""
    text = written(value)
    if isinstance(text, tuple):
        return tuple(_shift(item, shift) for item in text)
    return _shift(text, shift)


def _shift(text: str, shift: int) -> str:
    number = Decimal(text)
    return str(number.scaleb(shift).normalize()) if number else "0.0"


def decoded(text: str, code: str) -> tuple[str, ...]:
    """Numbers of an array in base64, little-endian (REXS 1.4).

    Raises:
        ValueError: where it is none.
    """
    if code not in _CODES:
        raise ValueError(f'code "{code}" is not known, must be one of {", ".join(_CODES)}')
    try:
        content = base64.b64decode("".join(text.split()), validate=True)
        return tuple(str(item) for item in np.frombuffer(content, _CODES[code]))
    except (binascii.Error, ValueError):
        raise ValueError(f"is not an array of {code} in base64") from None
