"""The tables [lubricant] and [strength], which may stand in files of their own."""

from ..metrics import Lubricant, Strength
from ..numerics import Number
from .design_file import DesignFile
from .errors import DesignFileError
from .table_keys import section_of
from .tables import FILE, SettingsTable
from .value_types import outside

# that only a rating after ISO/TS 6336-20, -21 and -22 counts
_OF_RATING = (
    *("fzg_stage", "structure_factor", "run_in", "micropitting_test", "micropitting_test_film"),
    *("pinion_immersion", "wheel_immersion", "splash_factor", "oil_volume"),
)
_SPEED = Number("rpm", low=0.0, open_low=True)


class LubricantSection(SettingsTable, section_of(Lubricant, open=False)):  # type: ignore[misc]
    """The oil, for friction, temperatures, film and scuffing; needs a load.speed greater than 0."""

    table = "lubricant"

    def check(self, design: DesignFile) -> None:
        """Refuses a lubricant without motion, its friction beside that of the load, and keys that rate nothing."""
        if "rating" not in design.tables:
            for name in _OF_RATING:
                if getattr(self, name) is not None:
                    raise DesignFileError(f"lubricant.{name}", "has no effect without [rating]")
        key, slowest = "load.speed", design.speed
        if slowest is None:
            raise DesignFileError("lubricant", "has no effect without load.speed")
        for free in design.open_case:
            if free.key == key:
                key, slowest = f"variables.{free.name}.low", design.bounds[free.name][0]
        if too_slow := outside(_SPEED, slowest):
            raise DesignFileError(key, f"{too_slow} with [lubricant]: no film without motion")
        if design.friction is not None:
            for name in ("friction", "friction_factor"):
                if getattr(self, name) is not None:
                    raise DesignFileError(f"lubricant.{name}", "has no effect beside load.friction")


class StrengthSection(SettingsTable, section_of(Strength, open=False)):  # type: ignore[misc]
    """Permissible stresses, for the safety factors."""

    table = "strength"

    def check(self, design: DesignFile) -> None:
        """Refuses a table without any stress."""
        if not self.fields.keys() - {FILE}:
            raise DesignFileError("strength", "is empty; it gives the permissible stresses")
        if not self.fields.keys() - {FILE, "load_factor"}:
            raise DesignFileError("strength.load_factor", "has no effect without permissible stresses")
