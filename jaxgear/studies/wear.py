"""Wear study: worn flanks of a design file over the revolutions."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

from ..contact import Mesh, OperatingPoint
from ..io import DesignFile, Search
from ..io.errors import naming
from ..numerics import optional_real, real
from ..tolerance import ManufacturedGears
from ..wear import Wear, WearHistory
from . import manufactured, wear_scatter
from .checkpoints import Checkpoints, CheckpointsOfKind, Marches, NamedArrays
from .comparison import Modifications, compared, first_mesh, search_of, sought
from .progress import Stages
from .study import AbstractStudy
from .wear_result import OVER_LIFE, WearResult

_QUICK_BLOCKS = 4
_MOST_BLOCKS = 1000  # most blocks of a wear history of manufactured gears


@dataclass(frozen=True)
class WearStudy(AbstractStudy[WearResult]):
    """Wear the flanks of the pair over the revolutions of the table `wear`.

    The command compares the unmodified pair, the rule-based tip relief of ISO 6336-1, and the modification of the
    design file or the optimum of its variables. An interrupted command resumes from its stored results when it is
    repeated.

    Attributes:
        settings: revolutions and wear coefficients.
        search: search for the optimum of the file; None if its modifications are numbers.
        over_life: search for the lowest mean PPTE over the wear history, under the static load; None for no search.
        tolerance: manufactured gears that are worn; None for none.
    """

    name: ClassVar = "wear"
    coarse: ClassVar = "coarse positions and few blocks"

    settings: Wear
    search: Search | None
    over_life: Search | None
    gears: ManufacturedGears | None

    @classmethod
    def of(cls, design: DesignFile, *, quick: bool = False) -> Self:
        """Wear study of a design file, see `AbstractStudy.of`."""
        with naming(design.path):
            settings = design.needed("wear", "it says for how long the pair runs and how it wears").settings(design)
            gears = None if wear_scatter.left_out(design) else manufactured.gears_of(design, quick=quick)
        if quick:
            settings = dataclasses.replace(settings, blocks=_QUICK_BLOCKS, largest_increment=None)
        search = search_of(design, quick=quick)
        # every step of the search computes a wear history: under the static load, far faster than with dynamics
        static = dataclasses.replace(settings, line_load=None, dynamics=None)
        over_life = None if search is None else search.over_life(static)
        return cls(design, quick, settings, search, over_life, gears)

    def omits(self) -> str:
        """Message on manufactured gears, which are ignored under the dynamic line load; "" for none."""
        return wear_scatter.left_out(self.design)

    def work_out(self, checkpoints: Checkpoints, stages: Stages) -> WearResult:
        """Compute the wear histories of all designs, and of manufactured pairs if the file has tolerances."""
        design, quick = self.design, self.quick
        highest = max(design.torque, design.torque_range[1])
        mesh, designs = compared(design, highest, self.search, checkpoints, stages, quick=quick)
        if self.over_life is not None:
            stages.begin("searching the optimum over the life")
            start = first_mesh(design, highest, quick=quick)
            _, designs[OVER_LIFE] = sought(design, OVER_LIFE, self.over_life, start, checkpoints, stages, quick=quick)
        kept = checkpoints.of(Marches())
        histories = {name: self._life(mesh, name, flanks, kept, stages) for name, flanks in designs.items()}
        scatters: Mapping[str, wear_scatter.Samples] = {}
        if self.gears is not None:
            stages.begin("wear of manufactured gears of all designs")
            # of one length, as quantities take them, and as many as the nominal gears have taken
            blocks = min(max(len(history.revolutions) - 1 for history in histories.values()), _MOST_BLOCKS)
            settings = dataclasses.replace(self.settings, blocks=blocks, largest_increment=None)
            scatters = wear_scatter.manufactured_wear(
                mesh, design.torque, designs, settings, self.gears, keep=checkpoints.of(NamedArrays())
            )
        return WearResult(design, self.settings, designs, histories, scatters)

    def _life(
        self, mesh: Mesh, name: str, flanks: Modifications, kept: CheckpointsOfKind[Any], stages: Stages
    ) -> WearHistory:
        """Wear history of one design at the torque of the file."""
        stages.begin(f"wear of the {name} design")
        design, (pinion, wheel) = self.design, flanks

        def progress(done: int, total: int, best: float | None) -> None:
            stages.count(done, total, f"{done:.3g} of {total:.3g} revolutions")

        load = None
        if self.settings.loads is None:
            load = OperatingPoint(real(design.torque), optional_real(design.speed), optional_real(design.friction))
        return self.settings.history(mesh, load, pinion=pinion, wheel=wheel, keep=kept, callback=progress)
