"""Gear pair: pinion and wheel at their operating centre distance."""

import logging

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, PyTree

from ..numerics import Checked, changed, concrete, number, on_both, program, real
from .gear import Gear, with_diameters
from .margins import Margins, distance_with, faults_between, margins_between, play_between, rounded_by
from .outline import Outline, outline
from .path import PathOfContact, path_between, working_pressure_angle

Scalar = Float[Array, ""]
Real = Float[Array, "*pairs"]  # one number of each pair, where `jax.vmap` made many

_LOG = logging.getLogger(f"{__name__.partition('.')[0]}.unusual")
# of the narrower face: what counts as common where there is nothing in common, for numbers to stay finite
_LEAST_OVERLAP = 1e-3


class GearPair(Checked):
    """Gear pair: pinion (driving) and wheel (driven).

    Attributes:
        pinion: driving gear.
        wheel: driven gear; a `RingGear` for an internal pair, whose pinion is a planet.
        center_distance: operating centre distance [mm]; None for the backlash-free centre distance of the nominal tooth
            thicknesses, at which tooth thickness allowances add backlash. A concrete centre distance that is too small
            by no more than the rounding of its digits, of the profile shifts and of the helix angle is replaced by the
            backlash-free one, with a warning of the logger "jaxgear.unusual".
        axial_offset: offset of the middle of the wheel face from the middle of the pinion face, positive towards
            positive face coordinates [mm].

    Raises:
        ValueError: for gears of different module or pressure angle, helical gears of the same hand (a planet and a ring
            gear of opposite hands), an impossible centre distance, a total contact ratio below 1, a tip that hits the
            fillet or the root circle of the mate, or faces that do not overlap; the message is the first of `explain`.
            Traced pairs are not checked; see their `margins`.
    """

    pinion: Gear
    wheel: Gear
    center_distance: Scalar | None = number("mm", low=0.0, open_low=True, optional=True, default=None)
    axial_offset: Scalar = number("mm", default=0.0)

    def check_together(self) -> None:
        for name, gear in (("pinion", self.pinion), ("wheel", self.wheel)):
            if gear.teeth.ndim:
                raise ValueError(
                    f"GearPair: {name} holds gears of shape {gear.teeth.shape}, must be one; make many with jax.vmap"
                )
        if self.pinion.is_internal:
            raise ValueError("GearPair: pinion is a RingGear, which must be the wheel, whichever gear drives")
        if self.center_distance is not None and not _traced(self):
            object.__setattr__(self, "center_distance", _unrounded(self, self.center_distance))
        for fault in _faults(self):
            raise ValueError(fault)

    @property
    def working_pressure_angle(self) -> Real:
        """Operating pressure angle [rad]."""
        return working_pressure_angle(self.pinion, self.wheel, self.center_distance)

    @property
    def working_center_distance(self) -> Real:
        """Operating centre distance, given or backlash-free [mm]."""
        if self.center_distance is not None:
            return self.center_distance
        both = self.wheel.signed(self.pinion.base_radius + self.wheel.base_radius)
        return both / jnp.cos(self.working_pressure_angle)

    @property
    def backlash(self) -> Scalar:
        """Backlash j_bt of the unloaded, unmodified flanks on the transverse line of action [um].

        It is due to the centre distance and the mean tooth thickness allowances. The normal backlash is
        cos(beta_b) times as large.
        """
        tangent = None if self.center_distance is None else jnp.tan(self.working_pressure_angle)
        return play_between(self.pinion, self.wheel, tangent)

    @property
    def backlash_limits(self) -> Float[Array, "*pairs 2"]:
        """Least and largest backlash within the tolerances of the tooth thickness [um], shape (2,)."""
        tolerances = self.pinion.tooth_thickness_tolerance + self.wheel.tooth_thickness_tolerance
        half = 0.5 * jnp.cos(self.pinion.transverse_pressure_angle) / self.pinion.helix_cosine * tolerances
        return jnp.stack([self.backlash - half, self.backlash + half], axis=-1)

    @property
    def face_width(self) -> Real:
        """Common face width [mm], on which both faces overlap; the smaller face width for centred gears.

        For faces that do not overlap it is a thousandth of the smaller face width, and `face_overlap` is negative.
        """
        low, high = self._common_face
        least = _LEAST_OVERLAP * jnp.minimum(self.pinion.face_width, self.wheel.face_width)
        return jnp.maximum(high - low, least)

    @property
    def face_overlap(self) -> Real:
        """Axial length on which both faces overlap [mm]; negative where they are apart."""
        low, high = self._common_face
        return high - low

    @property
    def face_middles(self) -> tuple[Real, Real]:
        """Middle of the common face, from the middle of the pinion's and of the wheel's own face [mm]."""
        low, high = self._common_face
        middle = 0.5 * (low + high)
        return middle, middle - self.axial_offset

    @property
    def overhangs(self) -> tuple[tuple[Real, Real], tuple[Real, Real]]:
        """Overhangs of pinion and wheel beyond the common face, at its negative and its positive end [mm]."""
        half = 0.5 * self.face_width

        def ends(gear: Gear, middle: Real) -> tuple[Real, Real]:
            wider = 0.5 * gear.face_width - half
            # only faces that do not overlap come down to the limit: where ends are flush derivatives are of both sides
            return jnp.maximum(wider + middle, -half), jnp.maximum(wider - middle, -half)

        pinion, wheel = map(ends, self.gears, self.face_middles)
        return pinion, wheel

    @property
    def gears(self) -> tuple[Gear, Gear]:
        """Pinion and wheel."""
        return self.pinion, self.wheel

    @property
    def _common_face(self) -> tuple[Real, Real]:
        """Ends of the common face from the middle of the pinion's face [mm]."""
        pinion, wheel, offset = 0.5 * self.pinion.face_width, 0.5 * self.wheel.face_width, self.axial_offset
        return jnp.maximum(-pinion, offset - wheel), jnp.minimum(pinion, offset + wheel)

    @property
    def base_pitch(self) -> Real:
        """Transverse base pitch p_bt [mm]."""
        return self.pinion.base_pitch

    @property
    def coast(self) -> "GearPair":
        """Mirror image of the pair, whose drive flanks are the coast flanks of this pair: gears of the opposite hand.

        Coast flanks carry a negative torque on the pinion, without a change of the sense of rotation. Analyse the
        mirrored pair with the absolute value of that torque and the modifications of the coast flanks, at the same face
        coordinates. Its mesh positions run backwards in time: contact begins at the tip of the pinion, E, and ends at
        its root, A; approach and recess are exchanged.
        """
        return changed(self, pinion=self.pinion.mirrored, wheel=self.wheel.mirrored)

    @property
    def is_spur(self) -> bool:
        """True if both gears have no helix angle, or a concrete helix angle of zero."""
        return all(gear.is_spur for gear in self.gears)

    @property
    def path_slope(self) -> Real:
        """Slope tan(beta_b) of the contact position on the line of action over the face coordinate.

        With a right-handed pinion, positive face coordinates enter the mesh first: the pinion turns counterclockwise,
        seen from the positive end of the face. For the coast flanks, or the other sense of rotation, the sign of face
        coordinates changes.
        """
        return jnp.tan(self.pinion.base_helix_angle)

    @property
    def overlap_ratio(self) -> Real:
        """Overlap ratio eps_beta = b |tan(beta_b)| / p_bt of the common face (ISO 21771)."""
        return self.face_width * jnp.abs(self.path_slope) / self.base_pitch

    @property
    def gear_ratio(self) -> Real:
        """Teeth of the wheel over teeth of the pinion."""
        return self.wheel.teeth / self.pinion.teeth

    @property
    def signed_gear_ratio(self) -> Real:
        """Gear ratio u = z2 / z1 with the sign of ISO 21771, negative for an internal pair."""
        return self.wheel.signed(self.gear_ratio)


class PairGeometry(eqx.Module):
    """Generated geometry of a gear pair.

    Attributes:
        outlines: tooth outlines of pinion and wheel.
        path_of_contact: points A to E.
        margins: margins against geometry that cannot run.
        held: True for every margin that is met, by name.
    """

    outlines: tuple[Outline, Outline]
    path_of_contact: PathOfContact
    margins: Margins
    held: dict[str, Bool[Array, ""]]


@program
def pair_geometry(pair: GearPair) -> PairGeometry:
    """Outlines, path of contact and margins of an `explicit` pair.

    Pairs of concrete numbers are checked by this program when they are made, so that it is compiled in any case.
    """
    outlines = on_both(outline, pair.pinion, pair.wheel)
    path = path_of_contact(pair, outlines)
    known = margins_between(*outlines, path, pair.center_distance, pair.face_overlap)
    return PairGeometry(outlines, path, known, known.held)


def path_of_contact(pair: GearPair, outlines: tuple[Outline, Outline] | None = None) -> PathOfContact:
    """Path of contact of a pair, limited by tip and form circles; None for `outlines` to generate them."""
    forms = None if outlines is None else (outlines[0].form_roll_length, outlines[1].form_roll_length)
    return path_between(pair.pinion, pair.wheel, pair.center_distance, forms)


def margins(pair: GearPair) -> Margins:
    """Margins of a pair against geometry that cannot run; finite and differentiable also for invalid gears."""
    return pair_geometry(explicit(pair)).margins


def explain(pair: GearPair) -> tuple[str, ...]:
    """Reasons why a pair cannot run, one line for each margin that is not met; empty if it can run.

    Args:
        pair: one pair of concrete numbers, for instance a design that `jax.jit` or `jax.vmap` returned.

    Raises:
        ValueError: while being traced, or for many pairs at once.
    """
    if _traced(pair):
        raise ValueError("explain: pair is being traced, must hold concrete numbers; use `margins` inside")
    if pair.pinion.teeth.ndim:
        raise ValueError(f"explain: pair holds pairs of shape {pair.pinion.teeth.shape}, must be one")
    return _faults(pair)


def _unrounded(pair: GearPair, center_distance: Scalar) -> Scalar:
    """Centre distance [mm], replaced by the backlash-free one if it is smaller only by the rounding of its digits."""
    known = pair_geometry(explicit(pair))
    held = known.held
    if _traced(known) or held["backlash"] or not held["base_circle_clearance"]:
        return center_distance
    given, free = float(center_distance), float(_free_distance(pair.pinion, pair.wheel))
    if abs(free - given) > rounded_by(pair.pinion, pair.wheel, center_distance):
        return center_distance
    _LOG.warning(
        "GearPair: center_distance = %.10g mm is %s than the backlash-free one by no more than the rounding of the "
        "given digits: %.10g mm is taken, without backlash",
        given,
        "more" if pair.wheel.is_internal else "less",
        free,
    )
    return real(free)


_free_distance = program(distance_with)


def _faults(pair: GearPair) -> tuple[str, ...]:
    if _traced(pair):
        return ()
    known = pair_geometry(explicit(pair))
    if _traced(known):  # within a trace of something else
        return ()
    return faults_between(pair.pinion, pair.wheel, pair.center_distance, pair.axial_offset, known.margins, known.held)


def explicit(pair: GearPair) -> GearPair:
    """Pair with explicit diameters of both gears (`with_diameters`), so that all pairs have one tree structure."""
    pinion, wheel = map(with_diameters, pair.gears)
    return changed(pair, pinion=pinion, wheel=wheel)


def is_even(pair: GearPair) -> bool:
    """True if both faces coincide: concrete, equal face widths without axial offset."""
    given = [concrete(each) for each in (pair.pinion.face_width, pair.wheel.face_width, pair.axial_offset)]
    if any(each is None for each in given):
        return False
    pinion, wheel, offset = given
    return bool(np.all(pinion == wheel) and np.all(offset == 0))


def _traced(tree: PyTree) -> bool:
    return any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(tree))
