"""The layout of a design file: one class per table, its fields are the allowed keys.

Numbers of modifications and curves may be the name of a variable instead. Defaults that belong to the library stay
there: None means that the key is absent.
"""

from typing import Annotated, Any

from ..compliance import Compliance
from ..contact import OperatingPoint, Resolution
from ..geometry import Gear, GearPair
from ..manufacture import ToothThickness
from ..numerics import Number
from ..shafts import Misalignment
from .kinds import (
    QUALITY_CLASS,
    choice,
    either,
    list_of,
    positive,
    real,
    table,
    text,
)
from .layout import Section, section_of

Tables = dict[str, Any]

_BOUND = real(plausible=False)
_TABLES = list_of(table(), empty=True)


class FileSection(Section):
    """The tables of a file, and its title.

    Attributes:
        pinion: the driving gear.
        wheel: the driven gear.
        load: torque and speed.
        title: free text; the name of the file without it.
        project: whose gears these are, for the head of the report.
        materials: of gears and shafts, by names of the file's own; "STEEL" is known without it.
        pair: how the gears are mounted.
        model: the stiffness model; the library's default without it.
        misalignment: of the axes; parallel ones without it.
        resolution: array sizes; the library's defaults without it.
        variables: numbers left open, with their bounds.
        optimize: what `jaxgear optimize` does.
        sweep: what `jaxgear sweep` does.
        tolerance: of manufactured gears: their scatter, and what a sweep or `optimize.manufactured` judges by.
        dynamics: at which speeds the pair runs, and what vibrates.
        wear: how long the pair runs, and how fast it wears.
        lubricant: the oil that they run in.
        strength: what the gears bear.
        shafts: that carry the gears, for `jaxgear layout`.
        meshes: of their gears; that of pinion and wheel alone without it.
        housing: that holds their bearings; rigid seats without it.
        layout: what `jaxgear layout` does.
    """

    pinion: Annotated[Tables, table()]
    wheel: Annotated[Tables, table()]
    load: Annotated[Tables, table()]
    title: Annotated[str | None, text()] = None
    project: Annotated[Tables | None, table()] = None
    materials: Annotated[Tables | None, table(table())] = None
    pair: Annotated[Tables | None, table()] = None
    model: Annotated[Tables | None, table()] = None
    misalignment: Annotated[Tables | None, table()] = None
    resolution: Annotated[Tables | None, table()] = None
    variables: Annotated[Tables | None, table(table())] = None
    optimize: Annotated[Tables | None, table()] = None
    sweep: Annotated[Tables | None, table()] = None
    tolerance: Annotated[Tables | None, table()] = None
    dynamics: Annotated[Tables | None, table()] = None
    wear: Annotated[Tables | None, table()] = None
    lubricant: Annotated[Tables | None, table()] = None
    strength: Annotated[Tables | None, table()] = None
    shafts: Annotated[list[Tables], _TABLES] = []
    meshes: Annotated[list[Tables], _TABLES] = []
    housing: Annotated[Tables | None, table()] = None
    layout: Annotated[Tables | None, table()] = None


class ProjectSection(Section):
    """Whose gears these are: texts that stand in the head of the report and in `summary.json`.

    Attributes:
        name: of the project.
        number: of the project or order.
        customer: for whom it is.
        drawing: number of the drawing.
        revision: of the drawing.
        author: who made the design.
        remark: what else is to stand there.
    """

    name: Annotated[str | None, text()] = None
    number: Annotated[str | None, text()] = None
    customer: Annotated[str | None, text()] = None
    drawing: Annotated[str | None, text()] = None
    revision: Annotated[str | None, text()] = None
    author: Annotated[str | None, text()] = None
    remark: Annotated[str | None, text()] = None


_ThicknessKeys = section_of(ToothThickness, most=(("teeth_spanned", 1000),))
_GearKeys = section_of(Gear, ("material", "tooth_thickness_allowance"))


class GearSection(_ThicknessKeys, _GearKeys):  # type: ignore[misc, valid-type]
    """A gear and what is taken off its flanks.

    The tooth thickness stands in one of three ways: as the allowance E_sns, with the tolerance T_sn down to E_sni where
    there is one; as the span W_k over so many teeth; as the dimension over balls. A list of two is lower and upper
    limit, between which the tooth is in the middle.

    Attributes:
        tooth_thickness_allowance: E_sns on the reference cylinder, negative for backlash, or [E_sni, E_sns].
        span: base tangent length W_k over `teeth_spanned` teeth, or its limits.
        teeth_spanned: k.
        over_balls: dimension M_dK over two balls or pins of `ball_diameter`, or its limits.
        ball_diameter: D_M.
        material: name in [materials], "STEEL", or elastic constants.
        quality_class: flank tolerance class of ISO 1328-1, of [tolerance], [layout] and the charts.
        modification: what is taken off the flank; several add up.
    """

    material: Annotated[Any, either(text(), table(), "the name of a material, or a table")] = None
    quality_class: Annotated[int | None, QUALITY_CLASS] = None
    modification: Annotated[list[Tables], _TABLES] = []


class FlankFileSection(Section):
    """A flank from a file, measured, computed or worn: points on a grid of roll_length_mm and, where it varies over the
    face, face_coordinate_mm, with measured_um (excess material), modification_um or wear_depth_um (material removed).

    Attributes:
        file: CSV or Parquet file, beside the design file.
        gear: of a file with flanks of both gears; the one that the table stands at where the key is left out.
        design: of a file with several designs.
        revolutions: of the pinion, of a file with several lives.
        method: of interpolation along the profile.
    """

    file: Annotated[str, text()]
    gear: Annotated[str | None, choice("pinion", "wheel")] = None
    design: Annotated[str | None, text()] = None
    revolutions: Annotated[float | None, real(Number("", low=0.0))] = None
    method: Annotated[str, choice("linear", "natural_cubic", "monotonic")] = "linear"


class PairSection(section_of(GearPair, ("pinion", "wheel"))):  # type: ignore[misc]
    """Pinion (driving) and wheel (driven) on their centre distance.

    Attributes:
        backlash: play on the line of action; by the tooth thickness of the gears that say nothing of their own, or by
            the centre distance where both do.
    """

    backlash: Annotated[Any, real(Number("um", low=0.0), open=True)] = None


MisalignmentSection = section_of(Misalignment)


class LoadSection(section_of(OperatingPoint)):  # type: ignore[misc]
    """Under what the pair runs.

    Attributes:
        torque: design torque on the pinion.
        torque_range: lowest and highest torque of interest; half and twice the design torque without it.
        speed: of the pinion, for temperatures, film and loss.
        friction: mean coefficient of friction, for efficiency and, with a speed, loss and temperatures; in place of the
            law of [lubricant].
    """

    torque: Annotated[Any, real(Number("N m", low=0.0, open_low=True), open=True)]
    torque_range: Annotated[list[float] | None, list_of(positive("N m"), length=2)] = None


class ModelSection(section_of(Compliance)):  # type: ignore[misc]
    """The stiffness model: tooth, gear body and contact law, each by its name, or as a table with `type` and options.

    Attributes:
        preset: "legacy" is the model of older studies and takes no other key.
        structure: "finite_element" takes tooth and body from finite elements, made once per gear and then kept; `plane`
            and the tables are its only other keys.
        pinion_table: CSV file, beside the design file, with the table of another finite-element program in place of it.
        wheel_table: the same for the wheel.
    """

    preset: Annotated[str, choice("default", "legacy")] = "default"
    structure: Annotated[str, choice("closed_form", "finite_element")] = "closed_form"
    pinion_table: Annotated[str | None, text()] = None
    wheel_table: Annotated[str | None, text()] = None


# Sizes up to these: a slip of the finger must not fill the memory or compile for hours.
ResolutionSection = section_of(
    Resolution,
    most=(("positions", 4096), ("slices", 1024), ("pairs", 12), ("patch_nodes", 64), ("newton_steps", 100)),
)


class VariableSection(Section):
    """A number of the file that is left open: it is named in place of a number.

    Attributes:
        low, high: least and greatest value, in the unit of the number that it stands for.
        value: between both, for `jaxgear analyze`, which needs numbers.
        unit: checked against its use.
    """

    low: Annotated[float, _BOUND]
    high: Annotated[float, _BOUND]
    value: Annotated[float | None, _BOUND] = None
    unit: Annotated[str | None, text(empty=True)] = None
