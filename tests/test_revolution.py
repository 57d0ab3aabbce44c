"""Every tooth on its own: pitch errors, eccentric and wavy gears against closed forms of rigid teeth."""

from dataclasses import replace
from functools import cache, partial

import helical_pairs
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import SLIDING, gear_pair

import jaxgear as jg
from jaxgear import dynamics
from jaxgear.contact import removed_material, solve_removed
from jaxgear.revolution import (
    Teeth,
    TeethDeviations,
    Undulation,
    named_orders,
    shaft_orders,
    side_bands,
    solve_revolution,
    tooth_shares,
    tooth_to_tooth_error,
    total_composite_error,
)

Z1, Z2 = 19, 24
RELIEF = jg.TipRelief(8.0, 3.0)
ALPHA = np.deg2rad(20.0)
LIGHT, TORQUE = 1e-2, 50.0


@cache
def mesh() -> jg.Mesh:
    return jg.prepare(gear_pair((Z1, Z2), bores=(24.0, 24.0)), resolution=SLIDING)


def pitch_on_line(removed) -> TeethDeviations:
    """Teeth that are displaced by so much along the line of action [um]."""
    return TeethDeviations(np.asarray(removed) / np.cos(ALPHA))


def of_wheel(removed) -> Teeth:
    return Teeth(wheel=pitch_on_line(removed))


def one_tooth(amount) -> Teeth:
    return of_wheel(amount * (np.arange(Z2) == 3))


def rigid(places, removed):
    """Transmission error of rigid involutes with tip corners: the least gap, to second order beyond the path."""
    pair, contact, best = mesh().pair, mesh().path_of_contact, np.inf
    (r1, t1), (r2, t2) = ((float(g.base_radius), float(g.tip_roll_length)) for g in pair.gears)
    m1, m2 = float(contact.pinion_roll_length(contact.start)), float(contact.wheel_roll_length(contact.end))
    for number in range(-2, round(places[-1]) + 3):
        x = (places - number) * float(contact.base_pitch)
        before, after = np.maximum(float(contact.start) - x, 0), np.maximum(x - float(contact.end), 0)
        gap = before**2 * t2 * (t2 + m1) / (2 * m1 * r2**2) + after**2 * t1 * (t1 + m2) / (2 * m2 * r1**2)
        best = np.minimum(best, 1e3 * gap + removed[number % len(removed)])
    return best


@pytest.mark.parametrize("shaped", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_equal_teeth_repeat_the_mesh_cycle(shaped):
    teeth = Teeth(wheel=waves(0.0, 1) if shaped else TeethDeviations(np.zeros(Z2)))
    found = solve_revolution(mesh(), TORQUE, teeth, pinion=RELIEF, wheel=RELIEF)
    cycle = jg.solve(mesh(), TORQUE, pinion=RELIEF, wheel=RELIEF)
    assert found.windows == Z2 and bool(found.converged.all())
    error = found.cycles.transmission_error - cycle.transmission_error[None]
    assert float(abs(error).max()) < 1e-12 * float(cycle.transmission_error.max())
    np.testing.assert_allclose(found.pair_share, 1.0, rtol=1e-12)
    assert float(total_composite_error(found)) == pytest.approx(float(jg.peak_to_peak(cycle.transmission_error)))
    assert float(tooth_to_tooth_error(found)) == pytest.approx(float(jg.peak_to_peak(cycle.transmission_error)))


@pytest.mark.parametrize("amount", [5.0, -5.0])
def test_a_pitch_error_shows_where_the_tooth_touches_alone_or_first(amount):
    found = solve_revolution(mesh(), LIGHT, one_tooth(amount))
    places = np.asarray(found.phase)
    expected = rigid(places, amount * (np.arange(Z2) == 3))
    assert expected.max() == max(amount, 0.0) and expected.min() == min(amount, 0.0)
    np.testing.assert_allclose(found.unloaded_transmission_error, expected, atol=0.05)  # of the second order
    np.testing.assert_allclose(found.transmission_error, found.unloaded_transmission_error, atol=0.01)
    flat = np.isin(expected, [0.0, amount])
    np.testing.assert_allclose(np.asarray(found.unloaded_transmission_error)[flat], expected[flat], atol=1e-9)
    assert float(total_composite_error(found)) == pytest.approx(5.0, abs=0.01)


def test_loaded_pairs_share_as_in_a_solution_by_hand():
    found = solve_revolution(mesh(), TORQUE, one_tooth(5.0))
    # two pairs: the later one of window 2, the earlier one of window 3
    for window, rows in ((2, [0.0, 5.0]), (3, [5.0, 0.0]), (5, [0.0, 0.0])):
        removed = jnp.asarray(rows)[:, None, None] * jnp.ones((2, 1, SLIDING.positions))
        by_hand = solve_removed(mesh(), TORQUE, removed)
        np.testing.assert_allclose(found.cycles.transmission_error[window], by_hand.transmission_error, rtol=1e-11)
        np.testing.assert_allclose(found.cycles.pair_force[window], by_hand.pair_force, rtol=1e-9, atol=1e-9)
    shares = np.asarray(tooth_shares(found, "wheel"))
    assert shares.mean() == pytest.approx(1.0) and shares.argmin() == 3
    assert shares[[2, 4]].min() > 1.05 and np.ptp(np.delete(shares, [2, 3, 4])) < 1e-9


def test_flanks_of_single_teeth_are_those_of_whole_gears_in_their_rows():
    slopes = 4.0 * np.sin(np.arange(Z2))
    listed = TeethDeviations(np.zeros(Z2), [jg.ProfileSlope(slope) for slope in slopes])
    found = solve_revolution(mesh(), TORQUE, Teeth(wheel=listed), pinion=RELIEF, wheel=RELIEF)
    rows = [
        removed_material(mesh(), TORQUE, pinion=RELIEF, wheel=RELIEF + jg.ProfileSlope(slopes[tooth])).amount[row]
        for row, tooth in enumerate((7, 8))
    ]
    gap = found.cycles.gap[7] - mesh().corner_gap
    np.testing.assert_allclose(gap, np.stack(rows), atol=1e-10)


def test_displaced_teeth_of_a_wheel_give_side_bands():
    """Its teeth stand on a cosine, each a true involute of its own: what rigid teeth follow in steps."""
    removed = 10.0 * np.cos(2 * np.pi * np.arange(Z2) / Z2)
    found = solve_revolution(mesh(), LIGHT, of_wheel(removed))
    expected = 2 * np.abs(np.fft.fft(rigid(np.asarray(found.phase), removed))) / found.phase.size
    bands = np.asarray(shaft_orders(found, "wheel", 2 * Z2).amplitude)
    for order in (1, Z2 - 1, Z2 + 1, 2 * Z2 - 1):
        assert bands[order - 1] == pytest.approx(expected[order], abs=0.004)
    assert bands[0] == pytest.approx(10.0, rel=0.01) and bands[Z2] > 0.1
    around = side_bands(found, "wheel", count=2)
    np.testing.assert_allclose(around, bands[np.array([Z2 - 2, Z2 - 1, Z2 + 1, Z2 + 2]) - 1], atol=1e-12)
    names = {line.order: line.name for line in named_orders(found, of_wheel(removed))}
    assert names[1] == "mesh" and names[Z2 + 1] == "wheel side band" and names[3] == "mesh"


def waves(amplitude, order, phase=30.0, teeth=Z2) -> TeethDeviations:
    return TeethDeviations(np.zeros(teeth), undulations=[Undulation(amplitude, order, phase)])


@pytest.mark.slow
@pytest.mark.parametrize(("order", "name"), [(1, "wheel shaft order"), (37, "wheel ghost order")])
def test_waves_around_a_gear_are_lines_at_their_order(order, name):
    """All flanks move alike: an eccentric gear gives its shaft order alone, a ghost order is no side band."""
    teeth = (Teeth(wheel=waves(amount, order)) for amount in (0.5, 0.0))
    found, even = (solve_revolution(mesh(), LIGHT, each, pinion=RELIEF, wheel=RELIEF) for each in teeth)
    more = shaft_orders(found, "wheel", of=found.transmission_error - even.transmission_error).amplitude
    assert float(more[order - 1]) == pytest.approx(0.5, rel=0.01)
    assert float(jnp.delete(more, order - 1).max()) < 0.01
    lines = {line.name: line for line in named_orders(found, Teeth(wheel=waves(0.5, order))) if line.order == order}
    assert lines[name].pinion_order == pytest.approx(order * Z1 / Z2)


@pytest.mark.slow
def test_the_gradient_of_side_bands_by_a_relief_is_the_central_difference():
    prepared, teeth = mesh(), of_wheel(10.0 * np.cos(2 * np.pi * np.arange(Z2) / Z2))

    @jax.jit
    @jax.value_and_grad
    def bands(amount):
        found = solve_revolution(prepared, TORQUE, teeth, pinion=jg.TipRelief(amount, 3.0), wheel=RELIEF)
        return jnp.sum(side_bands(found, "wheel", count=1))

    step = 1e-3
    slope = (bands(8.0 + step)[0] - bands(8.0 - step)[0]) / (2 * step)
    assert float(bands(8.0)[1]) == pytest.approx(float(slope), rel=1e-6)


@pytest.mark.slow
def test_an_eccentric_gear_vibrates_as_a_mass_on_a_spring():
    """With equal teeth the orbit is that of the mesh cycle; a wave of all flanks is a displacement of its order."""
    force = partial(dynamics.torsional, pair=mesh().pair, torque=TORQUE, damping_ratio=0.05)
    reliefs = {"pinion": RELIEF, "wheel": RELIEF}
    of_cycle = force(dynamics.mesh_force(mesh(), TORQUE, model="tangent", positions=SLIDING.positions, **reliefs))
    even, found = (solve_revolution(mesh(), TORQUE, Teeth(wheel=waves(a, 1)), **reliefs) for a in (0.0, 5.0))
    natural, start = dynamics.natural_frequencies(of_cycle).mesh, (even.transmission_error[:1], jnp.zeros(1))
    for ratio in (0.5, 3.0):
        orbit = dynamics.steady_orbit(of_cycle, ratio * natural, start, settle=100, steps=32)
        many = [
            dynamics.steady_orbit(
                force(dynamics.revolution_force(each, "tangent")), ratio * natural / Z2, start, settle=5, steps=32 * Z2
            )
            for each in (even, found)
        ]
        np.testing.assert_allclose(many[0].dte, jnp.tile(orbit.dte, Z2), rtol=1e-9)
        more = shaft_orders(found, "wheel", 30, of=many[1].dte - many[0].dte).amplitude
        turn = ratio / Z2
        assert float(more[0]) == pytest.approx(5.0 / abs(1 - turn**2 + 0.1j * turn), rel=2e-3)


def test_draws_keep_to_their_class():
    gear = mesh().pair.wheel
    limits = jg.tolerance.ToleranceClass.of(gear, 6)
    key = jax.random.key(0)
    draw = partial(TeethDeviations.drawn, gear, 6, distribution=jg.tolerance.Uniform())
    many = jax.vmap(lambda key: draw(key=key))(jax.random.split(key, 200))
    turn = 2 * np.pi * np.arange(Z2) / Z2
    pitch = np.asarray(many.pitch)
    for order, wave in enumerate(many.undulations, 1):
        angle = order * turn + np.deg2rad(wave.phase)[:, None]
        pitch = pitch + np.asarray(wave.amplitude)[:, None] * np.cos(angle) / np.cos(ALPHA)
    single = np.diff(pitch, axis=1, append=pitch[:, :1])
    assert 0.5 < abs(single).max() / float(limits.single_pitch) <= 1.0
    assert 0.5 < np.ptp(pitch, axis=1).max() / float(limits.total_pitch) <= 1.0
    assert 2 * float(many.undulations[0].amplitude.max()) <= 0.9 * float(limits.total_pitch)


def test_single_pitch_deviations_close():
    single = np.zeros(Z2)
    single[[3, 4]] = 5.0, -5.0
    np.testing.assert_allclose(TeethDeviations.from_single_pitch(single).pitch, 5.0 * (np.arange(Z2) == 3), atol=1e-12)
    with pytest.raises(ValueError, match=r"sum to 5 um around the gear, must sum to 0 um within 0.49 um"):
        TeethDeviations.from_single_pitch(np.maximum(single, 0.0))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Teeth(over="never"), 'over = \'never\' must be "pinion", "wheel", "hunting" or a number'),
        (lambda: Teeth(over=0), "over = 0 must be a whole number of at least 1"),
        (
            lambda: Teeth(TeethDeviations(np.zeros(20))).counts_of(mesh().pair),
            "pinion has 20 teeth by counts or deviations, 19 by its gear",
        ),
        (lambda: TeethDeviations([1.0, np.nan]), "pitch = nan um must be finite"),
        (
            lambda: TeethDeviations(np.zeros(9), jg.ProfileSlope(3.0)),
            r"shape \(\), must have 9 in front, one per tooth",
        ),
        (lambda: TeethDeviations(np.zeros(2), [jg.ProfileSlope(3.0), jg.LeadSlope(3.0)]), "another kind or shape"),
        (lambda: Undulation(1.0, 0), "order = 0 must be at least 1"),
        (lambda: Undulation(-1.0, 2), "amplitude = -1 um must be at least 0 um"),
        (
            lambda: solve_revolution(mesh(), 1.0, Teeth(TeethDeviations(np.zeros(Z1), [jg.LeadSlope(1.0)] * Z1))),
            "flanks of the pinion vary along the face, which a mesh of 1 slice cannot show",
        ),
        (
            lambda: dynamics.revolution_force(replace(solve_revolution(mesh(), TORQUE, one_tooth(1.0)), repeats=False)),
            "24 base pitches are no whole revolutions of all gears whose teeth differ",
        ),
        (
            lambda: shaft_orders(solve_revolution(mesh(), TORQUE, one_tooth(1.0)), "pinion"),
            r'or of the pinion \(19 teeth\): solve over "hunting"',
        ),
    ],
)
def test_what_is_refused(make, message):
    with pytest.raises(ValueError, match=message) as refused:
        make()
    assert "\n" not in str(refused.value)


@pytest.mark.slow
def test_teeth_that_are_far_apart_take_more_pairs():
    open_pairs = jg.prepare(mesh().pair, resolution=replace(SLIDING, pairs=None))
    teeth = of_wheel(300.0 * (np.arange(Z2) % 2))
    found = solve_revolution(open_pairs, TORQUE, teeth)
    many = solve_revolution(jg.prepare(mesh().pair, resolution=replace(SLIDING, pairs=6)), TORQUE, teeth)
    assert found.cycles.pair_force.shape[1] > 2 and bool(found.converged.all())
    np.testing.assert_allclose(found.transmission_error, many.transmission_error, atol=1e-9)
    assert not bool(solve_revolution(mesh(), TORQUE, teeth).converged.all())  # two pairs are said to be too few


@pytest.mark.slow
def test_waves_of_helical_gears_run_along_their_contact_lines():
    """Every slice meets a wave at the same height, so that rigid teeth follow it whole; so do loaded ones."""
    lines = jg.prepare(helical_pairs.pair_of(), resolution=helical_pairs.SIZES)
    for torque in (LIGHT, 150.0):
        both = (solve_revolution(lines, torque, Teeth(waves(amount, 5, teeth=Z1))) for amount in (1.0, 0.0))
        found, even = both
        more = shaft_orders(found, "pinion", 20, of=found.transmission_error - even.transmission_error).amplitude
        assert float(more[4]) == pytest.approx(1.0, rel=2e-3)
        assert float(jnp.delete(more, 4).max()) < 0.01
    cycle = jg.solve(lines, 150.0)
    np.testing.assert_allclose(even.cycles.transmission_error[7], cycle.transmission_error, rtol=1e-12)
