"""Designs: functions that make modifications of named parameters."""

from collections.abc import Callable, Mapping

from jaxtyping import Array, Float

from ..microgeometry import AbstractModification, NoModification

Parameters = Mapping[str, Float[Array, ""]]
Modifications = tuple[AbstractModification | None, AbstractModification | None]
Design = Callable[[Parameters], Modifications]


def two_modifications(made) -> tuple[AbstractModification, AbstractModification]:
    """What a design has made, with nominal involutes for None.

    Raises:
        ValueError: for anything but two modifications.
    """
    if not (isinstance(made, tuple | list) and len(made) == 2):
        what = f"{len(made)} values" if isinstance(made, tuple | list) else f"one {type(made).__name__}"
        raise ValueError(f"design: gives {what}, must give two modifications, (pinion, wheel); None for an involute")
    for name, modification in zip(("pinion", "wheel"), made):
        if not (modification is None or isinstance(modification, AbstractModification)):
            kind = type(modification).__name__
            raise ValueError(f"design: the {name} is of type {kind}, must be a modification or None for an involute")
    pinion, wheel = made
    return pinion or NoModification(), wheel or NoModification()
