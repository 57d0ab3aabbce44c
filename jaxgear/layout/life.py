"""Damage and life under a duty cycle by the load over the face, and the flank line with the longest life.

Palmgren and Miner: every cycle at a stress takes 1 / N of a life, N = N_0 (sigma_0 / sigma)^p, and the shares add up.
Stresses are those at the most loaded place of the face, so the largest line load of every load is taken to meet the
same place: the damage is on the safe side where they are at different ends.

References:
    ISO 6336-6 (load spectra); ISO 6336-2 and -3 for the nominal stresses; U. Kissling's three-step layout
    of modifications, on flank lines for the longest life under a load spectrum.

The shafts bend differently under every load, so that no flank line levels all of them; the one sought is that of the
smallest damage sum.
"""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import scipy  # its packages load when they are used
from jaxtyping import Array, Float, Int8

from ..conditions import LoadSpectrum
from ..contact.status import Status, WithStatus, reason, status_of
from ..geometry import GearPair, path_of_contact
from ..metrics.safety import Mode, Strength, damage_per_cycle
from ..metrics.stress import nominal_stress_squares, single_contact_root_stress
from ..numerics import Checked, Numbers, concrete, kernel, maximum, program, real, result, whole
from ..shafts import AbstractSupport, FaceLoad, annex_e, face_load_factor, root_face_load_factor, tooth_height
from .flank_line import STATIONS, FlankLine, Stations, at_stations, level_load

Scalar = Float[Array, ""]
Torques = Float[Array, " torques"]
OfGears = Float[Array, "gears torques"]


class Damage(WithStatus, Checked):
    """Damage under a duty cycle, 1 for a life that is used up; axes (gears, torques), pinion first.

    Attributes:
        pitting, bending: damage that every load does.
        contact_stress, root_stress: of both gears at every torque.
        face_load_factor: K_Hbeta at every torque.
        status: of the load over the face at every torque; where it has not converged, its numbers are NaN, and with
            them every sum. Without torque there is nothing to find.
        duration: of the duty cycle; None where it has none: the damage is that of one revolution of the pinion.
    """

    pitting: OfGears = result()
    bending: OfGears = result()
    contact_stress: OfGears = result("MPa")
    root_stress: OfGears = result("MPa")
    face_load_factor: Torques = result()
    status: Int8[Array, " torques"] = result()
    duration: Scalar | None = result("h")

    @property
    def total(self) -> Float[Array, "modes gears"]:
        """Damage sums, pitting first."""
        return jnp.stack([jnp.sum(self.pitting, axis=-1), jnp.sum(self.bending, axis=-1)])

    @property
    def largest(self) -> Scalar:
        """Largest damage sum of both gears and both ways to fail."""
        return maximum(self.total)

    @property
    def life(self) -> Scalar:
        """Hours until the largest damage sum is 1; without a duration the revolutions of the pinion. Infinite without
        damage, NaN where a load has not been found."""
        return self._until(self.largest)

    @property
    def gear_lives(self) -> Float[Array, " gears"]:
        """`life` of pinion and wheel."""
        return self._until(maximum(self.total, axis=0))

    def _until(self, worst):
        lasts, none = 1.0 if self.duration is None else self.duration, worst == 0
        return jnp.where(none, jnp.inf, lasts / jnp.where(none, 1.0, worst))


def damage(
    support: AbstractSupport,
    load: LoadSpectrum,
    strength: Strength,
    *,
    pinion: FlankLine | None = None,
    wheel: FlankLine | None = None,
    stations: int = STATIONS,
) -> Damage:
    """Damage of both gears under a duty cycle, K_Hbeta of every load by the one-dimensional analysis.

    Stresses are those of `metrics.nominal_contact_stress` with K_Hbeta and of `metrics.nominal_root_stress` with
    K_Fbeta. Dynamic and application factors are the `load_factor` of the strength.
    Differentiable in everything.

    Args:
        support: shafts at the mesh; couplings are scaled to every torque.
        load: torques on the pinion with speeds and duration, `LoadSpectrum.from_hours`. Without a duration the weights
            are shares of the revolutions and the damage is that of one revolution.
        strength: of both gears, with the S-N curves of pitting and bending.
        pinion, wheel: flank lines; None for none.
        stations: over the face.

    Raises:
        ValueError: for a duration without speeds, and a strength without an S-N curve.
    """
    whole("stations", stations, 3, 1001)
    found = under_loads(support, load.torques, stations)
    return damage_of(found, load, strength, pinion or FlankLine(), wheel or FlankLine())


@program
def under_loads(support: AbstractSupport, torques: Torques, stations: int) -> Stations:
    """A support under several torques, with a leading axis (torques,)."""
    return jax.vmap(lambda torque: at_stations(support, torque, stations=stations))(torques)


def _face_loads(faces: Stations, pinion: FlankLine, wheel: FlankLine) -> FaceLoad:
    """Load over the face of every support, with a leading axis."""

    def at(face):
        return annex_e(
            face, torque=face.torque, pinion=pinion.modification, wheel=wheel.modification, stations=face.count
        )

    return jax.vmap(at)(faces)


@program
def damage_of(faces: Stations, load: LoadSpectrum, strength: Strength, pinion: FlankLine, wheel: FlankLine) -> Damage:
    """`damage` of supports that are worked out."""
    found = _face_loads(faces, pinion, wheel)
    pair = jax.tree.map(lambda leaf: leaf[0], faces.pair)
    loaded = Loaded(maximum(found.line_load, axis=-1), face_load_factor(found.line_load), found.status)
    return summed(pair, loaded, load, strength)


def gear_lives(
    pair: GearPair, load: LoadSpectrum, strength: Strength, factors: Numbers
) -> Float[Array, "variants gears"]:
    """`Damage.gear_lives` of pinion and wheel where one face load factor stands for every load.

    Args:
        pair: the gears.
        load, strength: as for `damage`.
        factors: K_Hbeta, such as that of the loaded tooth contact at one torque, shape (variants,).
    """
    return _gear_lives(pair, load, strength, real(factors))


@program
def _gear_lives(pair: GearPair, load: LoadSpectrum, strength: Strength, factors):
    mean = 1e3 * load.torques / (pair.pinion.base_radius * pair.face_width)

    def lives(factor):
        every = jnp.full_like(mean, factor)
        return summed(
            pair, Loaded(factor * mean, every, status_of({Status.NOT_CONVERGED: ~jnp.isfinite(every)})), load, strength
        ).gear_lives

    return jax.vmap(lives)(factors)


class Loaded(NamedTuple):
    """The load over the face at every torque.

    Attributes:
        largest: line load [N/mm].
        factor: K_Hbeta.
        status: of each.
    """

    largest: Torques
    factor: Torques
    status: Int8[Array, " torques"]


def summed(pair: GearPair, found: Loaded, load: LoadSpectrum, strength: Strength) -> Damage:
    """The damage of loads over the face."""
    # without torque teeth carry nothing, whether the place of the shafts has been found or not
    carries = load.torques > 0
    largest, factor = jnp.where(carries, found.largest, 0.0), jnp.where(carries, found.factor, 1.0)
    path = path_of_contact(pair)
    contact, root = nominal_stress_squares(pair, path), single_contact_root_stress(pair, path)
    mean = largest / factor
    # K_Fbeta of an even load; below 1 is rounding
    bent = mean * root_face_load_factor(jnp.maximum(factor, 1.0), pair.face_width, tooth_height(pair))
    turns = load.turns()
    cycles = turns, turns / pair.gear_ratio
    loaded = largest != 0
    # the root has no derivative at zero load
    stresses = [jnp.where(loaded, jnp.sqrt(jnp.where(loaded, largest * hertz, 1.0)), 0.0) for hertz in contact]
    bending = [bent * share for share in root]

    def of(name: Mode, stresses) -> OfGears:
        shares = damage_per_cycle(strength, name, tuple(stresses))
        # a load that is never run does nothing, even where it has not been found
        return jnp.stack([jnp.where(run > 0, run * each, 0.0) for run, each in zip(cycles, shares)])

    return Damage(
        of("pitting", stresses),
        of("bending", bending),
        jnp.stack(stresses),
        jnp.stack(bending),
        found.factor,
        jnp.where(carries, found.status, jnp.int8(Status.CONVERGED)),
        load.duration,
    )


# Exponents of the mean that stands for the largest line load: from one that most of the face has a say in to one that
# is 2 % below the largest. The search ends on the largest line load itself.
_SHARPNESS = (16.0, 64.0, 256.0)
_FIRST_STEP = 0.5  # um, of the last search
_PRECISION = 1e-4  # um
_NONE = 1e-300  # damage whose logarithm still exists


def longest_life(
    support: AbstractSupport,
    load: LoadSpectrum,
    strength: Strength,
    *,
    negative_crowning: bool = False,
    stations: int = STATIONS,
) -> FlankLine:
    """The flank line of the smallest damage sum under a duty cycle, of both gears and of pitting and bending.

    The largest line load of every load has a kink where it goes from one end of the face to the other. So the search
    follows the gradient of the damage of a high mean of the line load (L-BFGS-B), from the flank line that levels the
    load which does most damage, and ends with a simplex on the damage itself. While the whole face carries, the damage
    is convex in both amounts.

    Args:
        support: shafts at the mesh; couplings are scaled to every torque.
        load, strength, stations: as for `damage`.
        negative_crowning: whether the crowning may be negative.

    Returns:
        the flank line over the common face, of numbers: what it is made of has no derivatives, the damage with it has.

    Raises:
        ValueError: as `damage` does, for torques that are all zero, numbers that are being traced, and a torque whose
            load over the face is not found.
    """
    if any(concrete(leaf) is None for leaf in jax.tree.leaves((support, load, strength))):
        raise ValueError("longest_life searches with numbers, not inside of a traced function; `damage` can be traced")
    if not float(jnp.max(jnp.where(load.weights > 0, load.torques, 0.0))) > 0:
        raise ValueError("torques are all zero; every flank line has an infinite life")
    faces = under_loads(support, load.torques, stations)
    unmodified = damage(support, load, strength, stations=stations)
    missed = np.asarray(load.torques)[~np.asarray(unmodified.converged)]
    if len(missed):
        raise ValueError(
            f"the load over the face at {float(missed[0]):g} N m did not converge, "
            f"{reason(unmodified.status)}: do the loads leave a shaft loose in its clearances?"
        )
    worst = int(np.argmax(np.sum(unmodified.pitting, axis=0)))
    heaviest = jax.tree.map(lambda leaf: leaf[worst], faces)
    start = level_load(heaviest, negative_crowning=negative_crowning, stations=stations)
    point = np.array([float(start.slope), float(start.crowning)])
    bounds = [(None, None), (None if negative_crowning else 0.0, None)]
    for sharpness in _SHARPNESS:

        def soft(at, sharpness=sharpness):
            value, slope = _soft_damage(faces, load, strength, jnp.asarray(at), jnp.asarray(sharpness))
            return float(value), np.asarray(slope)

        point = scipy.optimize.minimize(soft, point, jac=True, method="L-BFGS-B", bounds=bounds).x

    pair = support.pair

    def true(at):
        found = damage_of(faces, load, strength, FlankLine(), FlankLine(*at).on(pair, "wheel"))
        return math.log(max(float(found.largest), _NONE))

    corners = np.stack([point, point + [_FIRST_STEP, 0.0], point + [0.0, _FIRST_STEP]])
    options = {"initial_simplex": corners, "xatol": _PRECISION, "fatol": 1e-9}
    found = scipy.optimize.minimize(true, point, method="Nelder-Mead", bounds=bounds, options=options)
    return FlankLine(*found.x)


@kernel
def _soft_damage(faces: Stations, load: LoadSpectrum, strength, at: Float[Array, "2"], sharpness):
    """Logarithm of the damage by a mean of the line load that is close to the largest, and its gradient."""
    pair = jax.tree.map(lambda leaf: leaf[0], faces.pair)

    def of(at) -> Float[Array, ""]:
        found = _face_loads(faces, FlankLine(), FlankLine(at[0], at[1]).on(pair, "wheel"))
        mean = jnp.mean(found.line_load, axis=-1)
        loaded = mean > 0
        share = found.line_load / jnp.where(loaded, mean, 1.0)[:, None]
        # powers relative to the largest do not overflow
        top = jax.lax.stop_gradient(jnp.max(share, axis=-1))
        factor = top * jnp.mean((share / jnp.where(loaded, top, 1.0)[:, None]) ** sharpness, axis=-1) ** (1 / sharpness)
        factor = jnp.where(loaded, factor, 1.0)
        made: Damage = summed(pair, Loaded(factor * mean, factor, found.status), load, strength)
        return jnp.log(jnp.maximum(maximum(made.total), _NONE))

    return jax.value_and_grad(of)(at)


def face_load_over_torques(
    support: AbstractSupport,
    torques: Numbers,
    *,
    pinion: FlankLine | None = None,
    wheel: FlankLine | None = None,
    stations: int = STATIONS,
) -> Float[Array, " torques"]:
    """K_Hbeta at several torques, without deviations.

    Args:
        support: shafts at the mesh; couplings are scaled to every torque, loads from outside stay.
        torques: on the pinion [N m], shape (torques,), all different.
        pinion, wheel: flank lines; None for none.
        stations: over the face.

    Raises:
        ValueError: for torques that are negative or repeated, and other numbers out of range.
    """
    whole("stations", stations, 2, 1001)
    faces = under_loads(support, LoadSpectrum(torques).torques, stations)
    return _factors(faces, pinion or FlankLine(), wheel or FlankLine())


@program
def _factors(faces: Stations, pinion: FlankLine, wheel: FlankLine) -> Float[Array, " torques"]:
    return face_load_factor(_face_loads(faces, pinion, wheel).line_load)
