"""The layout of a design file: one class per table, its fields are the allowed keys.

Numbers of modifications and curves may be the name of a variable instead. Defaults that belong to the library stay
there: None means that the key is absent.
"""

from typing import Any

from ..compliance import Compliance
from ..contact import OperatingPoint, Resolution
from ..dynamics import Dynamics
from ..geometry import Gear, GearPair
from ..manufacture import ToothThickness
from ..numerics import Number
from ..optimize import METHODS, Pareto
from ..shafts import Misalignment
from ..tolerance import Tolerance
from ..wear import Wear
from .table_keys import FileTable, Key, key, section_of
from .value_types import (
    LEVEL,
    QUALITY_CLASS,
    QUALITY_CLASSES,
    SEED,
    WEIGHTS,
    choice,
    count,
    either,
    list_of,
    positive,
    real,
    switch,
    table,
    text,
)

Tables = dict[str, Any]

_BOUND = real(plausible=False)
_TABLES = list_of(table(), empty=True)


class FileSection(FileTable):
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
        strength: permissible stresses of both gears.
        shafts: that carry the gears, for `jaxgear layout`.
        meshes: of their gears; that of pinion and wheel alone without it.
        housing: that holds their bearings; rigid seats without it.
        layout: what `jaxgear layout` does.
    """

    pinion: Tables = key(table(), ...)
    wheel: Tables = key(table(), ...)
    load: Tables = key(table(), ...)
    title: str | None = key(text())
    project: Tables | None = key(table())
    materials: Tables | None = key(table(table()))
    pair: Tables | None = key(table())
    model: Tables | None = key(table())
    misalignment: Tables | None = key(table())
    resolution: Tables | None = key(table())
    variables: Tables | None = key(table(table()))
    optimize: Tables | None = key(table())
    sweep: Tables | None = key(table())
    tolerance: Tables | None = key(table())
    dynamics: Tables | None = key(table())
    wear: Tables | None = key(table())
    lubricant: Tables | None = key(table())
    strength: Tables | None = key(table())
    shafts: list[Tables] = key(_TABLES, [])
    meshes: list[Tables] = key(_TABLES, [])
    housing: Tables | None = key(table())
    layout: Tables | None = key(table())


class ProjectSection(FileTable):
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

    name: str | None = key(text())
    number: str | None = key(text())
    customer: str | None = key(text())
    drawing: str | None = key(text())
    revision: str | None = key(text())
    author: str | None = key(text())
    remark: str | None = key(text())


_ThicknessKeys = section_of(ToothThickness, most=(("teeth_spanned", 1000),))
_GearKeys = section_of(Gear, ("material", "tooth_thickness_allowance"))


class GearSection(_ThicknessKeys, _GearKeys):  # type: ignore[misc, valid-type]
    """A gear and the modifications of its flanks.

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
        modification: modifications of the flank; several add up.
    """

    material: Any = key(either(text(), table(), "the name of a material, or a table"))
    quality_class: int | None = key(QUALITY_CLASS)
    modification: list[Tables] = key(_TABLES, [])


class FlankFileSection(FileTable):
    """A flank from a file, measured, computed or worn: points on a grid of roll_length_mm and, where it varies over the
    face, face_coordinate_mm, with measured_um (excess material), modification_um or wear_depth_um (material removed).

    Attributes:
        file: CSV or Parquet file, beside the design file.
        gear: of a file with flanks of both gears; the one that the table stands at where the key is left out.
        design: of a file with several designs.
        revolutions: of the pinion, of a file with several lives.
        method: of interpolation along the profile.
    """

    file: str = key(text(), ...)
    gear: str | None = key(choice("pinion", "wheel"))
    design: str | None = key(text())
    revolutions: float | None = key(real(Number("", low=0.0)))
    method: str = key(choice("linear", "natural_cubic", "monotonic"), "linear")


class PairSection(section_of(GearPair, ("pinion", "wheel"))):  # type: ignore[misc]
    """Pinion (driving) and wheel (driven) on their centre distance.

    Attributes:
        backlash: play on the line of action; by the tooth thickness of the gears that say nothing of their own, or by
            the centre distance where both do.
    """

    backlash: Any = key(real(Number("um", low=0.0), open=True))


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

    torque: Any = key(real(Number("N m", low=0.0, open_low=True), open=True), ...)
    torque_range: list[float] | None = key(list_of(positive("N m"), length=2))


class ModelSection(section_of(Compliance)):  # type: ignore[misc]
    """The stiffness model: tooth, gear body and contact law, each by its name, or as a table with `type` and options.

    Attributes:
        preset: "legacy" is the model of older studies and takes no other key.
        structure: "finite_element" takes tooth and body from finite elements, made once per gear and then kept; `plane`
            and the tables are its only other keys.
        pinion_table: CSV file, beside the design file, with the table of another finite-element program in place of it.
        wheel_table: the same for the wheel.
    """

    preset: str = key(choice("default", "legacy"), "default")
    structure: str = key(choice("closed_form", "finite_element"), "closed_form")
    pinion_table: str | None = key(text())
    wheel_table: str | None = key(text())


# Sizes up to these: a slip of the finger must not fill the memory or compile for hours.
ResolutionSection = section_of(
    Resolution,
    most=(("positions", 4096), ("slices", 1024), ("pairs", 12), ("patch_nodes", 64), ("newton_steps", 100)),
)


class VariableSection(FileTable):
    """A number of the file that is left open: it is named in place of a number.

    Attributes:
        low, high: least and greatest value, in the unit of the number that it stands for.
        value: between both, for `jaxgear analyze`, which needs numbers.
        unit: checked against its use.
    """

    low: float = key(_BOUND, ...)
    high: float = key(_BOUND, ...)
    value: float | None = key(_BOUND)
    unit: str | None = key(text(empty=True))


class DynamicsSection(section_of(Dynamics, ("mesh_frequencies",), open=False)):  # type: ignore[misc]
    """At which speeds the pair runs, and what vibrates; for `jaxgear dynamics` and for the quantities that need it.

    Attributes:
        mesh_frequencies: lowest and highest frequency of the mesh; either these or `speeds`.
        speeds: lowest and highest speed of the pinion.
        number: of speeds, at equal steps.
        torque_factors: torques of `jaxgear dynamics`, in design torques; 0.5, 1 and 2 without it.
        run_up: duration of a change of speed from the lowest to the highest in `jaxgear dynamics`, at constant
            acceleration; no run-up without it.
    """

    mesh_frequencies: list[float] | None = key(list_of(positive("Hz"), length=2))
    speeds: list[float] | None = key(list_of(positive("rpm"), length=2))
    number: int = key(count(2, 10_000), 100)
    torque_factors: list[float] = key(list_of(positive("")), [0.5, 1.0, 2.0])
    run_up: float | None = key(positive("s"))


class WearSection(section_of(Wear, ("dynamics", "loads"), open=False)):  # type: ignore[misc]
    """How long the pair runs, and how fast it wears; for `jaxgear wear` and for the quantities that need it.

    Attributes:
        line_load: under which the flanks wear; "dynamic" is that of the steady motion, which needs the table
            [dynamics] and load.speed.
        largest_increment: depth that no block of the lives of `jaxgear wear` wears off beyond a tenth more; blocks of
            equal length without it. Quantities and the search over the life take `blocks` in any case.
        torques: on the pinion, of a spectrum whose loads wear one flank together; the load of the file without it.
        weights: of the torques in the revolutions.
        speeds: of the pinion at every torque; that of the file without it.
    """

    line_load: str = key(choice("static", "dynamic"), "static")
    largest_increment: float | None = key(positive("um"))
    torques: list[float] | None = key(list_of(positive("N m")))
    weights: list[float] | None = key(WEIGHTS)
    speeds: list[float] | None = key(list_of(positive("rpm")))


class SweepSection(FileTable):
    """Variants to be evaluated.

    Attributes:
        sampling: how they are spread over the bounds of the variables.
        samples: number of variants, of "sobol" and "latin_hypercube".
        seed: of the same.
        levels: values per variable, of "full_factorial": one number, or a number or list of values per variable.
        file: CSV or Parquet file of the variants, of "list".
        torques: on the pinion; the design torque alone without it.
        weights: of the torques.
        results: quantities to be listed.
        part_rows: variants per file of the table; without it there are about 64 files.
    """

    sampling: str = key(choice("sobol", "latin_hypercube", "full_factorial", "list"), "sobol")
    samples: int | None = key(count(1, 2**40))
    seed: int | None = key(SEED)
    levels: int | dict[str, int | list[float]] | None = key(
        either(
            LEVEL,
            table(either(LEVEL, list_of(real()), "a whole number or a list of values")),
            "a whole number, or a table with one entry per variable",
        )
    )
    file: str | None = key(text())
    torques: list[float] | None = key(list_of(positive("N m")))
    weights: list[float] | None = key(WEIGHTS)
    results: list[str] | None = key(list_of(text()))
    part_rows: int | None = key(count(1, 2**24))


class ToleranceSection(section_of(Tolerance, ("pinion", "wheel", "distribution"), open=False)):  # type: ignore[misc]
    """Deviations of manufactured gears after ISO 1328-1: the scatter of all designs of analyze, optimize and wear.

    Attributes:
        quality_class: of both gears, or of pinion and wheel; that of the gears without it.
        samples: manufactured pairs per design, or variant of a sweep.
        seed: of their deviations.
    """

    quality_class: int | list[int] | None = key(QUALITY_CLASSES)
    samples: int = key(count(2, 100_000), 64)
    seed: int = key(SEED, 0)


_NUMBER = real()
_NAMES = either(text(), list_of(text()), "a string or a list of strings")
_SHARE = real(Number(low=0.0, high=1.0, open_low=True, open_high=True))


class OptimizeSection(FileTable):
    """A search for the best values of the variables, or for flanks without any.

    Attributes:
        method: name of the method; "slp" without it.
        objective: a quantity to be made small, or large where that is better; several for "pareto"; "ppte" without it.
        measure: joins the cases of several torques or manufactured gears into one number; "mean" without it.
        level: of the measures "quantile" and "cvar".
        torques: on the pinion; the design torque alone without it.
        weights: of the torques.
        manufactured: pairs of manufactured gears under every torque; needs [tolerance].
        seed: of random searches and of the manufactured gears.
        starts: searches, of methods "slp", "adam" and "lbfgs".
        steps: most steps of every search, of the same methods.
        application_factor: K_A of the rule-based relief.
        verify: whether the designs are evaluated with the finite-element structure too; without it they are where the
            gears can be meshed. A quick run never does.
        constraint: limits of quantities or of combinations of variables.
    """

    method: str | None = key(text())
    objective: str | list[str] | None = key(_NAMES)
    measure: str | None = key(choice("mean", "worst", "quantile", "cvar"))
    level: float | None = key(_SHARE)
    torques: list[float] | None = key(list_of(positive("N m")))
    weights: list[float] | None = key(WEIGHTS)
    manufactured: int | None = key(count(1, 10_000))
    seed: int | None = key(SEED)
    starts: int | None = key(count(1, 4096))
    steps: int | None = key(count(10, 100_000))
    application_factor: float = key(real(Number(low=0.0, high=100.0, open_low=True)), 1.0)
    verify: bool | None = key(switch())
    constraint: list[Tables] = key(_TABLES, [])


class ConstraintSection(FileTable):
    """A limit, of either a quantity or a linear combination of variables.

    Attributes:
        of: name of a quantity.
        variables: coefficient of every variable of the combination.
        low: least value.
        high: greatest value.
    """

    of: str | None = key(text())
    variables: dict[str, float] | None = key(table(_NUMBER))
    low: float | None = key(real(plausible=False))
    high: float | None = key(real(plausible=False))


class FactorialOptions(FileTable):
    levels: int | dict[str, int] | None = key(
        either(LEVEL, table(LEVEL), "a whole number, or a table with one entry per variable")
    )


class IterationOptions(FileTable):
    start: str = key(choice("unmodified", "given", "low_pressure"), "unmodified")
    max_relief: float = key(positive("um"), 7.0)
    max_pressure: float | None = key(positive("MPa"))
    rtol: float | None = key(positive(""))
    steps: int | None = key(count(1, 1000))
    curve: str | None = key(text())


class FreeFormOptions(FileTable):
    points: int | None = key(count(4, 500))
    max_relief: float | None = key(positive("um"))
    curvature: float | None = key(real(Number(low=0.0)))
    steps: int | None = key(count(1, 10_000))
    curve: str | None = key(text())


# They seek the flanks themselves.
METHODS_WITHOUT_VARIABLES = ("te_iteration", "free_form")


def method_options() -> dict[str, type[FileTable]]:
    """The tables [optimize.<method>] of the methods that have one, of a user's own too: the fields of their classes."""
    found = {name: section_of(cls, ("starts", "steps", "seed"), open=False) for name, cls in METHODS.items()}
    found |= {"factorial": FactorialOptions, "pareto": section_of(Pareto)}
    found |= {"te_iteration": IterationOptions, "free_form": FreeFormOptions}
    return {name: section for name, section in found.items() if section.keys}


def optimize_section() -> type[OptimizeSection]:
    """The table [optimize] with those of the methods."""
    tables = {name: Key(table(), meaning="options of the method.") for name in method_options()}
    return type("OptimizeSection", (OptimizeSection,), {**tables, "__doc__": OptimizeSection.__doc__})
