"""A prepared mesh: everything that depends neither on the modification nor on the torque."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..compliance import Compliance, default_compliance
from ..compliance.hertz import AbstractLaw
from ..compliance.toothload import ToothLoad, tooth_load
from ..geometry import GearPair, PathOfContact, outline, path_of_contact
from ..microgeometry import Flank
from ..numerics import concrete
from .corner import REACH, corner_gap

Scalar = Float[Array, ""]
Field = Float[Array, "pairs positions"]


class Resolution(eqx.Module):
    """Array sizes of a mesh, all static.

    Attributes:
        positions: mesh positions over one base pitch.
        slices: slices over the common face width.
        pairs: tooth pairs carried along. Pair i runs at phase + (pairs - 1) // 2 - i base pitches, so four pairs cover two
            base pitches on either side of the pitch point: contact ratios up to 3.
        newton_steps: steps of the contact solution.
    """

    positions: int = eqx.field(static=True, default=64)
    slices: int = eqx.field(static=True, default=1)
    pairs: int = eqx.field(static=True, default=4)
    newton_steps: int = eqx.field(static=True, default=8)

    def __check_init__(self):
        for name, low in (("positions", 4), ("slices", 1), ("pairs", 2), ("newton_steps", 1)):
            value = getattr(self, name)
            if not isinstance(value, int) or value < low:
                raise ValueError(f"Resolution: {name} = {value!r} must be a whole number of at least {low}")

    @property
    def leading(self) -> int:
        """Base pitches by which the first pair leads the reference pair."""
        return (self.pairs - 1) // 2


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
        structure: compliance of both gears, (pairs, pairs, positions) [um per N/mm].
        law: prepared contact law.
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
    structure: Float[Array, "pairs pairs positions"]
    law: AbstractLaw
    hub: Scalar
    face_coordinate: Float[Array, " slices"]
    slice_width: Float[Array, " slices"]

    @property
    def pinion_flank(self) -> Flank:
        """Contact points on the pinion, for its modification; fields broadcast to (pairs, slices, positions)."""
        contact = self.path_of_contact
        start = contact.pinion_roll_length(contact.start)
        return self._flank(self.pinion_load, start)

    @property
    def wheel_flank(self) -> Flank:
        """Contact points on the wheel, for its modification; fields broadcast to (pairs, slices, positions)."""
        contact = self.path_of_contact
        start = contact.wheel_roll_length(contact.end)
        return self._flank(self.wheel_load, start)

    def _flank(self, load: ToothLoad, start: Scalar) -> Flank:
        gear = load.outline.gear
        return Flank(
            roll_length=load.roll_length[:, None],
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
    contact = path_of_contact(pair)
    _check_cover(contact, resolution)
    dtype = jnp.result_type(contact.start)
    phase = jnp.arange(resolution.positions, dtype=dtype) / resolution.positions
    offset = resolution.leading - jnp.arange(resolution.pairs, dtype=dtype)
    path = (phase[None] + offset[:, None]) * contact.base_pitch
    pinion_rho, wheel_rho, gap, outside = _contact_points(pair, contact, path)
    pinion, wheel = tooth_load(outline(pair.pinion), pinion_rho), tooth_load(outline(pair.wheel), wheel_rho)
    slices, width = resolution.slices, pair.face_width
    centre = (jnp.arange(slices, dtype=dtype) + 0.5) / slices - 0.5
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
        structure=compliance.structure(pinion, wheel),
        law=compliance.law(pinion, wheel, width),
        hub=compliance.hub(pinion, wheel),
        face_coordinate=centre * width,
        slice_width=jnp.full((slices,), 1.0 / slices, dtype) * width,
    )


def _contact_points(pair: GearPair, contact: PathOfContact, path: Field) -> tuple[Field, Field, Field, Field]:
    """Roll lengths of pinion and wheel at the contact, corner gap [um] and distance outside the path, per pair."""
    pinion_base, wheel_base = contact.pinion_base_radius, contact.wheel_base_radius
    before, after = contact.start - path, path - contact.end
    on_path = jnp.clip(path, contact.start, contact.end)
    approach = contact.pinion_roll_length(contact.start), pinion_base
    recess = contact.wheel_roll_length(contact.end), wheel_base
    gap_before, pinion_rho = _corner(before, pair.wheel.tip_roll_length, wheel_base, *approach, contact.base_pitch)
    gap_after, wheel_rho = _corner(after, pair.pinion.tip_roll_length, pinion_base, *recess, contact.base_pitch)
    return (
        jnp.where(before > 0, pinion_rho, contact.pinion_roll_length(on_path)),
        jnp.where(after > 0, wheel_rho, contact.wheel_roll_length(on_path)),
        gap_before + gap_after,
        jnp.maximum(jnp.maximum(before, after), 0.0),
    )


def _corner(x, tip_rho, tip_base, mate_rho, mate_base, base_pitch):
    """Corner gap that goes on along its tangent beyond `REACH`, so that far pairs stay finite and apart."""
    reach = REACH * base_pitch
    near = jnp.minimum(x, reach)
    gap, rho = corner_gap(near, tip_rho, tip_base, mate_rho, mate_base)
    end, slope = jax.jvp(
        lambda t: corner_gap(t, tip_rho, tip_base, mate_rho, mate_base)[0], (reach,), (jnp.ones_like(reach),)
    )
    return jnp.where(x > reach, end + slope * (x - near), gap), rho


def _check_cover(contact: PathOfContact, resolution: Resolution) -> None:
    start, end = concrete(contact.start / contact.base_pitch), concrete(contact.end / contact.base_pitch)
    if start is None or end is None:
        return
    ahead, behind = resolution.leading + 1, resolution.pairs - 1 - resolution.leading
    if (end > ahead).any() or (-start > behind).any():
        needed = max(2 * int(float(end.max()) // 1) + 1, 2 * int(float(-start.min()) // 1) + 2)
        raise ValueError(
            f"Resolution: pairs = {resolution.pairs} must be at least {needed}: the path of contact reaches from "
            f"{float(start.min()):.3g} to {float(end.max()):.3g} base pitches around the pitch point"
        )
