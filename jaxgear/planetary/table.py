"""The table [stage] of a design file: a planetary stage, whose sun, planets and ring stand in tables of their own."""

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import jax
import numpy as np
from jaxtyping import Array, Float

from ..contact import MeshCycle
from ..io.design_file import DesignFile, FileDesign, design_of
from ..io.errors import DesignFileError, calling, join, refused
from ..io.table_keys import entry, section_of, template_of
from ..io.tables import FurtherTable, Whole
from ..io.value_types import SEED, count, positive, real
from ..metrics import Quantity
from ..microgeometry import AbstractModification, NoModification
from ..numerics import Number, changed
from ..numerics import real as as_real
from ..report import Part
from ..tolerance import TruncatedNormal
from .flanks import PlanetFlanks, of_design
from .gears import StageGears
from .kinematics import driving_speed, driving_torque, relative_speeds
from .quantities import DYNAMIC_FACTOR, OF_LOSSES, WITH_ERRORS, StageSettings
from .report import part, stages_over_torques
from .solve import prepare_stage
from .stage import PlanetaryStage
from .vibration import StageInertias

_GEARS = "sun", "planet", "ring"
_FLANKS = "modification", "ring_modification"
_HAND = "helix_angle"
_SAMPLES, _MOST_SAMPLES = 32, 4096
_TORQUES = 9  # over the range of the file
_FEWEST_POSITIONS = 16  # a multiple of it and of the number of planets
# tables that the mesh of planet and ring has in common with that of sun and planet
_SHARED = "title", "materials", "model", "resolution"
_TILTS = "radial_pin_tilt", "tangential_pin_tilt", "pin_tilt_compliance"
_WITHOUT_VARIABLES = "variables", "stage", "type", "curve"
_LEFT_OUT = "tolerance", "misalignment", "shafts", "teeth", "layout", "wear", "dynamics", "rating"


class _StageDesign(FileDesign):
    """The flanks of a stage as a function of the free parameters of its file; pure and traceable.

    Attributes:
        outer: flanks of planet and ring.
    """

    outer: FileDesign

    def __call__(self, parameters: Mapping[str, Any]) -> tuple[AbstractModification, AbstractModification]:
        """Modifications of the sun, and of planets and ring as `PlanetFlanks`."""
        sun, to_sun = super().__call__(parameters)
        to_ring, ring = self.outer({name: parameters[name] for name in self.outer.names})
        if all(isinstance(each, NoModification) for each in (to_sun, to_ring, ring)):
            return sun, to_sun
        return sun, PlanetFlanks(to_sun, to_ring, ring)


class StageSection(FurtherTable, section_of(PlanetaryStage, ("gears",), open=False)):  # type: ignore[misc]
    """A planetary stage.

    A file with the table has [sun], [planet] and [ring] in place of pinion and wheel, and its load is that of the
    driving member. Commands analyze the mesh of sun and planet under the share of a planet, and the whole stage with
    it; variables are those of the flanks.

    Attributes:
        pin_tolerance: limit of the tangential displacement of every pin of either sign, three standard deviations, for
            quantities with pin errors.
        pin_samples: number of stages with such errors.
        seed: seed of the errors.
        carrier_inertia: moment of inertia of the carrier without the planets, for natural frequencies and vibration;
            those of the gears are of their bodies.
        carrier_mass: mass of the carrier, for a carrier whose support is not rigid.
        damping_ratio: damping ratio of the modes; 0.05 without it.
    """

    table = "stage"
    drive_only = True
    called = {"pinion": "sun", "wheel": "planet"}
    whole = "the mesh of sun and planet alone, under its share of the load: [stage] is not part of this analysis"

    pin_tolerance: float | None = entry(positive("um"))
    pin_samples: int = entry(count(2, _MOST_SAMPLES), _SAMPLES)
    seed: int = entry(SEED, 0)
    carrier_inertia: float | None = entry(positive("kg m2"))
    carrier_mass: float | None = entry(positive("kg"))
    damping_ratio: float | None = entry(real(Number("", low=0.0, high=1.0)))
    _outer: DesignFile  # of planet and ring
    _stage: PlanetaryStage
    _made: tuple[DesignFile, StageSettings] | None = None

    @classmethod
    def pair_content(cls, content: Mapping[str, Any]) -> Mapping[str, Any]:
        """Content of a file of sun and planet."""
        for name in _GEARS:
            if name not in content:
                raise DesignFileError(name, "missing, this table is required with [stage]")
        for name in cls.called:
            if name in content:
                raise DesignFileError(cls.table, f"has no effect with [{name}]: give [sun], [planet] and [ring]")
        for name in _LEFT_OUT:
            if name in content:
                raise DesignFileError(cls.table, f"has no effect with [{name}], which knows a single pair")
        for name in _GEARS:
            if isinstance(content[name], dict) and "coast_modification" in content[name]:
                problem = (
                    "has no effect with [stage]: planet.ring_modification is of the flanks that carry with the ring"
                )
                raise DesignFileError(f"{name}.coast_modification", problem)
        pair = {name: table for name, table in content.items() if name not in _GEARS}
        planet = content["planet"]
        if isinstance(planet, dict):
            planet = {key: value for key, value in planet.items() if key != "ring_modification"}
        pair |= {"pinion": content["sun"], "wheel": planet}
        only_there = _names(cls._ring_content(content)) - _names(pair)
        if isinstance(pair.get("variables"), dict):
            pair["variables"] = {name: each for name, each in pair["variables"].items() if name not in only_there}
        return pair

    @staticmethod
    def _ring_content(content: Mapping[str, Any]) -> dict[str, Any]:
        """Content of a file of planet and ring, but for load and centre distance."""
        pair = {name: content[name] for name in _SHARED if name in content}
        planet = content["planet"]
        if isinstance(planet, dict):
            given = [planet[name] for name in _FLANKS if name in planet]
            planet = {key: value for key, value in planet.items() if key not in _FLANKS}
            planet |= {"modification": given[-1]} if given else {}
            sun = content["sun"].get(_HAND) if isinstance(content["sun"], dict) else None
            if _HAND not in planet and isinstance(sun, int | float):
                planet[_HAND] = -sun
        pair |= {"pinion": planet, "ring": content["ring"]}
        variables = content.get("variables")
        if isinstance(variables, dict):
            used = _names(pair)
            pair["variables"] = {name: each for name, each in variables.items() if name in used}
        return pair

    def extended(self, design: DesignFile, content: Mapping[str, Any]) -> DesignFile:
        """Design file of sun and planet under the load of their mesh, with all flanks of the stage."""
        for free in design.open_case:
            raise DesignFileError(free.key, f'"{free.name}" must be a number: variables of a stage are of its flanks')
        for name in ("backlash", "axial_offset"):
            if name in content.get("pair", {}):
                raise DesignFileError(f"pair.{name}", "has no effect with [stage]")
        distance = float(design.pair().working_center_distance)
        given = {"load": {"torque": design.torque}, "pair": {"center_distance": distance}}
        with calling({"pinion": "planet"}):
            outer = design_of(design.path, {**self._ring_content(content), **given})
        if not outer.pair().wheel.alike:
            raise DesignFileError("ring.support", "has to hold the ring of a stage alike all round")
        gears = refused(self.key, StageGears.of_pairs, design.pair(), outer.pair())
        stage: PlanetaryStage = template_of(self, PlanetaryStage).having(gears=gears).build({})
        share = float(1 / driving_torque(stage, stage.planets))
        speed = None if design.speed is None else float(relative_speeds(stage, design.speed).sun)
        load: Any = {"torque": as_real(share * design.torque)} | ({} if speed is None else {"speed": as_real(speed)})
        low, high = design.torque_range
        self._outer, self._stage = outer, stage
        return replace(
            design,
            text=json.dumps(content, sort_keys=True, default=str),
            torque=share * design.torque,
            torque_range=(share * low, share * high),
            speed=speed,
            bounds={**design.bounds, **outer.bounds},
            units={**design.units, **outer.units},
            values={**design.values, **outer.values},
            design=_StageDesign(
                tuple({**design.bounds, **outer.bounds}), design.design.pinion, design.design.wheel, outer.design
            ),
            _load=design._load.having(**load),
        )

    def whole_of(self, design: DesignFile, parameters: Mapping[str, Any]) -> Whole:
        """Pairs of sun and planet and of planet and ring, under the load of the driving member."""
        flanks = of_design(*design.design(parameters))
        none = NoModification()
        return Whole(
            pairs=(design.pair(), self._outer.pair()),
            flanks=tuple((one or none, other or none) for one, other in (flanks.at_sun, flanks.at_ring)),
            quality_classes=(design.quality_classes, self._outer.quality_classes),
            torque=float(driving_torque(self._stage, self.planets * design.torque)),
            speed=self._driving_speed(design),
        )

    def _driving_speed(self, design: DesignFile) -> float | None:
        return None if design.speed is None else float(driving_speed(self._stage, design.speed))

    def check(self, design: DesignFile) -> None:
        """Refuses flanks that carry nothing, and pairs that differ."""
        for name, section in (("pin_samples", self.pin_samples), ("seed", self.seed)):
            if name in self.fields and self.pin_tolerance is None:
                raise DesignFileError(join(self.key, name), f"{section} has no effect without stage.pin_tolerance")
        for name in ("carrier_mass", "damping_ratio"):
            if name in self.fields and self.carrier_inertia is None:
                raise DesignFileError(join(self.key, name), "has no effect without stage.carrier_inertia")
        if self.carrier_inertia is not None and self.carrier_support is not None and self.carrier_mass is None:
            raise DesignFileError("stage.carrier_mass", "missing, the support of the carrier is not rigid")

    def varies_along_face(self) -> list[str]:
        """The tilts of pins, which lean the flanks of every mesh."""
        return [self.key] if any(name in self.fields for name in _TILTS) else []

    def quantity(self, design: DesignFile, key: str, quantity: Quantity) -> Quantity:
        """A quantity of the stage."""
        if quantity.name.endswith(WITH_ERRORS) and self.pin_tolerance is None:
            raise DesignFileError(key, f'"{quantity.name}" needs stage.pin_tolerance')
        if quantity.name == DYNAMIC_FACTOR:
            if self.carrier_inertia is None:
                raise DesignFileError(key, f'"{quantity.name}" needs stage.carrier_inertia')
            if design.speed is None:
                raise DesignFileError(key, f'"{quantity.name}" needs load.speed')
        if quantity.name in OF_LOSSES:
            if design.speed is None:
                raise DesignFileError(key, f'"{quantity.name}" needs load.speed')
            if design.friction is None and "lubricant" not in design.tables:
                raise DesignFileError(key, f'"{quantity.name}" needs load.friction or the table [lubricant]')
        return quantity.with_settings(self.settings(design))

    def settings(self, design: DesignFile) -> StageSettings:
        """The stage with prepared meshes, and pin errors where the file has a tolerance."""
        if self._made is not None and self._made[0] is design:
            return self._made[1]
        step = math.lcm(_FEWEST_POSITIONS, self.planets)
        sizes = {"sun": design.resolution(), "ring": self._outer.resolution()}
        slices = max(each.slices for each in sizes.values()) if self.varies_along_face() else None
        meshes = {}
        for name, each in (("sun", design), ("ring", self._outer)):
            own = replace(sizes[name], positions=step * -(-sizes[name].positions // step))
            meshes[name] = each.mesh(own if slices is None else replace(own, slices=slices))
        lubricant = design.tables.get("lubricant")
        made = StageSettings(
            prepare_stage(self._stage, **meshes), self._pin_errors(self.planets), lubricant, self._inertias(design)
        )
        if self.damping_ratio is not None:
            made = changed(made, damping_ratio=as_real(self.damping_ratio))
        self._made = design, made
        return made

    def _inertias(self, design: DesignFile) -> StageInertias | None:
        if self.carrier_inertia is None:
            return None
        gears = (*design.pair().gears, self._outer.pair().wheel)
        return StageInertias.of_gears(*gears, carrier=self.carrier_inertia, carrier_mass=self.carrier_mass)

    def _pin_errors(self, planets: int) -> Float[Array, "samples planets"] | None:
        if self.pin_tolerance is None:
            return None
        key, shape = jax.random.key(self.seed), (self.pin_samples, planets)
        return self.pin_tolerance * TruncatedNormal()(key, shape, as_real(0.0).dtype)

    def part(self, design: DesignFile, name: str, cycle: MeshCycle) -> Part:
        """The stage with the flanks of a design, for the terminal, the report and the files."""
        settings, flanks = self.settings(design), of_design(cycle.pinion, cycle.wheel)
        torques = np.concatenate([[design.torque], np.linspace(*design.torque_range, _TORQUES)])
        driving = driving_torque(self._stage, self.planets * torques)
        unmodified, modified = stages_over_torques(settings.prepared, driving, flanks)
        cycles = {"unmodified": unmodified, name: modified}
        return part(settings, cycles, self._driving_speed(design), design.friction)


def _names(content: object) -> set[str]:
    """All texts of a content but those of its variables and of the stage: names that it uses are among them."""
    if isinstance(content, str):
        return {content}
    if isinstance(content, Mapping):
        return set().union(*(_names(each) for name, each in content.items() if name not in _WITHOUT_VARIABLES))
    return set().union(*map(_names, content)) if isinstance(content, list) else set()
