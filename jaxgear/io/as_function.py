"""What a design file says as functions of its free parameters."""

from collections.abc import Mapping
from typing import Any

import equinox as eqx

from ..contact import Mesh, Resolution, prepare
from ..microgeometry import AbstractModification
from ..shafts import RigidSupport
from . import template


class FileDesign(eqx.Module):
    """The flanks of a design file as a function of its free parameters; pure and traceable.

    Attributes:
        names: of the parameters.
        pinion, wheel: the modifications, which are added up.
    """

    names: tuple[str, ...] = eqx.field(static=True)
    pinion: list[template.Part]
    wheel: list[template.Part]

    def __call__(self, parameters: Mapping[str, Any]) -> tuple[AbstractModification, AbstractModification]:
        """Modifications of pinion and wheel.

        Args:
            parameters: value of every free parameter, scalar.
        """
        if set(parameters) != set(self.names):
            raise ValueError(
                f"design: parameters {', '.join(sorted(parameters)) or '(none)'} must be those of the file: "
                f"{', '.join(sorted(self.names)) or '(none)'}"
            )
        return template.build(self.pinion, parameters), template.build(self.wheel, parameters)


class FileMesh(eqx.Module):
    """The prepared mesh of a design file as a function of its free parameters; pure and traceable."""

    pair: template.Part
    model: template.Part
    misalignment: template.Part
    resolution: Resolution

    def __call__(self, parameters: Mapping[str, Any]) -> Mesh:
        """The mesh."""
        pair, compliance = self.pair.build(parameters), self.model.build(parameters)
        axes = RigidSupport(pair, self.misalignment.build(parameters)) if self.misalignment.fields else None
        return prepare(pair, compliance=compliance, resolution=self.resolution, support=axes)
