"""What `jaxgear layout` has found."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..contact import Mesh, MeshCycle
from ..io import DesignFile, LayoutRequest
from ..layout import FlankLine, FlankLineLayout, ProfileLayout, gear_lives
from ..metrics import Finding
from ..microgeometry import AbstractModification
from ..shafts import root_face_load_factor, tooth_height

STEPS = ("unmodified", "step 1", "step 2")
LIVES = ("pinion_life_h", "wheel_life_h")


@dataclass(frozen=True)
class Study:
    """What has been found.

    Attributes:
        design: the design file.
        request: what it asks for.
        layouts: flank lines, by the name of the support; the first is that of the design.
        over_torque: K_Hbeta of the design after every of the `STEPS` at the torques of the request, without deviations.
        meshes: of step 3, by the name of the support; empty without it.
        contacts: what the contact says of the flank lines of every step on their shafts, by the names of the support
            and of the step; empty without step 3 on shafts.
        contact_cases: K_Hbeta of the contact in the five cases of deviations, by the names of the support, of the
            tolerance and of the step, likewise.
        cycles: contact of the first support without modification and with all three steps, likewise.
        factors: K_Hbeta of the one-dimensional analysis at the same torque and on as many stations, likewise.
        profiles: profile modifications of step 3, by the name of the support.
        unusual: what of every layout is not usual, by the name of the support.
        stations_change: by how much K_Hbeta of the one-dimensional analysis changes at twice the stations, of the
            design at the torque of the profiles, by step; empty in a quick run.
        slices_change: by how much numbers of `cycles` change at twice the slices, by name and unit; empty in a quick
            run.
    """

    design: DesignFile
    request: LayoutRequest
    layouts: Mapping[str, FlankLineLayout]
    over_torque: Mapping[str, np.ndarray]
    meshes: Mapping[str, Mesh]
    contacts: Mapping[str, Mapping[str, Mapping[str, float]]]
    contact_cases: Mapping[str, Mapping[str, Mapping[str, np.ndarray]]]
    cycles: Mapping[str, MeshCycle]
    factors: Mapping[str, Mapping[str, float]]
    profiles: Mapping[str, ProfileLayout]
    unusual: Mapping[str, tuple[Finding, ...]]
    stations_change: Mapping[str, Mapping[str, float]]
    slices_change: Mapping[str, Mapping[str, float]]

    @property
    def profile(self) -> ProfileLayout | None:
        """The profile modifications of the design; None without step 3."""
        return next(iter(self.profiles.values()), None)

    @property
    def main(self) -> FlankLineLayout:
        """The layout of the design."""
        return next(iter(self.layouts.values()))


def flank_lines(layout: FlankLineLayout) -> dict[str, tuple[FlankLine, FlankLine]]:
    """Flank lines of pinion and wheel over their own faces, after every of the `STEPS`."""
    none = FlankLine()
    level = layout.line.on(layout.pair, layout.gear)
    first = (level, none) if layout.gear == "pinion" else (none, level)
    return dict(zip(STEPS, ((none, none), first, (layout.pinion, layout.wheel))))


def lives(study: Study, profile: ProfileLayout) -> dict[str, np.ndarray]:
    """Life [h] of pinion and wheel with every profile modification, by K_Hbeta of its contact; empty without a duty
    cycle. That factor is of the torque of step 3 and stands for every load."""
    load, endurance = (study.request.options.get(name) for name in ("duty_cycle", "endurance"))
    if load is None or endurance is None:
        return {}
    found = gear_lives(study.design.pair(), load, endurance, profile.table.column("face_load_factor"))
    return dict(zip(LIVES, np.asarray(found).T))


def root_factor(layout: FlankLineLayout, factor) -> np.ndarray:
    """K_Fbeta of K_Hbeta."""
    pair = layout.pair
    return np.asarray(root_face_load_factor(np.maximum(factor, 1.0), pair.face_width, tooth_height(pair)))


def designs(study: Study) -> dict[str, tuple[AbstractModification, AbstractModification]]:
    """Modifications of pinion and wheel after every step."""
    _, first, _ = flank_lines(study.main).values()
    pinion, wheel = study.main.modifications
    found = {"step 1": (first[0].modification, first[1].modification), "step 2": (pinion, wheel)}
    if study.profile is not None:
        # the profile was made on the further crowning, which the flank line has as well
        of_pinion, of_wheel = study.profile.profiles
        found["step 3"] = pinion + of_pinion, wheel + of_wheel
    return found
