"""Quantities of worn flanks, and gradients of a life."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE, gear_pair, prepare

import jaxgear as jg
from jaxgear.conditions import solve_case
from jaxgear.metrics import Analysis
from jaxgear.wear import (
    WEAR_QUANTITIES,
    Wear,
    life_to,
    life_to_depth,
    mean_over_life,
    over_life,
    pressure_error,
    wear,
    wear_depth,
)
from jaxgear.wear.settings import number_of

TORQUE = 100.0
BLOCKS = 2  # everywhere, so that one program serves all lives
REVOLUTIONS = 1e7
SETTINGS = Wear(REVOLUTIONS, 1e-18, blocks=BLOCKS, depth_limit=2.0, ppte_limit=6.0)
NONE = jg.TipRelief(0.0, 2.0)
PERFECT = np.zeros((2, 1, 16))  # deviations of none, as those of a cycle are: one program marches for both


@pytest.fixture(scope="module")
def mesh():
    return prepare(gear_pair((20, 30), face_width=20.0, bores=(None, None)), resolution=LINE)


@pytest.mark.slow
def test_quantities_are_those_of_the_life(mesh):
    relief = jg.TipRelief(5.0, 2.0)
    cycle = solve_case(mesh, TORQUE, relief, relief)
    life = SETTINGS.history(mesh, TORQUE, pinion=relief, wheel=relief, deviation=PERFECT)
    found = {name: float(SETTINGS.quantity(name)(Analysis(cycle, mesh))) for name in ("worn_ppte", "wear_depth")}
    assert found["worn_ppte"] == pytest.approx(float(over_life(life, "ppte")[-1]), rel=1e-9)
    assert found["wear_depth"] == pytest.approx(float(wear_depth(life)[-1]), rel=1e-9)
    expected = {
        "mean_ppte_over_life": mean_over_life(life, "ppte"),
        "max_ppte_over_life": over_life(life, "ppte").max(),
        "max_pressure_over_life": over_life(life, "max_contact_pressure").max(),
        "max_pressure_over_life_error": 0.0,  # that of new flanks at the tip corners is the largest
        "pinion_wear_depth": wear_depth(life, "pinion")[-1],
        "wheel_wear_depth": wear_depth(life, "wheel")[-1],
        "wear_depth_error": life.error[-1],
        "life_to_depth": life_to_depth(life, 2.0),
        "life_to_ppte": jnp.minimum(life_to(life, "ppte", 6.0), REVOLUTIONS),
    }
    vibrating = {"worn_dynamic_factor", "max_dynamic_factor_over_life"}
    assert {*expected, *found, *vibrating} == {*WEAR_QUANTITIES}
    for name, number in expected.items():
        np.testing.assert_allclose(number_of(name, life, SETTINGS), number, rtol=1e-12)


@pytest.mark.slow
def test_the_pressure_of_worn_flanks_has_an_error_of_its_own(mesh):
    """Wear leaves a ridge at the pitch point, which points blunt; the blocks say nothing of it."""
    life = SETTINGS.history(mesh, TORQUE, pinion=NONE, wheel=NONE, deviation=PERFECT)
    new, _, worn = np.asarray(pressure_error(life))
    assert new == 0 < worn < 0.05 * over_life(life, "max_flank_pressure")[-1]


@pytest.mark.slow
def test_the_error_of_the_pressure_is_that_of_the_grid_or_more():
    """An estimate: 45 MPa where 33 points are off by 46, 31 MPa where 97 are off by 4."""
    fine = prepare(
        gear_pair((30, 30), 2.0, face_width=20.0, bores=(12.6, 12.6)), resolution=jg.Resolution(positions=64, pairs=2)
    )
    relief, pressures, errors = jg.TipRelief(10.0, 2.0), [], []
    for points in (33, None, 193):
        options = {"coefficient": 1e-18, "pinion": relief, "wheel": relief, "blocks": 10, "points": points}
        life = wear(fine, 150.0, 2e7, **options)
        pressures.append(float(over_life(life, "max_flank_pressure")[-1]))
        errors.append(float(pressure_error(life)[-1]))
    away = np.abs(np.array(pressures[:2]) - pressures[2])
    assert (away < 1.2 * np.array(errors[:2])).all() and away[1] < 0.01 * pressures[2] < 0.02 * pressures[2] < away[0]


@pytest.mark.slow
def test_a_limit_that_is_never_reached_is_no_failure(mesh):
    """Not finite values are those of failed contacts, which count as the worst of all."""
    life = SETTINGS.history(mesh, TORQUE, pinion=NONE, wheel=NONE, deviation=PERFECT)
    assert np.isinf(life_to(life, "ppte", 1e3))
    far = Wear(REVOLUTIONS, 1e-18, ppte_limit=1e3, depth_limit=1e6)
    assert float(number_of("life_to_ppte", life, far)) == REVOLUTIONS
    idle = SETTINGS.history(mesh, 0.0, pinion=NONE, wheel=NONE, deviation=PERFECT)
    assert np.isinf(life_to_depth(idle, 1.0))
    assert REVOLUTIONS < float(number_of("life_to_depth", idle, far)) < np.inf


def test_overlong_blocks_give_no_number_but_their_error(mesh):
    """Where flanks overshoot from block to block the depth is unknown; the estimated error tells."""
    cycle = Analysis(solve_case(mesh, TORQUE, NONE, NONE), mesh)
    long, enough = (Wear(revolutions, 1e-18, blocks=BLOCKS) for revolutions in (2e9, REVOLUTIONS))
    assert np.isnan(float(long.quantity("wear_depth")(cycle)))
    assert float(long.quantity("wear_depth_error")(cycle)) > 1.0
    assert 0 < float(enough.quantity("wear_depth")(cycle)) < np.inf


def test_a_life_is_under_one_load(mesh):
    spectrum = Wear(2e7, 1e-18, loads=jg.LoadSpectrum([50.0, 100.0]))
    for settings, torque in ((SETTINGS, None), (spectrum, TORQUE)):
        with pytest.raises(ValueError, match="Wear: give a torque where there are no loads, and none where there are"):
            settings.history(mesh, torque)


def test_equal_settings_make_equal_quantities():
    again = Wear(REVOLUTIONS, 1e-18, blocks=BLOCKS, depth_limit=2.0, ppte_limit=6.0)
    assert SETTINGS.quantity("wear_depth") == again.quantity("wear_depth") != Wear(2e7, 1e-18).quantity("wear_depth")
    assert SETTINGS.quantity("life_to_depth").better == "larger"
    np.testing.assert_array_equal(Wear(1e7, 1e-18, 3e-18).coefficients, [1e-18, 3e-18])


def test_a_name_without_settings_says_what_it_needs(mesh):
    cycle = solve_case(mesh, TORQUE, NONE, NONE)
    for name in WEAR_QUANTITIES:
        with pytest.raises(ValueError, match=rf'{name}: needs settings, give jaxgear.wear.Wear\(...\).quantity\("'):
            jg.quantities[name](cycle)


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda: SETTINGS.quantity("depth"), 'Wear: quantity "depth" is not known, must be one of worn_ppte'),
        (lambda: Wear(1e7, 1e-18).quantity("life_to_depth"), 'Wear: quantity "life_to_depth" needs depth_limit'),
        (lambda: Wear(1e7, 1e-18).quantity("life_to_ppte"), 'Wear: quantity "life_to_ppte" needs ppte_limit'),
        (lambda: Wear(-1.0, 1e-18), "Wear: revolutions = -1 revolutions must be greater than 0 revolutions"),
        (lambda: Wear(1e7, -1e-18), "Wear: coefficient = -1e-18 m2/N must be at least 0 m2/N"),
        (lambda: Wear(1e7, 1e-12), "Wear: coefficient = 1e-12 m2/N must be at least 0 m2/N and at most 1e-13 m2/N"),
        (lambda: Wear(1e7, 1e-18, -1.0), "Wear: wheel_coefficient = -1 m2/N must be at least 0 m2/N"),
        (lambda: Wear(1e7, 1e-18, blocks=5), "blocks = 5 must be even"),
        (lambda: Wear(1e7, 1e-18, points=2), "Wear: points = 2 must be a whole number of at least 3"),
        (lambda: Wear(1e7, 1e-18, depth_limit=0.0), "Wear: depth_limit = 0 um must be greater than 0 um"),
        (lambda: Wear(1e7, 1e-18, ppte_limit=0.0), "Wear: ppte_limit = 0 um must be greater than 0 um"),
    ],
)
def test_refuses_in_one_line(make, message):
    with pytest.raises(ValueError, match=message) as refused:
        make()
    assert "\n" not in str(refused.value)


@pytest.mark.slow
def test_settings_may_be_traced(mesh):
    """Revolutions times the coefficient of wear is all that counts."""
    cycle = solve_case(mesh, TORQUE, NONE, NONE)

    def depth(times):
        settings = Wear(REVOLUTIONS / times, 1e-18 * times, blocks=BLOCKS)
        return settings.quantity("wear_depth")(Analysis(cycle, mesh))

    depth, slope = jax.jit(jax.value_and_grad(depth))(2.0)
    alone = SETTINGS.quantity("wear_depth")(Analysis(cycle, mesh))
    assert float(depth) == pytest.approx(float(alone), rel=1e-9) and abs(float(slope)) < 1e-9 * float(depth)


class Power(eqx.Module):
    """Wear that grows with a power of the pressure, whose slope is infinite without any."""

    coefficient: jax.Array
    exponent: jax.Array

    def __call__(self, pressure, sliding, temperature):
        return self.coefficient * (pressure / 1000.0) ** self.exponent


def worn_ppte(mesh, design):
    """By amount and length of the relief, and by coefficient and exponent of wear."""
    relief = jg.TipRelief(design[0], design[1])
    options = {"coefficient": Power(1e-18 * design[2], design[3]), "blocks": 8, "points": 9}
    life = wear(mesh, jg.OperatingPoint(TORQUE, 1000.0), 4e7, pinion=relief, wheel=relief, **options)
    return over_life(life, "ppte")[-1]


DESIGN = jnp.array([5.0, 2.0, 1.0, 0.5])


@pytest.mark.slow
def test_slopes_of_worn_ppte_are_those_of_differences(mesh):
    @jax.jit
    def with_slopes(design):
        return jax.vmap(lambda way: jax.jvp(lambda at: worn_ppte(mesh, at), (design,), (way,)))(jnp.eye(4))

    step = 1e-4
    _, slopes = with_slopes(DESIGN)
    moved = [[float(with_slopes(DESIGN + sign * step * way)[0][0]) for way in jnp.eye(4)] for sign in (1, -1)]
    difference = (np.array(moved[0]) - np.array(moved[1])) / (2 * step)
    np.testing.assert_allclose(slopes, difference, rtol=1e-4)
    assert np.abs(difference).min() > 1e-3


@pytest.mark.slow
def test_gradients_backwards_are_the_slopes(mesh):
    gradient = jax.jit(jax.grad(lambda design: worn_ppte(mesh, design)))
    slopes = jax.jit(jax.jacfwd(lambda design: worn_ppte(mesh, design)))
    np.testing.assert_allclose(gradient(DESIGN), slopes(DESIGN), rtol=1e-8)
