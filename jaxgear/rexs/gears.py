"""A gear of the library and the components of REXS that describe it: gear, flanks, tool and material."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ..geometry import Gear, Material, RingGear, allowance_of_balls, measures, over_balls
from ..io.errors import DesignFileError, refused
from ..numerics import real
from .model import CUSTOM, Component, Model, shifted
from .open_numbers import CUTTER, FLANK, GEAR, RING, TOOL, Completed, attributes, rack_by_hand

GENERATED = "generated_addendum_modification_coefficient"
CHORDS = "chordal_tooth_thickness_upper_deviation", "chordal_tooth_thickness_lower_deviation"
SPANS = "upper_backlash_allowance_referenced_to_span", "lower_backlash_allowance_referenced_to_span"
BALLS = "upper_backlash_allowance_balls_or_pins", "lower_backlash_allowance_balls_or_pins"
_SHIFT_DIGITS = 1e-3  # by which profile shifts in files are rounded
_DIGITS = 6  # of an allowance [um] behind the point: further ones are of the way through chord or span


def write_thickness(gear: Gear) -> dict[str, tuple[Any, str]]:
    """Deviations of chord and span as attributes, beside the span without an allowance; nothing without allowances."""
    upper, tolerance = float(gear.tooth_thickness_allowance), float(gear.tooth_thickness_tolerance)
    if not upper and not tolerance:
        return {}
    limits = upper, upper - tolerance  # um
    diameter, arc = _nominal(gear)
    found: dict[str, tuple[Any, str]] = {}
    for name, allowance in zip(CHORDS, (1e-3 * limit for limit in limits)):
        # d (sin((s + E) / d) - sin(s / d)), without the difference of two near numbers
        half = 0.5 * allowance / diameter
        found[name] = float(2 * diameter * np.cos((arc + 0.5 * allowance) / diameter) * np.sin(half)), "mm"
    none = real(0.0)
    span = measures(replace(gear, tooth_thickness_allowance=none, tooth_thickness_tolerance=none))
    if not np.isfinite(span.span):
        return found
    cosine = float(np.cos(np.deg2rad(gear.pressure_angle)))
    found |= {name: (limit * cosine, "mum") for name, limit in zip(SPANS, limits)}
    return found | {
        "number_of_teeth_for_span_measurement": (int(span.teeth), "none"),
        "span_measurement": (span.span, "mm"),
    }


def read_thickness(gear: Component, made: Gear) -> dict[str, Any]:
    """Upper tooth thickness allowance and tolerance [um], from deviations of chord, span or dimension over balls.

    Of several measures the first is used, as they are equivalent; a single limit is both upper and lower limit.
    """
    for names, limits, allowance in _deviations(gear, made):
        given = [limit for limit in limits if limit is not None]
        if not given:
            continue
        # no deviation is no allowance, whatever the measure is rounded to on the way
        high, low = (
            refused(gear.where(names[0]), allowance, limit) if limit else 0.0 for limit in (given[0], given[-1])
        )
        if low > high:
            raise gear.refuse(names[1], f"{given[-1]:g} must be at most the upper one, {given[0]:g}")
        if high > 0:
            raise gear.refuse(names[0], f"{given[0]:g} makes the tooth {high:.4g} um thicker, must be at most 0")
        high, low = round(high, _DIGITS), round(low, _DIGITS)
        tolerance = round(high - low, _DIGITS)
        return {"tooth_thickness_allowance": real(high), "tooth_thickness_tolerance": real(tolerance)}
    return {}


def _deviations(
    gear: Component, made: Gear
) -> Iterator[tuple[tuple[str, str], list[float | None], Callable[..., Any]]]:
    """Names of both limits, upper one first, their values, and the function from a value to the allowance [um]."""
    yield CHORDS, [gear.number(name, "mm") for name in CHORDS], lambda chord: _of_chord(made, chord)
    cosine = float(np.cos(np.deg2rad(made.pressure_angle)))
    yield SPANS, [gear.number(name, "mum") for name in SPANS], lambda span: span / cosine
    balls = [gear.number(name, "mm") for name in BALLS]
    ball = gear.needed("diameter_of_measuring_ball_or_pin", "mm") if balls != [None, None] else 0.0
    yield BALLS, balls, lambda by: float(allowance_of_balls(made, ball, float(over_balls(made, ball)) + by))


def as_cut(settings: Component, made: Gear, owner: str, completed: Completed) -> Gear:
    """Gear with the tooth thickness by its generating profile shift, unless deviations of the thickness are given.

    x_E = x + A_sn / (2 m_n tan(alpha_n)) (ISO 21771) of a file is that of an allowance A_sn between both limits.
    """
    generated = settings.number(GENERATED, "none")
    if generated is None:
        return made
    shift, upper, tolerance = (
        float(number) for number in (made.profile_shift, made.tooth_thickness_allowance, made.tooth_thickness_tolerance)
    )
    thinner = 2e3 * float(made.module) * np.tan(np.deg2rad(float(made.pressure_angle)))  # um, for a shift of 1
    if not upper and not tolerance and generated < shift - _CLOSE:
        allowance = round(float(thinner * (generated - shift)), _DIGITS)
        completed.say(f"{owner}.tooth_thickness_allowance", allowance, f"um, by {GENERATED}")
        return refused(settings.where(GENERATED), replace, made, tooth_thickness_allowance=real(allowance))
    least = shift + (upper - tolerance) / thinner
    if not least - _SHIFT_DIGITS <= generated <= shift + _CLOSE:
        problem = f"{generated:g} must be at least {least:g}, that of the tooth thickness, and at most {shift:g}, x"
        raise settings.refuse(GENERATED, f"{problem}; {rack_by_hand(owner)}")
    return made


def _nominal(gear: Gear) -> tuple[float, float]:
    """Diameter of the reference circle and tooth thickness on its arc without an allowance [mm] (ISO 21771).

    Both of the normal section, whose circle has the curvature of the reference cylinder there, d / cos(beta)^2.
    """
    module, shift, angle = float(gear.module), float(gear.profile_shift), np.deg2rad(float(gear.pressure_angle))
    return 2 * float(gear.signed(gear.pitch_radius) / gear.helix_cosine**2), float(
        module * (0.5 * np.pi + 2 * shift * np.tan(angle))
    )


def _of_chord(made: Gear, chord: float) -> float:
    """Allowance on the arc of the reference circle [um], from the allowance on the chord [mm]."""
    diameter, arc = _nominal(made)
    if not -arc < chord < arc:
        raise ValueError(f"{chord:g} mm must be greater than {-arc:.4g} mm and at most 0 mm")
    # E from sin(s/d + E/d) = sin(s/d) + A/d
    return float(1e3 * diameter * (np.arcsin(np.sin(arc / diameter) + chord / diameter) - arc / diameter)) + 0.0


QUALITY = "global_tolerance_class_iso_1328_2013"
# fields of a gear and of its material: attribute of REXS, its unit and the decimal digits between both units
_EDGE = {"tip_edge_radius": (f"{CUSTOM}tip_edge_radius", "mm")}
_ON_GEAR = {"thermal_contact_coefficient": ("thermal_contact_coefficient_agma_925_2003", "N / (mm s^0.5 K)", 3)}
_MATERIAL = {
    "elastic_modulus": ("elastic_modulus", "MPa", 0),
    "poisson_ratio": ("poisson_ratio", "none", 0),
    "density": ("density", "kg / dm^3", 3),
}
_HANDS = "helix_angle_reference_diameter", "helix_angle_base_diameter"
_ANGLE = 1e-3  # deg, by which angles in files are rounded
_LENGTHS = {  # by the coefficient of the module that each is
    "addendum_modification_coefficient": "addendum_modification",
    "addendum_coefficient_reference_profile": "addendum_reference_profile",
    "tip_corner_radius_factor_reference_profile": "tip_corner_radius_reference_profile",
}
_ISO_53 = "basic rack of ISO 53"
_TOOL, _CUTTER = "rack_shaped_tool", "cutter_wheel_tool"
_RING = "ring_gear"
_SETTINGS = "cylindrical_gear_manufacturing_settings"
_DEDENDUM_DIGITS = 9  # behind the point: further ones are of the way through the root diameter
_CHAMFER = "chamfer_at_tooth_end"
# unsupported in the library: must be absent or zero. (component, attribute, unit)
_NOT_HERE = (
    (_TOOL, "protuberance_amount", "mm"),
    (_TOOL, "protuberance_amount_factor", "none"),
    (_TOOL, "protuberance_height", "mm"),
    (_TOOL, "protuberance_height_factor", "none"),
    (_TOOL, "machining_allowance_din_3972_1952", "mm"),
    (_TOOL, "relative_machining_allowance_din_3972_1952", "none"),
    (_SETTINGS, "machining_allowance", "mm"),
)
_CLOSE = 1e-9  # difference of numbers that mean the same: relative ones, and profile shifts
_ALIKE = 2e-3  # mm, by which diameters on a drawing are rounded


def is_internal(gear: Component) -> bool:
    """True for a ring gear, whose number of teeth may be negative.

    Raises:
        DesignFileError: for a component that is neither a cylindrical gear nor a ring gear.
    """
    if gear.type not in ("cylindrical_gear", _RING):
        raise gear.refuse("", f"must be a cylindrical_gear or a {_RING}")
    return gear.type == _RING or gear.needed("number_of_teeth", "none") < 0


def _helix_angle(gear: Component, pressure_angle: float) -> float:
    """Helix angle on the reference cylinder [deg], given there or on the base cylinder; positive for a right hand."""
    reference, base = (gear.number(name, "deg") for name in _HANDS)
    if base is None:
        return reference or 0.0
    # sin(beta_b) = sin(beta) cos(alpha_n)
    sine = np.sin(np.deg2rad(base)) / np.cos(np.deg2rad(pressure_angle))
    if not -1 < sine < 1:
        raise gear.refuse(_HANDS[1], f"{base:g} deg is no helix of normal pressure angle {pressure_angle:g} deg")
    angle = float(np.rad2deg(np.arcsin(sine)))
    if reference is not None and abs(angle - reference) > _ANGLE:
        raise gear.refuse(
            _HANDS[1], f"{base:g} deg is {angle:g} deg on the reference circle, must be {reference:g} deg"
        )
    return angle if reference is None else reference


def _tip_form(gear: Component, flank: Component) -> float | None:
    """Tip form diameter [mm], from itself or from the height of the tip's chamfer; None without a chamfer."""
    tip, form = gear.number("tip_diameter", "mm"), gear.number("tip_form_diameter", "mm")
    height = flank.number("tooth_tip_chamfer", "mm")
    if height and tip is None:
        raise gear.refuse("tip_diameter", "missing, the chamfer of the tip begins below it")
    chamfered = None if not height or tip is None else tip - 2 * height
    if form is None or chamfered is None:
        known = chamfered if form is None else form
        return None if known is None or (tip is not None and abs(known - tip) <= _CLOSE * tip) else known
    if abs(form - chamfered) > _ALIKE:
        problem = f"{height:g} mm must be {0.5 * ((tip or 0.0) - form):g} mm, down to the tip form diameter, or absent"
        raise flank.refuse("tooth_tip_chamfer", problem)
    return form


def read_gear(model: Model, gear: Component, flank: Component, owner: str, completed: Completed) -> Gear:
    """Read the gear of a component, generated by the tool of one of its flanks.

    Args:
        model: the file.
        gear, flank: components with the numbers that are given beside the file.
        owner: pinion or wheel.
        completed: numbers beside the file; takes down what is completed.

    Raises:
        DesignFileError: for what is missing or not of the library.
    """
    internal = is_internal(gear)
    tool, settings = _manufacturing(model, flank, owner, completed, internal)
    for part in (tool, settings):
        for kind, name, unit in _NOT_HERE:
            if part.type == kind and (value := part.number(name, unit)):
                problem = f"{value:g} must be 0, the library has no such tooth"
                raise part.refuse(name, f"{problem}; {rack_by_hand(owner)}")
    width = f"{owner}.face_width"
    if (chamfer := gear.number(_CHAMFER, "mm")) and width not in completed.given:
        problem = f"{chamfer:g} must be 0, the library has no such tooth; or give the width without: --set {width}=MM"
        raise gear.refuse(_CHAMFER, problem)
    module = gear.needed("normal_module", "mm")
    if not module > 0:
        raise gear.refuse("normal_module", f"{module:g} mm must be greater than 0 mm")
    angle = flank.needed("normal_pressure_angle", "deg")
    for name, unit, wanted in (("normal_module", "mm", module), ("normal_pressure_angle", "deg", angle)):
        given = tool.number(name, unit)
        if given is not None and abs(given - wanted) > _CLOSE * wanted:
            problem = f"{given:g} {unit} must be that of the gear, {wanted:g} {unit}; {rack_by_hand(owner)}"
            raise tool.refuse(name, problem)
    attribute, _ = FLANK["profile_shift"]
    profile_shift = _relative(flank, attribute, module)
    if profile_shift is None:
        raise flank.missing(attribute)
    on_gear = (RING if internal else GEAR) | _EDGE
    of_tool = CUTTER if tool.type == _CUTTER else TOOL
    options: dict[str, float | None] = {
        **{field: gear.number(name, unit) for field, (name, unit) in on_gear.items()},
        **{field: flank.number(name, unit) for field, (name, unit) in FLANK.items()},
        **{field: _relative(tool, name, module) for field, (name, _) in of_tool.items()},
        "teeth": gear.needed("number_of_teeth", "none"),
        "profile_shift": profile_shift,
        "helix_angle": _helix_angle(gear, angle),
        "face_width": gear.needed("face_width", "mm"),
        "tip_form_diameter": _tip_form(gear, flank),
    }
    if internal:
        material = _material(model, gear, owner, completed)
        return _complete_ring(gear, tool, settings, owner, options, material, completed)
    if options["bore_diameter"] == 0:
        problem = (
            f"0 mm: give the diameter at which the body is held, that of the shaft: --set {owner}.bore_diameter=MM"
        )
        raise gear.refuse("inner_diameter", problem)
    material = _material(model, gear, owner, completed)
    return _complete(gear, settings, owner, options, material, completed)


def _complete(
    gear: Component,
    settings: Component,
    owner: str,
    options: dict[str, float | None],
    material: Material,
    completed: Completed,
) -> Gear:
    """Gear from the numbers of a file; numbers that are None are completed and noted."""

    def made() -> Gear:
        given = {name: value for name, value in options.items() if value is not None}
        found: Gear = refused(gear.where(), Gear, **given, material=material)
        return as_cut(settings, refused(gear.where(), replace, found, **read_thickness(gear, found)), owner, completed)

    found, root = made(), gear.number("root_diameter", "mm")
    if options["dedendum"] is None and root is not None:
        deeper = float(found.root_circle_radius) - 0.5 * root
        options["dedendum"] = round(float(found.dedendum) + deeper / float(found.module), _DEDENDUM_DIGITS)
        completed.say(f"{owner}.dedendum", options["dedendum"], "root_diameter")
        found = made()
    for name, (value, why) in {
        "dedendum": (found.dedendum, _ISO_53),
        "root_radius": (found.root_radius, _ISO_53),
        "tip_diameter": (2 * found.tip_radius, f"addendum {float(found.addendum):g} x module"),
        "bore_diameter": (2 * found.bore_radius, "half the root diameter"),
    }.items():
        if options[name] is None:
            completed.say(f"{owner}.{name}", float(value), why)
    return found


def _complete_ring(
    gear: Component,
    tool: Component,
    settings: Component,
    owner: str,
    options: dict[str, float | None],
    material: Material,
    completed: Completed,
) -> Gear:
    """Ring gear from the numbers of a file, whose teeth and diameters may be negative, as `_complete`."""
    for key in ("bore_diameter", "dedendum", "root_radius"):
        if f"{owner}.{key}" in completed.given:
            raise DesignFileError("", f"--set {owner}.{key} has no effect, {gear.where()} is a ring gear")
    given = {
        name: abs(value) if name == "teeth" or name.endswith("diameter") else value
        for name, value in options.items()
        if value is not None
    }

    def made() -> Gear:
        nominal: RingGear = refused(gear.where(), RingGear, **given, material=material)
        found: Any = refused(gear.where(), replace, nominal, **read_thickness(gear, nominal))
        return as_cut(settings, found, owner, completed)

    root, height = gear.number("root_diameter", "mm"), _relative(tool, TOOL["dedendum"][0], float(given["module"]))
    if "dedendum" not in given and (root is not None or height is not None):
        radius = given.pop("root_radius", None)  # there may be no room for it yet
        found = made()
        cutter = found.cutter
        assert cutter is not None and found.cutter_teeth is not None and found.cutter_profile_shift is not None
        reached = 0.5 * abs(root or 0.0)
        if height is not None and root is None:
            tip = 0.5 * found.cutter_teeth + found.cutter_profile_shift + height
            reached = float(found.module * tip - cutter.center_distance)
        deeper = reached + float(found.root_circle_radius)
        given["dedendum"] = round(float(found.dedendum) + deeper / float(found.module), _DEDENDUM_DIGITS)
        given |= {} if radius is None else {"root_radius": radius}
    found = made()
    for name, (value, why) in {
        "dedendum": (found.dedendum, _ISO_53),
        "cutter_teeth": (found.cutter_teeth, "0.4 z"),
        "root_radius": (found.root_radius, _ISO_53),
        "tip_diameter": (-2 * found.tip_radius, f"addendum {float(found.addendum):g} x module"),
        "rim_diameter": (-2 * found.bore_radius, "a rim of 3.5 modules"),
    }.items():
        if name not in given:
            completed.say(f"{owner}.{name}", float(np.asarray(value)), why)
    return found


def read_quality(gear: Component) -> int | None:
    """Flank tolerance class of ISO 1328-1:2013; None if it is missing."""
    if QUALITY not in gear.attributes:
        return None
    return int(gear.choice(QUALITY, None, [str(number) for number in range(1, 12)]))


def write_gear(
    model: Model, gear: Gear, name: str, quality: int | None, material_name: str | None = None
) -> tuple[Component, list[Component]]:
    """Write a gear; returns the components of the gear and of its left and right flank."""
    tip = 2 * gear.signed(gear.tip_radius) if gear.tip_diameter is None else gear.tip_diameter
    hand = 0.0 if gear.helix_angle is None else gear.helix_angle
    part = model.add(
        _RING if gear.is_internal else "cylindrical_gear",
        name,
        **attributes(
            (RING if gear.is_internal else GEAR) | _EDGE,
            gear,
            teeth=int(gear.teeth),
            helix_angle=hand,
            tip_diameter=tip,
        ),
        root_diameter=(2 * gear.signed(gear.root_circle_radius), "mm"),
        datum_face_orientation=("negative", "none"),
        **{QUALITY: (None if quality is None else str(quality), "none")},
        **write_thickness(gear),
        **_of_material(_ON_GEAR, gear.material),
    )
    material = model.add("material", material_name or f"{name} material", **_of_material(_MATERIAL, gear.material))
    model.relate("reference", origin=part, referenced=material)
    of_tool = attributes(TOOL, gear)
    if gear.is_internal:
        assert gear.cutter_teeth is not None
        height = TOOL["dedendum"][0], (gear._tool_height(), "none")
        of_tool = attributes(CUTTER, gear, cutter_teeth=int(gear.cutter_teeth)) | dict([height])
    tool = model.add(
        _CUTTER if gear.is_internal else _TOOL,
        f"{name} tool",
        normal_module=(gear.module, "mm"),
        normal_pressure_angle=(gear.pressure_angle, "deg"),
        **of_tool,
    )
    settings = model.add(_SETTINGS, f"{name} settings", **{GENERATED: (gear.generating_profile_shift, "none")})
    flanks = [
        model.add("cylindrical_gear_flank", f"{name} {side} flank", **attributes(FLANK, gear))
        for side in ("left", "right")
    ]
    model.relate("flank", gear=part, left=flanks[0], right=flanks[1])
    for flank in flanks:
        model.relate("manufacturing_step", order=1, workpiece=flank, tool=tool, manufacturing_settings=settings)
    return part, flanks


def _of_material(fields: dict[str, tuple[str, str, int]], material: Material) -> dict[str, tuple[Any, str]]:
    held = ((name, getattr(material, field), unit, shift) for field, (name, unit, shift) in fields.items())
    return {name: (shifted(value, -shift) if shift else value, unit) for name, value, unit, shift in held}


def _manufacturing(
    model: Model, flank: Component, owner: str, completed: Completed, internal: bool
) -> tuple[Component, Component]:
    """Tool and settings of the one step that makes a flank, with the numbers that are given.

    Both are empty for a file without tools, and where the numbers that are given say all of the tool.
    """
    settings = Component(0, _SETTINGS)
    tools = model.related("manufacturing_step", "workpiece", flank.id, "tool")
    if not tools or (not internal and all(f"{owner}.{name}" in completed.given for name in TOOL)):
        return completed.of(owner, Component(0, _TOOL), TOOL), settings
    if len(tools) > 1:
        known = ", ".join(str(tool.id) for tool in tools)
        problem = f"must be made by one {_TOOL}, its tools are {known}; {rack_by_hand(owner)}"
        raise flank.refuse("", problem)
    if tools[0].type != _TOOL and (tools[0].type != _CUTTER or not internal):
        raise tools[0].refuse("", f"makes a flank, must be a {_TOOL}; {rack_by_hand(owner)}")
    found = model.related("manufacturing_step", "workpiece", flank.id, "manufacturing_settings")
    return completed.of(owner, tools[0], TOOL), found[0] if found else settings


def _relative(part: Component, coefficient: str, module: float) -> float | None:
    """Coefficient of the module, also if the file gives a length; None if it is missing."""
    value = part.number(coefficient, "none")
    if value is not None:
        return value
    length = part.number(_LENGTHS[coefficient], "mm")
    return None if length is None else length / module


def _material(model: Model, gear: Component, owner: str, completed: Completed) -> Material:
    """Material of a gear; missing constants are those of gear steel."""
    materials = [
        part for part in model.related("reference", "origin", gear.id, "referenced") if part.type == "material"
    ]
    if len(materials) > 1:
        raise gear.refuse("", f"has {len(materials)} materials, must have one")
    sources = [(gear, _ON_GEAR), *((part, _MATERIAL) for part in materials)]
    given = {
        field: part.number(name, unit, shift=shift)
        for part, fields in sources
        for field, (name, unit, shift) in fields.items()
    }
    if missing := [name for name in ("elastic_modulus", "poisson_ratio") if given.get(name) is None]:
        completed.say(f"{owner}.material", "STEEL", f"no {' and '.join(missing)}")
    where = materials[0].where() if materials else gear.where()
    return refused(where, Material, **{name: value for name, value in given.items() if value is not None})
