"""One vocabulary of quantities: names and objects, reductions exact, soft and in pieces."""

import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE, gear_pair, ppte

import jaxgear as jg
from jaxgear.contact import OperatingPoint
from jaxgear.metrics import Quantity
from jaxgear.numerics.reductions import Average, Harmonic, Max, Min, Range, Rms, Value
from jaxgear.vocabulary import quantities, quantity_of

VALUES = np.array([0.3, -1.2, 2.5, 0.9, 1.1, -0.4])


@pytest.fixture(scope="module")
def mesh():
    return jg.prepare(gear_pair(), resolution=LINE)


@pytest.fixture(scope="module")
def cycle(mesh):
    relief = jg.TipRelief(5.0, 3.0)
    return jg.solve(mesh, 50.0, pinion=relief, wheel=relief)


@pytest.mark.parametrize(
    ("reduction", "value"),
    [
        (Max(), VALUES.max()),
        (Min(), VALUES.min()),
        (Range(), np.ptp(VALUES)),
        (Average(), VALUES.mean()),
        (Rms(), VALUES.std()),
        (Harmonic(2), 2 * abs(np.fft.rfft(VALUES)[2]) / len(VALUES)),
    ],
    ids=lambda part: type(part).__name__ if not isinstance(part, float) else "",
)
def test_reductions(reduction, value):
    evaluated = jax.jit(lambda x: (reduction(x), reduction.soft(x, 1e-3), jax.grad(reduction)(x)))
    found, soft, _ = evaluated(VALUES)
    assert float(found) == pytest.approx(value, rel=1e-12)
    # of many rows at once, and softly with a width that goes to zero
    assert jax.jit(lambda x: reduction(x))(np.stack([VALUES, 2 * VALUES])) == pytest.approx([value, 2 * value])
    assert float(soft) == pytest.approx(value, abs=5e-3)
    assert np.isnan(evaluated(np.array([1.0, np.nan, 2.0, 1.0, 0.0, 0.0]))[0])
    # constant values: a derivative all the same
    assert np.isfinite(evaluated(np.ones(6))[2]).all()


@pytest.mark.parametrize(("reduction", "sign"), [(Max(), 1), (Min(), -1), (Range(), 1)])
def test_pieces_make_the_value(reduction, sign):
    above, below = reduction.factors(sign)
    assert (above * VALUES).max() - (below * VALUES).min() == pytest.approx(
        sign * float(jax.jit(lambda x: reduction(x))(VALUES))
    )
    # made large, a largest value is not convex: no pieces
    assert reduction.factors(-sign) is None


def test_both_spellings_and_the_nearest_name():
    assert quantity_of("ppte") is quantity_of("ppte_um") is quantities["ppte"]
    assert quantities["max_line_load"].key == "max_line_load_N_per_mm"
    with pytest.raises(ValueError, match='^"ppet" is not known, did you mean "ppte"?'):
        quantity_of("ppet")
    with pytest.raises(ValueError, match="exists already"):
        quantities.add(Quantity("ppte", lambda cycle: cycle.transmission_error))


def test_an_unknown_name_is_a_key_error_with_the_nearest_one():
    with pytest.raises(KeyError, match='quantities: "max_pressure" is not known, did you mean "max_flank_pressure"'):
        quantities["max_pressure"]
    assert "max_pressure" not in quantities and quantities.get("max_pressure") is None


@pytest.mark.slow
def test_the_vocabulary_is_the_same_whatever_was_imported_first():
    """A name of a package that nobody has imported is known, and tables and guides list all in one order."""

    def listed(module):
        code = f"import {module}; from jaxgear import quantities; print(quantities['wear_depth'].unit, *quantities)"
        told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=100)
        return told.stdout.split()

    unit, *names = listed("jaxgear.manufacture")
    assert unit == "um" and [unit, *names] == listed("jaxgear.wear") and {"ppte", "wear_depth"} <= set(names)
    # here too, where other tests may have added their own
    assert [name for name in quantities if name in names] == names


def test_a_quantity_of_your_own_is_as_good_as_one_of_the_vocabulary(cycle):
    mine = Quantity("mine", lambda c: c.transmission_error, "um", reduction=Range())
    assert quantity_of(mine) is mine
    assert float(mine(cycle)) == float(quantities["ppte"](cycle)) == float(jg.peak_to_peak(cycle.transmission_error))
    assert float(quantity_of(lambda c: c.residual[0])(cycle)) == float(cycle.residual[0])


def test_an_array_needs_a_reduction(cycle):
    with pytest.raises(ValueError, match=r"te: gives an array of shape \(16,\), must be a single number.*Max\(\)"):
        Quantity("te", lambda c: c.transmission_error)(cycle)
    with pytest.raises(ValueError, match="te: gives dict, must be a number or an array"):
        Quantity("te", lambda c: {"ppte": 1.0}, reduction=Max())(cycle)
    with pytest.raises(ValueError, match="2 values"):
        Value()(jnp.ones(2))


def test_what_takes_a_speed_says_so(mesh, cycle):
    flash = quantities["max_flash_temperature"]
    with pytest.raises(ValueError, match="max_flash_temperature: needs a speed"):
        flash(cycle)
    running = jg.solve(mesh, OperatingPoint(50.0, speed=3000.0), pinion=cycle.pinion, wheel=cycle.wheel)
    found, field = jax.jit(lambda cycle: (flash(cycle), jg.metrics.flash_temperature(cycle, 3000.0)))(running)
    assert float(found) == pytest.approx(np.max(field))


def test_margins_are_quantities(cycle):
    margins = jg.margins(cycle.kinematics.pair)
    assert float(quantities["pinion_tip_land"](cycle)) == pytest.approx(float(margins.pinion_tip_land))
    assert quantities["pinion_tip_land_mm"].better == "larger"


def test_of_many_cycles(mesh):
    """One number per design, whatever the quantity: that of the design alone."""

    def solve(amount):
        relief = jg.TipRelief(amount, 3.0)
        return jg.solve(mesh, 50.0, pinion=relief, wheel=relief)

    many = jax.tree.map(lambda *parts: jnp.asarray(np.stack(parts)), *(solve(amount) for amount in (1.0, 6.0)))
    found, ratio = jax.jit(lambda many: [quantities[name](many) for name in ("ppte", "effective_contact_ratio")])(many)
    assert found == pytest.approx(
        [ppte(mesh, 50.0, jg.TipRelief(a, 3.0), jg.TipRelief(a, 3.0)) for a in (1.0, 6.0)], abs=1e-9
    )
    assert ratio.shape == (2,)
