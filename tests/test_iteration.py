"""Flanks from the transmission error itself, on the pair and at the torque of the study that they come from."""

from dataclasses import replace

import numpy as np
import pytest
from catalogue import TWO_PAIRS, gear_pair, kahraman_gear, ppte

import jaxgear as jg
from jaxgear.contact.mesh import parts
from jaxgear.optimize.refine import POSITIONS

TORQUE = 200.0  # [N m]


@pytest.fixture(scope="module")
def mesh():
    # the gears of `kahraman_gear`, with the tree of all others
    tip = float(kahraman_gear().tip_diameter)
    pair = gear_pair((50, 50), face_width=20.0, bores=(50.0, 50.0), tips=(tip, tip))
    assert jg.fewest_pairs(pair, deflection=40.0) == TWO_PAIRS.pairs
    return jg.prepare(pair, resolution=TWO_PAIRS)


def iterated(mesh, *, torque=TORQUE, positions=POSITIONS, callback=None, **options):
    method = jg.optimize.TransmissionErrorIteration(**options)
    return jg.minimize(jg.Problem(mesh, torque), method, positions=positions, callback=callback)


@pytest.fixture(scope="module")
def nominal(mesh):
    """From the nominal involute, and what was reported on the way."""
    looks = []
    return iterated(mesh, callback=lambda *args: looks.append(args)), looks


@pytest.fixture(scope="module")
def relieved(mesh):
    """From a tip relief of the form that the study's second type starts with: a parabola that goes on straight."""
    tip = jg.TipRelief(7.0, 3.27, jg.ParabolicLinear(0.5))
    problem = jg.Problem(mesh, TORQUE, lambda variables: (tip, tip))
    return jg.minimize(problem, jg.optimize.TransmissionErrorIteration(start="given"))


def test_five_steps_take_three_quarters_off(nominal):
    result, _ = nominal
    first = result.iterations[0]
    assert first.max_relief == 0.0
    assert result.ppte < 0.25 * first.ppte
    # a single-pair deflection of a few um is all that there is to take off
    assert max(state.max_relief for state in result.iterations) <= 7.0
    assert len(result.iterations) <= 6


def test_result_is_the_best_state(mesh, nominal):
    result, looks = nominal
    reached = [state.ppte for state in result.iterations]
    assert result.ppte == result.objective == min(reached)
    assert ppte(mesh, TORQUE, result.pinion, result.wheel) == pytest.approx(result.ppte, abs=1e-9)
    assert result.evaluations == len(reached)
    np.testing.assert_array_equal(result.history, np.minimum.accumulate(reached))
    assert [best for *_, best in looks] == list(result.history)
    assert [(step, steps) for step, steps, _ in looks] == [(step, 5) for step in range(len(reached))]
    assert result.method == "te_iteration" and result.violation == 0.0
    for state, error in zip(result.iterations, (state.transmission_error for state in result.iterations)):
        assert np.ptp(error) == pytest.approx(state.ppte, rel=1e-12)


def test_levelled_at_its_own_torque(mesh, nominal):
    """The least variation stands at the torque of the design; far below it relief only does harm, above it helps."""
    result, _ = nominal
    torques = TORQUE * np.array([0.5, 0.75, 0.9, 1.0, 1.1, 1.25, 1.5])
    values = [ppte(mesh, torque, result.pinion, result.wheel) for torque in torques]
    assert 0.9 * TORQUE <= torques[np.argmin(values)] <= 1.1 * TORQUE
    assert ppte(mesh, 50.0, result.pinion, result.wheel) > 2 * ppte(mesh, 50.0)
    assert ppte(mesh, 300.0, result.pinion, result.wheel) < 0.5 * ppte(mesh, 300.0)


def test_single_contact_stays_as_it_was(nominal):
    """Around the pitch point one pair carries the load on unmodified flank: its deflection cannot change."""
    result, _ = nominal
    before, after = result.iterations[0].transmission_error, np.asarray(result.cycle.transmission_error)
    middle = np.r_[:4, -3:0]
    np.testing.assert_allclose(after[middle], before[middle], atol=2e-3)
    # and double contact has come to that level
    level = before[middle].max()
    double = np.arange(10, 23)
    assert np.all(before[double] < level - 2.0)
    assert np.all(np.abs(after[double] - level) < 0.25)


def test_nothing_is_removed_below_the_pitch_point(mesh, nominal):
    result, _ = nominal
    contact, tip = mesh.path_of_contact, float(mesh.pair.pinion.tip_roll_length)
    start, pitch = float(contact.pinion_roll_length(contact.start)), float(contact.pinion_pitch_roll_length)
    roll = np.linspace(start, tip, 101)
    for relief in jg.metrics.profile_relief(mesh, result.pinion, result.wheel):
        relief = np.asarray(relief)
        assert np.all(relief[roll < pitch] == 0.0)
        assert np.all(relief >= 0.0)
        assert relief[-1] > 2.0


def test_equal_gears_get_equal_flanks(mesh, nominal):
    result, _ = nominal
    for state in result.iterations:
        pinion, wheel = jg.metrics.profile_relief(mesh, state.pinion, state.wheel)
        np.testing.assert_allclose(pinion, wheel, atol=1e-9)
        # approach mirrors recess
        error = state.transmission_error
        np.testing.assert_allclose(error[1:], error[:0:-1], atol=1e-9)


def test_the_largest_relief_is_kept_in_every_state(mesh, nominal):
    result, _ = nominal
    capped = iterated(mesh, max_relief=2.0)
    assert max(state.max_relief for state in capped.iterations) == pytest.approx(2.0, abs=1e-9)
    assert capped.constraints["max_relief"].value <= 2.0 + 1e-9
    assert result.ppte < capped.ppte < 0.75 * capped.iterations[0].ppte


@pytest.mark.slow
def test_a_relief_to_start_from_also_softens_the_entry(nominal, relieved):
    """From a gradual relief the level is reached as well, and the tips no longer come in as sharp edges."""
    result, _ = nominal
    unmodified = result.iterations[0]
    assert relieved.ppte <= 0.25 * unmodified.ppte
    assert relieved.ppte < relieved.iterations[0].ppte
    best = min(relieved.iterations, key=lambda state: state.ppte)
    # taking off what two pairs lag leaves the tip edges as they are; the gradual relief takes the load off them
    assert min(state.max_corner_pressure for state in result.iterations) > 0.9 * unmodified.max_corner_pressure
    assert best.max_corner_pressure < 0.6 * unmodified.max_corner_pressure
    assert best.max_relief <= 7.0 + 1e-9


@pytest.fixture(scope="module")
def slanted(mesh):
    """Within 2 GPa, what the study allows: the height at the tip is left to the pressure."""
    return iterated(mesh, max_relief=12.0, max_pressure=2000.0, positions=None)


def test_a_relief_that_rises_to_the_tip_is_as_level_and_keeps_the_tip_edges_out(mesh, nominal, slanted):
    """Of the reliefs that level two pairs alike, the plateau leaves the edges as they are, the slanted one unloads them
    as it comes to the deflection of a single pair: twice the height of the plateau."""
    plateau, _ = nominal
    pressure = jg.quantities["max_contact_pressure"]
    assert float(pressure(plateau.cycle)) > 3500.0
    assert float(pressure(slanted.cycle)) <= 2000.0 and slanted.feasible
    assert slanted.ppte <= plateau.ppte
    for state in slanted.iterations[1:]:
        assert max(state.max_corner_pressure, state.max_flank_pressure) <= 2000.0
    top = max(state.max_relief for state in plateau.iterations)
    assert 1.6 * top < slanted.constraints["max_relief"].value < 2.4 * top
    # towards the tip it rises all the way, where the other one is level
    pinion, wheel = (np.asarray(relief) for relief in jg.metrics.profile_relief(mesh, slanted.pinion, slanted.wheel))
    np.testing.assert_allclose(pinion, wheel, atol=1e-9)
    assert np.all(np.diff(pinion[pinion > 0.5]) > 0) and pinion.argmax() == pinion.size - 1
    strength = jg.metrics.Strength(pressure=2000.0)
    assert float(strength.quantity("pressure_safety")(slanted.cycle)) >= 1.0


@pytest.mark.slow
def test_the_limit_of_the_pressure_is_kept_between_the_positions(mesh):
    """At four times the positions that judge it; what the positions of the mesh alone judge passes it."""
    limit, count = 2430.0, mesh.resolution.positions
    fine = parts(jg.prepare(mesh.pair, resolution=replace(mesh.resolution, positions=4 * POSITIONS)), count)
    judged, short = (
        iterated(mesh, max_relief=12.0, max_pressure=limit, positions=positions) for positions in (POSITIONS, None)
    )

    def largest(found):
        cycles = [jg.solve(part, TORQUE, pinion=found.pinion, wheel=found.wheel) for part in fine]
        return max(float(np.max(np.asarray(cycle.corner_pressure))) for cycle in cycles)

    assert judged.feasible and largest(judged) <= limit
    assert short.feasible and largest(short) > limit


@pytest.mark.slow
def test_a_limit_of_the_pressure_that_holds_anyway_changes_nothing(nominal, mesh):
    result, _ = nominal
    free = iterated(mesh, max_pressure=1e5)
    assert [state.ppte for state in free.iterations] == [state.ppte for state in result.iterations]
    assert free.evaluations == result.evaluations


def test_a_limit_of_the_pressure_that_no_slant_keeps_is_no_success(mesh):
    """With 2 um at the tips the edges dig in however the relief is spread."""
    low = iterated(mesh, max_relief=2.0, max_pressure=2000.0, steps=1)
    limit = low.constraints["max_contact_pressure"]
    assert not low.feasible and not limit.kept and "MPa, NOT MET: at most 2000" in str(limit)
    assert low.violation == pytest.approx(limit.value / 2000.0 - 1) and low.violation > 0.5
    assert low.constraints["max_relief"].kept


def test_a_loose_tolerance_ends_early(mesh, nominal):
    result, _ = nominal
    hasty = iterated(mesh, rtol=20.0)
    assert len(hasty.iterations) < len(result.iterations)
    last = hasty.iterations[-1]
    assert last.ppte - last.limit <= 20.0 * last.limit
    assert iterated(mesh, steps=1).evaluations == 2


@pytest.mark.parametrize(
    ("torque", "options", "words"),
    [
        (0.0, {}, "torque"),
        (float("nan"), {}, "torque"),
        (TORQUE, {"max_relief": 0.0}, "max_relief"),
        (TORQUE, {"max_pressure": 0.0}, "max_pressure"),
        (TORQUE, {"rtol": -0.1}, "rtol"),
        (TORQUE, {"steps": 0}, "steps = 0"),
        (TORQUE, {"steps": 2.5}, "steps = 2.5"),
    ],
)
def test_refuses_numbers_outside_their_range(mesh, torque, options, words):
    with pytest.raises(ValueError, match=words):
        iterated(mesh, torque=torque, **options)
