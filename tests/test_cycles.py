"""Many mesh cycles: what a cycle holds, what it is solved again from, and metrics of batches of cycles."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE, gear_pair

import jaxgear as jg

AMOUNTS, TORQUES = jnp.asarray([0.0, 6.0, 15.0]), jnp.asarray([20.0, 60.0])
METRICS = {
    "summary": jg.summary,
    "effective contact ratio": jg.effective_contact_ratio,
    "contact shock": jg.metrics.contact_shock,
    "load sharing": jg.load_sharing,
    "loss factor": jg.metrics.loss_factor,
    "root stress": jg.metrics.root_stress,
    "flash temperature": lambda cycle: jg.metrics.flash_temperature(cycle, 1500.0),
    "secant stiffness": jg.secant_stiffness,
    "peak to peak": lambda cycle: jg.peak_to_peak(cycle.transmission_error),
    "harmonics": lambda cycle: jg.harmonics(cycle.transmission_error, 3),
    "flank pressure": lambda cycle: cycle.contact_pressure,
    "corner pressure": lambda cycle: cycle.corner_pressure,
    "force": lambda cycle: cycle.force,
    "path": lambda cycle: (cycle.kinematics.path, cycle.kinematics.outside, cycle.kinematics.face_coordinate),
    "sides": lambda cycle: [(side.contact_roll_length, side.start_roll_length) for side in cycle.sides],
}


@pytest.fixture(scope="module")
def mesh():
    return jg.prepare(gear_pair(), resolution=LINE)


def design(mesh, torque, amount):
    relief = jg.TipRelief(amount, 3.4)
    return jg.solve(mesh, torque, pinion=relief, wheel=relief)


@pytest.fixture(scope="module")
def batch(mesh):
    """Cycles of every torque and amount."""
    over = jax.vmap(jax.vmap(design, (None, None, 0)), (None, 0, None))
    return jax.jit(over)(mesh, TORQUES, AMOUNTS)


def one_of(batch, index):
    return jax.tree.map(lambda leaf: jnp.asarray(np.asarray(leaf)[index]), batch)


@eqx.filter_jit
def every_metric(cycles):
    """By one program for a batch, and one for a cycle."""
    return {name: jax.tree.leaves(metric(cycles)) for name, metric in METRICS.items()}


@pytest.fixture(scope="module")
def measured(batch):
    """Metrics of the batch and of every cycle."""
    together, alone = every_metric(batch), {index: every_metric(one_of(batch, index)) for index in np.ndindex(2, 3)}
    return jax.tree.map(np.asarray, (together, alone))


@pytest.mark.slow
@pytest.mark.parametrize("name", METRICS)
def test_a_metric_of_many_cycles_is_that_of_each(measured, name):
    """Whether it is taken of the batch or of every cycle, over two batch axes."""
    together, alone = measured
    assert together[name]
    for index, parts in alone.items():
        for whole, part in zip(together[name], parts[name], strict=True):
            assert whole.shape == (2, 3, *part.shape)
            np.testing.assert_allclose(whole[index], part, rtol=1e-12, atol=1e-12)


@pytest.mark.slow
def test_more_relief_shortens_the_contact(batch):
    """One effective contact ratio per design, not one for all."""
    ratio = np.asarray(jg.effective_contact_ratio(batch))
    assert ratio.shape == (2, 3) and (np.diff(ratio, axis=1) < 0).all() and (np.diff(ratio, axis=0) > 0).all()
    assert (ratio > 1).all() and (ratio < 2).all()


def test_cycles_do_not_hold_the_prepared_mesh(mesh, batch):
    """What a cycle of a batch takes is its curves and a few numbers of the pair, less than half of the mesh."""

    def size(tree):
        return sum(leaf.nbytes for leaf in jax.tree.leaves(eqx.filter(tree, eqx.is_array)))

    curves = 5 * 16 * 8 + 5 * (2 * 16 * 8) + 2 * 16 * 8
    assert size(batch) / 6 < curves + 500
    assert size(mesh) > 2 * size(batch) / 6
    largest = max(leaf.size for leaf in jax.tree.leaves(batch))
    assert largest == 6 * 2 * 16


def test_a_cycle_is_solved_again_from_what_it_holds(batch):
    """Flanks, operating point, pair and array sizes are in it, also after many were stacked and one was taken out."""
    cycle = one_of(batch, (1, 2))
    again = jg.solve(
        jg.prepare(cycle.kinematics.pair, resolution=cycle.kinematics.resolution),
        cycle.operating_point,
        pinion=cycle.pinion,
        wheel=cycle.wheel,
    )
    assert float(again.torque) == 60.0 and float(cycle.pinion.amount) == 15.0
    np.testing.assert_allclose(again.transmission_error, cycle.transmission_error, rtol=1e-11)
    stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), cycle, again)
    np.testing.assert_allclose(*stacked.pair_force, rtol=1e-9, atol=1e-9)


def test_operation_carries_what_the_contact_does_not_need(mesh):
    cycle = jg.solve(mesh, jg.OperatingPoint(50.0, speed=1500.0))
    np.testing.assert_array_equal(cycle.transmission_error, jg.solve(mesh, 50.0).transmission_error)
    assert float(cycle.operating_point.speed) == 1500.0 and cycle.operating_point.friction is None
    with pytest.raises(ValueError, match="OperatingPoint: speed = -1 rpm must be at least 0 rpm"):
        jg.OperatingPoint(50.0, speed=-1.0)


def test_one_design_over_torques_is_that_of_each(mesh):
    """In the order given, from zero torque on, and with the flanks in every cycle."""
    relief, torques = jg.TipRelief(6.0, 3.4), [60.0, 0.0, 20.0]
    cycles = jg.sweeps.over_torques(mesh, torques, pinion=relief, wheel=relief)
    assert [float(cycle.torque) for cycle in cycles] == torques and all(cycle.pinion is relief for cycle in cycles)
    for cycle, torque in zip(cycles, torques):
        expected = design(mesh, torque, 6.0).transmission_error
        np.testing.assert_allclose(cycle.transmission_error, expected, rtol=1e-12, atol=1e-12)
    lowest = np.asarray([cycle.transmission_error.min() for cycle in cycles])
    assert lowest[1] < lowest[2] < lowest[0] and lowest[1] == pytest.approx(0.0, abs=1e-9)


WRONG = {
    "a pair": (lambda mesh: jg.solve(mesh.pair, 50.0), TypeError, "mesh is a GearPair, must be a Mesh"),
    "torques": (
        lambda mesh: jg.solve(mesh, jnp.linspace(1.0, 9.0, 16)),
        ValueError,
        r"torque has shape \(16,\), must be a single number",
    ),
    "no modification": (
        lambda mesh: jg.solve(mesh, 50.0, pinion=6.9),
        TypeError,
        "pinion is a float, must be a modification such as TipRelief",
    ),
    "two flanks": (
        lambda mesh: jg.contact.removed_material(mesh, 50.0, wheel=(jg.TipRelief(6.9, 3.4),)),
        TypeError,
        "wheel is a tuple",
    ),
    "one curve": (
        lambda mesh: jg.contact.solve_removed(mesh, 50.0, jnp.zeros(16)),
        ValueError,
        r"removed has shape \(16,\), must be \(2, 1, 16\) \(pairs, slices, positions\)",
    ),
}


@pytest.mark.parametrize(("call", "error", "message"), WRONG.values(), ids=WRONG)
def test_what_is_wrong_is_said_in_one_line(mesh, call, error, message):
    """Also while tracing, when no number is known."""
    with pytest.raises(error, match=message):
        call(mesh)
    with pytest.raises(error, match=message):
        eqx.filter_jit(call)(mesh)


@pytest.mark.slow
def test_modifications_are_taken_in_the_precision_of_the_mesh(mesh):
    """Double-precision reliefs on a mesh in single precision: converged, and within its accuracy of the exact curve."""
    single = jax.tree.map(lambda leaf: leaf.astype(jnp.float32) if eqx.is_inexact_array(leaf) else leaf, mesh)
    cycle, exact = design(single, 50.0, 6.0), design(mesh, 50.0, 6.0)
    assert cycle.transmission_error.dtype == cycle.force.dtype == jnp.float32
    assert bool(jnp.all(cycle.converged))
    np.testing.assert_allclose(cycle.transmission_error, exact.transmission_error, atol=2e-3)
