"""The table [rating] of a design file."""

from collections.abc import Mapping
from dataclasses import replace

from ..conditions import LoadSpectrum
from ..contact import MeshCycle, OperatingPoint
from ..io.design_file import DesignFile
from ..io.errors import DesignFileError, refused
from ..io.table_keys import FileTable, entry, nested, section_of, template_of
from ..io.tables import FurtherTable
from ..io.value_types import WEIGHTS, list_of, positive
from ..metrics import Analysis, Finding, Quantity
from ..numerics import optional_real, real
from ..report import Part
from .findings import rating_findings
from .quantities import rating_of
from .report import part
from .settings import GearRating, Rating, check_metal
from .thermal_quantities import missing, thermal_of

_GEARS = "pinion", "wheel"
_ROUNDED = 1e-6  # by which shares may miss their sum


class GearRatingSection(section_of(GearRating, open=False)):  # type: ignore[misc]
    """Material, surface and deviations of a gear for its rating; its quality class is that of the gear."""

    source = GearRating


class RatingSection(FurtherTable, section_of(Rating, (*_GEARS, "lubricant", "loads"), open=False)):  # type: ignore[misc]
    """How the pair is rated after ISO 6336: load factors, required safeties, load spectrum.

    Attributes:
        pinion, wheel: materials, surfaces and deviations, with the keys of [rating.gears].
        gears: keys that both have in common, such as the material; a key of a gear itself counts before it.
        torques: on the pinion, of a load spectrum; the load of the file without it.
        weights: shares of the time at every torque, which sum to 1; equal shares without it.
        speeds: of the pinion at every torque; that of the file without it.
    """

    table = "rating"
    shown = tuple(
        f"{gear}_{name}"
        for name in ("pitting_safety", "static_pitting_safety", "root_safety", "static_root_safety", "service_life")
        for gear in _GEARS
    )

    pinion: GearRatingSection | None = entry(nested(GearRatingSection))
    wheel: GearRatingSection | None = entry(nested(GearRatingSection))
    gears: GearRatingSection | None = entry(nested(GearRatingSection))
    torques: list[float] | None = entry(list_of(positive("N m")))
    weights: list[float] | None = entry(WEIGHTS)
    speeds: list[float] | None = entry(list_of(positive("rpm")))
    _made: tuple[DesignFile, Rating] | None = None

    def check(self, design: DesignFile) -> None:
        """Refuses what does not go together with the rest of the file."""
        if design.speed is None:
            raise DesignFileError("rating", "has no effect without load.speed")
        for name in ("strength",):
            strength = design.tables.get(name)
            for key in ("pitting", "bending"):
                if strength is not None and getattr(strength, key) is not None:
                    problem = "has no effect beside [rating]: it is the limit that the rating works out"
                    raise DesignFileError(f"{name}.{key}", problem)
        self.settings(design)

    def quantity(self, design: DesignFile, key: str, quantity: Quantity) -> Quantity:
        """A quantity with the settings of the table, the oil of [lubricant] and the classes of the gears."""
        settings = self.settings(design)
        if quantity.needs and getattr(settings, quantity.needs) is None:
            raise DesignFileError(key, f'"{quantity.name}" needs rating.{quantity.needs}')
        if lacks := missing(quantity.name, settings.lubricant):
            raise DesignFileError(key, f'"{quantity.name}" needs {lacks}')
        return quantity.with_settings(settings)

    def settings(self, design: DesignFile) -> Rating:
        """The settings that the table stands for.

        Raises:
            DesignFileError: for what is missing or does not go together.
        """
        if self._made is not None and self._made[0] is design:
            return self._made[1]
        classes = design.quality_classes or (None, None)
        for name in _GEARS:
            refused(f"{name}.material", check_metal, "elastic_modulus", getattr(design.pair(), name).material)
        gears = {name: self._gear(name, quality) for name, quality in zip(_GEARS, classes)}
        if "lubricant" not in design.tables:
            raise DesignFileError("rating", "Z_L needs the table [lubricant]")
        further = {**gears, "lubricant": design.tables["lubricant"], "loads": self._loads(design)}
        made: Rating = template_of(self, Rating, without=_GEARS).having(**further).build({})
        self._made = design, made
        return made

    def findings(self, design: DesignFile, cycle: MeshCycle) -> tuple[Finding, ...]:
        """Numbers of the rating that are out of the validity of ISO 6336."""
        rating = self.settings(design)
        return rating_findings(cycle.kinematics.pair, rating, rating_of(_analysis(design, cycle), rating))

    def part(self, design: DesignFile, name: str, cycle: MeshCycle) -> Part:
        """The rating for the terminal, the report and the files."""
        rating, analysis = self.settings(design), _analysis(design, cycle)
        return part(rating_of(analysis, rating), thermal_of(analysis, rating), rating, name, coast=design.coast)

    @classmethod
    def inner(cls) -> Mapping[str, type[FileTable]]:
        """Keys that the gears have in common; the tables of each have the same keys."""
        return {"[rating.gears]": GearRatingSection}

    def _gear(self, name: str, quality: int | None) -> GearRating:
        key, said = f"{self.table}.{name}", [each for each in (self.gears, getattr(self, name)) if each is not None]
        if not said:
            raise DesignFileError(key, "missing, the table of the material and the surface of the gear")
        section = GearRatingSection(key, **{field: value for each in said for field, value in each.fields.items()})
        for needed, why in _NEEDED:
            if all(getattr(section, each) is None for each in needed):
                raise DesignFileError(f"{key}.{needed[0]}", f"missing, {why}")
        for each in _DEVIATIONS if quality is None and section.quality_class is None else ():
            if getattr(section, each) is None:
                raise DesignFileError(f"{key}.{each}", f"missing, K_v needs it; or give {name}.quality_class")
        given = {} if quality is None or section.quality_class is not None else {"quality_class": quality}
        made: GearRating = template_of(section, GearRating).having(**given).build({})
        return made

    def _loads(self, design: DesignFile) -> LoadSpectrum | None:
        """The spectrum; None where the table names no torques."""
        spectrum = design.spectrum(self)
        if self.torques is None:
            return None
        if self.service_life is None:
            raise DesignFileError("rating.service_life", "missing, a load spectrum needs it")
        if self.application_factor not in (None, 1.0):
            raise DesignFileError("rating.application_factor", "has no effect beside a load spectrum, it is 1")
        if self.weights is not None and abs(sum(self.weights) - 1) > _ROUNDED:
            problem = f"{self.weights} sum to {sum(self.weights):g}, must sum to 1"
            raise DesignFileError("rating.weights", problem)
        return spectrum


def _analysis(design: DesignFile, cycle: MeshCycle) -> Analysis:
    running = OperatingPoint(real(design.torque), optional_real(design.speed))
    return Analysis(replace(cycle, operating_point=running))


# any one of several keys, and what needs it
_NEEDED: tuple[tuple[tuple[str, ...], str], ...] = (
    (("heat_treatment",), "the group of materials of ISO 6336-5"),
    (("flank_roughness_rz", "flank_roughness_ra"), "Z_R needs it; or give flank_roughness_ra"),
    (("root_roughness_rz",), "Y_RrelT needs it"),
)
_DEVIATIONS = "base_pitch_deviation", "profile_form_deviation"
