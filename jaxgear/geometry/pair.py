"""Two gears on their operating centre distance."""

import logging

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, PyTree

from ..numerics import Checked, changed, concrete, number, on_both, program, real
from .gear import Gear, with_diameters
from .margins import Margins, faults_between, free_distance, margins_between, play_between, rounded_by
from .outline import Outline, outline
from .path import PathOfContact, path_between, working_pressure_angle

Scalar = Float[Array, ""]
Real = Float[Array, "*pairs"]  # one number of each pair, where `jax.vmap` made many

_LOG = logging.getLogger(f"{__name__.partition('.')[0]}.unusual")
# of the narrower face: what counts as common where there is nothing in common, for numbers to stay finite
_LEAST_OVERLAP = 1e-3


class GearPair(Checked):
    """Pinion (driving) and wheel (driven).

    Attributes:
        pinion: driving gear.
        wheel: driven gear.
        center_distance: operating centre distance [mm]; None for the backlash-free one of the nominal tooth
            thicknesses, to which tooth thickness allowances add their play. A concrete one that is too small by no more
            than the rounding of its digits and of those of profile shifts and helix angle becomes the backlash-free
            one, with a warning of the logger "jaxgear.unusual".
        axial_offset: of the middle of the wheel's face from that of the pinion's, positive towards positive face
            coordinates [mm].

    Raises:
        ValueError: for gears that do not share module or pressure angle, helical gears of the same hand, an impossible
            centre distance, a total contact ratio below 1, a tip that hits the mate's fillet or root circle, faces that
            do not overlap: the first of what `explain` lists. Pairs made while being traced pass; their `margins` tell.
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
        """[mm]"""
        if self.center_distance is not None:
            return self.center_distance
        return (self.pinion.base_radius + self.wheel.base_radius) / jnp.cos(self.working_pressure_angle)

    @property
    def backlash(self) -> Scalar:
        """Play between the unloaded, unmodified flanks on the transverse line of action [um], j_bt: that of the centre
        distance, and what the mean tooth thickness allowances take off both teeth. Normal to the flanks it is
        cos(beta_b) times this.
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
        """Common face width [mm], on which both faces overlap: of gears that are centred the smaller of the two.

        Of faces that do not overlap it is a thousandth of the smaller one, and the pair's `face_overlap` is negative.
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
        """Pair whose drive flanks are the coast flanks of this one, seen in a mirror: gears of the other hand.

        The wheel drives on them where the pinion goes on turning as it did: under a negative torque on the pinion. The
        amount of that torque is then the torque, and modifications are those of the coast flanks, at the same face
        coordinates. While the gears turn on, mesh positions count backwards: contact begins at the tip of the pinion,
        E, and ends at its root, A, so that approach and recess change places.
        """
        pinion, wheel = (
            gear if gear.helix_angle is None else changed(gear, helix_angle=-gear.helix_angle) for gear in self.gears
        )
        return changed(self, pinion=pinion, wheel=wheel)

    @property
    def is_spur(self) -> bool:
        """Whether both gears are known to be spur gears."""
        return all(gear.is_spur for gear in self.gears)

    @property
    def path_slope(self) -> Real:
        """tan(beta_b), by which contacts lie ahead on the line of action per face coordinate.

        Positive face coordinates enter the mesh first where the pinion has a right hand: it turns counterclockwise seen
        from the positive end of the face. On the other flanks, or turning the other way, face coordinates change sign.
        """
        return jnp.tan(self.pinion.base_helix_angle)

    @property
    def overlap_ratio(self) -> Real:
        """eps_beta = b |tan(beta_b)| / p_bt (ISO 21771), over the common face."""
        return self.face_width * jnp.abs(self.path_slope) / self.base_pitch

    @property
    def gear_ratio(self) -> Real:
        """Teeth of the wheel over teeth of the pinion."""
        return self.wheel.teeth / self.pinion.teeth


class PairGeometry(eqx.Module):
    """A pair by its generated teeth.

    Attributes:
        outlines: of the teeth of pinion and wheel.
        path_of_contact: points A to E.
        margins: how far the pair is from what cannot run.
        held: for each margin by name whether it holds.
    """

    outlines: tuple[Outline, Outline]
    path_of_contact: PathOfContact
    margins: Margins
    held: dict[str, Bool[Array, ""]]


@program
def pair_geometry(pair: GearPair) -> PairGeometry:
    """Outlines, path of contact and margins of an `explicit` pair.

    A pair of concrete numbers is checked by this program when it is made, so that it costs no further compilation.
    """
    outlines = on_both(outline, pair.pinion, pair.wheel)
    path = path_of_contact(pair, outlines)
    known = margins_between(*outlines, path, pair.center_distance, pair.face_overlap)
    return PairGeometry(outlines, path, known, known.held)


def path_of_contact(pair: GearPair, outlines: tuple[Outline, Outline] | None = None) -> PathOfContact:
    """Path of contact of a pair, limited by tip and form circles; `outlines` of its gears where they are known."""
    forms = None if outlines is None else (outlines[0].form_roll_length, outlines[1].form_roll_length)
    return path_between(pair.pinion, pair.wheel, pair.center_distance, forms)


def margins(pair: GearPair) -> Margins:
    """How far a pair is from what cannot run; finite and differentiable for impossible gears too."""
    return pair_geometry(explicit(pair)).margins


def explain(pair: GearPair) -> tuple[str, ...]:
    """Why a pair cannot run, one line for each margin that does not hold; empty if it can.

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
    """The centre distance, or the backlash-free one where it is less by no more than its digits are rounded."""
    known = pair_geometry(explicit(pair))
    held = known.held
    if _traced(known) or held["backlash"] or not held["base_circle_clearance"]:
        return center_distance
    given, free = float(center_distance), float(_free_distance(pair.pinion, pair.wheel))
    if free - given > rounded_by(pair.pinion, pair.wheel, center_distance):
        return center_distance
    _LOG.warning(
        "GearPair: center_distance = %.10g mm is less than the backlash-free one by no more than the rounding of the "
        "given digits: %.10g mm is taken, without backlash",
        given,
        free,
    )
    return real(free)


_free_distance = program(free_distance)


def _faults(pair: GearPair) -> tuple[str, ...]:
    if _traced(pair):
        return ()
    known = pair_geometry(explicit(pair))
    if _traced(known):  # within a trace of something else
        return ()
    return faults_between(pair.pinion, pair.wheel, pair.center_distance, pair.axial_offset, known.margins, known.held)


def explicit(pair: GearPair) -> GearPair:
    """The pair of gears `with_diameters`, for programs that ask for their numbers and not whether they are given."""
    pinion, wheel = map(with_diameters, pair.gears)
    return changed(pair, pinion=pinion, wheel=wheel)


def is_even(pair: GearPair) -> bool:
    """Whether both faces are known to be one: gears of equal width without offset, of concrete numbers."""
    given = [concrete(each) for each in (pair.pinion.face_width, pair.wheel.face_width, pair.axial_offset)]
    if any(each is None for each in given):
        return False
    pinion, wheel, offset = given
    return bool(np.all(pinion == wheel) and np.all(offset == 0))


def _traced(tree: PyTree) -> bool:
    return any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(tree))
