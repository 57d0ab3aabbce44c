"""Bearing reactions and elastic lines of shafts under the loads of a gearbox."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..contact.status import Status
from ..numerics import Checked, Numbers, check, concrete, program, real, result
from .gearbox import Gearbox
from .loads import Patterns, load_pattern, side_by_side, solve, system_under_load, torques_on
from .stepped_beam import DIRECTIONS, twist

_WAYS = len(DIRECTIONS)
_ROUNDED = 1 + 1e-6  # an end of a shaft in single precision


class BearingReactions(Checked):
    """Forces and displacements at the bearings, in the order of their shafts; directions are x, y, z, rx, ry.

    Attributes:
        names: names of the bearings.
        force: force of the shafts on the bearings [N, N mm], shape (bearings, directions); `print` shows radial and
            axial force.
        shaft: displacement of the shafts at the bearings [um, mrad], shape (bearings, directions).
        seat: displacement of the housing at the bearings [um, mrad], shape (bearings, directions).
    """

    names: tuple[str, ...] = eqx.field(static=True)
    force: Float[Array, "bearings directions"] = result("N")
    shaft: Float[Array, "bearings directions"] = result("um")
    seat: Float[Array, "bearings directions"] = result("um")

    def __str__(self) -> str:
        head = f"{'bearing':12}{'force N':>12}{'axial N':>10}{'x':>10}{'y':>10}{'z':>10}" + "".join(
            f"{name:>10}" for name in ("seat x", "seat y", "seat z")
        )
        lines = [head + "   um"]
        for name, force, shaft, seat in zip(self.names, *map(np.asarray, (self.force, self.shaft, self.seat))):
            moved = "".join(f"{value:10.2f}" for value in (*shaft[:3], *seat[:3]))
            lines.append(f"{name:12}{np.hypot(force[0], force[1]):12.1f}{force[2]:10.1f}{moved}")
        return "\n".join(lines)


class ElasticLine(Checked):
    """Deformation of a shaft under load at given positions.

    Attributes:
        position: distance from the left end of the shaft [mm], shape (points,).
        displacement: displacement in x, y, z, rx, ry [um, mrad], shape (points, 5).
        twist: twist against the left end, positive in the sense of rotation of the shaft [mrad], shape (points,).
    """

    position: Float[Array, " points"] = result("mm")
    displacement: Float[Array, "points 5"] = result("um")
    twist: Float[Array, " points"] = result("mrad")


def bearing_reactions(gearbox: Gearbox) -> BearingReactions:
    """Bearing reactions under all loads, with mesh forces even over their faces; NaN for an unsupported shaft."""
    return _reactions(gearbox)


def elastic_line(gearbox: Gearbox, shaft: str, position: Numbers) -> ElasticLine:
    """Displacements and twist of a shaft under all loads, with mesh forces even over their faces.

    Args:
        gearbox: gearbox, with the torques of its couplings.
        shaft: name of the shaft.
        position: distance from the left end of the shaft [mm], shape (points,).

    Raises:
        ValueError: for an unknown shaft, or a position beyond its ends.
    """
    names = [item.name for item in gearbox.shafts]
    if shaft not in names:
        raise ValueError(f'shaft "{shaft}" is not known, must be one of {", ".join(names)}')
    end = concrete(gearbox.shafts[names.index(shaft)].length)
    farthest = None if end is None else float(end) * _ROUNDED
    check("position", position, "mm", low=0.0, high=farthest)
    return _line(gearbox, names.index(shaft), jnp.atleast_1d(real(position)))


@program
def _reactions(gearbox: Gearbox) -> BearingReactions:
    found = solve(system_under_load(gearbox, load_pattern(gearbox)), jnp.ones((1, 1)), actual=True)
    possible = gearbox.status == Status.CONVERGED
    each = -found.force, found.bearing, found.seat
    force, shaft, seat = (jnp.where(possible, item[:, 0].reshape(-1, _WAYS), jnp.nan) for item in each)
    return BearingReactions(gearbox.bearing_names, force, shaft, seat)


@program
def _line(gearbox: Gearbox, shaft: int, position: Float[Array, " points"]) -> ElasticLine:
    count = len(position)
    probes = [Patterns(jnp.zeros(0), jnp.zeros((0, _WAYS, _WAYS * count)))] * len(gearbox.shafts)
    probes[shaft] = Patterns(position, jnp.eye(_WAYS * count).reshape(count, _WAYS, -1))
    load = jnp.zeros((_WAYS * count + 1, 1)).at[-1].set(1.0)
    found = solve(system_under_load(gearbox, side_by_side(probes, load_pattern(gearbox))), load, actual=True).pattern[
        :-1, 0
    ]
    at, torque = torques_on(gearbox, shaft)
    # of two torques that twist a shaft against each other, the left one is taken as the reaction
    turned = twist(gearbox.shafts[shaft].beam, jnp.minimum(position[:, None], at[None, :])) @ torque
    # NaN for a traced shaft that is not valid
    possible = gearbox.status == Status.CONVERGED
    bent, turned = (jnp.where(possible, each, jnp.nan) for each in (found.reshape(count, _WAYS), turned))
    return ElasticLine(position, bent, turned)
