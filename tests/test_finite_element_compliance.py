"""Tables of finite-element compliances: what they scale with, what they refuse, how they are kept and exchanged."""

import importlib

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE

import jaxgear as jg
from benchmarks import cases
from jaxgear.compliance import plane_stress_share, write_table
from jaxgear.compliance.finite_element.table_cache import cached
from jaxgear.compliance.tooth import tooth_load
from jaxgear.geometry import outline
from jaxgear.io import DesignFileError, load_design

LOAD = jnp.full((2, 1, 16), 100.0)
making = importlib.import_module("jaxgear.compliance.finite_element.compliance")


def pair(
    teeth=(19, 48), *, module=3.0, modulus=206e3, poisson=0.3, face_width=18.0, distance=None, shift=0.0, bore=None
):
    """Bores of half the root diameter, which grow with the module, where none is given."""
    material = jg.Material(modulus, poisson)
    pinion, wheel = (
        jg.Gear(z, module, profile_shift=x, face_width=face_width, bore_diameter=bore, material=material)
        for z, x in zip(teeth, (shift, 0.0))
    )
    return jg.GearPair(pinion, wheel, distance)


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    """Of a user's cache."""
    return tmp_path_factory.mktemp("tables")


@pytest.fixture(scope="module")
def folder(home):
    """Where tables are kept unless another place is given."""
    return home / "jaxgear" / "compliance"


@pytest.fixture(scope="module")
def tabulated(folder):
    return jg.finite_element_compliance(pair(), "auto", cache=folder)


def prepared(gears, compliance):
    return jg.prepare(gears, compliance=compliance, resolution=LINE)


def softness(compliance, **numbers):
    """One number that everything in the mesh goes into."""
    mesh = prepared(pair(**numbers), compliance)
    weights = jnp.cos(jnp.arange(mesh.structure.size, dtype=float)).reshape(mesh.structure.shape)
    return jnp.sum(weights * mesh.structure) + mesh.hub + jnp.mean(mesh.law.secant(LOAD))


@pytest.fixture(scope="module")
def usual(tabulated):
    return prepared(pair(), tabulated)


@eqx.filter_jit
def structure_of(compliance, gears, mesh):
    loads = (
        tooth_load(outline(gear), side.contact_roll_length[:, 0])
        for gear, side in zip((gears.pinion, gears.wheel), mesh.sides)
    )
    return jnp.sum(compliance.structure(*loads), axis=0)


def test_unmodified_gears_deflect_as_in_the_reference(folder):
    """Tooth, body and depth term come from one program, the reference from another."""
    case = cases.Case("A", "stress", 50.0, "none")
    gears = cases.gear_pair("A")
    compliance = jg.finite_element_compliance(gears, "stress", cache=folder)
    cycle = jg.solve(prepared(gears, compliance), 50.0)
    found, true = np.asarray(cycle.transmission_error), cases.reference(case).transmission_error[::8]
    assert found.mean() == pytest.approx(true.mean(), rel=2e-3)
    assert np.ptp(found) == pytest.approx(np.ptp(true), rel=1e-2)
    assert bool(cycle.converged.all())


@pytest.mark.slow
def test_a_table_serves_every_size_and_modulus(tabulated, usual, folder):
    large = prepared(pair(module=8.0, face_width=48.0, modulus=103e3), tabulated)
    np.testing.assert_allclose(large.structure, 2 * usual.structure, rtol=1e-9)
    assert float(large.hub) == pytest.approx(2 * float(usual.hub), rel=1e-12)
    made = jg.finite_element_compliance(pair(module=8.0, face_width=48.0, modulus=103e3), "auto", cache=folder)
    np.testing.assert_allclose(prepared(pair(), made).structure, usual.structure, rtol=1e-9)


def test_the_structure_is_symmetric_definite_and_close_to_the_closed_form(tabulated):
    models = tabulated, jg.default_compliance()
    found, closed = (prepared(pair(), model).structure[:, :, 0] for model in models)
    matrices = np.moveaxis(np.asarray(found), -1, 0)
    np.testing.assert_allclose(matrices, matrices.swapaxes(1, 2), rtol=1e-12)
    np.linalg.cholesky(matrices)
    np.testing.assert_allclose(np.trace(found), np.trace(closed), rtol=0.06)
    hub = float(prepared(pair(), jg.default_compliance()).hub)
    assert float(prepared(pair(), tabulated).hub) == pytest.approx(hub, rel=1e-6)
    # the coupling, which decides on the load sharing, by sign and size: rotation of the body on either side
    np.testing.assert_allclose(found[0, 1] + hub, closed[0, 1] + hub, rtol=0.05)


def test_auto_lies_between_the_planes_by_the_face_width(tabulated, folder):
    gears = pair()
    strain, stress = (
        prepared(gears, jg.finite_element_compliance(gears, plane, cache=folder)) for plane in ("strain", "stress")
    )
    mixed = prepared(gears, tabulated)
    shares = [plane_stress_share(outline(gear), gears.face_width) for gear in (gears.pinion, gears.wheel)]
    low, high = sorted(map(float, shares))
    assert 0.5 < low < high < 0.9
    share = (mixed.structure - strain.structure) / (stress.structure - strain.structure)
    own = np.asarray(jnp.stack([share[i, i] for i in range(2)]))
    assert np.all((own > low - 1e-6) & (own < high + 1e-6))
    np.testing.assert_allclose(mixed.law.secant(LOAD), strain.law.secant(LOAD), rtol=1e-12)


@pytest.mark.slow
def test_derivatives_by_what_a_table_scales_with(tabulated):
    """Module, modulus, face width and centre distance."""
    names, steps = ("module", "modulus", "face_width", "distance"), (1e-6, 1.0, 1e-4, 1e-6)
    point = jnp.asarray([3.0, 206e3, 18.0, 100.6])

    @jax.jit
    @jax.value_and_grad
    def value(numbers):
        return softness(tabulated, **dict(zip(names, numbers)))

    found = value(point)[1]
    for place, step in enumerate(steps):
        move = jnp.zeros(4).at[place].set(step)
        central = (value(point + move)[0] - value(point - move)[0]) / (2 * step)
        assert float(found[place]) == pytest.approx(float(central), rel=2e-6)


@pytest.mark.parametrize("name, value", [("shift", 0.0), ("poisson", 0.3)])
@pytest.mark.parametrize("derivative", [jax.grad, jax.jacfwd])
def test_derivatives_that_a_table_cannot_know_are_refused(tabulated, usual, derivative, name, value):
    key = {"shift": "profile_shift", "poisson": "poisson_ratio"}[name]
    with pytest.raises(ValueError, match=f"^no derivative by {key}: "):
        derivative(lambda number: jnp.sum(structure_of(tabulated, pair(**{name: number}), usual)))(value)


def test_the_module_has_no_derivative_beside_a_bore_in_millimetres(tabulated, usual):
    """Of the gears of the table, with the bore that the pinion has without one being given."""
    bore = 2 * float(pair().pinion.bore_radius)

    def found(module):
        pinion = jg.Gear(19, module, face_width=18.0, bore_diameter=bore)
        return jnp.sum(structure_of(tabulated, jg.GearPair(pinion, pair(module=module).wheel), usual))

    assert float(found(3.0)) == pytest.approx(float(np.sum(usual.structure)), rel=1e-9)
    with pytest.raises(ValueError, match="no derivative by module: .* leave them None"):
        jax.grad(found)(3.0)


@pytest.mark.slow
def test_a_thinner_tooth_is_softer_and_has_a_table_of_its_own(usual, folder):
    """By about as much as beam and ring say, which bend the same outline."""

    def gears(allowance):
        return jg.GearPair(
            *(jg.Gear(teeth, 3.0, face_width=18.0, tooth_thickness_allowance=allowance) for teeth in (19, 48))
        )

    def scaled(pair, module):
        return eqx.tree_at(lambda p: (p.pinion.module, p.wheel.module), pair, (module, module))

    def mean(allowance, compliance):
        return float(np.mean(np.diagonal(structure_of(compliance, gears(allowance), usual))))

    nominal = jg.finite_element_compliance(gears(0.0), "stress", cache=folder)
    with pytest.raises(ValueError, match="pinion tooth_thickness_allowance over module = -0.03 differs from 0 of its"):
        prepared(gears(-90.0), nominal)
    compliance = jg.finite_element_compliance(gears(-90.0), "stress", cache=folder)
    softer = mean(-90.0, compliance) / mean(0.0, nominal) - 1
    closed_form = jg.default_compliance("stress")
    assert softer == pytest.approx(mean(-90.0, closed_form) / mean(0.0, closed_form) - 1, rel=0.25)
    assert softer > 0.005
    value, slope = jax.jvp(
        lambda module: jnp.sum(structure_of(compliance, scaled(gears(-90.0), module), usual)), (3.0,), (1.0,)
    )
    # the allowance does not grow with the module
    assert np.isfinite(value) and np.isnan(slope)


def test_other_gears_than_those_of_the_table(tabulated, usual):
    with pytest.raises(ValueError, match="^pinion teeth = 20 differs from 19 of its table"):
        prepared(pair((20, 48)), tabulated)
    with pytest.raises(ValueError, match="wheel .*bore_diameter over 2 module"):
        prepared(
            eqx.tree_at(lambda p: p.wheel, pair(), jg.Gear(48, 3.0, face_width=18.0, bore_diameter=40.0)), tabulated
        )
    found = jax.jit(lambda shift: structure_of(tabulated, pair(shift=shift), usual))
    assert np.all(np.isnan(found(0.1))) and np.all(np.isfinite(found(0.0)))


def test_traced_gears_have_no_table():
    with pytest.raises(ValueError, match="pair: pinion is traced, must be of concrete numbers"):
        jax.jit(lambda module: jg.finite_element_compliance(pair(module=module)).plane)(3.0)
    with pytest.raises(ValueError, match="plane = 'plain' must be"):
        jg.finite_element_compliance(pair(), "plain")


def shape_of_first(gears):
    return making.Shape(*map(float, making.shape_of(gears.pinion, "stress"))).rounded()


def test_a_kept_table_is_the_same_and_a_damaged_one_is_made_again(folder, tmp_path, monkeypatch):
    gears, made = pair(), []
    gears = jg.GearPair(gears.pinion, gears.pinion)
    numbers = cached(folder, shape_of_first(gears), making.build)
    monkeypatch.setattr(making, "build", lambda shape: made.append(shape) or numbers)
    first = jg.finite_element_compliance(gears, "stress", cache=tmp_path)
    assert len(made) == 1  # two gears of one shape
    assert eqx.tree_equal(first, jg.finite_element_compliance(gears, "stress", cache=tmp_path)) and len(made) == 1
    (file,) = tmp_path.iterdir()
    file.write_bytes(file.read_bytes()[:-5])
    assert eqx.tree_equal(first, jg.finite_element_compliance(gears, "stress", cache=tmp_path)) and len(made) == 2
    assert eqx.tree_equal(first, jg.finite_element_compliance(gears, "stress", cache=None)) and len(made) == 4
    with pytest.raises(ValueError, match="^cache = "):
        jg.finite_element_compliance(gears, "stress", cache=file / "below")


def test_a_written_table_is_read_as_it_was(usual, folder, tmp_path):
    gears, path = pair(), tmp_path / "pinion.csv"
    made = jg.finite_element_compliance(gears, "strain", cache=folder)
    write_table(path, made.pinion[0])
    read = jg.finite_element_compliance(gears, "strain", pinion_table=path, cache=folder)
    assert eqx.tree_equal(read, made)
    # one table stands for all planes
    one = jg.finite_element_compliance(gears, "auto", pinion_table=path, cache=folder)
    assert len(one.pinion) == 1 and len(one.wheel) == 2
    assert np.all(np.isfinite(structure_of(one, gears, usual)))


TABLE = """kind,neighbour,loaded_mm,displaced_mm,um_mm_per_N
center,,4,,0.02
center,,6,,0.03
center,,8,,0.04
center,,10,,0.06
hub,,,,0.005
"""
BESIDE = "".join(
    f"neighbour,{k},{x},{y},{0.01 + 1e-4 * k * (x - y)}\n"
    for k in (1, -1)
    for x in (4, 6, 8, 10)
    for y in (4, 6, 8, 10)
)


def test_a_table_of_another_program_needs_no_more_than_it_knows(tmp_path, folder):
    path = tmp_path / "rim.csv"
    path.write_text(TABLE + BESIDE)
    (table,) = jg.finite_element_compliance(pair(), "stress", pinion_table=path, cache=folder).pinion
    assert table.neighbours.shape == (1, 4, 4) and float(table.neighbours[0, 0, 3]) == pytest.approx(0.0094)
    assert float(table.modulus) == 206e3 and float(table.module) == 3.0 and not np.any(table.local)
    assert float(table.weights(jnp.asarray(7.0)) @ table.center) == pytest.approx(
        0.034375
    )  # the cubic through four points


@pytest.mark.parametrize(
    "text, problem",
    [
        ("kind,value\n", "line 1: columns must be kind, neighbour"),
        (TABLE.replace("0.03", "x"), "line 3: um_mm_per_N = 'x' must be a finite number"),
        (TABLE.replace(",6,", ",3,"), "line 3: loaded_mm = 3 must be greater than 4"),
        (TABLE.replace("hub", "rub"), "line 6: kind = 'rub' must be one of module"),
        (TABLE + "center,,12\n", "line 7: 3 columns must be 5"),
        (TABLE.replace("0.005", "0.05"), "loaded_mm = 4: .* not positive definite"),
        (TABLE + "neighbour,1,4,5,0.01\n", "line 7: displaced_mm = 5 must be a roll length of center"),
        (TABLE + "neighbour,1,4,6,0.01\n", "neighbour 1: no row for loaded_mm = 4, displaced_mm = 4"),
        (TABLE + BESIDE.replace("neighbour,-1", "neighbour,3"), "neighbour 2: no rows"),
        (TABLE + BESIDE.replace("-1,4,4,0.01", "-1,4,4,0.02"), "neighbours 1 and -1 differ by .* reciprocal"),
    ],
)
def test_tables_that_cannot_be_right_are_refused_by_line(tmp_path, text, problem):
    path = tmp_path / "rim.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=problem) as refused:
        jg.finite_element_compliance(pair(), "stress", pinion_table=path, cache=None)
    assert str(refused.value).startswith(str(path)) and "\n" not in str(refused.value)


DESIGN = """
[pinion]
teeth = 19
module = 2.0
face_width = {width}
profile_shift = {shift}
[wheel]
teeth = 48
module = 2.0
face_width = {width}
[load]
torque = 20.0
[model]
structure = "finite_element"
{model}
[resolution]
positions = 16
pairs = 2
"""


def test_design_files_ask_for_it(tmp_path, home, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(home))
    path = tmp_path / "gear.toml"
    path.write_text(
        DESIGN.format(width='"b"', shift="0.0", model="") + "[variables]\nb = { low = 10.0, high = 20.0 }\n"
    )
    file = load_design(path)
    mesh = file.sweep_mesh(file.resolution())
    narrow, wide = (mesh({"b": jnp.asarray(width)}) for width in (10.0, 20.0))
    assert type(narrow.compliance).__name__ == "TabulatedCompliance"
    # the narrow face is nearer to plane stress, which is softer
    assert np.all(np.diagonal(narrow.structure) > np.diagonal(wide.structure))
    assert bool(jg.solve(narrow, 20.0).converged.all())


@pytest.mark.parametrize(
    "text, problem",
    [
        (
            DESIGN.format(width="20.0", shift='"x"', model="") + "[variables]\nx = { low = 0.0, high = 0.1 }\n",
            "pinion.profile_shift: cannot be a variable with model.structure",
        ),
        (DESIGN.format(width="20.0", shift="0.0", model='tooth = "beam"'), "model.tooth: cannot be combined with"),
        (
            DESIGN.format(width="20.0", shift="0.0", model='pinion_table = "none.csv"'),
            "model.pinion_table: none.csv: No such file or directory",
        ),
        (
            DESIGN.format(width="20.0", shift="0.0", model='wheel_table = "a.csv"').replace(
                "finite_element", "closed_form"
            ),
            "model.wheel_table: has no effect without structure",
        ),
    ],
)
def test_design_files_that_ask_for_what_cannot_be(tmp_path, text, problem):
    path = tmp_path / "gear.toml"
    path.write_text(text)
    with pytest.raises(DesignFileError, match=problem):
        load_design(path)
