"""What a modification asks of the grinding machine: amounts, monotony, volume."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import FACE, LINE, gear_pair, kahraman_gear, prepare

import jaxgear as jg
from jaxgear.metrics import max_relief, profile_relief, relief_reversal, removed_volume
from jaxgear.microgeometry import ParabolicLinear


@pytest.fixture(scope="module")
def mesh():
    """The 50/50 pair of contact ratio 1.37: tip at a roll length of 31.7181 mm, pitch point at 25.6515 mm."""
    return prepare(jg.GearPair(kahraman_gear(), kahraman_gear()), resolution=LINE)


@pytest.fixture(scope="module")
def unequal():
    return prepare(gear_pair(), resolution=LINE)


def lengths(mesh):
    """Of the relief [mm]: from the pitch point and from the outer point of single contact."""
    return {"pitch": mesh.path_of_contact.end, "single": mesh.path_of_contact.end - mesh.path_of_contact.outer_single}


PARABOLA = jg.Quadratic(0.0, 0.0, 1.0)


@pytest.mark.parametrize(
    ("start", "curve", "volume"),
    [
        ("pitch", jg.Linear(), 15.337),
        ("pitch", PARABOLA, 10.399),
        ("single", PARABOLA, 5.747),
        ("single", jg.Linear(), 8.544),
    ],
)
def test_volume_of_reliefs_of_6_um(mesh, start, curve, volume):
    """All 100 flanks of one gear of the study of ground profile modifications, which states about 5 mm^3 for its
    reliefs from the end of single contact, and 2.5 and 1.73 times as much for the linear and parabolic ones from the
    pitch point."""
    relief = jg.TipRelief(6.0, lengths(mesh)[start], curve)
    found = float(removed_volume(mesh, pinion=relief))
    assert found == pytest.approx(volume, rel=1e-3)
    assert float(removed_volume(mesh, wheel=relief)) == pytest.approx(found, rel=1e-12), "equal gears"
    assert float(removed_volume(mesh, pinion=relief, wheel=relief)) == pytest.approx(2 * found, rel=1e-12)


def test_volume_is_the_integral_over_the_flank(unequal):
    """2 z b h_max / r_b (rho D / 2 + D^2 / 3) of a linear relief of length D that starts at rho, on each gear."""
    amount, length = 8.0, 3.0
    total = 0.0
    for gear in (unequal.pair.pinion, unequal.pair.wheel):
        rho = float(gear.tip_roll_length) - length
        area = (rho * length / 2 + length**2 / 3) / float(gear.base_radius)
        total += 2 * float(gear.teeth) * 18.0 * 1e-3 * amount * area
    relief = jg.TipRelief(amount, length, jg.Linear())
    assert float(removed_volume(unequal, pinion=relief, wheel=relief)) == pytest.approx(total, rel=2e-4)


def test_volume_along_the_face(mesh):
    """Crowning takes a third of its amount off the whole flank, end relief half of it off its lengths."""
    contact, gear = mesh.path_of_contact, mesh.pair.pinion
    start, tip = float(contact.pinion_roll_length(contact.start)), float(gear.tip_roll_length)
    flanks = 2 * 50 * 20.0 * 1e-3 * (tip**2 - start**2) / (2 * float(gear.base_radius))
    assert float(removed_volume(mesh, pinion=jg.LeadCrowning(9.0))) == pytest.approx(flanks * 3.0, rel=1e-9)
    ends = float(removed_volume(mesh, pinion=jg.EndRelief(9.0, 2.0)))
    assert ends == pytest.approx(flanks * 9.0 * 0.1, rel=5e-3)
    # an eighth of its amount: a slope removes on one half of the face, what it would add on the other does not count
    assert float(removed_volume(mesh, pinion=jg.LeadSlope(8.0))) == pytest.approx(flanks * 8.0 / 8, rel=1e-3)


def test_volume_grows_with_the_amount_from_zero_on(mesh):
    """The slope is the volume per um, also at an amount of zero; that by the length against central differences."""
    volume = lambda amount, length: removed_volume(mesh, pinion=jg.TipRelief(amount, length))  # noqa: E731
    per_um = float(volume(1.0, 3.0))
    for amount in (0.0, 6.0):
        assert float(jax.grad(volume)(amount, 3.0)) == pytest.approx(per_um, rel=1e-12)
    central = (volume(6.0, 3.2) - volume(6.0, 2.8)) / 0.4
    assert float(jax.grad(volume, 1)(6.0, 3.0)) == pytest.approx(float(central), rel=5e-3)


def test_nominal_flanks_need_no_grinding(mesh):
    for metric in (max_relief, relief_reversal, removed_volume):
        assert float(metric(mesh)) == 0.0
    for removed in profile_relief(mesh):
        np.testing.assert_array_equal(removed, np.zeros(101))


def test_profile_from_the_start_of_the_active_profile_to_the_tip(unequal):
    """Root relief stands at the first point, tip relief at the last; the middle of the face has no crowning."""
    contact = unequal.path_of_contact
    pinion = jg.TipRelief(7.0, 3.0) + jg.RootRelief(4.0, 2.0) + jg.LeadCrowning(9.0)
    on_pinion, on_wheel = profile_relief(unequal, pinion, jg.TipRelief(5.0, 3.0), points=51)
    assert on_pinion.shape == on_wheel.shape == (51,)
    np.testing.assert_allclose([on_pinion[0], on_pinion[-1], on_wheel[0], on_wheel[-1]], [4.0, 7.0, 0.0, 5.0])
    length = float(contact.end - contact.start)
    depth = np.maximum(1 - (1 - np.linspace(0, 1, 51)) * length / 3.0, 0.0)
    np.testing.assert_allclose(on_wheel, 5.0 * (0.44 * depth + 0.56 * depth**2), atol=1e-12)


def test_max_relief_adds_up_over_profile_and_face(mesh):
    assert float(max_relief(mesh, pinion=jg.TipRelief(7.0, 3.0))) == pytest.approx(7.0)
    assert float(max_relief(mesh, pinion=jg.TipRelief(7.0, 3.0), wheel=jg.TipRelief(8.0, 2.0))) == pytest.approx(8.0)
    both = jg.TipRelief(7.0, 3.0) + jg.LeadCrowning(4.0)
    assert float(max_relief(mesh, pinion=both)) == pytest.approx(11.0), "the corner of the flank"
    # 4 d (1 - d) is highest in the middle of the relief
    assert float(max_relief(mesh, pinion=jg.TipRelief(6.0, 3.0, jg.Quadratic(0.0, 4.0, -4.0)))) == pytest.approx(
        6.0, rel=1e-3
    )


def test_failed_designs_stay_visible(mesh):
    broken = jax.tree.map(lambda leaf: leaf * jnp.nan, jg.LeadCrowning(1.0))
    assert np.isnan(float(max_relief(mesh, pinion=broken)))


@pytest.mark.parametrize(
    "relief",
    [jg.TipRelief(6.0, 3.0), jg.TipRelief(6.0, 3.0, ParabolicLinear(0.5)) + jg.RootRelief(4.0, 2.0),
     jg.LeadCrowning(5.0), jg.TipRelief(6.0, 3.0, jg.Quadratic(0.2, 0.0, 0.8))],
)  # fmt: skip
def test_reliefs_that_only_grow_do_not_reverse(unequal, relief):
    assert float(relief_reversal(unequal, pinion=relief, wheel=relief)) == pytest.approx(0.0, abs=1e-12)


def test_reversal_is_the_depth_of_the_dips(mesh):
    """4 d (1 - d) rises to its amount and falls back to zero: the whole amount is taken back. Of both gears the worse
    one counts, and what one place loses another does not make good."""
    hump = jg.TipRelief(6.0, 3.0, jg.Quadratic(0.0, 4.0, -4.0))
    assert float(relief_reversal(mesh, pinion=hump)) == pytest.approx(6.0, rel=1e-3)
    assert float(relief_reversal(mesh, wheel=hump)) == pytest.approx(6.0, rel=1e-3)
    half = jg.TipRelief(3.0, 3.0, jg.Quadratic(0.0, 4.0, -4.0))
    assert float(relief_reversal(mesh, pinion=half, wheel=hump)) == pytest.approx(6.0, rel=1e-3)
    root = jg.RootRelief(2.0, 2.0, jg.Quadratic(0.0, 4.0, -4.0))
    assert float(relief_reversal(mesh, pinion=hump + root)) == pytest.approx(8.0, rel=1e-3)


def test_reversal_of_a_profile_slope_is_what_it_adds_on_one_side(mesh):
    """A slope of 6 um over the profile falls from the pitch point to the root."""
    contact = mesh.path_of_contact
    below = float(-contact.start / (contact.end - contact.start))
    assert float(relief_reversal(mesh, pinion=jg.ProfileSlope(6.0))) == pytest.approx(6.0 * below, rel=1e-9)


def test_flank_metrics_under_grad_and_vmap(mesh):
    """Derivatives against central differences at a relief that dips; a batch is its members."""

    def design(x):
        pinion = jg.TipRelief(x[0], x[1], jg.Quadratic(0.0, x[2], 1 - x[2]))
        return {"pinion": pinion, "wheel": jg.TipRelief(x[3], x[1])}

    x, h = jnp.asarray([6.0, 3.0, 2.5, 4.0]), 1e-6
    for metric in (max_relief, relief_reversal, removed_volume):
        value = jax.jit(lambda y, metric=metric: metric(mesh, **design(y)))
        gradient = jax.grad(value)(x)
        central = [(value(x + h * e) - value(x - h * e)) / (2 * h) for e in jnp.eye(4)]
        np.testing.assert_allclose(gradient, central, atol=1e-5)
        batch = jnp.stack([x, 0.5 * x])
        np.testing.assert_allclose(jax.vmap(value)(batch), [value(y) for y in batch], rtol=1e-12)


def test_flank_metrics_do_not_depend_on_the_resolution(mesh):
    fine = jg.prepare(mesh.pair, resolution=FACE)
    relief = jg.TipRelief(6.0, 3.0) + jg.LeadCrowning(4.0)
    for metric in (max_relief, removed_volume):
        assert float(metric(fine, pinion=relief)) == pytest.approx(float(metric(mesh, pinion=relief)), rel=1e-12)
