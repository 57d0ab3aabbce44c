"""Margins tell traced gears that cannot run, by the rules that refuse concrete ones, and hold a search by gradients."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import gear_pair
from scipy.optimize import minimize

import jaxgear as jg
from jaxgear.contact.status import Status, reason
from jaxgear.geometry import outline
from jaxgear.numerics import fields_of

# pinion shift, wheel shift, pinion addendum, centre distance, pinion tip diameter, pinion bore of a 19/48 pair
SOUND = (0.1, -0.05, 1.0, 100.9, 63.5, 24.0)
IMPOSSIBLE = {
    "pinion_tip_land": (0.3, 0.0, 1.0, 101.5, 71.0, 24.0),
    "pinion_tip_height": (0.1, 0.0, 1.0, 100.9, 52.0, 24.0),
    "pinion_rim_thickness": (0.1, 0.0, 1.0, 100.9, 63.5, 52.0),
    "base_circle_clearance": (0.1, 0.0, 1.0, 93.0, 63.5, 24.0),
    "backlash": (0.4, 0.3, 1.0, 101.5, 63.5, 24.0),
    "contact_ratio_margin": (0.1, 0.0, 1.0, 104.5, 63.5, 24.0),
    "wheel_form_clearance": (-0.5, 0.5, 1.0, 100.9, 64.0, 24.0),
    "pinion_tip_clearance": (0.1, -0.6, 1.0, 100.5, 68.6, 24.0),
}


def pair_of(x, teeth=(19.0, 48.0)):
    shift, mate_shift, addendum, distance, tip, bore = x
    pinion = jg.Gear(
        teeth[0], 3.0, profile_shift=shift, face_width=10.0, addendum=addendum, tip_diameter=tip, bore_diameter=bore
    )
    wheel = jg.Gear(teeth[1], 3.0, profile_shift=mate_shift, face_width=10.0)
    return jg.GearPair(pinion, wheel, distance)


def numbers(x):
    margins = jg.margins(pair_of(x))
    return jnp.stack([getattr(margins, name) for name in fields_of(jg.geometry.Margins)])


NAMES = tuple(fields_of(jg.geometry.Margins))
MANY = 60  # points side by side, so that one program looks at all


class Looked(NamedTuple):
    """Margins, their derivatives by every number of the pair, and whether the rules are kept."""

    values: np.ndarray
    slopes: np.ndarray
    valid: np.ndarray
    held: dict[str, np.ndarray]


@jax.jit
@jax.vmap
def _looked(x):
    margins = jg.margins(pair_of(x))
    return Looked(numbers(x), jax.jacfwd(numbers)(x), margins.valid, margins.held)


def looked(points) -> Looked:
    """At up to `MANY` points."""
    points = np.asarray(points)
    filled = np.concatenate([points, np.broadcast_to(SOUND, (MANY - len(points), len(SOUND)))])
    return jax.tree.map(lambda leaf: np.asarray(leaf)[: len(points)], _looked(filled))


def test_margins_of_a_pair_in_closed_form():
    pair = gear_pair((19, 48), 3.0)
    margins = jg.margins(pair)
    assert bool(margins.valid) and jg.explain(pair) == ()
    assert float(margins.pinion_tip_clearance) == pytest.approx(0.25 * 3.0, rel=1e-12)
    assert float(margins.wheel_tip_clearance) == pytest.approx(0.25 * 3.0, rel=1e-12)
    assert float(margins.pinion_rim_thickness) == pytest.approx(0.5 * (3.0 * 16.5 - 24.0), rel=1e-12)
    assert float(margins.wheel_tip_height) == pytest.approx(3.0 * 2.25, rel=1e-12)
    assert float(margins.contact_ratio_margin) == pytest.approx(0.6456, abs=6e-5)
    assert float(margins.base_circle_clearance) == pytest.approx(100.5 * (1 - np.cos(np.deg2rad(20))), rel=1e-12)
    assert float(margins.pinion_tip_land) == pytest.approx(
        float(jg.geometry.tooth_thickness(pair.pinion, 63.0)), rel=1e-12
    )
    path = jg.path_of_contact(pair)
    reached = path.wheel_roll_length(path.end) - outline(pair.wheel).form_roll_length
    assert float(margins.wheel_form_clearance) == pytest.approx(float(reached), rel=1e-12)
    assert float(margins.backlash) == 0.0


@pytest.mark.parametrize("extra", [0.0, 0.05, 0.6])
def test_backlash_is_the_operating_pitch_less_both_thicknesses(extra):
    free = gear_pair((20, 31), 2.0, shift=(0.5, 0.3), bores=(None, None))
    distance = float(free.working_center_distance) + extra
    pair = jg.GearPair(free.pinion, free.wheel, distance)
    diameters = 2 * distance * 20 / 51, 2 * distance * 31 / 51
    thickness = sum(
        float(jg.geometry.tooth_thickness(g, jnp.asarray(d))) for g, d in zip((pair.pinion, pair.wheel), diameters)
    )
    on_the_circle = np.pi * diameters[0] / 20 - thickness
    normal = on_the_circle * np.cos(float(pair.working_pressure_angle))
    assert float(pair.backlash) == pytest.approx(1e3 * normal, abs=1e-8)
    # dj / da = 2 sin(alpha_w), by the trapezoidal rule
    sine = 0.5 * sum(np.sin(float(gears.working_pressure_angle)) for gears in (free, pair))
    assert float(pair.backlash) == pytest.approx(2e3 * extra * sine, rel=1e-3, abs=1e-8)


def test_each_rule_has_its_impossible_pair():
    _, _, valid, rules = looked([SOUND, *IMPOSSIBLE.values()])
    assert bool(valid[0]) and not bool(valid[1:].any())
    for place, name in enumerate(IMPOSSIBLE, start=1):
        assert not bool(rules[name][place]), name
    make = jax.jit(pair_of)
    for x in IMPOSSIBLE.values():
        assert jg.explain(make(jnp.asarray(x)))
        with pytest.raises(ValueError):
            pair_of(x)


def test_a_pair_is_refused_exactly_where_its_margins_flag_it():
    generator = np.random.default_rng(5)
    low, high = np.array([-0.6, -0.6, 0.8, 99.0, 60.0, 20.0]), np.array([0.8, 0.6, 1.2, 104.0, 67.0, 50.0])
    points = low + (high - low) * generator.random((60, 6))
    valid = looked(points).valid
    assert 5 < valid.sum() < 55

    def accepted(x):
        try:
            pair_of(x)
        except ValueError:
            return False
        return True

    assert [accepted(x) for x in points] == valid.tolist()


def test_two_micrometres_of_the_form_diameter_are_the_accuracy_of_the_outline():
    """A wheel tip that reaches 1.9 um below the pinion's form diameter runs, one that reaches 2.1 um below does not."""

    def pair(micrometres, make=jg.GearPair):
        pinion, wheel = jg.Gear(19, 3.0, face_width=10.0), jg.Gear(48, 3.0, face_width=10.0)
        form = outline(pinion)
        reached = jg.geometry.roll_length(
            pinion, jg.geometry.diameter(pinion, form.form_roll_length) - 1e-3 * micrometres
        )
        line = 100.5 * np.sin(np.deg2rad(20))
        tip = 2 * np.hypot(float(wheel.base_radius), line - float(reached))
        return make(pinion, jg.Gear(48, 3.0, face_width=10.0, tip_diameter=tip))

    make = jax.jit(jg.GearPair)
    assert bool(jg.margins(pair(1.9)).valid)
    with pytest.raises(ValueError, match="form diameter"):
        pair(2.1)
    assert not bool(jg.margins(pair(2.1, make)).valid)


def test_derivatives_of_the_margins_of_sound_and_impossible_gears():
    points, step = np.asarray([SOUND, *IMPOSSIBLE.values()]), 1e-6
    exact = looked(points).slopes
    for i, move in enumerate(np.eye(points.shape[1]) * step):
        difference = (looked(points + move).values - looked(points - move).values) / (2 * step)
        np.testing.assert_allclose(exact[:, :, i], difference, rtol=1e-5, atol=1e-5)
    # each violated margin knows a way back
    for place, name in enumerate(IMPOSSIBLE, start=1):
        assert np.abs(exact[place, NAMES.index(name)]).max() > 1e-3, name


def test_absurd_traced_gears_have_finite_margins_and_derivatives():
    generator = np.random.default_rng(3)
    low, high = np.array([-3.0, -3.0, -1.0, 40.0, 1.0, 0.0]), np.array([4.0, 4.0, 4.0, 150.0, 150.0, 150.0])
    points = low + (high - low) * generator.random((500, 6))
    for some in np.array_split(points, -(-len(points) // MANY)):
        found = looked(some)
        assert np.isfinite(found.values).all() and np.isfinite(found.slopes).all()


@pytest.mark.slow
def test_a_search_by_gradients_is_held_by_the_margins():
    """The largest contact ratio over shift, addendum, centre distance: longer and longer teeth, closer and closer."""

    def pair(x):
        shift, addendum, distance = x
        pinion = jg.Gear(19, 3.0, profile_shift=shift, face_width=10.0, addendum=addendum)
        wheel = jg.Gear(48, 3.0, face_width=10.0, addendum=addendum)
        return jg.GearPair(pinion, wheel, distance)

    def rules(x):
        margins = jg.margins(pair(x))
        rows = [getattr(margins, name) for name in NAMES]
        # a tip as thick as engineers ask for, and backlash in a unit near 1
        return jnp.stack(rows).at[0].add(-0.6).at[1].add(-0.6) * jnp.where(
            jnp.asarray([name == "backlash" for name in NAMES]), 0.01, 1.0
        )

    def all_of(x):
        """What is to be least, and the rules; whether all of them are kept."""
        ratio = jg.path_of_contact(pair(x)).contact_ratio
        found = jnp.append(-ratio, rules(x))
        return found, (found, jg.margins(pair(x)).valid)

    sloped = jax.jit(jax.jacrev(all_of, has_aux=True))

    def told(x):
        slopes, (found, valid) = jax.tree.map(np.asarray, sloped(x))
        return found[0], slopes[0], found[1:], slopes[1:], bool(valid)

    start, box = np.array([0.2, 0.9, 101.5]), [(-0.8, 1.2), (0.6, 1.6), (97.0, 104.0)]
    held_by = {"type": "ineq", "fun": lambda x: told(x)[2], "jac": lambda x: told(x)[3]}
    run = {"x0": start, "fun": lambda x: told(x)[:2], "jac": True, "bounds": box}
    free = minimize(method="SLSQP", **run)
    bound = minimize(method="SLSQP", constraints=held_by, **run)
    assert not told(free.x)[4]
    assert bound.success and told(bound.x)[2].min() > -1e-6
    assert -bound.fun > 1.2 * -told(start)[0]
    assert bool(jg.margins(pair(bound.x + np.array([0.0, 0.0, 1e-6]))).valid)
    assert told(bound.x)[2].min() < 1e-6, "margins end the search"
    assert all(low + 0.1 < value < high - 0.1 for value, (low, high) in zip(bound.x, box)), "and not the box"


@pytest.mark.slow
def test_traced_gears_that_cannot_run_do_not_converge():
    """A profile shift of 0.9 leaves 12 teeth no tip: refused when concrete, and no less wrong while being traced."""

    @jax.jit
    def solved(shift):
        pinion = jg.Gear(12, 3.0, profile_shift=shift, face_width=20.0, bore_diameter=12.0)
        pair = jg.GearPair(pinion, jg.Gear(48, 3.0, face_width=18.0, bore_diameter=70.0))
        cycle = jg.solve(jg.prepare(pair, resolution=jg.Resolution(positions=4, pairs=2)), 20.0)
        return cycle.margins.valid, cycle.status, cycle.margins.pinion_tip_land

    valid, status, _ = solved(0.5)
    assert bool(valid) and bool((status == Status.CONVERGED).all())
    valid, status, land = solved(0.9)
    assert not bool(valid) and bool((status == Status.GEARS_CANNOT_RUN).all()) and float(land) < 0
    assert reason(status).startswith("the gears cannot run")


def test_a_slip_of_the_unit_is_named_where_no_number_of_pairs_suffices():
    with pytest.raises(ValueError, match=r"deflection = 12933.3 um.*torque.*N m.*elastic modulus.*MPa"):
        jg.fewest_pairs(gear_pair((19, 48), 3.0), deflection=12933.3)
