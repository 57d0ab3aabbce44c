"""Answers of the page: a design while it moves, at rest, over manufactured gears, and optimized; its files."""

import dataclasses
import threading
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..conditions import cycle_status, solve_case
from ..contact import Mesh, MeshCycle, Resolution
from ..contact.status import Status, reason
from ..io import DesignFile, Search, quantities_of_tables, write_flanks, writing
from ..io.named_quantities import quantity_named
from ..io.optimize_table import optimize_of
from ..io.tables import FurtherTable
from ..metrics import Quantity, findings_of, profile_relief, share_settings
from ..microgeometry import AbstractModification, NoModification
from ..numerics.durable import write_durably
from ..numerics.programs import begin
from ..optimize import Front
from ..studies.comparison import rule_based
from ..studies.manufactured import gears_of
from ..sweeps import monte_carlo
from ..tolerance import ManufacturedGears, Tolerance
from ..vocabulary import quantity_of
from . import charts
from .movement import (
    Contacts,
    Curves,
    Found,
    Moved,
    contacts_of_slice,
    contacts_of_slices,
    curves_of,
    found,
    numbers_of,
)
from .sliders import Opened

_TORQUES = 9  # of the curve over the torque
_ORDERS = 8
_POSITIONS, _SLICED_POSITIONS = 512, 128  # at rest, of one slice and of several
# at most while a slider moves
_MOVING, _SLICES = 64, 11  # positions and slices
_GEARS = 100  # manufactured pairs
_BAND = 0.05, 0.5, 0.95  # quantiles
_FIRST = "ppte", "mean_te", "max_flank_pressure", "max_corner_pressure", "effective_contact_ratio"
_OVER_FACE = ("face_load_factor",)
_SAFETIES = "safety"  # in the names of quantities that the file has settings for


class Explorer:
    """A design file whose numbers move.

    Attributes:
        opened: the design file with its sliders.
        wanted: quantities of the page, in the order of their numbers.
        rests: set once designs at rest are answered without compiling.
    """

    def __init__(self, path: str | Path) -> None:
        """Open a design file.

        Raises:
            DesignFileError: for errors in the file, in one line.
        """
        self.opened = Opened(path)
        design = self.design
        self.wanted = tuple(self._quantities())
        self._bare, self._settings = share_settings(self.wanted)
        size = design.resolution()
        positions = _POSITIONS if size.slices == 1 else _SLICED_POSITIONS
        self._sizes = _coarse(size)
        self._fine_sizes = dataclasses.replace(size, positions=max(size.positions, positions))
        self._contacts = contacts_of_slice if self._sizes.slices == 1 else contacts_of_slices
        self._torques = jnp.linspace(*design.torque_range, _TORQUES)
        self._gears = _manufactured(design)
        self._lock = threading.Lock()
        self.rests = threading.Event()
        self._written: set[Path] = set()

    def prepare(self, stage: Callable[[str], None] = lambda text: None) -> None:
        """Compile what a movement needs.

        Args:
            stage: called with every stage of the work.
        """
        stage("preparing the mesh")
        first = self.opened.values
        self._at = self._moved(self._sizes)
        stage("compiling what a movement needs")
        vector = self._vector(first)
        contact = begin(self._contacts, self._at, vector, self._torques)
        if contact is not None:  # two compilers at once
            begin(found, self._at, vector, contact.known, self._orders, self._bare, self._settings)
        mesh = self._at.mesh_of(first)
        self._profiles = charts.profiles_of(mesh.sides) if isinstance(self._at.mesh, Mesh) else None
        self._frames = charts.frames(mesh, self._moving(first)[0].cycle, np.asarray(self._torques))

    def prepare_rest(self) -> None:
        """Compile what a design at rest and manufactured gears need."""
        try:
            self._fine = self._moved(self._fine_sizes)
            self._rule = rule_based(self.design)
            self.rest(self.opened.values)
        finally:
            self.rests.set()  # where it fails, so does every design at rest, and says so
        if self._gears is not None:
            self.robust(self.opened.values)

    @property
    def design(self) -> DesignFile:
        """Design file whose variables are the sliders."""
        return self.opened.design

    @property
    def folder(self) -> Path:
        """Folder of the design file."""
        return self.opened.path.resolve().parent

    def _quantities(self) -> Sequence[Quantity]:
        design = self.design
        asked = optimize_of(design).objective or ()
        named = (asked,) if isinstance(asked, str) else tuple(asked)
        sliced = design.resolution().slices > 1
        names = [*_FIRST, *_OVER_FACE * sliced]
        found = [quantity_of(quantity_named(design, "optimize.objective", name)) for name in [*names, *named]]
        safe = [each for each in quantities_of_tables(design) if _SAFETIES in each.name]
        return tuple({each.name: each for each in [*found, *safe]}.values())

    def _moved(self, sizes: Resolution) -> Moved:
        """Mesh, load and flanks as functions of the sliders, on a grid."""
        design = self.design
        fixed = not any(not free.key.startswith(("load.", "misalignment.")) for free in design.open_case)
        mesh = jax.block_until_ready(design.mesh(sizes)) if fixed else design.sweep_mesh(sizes)
        axes = design.misalignment if fixed and design.misalignment.free() else None
        return Moved(tuple(self.opened.sliders), mesh, axes, design.load, design.design)

    def start(self) -> dict[str, Any]:
        """Sliders, quantities and labels of the page, besides its answers."""
        design = self.design
        return {
            "title": design.title,
            "file": self.opened.path.name,
            "sliders": [dataclasses.asdict(slider) for slider in self.opened.sliders.values()],
            "styles": charts.styles(),
            "quantities": [charts.quantity(each) for each in self.wanted],
            "charts": self._frames,
            "torques": self._torques.tolist(),
            "manufactured": self._gears is not None,
            "grids": {"moving": charts.grid(self._sizes), "rest": charts.grid(self._fine_sizes)},
        }

    def move(self, values: Mapping[str, float]) -> dict[str, Any]:
        """Answer while a slider moves, on the coarse grid, with the gradient of every quantity."""
        with self._lock:
            result, contact = jax.device_get(self._moving(values))
        answer = self._answer(result.cycle, result.curves, result.profiles, values)
        status = contact.status
        return answer | {
            "numbers": charts.exact(result.numbers),
            "gradient": [charts.exact(row) for row in result.gradient],
            "over_torque": charts.short(contact.ppte),
            "failed": reason(status) if status != Status.CONVERGED else "",
        }

    def _vector(self, values: Mapping[str, float]) -> Array:
        return jnp.asarray([values[name] for name in self.opened.sliders], float)

    def _moving(self, values: Mapping[str, float]) -> tuple[Found, Contacts]:
        """Results on the coarse grid."""
        vector = self._vector(values)
        contact = self._contacts(self._at, vector, self._torques)
        result = found(self._at, vector, contact.known, self._orders, self._bare, self._settings)
        return result, contact

    @property
    def _orders(self) -> int:
        return max(1, min(_ORDERS, (self._sizes.positions - 1) // 2))

    def _answer(
        self, cycle: MeshCycle, curves: Curves, removed: Sequence[np.ndarray], values: Mapping[str, float]
    ) -> dict[str, Any]:
        along = charts.profiles_of(cycle.sides) if self._profiles is None else self._profiles
        return {
            "charts": charts.data(cycle, curves, along, removed),
            "handles": charts.handles(along, self._reliefs(values)),
        }

    def _reliefs(self, values: Mapping[str, float]) -> dict[str, charts.Relief]:
        """Tip reliefs of both gears whose numbers are sliders."""
        found = {}
        for gear in ("pinion", "wheel"):
            relief = charts.relief_of(getattr(self.design.design, gear), values)
            if relief is not None:
                found[gear] = relief
        return found

    def _solved(
        self, at: Moved, values: Mapping[str, float], flanks: Sequence[AbstractModification] | None = None
    ) -> tuple[MeshCycle, Mesh]:
        mesh, point, *own = at(values)
        pinion, wheel = own if flanks is None else flanks
        return solve_case(mesh, point, pinion, wheel), mesh

    def rest(self, values: Mapping[str, float], ended: Callable[[], bool] = lambda: False) -> dict[str, Any] | None:
        """Answer for a design at rest, on the fine grid, with the unmodified and rule-based flanks and the findings.

        Args:
            values: values of the sliders.
            ended: asked between two solutions; True ends the work.

        Returns:
            the answer; None if it was ended.
        """
        involute = NoModification(), NoModification()
        others = {"unmodified": involute, "rule-based": (self._rule, self._rule)}
        with self._lock:
            cycle, mesh = self._solved(self._fine, values)
            numbers = jax.device_get(numbers_of(cycle, mesh, self._bare, self._settings))
            answer = self._curves(cycle, values)
            status = np.asarray(cycle_status(cycle))
        answer |= {
            "numbers": charts.exact(numbers),
            "failed": reason(status) if status != Status.CONVERGED else "",
            "findings": [str(each) for each in self._findings(cycle)],
            "beside": {},
        }
        for name, flanks in others.items():
            if ended():
                return None
            with self._lock:
                answer["beside"][name] = self._curves(self._solved(self._fine, values, flanks)[0], values)["charts"]
        return answer

    def _curves(self, cycle: MeshCycle, values: Mapping[str, float]) -> dict[str, Any]:
        """Curves of a cycle with its flanks."""
        bare = dataclasses.replace(cycle, pinion=None, wheel=None)  # one program serves every kind of flank
        curves, profiles = curves_of(bare, self._orders), profile_relief(cycle.kinematics, cycle.pinion, cycle.wheel)
        bare, curves, profiles = jax.device_get((bare, curves, profiles))
        return self._answer(bare, curves, profiles, values)

    def _findings(self, cycle: MeshCycle) -> Sequence[object]:
        design, speed = self.design, cycle.operating_point.speed
        found = findings_of(cycle, torque_range=design.torque_range, speed=None if speed is None else float(speed))
        for table in design.tables.values():
            if isinstance(table, FurtherTable):
                found += table.findings(design, cycle)
        return found

    def robust(self, values: Mapping[str, float]) -> dict[str, Any]:
        """Scatter over manufactured gears: quantiles of the transmission error, and of PPTE.

        Raises:
            ValueError: for a file without tolerances.
        """
        if self._gears is None:
            raise ValueError("manufactured gears need the table [tolerance], or quality_class in both gears")
        with self._lock:
            mesh, point, pinion, wheel = self._at(values)
            torque = np.asarray(point.torque)
            scatter = monte_carlo(mesh, torque, self._gears, pinion=pinion, wheel=wheel, quantiles=_BAND)
        return charts.band(scatter)

    def optimize(
        self, values: Mapping[str, float], objective: str, progress: Callable[[int, int, float | None], None]
    ) -> dict[str, float]:
        """Values of the best flanks by a quick search from the current load and gears.

        Args:
            values: values of the sliders.
            objective: name of the quantity to be optimized.
            progress: called with the step, the number of steps, and the best value; its exceptions end the search.

        Raises:
            ValueError: for an unknown objective, and a design without sliders of flanks.
        """
        wanted = {quantity.name: quantity for quantity in self.wanted}
        if objective not in wanted:
            raise ValueError(f"{objective}: unknown objective, must be one of {', '.join(wanted)}")
        design = self.opened.searched(values)
        if not design.bounds:
            raise ValueError("variables: no slider changes the flanks, nothing to optimize")
        search = Search.of(design, method="slp", quick=True)
        search = dataclasses.replace(search, problem={**search.problem, "objective": wanted[objective]})
        best = search(design.mesh(), progress)
        assert not isinstance(best, Front)  # by the method
        numbers = {name: float(value) for name, value in best.parameters.items()}
        return {**values, **numbers}

    def write(self, name: str, values: Mapping[str, float]) -> list[str]:
        """Write the design file and the flanks, `name.toml` and `name.csv`, beside the design file.

        Args:
            name: name without an ending.
            values: values of the sliders.

        Returns:
            names of the files.

        Raises:
            ValueError: for a name with other characters than letters, digits, spaces, dots, hyphens and underscores, a
                file that was there before, and where a file cannot be written.
        """
        path = self.path_of(name)
        written = path, path.with_suffix(".csv")
        there = [each.name for each in written if each not in self._written and (each.exists() or each.is_symlink())]
        if there:
            raise ValueError(f"name: {there[0]} exists already, choose another name")
        mesh, _, *flanks = self._at(values)
        text = self.opened.text(values)
        self._written.update(written)
        with writing(path):
            write_durably(path, lambda file: file.write(text.encode("utf-8")))
        write_flanks(path.with_suffix(".csv"), mesh, {path.stem: (flanks[0], flanks[1])})
        return [each.name for each in written]

    def path_of(self, name: str) -> Path:
        """Path of a design file of this name, in the folder of the design file.

        Raises:
            ValueError: see `write`.
        """
        stem = name.removesuffix(".toml")
        if not (
            stem[:1].isalnum() and stem == stem.strip(" .") and all(each.isalnum() or each in " ._-" for each in stem)
        ):
            allowed = "letters, digits, spaces, dots, hyphens and underscores, a letter or digit first"
            raise ValueError(f"name: must be {allowed}")
        if len(stem) > _LONGEST_NAME:
            raise ValueError(f"name: has {len(stem)} characters, must have at most {_LONGEST_NAME}")
        return self.folder / f"{stem}.toml"


_LONGEST_NAME = 80


def _manufactured(design: DesignFile) -> ManufacturedGears | None:
    """Gears within [tolerance], or else within the classes of both gears; None without either."""
    given = gears_of(design, quick=False)
    if given is not None:
        return dataclasses.replace(given, samples=_GEARS)
    if design.quality_classes is None:
        return None
    tolerance = Tolerance.from_class(design.pair(), quality_class=design.quality_classes)
    return ManufacturedGears(tolerance if design.resolution().slices > 1 else tolerance.without_lead(), _GEARS)


def _coarse(size: Resolution) -> Resolution:
    """Array sizes while a slider moves."""
    size = dataclasses.replace(size, positions=min(size.positions, _MOVING))
    return size if size.slice_widths is not None else dataclasses.replace(size, slices=min(size.slices, _SLICES))
