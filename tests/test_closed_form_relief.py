"""Closed forms of the gear pair whose tooth pairs all have one constant stiffness k, without corner contact.

Symmetric linear tip relief on both gears, depth E at the tip over the length G p_b, contact ratio 1 < eps < 2,
L = eps - 1, unit of the transmission error delta0 = F0 / k. The results are exact where the extremes stand on flats.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import constant_stiffness_mesh, flank, high_contact_ratio_pair, kahraman_gear, solve

import jaxgear as jg

POSITIONS, STIFFNESS, DELTA0 = 64, 300.0, 10.0  # stiffness of a pair [N/um], reference deflection [um]
# ends of the path lie midway between two positions, so that the shares of double and single contact are exact
CONTACT_RATIO = 89 / 64
L = CONTACT_RATIO - 1


def pair_with(contact_ratio):
    """Two equal gears whose tip circles make the contact ratio."""
    gear = kahraman_gear()
    rho = gear.base_radius * jnp.tan(jnp.deg2rad(20.0)) + 0.5 * contact_ratio * gear.base_pitch
    tip = float(2 * jnp.sqrt(gear.base_radius**2 + rho**2))
    return jg.GearPair(kahraman_gear(tip), kahraman_gear(tip))


@pytest.fixture(scope="module")
def mesh():
    return constant_stiffness_mesh(
        pair_with(CONTACT_RATIO), STIFFNESS, jg.Resolution(positions=POSITIONS, contact_nodes=1)
    )


@pytest.fixture(scope="module")
def fine():
    return constant_stiffness_mesh(pair_with(CONTACT_RATIO), STIFFNESS, jg.Resolution(positions=1024, contact_nodes=1))


def torque(mesh, load):
    """Torque [N m] of a load in units of F0."""
    return load * STIFFNESS * DELTA0 * mesh.pair.pinion.base_radius * 1e-3


def relieved(mesh, depth, extent, load=1.0, curve=(1.0, 0.0)):
    """Mesh cycle with both tips relieved by depth * delta0 over extent * p_b, linear by default."""
    relief = flank(tip=depth * DELTA0, tip_length=extent * mesh.pair.base_pitch, curve=curve)
    return solve(mesh, torque(mesh, load), relief, relief)


def ppte(cycle):
    assert np.all(cycle.converged)
    return float(jg.peak_to_peak(cycle.transmission_error)) / DELTA0


def test_contact_ratio_of_the_model(mesh):
    assert float(mesh.path_of_contact.contact_ratio) == pytest.approx(CONTACT_RATIO, rel=1e-13)


def test_unmodified_pair(mesh):
    """Half of delta0 between one and two pairs; rms (delta0 / 2) sqrt(L (1 - L))."""
    cycle = solve(mesh, torque(mesh, 1.0))
    assert ppte(cycle) == pytest.approx(0.5, rel=1e-12)
    assert np.std(cycle.transmission_error) / DELTA0 == pytest.approx(0.5 * np.sqrt(L * (1 - L)), rel=1e-12)
    assert float(jg.effective_contact_ratio(cycle)) == pytest.approx(CONTACT_RATIO, abs=1.01 / POSITIONS)


@pytest.mark.parametrize(
    ("relative", "depth"), [(0.55, 5.5), (0.6, 3.0), (0.7, 1.75), (0.75, 1.5), (0.8, 4 / 3), (0.9, 1.125), (1.0, 1.0)]
)
def test_zero_variation_curve(mesh, relative, depth):
    """E* = delta0 / (2 - L / G): no variation at all, whatever the extent between short and long relief."""
    assert depth == pytest.approx(1 / (2 - 1 / relative), rel=1e-3)
    extent = relative * L
    cycle = relieved(mesh, 1 / (2 - L / extent), extent)
    assert ppte(cycle) < 1e-12
    np.testing.assert_allclose(cycle.transmission_error, DELTA0, rtol=1e-12)
    # with long relief contact ends where this mesh ends, somewhere within a step
    resolved = 1e-9 if relative < 1 else 1.01 / POSITIONS
    assert float(jg.effective_contact_ratio(cycle)) == pytest.approx(1 + 2 * extent - L, abs=resolved)


@pytest.mark.parametrize("load", [0.4, 0.8, 1.3, 2.0])
@pytest.mark.parametrize("relative", [0.6, 0.8, 1.0])
def test_off_design_load(mesh, relative, load):
    """PPTE = |F - F0| / (2 k) for any extent on the curve."""
    extent = relative * L
    cycle = relieved(mesh, 1 / (2 - L / extent), extent, load)
    assert ppte(cycle) == pytest.approx(0.5 * abs(load - 1), abs=1e-9)


@pytest.mark.parametrize("error", [-0.3, -0.1, 0.1, 0.3])
@pytest.mark.parametrize("relative", [0.75, 1.0])
def test_depth_error(mesh, relative, error):
    """PPTE = |E - E*| (2 - L / G) / 2: half the error for long relief."""
    extent = relative * L
    best = 1 / (2 - L / extent)
    cycle = relieved(mesh, best + error, extent)
    assert ppte(cycle) == pytest.approx(0.5 * abs(error) * (2 - L / extent), abs=1e-9)


@pytest.mark.slow
def test_variance_without_loss_of_contact(fine):
    """L/2 <= G <= L, E <= delta0: the closed-form variance of the trapezoidal variation."""
    for relative in (0.5, 0.75, 1.0):
        extent = relative * L
        m, e = 2 * extent - L, 0.9
        b = 2 * extent / 3 + m**3 / (3 * extent**2)
        variance = (L - 2 * e * extent + e**2 * b - (L - e * extent) ** 2) / 4
        std = float(jnp.std(relieved(fine, e, extent).transmission_error)) / DELTA0
        assert std**2 == pytest.approx(variance, rel=3e-3)


@pytest.mark.parametrize("meshes", ["mesh", pytest.param("fine", marks=pytest.mark.slow)])
def test_relief_that_reaches_into_single_contact(meshes, request):
    """G > L: the best PPTE is delta0 (G - L) / (2 G - L); the extreme stands at the end of single contact."""
    mesh = request.getfixturevalue(meshes)
    for relative in (1.1, 1.25):
        extent = relative * L
        depth = 1 / (2 - L / extent)
        per_position = depth / extent / mesh.path.shape[-1]
        assert ppte(relieved(mesh, depth, extent)) == pytest.approx((extent - L) / (2 * extent - L), abs=per_position)


@pytest.mark.slow
def test_parabolic_relief(fine):
    """Pure parabola over the double-contact zone: PPTE is least, delta0 / 8, at twice the depth; 1/4 at delta0."""
    values = [ppte(relieved(fine, depth, L, curve=(0.0, 1.0))) for depth in (1.0, 1.8, 2.0, 2.2)]
    assert values[0] == pytest.approx(0.25, abs=2e-3)
    assert values[2] == pytest.approx(0.125, abs=2e-3)
    assert values[2] < min(values[1], values[3])


def test_worst_case_over_a_torque_range(mesh):
    """Long relief: the design load in the middle of the range is the slp, worst PPTE (T_hi - T_lo) / (4 k r_b)."""
    low, high = 0.5, 1.5

    def worst(design):
        return max(ppte(relieved(mesh, design, L, load)) for load in (low, high))

    assert worst(1.0) == pytest.approx((high - low) / 4, abs=1e-9)
    assert worst(0.9) > worst(1.0) < worst(1.1)


def test_transmission_error_taken_off_the_flanks(mesh):
    """Both pairs give way by what they lag, delta0 / 2: the first step levels double contact, and none has to follow.

    Pairs that carry no load outside the path of contact make it exact.
    """
    result = jg.minimize(jg.Problem(mesh, torque(mesh, 1.0)), "te_iteration")
    first, second = result.iterations
    assert first.ppte / DELTA0 == pytest.approx(0.5, rel=1e-12)
    assert second.ppte / DELTA0 < 1e-9
    assert second.limit / DELTA0 < 1e-9
    np.testing.assert_allclose(result.cycle.transmission_error, DELTA0, rtol=1e-9)
    assert second.max_relief == pytest.approx(0.5 * DELTA0, rel=1e-9)
    # half of it only: both pairs give way by a quarter of delta0, and half of the variation is left
    capped = jg.minimize(
        jg.Problem(mesh, torque(mesh, 1.0)), jg.optimize.TransmissionErrorIteration(max_relief=0.25 * DELTA0)
    )
    assert capped.ppte / DELTA0 == pytest.approx(0.25, abs=1e-9)


def test_gradient_of_the_closed_forms(mesh):
    """Slope of PPTE over the depth: (2 - L / G) / 2 past the curve, its negative before it; over load 1 / (2 k)."""
    extent = 0.8 * L

    def value(depth, load):
        relief = jg.TipRelief(depth * DELTA0, extent * mesh.pair.base_pitch, jg.Linear())
        cycle = jg.solve(mesh, torque(mesh, load), pinion=relief, wheel=relief)
        return jg.peak_to_peak(cycle.transmission_error) / DELTA0

    slope = jax.jit(jax.grad(value, (0, 1)))
    best = 1 / (2 - L / extent)
    half = 0.5 * (2 - L / extent)
    np.testing.assert_allclose(slope(best - 0.1, 1.0), (-half, 0.5), rtol=1e-9)
    np.testing.assert_allclose(slope(best + 0.1, 1.0), (half, -0.5), rtol=1e-9)


@pytest.mark.slow
def test_two_and_three_pairs_in_contact():
    """Contact ratio 2.36: the deflection varies between a half and a third of delta0."""
    pair = high_contact_ratio_pair()
    mesh = constant_stiffness_mesh(pair, STIFFNESS, jg.Resolution(positions=POSITIONS, contact_nodes=1))
    cycle = solve(mesh, torque(mesh, 1.0))
    assert ppte(cycle) == pytest.approx(1 / 2 - 1 / 3, rel=1e-12)
    loaded = np.sum(np.asarray(cycle.line_load)[:, 0] > 0, axis=0)
    assert set(loaded.tolist()) == {2, 3}
    np.testing.assert_allclose(cycle.transmission_error, DELTA0 / loaded, rtol=1e-12)
