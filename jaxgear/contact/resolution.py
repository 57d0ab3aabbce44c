"""Array sizes of a mesh."""

from dataclasses import replace
from math import gcd

import equinox as eqx
import numpy as np

from ..numerics import Checked, Given, changed, check, count, number, whole

_SLIDING_NODES = 3  # a parabola
_SLIDE_STEPS = 20
# Widths of slices from an end of the face on, how much of that is over the relief, and finest parts of the narrowest
_END, _OVER_RELIEF, _FINEST = (3, 2, 1, 1), 6, 8
_MISSED = 0.02  # of the length of a relief, by which slices may end beside where it begins
_MOST_PARTS = 1024  # of equal width, that slices of unequal width are put together from


class Resolution(Checked):
    """Array sizes of a mesh, all static.

    Attributes:
        positions: mesh positions over one base pitch.
        slices: slices over the common face; 1 takes it as a whole, of helical gears as many as show how their contact
            lines run across it (`helical_slices`).
        pairs: tooth pairs carried along; None for as few as the gears and the load need, see `prepare`. Pair i runs at
            phase + (pairs - 1) // 2 - i base pitches, and mesh positions begin at phase 0, of an odd number of pairs at
            -1/2: they cover as much on either side of the pitch point, four pairs two base pitches, contact ratios up
            to 3.
        contact_nodes: points across the contact width at which modifications are averaged; 1 takes the nominal contact
            point alone.
        slide_steps: most steps of the search for the place where a contact rests on the slope of a modification; 0
            keeps it at its nominal place. None for 20, of which reliefs take four or five, and for 0 with fewer than 3
            points across the contact, which do not resolve slope and curvature.
        coupled_slices: whether slices are elastically coupled, as those of a real face are; without it each slice
            deflects on its own, and the peak of line loads that vary over the face is 10 to 40 % too small. No effect
            on one slice.
        face_modes: waves over the face by which slices are coupled; a number above that of the slices acts as that of
            the slices. With 5, line loads are within 0.4 % of those with all on faces of 6 modules, 0.7 % on 67. Gears
            of unequal width take two more, at least 7, of which four decay from the ends: 0.1 % on 6 modules, 0.9 % on
            20.
        newton_steps: largest number of steps of the contact solution.
        rtol: residual at which the contact solution ends, relative to the transmission error and to the force;
            None for 1e-11 in double and 5e-6 in single precision.
        slice_widths: relative widths of the slices as whole numbers, from the negative end of the face to the positive
            one; None for slices of equal width. Short features such as an end relief need narrow slices, see
            `end_relief_widths`.
        extended_contact: whether pairs touch with their tip corners beyond the path of contact too, as those of loaded
            gears do; without it every pair takes load from the start of the path to its end alone, as in many published
            models, and the transmission error jumps there.
    """

    positions: int = count(low=4, default=64)
    slices: int = count(default=1)
    pairs: int | None = count(low=2, optional=True, default=None)
    contact_nodes: int = count(default=4)
    slide_steps: int | None = count(low=0, high=20, optional=True, default=None)
    coupled_slices: bool = eqx.field(static=True, default=True)
    face_modes: int = count(low=2, default=5)
    newton_steps: int = count(default=8)
    rtol: float | None = number(
        "", low=0.0, high=1.0, open_low=True, open_high=True, static=True, optional=True, default=None
    )
    slice_widths: tuple[int, ...] | None = number(
        "", low=1, high=_MOST_PARTS, whole=True, static=True, shape=("slices",), optional=True, default=None
    )
    extended_contact: bool = eqx.field(static=True, default=True)

    def check_together(self) -> None:
        if self.slide_steps and self.contact_nodes < _SLIDING_NODES:
            raise ValueError(
                f"Resolution: slide_steps = {self.slide_steps} needs contact_nodes >= {_SLIDING_NODES}, is "
                f"{self.contact_nodes}: fewer points across the contact do not resolve slope and curvature of a flank"
            )

        if self.slice_widths is None:
            return
        if len(self.slice_widths) != self.slices:
            raise ValueError(
                f"Resolution: slice_widths has {len(self.slice_widths)} numbers, must have one for each of the "
                f"slices = {self.slices}"
            )
        if sum(self.slice_widths) > _MOST_PARTS:
            raise ValueError(
                f"Resolution: slice_widths sum to {sum(self.slice_widths)}, must sum to at most {_MOST_PARTS}: small "
                "whole numbers do"
            )

    @property
    def parts(self) -> tuple[int, ...] | None:
        """Parts of equal width that make up each slice, as few as can be; None where the slices are of equal width."""
        if self.slice_widths is None or len(set(self.slice_widths)) == 1:
            return None
        common = gcd(*self.slice_widths)
        return tuple(width // common for width in self.slice_widths)

    @property
    def slice_edges(self) -> np.ndarray:
        """Where slices end, from -0.5 to 0.5 of the common face, one more than slices."""
        parts = self.parts or (1,) * self.slices
        return np.cumsum([0, *parts]) / sum(parts) - 0.5

    @property
    def slice_weights(self) -> np.ndarray | None:
        """Widths of the slices over their mean; None where all are equal."""
        return None if self.parts is None else np.asarray(self.parts) / np.mean(self.parts)

    @property
    def chosen_slide_steps(self) -> int:
        """`slide_steps`, with its default."""
        if self.slide_steps is not None:
            return self.slide_steps
        return _SLIDE_STEPS if self.contact_nodes >= _SLIDING_NODES else 0

    @property
    def is_coupled(self) -> bool:
        """Whether there are coupled slices."""
        return self.coupled_slices and self.slices > 1

    @property
    def chosen_pairs(self) -> int:
        """Number of pairs, which `prepare` has chosen where it was not given."""
        if self.pairs is None:
            raise ValueError("Resolution: pairs = None has no number yet: prepare chooses it")
        return self.pairs

    @property
    def of_arrays(self) -> "Resolution":
        """Sizes that the arrays of a prepared mesh depend on, all else at its default: one program serves many."""
        plain = self._plain(slice_widths=self.parts, extended_contact=self.extended_contact)
        if self.slices == 1:
            return plain
        modes = self.face_modes if self.coupled_slices else plain.face_modes
        return replace(plain, coupled_slices=self.coupled_slices, face_modes=modes)

    @property
    def of_material(self) -> "Resolution":
        """Sizes that the material removed from the flanks of a prepared mesh depends on, all else at its default."""
        nodes, steps = self.contact_nodes, self.chosen_slide_steps
        return self._plain(contact_nodes=nodes, slide_steps=steps, slice_widths=self.parts)

    @property
    def of_contact(self) -> "Resolution":
        """Sizes that the contact depends on once the removed material is known, all else at its default."""
        steps, rtol = self.newton_steps, self.rtol
        return self._plain(newton_steps=steps, rtol=rtol)

    def _plain(self, **sizes: object) -> "Resolution":
        """These positions, slices and pairs, all else at its default; unchecked, as a single position is allowed."""
        return changed(Resolution(), positions=self.positions, slices=self.slices, pairs=self.pairs, **sizes)

    @property
    def leading(self) -> int:
        """Base pitches by which the first pair leads the reference pair."""
        return (self.chosen_pairs - 1) // 2

    @property
    def reach(self) -> float:
        """Base pitches on either side of the pitch point that the pairs cover."""
        return reach(self.chosen_pairs)

    @property
    def first_phase(self) -> float:
        """Mesh position with which the base pitch begins so that the pairs cover that [base pitches]."""
        return self.reach - self.leading - 1


def end_relief_widths(face_width: Given, length: Given, slices: int = 11) -> tuple[int, ...]:
    """Widths of slices that show an end relief, for `Resolution.slice_widths`.

    The load peaks where the relief begins: slices end there, and narrow to a sixth of its length on either side. Eleven
    such slices show the largest over the mean line load within 1 % of 72 equal ones where 11 equal ones miss it by 11 %
    (19/48 teeth, face of 6 modules, relief of 15 um over a sixth of it at both ends).

    Args:
        face_width: b over which both faces overlap [mm].
        length: of the relief at either end of that face [mm], b/3 at most; what of it lies outside the mate does not
            count.
        slices: number of slices, at least 9.

    Raises:
        ValueError: for numbers out of these ranges, where the relief is too short for whole numbers, and for more
            slices than a long relief leaves room for.
    """
    whole("slices", slices, low=2 * len(_END) + 1)
    check("face_width", face_width, "mm", low=0.0, open_low=True)
    check("length", length, "mm", low=0.0, high=float(face_width) / 3, open_low=True)
    middle, best = slices - 2 * len(_END), None
    for unit in range(1, _FINEST + 1):  # parts of the face in the narrowest slice
        wide = max(unit, round(float((_OVER_RELIEF * face_width / length - 2 * sum(_END)) * unit / middle)))
        end = [unit * width for width in _END]
        made = (*end, *[wide] * middle, *end[::-1])
        missed = abs(_OVER_RELIEF * unit / sum(made) * face_width / length - 1)
        if sum(made) <= _MOST_PARTS and (best is None or missed < 0.5 * best[0]):
            best = missed, made
    if best is None:
        least = _OVER_RELIEF * float(face_width) / _MOST_PARTS
        raise ValueError(f"length = {float(length):g} mm must be at least {least:g} mm on this face")
    missed, made = best
    if missed > _MISSED:
        raise ValueError(
            f"slices = {slices} are too many for a relief of length = {float(length):g} mm on "
            f"{float(face_width):g} mm: those between the reliefs would be narrower than those at their ends"
        )
    return made


def reach(pairs: int) -> float:
    """Base pitches on either side of the pitch point that a number of pairs covers."""
    return 0.5 * pairs
