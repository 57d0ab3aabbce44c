"""The stiffness model and the array sizes that a design file asks for."""

from pathlib import Path

from ..compliance import AbstractCompliance, Compliance, finite_element_compliance, legacy_compliance
from ..contact import Resolution, helical_slices
from ..geometry import GearPair
from . import template
from .errors import DesignFileError, check_file, referring, refused
from .table_keys import FileTable, entry, section_of, template_of
from .value_types import choice, text

# Slices where a modification varies along the face: the mean of a parabola over the middles of n slices is 1 / n^2 too
# small, so that 11 show a lead crowning to 1 %.
_SLICES = 11


class ModelSection(section_of(Compliance)):  # type: ignore[misc]
    """The stiffness model: tooth, gear body and contact law, each by its name, or as a table with `type` and options.

    Attributes:
        preset: "legacy" is the model of older studies and takes no other key.
        structure: "finite_element" takes tooth and body from finite elements, made once per gear and then kept; `plane`
            and the tables are its only other keys.
        pinion_table: CSV file, beside the design file, with the table of another finite-element program in place of it.
        wheel_table: CSV file with the table of the wheel.
    """

    preset: str = entry(choice("default", "legacy"), "default")
    structure: str = entry(choice("closed_form", "finite_element"), "closed_form")
    pinion_table: str | None = entry(text())
    wheel_table: str | None = entry(text())


# Sizes up to these: a slip of the finger must not fill the memory or compile for hours.
ResolutionSection = section_of(
    Resolution,
    most=(("positions", 4096), ("slices", 1024), ("pairs", 64), ("contact_nodes", 64), ("newton_steps", 100)),
)


def resolution_of(section: FileTable, uneven: list[str], *, bent: bool, longest: GearPair) -> Resolution:
    """The array sizes.

    Args:
        section: the table of that name.
        uneven: keys of the modifications that vary along the face.
        bent: shafts bend; slices show it where the file says nothing else.
        longest: the pair, of those that the variables make, whose contact lines run the farthest along the path.

    Raises:
        DesignFileError: for one slice where modifications vary along the face, or of helical gears.
    """
    sizes = dict(section.fields)
    if sizes.get("slice_widths") is not None:
        sizes.setdefault("slices", len(sizes["slice_widths"]))
    usual = max(_SLICES, helical_slices(longest))
    seen = [] if longest.is_spur else ["helical gears, whose contact lines run across the face"]
    seen += [f"{key}, which varies along the face" for key in uneven]
    if bent or seen:
        sizes.setdefault("slices", usual)
    if seen and sizes["slices"] == 1:
        problem = f"must be at least 2, 1 cannot show {seen[0]}"
        raise DesignFileError("resolution.slices", f"{problem} ({usual} where the key is left out)")
    return template.Template(Resolution, sizes, "resolution").build({})


FINITE_ELEMENTS = "finite_element"
_TABLES = "pinion_table", "wheel_table"
# numbers of gears and pair that a table holds for whatever they are; the module too, where it moves no ratio
_FREE = {
    "face_width",
    "center_distance",
    "axial_offset",
    "tip_edge_radius",
    "tip_form_diameter",
    "elastic_modulus",
    "density",
    "thermal_contact_coefficient",
}
_LENGTHS = "tip_diameter", "bore_diameter", "rim_diameter", "fillet_radius"


def model_template(section: ModelSection) -> template.Template:
    """Template of the stiffness model without finite-element tables, which need the gears."""
    if section.structure == FINITE_ELEMENTS:
        others = set(section.fields) - {"structure", "plane", *_TABLES}
        if others:
            raise DesignFileError(f"model.{min(others)}", f'cannot be combined with structure = "{FINITE_ELEMENTS}"')
        return template.Template(Compliance, {}, "model")
    section.refuse(_TABLES, f' without structure = "{FINITE_ELEMENTS}"')
    if section.preset == "default":
        return template_of(section, Compliance)
    given = set(section.fields) - {"preset", "structure"}
    if given:
        raise DesignFileError(f"model.{min(given)}", 'cannot be combined with preset = "legacy"')
    return template.Template(legacy_compliance, {}, "model")


def with_tables(
    model: template.Template, section: ModelSection, folder: Path, pair: template.Template, middle: GearPair
) -> template.Template:
    """The model, with the tables of the gears where the file asks for finite elements.

    Args:
        model: model from `model_template`.
        section: table [model] of the file.
        folder: folder of the design file, in which paths begin.
        pair: gears whose numbers may be variables.
        middle: the gears with all variables in the middle of their bounds.
    """
    if section.structure != FINITE_ELEMENTS:
        return model
    for free in pair.free():
        name = free.key.rpartition(".")[2]
        moves = name == "module" and any(
            getattr(g, name, None) is not None for g in _gears(middle) for name in _LENGTHS
        )
        if moves or name not in {*_FREE, "module"}:
            problem = f'cannot be a variable with model.structure = "{FINITE_ELEMENTS}", whose tables are of one shape'
            raise DesignFileError(free.key, problem)
    paths = {name: folder / path for name in _TABLES if (path := getattr(section, name)) is not None}
    for name, path in paths.items():
        with referring(f"model.{name}", path.name):
            check_file(path)
    tabulated = refused("model", finite_element_compliance, middle, section.plane or "auto", **paths)
    return template.Template(_unchanged, {"compliance": tabulated}, "model")


def _gears(pair: GearPair):
    return pair.pinion, pair.wheel


def _unchanged(compliance: AbstractCompliance) -> AbstractCompliance:
    return compliance
