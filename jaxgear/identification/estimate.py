"""Identification of flanks from a measured transmission error: named unknowns with their uncertainty."""

from collections.abc import Mapping, Sequence
from math import lcm
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy  # its packages load when they are used
from jaxtyping import Array, Bool, Float

from ..conditions import Design, Variants, call_with, conditions, solve_case, two_modifications
from ..conditions.join import side_by_side
from ..contact import Mesh, removed_material
from ..contact.solve import check_alike
from ..contact.status import Status
from ..geometry import GearPair
from ..numerics import Checked, check, program, result, solve_dense, whole
from ..revolution import Teeth
from ..revolution.solve import GEARS, GearName, displaced, pairs_in_window
from .measurement import ORDERS, Data, Measurement, errors_of, joined

Scalar = Float[Array, ""]
Rows = Float[Array, " rows"]
Vector = Float[Array, " unknowns"]
Prior = Mapping[str, tuple[float, float]]
Pitches = tuple[float | None, float | None]

TORQUE_SCALE, OFFSET = "torque_scale", "offset"  # unknowns of the test rig
_BOTH = 2**0.5  # the error alike at all torques and that of each add up in squares
_SIZES = 10.0 ** np.arange(-2.0, 3.01, 0.25)  # of the error of the model that are looked at, relative to the noise
_TOLD = 1.0  # least singular value of what the data say more about than the prior
_NAMED = 0.3  # least share in a combination that is named
_CHIEFLY = 0.5  # share of pitch deviations, in squares, in a combination that is theirs
_DAMPING = 100.0  # of the first step, which prior deviations measure
_SETTLED = 0.05  # largest move at the end, in prior standard deviations
_LAST = 1e-9  # move that ends the search
_ROUND_OFF = 1e-9
_SAME = 4  # decimals of phases that are one
_EQUAL = None, None  # teeth of both gears
_OF_NOISE = 2 * (-np.log(0.05)) ** 0.5  # 95 % of amplitudes by Rayleigh's law, over noise and root of the readings


class Identified(Checked):
    """Estimates of the unknowns from data and prior, with their uncertainty.

    Attributes:
        names: names of the unknowns: those of the design, "torque_scale" and "offset" if unknown, then single pitch
            deviations, "pinion_pitch_0" ..., of which one fewer than the teeth of each gear is independent.
        own: number of unknowns before the pitch deviations.
        estimate: most probable values of the unknowns, in their units, shape (unknowns,).
        deviation: standard deviations of the unknowns, error of the model included, shape (unknowns,).
        correlation: correlation matrix of the unknowns, shape (unknowns, unknowns).
        prior: mean and standard deviation before the data, shape (2, unknowns).
        singular_values: singular values of the Jacobian in descending order, with rows divided by noise and error of
            the model and columns in prior standard deviations. Below 1 the prior determines more than the data.
        directions: right singular vectors, one per row.
        torque, phase: torque [N m] and phase [base pitches] of the readings averaged per position.
        measured, fitted: measured and fitted transmission error of these readings [um].
        noise: standard deviation of these readings [um].
        model_error: standard deviation of the error of the mean transmission error by the model at the largest torque
            [um].
        chi_square: square of the residual weighted by noise alone, per degree of freedom; about 1 if the model is as
            accurate as the data.
        converged: True if the steps have converged and all contact solutions have converged.
        candidates: further torques [N m], shape (candidates,).
        candidate_singular_values: singular values of the data together with each further torque, shape (candidates,
            independent unknowns).
    """

    names: tuple[str, ...] = eqx.field(static=True)
    own: int = eqx.field(static=True)
    estimate: Vector = result()
    deviation: Vector = result()
    correlation: Float[Array, "unknowns unknowns"] = result()
    prior: Float[Array, "2 unknowns"] = result()
    singular_values: Float[Array, " independent"] = result()
    directions: Float[Array, "independent unknowns"] = result()
    torque: Rows = result("N m")
    phase: Rows = result("base pitches")
    measured: Rows = result("um")
    fitted: Rows = result("um")
    noise: Rows = result("um")
    model_error: Scalar = result("um")
    chi_square: Scalar = result()
    converged: Bool[Array, ""] = result()
    candidates: Float[Array, " candidates"] = result("N m")
    candidate_singular_values: Float[Array, "candidates independent"] = result()

    @property
    def best_candidate(self) -> float | None:
        """Further torque that best determines the least determined combination [N m]; None without candidates."""
        least = np.asarray(self.candidate_singular_values)[:, -1:]
        return float(self.candidates[int(np.argmax(least))]) if len(least) else None

    @property
    def parameters(self) -> dict[str, Scalar]:
        """Estimates by name without pitch deviations, the arguments of the design."""
        return dict(zip(self.names, self.estimate[: self.own]))

    def undetermined(self) -> list[str]:
        """Lines on combinations of unknowns that the prior determines more than the data."""
        lines, values, directions = [], np.asarray(self.singular_values), np.asarray(self.directions)
        of_pitch = np.sum(directions[:, self.own :] ** 2, axis=1) > _CHIEFLY
        for value, direction in zip(values[~of_pitch], directions[~of_pitch]):
            if value < _TOLD:
                least = min(_NAMED, np.max(np.abs(direction)))
                chief = [(share, name) for share, name in zip(direction, self.names) if abs(share) >= least]
                sign = np.sign(chief[0][0])
                words = " ".join(f"{'+' if sign * share > 0 else '-'} {name}" for share, name in chief)
                left = 1 / np.sqrt(1 + value**2)
                what = "cannot be told" if len(chief) < 2 else "cannot be told apart"
                lines.append(f"{words.removeprefix('+ ')} {what}: {left:.0%} of the prior deviation is left")
        if unseen := np.sum(values[of_pitch] < _TOLD):
            lines.append(
                f"{unseen} combinations of {len(self.names) - self.own} pitch deviations cannot be told: of two teeth "
                "that meet their sum alone is seen, until all have met"
            )
        return lines

    @property
    def single_pitch(self) -> dict[GearName, tuple[Vector, Vector]]:
        """Single pitch deviations and their standard deviations [um] by gear, for gears with unknown pitches."""
        found = {}
        for gear in GEARS:
            at = np.array([place for place, name in enumerate(self.names[self.own :]) if name.startswith(gear)], int)
            if len(at):
                found[gear] = self.estimate[self.own + at], self.deviation[self.own + at]
        return found

    @property
    def torques(self) -> Float[np.ndarray, " torques"]:
        """Torques of the readings, ascending [N m]."""
        return np.unique(np.asarray(self.torque))

    @property
    def residual_orders(self) -> Float[np.ndarray, "torques orders"]:
        """Amplitudes of the mesh orders 1, 2 ... of the residual of the fit [um], shape (torques, orders).

        They are least-squares estimates; the readings of every torque limit the number of orders, 8 at most.
        """
        every, left = self._rows_of_torques(), np.asarray(self.measured - self.fitted)
        places = min(len(np.unique(np.round(np.asarray(self.phase)[rows] % 1, _SAME))) for rows in every)
        orders = np.arange(1, max(1, min(ORDERS, (places - 1) // 2)) + 1)
        found = []
        for rows in every:
            angle = 2 * np.pi * np.outer(np.asarray(self.phase)[rows], orders)
            waves = np.concatenate([np.ones((len(rows), 1)), np.cos(angle), np.sin(angle)], axis=1)
            cosine, sine = np.split(np.linalg.lstsq(waves, left[rows])[0][1:], 2)
            found.append(np.hypot(cosine, sine))
        return np.asarray(found)

    @property
    def noise_orders(self) -> Float[np.ndarray, " torques"]:
        """95 % quantile of the amplitude of a mesh order due to noise alone [um], shape (torques,)."""
        mean = [
            np.sqrt(np.mean(np.square(np.asarray(self.noise)[rows])) / len(rows)) for rows in self._rows_of_torques()
        ]
        return _OF_NOISE * np.asarray(mean)

    def _rows_of_torques(self) -> list[np.ndarray]:
        return [np.flatnonzero(np.asarray(self.torque) == torque) for torque in self.torques]


class _Problem(eqx.Module):
    """Unknowns of a fit and the model that depends on them.

    Attributes:
        names: names of the unknowns.
        own: number of unknowns, the first ones, that are not pitch deviations.
        turn: matrix from independent unknowns to all, both in prior deviations; of the pitch deviations of a gear one
            less is independent than there are teeth.
        gaps: separation of the pairs of every window per unit of each independent pitch deviation [um].
        least_error: least size of the shapes of the error of the model.
    """

    design: Design
    names: tuple[str, ...] = eqx.field(static=True)
    own: int = eqx.field(static=True)
    mesh: Mesh
    mean: Vector
    spread: Vector
    turn: Float[Array, "unknowns independent"]
    gaps: Float[Array, "windows pairs pitches"]
    least_error: Scalar

    def curves(
        self, own: Vector, apart: Float[Array, "windows pairs"], shift: Array, torques: Array
    ) -> tuple[Array, Bool[Array, ""]]:
        """Transmission error over the places of all windows, a row per torque."""
        given = dict(zip(self.names, self.mean[: self.own] + self.spread[: self.own] * own))
        pinion, wheel = two_modifications(call_with("design", self.design, given))
        scale, offset = given.get(TORQUE_SCALE, jnp.ones_like(own[0])), given.get(OFFSET, jnp.zeros_like(own[0]))

        def at(torque: Scalar):
            removed = removed_material(self.mesh, torque * scale, pinion=pinion, wheel=wheel)

            def window(gap: Array):
                cycle, status = displaced(self.mesh, torque * scale, removed, gap + jnp.pad(shift, 1))
                return cycle.transmission_error + offset, status == Status.CONVERGED

            # whole batches only: a rest would be a program of its own
            size = min(side_by_side(self.mesh), len(apart))
            whole = jnp.pad(apart, ((0, -len(apart) % size), (0, 0)), mode="edge")
            found, fine = jax.lax.map(window, whole, batch_size=size)
            return found[: len(apart)].ravel(), jnp.all(fine)

        found, fine = jax.vmap(at)(torques)
        return found, jnp.all(fine)

    def jacobian(self, z: Vector, data: Data) -> tuple[Array, Rows, Bool[Array, ""]]:
        """Slopes by the independent unknowns, values at the readings, and whether all contacts converged.

        A window sees its own pairs alone: what they do to it when they are displaced, alike in all windows at once,
        gives the slopes by the pitch deviations of all teeth.
        """
        own, pitch = jnp.split(z, [self.own])
        apart, shift = self.gaps @ pitch, jnp.zeros(self.mesh.resolution.chosen_pairs, z.dtype)

        def twice(of):
            values, fine = self.curves(of[0], apart, of[1], data.torques)
            return values, (values, fine)

        (slopes, by_pair), (values, fine) = jax.jacfwd(twice, has_aux=True)((own, shift))
        by_pair = by_pair.reshape(len(by_pair), len(apart), -1, len(shift))
        by_pitch = jnp.einsum("twpk,wku->twpu", by_pair, self.gaps[:, 1:-1]).reshape(*slopes.shape[:2], len(pitch))
        return data.at(jnp.concatenate([slopes, by_pitch], axis=-1)), data.at(values), fine


class _Fit(NamedTuple):
    z: Vector  # the estimates, from the prior means in prior standard deviations
    covariance: Array
    singular: Vector
    directions: Array
    values: Rows
    size: Scalar  # of the shapes of the error of the model
    fine: Bool[Array, ""]


def _directions(slopes: Float[Array, "sums unknowns"]) -> tuple[Vector, Float[Array, "unknowns unknowns"]]:
    """Singular values and right singular vectors, of as many as there are unknowns."""
    missing = max(slopes.shape[1] - slopes.shape[0], 0)
    _, singular, directions = jnp.linalg.svd(jnp.pad(slopes, ((0, missing), (0, 0))), full_matrices=False)
    return singular, directions


@program
def _fit(problem: _Problem, data: Data, steps: int) -> _Fit:
    """Gauss-Newton with Levenberg's damping; the size of the error of the model is a mean by probability.

    Where the search begins the error would explain what the unknowns do: it keeps its least size until they settle.
    """
    errors = errors_of(data)
    sizes = jnp.asarray(_SIZES, data.value.dtype) * jnp.mean(data.noise)
    count = problem.turn.shape[1]
    unit = jnp.eye(count, dtype=data.value.dtype)

    def judged(z: Vector, slopes: Array, known: Bool[Array, ""], *values: Rows) -> tuple[Scalar, Array]:
        """Size of the error of the model, and products of slopes and of what all values leave."""
        products = errors.products(jnp.stack([*slopes.T, *(data.value - each for each in values)], axis=1))
        weight = jax.nn.softmax(jax.vmap(lambda size: errors.evidence(size, products(size), z))(sizes))
        size = jnp.sqrt(jnp.where(known, weight @ sizes**2, 0.0) + problem.least_error**2)
        return size, products(size)

    def step(state):
        number, _, known, z, slopes, values, damping, move = state
        new_slopes, new_values, fine = problem.jacobian(z + move, data)
        _, product = judged(z, slopes, known, values, new_values)
        old, new = product[count, count] + z @ z, product[count + 1, count + 1] + (z + move) @ (z + move)
        better = fine & ((number == 0) | (new <= old * (1 + _ROUND_OFF)))  # at first nothing is known
        z = jnp.where(better, z + move, z)
        slopes, values = jnp.where(better, new_slopes, slopes), jnp.where(better, new_values, values)
        damping = jnp.clip(jnp.where(better, 0.1 * damping, 10 * damping), 1e-3, 1e6)
        settled = better & (number > 0) & (jnp.max(jnp.abs(move)) < _SETTLED)
        known = known | settled | (number >= steps // 2)
        _, product = judged(z, slopes, known, values)
        move = solve_dense(product[:count, :count] + (1 + damping) * unit, product[:count, count] - z)
        return number + 1, better, known, z, slopes, values, damping, move

    z = jnp.zeros(count, data.value.dtype)
    slopes = jnp.zeros((data.value.shape[0], count), z.dtype)
    no, yes = jnp.asarray(False), jnp.asarray(True)
    start = (0, no, no, z, slopes, jnp.zeros_like(data.value), jnp.asarray(_DAMPING, z.dtype), z)

    def goes_on(state):
        number, better, known, *_, move = state
        return (number < steps) & (~known | ~better | (jnp.max(jnp.abs(move)) > _LAST))

    _, _, _, z, slopes, values, _, move = jax.lax.while_loop(goes_on, step, start)
    fine = jnp.any(slopes != 0) & (jnp.max(jnp.abs(move)) < _SETTLED)
    size, product = judged(z, slopes, yes, values)
    covariance = solve_dense(product[:count, :count] + unit, unit)
    return _Fit(z, covariance, *_directions(errors.whitened(size, slopes)), values, size, fine)


@program
def _further(problem: _Problem, z: Vector, data: Data, size: Scalar, candidate: Scalar) -> Vector:
    """Singular values with a further torque, read at every position of the mesh with the noise of the data."""
    torques, windows = jnp.append(data.torques, candidate), len(problem.gaps)
    phase = jnp.tile(problem.mesh.phase.astype(data.phase.dtype), windows)
    places = jnp.arange(len(phase))
    level = jnp.full(phase.shape, data.torques.shape[0])
    noise = jnp.full_like(phase, jnp.mean(data.noise))
    zero = jnp.zeros_like(phase)
    every = Data(torques, level, places, places, zero, phase, zero, noise)
    more = jax.tree.map(lambda *parts: jnp.concatenate(parts), data, every)
    more = eqx.tree_at(lambda of: of.torques, more, torques)
    slopes, _, _ = problem.jacobian(z, more)
    grown = size * jnp.max(torques) / jnp.max(data.torques)  # the shapes are those at the largest torque
    return _directions(errors_of(more).whitened(grown, slopes))[0]


def identify(
    mesh: Mesh,
    measurement: Measurement,
    design: Design,
    prior: Prior,
    *,
    torque_scale: float | None = 0.01,
    offset: float | None = None,
    single_pitch: Pitches | None = None,
    model_error: float = 0.02,
    candidates: Sequence[float] = (),
    steps: int = 50,
) -> Identified:
    """Identify the unknowns of a design from a measured transmission error.

    The result is the most probable value of each unknown under Gaussian priors and noise, by Gauss-Newton steps with
    exact derivatives through the contact solution. The model has an error: smooth curves over the phase, proportional
    to the torque, partly equal for all torques. Its size combines `model_error` and, added in squares, a mean over
    sizes weighted by the probability of the data; it widens the standard deviations (M. C. Kennedy, A. O'Hagan,
    Bayesian calibration of computer models, J. R. Stat. Soc. B 63, 2001).

    Args:
        mesh: prepared mesh.
        measurement: measured transmission error.
        design: function that returns (pinion, wheel) modifications from the named unknowns.
        prior: mean and standard deviation of every unknown in its unit, for instance from the tolerance class.
        torque_scale: standard deviation of the ratio of true to measured torque; None for an exact torque.
        offset: standard deviation of an offset added to every reading [um]; None for absolute readings.
        single_pitch: standard deviations of the single pitch deviations of pinion and wheel [um], see
            `TeethDeviations`; None for equal teeth of one gear or both. With pitch deviations, `offset` must be
            unknown, and the mesh position of a reading identifies the teeth: pair n is tooth n mod z1 on tooth n mod
            z2.
        model_error: relative standard deviation of the error of the mean deflection; 0.02 is the error of the default
            structure against finite elements. An error visible in the residual is added.
        candidates: further torques that could be measured [N m].
        steps: largest number of steps.

    Raises:
        ValueError: for a prior that is not positive, an unknown without effect, no noise without repeated readings, or
            pitch deviations without an offset.
        TypeError: if the mesh is not a prepared mesh.
    """
    check("model_error", model_error, "", low=0.0, high=1.0)
    whole("steps", steps, low=1)
    for torque in candidates:
        check("candidates", torque, "N m", low=0.0, open_low=True)
    problem, data = _posed(mesh, measurement, design, prior, torque_scale, offset, single_pitch, model_error)
    found = _fit(problem, data, steps)
    z = found.z
    more = [_further(problem, z, data, found.size, jnp.asarray(torque, z.dtype)) for torque in candidates]
    told = jnp.stack(more) if more else jnp.zeros((0, len(z)), z.dtype)
    return _found(problem, data, found, jnp.asarray(candidates, z.dtype), told)


def _posed(
    mesh: Mesh,
    measurement: Measurement,
    design: Design,
    prior: Prior,
    scale: float | None,
    offset: float | None,
    single_pitch: Pitches | None,
    model_error: float,
) -> tuple[_Problem, Data]:
    check_alike(mesh)
    if not prior:
        raise ValueError("prior must name at least one unknown")
    every = dict(prior)
    for name, middle, known in ((TORQUE_SCALE, 1.0, scale), (OFFSET, 0.0, offset)):
        if name in prior:
            raise ValueError(f"prior names {name}, give {name} = its standard deviation")
        if known is not None:
            every[name] = (middle, known)
    for name, (middle, known) in every.items():
        check(f"prior mean of {name}", middle, "")
        check(f"prior standard deviation of {name}", known, "", low=0.0, open_low=True)
    period, own, spreads = period_of(measurement, mesh.pair, single_pitch, offset), len(every), single_pitch or _EQUAL
    counts = Teeth().counts_of(mesh.pair)
    for gear, count, known in zip(GEARS, counts, spreads):
        if known is not None:
            pitches = {f"{gear}_pitch_{tooth}": (0.0, known) for tooth in range(count)}
            if taken := pitches.keys() & every.keys():
                raise ValueError(f"prior names {min(taken)}, a pitch deviation: choose another name")
            every |= pitches
    data, windows = joined(measurement, mesh, period)
    mean, spread = (jnp.asarray([known[end] for known in every.values()], data.value.dtype) for end in (0, 1))
    _check_used(design, prior, mesh, float(np.min(np.asarray(measurement.torque))))
    cycle = solve_case(mesh, data.torques[-1], *two_modifications(design(dict(zip(prior, mean)))))
    deflection = jnp.mean(cycle.transmission_error - cycle.unloaded_transmission_error)
    differ = [_closed(count) for count, known in zip(counts, spreads) if known is not None]
    turn = scipy.linalg.block_diag(np.eye(own), *differ)
    gaps = _gaps(mesh, windows, counts, spreads)
    least = model_error * deflection / _BOTH
    return _Problem(design, tuple(every), own, mesh, mean, spread, jnp.asarray(turn, spread.dtype), gaps, least), data


def period_of(measurement: Measurement, pair: GearPair, single_pitch: Pitches | None, offset: float | None) -> int:
    """Number of base pitches after which teeth with unknown pitch deviations meet again; 1 for equal teeth.

    Raises:
        ValueError: for standard deviations that are not positive, no unknown offset, or readings of one base pitch.
    """
    if single_pitch is None:
        return 1
    for gear, known in zip(GEARS, single_pitch):
        if known is not None:
            check(f"single_pitch of the {gear}", known, "um", low=0.0, open_low=True)
    if offset is None:
        raise ValueError("offset must be unknown with pitch deviations, no tooth is the right one")
    covered = float(np.ptp(np.asarray(measurement.phase)))
    if covered <= 1:
        raise ValueError(f"phase covers {covered:.2g} base pitches, pitch deviations need whole revolutions")
    return lcm(*(count for count, known in zip(Teeth().counts_of(pair), single_pitch) if known is not None))


def _closed(teeth: int) -> Float[np.ndarray, "teeth independent"]:
    """Single pitch deviations that close around the gear, from one less that are independent; orthonormal."""
    return np.linalg.qr(np.eye(teeth) - 1 / teeth)[0][:, :-1]


def _gaps(mesh: Mesh, windows: np.ndarray, counts: Sequence[int], spreads: Sequence[float | None]) -> Array:
    """Gaps of `_Problem`: cumulative pitch deviations, around their mean, of both teeth of every pair."""
    numbers = windows[:, None] + pairs_in_window(mesh.resolution)
    found = [jnp.zeros((*numbers.shape, 0), mesh.slice_width.dtype)]
    for gear, count, spread in zip(mesh.pair.gears, counts, spreads):
        if spread is not None:
            total = np.cumsum(_closed(count), axis=0)
            around = jnp.asarray(spread * (total - total.mean(axis=0)), found[0].dtype)
            found.append(around[numbers % count] * jnp.cos(gear.transverse_pressure_angle).astype(around.dtype))
    return jnp.concatenate(found, axis=-1)


def _check_used(design: Design, prior: Prior, mesh: Mesh, torque: float) -> None:
    cases = conditions(mesh, torque)
    means = [np.asarray(mean, float) for mean, _ in prior.values()]
    Variants(tuple(prior), design, mesh, None, cases, cases.on(mesh)).traced(means)


def _found(problem: _Problem, data: Data, fit: _Fit, candidates: Array, candidate_singular_values: Array) -> Identified:
    turn = problem.turn
    covariance = turn @ fit.covariance @ turn.T
    deviation = jnp.sqrt(jnp.diagonal(covariance))
    told = jnp.sum(fit.singular**2 / (1 + fit.singular**2))
    weighted = jnp.sum(((data.value - fit.values) / data.noise) ** 2)
    return Identified(
        names=problem.names,
        own=problem.own,
        estimate=problem.mean + problem.spread * (turn @ fit.z),
        deviation=problem.spread * deviation,
        correlation=covariance / (deviation[:, None] * deviation[None, :]),
        prior=jnp.stack([problem.mean, problem.spread * jnp.linalg.norm(turn, axis=1)]),
        singular_values=fit.singular,
        directions=fit.directions @ turn.T,
        torque=data.torques[data.level],
        phase=data.phase,
        measured=data.value,
        fitted=fit.values,
        noise=data.noise,
        model_error=_BOTH * fit.size,
        chi_square=weighted / jnp.maximum(data.value.shape[0] - told, 1.0),
        converged=fit.fine,
        candidates=candidates,
        candidate_singular_values=candidate_singular_values,
    )
