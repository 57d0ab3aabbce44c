"""What flanks gave a measured transmission error: named unknowns with the uncertainty that the data leave."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..conditions import Design, Variants, conditions, solve_case, two_modifications
from ..contact import Mesh, Resolution
from ..contact.solve import check_mesh
from ..numerics import Checked, check, concrete, number, pivots, program, result, solve_dense, whole

Scalar = Float[Array, ""]
Rows = Float[Array, " rows"]
Vector = Float[Array, " unknowns"]
Prior = Mapping[str, tuple[float, float]]

TORQUE_SCALE, OFFSET = "torque_scale", "offset"  # unknowns of the test rig
LEAST_ROWS = 12  # of a measurement
_BOTH = 2**0.5  # the error alike at all torques and that of each add up in squares
_LARGEST_GAP = 0.25  # between neighbouring phases of one torque [base pitches]: the first three mesh orders are seen
# The error of the model: mesh orders of it, and its size relative to the noise that is looked at.
_ORDERS = 8
_SIZES = 10.0 ** np.arange(-2.0, 3.01, 0.25)
_TOLD = 1.0  # least singular value of what the data say more about than the prior
_NAMED = 0.3  # least share in a combination that is named
_DAMPING = 100.0  # of the first step, which prior deviations measure
_SETTLED = 0.05  # largest move at the end, in prior standard deviations
_ROUND_OFF = 1e-9
_OF_NOISE = 2 * (-np.log(0.05)) ** 0.5  # 95 % of amplitudes by Rayleigh's law, over noise and root of the readings
_NOTHING = 1e6  # noises between the data and what is not known


class Measurement(Checked):
    """A measured transmission error, a row per reading.

    Attributes:
        phase: mesh position; readings of several base pitches are folded into one.
        torque: on the pinion.
        transmission_error: along the line of action, positive when the wheel lags.
        noise: standard deviation of a reading; None for that of repeats, of readings of one torque within one mesh
            position.

    Raises:
        ValueError: for less than 12 readings, columns of different lengths, numbers that are not finite, or phases
            of a torque that leave more than a quarter of the base pitch out.
    """

    phase: Rows = number("base pitches", shape=("rows",))
    torque: Rows = number("N m", low=0.0, open_low=True, shape=("rows",))
    transmission_error: Rows = number("um", shape=("rows",))
    noise: Scalar | None = number("um", low=0.0, open_low=True, optional=True, default=None)

    def __check_init__(self) -> None:
        counts = {name: len(getattr(self, name)) for name in ("phase", "torque", "transmission_error")}
        if min(counts.values()) < LEAST_ROWS:
            raise ValueError(f"Measurement: phase has {counts['phase']} rows, must have {LEAST_ROWS} at least")
        if len(set(counts.values())) > 1:
            raise ValueError(f"Measurement: torque has {counts['torque']} rows, phase {counts['phase']}")
        phase, torque = np.asarray(self.phase) % 1, np.asarray(self.torque)
        for level in np.unique(torque):
            places = np.sort(phase[torque == level])
            gap = float(np.diff(places, append=places[0] + 1).max())
            if gap > _LARGEST_GAP:
                raise ValueError(
                    f"Measurement: phase does not cover a base pitch at {level:g} N m: {gap:.2g} of it are without a "
                    f"reading, must be {_LARGEST_GAP:g} at most"
                )

    def noise_on(self, resolution: Resolution) -> Scalar:
        """Standard deviation of a reading [um], given or of readings of one torque within one position of the mesh.

        Raises:
            ValueError: for none that is given and too few repeats, or repeats that are all alike.
        """
        return _noise(self, _bins(self, resolution.positions, float(np.asarray(resolution.first_phase))))


class _Data(eqx.Module):
    """Readings joined per torque and position of the mesh: what a compiled fit takes."""

    torques: Float[Array, " torques"]
    level: Array  # number of the torque of every row
    phase: Rows
    value: Rows
    noise: Rows


class Identified(Checked):
    """What the data say about the unknowns, besides the prior.

    Attributes:
        names: of the unknowns; those of the design, then "torque_scale" and "offset" where they are unknown.
        estimate: their most probable values, in their units.
        deviation: standard deviations, that of the error of the model included.
        correlation: of the unknowns, shape (unknowns, unknowns).
        prior: mean and standard deviation before the data, shape (2, unknowns).
        singular_values: of the Jacobian, rows divided by noise and error of the model, columns in prior standard
            deviations; descending. Below 1 the prior says more than the data.
        directions: the right singular vectors, a row for each.
        torque, phase: of the readings as joined per position.
        measured, fitted: transmission error of these.
        noise: standard deviation of these.
        model_error: standard deviation of the mean that the model misses at the largest torque.
        chi_square: weighted square of the residual by noise alone, per degree of freedom; about 1 where the model is
            as good as the data.
        converged: whether the steps ended and all contact solutions converged.
        candidates: further torques, shape (candidates,).
        told_by_candidates: singular values of the data together with each of them, shape (candidates, unknowns).
    """

    names: tuple[str, ...] = eqx.field(static=True)
    estimate: Vector = result()
    deviation: Vector = result()
    correlation: Float[Array, "unknowns unknowns"] = result()
    prior: Float[Array, "2 unknowns"] = result()
    singular_values: Vector = result()
    directions: Float[Array, "unknowns unknowns"] = result()
    torque: Rows = result("N m")
    phase: Rows = result("base pitches")
    measured: Rows = result("um")
    fitted: Rows = result("um")
    noise: Rows = result("um")
    model_error: Scalar = result("um")
    chi_square: Scalar = result()
    converged: Bool[Array, ""] = result()
    candidates: Float[Array, " candidates"] = result("N m")
    told_by_candidates: Float[Array, "candidates unknowns"] = result()

    @property
    def best_candidate(self) -> float | None:
        """The further torque that tells most of what is told least [N m]; None without candidates."""
        least = np.asarray(self.told_by_candidates)[:, -1:]
        return float(self.candidates[int(np.argmax(least))]) if len(least) else None

    @property
    def parameters(self) -> dict[str, Scalar]:
        """The estimates by name, which the design takes."""
        return dict(zip(self.names, self.estimate))

    def not_told(self) -> list[str]:
        """What the data cannot tell, a line per combination: of it the prior says more than they do."""
        lines = []
        for value, direction in zip(np.asarray(self.singular_values), np.asarray(self.directions)):
            if value < _TOLD:
                chief = [(share, name) for share, name in zip(direction, self.names) if abs(share) >= _NAMED]
                sign = np.sign(chief[0][0])
                words = " ".join(f"{'+' if sign * share > 0 else '-'} {name}" for share, name in chief)
                left = 1 / np.sqrt(1 + value**2)
                what = "cannot be told" if len(chief) < 2 else "cannot be told apart"
                lines.append(f"{words.removeprefix('+ ')} {what}: {left:.0%} of the prior deviation is left")
        return lines

    @property
    def torques(self) -> Float[np.ndarray, " torques"]:
        """Torques of the readings, ascending [N m]."""
        return np.unique(np.asarray(self.torque))

    @property
    def residual_orders(self) -> Float[np.ndarray, "torques orders"]:
        """Amplitudes of the mesh orders 1, 2 ... of what the fit leaves, a row per torque [um].

        By least squares; as many orders as the readings of every torque resolve, 8 at most.
        """
        every, left = self._rows_of_torques(), np.asarray(self.measured - self.fitted)
        orders = np.arange(1, max(1, min(_ORDERS, (min(map(len, every)) - 1) // 2)) + 1)
        found = []
        for rows in every:
            angle = 2 * np.pi * np.outer(np.asarray(self.phase)[rows], orders)
            waves = np.concatenate([np.ones((len(rows), 1)), np.cos(angle), np.sin(angle)], axis=1)
            cosine, sine = np.split(np.linalg.lstsq(waves, left[rows])[0][1:], 2)
            found.append(np.hypot(cosine, sine))
        return np.asarray(found)

    @property
    def noise_orders(self) -> Float[np.ndarray, " torques"]:
        """Amplitude of a mesh order that noise alone stays below in 95 of 100 cases, of every torque [um]."""
        mean = [
            np.sqrt(np.mean(np.square(np.asarray(self.noise)[rows])) / len(rows)) for rows in self._rows_of_torques()
        ]
        return _OF_NOISE * np.asarray(mean)

    def _rows_of_torques(self) -> list[np.ndarray]:
        return [np.flatnonzero(np.asarray(self.torque) == torque) for torque in self.torques]


class _Problem(eqx.Module):
    design: Design
    names: tuple[str, ...] = eqx.field(static=True)
    mesh: Mesh
    mean: Vector
    spread: Vector
    least_error: Scalar  # size of the shapes of the error of the model

    def parameters(self, z: Vector) -> dict[str, Scalar]:
        return dict(zip(self.names, self.mean + self.spread * z))

    def curves(self, z: Vector, torques: Array) -> tuple[Array, Bool[Array, ""]]:
        """Transmission error over the positions of the mesh, a row per torque."""
        given = self.parameters(z)
        pinion, wheel = two_modifications(self.design(given))
        scale, offset = given.get(TORQUE_SCALE, jnp.ones_like(z[0])), given.get(OFFSET, jnp.zeros_like(z[0]))

        def at(torque: Scalar):
            cycle = solve_case(self.mesh, torque * scale, pinion, wheel)
            return cycle.transmission_error + offset, jnp.all(cycle.converged)

        found, fine = jax.vmap(at)(torques)
        return found, jnp.all(fine)

    def rows(self, z: Vector, data: _Data) -> tuple[Rows, Bool[Array, ""]]:
        """At the readings, between positions of the mesh by a straight line."""
        found, fine = self.curves(z, data.torques)
        count = found.shape[1]
        place = (data.phase - self.mesh.phase[0]) * count
        before = jnp.floor(place)
        share, first = place - before, before.astype(int)
        left, right = (found[data.level, number % count] for number in (first, first + 1))
        return left + share * (right - left), fine

    def jacobian(self, z: Vector, data: _Data) -> tuple[Array, Rows, Bool[Array, ""]]:
        def twice(z: Vector) -> tuple[Rows, tuple[Rows, Bool[Array, ""]]]:
            values, fine = self.rows(z, data)
            return values, (values, fine)

        slopes, (values, fine) = jax.jacfwd(twice, has_aux=True)(z)
        return slopes, values, fine


class _Fit(NamedTuple):
    z: Vector  # the estimates, from the prior means in prior standard deviations
    covariance: Array
    singular: Vector
    directions: Array
    values: Rows
    size: Scalar  # of the shapes of the error of the model
    fine: Bool[Array, ""]


def _error_shapes(data: _Data) -> Float[Array, "rows shapes"]:
    """Curves of unit size that a stiffness in error adds: alike at all torques, and each torque its own.

    Proportional to the torque; the amplitude of a mesh order falls with its number.
    """
    order = jnp.arange(1, _ORDERS + 1, dtype=data.phase.dtype)
    angle = 2 * jnp.pi * data.phase[:, None] * order[None]
    waves = jnp.concatenate([jnp.cos(angle) / order[None], jnp.sin(angle) / order[None]], axis=1)
    load = (data.torques / jnp.max(data.torques))[data.level]
    alike = load[:, None] * jnp.concatenate([jnp.ones_like(waves[:, :1]), waves], axis=1)
    own = jax.nn.one_hot(data.level, data.torques.shape[0], dtype=alike.dtype)
    return jnp.concatenate([alike, (own[:, :, None] * alike[:, None, :]).reshape(alike.shape[0], -1)], axis=1)


class _Errors(NamedTuple):
    """Noise and error of the model, turned so that both are independent: sums of readings in noises.

    Attributes:
        turn: the sums, a row each.
        variance: of the error of the model in every one, where its shapes have unit size.
    """

    turn: Float[Array, "rows rows"]
    variance: Rows

    def whitened(self, size: Scalar, of: Array) -> Array:
        """Columns of readings, in standard deviations."""
        deviation = jnp.sqrt(1 + size**2 * self.variance)
        return (self.turn @ of) / deviation.reshape(-1, *[1] * (of.ndim - 1))


def _errors(data: _Data) -> _Errors:
    shapes = _error_shapes(data) / data.noise[:, None]
    variance, turn = jnp.linalg.eigh(shapes @ shapes.T)
    return _Errors(turn.T / data.noise[None], jnp.maximum(variance, 0.0))


def _evidence(errors: _Errors, size: Scalar, slopes: Array, left: Rows) -> Scalar:
    """Logarithm of the probability of the data under an error of the model of this size, the unknowns integrated."""
    a, r = errors.whitened(size, slopes), errors.whitened(size, left)
    normal, b = jnp.eye(a.shape[1], dtype=a.dtype) + a.T @ a, a.T @ r
    determinant = jnp.sum(jnp.log1p(size**2 * errors.variance)) + jnp.sum(jnp.log(pivots(normal)))
    return -0.5 * (r @ r - b @ solve_dense(normal, b) + determinant)


@program
def _fit(problem: _Problem, data: _Data, steps: int) -> _Fit:
    """Gauss-Newton with Levenberg's damping; the size of the error of the model is a mean by probability."""
    errors = _errors(data)
    sizes = jnp.asarray(_SIZES, data.value.dtype) * jnp.mean(data.noise)

    def white(z, slopes, values):
        left = data.value - values + slopes @ z
        weight = jax.nn.softmax(jax.vmap(lambda size: _evidence(errors, size, slopes, left))(sizes))
        size = jnp.sqrt(weight @ sizes**2 + problem.least_error**2)
        return size, partial(errors.whitened, size)

    def step(state, _):
        z, slopes, values, damping, move = state
        new_slopes, new_values, fine = problem.jacobian(z + move, data)
        _, whiten = white(z, slopes, values)
        old, new = whiten(data.value - values), whiten(data.value - new_values)
        better = fine & (new @ new + (z + move) @ (z + move) <= (old @ old + z @ z) * (1 + _ROUND_OFF))
        z = jnp.where(better, z + move, z)
        slopes, values = jnp.where(better, new_slopes, slopes), jnp.where(better, new_values, values)
        damping = jnp.clip(jnp.where(better, 0.1 * damping, 10 * damping), 1e-3, 1e6)
        _, whiten = white(z, slopes, values)
        a, r = whiten(slopes), whiten(data.value - values)
        normal = a.T @ a + (1 + damping) * jnp.eye(z.shape[0], dtype=z.dtype)
        return (z, slopes, values, damping, solve_dense(normal, a.T @ r - z)), better

    # before the first step nothing is known, and whatever it finds is better
    z = jnp.zeros_like(problem.mean)
    slopes = jnp.zeros((data.value.shape[0], z.shape[0]), z.dtype)
    start = (z, slopes, data.value + _NOTHING * data.noise, jnp.asarray(_DAMPING, z.dtype), z)
    (z, slopes, values, _, move), accepted = jax.lax.scan(step, start, None, length=steps)
    fine = jnp.any(accepted) & (jnp.max(jnp.abs(move)) < _SETTLED)
    size, whiten = white(z, slopes, values)
    a = whiten(slopes)
    unit = jnp.eye(z.shape[0], dtype=z.dtype)
    covariance = solve_dense(a.T @ a + unit, unit)
    _, singular, directions = jnp.linalg.svd(a, full_matrices=False)
    return _Fit(z, covariance, singular, directions, values, size, fine)


@program
def _further(problem: _Problem, z: Vector, data: _Data, size: Scalar, candidate: Scalar) -> Vector:
    """Singular values with a further torque, read at every position of the mesh with the noise of the data."""
    torques = jnp.append(data.torques, candidate)
    phase = problem.mesh.phase.astype(data.phase.dtype)
    more = _Data(
        torques,
        jnp.concatenate([data.level, jnp.full(phase.shape, data.torques.shape[0], data.level.dtype)]),
        jnp.concatenate([data.phase, phase]),
        jnp.concatenate([data.value, jnp.zeros_like(phase)]),
        jnp.concatenate([data.noise, jnp.full_like(phase, jnp.mean(data.noise))]),
    )
    slopes, _, _ = problem.jacobian(z, more)
    grown = size * jnp.max(torques) / jnp.max(data.torques)  # the shapes are those at the largest torque
    return jnp.linalg.svd(_errors(more).whitened(grown, slopes), compute_uv=False)


def identify(
    design: Design,
    prior: Prior,
    measurement: Measurement,
    *,
    mesh: Mesh,
    torque_scale: float | None = 0.01,
    offset: float | None = None,
    model_error: float = 0.02,
    candidates: Sequence[float] = (),
    steps: int = 25,
) -> Identified:
    """The unknowns of a design that gave a measured transmission error.

    Most probable values under Gaussian priors and noise, by Gauss-Newton steps with exact derivatives through the
    contact solution. The model has an error of its own: smooth curves over the phase, proportional to the torque,
    partly alike at all torques. Their size is that of `model_error` and, added in squares, a mean over those under
    which the data are probable; it widens the standard deviations (M. C. Kennedy, A. O'Hagan, Bayesian calibration of
    computer models, J. R. Stat. Soc. B 63, 2001).

    Args:
        design: makes (pinion, wheel) modifications from the named unknowns.
        prior: mean and standard deviation of every unknown in its unit, such as that of the tolerance class.
        measurement: the data.
        mesh: prepared mesh.
        torque_scale: standard deviation of the factor between measured and true torque; None for a right one.
        offset: standard deviation of what is added to every reading [um]; None for absolute readings.
        model_error: standard deviation of the error of the mean deflection, relative to it; 0.02 is that of the default
            structure against finite elements. What the residual shows comes on top.
        candidates: further torques that could be measured [N m].
        steps: of the search.

    Raises:
        ValueError: for a prior that is not positive, an unknown on which nothing depends, or no noise without repeats.
        TypeError: for something else than a prepared mesh.
    """
    check("identify", "model_error", model_error, "", low=0.0, high=1.0)
    whole("identify", "steps", steps, low=1)
    for torque in candidates:
        check("identify", "candidates", torque, "N m", low=0.0, open_low=True)
    problem, data = _posed(design, prior, measurement, mesh, torque_scale, offset, model_error)
    found = _fit(problem, data, steps)
    z = found.z
    more = [_further(problem, z, data, found.size, jnp.asarray(torque, z.dtype)) for torque in candidates]
    told = jnp.stack(more) if more else jnp.zeros((0, len(z)), z.dtype)
    return _found(problem, data, found, jnp.asarray(candidates, z.dtype), told)


def _posed(
    design: Design,
    prior: Prior,
    measurement: Measurement,
    mesh: Mesh,
    scale: float | None,
    offset: float | None,
    model_error: float,
) -> tuple[_Problem, _Data]:
    check_mesh("identify", mesh)
    if not prior:
        raise ValueError("identify: prior must name at least one unknown")
    every = dict(prior)
    for name, middle, known in ((TORQUE_SCALE, 1.0, scale), (OFFSET, 0.0, offset)):
        if name in prior:
            raise ValueError(f"identify: prior names {name}, give {name} = its standard deviation")
        if known is not None:
            every[name] = (middle, known)
    for name, (middle, known) in every.items():
        check("identify", f"prior mean of {name}", middle, "")
        check("identify", f"prior standard deviation of {name}", known, "", low=0.0, open_low=True)
    data = _joined(measurement, mesh)
    mean, spread = (jnp.asarray([known[end] for known in every.values()], data.value.dtype) for end in (0, 1))
    _check_used(design, prior, mesh, float(np.min(np.asarray(measurement.torque))))
    cycle = solve_case(mesh, data.torques[-1], *two_modifications(design(dict(zip(prior, mean)))))
    deflection = jnp.mean(cycle.transmission_error - cycle.unloaded_transmission_error)
    return _Problem(design, tuple(every), mesh, mean, spread, model_error * deflection / _BOTH), data


def _check_used(design: Design, prior: Prior, mesh: Mesh, torque: float) -> None:
    cases = conditions("identify", mesh, torque)
    made = Variants(tuple(prior), design, mesh, None, cases, cases.on(mesh))
    used = made.traced([np.asarray(mean, float) for mean, _ in prior.values()])[1]
    if unused := [name for name in prior if name not in used]:
        raise ValueError(
            f"identify: nothing depends on {', '.join(unused)}: use it in design, or leave it out of prior"
        )


class _Bins(NamedTuple):
    """Readings by torque and position of the mesh."""

    torques: np.ndarray
    level: np.ndarray  # number of the torque of every bin that has readings
    phase: np.ndarray  # mean of its readings
    row: np.ndarray  # bin of every reading
    readings: np.ndarray  # of every bin

    def mean(self, of: Array) -> Array:
        return jnp.zeros(len(self.level), of.dtype).at[self.row].add(of) / self.readings.astype(of.dtype)


def _bins(measurement: Measurement, positions: int, first: float) -> _Bins:
    phase, torque = np.asarray(measurement.phase, float), np.asarray(measurement.torque, float)
    torques, level = np.unique(torque, return_inverse=True)
    place = ((phase - first) % 1) * positions
    bins = level * positions + np.minimum(place.astype(int), positions - 1)
    kept, row, readings = np.unique(bins, return_inverse=True, return_counts=True)
    mean = first + np.bincount(row, place) / readings / positions
    return _Bins(torques, kept // positions, mean, row, readings)


def _noise(measurement: Measurement, bins: _Bins) -> Scalar:
    if measurement.noise is not None:
        return measurement.noise
    value, free = measurement.transmission_error, len(bins.row) - len(bins.level)
    if free < LEAST_ROWS:
        raise ValueError(f"identify: noise = None needs {LEAST_ROWS} repeated readings or more, are {free}")
    noise = jnp.sqrt(jnp.sum((value - bins.mean(value)[bins.row]) ** 2) / free)
    known = concrete(noise)
    if known is not None and not known > 0:
        raise ValueError("identify: repeated readings are all alike, noise must be given [um]")
    return noise


def _joined(measurement: Measurement, mesh: Mesh) -> _Data:
    """Readings of one torque within one position of the mesh, joined into their mean."""
    bins = _bins(measurement, mesh.resolution.positions, float(np.asarray(mesh.phase)[0]))
    dtype = mesh.slice_width.dtype
    noise = _noise(measurement, bins).astype(dtype)
    return _Data(
        torques=jnp.asarray(bins.torques, dtype),
        level=jnp.asarray(bins.level),
        phase=jnp.asarray(bins.phase, dtype),
        value=bins.mean(measurement.transmission_error).astype(dtype),
        noise=noise / jnp.asarray(np.sqrt(bins.readings), dtype),
    )


def _found(problem: _Problem, data: _Data, fit: _Fit, candidates: Array, told_by_candidates: Array) -> Identified:
    deviation = jnp.sqrt(jnp.diagonal(fit.covariance))
    told = jnp.sum(fit.singular**2 / (1 + fit.singular**2))
    weighted = jnp.sum(((data.value - fit.values) / data.noise) ** 2)
    return Identified(
        names=problem.names,
        estimate=problem.mean + problem.spread * fit.z,
        deviation=problem.spread * deviation,
        correlation=fit.covariance / (deviation[:, None] * deviation[None, :]),
        prior=jnp.stack([problem.mean, problem.spread]),
        singular_values=fit.singular,
        directions=fit.directions,
        torque=data.torques[data.level],
        phase=data.phase,
        measured=data.value,
        fitted=fit.values,
        noise=data.noise,
        model_error=_BOTH * fit.size,
        chi_square=weighted / jnp.maximum(data.value.shape[0] - told, 1.0),
        converged=fit.fine,
        candidates=candidates,
        told_by_candidates=told_by_candidates,
    )
