"""The table [teeth] of a design file: by how much the teeth of a gear differ."""

from collections.abc import Mapping
from functools import partial, reduce
from operator import add
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..metrics import Quantity
from ..microgeometry import AbstractModification, LeadSlope, ProfileSlope
from ..microgeometry.base import AMOUNTS
from ..numerics import Number
from ..revolution import Teeth, TeethDeviations, Undulation
from ..revolution.settings import MOST_WINDOWS
from ..revolution.solve import GEARS
from .design_file import DesignFile
from .errors import DesignFileError, join, naming, referring, refused
from .flanks import check_flank, flank_of_rows, numbers_of
from .rows import read_rows
from .table_keys import FileTable, entry, nested, section_of
from .tables import FurtherTable
from .template import Template
from .value_types import QUALITY_CLASS, SEED, ValueType, choice, count, list_of, positive, real, text

_GEAR, _COUNT = choice("pinion", "wheel", "hunting"), count(1, MOST_WINDOWS)
_OVER = ValueType(
    '"pinion", "wheel", "hunting" or a number of base pitches',
    lambda key, value: (_GEAR if isinstance(value, str) else _COUNT).read(key, value),
    _COUNT.number,
)
_AMOUNTS = list_of(real(Number("um")))
_TOOTH = "tooth"
_LISTS = "pitch", "single_pitch", "profile_slope", "helix_slope"  # keys, and columns with the unit
_SLOPES = {"profile_slope": ProfileSlope, "helix_slope": LeadSlope}


class _GearTeethSection(FileTable):
    """How the teeth of one gear deviate; what is given in several ways adds up.

    Teeth are counted in the order in which they come into mesh, from 0. Amounts are positive where material is missing:
    the sign of a report that counts pitches in this order for the pinion, the opposite one for the wheel.

    Attributes:
        pitch: cumulative pitch deviation F_pi of every tooth on the reference circle.
        single_pitch: single pitch deviation f_pi of every tooth from the one before, in place of `pitch`; they sum to
            zero.
        profile_slope: deviation f_Halpha of every tooth, as the amount of a profile slope.
        helix_slope: deviation f_Hbeta of every tooth, as the amount of a lead slope.
        run_out: F_r of an eccentric gear, twice the eccentricity, largest at tooth 0.
        undulations: waves around the gear, ghost orders for one.
        file: CSV or Parquet file beside the design file with a row per tooth and any of the columns pitch_um,
            single_pitch_um, profile_slope_um, helix_slope_um, and tooth, which then counts from 0 or 1.
        flanks: CSV or Parquet file with a flank of every tooth: the columns of a flank from a file, and tooth.
        quality_class: flank tolerance class of ISO 1328-1 in whose limits of pitch and run-out deviations are drawn.
        seed: seed of this draw.
    """

    pitch: list[float] | None = entry(_AMOUNTS)
    single_pitch: list[float] | None = entry(_AMOUNTS)
    profile_slope: list[float] | None = entry(_AMOUNTS)
    helix_slope: list[float] | None = entry(_AMOUNTS)
    run_out: float | None = entry(positive("um"))
    undulations: list[Template] = entry(list_of(nested(Undulation, open=False)), [])
    file: str | None = entry(text())
    flanks: str | None = entry(text())
    quality_class: int | None = entry(QUALITY_CLASS)
    seed: int = entry(SEED, 0)


class TeethSection(FurtherTable):
    """Teeth that differ from each other; for `jaxgear revolution` and for the quantities of a revolution.

    Attributes:
        pinion: deviations of the teeth of the pinion; equal teeth without it.
        wheel: deviations of the teeth of the wheel; equal teeth without it.
        over: a revolution of the pinion or the wheel, the hunting period of all pairings of teeth, or a number of base
            pitches; without it the revolution of the only gear whose teeth differ, or the hunting period.
    """

    table = "teeth"
    drive_only = True

    pinion: _GearTeethSection | None = entry(nested(_GearTeethSection))
    wheel: _GearTeethSection | None = entry(nested(_GearTeethSection))
    over: str | int | None = entry(_OVER)

    def check(self, design: DesignFile) -> None:
        """As a study does."""
        teeth_of(design)

    def quantity(self, design: DesignFile, key: str, quantity: Quantity) -> Quantity:
        """Quantity of a revolution with these teeth; orders of a shaft need whole revolutions."""
        teeth = teeth_of(design)
        assert teeth.counts is not None
        for gear, number in zip(GEARS, teeth.counts):
            whole = teeth.repeats(teeth.counts) and teeth.windows(teeth.counts) % number == 0
            if quantity.name in (f"{gear}_shaft_order", f"{gear}_side_bands") and not whole:
                needed = f'whole revolutions of the {gear} and of all gears whose teeth differ: teeth.over = "hunting"'
                raise DesignFileError(key, f'"{quantity.name}" needs {needed}')
        return quantity.with_settings(teeth)

    @classmethod
    def inner(cls) -> Mapping[str, type[FileTable]]:
        """The gears, and waves around them."""
        return {
            "[teeth.pinion] and [teeth.wheel]": _GearTeethSection,
            "[[teeth.pinion.undulations]]": section_of(Undulation, open=False),
        }


def teeth_of(design: DesignFile) -> Teeth:
    """The settings of the table [teeth].

    Raises:
        DesignFileError: for anything that is wrong with it, in one line that names the file and the key.
    """
    with naming(design.path):
        section = design.needed("teeth", "it says by how much the teeth of the gears differ")
        if section.pinion is None and section.wheel is None:
            raise DesignFileError("teeth", "needs the table pinion or wheel, or both")
        for free in design.open_case:
            if free.key in ("pinion.teeth", "wheel.teeth"):
                raise DesignFileError("teeth", f"cannot be with {free.key} a variable")
        gears = [(name, getattr(section, name)) for name in ("pinion", "wheel")]
        pinion, wheel = (_deviations(design, name, given) for name, given in gears)
        first, second = (round(float(gear.teeth)) for gear in design.pair().gears)
        teeth = Teeth(pinion, wheel, section.over, (first, second))
        refused("teeth.over", teeth.windows, (first, second))
        return teeth


def _deviations(design: DesignFile, name: str, section: _GearTeethSection | None) -> TeethDeviations | None:
    """Deviations of the teeth of one gear; None without its table."""
    if section is None:
        return None
    at, gear, lists = section.key, getattr(design.pair(), name), _lists(design, section)
    teeth = round(float(gear.teeth))
    for key, values in lists.items():
        if len(values) != teeth:
            raise DesignFileError(join(at, key), f"has {len(values)} numbers, the gear has {teeth} teeth")
    if "pitch" in lists and "single_pitch" in lists:
        raise DesignFileError(join(at, "single_pitch"), "has no effect beside pitch")
    pitch = jnp.asarray(lists.get("pitch", np.zeros(teeth)), float)
    if "single_pitch" in lists:
        pitch = refused(join(at, "single_pitch"), TeethDeviations.from_single_pitch, lists["single_pitch"]).pitch
    waves = [each.build({}) for each in section.undulations]
    if section.run_out is not None:
        waves.append(Undulation(jnp.asarray(0.5 * section.run_out), jnp.asarray(1.0)))
    if section.quality_class is not None:
        draw = partial(TeethDeviations.drawn, key=jax.random.fold_in(jax.random.key(section.seed), name == "wheel"))
        drawn = refused(join(at, "quality_class"), draw, gear, section.quality_class)
        pitch, waves = pitch + drawn.pitch, [*waves, *drawn.undulations]
    elif "seed" in section.fields:
        section.refuse(["seed"], " without quality_class")
    flanks: list[Any] = [jax.vmap(make)(jnp.asarray(lists[key])) for key, make in _SLOPES.items() if key in lists]
    if section.flanks is not None:
        flanks.append(_measured(design, name, section))
    made = reduce(add, flanks) if flanks else None
    _check_slices(design, section, made, lists)
    return TeethDeviations(pitch, made, tuple(waves))


def _lists(design: DesignFile, section: _GearTeethSection) -> dict[str, Any]:
    """The numbers of every tooth by their keys, those of the file included."""
    found = {key: getattr(section, key) for key in _LISTS if getattr(section, key) is not None}
    if section.file is None:
        return found
    with referring(join(section.key, "file"), section.file):
        rows = read_rows(design.path.parent / section.file)
        columns = {key: f"{key}_um" for key in _LISTS if f"{key}_um" in rows[0]}
        if not columns:
            raise DesignFileError("", f"has no column {', '.join(f'{key}_um' for key in _LISTS)}, must have one")
        for twice in columns.keys() & found.keys():
            raise DesignFileError("", f"has {columns[twice]}, which is given as {join(section.key, twice)} too")
        if _TOOTH in rows[0]:
            numbers = numbers_of(rows, _TOOTH)
            if numbers[0] not in (0, 1) or (np.diff(numbers) != 1).any():
                raise DesignFileError("", "has the column tooth, must count 0, 1, 2 ... or 1, 2, 3 ... from row to row")
        read = {key: numbers_of(rows, column) for key, column in columns.items()}
        for key, values in read.items():
            if 0 < (largest := float(abs(values).max())) < AMOUNTS.low:
                raise DesignFileError("", f"has {columns[key]} within {largest:.3g} um, {AMOUNTS.remark}")
        return found | read


def _measured(design: DesignFile, name: str, section: _GearTeethSection) -> AbstractModification:
    """A flank of every tooth from a file."""
    assert section.flanks is not None
    pair, key = design.pair(), join(section.key, "flanks")
    gear = getattr(pair, name)
    with referring(key, section.flanks):
        rows = read_rows(design.path.parent / section.flanks)
        if _TOOTH not in rows[0]:
            raise DesignFileError("", "has no column tooth, must have one")
        numbers, count = numbers_of(rows, _TOOTH), round(float(gear.teeth))
        known = np.unique(numbers)
        if known[0] not in (0, 1) or not np.array_equal(known, known[0] + np.arange(count)):
            raise DesignFileError("", f"has flanks of {len(known)} teeth, must have {count}, counted from 0 or 1")
        flanks = []
        for tooth in known:
            own = [row for row, number in zip(rows, numbers) if number == tooth]
            flank, reach = flank_of_rows(own, float(gear.base_radius))
            check_flank(reach, pair, name)
            flanks.append(flank)
    made: Any = refused(key, TeethDeviations, jnp.zeros(count), flanks)
    return made.flanks


def _check_slices(
    design: DesignFile, section: _GearTeethSection, flanks: AbstractModification | None, lists: Mapping[str, Any]
) -> None:
    """Refuses what varies over the face on one slice, which cannot show it."""
    if flanks is None or design.resolution().slices > 1:
        return
    for tooth in range(len(jax.tree.leaves(flanks)[0])):
        if jax.tree.map(lambda leaf, tooth=tooth: jnp.asarray(leaf)[tooth], flanks).varies_along_face:
            key = "file" if section.helix_slope is None and "helix_slope" in lists else "helix_slope"
            key = key if "helix_slope" in lists else "flanks"
            raise DesignFileError(join(section.key, key), "needs resolution.slices of at least 2, one cannot show it")
