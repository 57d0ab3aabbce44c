"""Steps 1 and 2 of a layout together: the flank lines of a mesh, and what tolerances leave of the even load."""

from collections.abc import Mapping
from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..conditions import LoadSpectrum
from ..geometry import GearPair
from ..metrics.safety import Strength
from ..microgeometry import AbstractModification
from ..numerics import Checked, Given, Numbers, check, optional_real, real, result
from ..shafts import AbstractSupport, ShaftSupport, annex_e
from .cases import (
    CASES,
    FlankLineTolerance,
    ToleranceCases,
    least_off_the_edges,
    lives_in_cases,
    tolerance_cases,
)
from .flank_line import STATIONS, FlankLine, GearName, at_stations, level_load
from .life import Damage, damage, longest_life

Scalar = Float[Array, ""]


class FlankLineLayout(Checked):
    """Flank lines of a mesh by the first two steps.

    Attributes:
        gear: whose flank line levels the load, "pinion" or "wheel".
        torque: of the layout, on the pinion.
        pair: the gears.
        line: of step 1, over the common face.
        further: C_b of step 2 on pinion and wheel, on top of step 1, over the common face.
        end_relief: width of the end reliefs of step 2, over the common face; None for crowning.
        needed: C_b of both together, without which a case touches an edge.
        factors: K_Hbeta without modification and after step 1, both without deviations.
        unmodified, before, after: the five cases without modification, with the flank line of step 1 alone, and with
            those of step 2, by the name of the tolerance.
        damage: under the duty cycle without modification, after step 1 and after step 2, without deviations; empty
            without one.
        lives: [h] of the five cases without modification, after step 1 and after step 2, shape (steps, cases), by the
            name of the tolerance; empty without a duty cycle.
    """

    gear: GearName = eqx.field(static=True)
    torque: Scalar = result("N m")
    pair: GearPair
    line: FlankLine
    further: Float[Array, "2"] = result("um")
    end_relief: Scalar | None = result("mm")
    needed: Scalar = result("um")
    factors: Float[Array, "2"] = result()
    unmodified: dict[str, ToleranceCases]
    before: dict[str, ToleranceCases]
    after: dict[str, ToleranceCases]
    damage: tuple[Damage, ...] = ()
    lives: dict[str, Float[Array, "steps cases"]] = eqx.field(default_factory=dict)

    @property
    def means(self) -> str:
        """Modification of step 2, crowning or end relief over its width."""
        return "crowning" if self.end_relief is None else f"end relief over {float(self.end_relief):.2f} mm"

    @property
    def pinion(self) -> FlankLine:
        """Flank line of the pinion after step 2, over its own face."""
        return self._line("pinion", 0)

    @property
    def wheel(self) -> FlankLine:
        """Flank line of the wheel after step 2, over its own face."""
        return self._line("wheel", 1)

    @property
    def cases(self) -> tuple[dict[str, ToleranceCases], ...]:
        """`unmodified`, `before` and `after`."""
        return self.unmodified, self.before, self.after

    @property
    def modifications(self) -> tuple[AbstractModification, AbstractModification]:
        """Modifications of pinion and wheel after step 2."""
        return self.pinion.modification, self.wheel.modification

    @property
    def touches_edges(self) -> bool:
        """Whether the largest load of some case is at an edge after step 2."""
        return any(bool(np.any(cases.edge_contact)) for cases in self.after.values())

    @property
    def relative_life(self) -> Float[Array, " steps"]:
        """Life without modification, after step 1 and after step 2, relative to that after step 1; no deviations.

        Raises:
            ValueError: for a layout without a duty cycle.
        """
        level = self._level_life("relative_life")
        return jnp.stack([each.life / level for each in self.damage])

    def worst_relative_life(self, tolerance: str) -> Float[Array, " steps"]:
        """Life of the worst case of deviations without modification, after step 1 and after step 2, relative to that
        after step 1 without any.

        Args:
            tolerance: its name.

        Raises:
            ValueError: for a layout without a duty cycle.
        """
        level = self._level_life("worst_relative_life")
        return jnp.min(self.lives[tolerance], axis=-1) / level

    def _level_life(self, name: str) -> Scalar:
        if not self.damage:
            raise ValueError(f"FlankLineLayout: {name} needs a duty cycle")
        return self.damage[1].life

    def _line(self, gear: GearName, index: int) -> FlankLine:
        own = self.line if self.gear == gear else FlankLine()
        return own.further(self.further[index], self.end_relief).on(self.pair, gear)

    def __str__(self) -> str:
        before, after = (f"{float(value):.3f}" for value in self.factors)
        lines = [
            f"layout at {float(self.torque):g} N m: K_Hbeta {before}, {after} after step 1",
            f"step 1, {self.gear}: slope {float(self.line.slope):.2f} um, crowning {float(self.line.crowning):.2f} um",
            "step 2, further {}: pinion {:.2f} um, wheel {:.2f} um".format(self.means, *map(float, self.further)),
            f"{'K_Hbeta':24}" + "".join(f"{name:>14}" for name in CASES),
        ]
        for step, of in zip(("unmodified", "step 1", "step 2"), self.cases):
            for name, cases in of.items():
                marks = ["*" if edge else "" for edge in np.asarray(cases.edge_contact)]
                values = [f"{float(value):.3f}{mark}" for value, mark in zip(cases.face_load_factor, marks)]
                lines.append(f"{f'{step}, {name}':24}" + "".join(f"{value:>14}" for value in values))
        return "\n".join([*lines, "* largest load at an edge"])


def layout_flank_lines(
    support: AbstractSupport,
    tolerances: Mapping[str, FlankLineTolerance] | FlankLineTolerance,
    torque: Given | None = None,
    *,
    duty_cycle: LoadSpectrum | None = None,
    strength: Strength | None = None,
    gear: GearName = "wheel",
    further: Numbers | None = None,
    end_relief: Given | None = None,
    share: float = 1.0,
    negative_crowning: bool = False,
    stations: int = STATIONS,
) -> FlankLineLayout:
    """Steps 1 and 2 of the layout of a mesh.

    Step 1 levels the load at the torque (`level_load`), or finds the longest life under a duty cycle (`longest_life`).
    Step 2 adds crowning or end reliefs to both gears so that the largest load of none of the five cases is at an edge:
    the given amounts, C_b = f_HbetaT of either gear over its own face after equation 1 of the study and ISO 6336-1
    Annex B (`helix_slope_limits`), and more in proportion where they do not suffice; without any, as little as it
    takes, half of it on either gear. The least end relief leaves the
    largest load where it begins.

    Args:
        support: shafts at the mesh, `support` of a gearbox or `RigidSupport`.
        tolerances: by name, for instance {"statistical": ..., "maximum": ...}; the worst of all counts.
        torque: on the pinion [N m]; None for the largest that the duty cycle has hours of, or that of the couplings.
        duty_cycle: torques with their hours, for step 1; None to level the load.
        strength: of the gears under it, as for `damage`.
        gear: whose flank line levels the load.
        further: C_b of pinion and wheel over the common face [um]; None for as little as it takes.
        end_relief: width of end reliefs over the common face [mm], for instance `iso_end_relief_width`; None for
            crowning.
        share: of the largest load inside, up to which an end may be loaded.
        negative_crowning: whether the crowning of step 1 may be negative.
        stations: over the face.

    Raises:
        ValueError: for a duty cycle without strength or the reverse, another gear, amounts or numbers out of range,
            where the load over the face is not found, and where no amount keeps it off the edges.
    """
    if gear not in ("pinion", "wheel"):
        raise ValueError(f'gear = {gear!r} must be "pinion" or "wheel"')
    if (duty_cycle is None) != (strength is None):
        given, missing = ("duty_cycle", "strength") if strength is None else ("strength", "duty_cycle")
        raise ValueError(f"{given} has no effect without {missing}")
    check("further", further, "um", low=0.0)
    if torque is None and duty_cycle is not None:
        torque = jnp.max(jnp.where(duty_cycle.weights > 0, duty_cycle.torques, 0.0))
    several = tolerances if isinstance(tolerances, Mapping) else {"tolerance": tolerances}
    if not several:
        raise ValueError("tolerances must not be empty")
    face = at_stations(support, torque, stations=stations)
    if duty_cycle is None or strength is None:
        line = level_load(face, negative_crowning=negative_crowning)
    else:
        line = longest_life(support, duty_cycle, strength, negative_crowning=negative_crowning, stations=stations)
    each = [least_off_the_edges(face, one, line=line, share=share, end_relief=end_relief) for one in several.values()]
    needed = jnp.max(jnp.stack(each))
    if not bool(jnp.isfinite(line.slope)):
        raise ValueError("the load over the face did not converge: do the loads leave a shaft loose in its clearances?")
    if not bool(jnp.isfinite(needed)):
        removed = "crowning" if end_relief is None else "end relief"
        raise ValueError(f"no {removed} keeps the load off the edges: the shafts are too soft")
    added = _further(needed, further)
    on_wheel, crowned = (each.on(face.pair, "wheel") for each in (line, line.further(jnp.sum(added), end_relief)))
    steps = FlankLine(), on_wheel, crowned
    unmodified, before, after = (
        {name: tolerance_cases(face, one, wheel=wheel) for name, one in several.items()} for wheel in steps
    )
    layout = FlankLineLayout(
        gear=gear,
        torque=face.torque,
        pair=face.pair,
        line=line,
        further=added,
        end_relief=optional_real(end_relief),
        needed=needed,
        factors=jnp.stack(
            [
                annex_e(face, torque=face.torque, wheel=one.modification, stations=face.count).face_load_factor
                for one in steps[:2]
            ]
        ),
        unmodified=unmodified,
        before=before,
        after=after,
    )
    if duty_cycle is None or strength is None:
        return layout
    spent = tuple(damage(support, duty_cycle, strength, wheel=one, stations=stations) for one in steps)
    lives = {
        name: jnp.stack(
            [lives_in_cases(support, duty_cycle, strength, each, wheel=one, stations=stations) for one in steps]
        )
        for name, each in several.items()
    }
    return replace(layout, damage=spent, lives=lives)


def _further(needed: Scalar, given) -> Float[Array, "2"]:
    """C_b of pinion and wheel."""
    if given is None:
        return 0.5 * needed * jnp.ones(2)
    amounts = jnp.broadcast_to(real(given), (2,))
    total = jnp.sum(amounts)
    if float(total) <= 0:
        return 0.5 * needed * jnp.ones(2)
    return amounts * jnp.maximum(1.0, needed / total)


def without_housing(support: ShaftSupport) -> ShaftSupport:
    """Copy of the support with the bearings on rigid seats in place of the housing."""
    return replace(support, gearbox=replace(support.gearbox, housing=None))
