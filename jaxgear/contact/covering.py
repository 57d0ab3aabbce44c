"""How many tooth pairs a mesh has to carry along."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..geometry import GearPair, PathOfContact, explicit, pair_geometry
from ..numerics import concrete, program
from .kinematics import Contacts, contacts
from .resolution import Resolution, reach

# Deflection that the pairs contain by default [um per mm of module]: root stress and deflection of a tooth grow with
# its load and shrink with its module, so that 8 um per mm are about 500 MPa; twice that leaves room for deep reliefs.
_DEFLECTION = 16.0
_PAIRS_TRACED = 4
_FEWEST_PAIRS = 2
# Pairs beyond those on the path of contact that a deflection may need: teeth that bend farther have broken.
_MORE_PAIRS = 10
# Slices of helical gears for every base pitch that the face overlaps. Load sets in steeply where a tip corner enters:
# with 11 for one base pitch PPTE is 24 % off, with these 2 % (23/67 teeth, module 2.25 mm, 18 degrees).
_PER_PITCH = 30
# They come in the number that one turn of the loops over slices takes (`numerics.coupling`). Faces that overlap more
# than three base pitches have no more: there the many contact lines even PPTE out.
_STEP, _MOST_SLICES = 11, 99


def pairs_for(pair: GearPair, deflection: float | None) -> int:
    """Pairs to carry along where a resolution leaves their number open, see `prepare`."""
    if _is_traced(pair):
        return _PAIRS_TRACED
    fewest = fewest_pairs(pair, deflection=_contained(pair, deflection))
    return fewest + fewest % more_pairs(pair)


def more_pairs(pair: GearPair) -> int:
    """Pairs to add where more are needed: with one more, the mesh cycle begins half a base pitch earlier, which is
    another place on a rim whose teeth are not supported alike.
    """
    return 1 if pair.wheel.alike else 2


def _is_traced(pair: GearPair) -> bool:
    return any(concrete(leaf) is None for leaf in jax.tree.leaves(pair))


def _contained(pair: GearPair, deflection: float | None) -> float:
    """Deflection that the pairs have to contain [um]."""
    return _DEFLECTION * float(pair.pinion.module) if deflection is None else deflection


def pairs_alternate(pair: GearPair, resolution: Resolution, deflection: float | None) -> bool:
    """Whether at most one of the even and one of the odd pairs can touch in any one slice of helical gears.

    The two are the pairs within a base pitch of the pitch point, as of a spur pair. False for a resolution with more
    pairs than the deflection needs: all of them can touch then.
    """
    if pair.is_spur or not resolution.is_coupled or _is_traced(pair):
        return False
    wanted = _contained(pair, deflection)
    if not 2 < resolution.chosen_pairs <= fewest_pairs(pair, deflection=wanted):
        return False
    path = pair_geometry(explicit(pair)).path_of_contact
    return bool(np.min(np.asarray(_gaps_of_slices(pair, path))) > wanted)


@program
def _gaps_of_slices(pair: GearPair, contact: PathOfContact) -> Array:
    """Transmission error at which a third pair touches in a slice, behind and ahead of the two next to the middle."""
    return closing(contacts(pair, contact, jnp.stack([-contact.base_pitch, contact.base_pitch])))


def fewest_pairs(pair: GearPair, *, deflection: float = 100.0) -> int:
    """The fewest pairs for `Resolution` that contain every contact up to a deflection; work grows with their square.

    Those whose contact lines lie on the face within the path of contact, and as many more as touch beyond it.

    Args:
        pair: gear pair with concrete numbers.
        deflection: largest transmission error under load, beyond the unloaded one [um].

    Returns:
        the number of pairs, at least 2.

    Raises:
        ValueError: when more than 10 pairs beyond those on the path of contact would be needed.
    """
    path = pair_geometry(explicit(pair)).path_of_contact
    fewest, gaps = (np.asarray(found) for found in _next_gaps(pair, path))
    enough = np.flatnonzero(gaps.min(axis=1) > deflection)
    if not enough.size:
        raise ValueError(
            f"{int(fewest) + _MORE_PAIRS} pairs do not contain every contact up to deflection = "
            f"{deflection:g} um: the torque is too large for these teeth, or is it not in N m, or the elastic modulus "
            "not in MPa?"
        )
    return int(fewest) + int(enough[0])


@program
def _next_gaps(pair: GearPair, contact: PathOfContact) -> tuple[Array, Float[Array, "counts 2"]]:
    """Pairs on the path of contact; gaps of the next ones behind and ahead with these, and with ever one more [um]."""
    ahead = _half_overlap(pair)
    start, end = contact.start - ahead, contact.end + ahead
    fewest = jnp.maximum(_covering(jnp.maximum(end, -start) / contact.base_pitch), float(_FEWEST_PAIRS))
    counts = fewest + jnp.arange(_MORE_PAIRS + 1, dtype=fewest.dtype)
    nearest = counts * reach(1) * contact.base_pitch - ahead  # to the pitch point, of the ends of the next contact line
    places = [jnp.minimum(-nearest, contact.start), jnp.maximum(nearest, contact.end)]
    return fewest, closing(contacts(pair, contact, jnp.stack(places, axis=1)))


def _covering(farthest: Any) -> Any:
    """The fewest pairs that reach so many base pitches to either side of the pitch point, of Python or JAX."""
    return -(-2 * farthest // 1)


def _half_overlap(pair: GearPair) -> Float[Array, ""]:
    """Distance on the path of contact between the end of the face and its middle [mm]."""
    return 0.5 * pair.face_width * jnp.abs(pair.path_slope)


def helical_slices(pair: GearPair) -> int:
    """Slices that show how the contact lines of a pair run over its flanks, one for spur gears.

    Contacts of neighbouring slices are at most a thirtieth of a base pitch apart on the path of contact, on faces that
    overlap up to three base pitches. A helix angle that is traced takes as many as an overlap ratio of one.
    """
    if pair.is_spur:
        return 1
    overlap = concrete(pair.overlap_ratio)
    wanted = _STEP * int(np.ceil(_PER_PITCH * (1.0 if overlap is None else float(overlap)) / _STEP))
    return min(wanted, _MOST_SLICES)


def closing(points: Contacts) -> Float[Array, "..."]:
    """Transmission error that closes the gaps of unmodified flanks, zero on the path of contact [um]."""
    return points.corner_gap / points.lever


def may_take_more(pair: GearPair, contact: PathOfContact, resolution: Resolution) -> bool:
    """Whether teeth that touch beyond the pairs of a resolution may be whole still, as far as it is known."""
    fewest = pairs_on_path(pair, contact)
    return fewest is not None and resolution.chosen_pairs < fewest + _MORE_PAIRS


def pairs_on_path(pair: GearPair, contact: PathOfContact) -> int | None:
    """The fewest pairs whose contact lines cover the path of contact over the face; None where that is not known."""
    known = _path_over_face(pair, contact)
    return None if known is None else max(int(_covering(max(known[1], -known[0]))), _FEWEST_PAIRS)


def check_cover(pair: GearPair, contact: PathOfContact, resolution: Resolution) -> None:
    """Refuses a path of contact that the pairs of a resolution do not cover, as far as it is known.

    Raises:
        ValueError: naming the number of pairs that does.
    """
    known, needed = _path_over_face(pair, contact), pairs_on_path(pair, contact)
    if known is not None and needed is not None and needed > resolution.chosen_pairs:
        start, end = known
        raise ValueError(
            f"Resolution: pairs = {resolution.pairs} must be at least {needed}: the path of contact reaches from "
            f"{start:.3g} to {end:.3g} base pitches around the pitch point"
        )


def _path_over_face(pair: GearPair, contact: PathOfContact) -> tuple[float, float] | None:
    """Ends of the path of contact that a contact line runs over while any of it is on the face [base pitches]."""
    ahead = 0.0 if pair.is_spur else _half_overlap(pair)
    start, end, pitch, more = map(concrete, (contact.start, contact.end, contact.base_pitch, ahead))
    if start is None or end is None or pitch is None or more is None:
        return None
    return float(((start - more) / pitch).min()), float(((end + more) / pitch).max())
