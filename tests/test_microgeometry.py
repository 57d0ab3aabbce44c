"""Every modification and relief curve against its formula; composition, limits, smoothness."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxgear as jg
from jaxgear.microgeometry import Flank, ParabolicLinear

START, TIP, WIDTH, BASE = 4.0, 12.0, 20.0, 30.0

CURVES = {
    "linear": (jg.Linear(), lambda d: d),
    "parabolic": (jg.Parabolic(), lambda d: 0.44 * d + 0.56 * d**2),
    "parabola and tangent": (
        ParabolicLinear(0.4), lambda d: np.where(d < 0.4, d**2, 0.16 + 0.8 * (d - 0.4)) / 0.64
    ),
    "power": (jg.Power(1.5), lambda d: d**1.5),
    "quadratic": (jg.Quadratic(0.0, 0.3, 0.7), lambda d: 0.3 * d + 0.7 * d**2),
    "polynomial": (jg.Polynomial([0.0, 0.2, 0.0, 0.8]), lambda d: 0.2 * d + 0.8 * d**3),
    "sinusoidal": (
        jg.Sinusoidal(np.pi / 2, 0.0, np.pi / 2), lambda d: np.sin(np.pi / 2 * d) + np.cos(np.pi / 2 * d + np.pi / 2)
    ),
    "step": (jg.Quadratic(0.25, 0.0, 0.75), lambda d: 0.25 + 0.75 * d**2),
}  # fmt: skip


def profile(rho, y=0.0):
    """Points at the given roll lengths [mm] and face coordinates [mm]."""
    rho, y = jnp.asarray(rho, float), jnp.asarray(y, float)
    rho, y = jnp.broadcast_arrays(rho, y)
    whole = lambda value: jnp.full(rho.shape, value)  # noqa: E731
    return Flank(rho, whole(TIP), whole(START), whole(BASE), y, whole(WIDTH))


def along_face(y):
    return profile(8.0, y)


RHO = np.linspace(START, TIP, 33)
FACE = np.linspace(-WIDTH / 2, WIDTH / 2, 21)


@pytest.mark.parametrize("name", CURVES)
def test_curves_follow_their_formula(name):
    curve, formula = CURVES[name]
    d = np.linspace(0.0, 1.0, 17)
    np.testing.assert_allclose(curve(jnp.asarray(d)), formula(d), atol=1e-15)
    assert curve(jnp.asarray(0.5)).shape == ()


@pytest.mark.parametrize("name", [n for n in CURVES if n != "sinusoidal"])
def test_curves_reach_one_at_the_tip(name):
    assert float(CURVES[name][0](jnp.asarray(1.0))) == pytest.approx(1.0, rel=1e-15)


def test_sinusoidal_curve_that_starts_from_zero_and_ends_at_one():
    """sin(b1) = -cos(b2) makes the start zero."""
    curve = jg.Sinusoidal(np.pi / 3, 0.0, -np.pi / 2)
    np.testing.assert_allclose(curve(jnp.asarray([0.0, 1.0])), [0.0, 2 * np.sin(np.pi / 3)], atol=1e-15)


def test_parabola_goes_on_along_its_tangent():
    """Continuous value and slope at the node, straight beyond it, and one at the tip for every node."""
    slope = jax.vmap(jax.grad(lambda d, n: ParabolicLinear(n)(d)), (0, None))
    for node in (0.05, 0.5, 0.9):
        curve, h = ParabolicLinear(node), 1e-9
        before, after = curve(jnp.asarray([node - h, node + h]))
        assert float(after - before) == pytest.approx(2 * h * 2 / (2 - node), rel=1e-6)
        np.testing.assert_allclose(slope(jnp.asarray([0.0, node, 1.0]), node), np.array([0, 2, 2]) / (2 - node))
        assert float(curve(jnp.asarray(1.0))) == pytest.approx(1.0, rel=1e-15)


def test_parabola_and_tangent_between_its_limits():
    """Node 1 is the pure parabola; towards node 0 it is the straight line, from below."""
    d = jnp.linspace(0.0, 1.0, 21)
    np.testing.assert_allclose(ParabolicLinear(1.0)(d), d**2, atol=1e-15)
    np.testing.assert_allclose(ParabolicLinear(1e-9)(d), d, atol=1e-9)
    between = ParabolicLinear(0.5)(d)
    assert bool(jnp.all((d**2 <= between) & (between <= d)))
    for node in (0.0, 1.01, np.nan):
        with pytest.raises(ValueError, match="ParabolicLinear: node"):
            ParabolicLinear(node)


def test_derivative_by_the_node_is_continuous_and_finite():
    """Also at the node itself, where the branches meet, and at a traced node of zero."""
    by_node = jax.vmap(jax.grad(lambda n, d: ParabolicLinear(n)(d)), (None, 0))
    d, h = jnp.linspace(0.0, 1.0, 41), 1e-6
    for node in (0.3, 0.5):
        central = (ParabolicLinear(node + h)(d) - ParabolicLinear(node - h)(d)) / (2 * h)
        np.testing.assert_allclose(by_node(node, d), central, atol=1e-6)
        np.testing.assert_allclose(
            by_node(node, jnp.asarray([node - 1e-9, node + 1e-9])), -2 * (1 - node) / (2 - node) ** 2, rtol=1e-7
        )
    assert bool(jnp.all(jnp.isfinite(by_node(0.0, d))))


@pytest.mark.usefixtures("interpolation")
def test_spline_curve_is_the_natural_cubic():
    """Exact at its knots, exact for a straight line, vanishing curvature at the ends, the natural spline in between."""
    from scipy.interpolate import CubicSpline

    values = np.array([0.0, 0.1, 0.5, 0.6, 1.0])
    curve, knots, d = jg.Spline(values), np.linspace(0, 1, 5), np.linspace(0, 1, 41)
    np.testing.assert_allclose(curve(jnp.asarray(knots)), values, atol=1e-14)
    np.testing.assert_allclose(curve(jnp.asarray(d)), CubicSpline(knots, values, bc_type="natural")(d), atol=1e-13)
    np.testing.assert_allclose(jg.Spline([0.0, 0.5, 1.0])(jnp.asarray(d)), d, atol=1e-14)
    table = jg.TabulatedProfile(START + 8 * knots, values, method="cubic2")
    np.testing.assert_allclose(table(profile(START + 8 * d)), curve(jnp.asarray(d)), atol=1e-13)


@pytest.mark.parametrize("name", [n for n in CURVES if n != "sinusoidal"])
def test_tip_relief(name):
    curve, formula = CURVES[name]
    amount, length = 7.0, 3.0
    removed = jg.TipRelief(amount, length, curve)(profile(RHO))
    depth = (RHO - (TIP - length)) / length
    np.testing.assert_allclose(removed, np.where(depth > 0, amount * formula(np.maximum(depth, 0)), 0.0), atol=1e-13)
    assert float(removed[-1]) == pytest.approx(amount, rel=1e-14), "the amount stands at the tip"
    np.testing.assert_array_equal(removed[depth <= 0], 0.0)


def test_tip_relief_keeps_its_amount_beyond_the_tip():
    """Corner contact never leaves the tip, but the points of a wide contact do."""
    assert float(jg.TipRelief(7.0, 3.0)(profile(TIP + 0.5))) == pytest.approx(7.0, rel=1e-15)


def test_parabolic_is_the_default_tip_relief_and_linear_the_default_root_relief():
    points = profile(RHO)
    np.testing.assert_array_equal(jg.TipRelief(5.0, 2.0)(points), jg.TipRelief(5.0, 2.0, jg.Parabolic())(points))
    np.testing.assert_array_equal(jg.RootRelief(5.0, 2.0)(points), jg.RootRelief(5.0, 2.0, jg.Linear())(points))


def test_root_relief_mirrors_tip_relief():
    tip = jg.TipRelief(6.0, 2.5, jg.Power(1.5))(profile(RHO))
    root = jg.RootRelief(6.0, 2.5, jg.Power(1.5))(profile(RHO[::-1]))
    np.testing.assert_allclose(root, tip, atol=1e-13)
    assert float(jg.RootRelief(6.0, 2.5)(profile(START))) == pytest.approx(6.0, rel=1e-14)


def test_profile_crowning_and_slope():
    x = (RHO - 8.0) / 4.0
    np.testing.assert_allclose(jg.ProfileCrowning(5.0)(profile(RHO)), 5.0 * x**2, atol=1e-14)
    np.testing.assert_allclose(jg.ProfileSlope(6.0)(profile(RHO)), 3.0 * x, atol=1e-14)
    ends = jg.ProfileSlope(6.0)(profile([START, 8.0, TIP]))
    np.testing.assert_allclose(ends, [-3.0, 0.0, 3.0], atol=1e-14)
    np.testing.assert_allclose(jg.ProfileCrowning(5.0)(profile([START, 8.0, TIP])), [5.0, 0.0, 5.0], atol=1e-14)


def test_lead_crowning_and_slope():
    np.testing.assert_allclose(jg.LeadCrowning(8.0)(along_face(FACE)), 8.0 * (2 * FACE / WIDTH) ** 2, atol=1e-14)
    np.testing.assert_allclose(jg.LeadSlope(8.0)(along_face(FACE)), 8.0 * FACE / WIDTH, atol=1e-14)
    ends = along_face([-10.0, 0.0, 10.0])
    np.testing.assert_allclose(jg.LeadCrowning(8.0)(ends), [8.0, 0.0, 8.0], atol=1e-14)
    np.testing.assert_allclose(jg.LeadSlope(8.0)(ends), [-4.0, 0.0, 4.0], atol=1e-14)


@pytest.mark.parametrize(("side", "ends"), [("both", (9, 9)), ("negative", (9, 0)), ("positive", (0, 9))])
def test_end_relief(side, ends):
    removed = jg.EndRelief(9.0, 4.0, jg.Parabolic(), side)(along_face(FACE))
    d = np.maximum(np.abs(FACE) - 6.0, 0.0) / 4.0
    chosen = np.where(FACE < 0, ends[0], ends[1])
    np.testing.assert_allclose(removed, chosen * (0.44 * d + 0.56 * d**2), atol=1e-13)


MODIFICATIONS = {
    "tip relief": lambda a, b: jg.TipRelief(a, b),
    "root relief": lambda a, b: jg.RootRelief(a, b),
    "end relief": lambda a, b: jg.EndRelief(a, b),
    "power tip relief": lambda a, b: jg.TipRelief(a, b, jg.Power(1.5)),
    "stepped tip relief": lambda a, b: jg.TipRelief(a, b, jg.Quadratic(0.2, 0.0, 0.8)),
}


@pytest.mark.parametrize("name", MODIFICATIONS)
def test_zero_amount_and_zero_length_remove_nothing(name):
    make, points = MODIFICATIONS[name], profile(RHO, np.linspace(-10, 10, 33))
    np.testing.assert_array_equal(make(0.0, 3.0)(points), 0.0)
    np.testing.assert_array_equal(make(5.0, 0.0)(points), 0.0)
    for amount, length in ((0.0, 3.0), (5.0, 0.0), (0.0, 0.0)):
        by_amount, by_length = jax.jacfwd(lambda a, b: make(a, b)(points), (0, 1))(amount, length)
        assert bool(jnp.all(jnp.isfinite(by_amount))) and bool(jnp.all(jnp.isfinite(by_length)))
    np.testing.assert_array_equal(jg.NoModification()(points), 0.0)


@pytest.mark.parametrize("name", MODIFICATIONS)
def test_derivatives_by_amount_and_length(name):
    """Against central differences; the points avoid the start of the relief, where it has a kink."""
    make, points, h = MODIFICATIONS[name], profile(RHO + 0.01, np.linspace(-10, 10, 33) * 0.999), 1e-6
    total = lambda x: make(x[0], x[1])(points)  # noqa: E731
    x = jnp.asarray([5.0, 3.0])
    jacobian = jax.jacfwd(total)(x)
    for k in range(2):
        step = h * jnp.eye(2)[k]
        np.testing.assert_allclose(jacobian[:, k], (total(x + step) - total(x - step)) / (2 * h), atol=1e-8)
    assert float(jnp.abs(jacobian).max()) > 0.5


def test_modifications_add_up():
    points = profile(RHO, np.linspace(-10, 10, 33))
    parts = jg.TipRelief(7.0, 3.0), jg.RootRelief(4.0, 2.0), jg.LeadCrowning(5.0), jg.ProfileSlope(1.0)
    whole = parts[0] + parts[1] + parts[2] + parts[3]
    np.testing.assert_allclose(whole(points), sum(part(points) for part in parts), atol=1e-13)
    assert len(whole.terms) == 4, "sums of sums stay flat"
    other = (parts[3] + parts[2]) + (parts[1] + parts[0])
    np.testing.assert_allclose(other(points), whole(points), atol=1e-13)
    with pytest.raises(TypeError):
        parts[0] + 1.0


@pytest.mark.usefixtures("interpolation")
@pytest.mark.parametrize("method", ["linear", "cubic2", "monotonic"])
def test_tables_are_exact_at_their_knots_and_constant_beyond(method):
    position, amount = np.array([5.0, 6.0, 8.5, 10.0, 12.0]), np.array([3.0, 1.0, 0.0, 0.5, 6.0])
    table = jg.TabulatedProfile(position, amount, method=method)
    np.testing.assert_allclose(table(profile(position)), amount, atol=1e-13)
    np.testing.assert_allclose(table(profile([0.0, 20.0])), [3.0, 6.0], atol=1e-13)
    middle = table(profile([9.25]))
    if method == "linear":
        assert float(middle[0]) == pytest.approx(0.25, rel=1e-14)
    if method == "monotonic":
        fine = table(profile(np.linspace(8.5, 12.0, 50)))
        assert bool(jnp.all(jnp.diff(fine) >= -1e-14)), "no overshoot between rising knots"


def test_tables_over_the_roll_angle():
    angle = np.array([10.0, 15.0, 20.0])
    table = jg.TabulatedProfile(angle, [1.0, 4.0, 2.0], coordinate="roll_angle")
    np.testing.assert_allclose(table(profile(np.deg2rad(angle) * BASE)), [1.0, 4.0, 2.0], atol=1e-13)


@pytest.mark.usefixtures("interpolation")
def test_table_reproduces_a_sampled_modification():
    relief = jg.TipRelief(7.0, 6.0) + jg.ProfileCrowning(2.0)
    knots = np.linspace(START, TIP, 200)
    table = jg.TabulatedProfile(knots, relief(profile(knots)), method="cubic2")
    fine = profile(np.linspace(6.5, TIP, 500))
    np.testing.assert_allclose(table(fine), relief(fine), atol=2e-3)


def test_relief_starts_without_a_step_and_parabolas_also_without_a_kink():
    """Value and slope just after the start of the relief; the start's slope is the linear coefficient of the curve."""
    h = 1e-7
    for curve, slope in ((jg.Linear(), 1.0), (jg.Parabolic(), 0.44), (jg.Quadratic(0.0, 0.0, 1.0), 0.0)):
        relief = jg.TipRelief(6.0, 3.0, curve)
        before, after = relief(profile([TIP - 3.0 - h, TIP - 3.0 + h]))
        assert float(before) == 0.0
        assert float(after - before) == pytest.approx(6.0 * slope * h / 3.0, abs=1e-12)
