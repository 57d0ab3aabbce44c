"""Every engine judges a design under the same conditions, and a sweep takes any variable of the problem."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE, constant_stiffness_mesh, gear_pair
from scipy.stats.mstats import hdquantiles

import jaxgear as jg
from jaxgear.conditions import conditions, joined, ranked, variants
from jaxgear.metrics import Quantity
from jaxgear.numerics.reductions import Max

AMOUNT, TORQUES = 5.0, (30.0, 50.0)


def pair(shift=0.0, distance=None):
    pinion = jg.Gear(teeth=19, module=3.0, face_width=20.0, profile_shift=shift)
    return jg.GearPair(pinion, jg.Gear(teeth=48, module=3.0, face_width=18.0), center_distance=distance)


def design(v):
    return jg.TipRelief(v["amount"], 4.0), None


@pytest.fixture(scope="module")
def mesh():
    return jg.prepare(gear_pair(), resolution=LINE)


@pytest.fixture(scope="module")
def tolerance(mesh):
    return jg.Tolerance.from_class(mesh.pair, 6).without_lead()


def test_every_torque_meets_the_same_gears(mesh, tolerance):
    judged = conditions(mesh, jg.LoadSpectrum(TORQUES), jg.ManufacturedGears(tolerance, 3, 7))
    drawn = jg.ManufacturedGears(tolerance, 3, 7).on(mesh)
    jax.tree.map(np.testing.assert_array_equal, judged.deviations, drawn)
    cases = judged.on(mesh)
    assert cases.count == 6 and cases.weights.tolist() == pytest.approx([1 / 6] * 6)
    for row, torque in enumerate(TORQUES):
        alone = conditions(mesh, torque, jg.ManufacturedGears(tolerance, 3, 7)).on(mesh)
        np.testing.assert_allclose(cases.removed[row], alone.removed[0], atol=1e-12)
    # the pitch deviations of a tooth do not depend on the load: they show that the gears are the same ones
    np.testing.assert_allclose(np.ptp(cases.removed[0] - cases.removed[1], axis=0).max(), 0.0, atol=0.5)


def test_every_case_weighs_as_its_torque(mesh, tolerance):
    """Three parts of the time at the first torque, one at the second: so does every gear that runs under them."""
    load = jg.LoadSpectrum(TORQUES, [3.0, 1.0])
    cases = conditions(mesh, load, jg.ManufacturedGears(tolerance, 3, 7)).on(mesh)
    torques, weights = (
        np.asarray(cases.each(lambda operating_point, removed: operating_point.torque)),
        np.asarray(cases.weights),
    )
    assert weights.shape == torques.shape == (6,)
    for torque, share in zip(TORQUES, (3 / 4, 1 / 4)):
        np.testing.assert_allclose(weights[torques == torque], share / 3, rtol=1e-12)


@pytest.mark.slow
def test_one_quantile_in_every_engine(tolerance):
    mesh = constant_stiffness_mesh(gear_pair(), 300.0, LINE)  # of which every program is a small one
    made = jg.ManufacturedGears(tolerance, 6, 3)
    scatter = jg.monte_carlo(mesh, 50.0, made, pinion=jg.TipRelief(AMOUNT, 4.0), results=("mean_te",))
    plan, measures = jg.VariantList(("amount",), [[AMOUNT]]), (jg.Quantile(0.95), jg.CVaR(0.5))
    table = jg.sweep(mesh, 50.0, design, plan, measures=measures, manufactured=made)
    assert table.results == ("ppte_um_q95", "ppte_um_cvar50")
    bounds = {"amount": (0.0, 10.0)}
    problem = jg.Problem(mesh, 50.0, design, bounds, measure=jg.Quantile(0.95), manufactured=made)
    searched = float(jax.jit(lambda x: problem.score(x).value[0])(jnp.asarray([AMOUNT / 10])))
    expected = float(hdquantiles(np.asarray(scatter.ppte), [0.95])[0])
    assert np.ptp(scatter.ppte) > 0.1
    for found in (scatter.ppte_quantile95, table.column("ppte_um_q95")[0], searched):
        assert float(found) == pytest.approx(expected, rel=1e-9)
    tail = np.sort(scatter.ppte)[-3:].mean()
    assert float(scatter.joined("ppte", jg.CVaR(0.5))) == pytest.approx(tail, rel=1e-9)
    assert table.column("ppte_um_cvar50")[0] == pytest.approx(tail, rel=1e-9)
    assert float(scatter.joined("mean_te", jg.Mean())) == pytest.approx(float(scatter.numbers["mean_te_um"].mean()))
    with pytest.raises(ValueError, match='"max_line_load_N_per_mm" is not among the results'):
        scatter.joined("max_line_load", jg.Mean())


@pytest.mark.parametrize("measure", [jg.Mean(), jg.Worst(), jg.Quantile(0.9), jg.CVaR(0.8)])
def test_host_and_device_join_alike(measure):
    values = np.random.default_rng(0).gamma(2.0, size=40)
    for better in ("smaller", "larger"):
        on_device = float(joined(measure, jnp.asarray(values), jnp.ones(40), better))
        assert float(ranked(measure, values, better)) == pytest.approx(on_device, rel=1e-12)
    values[3] = np.nan  # ranks beyond all others, on the bad side
    worst = float(joined(jg.Worst(), jnp.asarray(values), jnp.ones(40), "larger"))
    assert worst == -np.inf and float(joined(measure, jnp.asarray(values), jnp.ones(40))) == np.inf


@pytest.mark.slow
def test_a_sweep_of_geometry_load_and_flanks_is_a_loop_over_them():
    """Traced through `prepare`; what cannot be is a row that says so, be it the first one."""
    rows = [[AMOUNT, 0.9, 0.0, 50.0], [AMOUNT, 0.0, 0.0, 50.0], [8.0, 0.2, 0.1, 30.0], [8.0, 0.2, 0.0, -30.0]]
    plan = jg.VariantList(("amount", "shift", "wider", "torque"), rows)

    sizes = jg.Resolution(positions=8, pairs=2, contact_nodes=1)

    def mesh_of(v):
        return jg.prepare(pair(v["shift"], 101.8 + v["wider"]), resolution=sizes)

    own = Quantity("peak", lambda cycle: cycle.transmission_error * cycle.torque, "um N m", reduction=Max())
    results = ("ppte", "contact_ratio", own, "max_relief")
    table = jg.sweep(mesh_of, lambda v: v["torque"], design, plan, results=results)
    np.testing.assert_array_equal(table.column("converged"), [False, True, True, False])
    assert np.isnan(table.column("ppte_um")[[0, 3]]).all()
    for row in (1, 2):
        values = dict(zip(plan.names, rows[row]))
        cycle = jg.solve(mesh_of(values), values["torque"], pinion=design(values)[0])
        expected = np.asarray(cycle.transmission_error)
        assert table.column("ppte_um")[row] == pytest.approx(np.ptp(expected), abs=1e-9)
        assert table.column(own.key)[row] == pytest.approx(values["torque"] * expected.max(), rel=1e-9)
        assert table.column("max_relief_um")[row] == pytest.approx(values["amount"], rel=1e-9)


def test_unused_variables_are_named(mesh):
    plan = jg.Sobol({"amount": (0.0, 9.0), "torque": (10.0, 60.0), "lenght": (1.0, 2.0)}, 8, seed=0)
    with pytest.raises(ValueError, match='^nothing depends on "torque", "lenght": use it in design'):
        jg.sweep(mesh, 50.0, design, plan)
    with pytest.raises(ValueError, match='^nothing depends on "lenght"'):
        jg.sweep(mesh, lambda v: v["torque"], design, plan)
    with pytest.raises(ValueError, match='^nothing depends on "lenght": use it in design'):
        jg.minimize(jg.Problem(mesh, 50.0, design, {"amount": (0.0, 9.0), "lenght": (1.0, 2.0)}))


def test_what_has_no_effect_is_refused(mesh):
    plan = jg.VariantList(("amount",), [[AMOUNT]])
    for options, words in (({"measures": (jg.Mean(),)}, "measures have no effect"),):
        with pytest.raises(ValueError, match=words):
            jg.sweep(mesh, 50.0, design, plan, **options)
    with pytest.raises(ValueError, match="mesh gives GearPair, must be a Mesh"):
        jg.sweep(lambda v: pair(), 50.0, design, plan)


def test_a_load_has_a_speed(mesh):
    load = jg.LoadSpectrum([50.0, 50.0], speeds=[1000.0, 2000.0], friction=0.05)
    made = variants(mesh, load, design, names=("amount",), values=(AMOUNT,))
    speeds = made.cases.each(
        lambda operating_point, removed: (operating_point.speed, operating_point.torque * operating_point.friction)
    )
    np.testing.assert_allclose(speeds, [[1000.0, 2000.0], [2.5, 2.5]])
    with pytest.raises(ValueError, match="torques must be different, or their speeds"):
        jg.LoadSpectrum([50.0, 50.0], speeds=1000.0)


CAPPED = {"amount": (0.0, 5.0)}


@pytest.mark.parametrize(
    ("design", "kind", "said"),
    [
        (
            lambda v: (jg.TipRelief(v["amount"], 3.0) if v["amount"] > 1 else None, None),
            TypeError,
            "design: needs the value of a variable (by if, and",
        ),
        (
            lambda v: (jg.TipRelief(v["amuont"], 3.0), None),
            ValueError,
            'design: asks for "amuont", which is not a variable, must be one of amount',
        ),
    ],
)
def test_a_design_that_cannot_be_traced_is_refused_in_one_line(mesh, design, kind, said):
    for call in (
        lambda: jg.sweep(mesh, 50.0, design, jg.Sobol(CAPPED, 8, seed=0)),
        lambda: jg.minimize(jg.Problem(mesh, 50.0, design, CAPPED)),
    ):
        with pytest.raises(kind) as error:
            call()
        assert str(error.value).startswith(said) and "\n" not in str(error.value)


def test_a_key_error_of_the_user_is_left_alone(mesh):
    """One of a dictionary of his own that has a variable's name."""
    with pytest.raises(KeyError, match="amount"):
        jg.sweep(mesh, 50.0, lambda v: ({}["amount"], v["amount"]), jg.Sobol(CAPPED, 8, seed=0))


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: jg.Sobol([("amount", 0.0, 5.0)], 8, seed=0), "bounds is a list, must be a dict such as"),
        (lambda: jg.Sobol({"amount": 5.0}, 8, seed=0), "bounds of amount = 5.0 must be two numbers"),
        (lambda: jg.Sobol({"amount": ("0,5", 6)}, 8, seed=0), "'0,5' must be a number, with a decimal point"),
        (lambda: jg.sweep(None, 50.0, None, [1.0]), "plan is a list, must be FullFactorial"),
    ],
)
def test_a_plan_of_another_type_is_refused_in_one_line(make, said):
    with pytest.raises((TypeError, ValueError)) as error:
        make()
    assert said in str(error.value) and "\n" not in str(error.value)
