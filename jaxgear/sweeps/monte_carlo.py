"""Scatter of the transmission error over manufactured gears."""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..conditions import Better, joined, ranked, solved
from ..conditions.join import local_devices, over_devices, side_by_side
from ..contact import Mesh, removed_material, solve_removed
from ..metrics import AbstractSettings, Analysis, Quantity, share_settings
from ..microgeometry import AbstractModification, NoModification
from ..numerics import AbstractMeasure, Checked, Given, Quantile, Worst, check, kernel, real, result, whole
from ..tolerance import ManufacturedGears
from ..tolerance.deviation import deviation_field, deviation_of, flank_basis
from ..tolerance.limits import check_slices
from ..vocabulary import quantity_of

Scalar = Float[Array, ""]

_BLOCK = 4096  # samples per call and device


class Scatter(Checked):
    """Scatter of a design over manufactured gears; result of `monte_carlo`.

    A sample fails if its contact solution does not converge or is not finite. Failed samples stay in all arrays: their
    `ppte` is NaN, `mean` and `std` become NaN, and in every quantile they rank beyond all others, so that bounds can
    only widen. `scatter.ppte[scatter.converged]` excludes them.

    Attributes:
        ppte: peak-to-peak transmission error of every sample [um], shape (samples,).
        converged: True for every sample that has not failed, shape (samples,).
        nominal_ppte: PPTE of the design without deviations [um].
        mean, std: mean and standard deviation of `ppte` [um].
        ppte_quantile95: 95 % quantile of `ppte` [um].
        phase: mesh position in base pitches, shape (positions,).
        nominal_transmission_error: transmission error of the design without deviations [um], shape (positions,).
        quantiles: levels of the quantile curves, ascending, shape (quantiles,).
        transmission_error_quantiles: quantiles of the transmission error at every phase [um], shape
            (quantiles, positions).
        numbers: values of the further results by name with unit, shape (samples,) each, NaN for failed samples.
    """

    ppte: Float[Array, " samples"] = result("um")
    converged: Bool[Array, " samples"] = result()
    nominal_ppte: Scalar = result("um")
    mean: Scalar = result("um")
    std: Scalar = result("um")
    ppte_quantile95: Scalar = result("um")
    phase: Float[Array, " positions"] = result()
    nominal_transmission_error: Float[Array, " positions"] = result("um")
    quantiles: Float[Array, " quantiles"] = result()
    transmission_error_quantiles: Float[Array, "quantiles positions"] = result("um")
    numbers: dict[str, Float[Array, " samples"]] = result()

    def joined(self, of: str | Quantity, measure: AbstractMeasure) -> Scalar:
        """Measure of a result over all samples, such as its 95 % quantile, shape ().

        Args:
            of: one of the further results, or "ppte".
            measure: `Mean()`, `Worst()`, `Quantile(level)` or `CVaR(level)`.

        Raises:
            ValueError: for a result that was not computed.
        """
        wanted = quantity_of(of)
        known = {"ppte_um": self.ppte, **self.numbers}
        if wanted.key not in known:
            raise ValueError(f'Scatter: "{wanted.key}" is not among the results, must be one of {", ".join(known)}')
        return joined(measure, known[wanted.key], jnp.ones_like(self.ppte), wanted.better)

    @property
    def failed(self) -> int:
        """Number of failed samples."""
        return int(np.sum(~np.asarray(self.converged)))

    def __str__(self) -> str:
        return "\n".join(
            [
                f"Scatter of {self.ppte.shape[0]} samples, {self.failed} failed",
                f"  PPTE nominal         {float(self.nominal_ppte):.3f} um",
                f"  PPTE mean            {float(self.mean):.3f} um, standard deviation {float(self.std):.3f} um",
                f"  PPTE 95 % quantile   {float(self.ppte_quantile95):.3f} um",
            ]
        )


def monte_carlo(
    mesh: Mesh,
    torque: Given,
    manufactured: ManufacturedGears,
    *,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
    quantiles: Sequence[float] = (0.05, 0.25, 0.5, 0.75, 0.95),
    results: Sequence[str | Quantity] = (),
) -> Scatter:
    """Scatter of the transmission error and other results of one design over manufactured gears.

    Runs in blocks on all local devices; one compilation serves every tolerance, torque, seed and amount of
    modification. Beyond the blocks it holds one transmission error curve per sample in memory. For gradients, average
    over the deviations yourself:

        deviations = jg.ManufacturedGears(tolerance, samples=500).on(mesh)

        def mean_ppte(amount):
            def one(deviation):
                removed = jg.tolerance.deviated_material(mesh, torque, deviation, pinion=jg.TipRelief(amount, 4.0))
                return jg.peak_to_peak(jg.contact.solve_removed(mesh, torque, removed).transmission_error)

            return jax.numpy.mean(jax.vmap(one)(deviations))

    Args:
        mesh: prepared mesh.
        torque: torque on the pinion [N m], scalar.
        manufactured: manufactured gears, at least 2.
        pinion: modification of the pinion flank; None for the nominal involute.
        wheel: modification of the wheel flank; None for the nominal involute.
        quantiles: levels of the transmission error curves, between 0 and 1.
        results: further quantities, as for `sweep`.

    Raises:
        ValueError: for a torque, a number of samples or a quantile outside its range, unknown results, or lead
            deviations on a mesh of one slice.
    """
    check("torque", torque, "N m", low=0.0)
    levels = np.sort(np.asarray(quantiles, float))
    check("quantiles", levels, "", low=0.0, high=1.0)
    samples, tolerance = whole("samples", manufactured.samples, 2), manufactured.tolerance
    check_slices(tolerance, mesh)
    wanted, settings = share_settings([quantity_of(of) for of in results])
    flanks = pinion or NoModification(), wheel or NoModification()
    task = (mesh, real(torque), tolerance, *flanks, jax.random.key(manufactured.seed))
    curves, converged, numbers = _run(task, wanted, settings, samples + 1)
    return _scatter(mesh.phase, curves, converged, levels, {of.key: column for of, column in zip(wanted, numbers)})


def _run(
    task, results: tuple[Quantity, ...], settings: tuple[AbstractSettings, ...], count: int
) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
    """Transmission errors (count, positions), success (count,) and of every result (count,) on the host.

    Number 0 is the nominal design, which rides along without its own compilation.
    """
    devices = local_devices()
    share = min(_BLOCK, -(-count // devices.size))
    batch = min(side_by_side(task[0]), share)
    block = -(-share // batch) * batch * devices.size
    parts = [
        jax.device_get(_block(task, start + jnp.arange(block), results, settings, batch, devices))
        for start in range(0, count, block)
    ]
    curves, converged, *numbers = (np.concatenate(part)[:count] for part in zip(*parts))
    return curves, converged, numbers


@kernel
def _block(task, numbers, results: tuple[Quantity, ...], settings, batch: int, devices):
    mesh, torque, tolerance, pinion, wheel, key = task
    design, basis = removed_material(mesh, torque, pinion=pinion, wheel=wheel), flank_basis(mesh, torque)
    given = mesh, torque, tolerance, pinion, wheel, key, design, basis, settings
    arrays, rest = eqx.partition(given, eqx.is_array)

    def one(arrays, number):
        return _solve_number(eqx.combine(arrays, rest), number, results)

    return over_devices(one, numbers, arrays, batch=batch, devices=devices)


def _solve_number(task, number, results: tuple[Quantity, ...]):
    """Solution of the sample with a given number; number 0 is the nominal design."""
    mesh, torque, tolerance, pinion, wheel, key, design, basis, settings = task
    deviation = deviation_of(tolerance, mesh, key, number - 1)
    field = deviation_field(deviation, basis)
    removed = design + jnp.where(number > 0, field, 0.0)
    cycle = solve_removed(mesh, torque, removed, pinion=pinion, wheel=wheel)
    analysis = Analysis(cycle, mesh, settings)
    found = [of(analysis) for of in results]
    fine = jnp.all(jnp.stack([solved(cycle), *map(jnp.isfinite, found)]))
    return cycle.transmission_error, fine, *found


def _scatter(phase, curves: np.ndarray, converged: np.ndarray, levels: np.ndarray, numbers=None) -> Scatter:
    """Statistics of the solved samples, on the host: reductions of the device drop NaN from large arrays."""
    spread = np.ptp(curves, axis=1)
    converged = converged & np.isfinite(curves).all(axis=1)
    nominal, ppte, fine = curves[0], np.where(converged, spread, np.nan)[1:], converged[1:]

    def array(value):
        return jnp.asarray(value, curves.dtype)

    return Scatter(
        ppte=array(ppte),
        converged=jnp.asarray(fine),
        nominal_ppte=array(np.where(converged[0], spread[0], np.nan)),
        mean=array(np.mean(ppte, dtype=float)),
        std=array(np.std(ppte, ddof=1, dtype=float)),
        ppte_quantile95=array(_quantiles(ppte, fine, [0.95])[0]),
        phase=phase,
        nominal_transmission_error=array(nominal),
        quantiles=array(levels),
        transmission_error_quantiles=array(_quantiles(curves[1:], fine, levels)),
        numbers={key: array(np.where(fine, values[1:], np.nan)) for key, values in (numbers or {}).items()},
    )


def _quantiles(values: np.ndarray, fine: np.ndarray, levels) -> np.ndarray:
    """Quantiles over the samples of the first axis, shape (levels, ...); failed ones rank beyond all others.

    They do so on either side: below the median, where a bound is a lower one, among the smallest.
    """
    known = np.where(fine.reshape(-1, *[1] * (values.ndim - 1)), values, np.nan)
    found = []
    for level in levels:
        better: Better = "smaller" if level >= 0.5 else "larger"
        outer = level if level >= 0.5 else 1 - level
        found.append(ranked(Worst() if outer == 1 else Quantile(outer), known, better))
    return np.stack(found)
