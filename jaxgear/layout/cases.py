"""Step 2 of a layout: what tolerances make of the load over the face and of the life, and what is removed at the ends
against it.

References:
    U. Kissling's three-step layout of modifications: five cases of helix slope and axis deviations,
    equations 1 and 2; ISO 6336-1 Annexes B and E.

Without deviations further crowning or end relief only takes load off the ends and shortens the life; what it saves, it
saves where the flanks deviate.
"""

from collections.abc import Sequence
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..conditions import LoadSpectrum
from ..geometry import GearPair
from ..metrics.safety import Strength
from ..numerics import (
    Checked,
    Given,
    bracketed_root,
    check,
    concrete,
    maximum,
    number,
    optional_real,
    program,
    real,
    result,
    whole,
)
from ..shafts import AbstractSupport, FaceLoad, Misalignment, annex_e, axis_tolerance, face_load_factor
from ..tolerance import ToleranceClass
from .flank_line import STATIONS, FlankLine, Stations, at_stations
from .life import damage_of, under_loads

Scalar = Float[Array, ""]
Cases = Float[Array, " cases"]
Kind = Literal["maximum", "statistical"]
Classes = Given | Sequence[Given]  # one flank tolerance class for both gears, or those of pinion and wheel
Axes = Misalignment | Literal["class"] | None

CASES = ("no deviation", "+f_Hb +f_ma", "+f_Hb -f_ma", "-f_Hb +f_ma", "-f_Hb -f_ma")
_SIGNS = ((0.0, 0.0), (1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0))
_LEVEL = 1e-3  # of the mean line load, by which an end has to be above the rest: an even load touches no edge
_MOST = 16.0  # largest crowning that is tried, in sums of the deviations


class FlankLineTolerance(Checked):
    """Deviations of a pair over its common face width, each of either sign.

    Attributes:
        helix_slope: f_Hbeta of both gears together.
        misalignment: f_ma of the axes, in the plane of action.
    """

    helix_slope: Scalar = number("um", low=0.0)
    misalignment: Scalar = number("um", low=0.0, default=0.0)

    @property
    def slopes(self) -> Cases:
        """Slope of the gap over the face width in the five cases [um], see `CASES`."""
        return jnp.stack([first * self.helix_slope + second * self.misalignment for first, second in _SIGNS])


def flank_line_tolerance(
    pair: GearPair, quality_class: Classes, axes: Axes = None, *, kind: Kind = "statistical"
) -> FlankLineTolerance:
    """Deviations that flank tolerance classes and the parallelism of the axes allow.

    "maximum" adds the limits: f_HbetaT1 + f_HbetaT2, and f_ma = (f_Sigma_beta cos(alpha_wt) + f_Sigma_delta
    sin(alpha_wt)) b / L (equation 2 of the study, which leaves out the scaling from the bearing span to the face), to
    which f_ma that is given directly is added.
    Helix deviations count over a gear's own face: of a wider gear the common face has them in the ratio of the widths.
    "statistical" takes the root of the sum of the squares: where every deviation is normal and 97 % of it lie within
    its limits, 97 % of the independent sum lie within that.

    Args:
        pair: gear pair.
        quality_class: flank tolerance class of ISO 1328-1, one for both gears or (pinion, wheel).
        axes: largest skew and inclination over the bearing span, or f_ma itself, each of either sign; "class" for
            those of `axis_tolerance` by the larger F_beta of both gears, whose share over the face is the same for
            every bearing span; None for parallel axes.
        kind: "maximum" or "statistical".

    Raises:
        ValueError: for a class or gear outside of the range of the standard, negative limits of the axes, a bearing
            span that is shorter than the face, or another kind.
    """
    if kind not in ("maximum", "statistical"):
        raise ValueError(f'kind = {kind!r} must be "maximum" or "statistical"')
    classes = quality_class if isinstance(quality_class, tuple | list) else (quality_class, quality_class)
    if len(classes) != 2:
        raise ValueError(f"quality_class has {len(classes)} entries, must be one or two")
    gears = pair.pinion, pair.wheel
    limits = [ToleranceClass.of(gear, each) for gear, each in zip(gears, classes)]
    slopes = [limit.helix_slope * pair.face_width / gear.face_width for limit, gear in zip(limits, gears)]
    if axes == "class":
        # F_beta counts over the gear's own face, as the slope does
        totals = [limit.helix_total * pair.face_width / gear.face_width for limit, gear in zip(limits, gears)]
        axes = axis_tolerance(jnp.maximum(*totals), pair.face_width, pair.face_width)
    return FlankLineTolerance(_together(slopes, kind), _together(_over_face(pair, axes), kind))


def _over_face(pair: GearPair, axes) -> list[Scalar]:
    """Gap over the face by each deviation of the axes [um]."""
    if axes is None:
        return [jnp.zeros(())]
    if not isinstance(axes, Misalignment):
        raise ValueError(f'axes = {axes!r} must be a Misalignment, "class" or None')
    for name in ("skew", "inclination", "direct"):
        check(name, getattr(axes, name), "um", low=0.0)
    if axes.bearing_span is None:
        return [axes.direct]
    span, width = concrete(axes.bearing_span), concrete(pair.face_width)
    if span is not None and width is not None and span < width:
        problem = f"bearing_span = {float(span):g} mm must be at least the face width, {float(width):g} mm"
        raise ValueError(f"{problem}")
    angle, share = pair.working_pressure_angle, pair.face_width / axes.bearing_span
    return [axes.direct, share * axes.skew * jnp.cos(angle), share * axes.inclination * jnp.sin(angle)]


def helix_slope_limits(pair: GearPair, quality_class: Classes, *, end_relief: bool = False) -> Float[Array, "2"]:
    """Further crowning C_b of pinion and wheel over the common face [um], that of equation 1 of the study.

    Ground over its own face each has C_b = f_HbetaT; of a wider gear the common face has (common / own)^2 of that. End
    reliefs C_I(II) = f_HbetaT of gears with a modified flank line (ISO 6336-1 Annex B) have what the common face has
    of the deviation, common / own.
    """
    classes = quality_class if isinstance(quality_class, tuple | list) else (quality_class, quality_class)
    return jnp.stack(
        [
            ToleranceClass.of(gear, each).helix_slope * (pair.face_width / gear.face_width) ** (1 if end_relief else 2)
            for gear, each in zip((pair.pinion, pair.wheel), classes)
        ]
    )


def _together(parts, kind: Kind) -> Scalar:
    return sum(parts) if kind == "maximum" else jnp.sqrt(sum(part**2 for part in parts))


class ToleranceCases(Checked):
    """Load over the face in the five cases of `CASES`.

    Attributes:
        slope: of the gap over the face width that the deviations make.
        load: of the one-dimensional analysis, with a leading axis (cases,).
    """

    slope: Cases = result("um")
    load: FaceLoad = eqx.field()

    @property
    def face_load_factor(self) -> Cases:
        """K_Hbeta of every case."""
        return face_load_factor(self.load.line_load)

    @property
    def edge_excess(self) -> Cases:
        """Larger line load of both end stations less the largest in between, over the mean."""
        return _excess(self.load.line_load, 1.0)

    @property
    def edge_contact(self) -> Bool[Array, " cases"]:
        """Whether the largest line load is at an end of the face, or not found; an even load touches no edge."""
        return ~(self.edge_excess <= _LEVEL)

    @property
    def loaded_share(self) -> Cases:
        """Share of the face that carries load, NaN where that has not been found."""
        share = jnp.mean(self.load.in_contact.astype(self.slope.dtype), axis=-1)
        return jnp.where(self.load.converged, share, jnp.nan)


def tolerance_cases(
    support: AbstractSupport,
    tolerance: FlankLineTolerance,
    torque: Given | None = None,
    *,
    pinion: FlankLine | None = None,
    wheel: FlankLine | None = None,
    stiffness: Given | None = None,
    stations: int | None = None,
) -> ToleranceCases:
    """Load over the face without deviations and in the four combinations of the largest ones.

    Args:
        support: shafts at the mesh, `support` of a gearbox or `RigidSupport`.
        tolerance: the deviations.
        torque: on the pinion [N m]; None for that of the couplings, which are scaled for another one.
        pinion, wheel: flank lines of the gears; None for none.
        stiffness: c_gamma [N/(mm um)]; None for that of ISO 6336-1.
        stations: over the face; None for 41, or those that `Stations` have.
    """
    face = at_stations(support, torque, stations=stations)
    return _cases(face, tolerance, pinion or FlankLine(), wheel or FlankLine(), stiffness)


@program
def _cases(face: Stations, tolerance: FlankLineTolerance, pinion: FlankLine, wheel: FlankLine, stiffness):
    def at(slope):
        deviated = wheel.modification + FlankLine(slope).on(face.pair, "wheel").modification
        given = {"pinion": pinion.modification, "wheel": deviated, "stiffness": stiffness}
        return annex_e(face, torque=face.torque, stations=face.count, **given)

    return ToleranceCases(tolerance.slopes, jax.vmap(at)(tolerance.slopes))


def least_off_the_edges(
    support: AbstractSupport,
    tolerance: FlankLineTolerance,
    torque: Given | None = None,
    *,
    line: FlankLine | None = None,
    share: float = 1.0,
    end_relief: Given | None = None,
    stiffness: Given | None = None,
    stations: int | None = None,
) -> Scalar:
    """Smallest further crowning or end relief, of both gears together, with which no case touches an edge [um].

    A case touches an edge where its largest line load is at an end of the face. That is what the study looks for in the
    picture of all five cases; here the amount is where the worst end station carries as much as the largest station
    inside, or a share of that.

    Args:
        support: shafts at the mesh.
        tolerance: the deviations.
        torque: on the pinion [N m]; None for that of the couplings.
        line: flank line of step 1 over the common face, on either gear; None for none.
        share: of the largest load inside, up to which an end may be loaded.
        end_relief: width of end reliefs of both ends over the common face [mm]; None for crowning.
        stiffness: c_gamma [N/(mm um)]; None for that of ISO 6336-1.
        stations: over the face; None for 41, or those that `Stations` have.

    Returns:
        the amount, 0 where none is needed; NaN where 16 times the sum of all deviations and of the opening by bent
        shafts are not enough, or the load has not been found. Differentiable.

    Raises:
        ValueError: for a share out of range, and for end reliefs that begin beyond the outermost stations or beyond the
            middle of the face.
    """
    check("share", share, "", low=0.0, high=1.0, open_low=True)
    face = at_stations(support, torque, stations=stations)
    width = concrete(face.pair.face_width)
    if width is not None:  # the outermost stations are half a station away from the ends
        low, high = 0.5 * float(width) / face.count, 0.5 * float(width)
        check("end_relief", end_relief, "mm", low=low, high=high, open_low=True)
    return _off_the_edges(face, tolerance, line or FlankLine(), real(share), optional_real(end_relief), stiffness)


def _worst_excess(amount, given):
    face, tolerance, line, share, end_relief, stiffness = given
    found = _cases(face, tolerance, FlankLine(), line.further(amount, end_relief).on(face.pair, "wheel"), stiffness)
    return maximum(_excess(found.load.line_load, share))


@program
def _off_the_edges(
    face: Stations, tolerance: FlankLineTolerance, line: FlankLine, share, end_relief, stiffness
) -> Scalar:
    given = face, tolerance, line, share, end_relief, stiffness
    bent = face.bent
    size = tolerance.helix_slope + tolerance.misalignment + jnp.max(bent) - jnp.min(bent)
    size = jax.lax.stop_gradient(_MOST * (size + jnp.abs(line.slope) + jnp.abs(line.crowning)))
    zero = jnp.zeros_like(size)
    found = bracketed_root(_worst_excess, zero, size, given)
    # what has not been found is NaN, which is not level either
    enough, needed = _worst_excess(size, given) < 0, ~(_worst_excess(zero, given) <= _LEVEL)
    return jnp.where(needed, jnp.where(enough, found, jnp.nan), 0.0)


def _excess(line_load: Float[Array, "... slices"], share) -> Float[Array, "..."]:
    """Larger load of both ends less a share of the largest in between, over the mean."""
    if line_load.shape[-1] < 3:
        raise ValueError(f"{line_load.shape[-1]} stations must be at least 3, two of them are the edges")
    ends = jnp.maximum(line_load[..., 0], line_load[..., -1])
    inner, mean = maximum(line_load[..., 1:-1], axis=-1), jnp.mean(line_load, axis=-1)
    return (ends - share * inner) / jnp.where(mean > 0, mean, 1.0)


def lives_in_cases(
    support: AbstractSupport,
    load: LoadSpectrum,
    strength: Strength,
    tolerance: FlankLineTolerance,
    *,
    pinion: FlankLine | None = None,
    wheel: FlankLine | None = None,
    stations: int = STATIONS,
) -> Float[Array, " cases"]:
    """Life [h] without deviations and in the four combinations of the largest ones, see `CASES`.

    Args:
        support, load, strength, pinion, wheel, stations: as for `damage`.
        tolerance: the deviations.

    Raises:
        ValueError: as `damage` does.
    """
    whole("stations", stations, 3, 1001)
    faces = under_loads(support, load.torques, stations)
    return _lives(faces, load, strength, tolerance, pinion or FlankLine(), wheel or FlankLine())


@program
def _lives(
    faces: Stations,
    load: LoadSpectrum,
    strength: Strength,
    tolerance: FlankLineTolerance,
    pinion: FlankLine,
    wheel: FlankLine,
) -> Float[Array, " cases"]:
    pair = jax.tree.map(lambda leaf: leaf[0], faces.pair)

    def life(slope):
        on_wheel = FlankLine(slope).on(pair, "wheel")
        deviated = FlankLine(wheel.slope + on_wheel.slope, wheel.crowning + on_wheel.crowning, wheel.ends)
        return damage_of(faces, load, strength, pinion, deviated).life

    return jax.vmap(life)(jnp.asarray(tolerance.slopes))
