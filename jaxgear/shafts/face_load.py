"""Load over the face and its factors K_Hbeta and K_Fbeta.

References:
    ISO 6336-1, Annex E (one-dimensional contact analysis with one constant mesh stiffness along the face), in the form
    in which U. Kissling uses it for the first two steps of a layout of modifications; clause 7 for K_Fbeta.
"""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..compliance.iso_6336 import iso_stiffness
from ..contact.status import Status, Statuses, WithStatus, status_of
from ..contact.support import AbstractSupport
from ..geometry import Gear, GearPair, path_of_contact
from ..microgeometry import AbstractModification, Flank, NoModification
from ..numerics import Checked, Given, check, maximum, press, program, real, result, whole
from .mesh_support import ShaftSupport, even_coordinates

Scalar = Float[Array, ""]
Slices = Float[Array, " slices"]

_STATIONS = 41
# ISO 6336-1:2006/2019 clause 9: mesh stiffness for K_Hbeta over that for K_v and K_Halpha
_FACE_SHARE = 0.85
_WIDEST_TOOTH = 1 / 3  # largest h/b of ISO 6336-1 clause 7
_LEVEL = 1 - 1e-5  # factor of an even load, less rounding


class FaceLoad(WithStatus, Checked):
    """Load over the face by the one-dimensional contact analysis; NaN where the analysis has not converged.

    Attributes:
        face_coordinate: face coordinates of the stations, evenly spaced over the common face, from its middle [mm],
            shape (stations,).
        line_load: line load at the stations [N/mm], shape (stations,).
        gap: gap of the flanks without the load of this mesh: misalignment, modifications, other loads [um], shape
            (stations,).
        deformation: gap opened by shafts, bearings and housing under the line load [um], shape (stations,).
        approach: approach of the flanks along the line of action [um], shape ().
        in_contact: True at stations that carry load, shape (stations,).
        status: `converged` if all contact conditions hold, the support is valid, and its gears can run.
    """

    face_coordinate: Slices = result("mm")
    line_load: Slices = result("N/mm")
    gap: Slices = result("um")
    deformation: Slices = result("um")
    approach: Scalar = result("um")
    in_contact: Bool[Array, " slices"] = eqx.field()
    status: Statuses = result()

    @property
    def face_load_factor(self) -> Scalar:
        """K_Hbeta, largest over mean line load, shape ()."""
        return face_load_factor(self.line_load)


def face_load_factor(line_load: Float[Array, "... slices"], slice_width: Slices | None = None) -> Float[Array, "..."]:
    """K_Hbeta: largest over mean line load over the face; 1 without load, NaN for a line load of NaN.

    Args:
        line_load: line load over the face [N/mm], shape (..., slices). From a contact analysis take one pair at one
            position, as `metrics.face_load_factor` does.
        slice_width: width of every slice [mm], shape (slices,); None for equal widths.
    """
    load = real(line_load)
    check("slice_width", slice_width, "mm", low=0.0, open_low=True)
    given = jnp.ones_like(load[..., :1]) if slice_width is None else real(slice_width)
    return _largest_over_mean(load, given)


@partial(jax.jit, inline=True)
def _largest_over_mean(load: Array, width: Array) -> Array:
    width = jnp.broadcast_to(width, load.shape)
    mean = jnp.sum(load * width, axis=-1) / jnp.sum(width, axis=-1)
    idle = mean <= 0  # a mean of NaN is not idle and stays NaN
    return jnp.where(idle, 1.0, maximum(load, axis=-1) / jnp.where(idle, 1.0, mean))


def root_face_load_factor(factor: Given, face_width: Given, tooth_height: Given) -> Float[Array, "..."]:
    """K_Fbeta = K_Hbeta^N_F, N_F = 1 / (1 + h/b + (h/b)^2) (ISO 6336-1 clause 7, Method B).

    Args:
        factor: K_Hbeta.
        face_width: face width b [mm], the smaller one of the two gears.
        tooth_height: tooth height h from root to tip [mm], of the gear with the larger h/b; h/b is limited to 1/3.
    """
    check("factor", factor, "", low=_LEVEL)
    check("face_width", face_width, "mm", low=0.0, open_low=True)
    check("tooth_height", tooth_height, "mm", low=0.0, open_low=True)
    return jnp.maximum(real(factor), 1.0) ** root_exponent(real(face_width), real(tooth_height))


def root_exponent(face_width: Scalar, tooth_height: Scalar) -> Scalar:
    """Exponent N_F = 1 / (1 + h/b + (h/b)^2) of `root_face_load_factor`, from b and h [mm]."""
    ratio = jnp.minimum(tooth_height / face_width, _WIDEST_TOOTH)
    return 1 / (1 + ratio + ratio**2)


def tooth_height(pair: GearPair) -> Scalar:
    """Tooth height h for `root_face_load_factor` [mm]; h over the common face width is the larger h/b of both gears."""

    def of(gear: Gear) -> Scalar:
        return pair.face_width / gear.face_width * (gear.tip_radius - gear.root_circle_radius)

    return jnp.maximum(of(pair.pinion), of(pair.wheel))


def mesh_stiffness(pair: GearPair, line_load: Given) -> Scalar:
    """Mesh stiffness for K_Hbeta, c_gamma_beta = 0.85 c_gamma_alpha [N/(mm um)] (ISO 6336-1 Method B).

    Args:
        pair: gear pair.
        line_load: specific load F_t K_A / b [N/mm].
    """
    return _FACE_SHARE * iso_stiffness(pair, line_load).mesh


def annex_e(
    support: AbstractSupport,
    torque: Given | None = None,
    *,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
    stiffness: Given | None = None,
    stations: int = _STATIONS,
) -> FaceLoad:
    """Load over the face with a constant mesh stiffness, shaft deflection and gap (ISO 6336-1, Annex E).

    The line load w solves w / c_gamma + H w db + gap = approach where w > 0, without penetration elsewhere; the sum of
    w db is the force along the line of action. The standard iterates between deflection and load; this function solves
    for both at once, as one complementarity problem.

    Args:
        support: support of the mesh, `support` of a gearbox or `RigidSupport`.
        torque: torque on the pinion [N m], application factor included; None for the torque of the gearbox.
        pinion, wheel: modifications and deviations, evaluated along the pitch line; None for none.
        stiffness: mesh stiffness c_gamma [N/(mm um)]; None for `mesh_stiffness`.
        stations: number of stations over the face. The largest load is the value at the middle of a station; for a
            straight line load it is (K_Hbeta - 1) / stations below the value at the end of the face.

    Returns:
        the load over the face, differentiable. It is NaN and not `converged` where no solution exists, for instance if
        a shaft floats in its bearing clearances, and where traced gears, shafts, bearings or housing are not valid; the
        status gives the reason.

    Raises:
        ValueError: if a torque is given in addition to that of a gearbox, or no torque at all; for numbers out of their
            range.
    """
    of_gearbox = isinstance(support, ShaftSupport)
    if (torque is None) != of_gearbox:
        problem = "has no effect: that of the couplings counts" if of_gearbox else "must be given: no coupling has one"
        raise ValueError(f"torque {problem}")
    check("torque", torque, "N m", low=0.0)
    check("stiffness", stiffness, "N/(mm um)", low=0.0, open_low=True)
    modified = NoModification() if pinion is None else pinion, NoModification() if wheel is None else wheel
    optional = None if torque is None else real(torque), None if stiffness is None else real(stiffness)
    removed = _removed(support.pair, *modified, whole("stations", stations, 2, 1001))
    return _annex_e(support, removed, *optional)


@program
def _removed(pair: GearPair, pinion: AbstractModification, wheel: AbstractModification, stations: int) -> Slices:
    """Modification amount of both flanks at the stations [um]; a separate program, so that `_annex_e` compiles once."""
    y = even_coordinates(pair.face_width, stations)
    amount = sum(item(flank) for item, flank in zip((pinion, wheel), _pitch_lines(pair, y)))
    return jnp.broadcast_to(amount, y.shape)


@program
def _annex_e(
    support: AbstractSupport,
    removed: Slices,
    torque: Scalar | None,
    stiffness: Scalar | None,
) -> FaceLoad:
    pair, stations = support.pair, len(removed)
    moment = support.torque if torque is None else torque
    assert moment is not None  # one of both is given
    width = pair.face_width
    y, step = even_coordinates(width, stations), width / stations
    if stiffness is None:
        # the stiffness of the standard vanishes with the load; without load any stiffness gives the same result
        some = jnp.where(moment > 0, moment, 1.0)
        stiffness = mesh_stiffness(pair, 1e3 * some / (pair.pinion.pitch_radius * width))
    influence = support.influence(y)
    gap = jnp.broadcast_to(support.gap(y) + removed, y.shape)
    found = press(influence + jnp.eye(stations) / (stiffness * step), gap, 1e3 * moment / pair.pinion.base_radius)
    causes = {Status.NOT_CONVERGED: ~found.converged, Status.OUT_OF_VALIDITY: ~(stiffness > 0)}
    status = status_of(causes, support.status)

    def where_found(value: Array) -> Array:
        return jnp.where(status == Status.CONVERGED, value, jnp.nan)

    # an unconverged load must not look like an even load or like no load
    return FaceLoad(
        face_coordinate=y,
        line_load=where_found(found.force / step),
        gap=gap,
        deformation=where_found(influence @ found.force),
        approach=where_found(found.approach),
        in_contact=found.in_contact,
        status=status,
    )


def _pitch_lines(pair: GearPair, y: Slices) -> tuple[Flank, Flank]:
    """The flanks of pinion and wheel along their pitch lines, y from the middle of the common face."""
    path = path_of_contact(pair)
    starts = path.pinion_roll_length(path.start), path.wheel_roll_length(path.end)
    rolls = path.pinion_pitch_roll_length, path.wheel_pitch_roll_length

    def line(gear: Gear, roll: Scalar, start: Scalar, middle: Scalar) -> Flank:
        return Flank(
            roll_length=roll[None],
            tip_roll_length=gear.tip_roll_length[None],
            start_roll_length=start[None],
            base_radius=gear.base_radius[None],
            face_coordinate=y + middle,
            face_width=gear.face_width[None],
        )

    pinion, wheel = (line(*each) for each in zip(pair.gears, rolls, starts, pair.face_middles))
    return pinion, wheel
