"""Every modification and relief curve against its formula; composition, limits, smoothness."""

import functools

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
    return _points(*np.broadcast_arrays(np.asarray(rho, float), np.asarray(y, float)))


@jax.jit
def _points(rho, y):
    whole = lambda value: jnp.full(rho.shape, value)  # noqa: E731
    return Flank(rho, whole(TIP), whole(START), whole(BASE), y, whole(WIDTH))


@jax.jit
def at(function, points):
    """Values of a curve or of a modification, by one program instead of one for each of its operations."""
    return function(points)


PLACES = 60


def values(curve, d):
    """Of a curve, always at as many places: one program for every kind of curve."""
    d = np.asarray(d, float)
    return np.asarray(at(curve, jnp.asarray(np.resize(d, PLACES))))[: d.size]


def removed(modification, rho, y=0.0):
    """What a modification removes there, always at as many points: one program for every kind of modification."""
    rho, y = np.broadcast_arrays(np.asarray(rho, float), np.asarray(y, float))
    return np.asarray(at(modification, profile(np.resize(rho, PLACES), np.resize(y, PLACES))))[: rho.size]


def along_face(modification, y):
    return removed(modification, 8.0, y)


RHO = np.linspace(START, TIP, 33)
FACE = np.linspace(-WIDTH / 2, WIDTH / 2, 21)


@pytest.mark.parametrize("name", CURVES)
def test_curves_follow_their_formula(name):
    curve, formula = CURVES[name]
    d = np.linspace(0.0, 1.0, 17)
    np.testing.assert_allclose(values(curve, d), formula(d), atol=1e-15)
    assert jax.eval_shape(curve, jnp.asarray(0.5)).shape == ()


@pytest.mark.parametrize("name", [n for n in CURVES if n != "sinusoidal"])
def test_curves_reach_one_at_the_tip(name):
    assert values(CURVES[name][0], [1.0])[0] == pytest.approx(1.0, rel=1e-15)


def test_sinusoidal_curve_that_starts_from_zero_and_ends_at_one():
    """sin(b1) = -cos(b2) makes the start zero."""
    curve = jg.Sinusoidal(np.pi / 3, 0.0, -np.pi / 2)
    np.testing.assert_allclose(values(curve, [0.0, 1.0]), [0.0, 2 * np.sin(np.pi / 3)], atol=1e-15)


@jax.jit
def _node_slopes(node, depth):
    slopes = jax.value_and_grad(lambda n, d: ParabolicLinear(n)(d), (0, 1))
    return jax.vmap(slopes, (None, 0))(node, depth)


def node_slopes(node, depth):
    """Value of a parabola with tangent, and its derivatives by the node and by the depth, at `PLACES`."""
    depth = np.asarray(depth, float)
    value, slopes = jax.tree.map(np.asarray, _node_slopes(node, np.resize(depth, PLACES)))
    return tuple(part[: depth.size] for part in (value, *slopes))


def test_parabola_goes_on_along_its_tangent():
    """Continuous value and slope at the node, straight beyond it, and one at the tip for every node."""
    for node in (0.05, 0.5, 0.9):
        curve, h = ParabolicLinear(node), 1e-9
        before, after = values(curve, [node - h, node + h])
        assert float(after - before) == pytest.approx(2 * h * 2 / (2 - node), rel=1e-6)
        np.testing.assert_allclose(node_slopes(node, [0.0, node, 1.0])[2], np.array([0, 2, 2]) / (2 - node))
        assert values(curve, [1.0])[0] == pytest.approx(1.0, rel=1e-15)


def test_parabola_and_tangent_between_its_limits():
    """Node 1 is the pure parabola; towards node 0 it is the straight line, from below."""
    d = np.linspace(0.0, 1.0, 21)
    np.testing.assert_allclose(values(ParabolicLinear(1.0), d), d**2, atol=1e-15)
    np.testing.assert_allclose(values(ParabolicLinear(1e-9), d), d, atol=1e-9)
    between = values(ParabolicLinear(0.5), d)
    assert np.all((d**2 <= between) & (between <= d))
    for node in (0.0, 1.01, np.nan):
        with pytest.raises(ValueError, match="ParabolicLinear: node"):
            ParabolicLinear(node)


def test_derivative_by_the_node_is_continuous_and_finite():
    """Also at the node itself, where the branches meet, and at a traced node of zero."""
    d, h = np.linspace(0.0, 1.0, PLACES - 2), 1e-6
    for node in (0.3, 0.5):
        central = (values(ParabolicLinear(node + h), d) - values(ParabolicLinear(node - h), d)) / (2 * h)
        by_node = node_slopes(node, np.append(d, [node - 1e-9, node + 1e-9]))[1]
        np.testing.assert_allclose(by_node[:-2], central, atol=1e-6)
        np.testing.assert_allclose(by_node[-2:], -2 * (1 - node) / (2 - node) ** 2, rtol=1e-7)
    assert np.isfinite(node_slopes(0.0, np.resize(d, PLACES))[1]).all()


def test_spline_curve_is_the_natural_cubic():
    """Exact at its knots, exact for a straight line, vanishing curvature at the ends, the natural spline in between."""
    from scipy.interpolate import CubicSpline

    heights = np.array([0.0, 0.1, 0.5, 0.6, 1.0])
    curve, knots, d = jg.Spline(heights), np.linspace(0, 1, 5), np.linspace(0, 1, 41)
    np.testing.assert_allclose(values(curve, knots), heights, atol=1e-14)
    np.testing.assert_allclose(values(curve, d), CubicSpline(knots, heights, bc_type="natural")(d), atol=1e-13)
    np.testing.assert_allclose(values(jg.Spline([0.0, 0.25, 0.5, 0.75, 1.0]), d), d, atol=1e-14)
    table = jg.TabulatedProfile(START + 8 * knots, heights, method="natural_cubic")
    np.testing.assert_allclose(removed(table, START + 8 * d), values(curve, d), atol=1e-13)


@pytest.mark.parametrize("name", [n for n in CURVES if n != "sinusoidal"])
def test_tip_relief(name):
    curve, formula = CURVES[name]
    amount, length = 7.0, 3.0
    off = removed(jg.TipRelief(amount, length, curve), RHO)
    depth = (RHO - (TIP - length)) / length
    np.testing.assert_allclose(off, np.where(depth > 0, amount * formula(np.maximum(depth, 0)), 0.0), atol=1e-13)
    assert off[-1] == pytest.approx(amount, rel=1e-14), "the amount stands at the tip"
    np.testing.assert_array_equal(off[depth < -1e-12], 0.0)


def test_tip_relief_keeps_its_amount_beyond_the_tip():
    """Corner contact never leaves the tip, but the points of a wide contact do."""
    assert removed(jg.TipRelief(7.0, 3.0), [TIP + 0.5])[0] == pytest.approx(7.0, rel=1e-15)


def test_parabolic_is_the_default_tip_relief_and_linear_the_default_root_relief():
    for default, named in (
        (jg.TipRelief(5.0, 2.0), jg.TipRelief(5.0, 2.0, jg.Parabolic())),
        (jg.RootRelief(5.0, 2.0), jg.RootRelief(5.0, 2.0, jg.Linear())),
    ):
        np.testing.assert_array_equal(removed(default, RHO), removed(named, RHO))


def test_root_relief_mirrors_tip_relief():
    tip = removed(jg.TipRelief(6.0, 2.5, jg.Power(1.5)), RHO)
    root = removed(jg.RootRelief(6.0, 2.5, jg.Power(1.5)), RHO[::-1])
    np.testing.assert_allclose(root, tip, atol=1e-13)
    assert removed(jg.RootRelief(6.0, 2.5), [START])[0] == pytest.approx(6.0, rel=1e-14)


def test_profile_crowning_and_slope():
    x = (RHO - 8.0) / 4.0
    np.testing.assert_allclose(removed(jg.ProfileCrowning(5.0), RHO), 5.0 * x**2, atol=1e-14)
    np.testing.assert_allclose(removed(jg.ProfileSlope(6.0), RHO), 3.0 * x, atol=1e-14)
    ends = removed(jg.ProfileSlope(6.0), [START, 8.0, TIP])
    np.testing.assert_allclose(ends, [-3.0, 0.0, 3.0], atol=1e-14)
    np.testing.assert_allclose(removed(jg.ProfileCrowning(5.0), [START, 8.0, TIP]), [5.0, 0.0, 5.0], atol=1e-14)


def test_lead_crowning_and_slope():
    np.testing.assert_allclose(along_face(jg.LeadCrowning(8.0), FACE), 8.0 * (2 * FACE / WIDTH) ** 2, atol=1e-14)
    np.testing.assert_allclose(along_face(jg.LeadSlope(8.0), FACE), 8.0 * FACE / WIDTH, atol=1e-14)
    ends = [-10.0, 0.0, 10.0]
    np.testing.assert_allclose(along_face(jg.LeadCrowning(8.0), ends), [8.0, 0.0, 8.0], atol=1e-14)
    np.testing.assert_allclose(along_face(jg.LeadSlope(8.0), ends), [-4.0, 0.0, 4.0], atol=1e-14)


@pytest.mark.parametrize(("side", "ends"), [("both", (9, 9)), ("negative", (9, 0)), ("positive", (0, 9))])
def test_end_relief(side, ends):
    off = along_face(jg.EndRelief(9.0, 4.0, jg.Parabolic(), side), FACE)
    d = np.maximum(np.abs(FACE) - 6.0, 0.0) / 4.0
    chosen = np.where(FACE < 0, ends[0], ends[1])
    np.testing.assert_allclose(off, chosen * (0.44 * d + 0.56 * d**2), atol=1e-13)


MODIFICATIONS = {
    "tip relief": lambda a, b: jg.TipRelief(a, b),
    "root relief": lambda a, b: jg.RootRelief(a, b),
    "end relief": lambda a, b: jg.EndRelief(a, b),
    "power tip relief": lambda a, b: jg.TipRelief(a, b, jg.Power(1.5)),
    "stepped tip relief": lambda a, b: jg.TipRelief(a, b, jg.Quadratic(0.2, 0.0, 0.8)),
}


@functools.partial(jax.jit, static_argnums=0)
def with_slopes(make, amount, length, points):
    """Material removed, and its derivatives by amount and length."""

    def off(x):
        return make(x[0], x[1])(points)

    x = jnp.stack([amount, length])
    return off(x), jax.jacfwd(off)(x)


@pytest.mark.parametrize("name", MODIFICATIONS)
def test_zero_amount_and_zero_length_remove_nothing(name):
    points = profile(RHO, np.linspace(-10, 10, 33))
    for amount, length in ((0.0, 3.0), (5.0, 0.0), (0.0, 0.0)):
        off, slopes = with_slopes(MODIFICATIONS[name], amount, length, points)
        np.testing.assert_array_equal(off, 0.0)
        assert np.isfinite(slopes).all()
    np.testing.assert_array_equal(removed(jg.NoModification(), RHO), 0.0)


@pytest.mark.parametrize("name", MODIFICATIONS)
def test_derivatives_by_amount_and_length(name):
    """Against central differences; the points avoid the start of the relief, where it has a kink."""
    points, h = profile(RHO + 0.01, np.linspace(-10, 10, 33) * 0.999), 1e-6

    def off(x):
        return [np.asarray(part) for part in with_slopes(MODIFICATIONS[name], *x.tolist(), points)]

    x = np.array([5.0, 3.0])
    jacobian = off(x)[1]
    for k, step in enumerate(h * np.eye(2)):
        np.testing.assert_allclose(jacobian[:, k], (off(x + step)[0] - off(x - step)[0]) / (2 * h), atol=1e-8)
    assert np.abs(jacobian).max() > 0.5


def test_modifications_add_up():
    places = RHO, np.linspace(-10, 10, 33)
    parts = jg.TipRelief(7.0, 3.0), jg.RootRelief(4.0, 2.0), jg.LeadCrowning(5.0), jg.ProfileSlope(1.0)
    whole = parts[0] + parts[1] + parts[2] + parts[3]
    off = removed(whole, *places)
    np.testing.assert_allclose(off, sum(removed(part, *places) for part in parts), atol=1e-13)
    assert len(whole.terms) == 4, "sums of sums stay flat"
    other = (parts[3] + parts[2]) + (parts[1] + parts[0])
    np.testing.assert_allclose(removed(other, *places), off, atol=1e-13)
    with pytest.raises(TypeError):
        parts[0] + 1.0


@pytest.mark.parametrize("method", ["linear", "natural_cubic", "monotonic"])
def test_tables_are_exact_at_their_knots_and_constant_beyond(method):
    position, amount = np.array([5.0, 6.0, 8.5, 10.0, 12.0]), np.array([3.0, 1.0, 0.0, 0.5, 6.0])
    table = jg.TabulatedProfile(position, amount, method=method)
    np.testing.assert_allclose(removed(table, position), amount, atol=1e-13)
    np.testing.assert_allclose(removed(table, [0.0, 20.0]), [3.0, 6.0], atol=1e-13)
    middle = removed(table, [9.25])
    if method == "linear":
        assert middle[0] == pytest.approx(0.25, rel=1e-14)
    if method == "monotonic":
        fine = removed(table, np.linspace(8.5, 12.0, 50))
        assert np.all(np.diff(fine) >= -1e-14), "no overshoot between rising knots"


def test_tables_over_the_roll_angle():
    angle = np.array([10.0, 15.0, 20.0])
    table = jg.TabulatedProfile(angle, [1.0, 4.0, 2.0], coordinate="roll_angle")
    np.testing.assert_allclose(removed(table, np.deg2rad(angle) * BASE), [1.0, 4.0, 2.0], atol=1e-13)


def test_table_reproduces_a_sampled_modification():
    relief = jg.TipRelief(7.0, 6.0) + jg.ProfileCrowning(2.0)
    knots = np.linspace(START, TIP, 200)
    table = jg.TabulatedProfile(knots, at(relief, profile(knots)), method="natural_cubic")
    fine = profile(np.linspace(6.5, TIP, 500))
    np.testing.assert_allclose(at(table, fine), at(relief, fine), atol=2e-3)


def test_relief_starts_without_a_step_and_parabolas_also_without_a_kink():
    """Value and slope just after the start of the relief; the start's slope is the linear coefficient of the curve."""
    h = 1e-7
    for curve, slope in ((jg.Linear(), 1.0), (jg.Parabolic(), 0.44), (jg.Quadratic(0.0, 0.0, 1.0), 0.0)):
        relief = jg.TipRelief(6.0, 3.0, curve)
        before, after = removed(relief, [TIP - 3.0 - h, TIP - 3.0 + h])
        assert float(before) == 0.0
        assert float(after - before) == pytest.approx(6.0 * slope * h / 3.0, abs=1e-12)


def test_a_number_scales_a_modification_and_sum_adds_many():
    """Also a traced number, whose derivative is the unscaled modification."""
    places = RHO, np.linspace(-10, 10, 33)
    parts = [jg.TipRelief(7.0, 3.0), jg.LeadCrowning(5.0), jg.ProfileSlope(1.0)]
    alone = [removed(part, *places) for part in parts]
    np.testing.assert_allclose(removed(sum(parts), *places), sum(alone), atol=1e-13)
    for factor in (2, 2.0, np.float64(2.0), jnp.asarray(2.0)):
        np.testing.assert_array_equal(removed(factor * parts[0], *places), 2.0 * alone[0])
        np.testing.assert_array_equal(removed(parts[0] * factor, *places), 2.0 * alone[0])
    np.testing.assert_array_equal(removed(-parts[0], *places), -alone[0])
    np.testing.assert_allclose(removed(sum(parts) - parts[1], *places), alone[0] + alone[2], atol=1e-13)
    by_factor = jax.jit(jax.jacfwd(lambda x, points: (x * sum(parts))(points)))(3.0, profile(*places))
    np.testing.assert_allclose(by_factor, sum(alone), atol=1e-13)
    assert str(2 * parts[1] + parts[2]) == (
        "Scaled(factor=2, modification=LeadCrowning(amount=5 um)) + ProfileSlope(amount=1 um)"
    )


@pytest.mark.parametrize(
    "wrong",
    [
        lambda relief: relief + 1.0,
        lambda relief: 1 + relief,
        lambda relief: relief + None,
        lambda relief: relief - "tip",
        lambda relief: relief * relief,
        lambda relief: "2" * relief,
        lambda relief: relief * [1.0, 2.0],
    ],
)
def test_what_is_no_modification_cannot_be_added_and_what_is_no_number_cannot_scale(wrong):
    with pytest.raises(TypeError, match=r"TipRelief\(amount=5 um.*only (a number can|another modification can)"):
        wrong(jg.TipRelief(5.0, 3.0))


def test_a_factor_is_one_number():
    with pytest.raises(ValueError, match=r"Scaled: factor has shape \(3,\), must be a single number"):
        jnp.arange(3.0) * jg.TipRelief(5.0, 3.0)


@pytest.mark.parametrize(
    "make",
    [
        lambda x: jg.TipRelief(x, 4.0),
        lambda x: jg.RootRelief(4.0, x),
        lambda x: jg.EndRelief(x, 1.0),
        jg.ProfileCrowning,
        jg.ProfileSlope,
        jg.LeadCrowning,
        jg.LeadSlope,
        jg.Power,
        ParabolicLinear,
        lambda x: jg.Quadratic(0.0, x, 0.0),
    ],
)
def test_arrays_where_a_single_number_is_meant_are_refused_also_while_traced(make):
    """An array as long as the positions was one amount per position, without a word."""
    for call in (make, jax.jit(make)):
        with pytest.raises(ValueError, match=r"has shape \(32,\), must be a single number; make many with jax.vmap"):
            call(jnp.linspace(0.1, 0.9, 32))


def test_many_reliefs_by_vmap():
    amounts = jnp.linspace(1.0, 9.0, 5)
    reliefs = jax.vmap(lambda amount: jg.TipRelief(amount, 4.0))(amounts)
    rows = jax.jit(jax.vmap(at, (0, None)))(reliefs, profile(RHO))
    for amount, row in zip(amounts, rows, strict=True):
        np.testing.assert_allclose(row, removed(jg.TipRelief(amount, 4.0), RHO), atol=1e-14)


def test_numbers_are_checked_inside_traced_functions_too():
    with pytest.raises(ValueError, match="TipRelief: length = -1 mm must be at least 0 mm"):
        jax.jit(lambda amount: jg.TipRelief(amount, -1.0))(5.0)


def test_which_modifications_vary_along_the_face():
    """Amounts of zero do not; traced ones may."""
    relief = jg.TipRelief(5.0, 3.0)
    assert not (relief + jg.ProfileSlope(2.0) + jg.LeadCrowning(0.0) + jg.NoModification()).varies_along_face
    assert not (0.0 * jg.LeadSlope(3.0)).varies_along_face and not (2.0 * relief).varies_along_face
    for lead in (jg.LeadCrowning(1.0), jg.LeadSlope(-1.0), jg.EndRelief(1.0, 2.0), -jg.LeadSlope(1.0)):
        assert lead.varies_along_face and (relief + lead).varies_along_face
    seen = []
    jax.jit(lambda x: seen.append(jg.LeadCrowning(x).varies_along_face) or x)(0.0)
    assert seen == [True]


@pytest.mark.parametrize("node", [1e-300, 1e-12, 1.0])
def test_derivative_by_the_node_is_right_for_any_node(node):
    """Closed form: -2 (1 - n) / (2 - n)^2 ... on the tangent, on the parabola d^2 (2 n - 2) / (2 n - n^2)^2."""
    r = np.array([0.0, 0.25, 0.5, 1.0 - 1e-9])
    value, by_node, by_depth = node_slopes(node, r * node)
    np.testing.assert_allclose(value, node * r**2 / (2 - node), rtol=1e-14)
    np.testing.assert_allclose(by_node, r**2 * (2 * node - 2) / (2 - node) ** 2, rtol=1e-8, atol=1e-14)
    np.testing.assert_allclose(by_depth, 2 * r / (2 - node), rtol=1e-14)
    assert np.isfinite(node_slopes(node, [0.3, 1.0])[1]).all()


TABLE = [5.0, 6.0, 8.5, 10.0, 12.0]


@pytest.mark.parametrize("method", ["linear", "natural_cubic", "monotonic"])
def test_a_flank_table_without_variation_over_the_face_is_a_profile_table(method):
    column = np.array([3.0, 1.0, 0.0, 0.5, 6.0])
    table = jg.TabulatedFlank(TABLE, [-10.0, 0.0, 4.0], np.stack([column] * 3, axis=1), method)
    places = np.linspace(START, 14.0, 60), np.linspace(-14.0, 14.0, 60)
    expected = removed(jg.TabulatedProfile(TABLE, column, method=method), *places)
    np.testing.assert_allclose(removed(table, *places), expected, atol=1e-13)
    assert not table.varies_along_face


@pytest.mark.parametrize("method", ["linear", "natural_cubic", "monotonic"])
def test_a_flank_table_is_exact_at_its_points_linear_over_the_face_and_constant_beyond(method):
    face = np.array([-9.0, -2.0, 8.0])
    amount = np.random.default_rng(3).normal(size=(5, 3))
    table = jg.TabulatedFlank(TABLE, face, amount, method)
    grid = np.repeat(TABLE, 3), np.tile(face, 5)
    np.testing.assert_allclose(removed(table, *grid), amount.reshape(-1), atol=1e-13)
    columns = [removed(jg.TabulatedProfile(TABLE, column, method=method), RHO) for column in amount.T]
    np.testing.assert_allclose(removed(table, RHO, 3.0), 0.5 * (columns[1] + columns[2]), atol=1e-13)
    np.testing.assert_allclose(removed(table, RHO, 99.0), columns[2], atol=1e-13)
    np.testing.assert_allclose(removed(table, RHO, -99.0), columns[0], atol=1e-13)
    assert table.varies_along_face


@pytest.mark.parametrize("method", [pytest.param("linear", marks=pytest.mark.slow), "natural_cubic", "monotonic"])
def test_derivatives_of_a_flank_table(method):
    """By amounts, roll lengths and face coordinates against central differences, forward and reverse."""
    amount = np.random.default_rng(4).normal(size=(5, 3))
    points = profile(np.linspace(5.2, 11.9, 7), np.linspace(-7.7, 7.1, 7))
    weight = jnp.arange(1.0, 8.0)
    start = jnp.concatenate([jnp.asarray(TABLE), jnp.asarray([-9.0, -2.0, 8.0]), jnp.asarray(amount).reshape(-1)])
    value = lambda x: jg.TabulatedFlank(x[:5], x[5:8], x[8:].reshape(5, 3), method)(points) @ weight  # noqa: E731
    count, unit = len(start), np.eye(len(start))
    around = start[None] + 1e-6 * jnp.asarray(np.concatenate([0 * unit[:1], unit, -unit]))
    both = jax.jit(jax.vmap(lambda x: (*jax.value_and_grad(value)(x), jax.jacfwd(value)(x))))
    values, reverse, forward = map(np.asarray, both(around))
    np.testing.assert_allclose(reverse, forward, rtol=1e-9, atol=1e-12)
    central = (values[1 : count + 1] - values[count + 1 :]) / 2e-6
    np.testing.assert_allclose(reverse[0], central, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: jg.TabulatedFlank([1.0, 2.0], [0.0, 1.0], [[1.0, 2.0]]),
            r"amount has shape \(1, 2\), must be \(2, 2\)",
        ),
        (lambda: jg.TabulatedFlank([1.0, 2.0], [0.0], [[1.0], [2.0]]), "face_coordinate has shape .* at least 2"),
        (lambda: jg.TabulatedFlank([2.0, 1.0], [0.0, 1.0], np.ones((2, 2))), "roll_length must increase strictly"),
        (lambda: jg.TabulatedFlank([1.0, 2.0], [1.0, 1.0], np.ones((2, 2))), "face_coordinate must increase strictly"),
        (lambda: jg.TabulatedFlank([1.0, 2.0], [0.0, 1.0], [1.0, 2.0]), "amount has shape .* must be a table"),
    ],
)
def test_flank_tables_that_are_refused(make, message):
    with pytest.raises(ValueError, match=f"TabulatedFlank: {message}"):
        make()


@pytest.mark.parametrize("method", ["natural_cubic", "monotonic"])
def test_cubic_tables_against_scipy(method):
    """The natural spline, and the shape-preserving cubic of Fritsch and Butland with its end slopes."""
    from scipy.interpolate import CubicSpline, PchipInterpolator

    rng, fine = np.random.default_rng(5), np.linspace(5.0, 12.0, 71)
    rows = np.concatenate([rng.normal(size=(6, 5)), rng.integers(-1, 2, (9, 5)), np.sort(rng.normal(size=(6, 5)))])
    ours = jax.jit(jax.vmap(lambda row: jg.TabulatedProfile(TABLE, row, method=method)(profile(fine))))(rows)
    exact = (
        CubicSpline(TABLE, rows.T, bc_type="natural") if method == "natural_cubic" else PchipInterpolator(TABLE, rows.T)
    )
    np.testing.assert_allclose(ours, exact(fine).T, atol=1e-12)
