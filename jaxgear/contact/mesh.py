"""A prepared mesh: everything that depends neither on the modification nor on the torque."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..compliance import Compliance, default_compliance
from ..compliance.hertz import AbstractLaw, contact_geometry
from ..compliance.toothload import ToothLoad, tooth_load
from ..geometry import GearPair, PathOfContact, outline, path_of_contact
from ..microgeometry import Flank
from ..numerics import concrete, minimum, whole
from .corner import REACH, corner_gap

Scalar = Float[Array, ""]
Field = Float[Array, "pairs positions"]


class Resolution(eqx.Module):
    """Array sizes of a mesh, all static.

    Attributes:
        positions: mesh positions over one base pitch.
        slices: slices over the common face width.
        pairs: tooth pairs carried along; `fewest_pairs` tells how few suffice. Pair i runs at
            phase + (pairs - 1) // 2 - i base pitches, so four pairs cover two base pitches on either side of the pitch
            point: contact ratios up to 3.
        patch_nodes: points across the Hertzian contact at which modifications are averaged. The contact bridges kinks
            and steep flanks over its own width; 1 takes the nominal contact point alone.
        newton_steps: largest number of steps of the contact solution.
        tolerance: residual at which the contact solution ends, relative to the transmission error and to the force;
            None for 1e-11 in double and 5e-6 in single precision.
    """

    positions: int = eqx.field(static=True, default=64)
    slices: int = eqx.field(static=True, default=1)
    pairs: int = eqx.field(static=True, default=4)
    patch_nodes: int = eqx.field(static=True, default=4)
    newton_steps: int = eqx.field(static=True, default=8)
    tolerance: float | None = eqx.field(static=True, default=None)

    def __check_init__(self):
        for name, low in (("positions", 4), ("slices", 1), ("pairs", 2), ("patch_nodes", 1), ("newton_steps", 1)):
            whole("Resolution", name, getattr(self, name), low)
        if self.tolerance is not None and not (isinstance(self.tolerance, float) and 0 < self.tolerance < 1):
            raise ValueError(f"Resolution: tolerance = {self.tolerance!r} must be a number between 0 and 1, or None")

    @property
    def leading(self) -> int:
        """Base pitches by which the first pair leads the reference pair."""
        return (self.pairs - 1) // 2

    @property
    def reach(self) -> tuple[int, int]:
        """Base pitches behind and ahead of the pitch point that the pairs cover."""
        return self.pairs - 1 - self.leading, self.leading + 1


class Mesh(eqx.Module):
    """A gear pair prepared for contact analysis; made by `prepare`.

    Attributes:
        pair: the gear pair.
        compliance: the compliance model.
        resolution: array sizes.
        path_of_contact: points A to E.
        phase: mesh positions in base pitches, shape (positions,).
        path: nominal path position of every pair [mm], shape (pairs, positions).
        pinion_load, wheel_load: load lines at the contact points.
        outside: distance of every pair outside the path of contact [mm], zero on it.
        corner_gap: gap of the unmodified flanks there [um].
        lever: what a pair closes per unit of transmission error; 1 on the path of contact, less beyond it, because the
            corner's gap opens while the gears turn on.
        outer_gap: smallest transmission error, beyond the unloaded one, at which pairs that are not carried along could
            touch [um].
        structure: compliance of both gears, (pairs, pairs, positions) [um per N/mm].
        law: prepared contact law.
        width_factor: squared half width of the contact per line load [mm^2 per N/mm].
        patch_place, patch_weight: points across the contact, relative to its half width, and their weights, shape
            (patch_nodes,).
        hub: common wind-up of the gear bodies [um per N/mm].
        face_coordinate: middle of every slice [mm], shape (slices,).
        slice_width: [mm], shape (slices,).
    """

    pair: GearPair
    compliance: Compliance
    resolution: Resolution
    path_of_contact: PathOfContact
    phase: Float[Array, " positions"]
    path: Field
    pinion_load: ToothLoad
    wheel_load: ToothLoad
    outside: Field
    corner_gap: Field
    lever: Field
    outer_gap: Scalar
    structure: Float[Array, "pairs pairs positions"]
    law: AbstractLaw
    width_factor: Field
    patch_place: Float[Array, " patch_nodes"]
    patch_weight: Float[Array, " patch_nodes"]
    hub: Scalar
    face_coordinate: Float[Array, " slices"]
    slice_width: Float[Array, " slices"]

    @property
    def pinion_flank(self) -> Flank:
        """Contact points on the pinion, for its modification; fields broadcast to (pairs, slices, positions)."""
        return self.flanks(0.0)[0]

    @property
    def wheel_flank(self) -> Flank:
        """Contact points on the wheel, for its modification; fields broadcast to (pairs, slices, positions)."""
        return self.flanks(0.0)[1]

    def flanks(self, offset) -> tuple[Flank, Flank]:
        """Points of both flanks that face each other at a distance from the centre of contact.

        Args:
            offset: distance along the flanks, towards the pinion tip [mm], scalar or (pairs, positions).
        """
        contact = self.path_of_contact
        return (
            self._flank(self.pinion_load, contact.pinion_roll_length(contact.start), offset),
            self._flank(self.wheel_load, contact.wheel_roll_length(contact.end), -offset),
        )

    def _flank(self, load: ToothLoad, start: Scalar, offset) -> Flank:
        gear = load.outline.gear
        # arc length of an involute: ds = rho / r_b d rho
        moved = jnp.maximum(load.roll_length + offset * gear.base_radius / load.roll_length, 0.0)
        return Flank(
            roll_length=moved[:, None],
            tip_roll_length=gear.tip_roll_length,
            start_roll_length=start,
            base_radius=gear.base_radius,
            face_coordinate=self.face_coordinate[None, :, None],
            face_width=self.pair.face_width,
        )


def prepare(pair: GearPair, *, compliance: Compliance | None = None, resolution: Resolution | None = None) -> Mesh:
    """Prepares a gear pair for `solve`: contact points, corner gaps and compliances over one base pitch.

    Args:
        pair: gear pair; every number in it may be traced.
        compliance: compliance model; None for `default_compliance()`.
        resolution: array sizes; None for `Resolution()`.

    Returns:
        the mesh, to be shared by any number of modifications and torques.

    Raises:
        ValueError: when the path of contact is longer than the pairs of the resolution can cover.
    """
    compliance = default_compliance() if compliance is None else compliance
    resolution = Resolution() if resolution is None else resolution
    _check_cover(path_of_contact(pair), resolution)
    return _prepare(pair, compliance, resolution)


@eqx.filter_jit
def _prepare(pair: GearPair, compliance: Compliance, resolution: Resolution) -> Mesh:
    contact = path_of_contact(pair)
    dtype = jnp.result_type(contact.start)
    phase = jnp.arange(resolution.positions, dtype=dtype) / resolution.positions
    offset = resolution.leading - jnp.arange(resolution.pairs, dtype=dtype)
    path = (phase[None] + offset[:, None]) * contact.base_pitch
    pinion_rho, wheel_rho, gap, lever, outside = _contact_points(pair, contact, path)
    pinion, wheel = tooth_load(outline(pair.pinion), pinion_rho), tooth_load(outline(pair.wheel), wheel_rho)
    slices, width = resolution.slices, pair.face_width
    geometry = contact_geometry(pinion, wheel, compliance.plane, width)
    centre = (jnp.arange(slices, dtype=dtype) + 0.5) / slices - 0.5
    # Chebyshev nodes of the second kind integrate with the weight of the semi-elliptic pressure
    angle = jnp.pi * jnp.arange(1, resolution.patch_nodes + 1, dtype=dtype) / (resolution.patch_nodes + 1)
    return Mesh(
        pair=pair,
        compliance=compliance,
        resolution=resolution,
        path_of_contact=contact,
        phase=phase,
        path=path,
        pinion_load=pinion,
        wheel_load=wheel,
        outside=outside,
        corner_gap=gap,
        lever=lever,
        outer_gap=minimum(_gaps_of_next_pairs(pair, contact, jnp.asarray([resolution.reach], dtype))),
        structure=compliance.structure(pinion, wheel),
        law=compliance.law(geometry, pinion, wheel, outside),
        width_factor=geometry.width_factor[:, 0],
        patch_place=jnp.cos(angle),
        patch_weight=jnp.sin(angle) ** 2,
        hub=compliance.hub(pinion, wheel),
        face_coordinate=centre * width,
        slice_width=jnp.full((slices,), 1.0 / slices, dtype) * width,
    )


def _contact_points(pair: GearPair, contact: PathOfContact, path: Field) -> tuple[Field, Field, Field, Field, Field]:
    """Roll lengths of pinion and wheel at the contact, corner gap [um], lever and distance outside the path, per pair.

    `phase` is the mean position of both gears: under a transmission error d the pinion leads it by d/2 and the wheel
    lags by d/2, so a corner is d/2 farther out than its nominal position and its gap grows by half its slope times d.
    """
    pinion_base, wheel_base = contact.pinion_base_radius, contact.wheel_base_radius
    before, after = contact.start - path, path - contact.end
    on_path = jnp.clip(path, contact.start, contact.end)
    approach = contact.pinion_roll_length(contact.start), pinion_base
    recess = contact.wheel_roll_length(contact.end), wheel_base
    reach = REACH * contact.base_pitch
    gap_before, slope_before, pinion_rho = _corner(before, reach, pair.wheel.tip_roll_length, wheel_base, *approach)
    gap_after, slope_after, wheel_rho = _corner(after, reach, pair.pinion.tip_roll_length, pinion_base, *recess)
    return (
        jnp.where(before > 0, pinion_rho, contact.pinion_roll_length(on_path)),
        jnp.where(after > 0, wheel_rho, contact.wheel_roll_length(on_path)),
        gap_before + gap_after,
        1 - 0.5e-3 * (slope_before + slope_after),
        jnp.maximum(jnp.maximum(before, after), 0.0),
    )


def _corner(x, reach, tip_rho, tip_base, mate_rho, mate_base):
    """Corner gap [um], its slope [um/mm] and the mate's roll length [mm].

    Beyond `reach` the gap goes on along its tangent, so that far pairs stay finite and apart.
    """
    near = jnp.clip(x, 0.0, reach)
    (gap, rho), (slope, _) = jax.jvp(
        lambda t: corner_gap(t, tip_rho, tip_base, mate_rho, mate_base), (near,), (jnp.ones_like(near),)
    )
    outside = x > 0
    return (
        jnp.where(outside, gap + slope * (jnp.maximum(x, reach) - reach), 0.0),
        jnp.where(outside, slope, 0.0),
        rho,
    )


def fewest_pairs(pair: GearPair, *, deflection: float = 100.0) -> int:
    """The fewest pairs for `Resolution` that contain every contact up to a deflection; work grows with their square.

    Args:
        pair: gear pair with concrete numbers.
        deflection: largest transmission error under load, beyond the unloaded one [um].

    Returns:
        the number of pairs, at least 2.

    Raises:
        ValueError: when more than 12 pairs would be needed.
    """
    candidates = range(2, 13)
    reaches = [Resolution(pairs=pairs).reach for pairs in candidates]
    gaps = np.asarray(_gaps_at(pair, reaches))
    for pairs, gap in zip(candidates, gaps):
        if gap.min() > deflection:
            return pairs
    raise ValueError(f"fewest_pairs: 12 pairs do not contain every contact up to deflection = {deflection:g} um")


@eqx.filter_jit
def _gaps_at(pair: GearPair, reaches):
    contact = path_of_contact(pair)
    return _gaps_of_next_pairs(pair, contact, jnp.asarray(reaches, jnp.result_type(contact.start)))


def _gaps_of_next_pairs(pair: GearPair, contact: PathOfContact, reach) -> Float[Array, "windows 2"]:
    """Closing of the first pairs beyond windows of (behind, ahead) base pitches, zero on the path of contact [um]."""
    path = jnp.stack([-reach[:, 0], reach[:, 1]], axis=1) * contact.base_pitch
    _, _, gap, lever, _ = _contact_points(pair, contact, path)
    return gap / lever


def _check_cover(contact: PathOfContact, resolution: Resolution) -> None:
    start, end = concrete(contact.start / contact.base_pitch), concrete(contact.end / contact.base_pitch)
    if start is None or end is None:
        return
    behind, ahead = resolution.reach
    if (end > ahead).any() or (-start > behind).any():
        needed = max(2 * int(float(end.max()) // 1) + 1, 2 * int(float(-start.min()) // 1) + 2)
        raise ValueError(
            f"Resolution: pairs = {resolution.pairs} must be at least {needed}: the path of contact reaches from "
            f"{float(start.min()):.3g} to {float(end.max()):.3g} base pitches around the pitch point"
        )
