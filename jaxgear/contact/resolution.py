"""Array sizes of a mesh."""

import equinox as eqx

from ..numerics import Checked, count, number

_SLIDING_NODES = 3  # a parabola
_SLIDE_STEPS = 2


class Resolution(Checked):
    """Array sizes of a mesh, all static.

    Attributes:
        positions: mesh positions over one base pitch.
        slices: slices of equal width over the common face.
        pairs: tooth pairs carried along; None for as few as the gears and the load need, see `prepare`. Pair i runs at
            phase + (pairs - 1) // 2 - i base pitches, so four pairs cover two base pitches on either side of the pitch
            point: contact ratios up to 3.
        patch_nodes: points across the Hertzian contact at which modifications are averaged. The contact bridges kinks
            and steep flanks over its own width; 1 takes the nominal contact point alone.
        slide_steps: steps in which the contact slides down the slope of a modification; 0 keeps it at its nominal
            place. None for 2, and 0 where fewer than 3 points across the contact do not see slope and curvature.
        coupled_slices: whether slices feel each other's load, as those of a real face do; without it each slice bends
            on its own, and the peak of line loads that vary over the face comes out 10 to 40 % too small. One slice has
            nothing to feel.
        face_modes: waves over the face by which slices feel each other; more than slices are as many as slices. With 5
            line loads are within 0.4 % of those with all on faces of 6 modules, 0.7 % on 67. Gears of unequal width
            take two more, at least 7, of which four decay from the ends: 0.1 % on 6 modules, 0.9 % on 20.
        newton_steps: largest number of steps of the contact solution.
        rtol: residual at which the contact solution ends, relative to the transmission error and to the force;
            None for 1e-11 in double and 5e-6 in single precision.
    """

    positions: int = count(low=4, default=64)
    slices: int = count(default=1)
    pairs: int | None = count(low=2, optional=True, default=None)
    patch_nodes: int = count(default=4)
    slide_steps: int | None = count(low=0, high=20, optional=True, default=None)
    coupled_slices: bool = eqx.field(static=True, default=True)
    face_modes: int = count(low=2, default=5)
    newton_steps: int = count(default=8)
    rtol: float | None = number(
        "", low=0.0, high=1.0, open_low=True, open_high=True, static=True, optional=True, default=None
    )

    def check_together(self) -> None:
        if self.slide_steps and self.patch_nodes < _SLIDING_NODES:
            raise ValueError(
                f"Resolution: slide_steps = {self.slide_steps} needs patch_nodes >= {_SLIDING_NODES}, is "
                f"{self.patch_nodes}: fewer points across the contact do not see slope and curvature of a flank"
            )

    @property
    def chosen_slide_steps(self) -> int:
        """`slide_steps`, with its default."""
        if self.slide_steps is not None:
            return self.slide_steps
        return _SLIDE_STEPS if self.patch_nodes >= _SLIDING_NODES else 0

    @property
    def is_coupled(self) -> bool:
        """Whether there are slices that feel each other."""
        return self.coupled_slices and self.slices > 1

    @property
    def chosen_pairs(self) -> int:
        """Number of pairs, which `prepare` has chosen where it was not given."""
        if self.pairs is None:
            raise ValueError("Resolution: pairs = None has no number yet: prepare chooses it")
        return self.pairs

    @property
    def leading(self) -> int:
        """Base pitches by which the first pair leads the reference pair."""
        return _leading(self.chosen_pairs)

    @property
    def reach(self) -> tuple[int, int]:
        """Base pitches behind and ahead of the pitch point that the pairs cover."""
        return reach(self.chosen_pairs)


def reach(pairs: int) -> tuple[int, int]:
    """Base pitches behind and ahead of the pitch point that a number of pairs covers."""
    ahead = _leading(pairs) + 1
    return pairs - ahead, ahead


def _leading(pairs: int) -> int:
    return (pairs - 1) // 2
