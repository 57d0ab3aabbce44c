"""The modifications of a flank as components of REXS.

Amounts are in mm and positive where material is removed; every component is additive. What the library says by lengths
goes out by diameters and face coordinates, which leave no question of where a length begins. A relief of b1 d + b2 d^2
is a linear and a parabolic one together. Other curves go out as points.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from ...microgeometry import (
    AbstractModification,
    EndRelief,
    LeadCrowning,
    LeadSlope,
    ProfileCrowning,
    ProfileSlope,
    RootRelief,
    TipRelief,
)
from ..errors import DesignFileError
from .rexs_model import Component, Model
from .topography import plain_terms, points, powers
from .values import Frame, shifted

_SHAPES = {1: "linear", 2: "parabolic"}  # of a relief, by the power of its depth


class Writer:
    """Writes the modifications of one gear.

    Args:
        model: where they go.
        flanks: the components of both flanks.
        frame: the flank within its pair.
        owner: name of the gear, for messages.
        error: of a curve that goes out as points [um].
    """

    def __init__(self, model: Model, flanks: list[Component], frame: Frame, owner: str, error: float) -> None:
        self._model, self._flanks, self._frame, self._owner, self._error = model, flanks, frame, owner, error

    def write(self, modification: AbstractModification) -> None:
        """Writes a modification.

        Raises:
            DesignFileError: for a step, which no points can show.
        """
        for term in plain_terms(modification):
            write = _WRITERS.get(type(term))
            if write is None or not write(self, term):
                self._points(term)

    def _add(self, kind: str, **values: tuple[Any, str]) -> None:
        part = self._model.add(kind, "", is_additive_modification=(True, "none"), **values)
        for flank in self._flanks:
            self._model.relate("reference", origin=flank, referenced=part)

    def _mm(self, length) -> tuple[Any, str]:
        return length, "mm"

    def _amount(self, amount) -> tuple[Any, str]:
        return shifted(amount, -3), "mm"

    def _tip_relief(self, term: TipRelief) -> bool:
        start = self._frame.tip - float(term.length)
        return self._relief(
            term,
            start >= 0,
            lambda shape, amount: self._add(
                "tip_relief",
                shape_of_relief=shape,
                tip_relief_depth=amount,
                tip_relief_datum_diameter=self._mm(self._frame.diameter(start)),
                tip_relief_evaluation_reference=self._mm(self._frame.diameter(self._frame.tip)),
            ),
        )

    def _root_relief(self, term: RootRelief) -> bool:
        end = self._frame.start + float(term.length)
        return self._relief(
            term,
            True,
            lambda shape, amount: self._add(
                "root_relief",
                shape_of_relief=shape,
                root_relief_depth=amount,
                root_relief_datum_diameter=self._mm(self._frame.diameter(end)),
                root_relief_evaluation_reference=self._mm(self._frame.diameter(self._frame.start)),
            ),
        )

    def _end_relief(self, term: EndRelief) -> bool:
        frame = self._frame

        def add(shape, amount) -> None:
            for face, side in (("datum_face", "negative"), ("non_datum_face", "positive")):
                if term.side in ("both", side):
                    self._add(f"end_relief_{face}", shape_of_relief=shape, **{
                        f"end_relief_depth_{face}": amount,
                        f"end_relief_length_{face}": self._mm(float(term.length)),
                        f"end_relief_evaluation_reference_{face}": self._mm(frame.place(face, 0.5 * frame.width)),
                    })  # fmt: skip

        return self._relief(term, True, add)

    def _relief(self, term: Any, fits: bool, add: Callable[..., None]) -> bool:
        """Writes a relief if REXS knows its shape."""
        known = powers(term.curve)
        if known is None or not fits:
            return False
        if float(term.length) > 0:
            for power, share in known.items():
                amount = np.asarray(term.amount) if share == 1 else share * np.asarray(term.amount)
                add((_SHAPES[power], "none"), self._amount(amount))
        return True

    def _profile_crowning(self, term: ProfileCrowning) -> bool:
        frame = self._frame
        self._add(
            "profile_crowning",
            shape_of_profile_crowning=("parabolic", "none"),
            profile_crowning_at_root=self._amount(term.amount),
            profile_crowning_at_tip=self._amount(term.amount),
            diameter_where_profile_crowning_root_is_specified=self._mm(frame.diameter(frame.start)),
            diameter_where_profile_crowning_tip_is_specified=self._mm(frame.diameter(frame.tip)),
            profile_highest_point=self._mm(frame.diameter(0.5 * (frame.start + frame.tip))),
        )
        return True

    def _profile_slope(self, term: ProfileSlope) -> bool:
        frame = self._frame
        self._add(
            "profile_slope",
            profile_slope=self._amount(term.amount),
            diameter_where_profile_slope_amount_is_specified=self._mm(frame.diameter(frame.tip)),
            profile_evaluation_start=self._mm(frame.diameter(frame.start)),
            profile_evaluation_end=self._mm(frame.diameter(frame.tip)),
        )
        return True

    def _lead_crowning(self, term: LeadCrowning) -> bool:
        frame = self._frame
        self._add(
            "helix_crowning",
            shape_of_helix_crowning=("parabolic", "none"),
            helix_crowning_amount_datum_face=self._amount(term.amount),
            helix_crowning_amount_non_datum_face=self._amount(term.amount),
            coordinate_where_helix_crowning_is_specified_datum_face=self._mm(-0.5 * frame.width),
            coordinate_where_helix_crowning_is_specified_non_datum_face=self._mm(0.5 * frame.width),
            helix_highest_point=self._mm(0.0),
        )
        return True

    def _lead_slope(self, term: LeadSlope) -> bool:
        frame = self._frame
        self._add(
            "helix_slope",
            helix_slope=self._amount(term.amount),
            helix_evaluation_reference=("helix_evaluation_length", "none"),
            helix_evaluation_start=self._mm(-0.5 * frame.width),
            helix_evaluation_end=self._mm(0.5 * frame.width),
        )
        return True

    def _points(self, term: AbstractModification) -> None:
        try:
            roll, face, amount = points(term, self._frame, self._error)
        except ValueError as error:
            raise DesignFileError(self._owner, f"{type(term).__name__} {error}") from None
        diameters, coordinates = np.meshgrid(self._frame.diameter(roll), face, indexing="ij")
        self._add(
            "topographical_modification",
            type_of_interpolation_topographical_modification=("linear", "none"),
            diameters_of_topographical_modification=self._mm(diameters.ravel()),
            coordinates_of_topographical_modification=self._mm(coordinates.ravel()),
            topographical_modification_amounts=self._amount(amount.ravel()),
        )


_WRITERS: dict[type, Callable[[Writer, Any], bool]] = {
    TipRelief: Writer._tip_relief,
    RootRelief: Writer._root_relief,
    EndRelief: Writer._end_relief,
    ProfileCrowning: Writer._profile_crowning,
    ProfileSlope: Writer._profile_slope,
    LeadCrowning: Writer._lead_crowning,
    LeadSlope: Writer._lead_slope,
}
